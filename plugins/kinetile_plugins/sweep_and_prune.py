"""Sweep-and-prune on one axis: the bounds of all bodies, kept sorted while they move (thesis, section 3.2).

Each body has a lower bound L at p - reach and an upper bound R at p + reach. The 2n bounds stand in a list in
their order along the axis, and one certificate guards each two neighbours: the left one is not right of the
right one. When it fails, the two change places and the three certificates around them are made anew (thesis,
figure 9). Two bodies are a candidate pair while their intervals overlap, which changes only when an R and an
L pass::

    R(a) L(b)  ->  L(b) R(a)    the intervals meet: a candidate pair
    L(a) R(b)  ->  R(b) L(a)    the intervals part: no longer one

Which bound is left is what the list says. Whether a certificate will fail is decided by the sign of the
relative velocity (``falls``), so no rounded coordinate is ever compared to restore an order that history
already knows; coordinates are sorted once, at the start, with ties broken by velocity (the order an instant
later), then R before L, then number.

Certificates 2n - 1; a body is in at most four; each failure costs O(log n). What it cannot avoid is the width
of its net: 2 r n^2 pairs for n bodies of radius r in a unit box, all of them in the worst case (thesis,
figure 10).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from kinetile.errors import BadOption
from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    BroadPhaseParts,
    Kernel,
    Records,
    add_pair,
    falls,
    hook,
    pairs_of,
    positions_now,
    remove_pair,
    schedule,
)

from .bounds_audit import audit_bounds

__all__ = ["SweepAndPrune"]


class State(NamedTuple):
    """The sorted list; a bound is 2 * body for L, 2 * body + 1 for R."""

    order: Records  # (2n,) the bounds from left to right
    rank: Records  # (2n,) where each bound stands in the order
    due: Records  # (2n,) the tick at which each bound passes the one right of it
    axis: Records  # (1,) 0 for x, 1 for y


def arrange(k: Kernel, s: State) -> None:
    """Sort the bounds as they stand now, and will a moment later."""
    axis = int(s.axis[0])
    place = positions_now(k)[:, axis]
    speed = k.bodies.vy if axis else k.bodies.vx
    bound = np.arange(len(s.order))
    body, upper = bound >> 1, bound & 1
    edge = place[body] + np.where(upper == 1, k.bodies.reach[body], -k.bodies.reach[body])
    s.order[:] = np.lexsort((body, 1 - upper, speed[body], edge))
    s.rank[s.order] = bound


@hook
def passes(k: Kernel, s: State, left: int, right: int) -> int:
    """Return the tick at which a bound passes its right neighbour."""
    p = k.bodies[left >> 1]
    q = k.bodies[right >> 1]
    since = max(p.anchor, q.anchor)
    tick = k.clock[0].tick
    p_time = (since - p.anchor) * tick
    q_time = (since - q.anchor) * tick
    p_reach = p.reach if left & 1 else -p.reach
    q_reach = q.reach if right & 1 else -q.reach
    if s.axis[0] == 0:
        gap = (q.x + q.vx * q_time + q_reach) - (p.x + p.vx * p_time + p_reach)
        rate = q.vx - p.vx
    else:
        gap = (q.y + q.vy * q_time + q_reach) - (p.y + p.vy * p_time + p_reach)
        rate = q.vy - p.vy
    return falls(k, since, gap, rate)


@hook
def watch(k: Kernel, s: State, gap: int) -> None:
    """Watch the gap right of a place, for the body whose bound stands there."""
    left = s.order[gap]
    s.due[left] = passes(k, s, left, s.order[gap + 1]) if gap + 1 < len(s.order) else NEVER
    body = left >> 1
    schedule(k, body, min(s.due[2 * body], s.due[2 * body + 1]))


@hook
def build(k: Kernel, s: State) -> None:
    """Watch all gaps; every body whose L stands between the bounds of another makes a pair with it."""
    for place in range(len(s.order)):
        s.due[place] = NEVER
    for place in range(len(s.order)):
        watch(k, s, place)
        bound = s.order[place]
        if bound & 1 == 0:
            inside = place + 1
            while inside < len(s.order) and s.order[inside] != bound + 1:
                if s.order[inside] & 1 == 0:
                    add_pair(k, bound >> 1, s.order[inside] >> 1)
                inside += 1


@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A bound passes the one right of it: exchange them, note whether their intervals meet or part, watch the
    three gaps around."""
    left = 2 * body if s.due[2 * body] <= s.due[2 * body + 1] else 2 * body + 1
    place = s.rank[left]
    right = s.order[place + 1]
    s.order[place] = right
    s.order[place + 1] = left
    s.rank[right] = place
    s.rank[left] = place + 1
    if left & 1 and not right & 1:
        add_pair(k, body, right >> 1)
    elif right & 1 and not left & 1:
        remove_pair(k, body, right >> 1)
    for gap in range(max(place - 1, 0), place + 2):
        watch(k, s, gap)
    return 0


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: watch the gaps on both sides of its two bounds."""
    for side in range(4):
        gap = s.rank[2 * body + (side >> 1)] - (side & 1)
        if gap >= 0:
            watch(k, s, gap)


@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies whose intervals overlap a body's."""
    return pairs_of(k, body)


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yield what does not hold of the sorted bounds and the pairs."""
    return audit_bounds(k, s.order[None], s.rank[None], (int(s.axis[0]),))


class SweepAndPrune:
    """Sweep-and-prune on one axis, x or y.

    Args:
        axis: the axis along which bounds are sorted, "x" (default) or "y".
    """

    def __init__(self, *, axis: str = "x") -> None:
        if axis not in ("x", "y"):
            raise BadOption(f"sap-1d sorts along one axis: axis must be 'x' or 'y', not {axis!r}")
        self.axis = axis

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Return the parts; any scene will do."""
        n = len(scene)
        place = scene.position[:, 0 if self.axis == "x" else 1]
        left, right = np.sort(place - scene.radius), np.sort(place + scene.radius)
        overlapping = int(np.searchsorted(left, right).sum()) - n * (n + 1) // 2
        state = State(
            order=np.zeros(2 * n, dtype=np.int32),
            rank=np.zeros(2 * n, dtype=np.int32),
            due=np.full(2 * n, NEVER),
            axis=np.array([0 if self.axis == "x" else 1]),
        )
        return BroadPhaseParts(
            state=state,
            near=near,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=replan,
            audit=audit,
            pairs=overlapping + overlapping // 4 + 64,
            ticks=(state.due,),
        )
