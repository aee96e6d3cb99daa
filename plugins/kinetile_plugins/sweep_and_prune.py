"""Sweep-and-prune on one axis: the bounds of all bodies, kept sorted while they move (thesis, section 3.2).

Each body has a lower bound L and an upper bound R, as far from its place as it reaches to either side. The 2n
bounds stand in a list in their order along the axis, and each two neighbours have a certificate: the left one
is not right of the right one. When it fails, they change places and the three gaps around them are scheduled
anew (thesis, figure 9).
Two bodies are a candidate pair while their intervals overlap, which changes only when an R and an L pass::

    R(a) L(b)  ->  L(b) R(a)    the intervals meet: a candidate pair
    L(a) R(b)  ->  R(b) L(a)    the intervals part: no longer one

The gap right of a bound belongs to the bound's body. A body stores when its two gaps close, and schedules
the first of them: one certificate a body, so that the queue holds n entries and not 2n - 1. Each
failure repairs one gap, so the exchanges are those of the thesis, one by one.

The list defines which bound is left. The sign of the relative velocity decides whether a certificate will
fail (``falls``), so no rounded coordinate is ever compared to restore an order that history
has fixed; coordinates are sorted once, at the start, with ties broken by velocity (the order an instant
later), then R before L, then number.

A failure costs O(1), and ``near`` walks the list of a body's pairs. Its weakness is
the number of pairs: 2 r n^2 for n bodies of radius r in a unit box, all of them in the worst case
(thesis, figure 10).

Along a periodic axis the list is a circle (``circular_bounds``). An axis with walls is sorted as here, also
where the other one is periodic: places along that do not matter.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from kinetile.errors import BadOption
from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    BroadPhaseParts,
    Item,
    Kernel,
    Records,
    add_pair,
    falls,
    hook,
    is_there,
    pairs_of,
    positions_now,
    remove_pair,
    schedule,
    since_anchor,
    unchecked,
)

from .circular_bounds import circular_parts
from .sorted_bounds import audit_bounds, audit_lists, draw_line, offset, offsets

PLACE = 2
"""Where the place of a bound stands behind its tick in ``bounds``."""

END = -1
"""What stands in the order before the first bound and behind the last."""


class State(NamedTuple):
    """The sorted list. The bounds of a body are numbered 4 * body for L and 4 * body + 1 for R."""

    order: Records  # (2n + 2,) the bounds from left to right, after one END and before others; n slots
    bounds: Records  # (4n,) when each bound passes the one right of it; at PLACE behind that, where it stands
    axis: Records  # (1,) 0 for x, 1 for y


def arrange(k: Kernel, s: State) -> None:
    """Sorts the bounds as they stand now, and will a moment later."""
    axis = int(s.axis[0])
    place = positions_now(k)[:, axis]
    speed = k.bodies.vy if axis else k.bodies.vx
    body, upper = np.divmod(np.arange(2 * len(place)), 2)
    edge = place[body] + offsets(k)[body, 2 * axis + upper]
    order = np.lexsort((body, 1 - upper, speed[body], edge))
    s.order[:] = END
    s.order[1 : len(order) + 1] = 4 * body[order] + upper[order]
    s.bounds[s.order[1 : len(order) + 1] + PLACE] = 1 + np.arange(len(order))


@hook
def watch(k: Kernel, s: State, left: int, right: int) -> None:
    """Watch the gap between two neighbours, for the body of the left one."""
    p = k.bodies[left >> 2]
    due = NEVER
    if right != END:
        q = k.bodies[right >> 2]
        since = max(p.anchor, q.anchor)
        tick = k.clock[0].tick
        p_time = (since - p.anchor) * tick
        q_time = (since - q.anchor) * tick
        p_away = offset(k, p, 2 * s.axis[0] + (left & 1))
        q_away = offset(k, q, 2 * s.axis[0] + (right & 1))
        if s.axis[0] == 0:
            gap = (q.x + q.vx * q_time + q_away) - (p.x + p.vx * p_time + p_away)
            rate = q.vx - p.vx
        else:
            gap = (q.y + q.vy * q_time + q_away) - (p.y + p.vy * p_time + p_away)
            rate = q.vy - p.vy
        due = falls(k, since, gap, rate)
    s.bounds[left] = due
    schedule(k, left >> 2, min(due, s.bounds[left ^ 1]))


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Watch all gaps; every body whose L stands between the bounds of another makes a pair with it."""
    for body in range(k.clock[0].bodies):
        s.bounds[4 * body] = NEVER
        s.bounds[4 * body + 1] = NEVER
    for place in range(1, 2 * k.clock[0].bodies + 1):
        bound = s.order[place]
        watch(k, s, bound, s.order[place + 1])
        if bound & 1 == 0:
            inside = place + 1
            while s.order[inside] != bound + 1:
                if s.order[inside] & 1 == 0:
                    add_pair(k, bound >> 2, s.order[inside] >> 2)
                inside += 1


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A bound passes the one right of it: exchange them, note whether their intervals meet or part, watch the
    three gaps around."""
    left = 4 * body if s.bounds[4 * body] <= s.bounds[4 * body + 1] else 4 * body + 1
    place = s.bounds[left + PLACE]
    before = s.order[place - 1]
    right = s.order[place + 1]
    after = s.order[place + 2]
    s.order[place] = right
    s.order[place + 1] = left
    s.bounds[right + PLACE] = place
    s.bounds[left + PLACE] = place + 1
    if left & 1 and not right & 1:
        add_pair(k, body, right >> 2)
    elif right & 1 and not left & 1:
        remove_pair(k, body, right >> 2)
    if before != END:
        watch(k, s, before, right)
    watch(k, s, right, left)
    watch(k, s, left, after)
    return 0


@unchecked
@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: watch the gaps on both sides of its two bounds."""
    for bound in range(4 * body, 4 * body + 2):
        place = s.bounds[bound + PLACE]
        if s.order[place - 1] != END:
            watch(k, s, s.order[place - 1], bound)
        watch(k, s, bound, s.order[place + 1])


