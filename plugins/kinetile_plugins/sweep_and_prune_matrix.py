"""Sweep-and-prune on two axes: bounding boxes, with the overlap matrix of the thesis (section 3.2, figure 8;
appendix A.4).

Both axes keep their own sorted list of bounds, as in ``sweep_and_prune``. Two bodies are a candidate pair
while their intervals overlap on x and on y, that is, while their boxes do. When two intervals meet on one
axis, the answer hangs on the other axis; the thesis keeps a matrix for that, with the number of axes on which
each two bodies overlap.

The matrix is kept here as the two lists themselves. Where each bound stands in its list, its rank, says
whether two bodies overlap on that axis, in two comparisons and without looking at a coordinate::

    rank of L(a) < rank of R(b)   and   rank of L(b) < rank of R(a)

That is an entry of the matrix, read instead of stored, so memory is O(n + overlaps) where the thesis needs
n^2. And since ranks change only when a certificate has failed, the pair set changes one pair at a time, like
the matrix would.

Certificates 4n - 2; a body is in at most eight. Twice the events of one axis, for far fewer pairs: about 0.6
n instead of 2 r n^2 in a dense gas of discs. Boxes can still overlap without number (thesis, figure 11).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

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

__all__ = ["SweepAndPruneMatrix"]


class State(NamedTuple):
    """The two sorted lists, row 0 for x, row 1 for y; a bound is 2 * body for L, 2 * body + 1 for R."""

    order: Records  # (2, 2n) the bounds in order
    rank: Records  # (2, 2n) where each bound stands
    due: Records  # (n, 4) when L and R on x, L and R on y pass the bound after them


def arrange(k: Kernel, s: State) -> None:
    """Sort the bounds of each axis as they stand now, and will a moment later."""
    place = positions_now(k)
    bound = np.arange(s.order.shape[1])
    body, upper = bound >> 1, bound & 1
    reach = np.where(upper == 1, k.bodies.reach[body], -k.bodies.reach[body])
    for axis, speed in enumerate((k.bodies.vx, k.bodies.vy)):
        s.order[axis] = np.lexsort((body, 1 - upper, speed[body], place[body, axis] + reach))
        s.rank[axis, s.order[axis]] = bound


@hook
def passes(k: Kernel, axis: int, left: int, right: int) -> int:
    """Return the tick at which a bound passes the one after it on an axis."""
    p = k.bodies[left >> 1]
    q = k.bodies[right >> 1]
    since = max(p.anchor, q.anchor)
    tick = k.clock[0].tick
    p_time = (since - p.anchor) * tick
    q_time = (since - q.anchor) * tick
    p_reach = p.reach if left & 1 else -p.reach
    q_reach = q.reach if right & 1 else -q.reach
    if axis == 0:
        gap = (q.x + q.vx * q_time + q_reach) - (p.x + p.vx * p_time + p_reach)
        rate = q.vx - p.vx
    else:
        gap = (q.y + q.vy * q_time + q_reach) - (p.y + p.vy * p_time + p_reach)
        rate = q.vy - p.vy
    return falls(k, since, gap, rate)


@hook
def watch(k: Kernel, s: State, axis: int, place: int) -> None:
    """Watch the gap after a place in the list of an axis, for the body whose bound stands there."""
    left = s.order[axis, place]
    body = left >> 1
    due = NEVER
    if place + 1 < s.order.shape[1]:
        due = passes(k, axis, left, s.order[axis, place + 1])
    s.due[body, 2 * axis + (left & 1)] = due
    schedule(k, body, min(min(s.due[body, 0], s.due[body, 1]), min(s.due[body, 2], s.due[body, 3])))


@hook
def overlap(s: State, axis: int, a: int, b: int) -> bool:
    """Read the matrix: whether two bodies overlap on an axis, from the ranks of their bounds."""
    return bool(
        s.rank[axis, 2 * a] < s.rank[axis, 2 * b + 1] and s.rank[axis, 2 * b] < s.rank[axis, 2 * a + 1]
    )


@hook
def build(k: Kernel, s: State) -> None:
    """Watch all gaps on both axes; make a pair of every two bodies that overlap on both."""
    bounds = s.order.shape[1]
    for body in range(len(s.due)):
        for gap in range(4):
            s.due[body, gap] = NEVER
    for axis in range(2):
        for place in range(bounds):
            watch(k, s, axis, place)
    for place in range(bounds):
        bound = s.order[0, place]
        if bound & 1 == 0:
            inside = place + 1
            while inside < bounds and s.order[0, inside] != bound + 1:
                other = s.order[0, inside] >> 1
                if s.order[0, inside] & 1 == 0 and overlap(s, 1, bound >> 1, other):
                    add_pair(k, bound >> 1, other)
                inside += 1


@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A bound passes the one after it on its axis: exchange them, look at the other axis, watch the three gaps
    around."""
    first = 0
    for gap in range(1, 4):
        if s.due[body, gap] < s.due[body, first]:
            first = gap
    axis = first >> 1
    left = 2 * body + (first & 1)
    place = s.rank[axis, left]
    right = s.order[axis, place + 1]
    s.order[axis, place] = right
    s.order[axis, place + 1] = left
    s.rank[axis, right] = place
    s.rank[axis, left] = place + 1
    if (left ^ right) & 1 and overlap(s, 1 - axis, body, right >> 1):
        if left & 1:
            add_pair(k, body, right >> 1)
        else:
            remove_pair(k, body, right >> 1)
    for gap in range(max(place - 1, 0), place + 2):
        watch(k, s, axis, gap)
    return 0


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: watch the gaps on both sides of its four bounds."""
    for side in range(8):
        axis = side >> 2
        place = s.rank[axis, 2 * body + (side >> 1 & 1)] - (side & 1)
        if place >= 0:
            watch(k, s, axis, place)


@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies whose boxes overlap a body's."""
    return pairs_of(k, body)


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yield what does not hold of the sorted bounds and the pairs."""
    return audit_bounds(k, s.order, s.rank, (0, 1))


class SweepAndPruneMatrix:
    """Sweep-and-prune on both axes: bounding boxes."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Return the parts; any scene will do."""
        bounds = 2 * len(scene)
        state = State(
            order=np.zeros((2, bounds), dtype=np.int32),
            rank=np.zeros((2, bounds), dtype=np.int32),
            due=np.full((len(scene), 4), NEVER),
        )
        return BroadPhaseParts(
            state=state,
            near=near,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=replan,
            audit=audit,
            pairs=4 * len(scene) + 64,
            ticks=(state.due,),
        )