@hook
def edge(k: Kernel, s: State, bound: int) -> float:
    """Return where a bound is now."""
    body = k.bodies[bound >> 2]
    elapsed = since_anchor(k, body, k.clock[0].now)
    place = body.x + body.vx * elapsed if s.axis[0] == 0 else body.y + body.vy * elapsed
    return float(place + offset(k, body, 2 * s.axis[0] + (bound & 1)))


@hook
def insert_bound(k: Kernel, s: State, bound: int) -> None:
    """Put a bound into the list, right of all that are not right of it; those behind it move up. O(n)."""
    there = edge(k, s, bound)
    place = 1
    while s.order[place] != END:
        place += 1
    while s.order[place - 1] != END and edge(k, s, s.order[place - 1]) > there:
        s.order[place] = s.order[place - 1]
        s.bounds[s.order[place] + PLACE] = place
        place -= 1
    s.order[place] = bound
    s.bounds[bound + PLACE] = place


@hook
def take_bound_out(s: State, bound: int) -> None:
    """Take a bound out of the list; those behind it close the gap. O(n)."""
    place = s.bounds[bound + PLACE]
    while s.order[place] != END:
        after = s.order[place + 1]
        s.order[place] = after
        if after != END:
            s.bounds[after + PLACE] = place
        place += 1


@hook
def watch_left(k: Kernel, s: State, bound: int) -> None:
    """Watch the gap left of a bound."""
    before = s.order[s.bounds[bound + PLACE] - 1]
    if before != END:
        watch(k, s, before, bound)


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """A body comes: its bounds find their places, and whose intervals overlap its own are its pairs."""
    lower = 4 * body
    upper = lower + 1
    s.bounds[lower] = NEVER
    s.bounds[upper] = NEVER
    insert_bound(k, s, lower)
    insert_bound(k, s, upper)
    for bound in range(lower, upper + 1):
        watch_left(k, s, bound)
        watch(k, s, bound, s.order[s.bounds[bound + PLACE] + 1])
    first = s.bounds[lower + PLACE]
    last = s.bounds[upper + PLACE]
    for other in range(k.clock[0].bodies):
        overlaps = s.bounds[4 * other + PLACE] < last and first < s.bounds[4 * other + 1 + PLACE]
        if overlaps and other != body and is_there(k, other):
            add_pair(k, body, other)


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """A body goes, and its pairs with it; the gaps that close behind its bounds are watched."""
    for other in range(pairs_of(k, body)):
        remove_pair(k, body, k.near[other])
    for upper in range(2):
        bound = 4 * body + upper
        before = s.order[s.bounds[bound + PLACE] - 1]
        take_bound_out(s, bound)
        s.bounds[bound] = NEVER
        if before != END:
            watch(k, s, before, s.order[s.bounds[before + PLACE] + 1])


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies whose intervals overlap a body's."""
    return pairs_of(k, body)


def audit(k: Kernel, s: State, pairs: bool = True) -> Iterator[str]:
    """Yields what does not hold of the sorted bounds and the pairs."""
    order = s.order[None, s.order != END].astype(np.int64)
    due, place = s.bounds.reshape(-1, 2, 2).swapaxes(0, 1).reshape(2, 1, -1)
    yield from audit_lists(s.order[None, :], (0,), 4)
    yield from audit_bounds(k, order >> 2 << 1 | order & 1, place - 1, due, (int(s.axis[0]),), pairs)


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws the axis, the bounds on it, and which two pass next."""
    order = s.order[s.order != END].astype(np.int64)
    due = s.bounds.reshape(-1, 2, 2)[:, 0].ravel()
    return draw_line(k, order >> 2 << 1 | order & 1, due, int(s.axis[0]))


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
        """Returns the parts; any scene will do."""
        if self.axis in scene.periodic:
            return circular_parts(scene, (0 if self.axis == "x" else 1,))
        n = scene.capacity
        state = State(
            order=np.full(2 * n + 2, END, dtype=np.int32),
            bounds=np.full(4 * n, NEVER),
            axis=np.array([0 if self.axis == "x" else 1]),
        )
        return BroadPhaseParts(
            state=state,
            near=near,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=replan,
            enter=enter,
            leave=leave,
            room=n,
            audit=audit,
            sound=partial(audit, pairs=False),
            draw=draw,
            drawn_as=f"bounds {self.axis}",
            pairs=4 * n + 64,
            ticks=(state.bounds.reshape(-1, 2, 2)[:, 0],),
            periodic=True,
        )
