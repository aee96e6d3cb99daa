"""Sweep-and-prune on two axes: bounding boxes, with the overlap matrix of the thesis (section 3.2, figure 8;
appendix A.4).

Both axes keep their own sorted list of bounds, as in ``sweep_and_prune``. Two bodies are a candidate pair
while their intervals overlap on x and on y, that is, while their boxes do. When two intervals meet on one
axis, the answer hangs on the other axis; the thesis keeps a matrix for that, with the number of axes on which
each two bodies overlap.

The matrix is kept here as the two lists themselves. The place of each bound in its list says whether two
bodies overlap on that axis, in two comparisons and without looking at a coordinate::

    place of L(a) < place of R(b)   and   place of L(b) < place of R(a)

That is an entry of the matrix, read instead of stored, so memory is O(n + overlaps) where the thesis needs
n^2. And since places change only when a certificate has failed, the pair set changes one pair at a time, like
the matrix would.

A body owns the gaps after its four bounds, and has the kernel wait for the first of them to close. Their
ticks and places are eight numbers side by side, a cache line. Twice the events of one axis, for far fewer
pairs: about 0.6 n instead of 2 r n^2 in a dense gas of discs. Boxes can still overlap without number (thesis,
figure 11).

Where an axis is periodic its list is a circle, and boxes may overlap through several images
(``circular_bounds``).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

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
from .sorted_bounds import Whole, audit_bounds, audit_lists, draw_boxes, offset, offsets

PLACE = 4
"""Where the place of a bound stands behind its tick in ``bounds``."""

END = -1
"""What stands in the order before the first bound of an axis and behind the last."""


class State(NamedTuple):
    """The two sorted lists. A body's bounds are numbered 8 * body + 0 to 3: L and R on x, L and R on y."""

    order: Records  # (4n + 4,) the bounds on x from left to right, then those on y, each list after one END
    # and before others; n slots
    bounds: Records  # (8n,) when each bound passes the one after it; at PLACE behind that, where it stands


def arrange(k: Kernel, s: State) -> None:
    """Sorts the bounds of each axis as they stand now, and will a moment later."""
    place = positions_now(k)
    s.order[:] = END
    body, upper = np.divmod(np.arange(2 * len(place)), 2)
    away = offsets(k)
    for axis, speed in enumerate((k.bodies.vx, k.bodies.vy)):
        edge = place[body, axis] + away[body, 2 * axis + upper]
        order = np.lexsort((body, 1 - upper, speed[body], edge))
        places = 1 + axis * (len(s.order) >> 1) + np.arange(len(order))
        s.order[places] = 8 * body[order] + 2 * axis + upper[order]
        s.bounds[s.order[places] + PLACE] = places


@hook
def watch(k: Kernel, s: State, left: int, right: int) -> None:
    """Watch the gap between two neighbours on an axis, for the body of the left one."""
    due = NEVER
    if right != END:
        p = k.bodies[left >> 3]
        q = k.bodies[right >> 3]
        since = max(p.anchor, q.anchor)
        tick = k.clock[0].tick
        p_time = (since - p.anchor) * tick
        q_time = (since - q.anchor) * tick
        p_away = offset(k, p, left & 3)
        q_away = offset(k, q, right & 3)
        if left & 2 == 0:
            gap = (q.x + q.vx * q_time + q_away) - (p.x + p.vx * p_time + p_away)
            rate = q.vx - p.vx
        else:
            gap = (q.y + q.vy * q_time + q_away) - (p.y + p.vy * p_time + p_away)
            rate = q.vy - p.vy
        due = falls(k, since, gap, rate)
    s.bounds[left] = due
    first = left & -4
    on_x = min(s.bounds[first], s.bounds[first + 1])
    on_y = min(s.bounds[first + 2], s.bounds[first + 3])
    schedule(k, left >> 3, min(on_x, on_y))


@hook
def overlap(s: State, one: int, other: int) -> bool:
    """Read the matrix: whether two bodies overlap on an axis, given their Ls there, from the places of their
    bounds."""
    one += PLACE
    other += PLACE
    return bool(s.bounds[one] < s.bounds[other + 1] and s.bounds[other] < s.bounds[one + 1])


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Watch all gaps on both axes; make a pair of every two bodies that overlap on both."""
    for body in range(k.clock[0].bodies):
        for bound in range(8 * body, 8 * body + 4):
            s.bounds[bound] = NEVER
    for place in range(1, len(s.order) - 1):
        bound = s.order[place]
        if bound != END:
            watch(k, s, bound, s.order[place + 1])
        if bound & 3 == 0:
            inside = place + 1
            while s.order[inside] != bound + 1:
                other = s.order[inside]
                if other & 1 == 0 and overlap(s, bound + 2, other + 2):
                    add_pair(k, bound >> 3, other >> 3)
                inside += 1


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A bound passes the one after it on its axis: exchange them, look at the other axis, watch the three
    gaps around."""
    left = 8 * body
    for bound in range(left + 1, left + 4):
        if s.bounds[bound] < s.bounds[left]:
            left = bound
    place = s.bounds[left + PLACE]
    before = s.order[place - 1]
    right = s.order[place + 1]
    after = s.order[place + 2]
    s.order[place] = right
    s.order[place + 1] = left
    s.bounds[right + PLACE] = place
    s.bounds[left + PLACE] = place + 1
    if (left ^ right) & 1 and overlap(s, (left ^ 2) & -2, (right ^ 2) & -2):
        if left & 1:
            add_pair(k, body, right >> 3)
        else:
            remove_pair(k, body, right >> 3)
    if before != END:
        watch(k, s, before, right)
    watch(k, s, right, left)
    watch(k, s, left, after)
    return 0


@unchecked
@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: watch the gaps on both sides of its four bounds."""
    for bound in range(8 * body, 8 * body + 4):
        place = s.bounds[bound + PLACE]
        if s.order[place - 1] != END:
            watch(k, s, s.order[place - 1], bound)
        watch(k, s, bound, s.order[place + 1])


@hook
def edge(k: Kernel, bound: int) -> float:
    """Return where a bound is now on its axis."""
    body = k.bodies[bound >> 3]
    elapsed = since_anchor(k, body, k.clock[0].now)
    place = body.x + body.vx * elapsed if bound & 2 == 0 else body.y + body.vy * elapsed
    return float(place + offset(k, body, bound & 3))


@hook
def insert_bound(k: Kernel, s: State, bound: int) -> None:
    """Put a bound into the list of its axis, right of all that are not right of it; those behind it move up.
    O(n)."""
    there = edge(k, bound)
    place = 1 + (len(s.order) >> 1 if bound & 2 else 0)
    while s.order[place] != END:
        place += 1
    while s.order[place - 1] != END and edge(k, s.order[place - 1]) > there:
        s.order[place] = s.order[place - 1]
        s.bounds[s.order[place] + PLACE] = place
        place -= 1
    s.order[place] = bound
    s.bounds[bound + PLACE] = place


@hook
def take_bound_out(s: State, bound: int) -> None:
    """Take a bound out of the list of its axis; those behind it close the gap. O(n)."""
    place = s.bounds[bound + PLACE]
    while s.order[place] != END:
        after = s.order[place + 1]
        s.order[place] = after
        if after != END:
            s.bounds[after + PLACE] = place
        place += 1


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """A body comes: its bounds find their places, and whose boxes overlap its own are its pairs."""
    first = 8 * body
    for bound in range(first, first + 4):
        s.bounds[bound] = NEVER
    for bound in range(first, first + 4):
        insert_bound(k, s, bound)
    for bound in range(first, first + 4):
        before = s.order[s.bounds[bound + PLACE] - 1]
        if before != END:
            watch(k, s, before, bound)
        watch(k, s, bound, s.order[s.bounds[bound + PLACE] + 1])
    for other in range(k.clock[0].bodies):
        overlaps = overlap(s, first, 8 * other) and overlap(s, first + 2, 8 * other + 2)
        if overlaps and other != body and is_there(k, other):
            add_pair(k, body, other)


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """A body goes, and its pairs with it; the gaps that close behind its bounds are watched."""
    for other in range(pairs_of(k, body)):
        remove_pair(k, body, k.near[other])
    for bound in range(8 * body, 8 * body + 4):
        before = s.order[s.bounds[bound + PLACE] - 1]
        take_bound_out(s, bound)
        s.bounds[bound] = NEVER
        if before != END:
            watch(k, s, before, s.order[s.bounds[before + PLACE] + 1])


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies whose boxes overlap a body's."""
    return pairs_of(k, body)


def _unpacked(s: State) -> tuple[Whole, Whole, Whole]:
    """Returns for each axis the order, the due ticks and the places, in ``sorted_bounds``'s numbers."""
    order = np.stack([each[each != END] for each in s.order.reshape(2, -1)]).astype(np.int64)
    due, place = s.bounds.reshape(-1, 2, 2, 2).transpose(1, 2, 0, 3).reshape(2, 2, -1)
    return order >> 3 << 1 | order & 1, due, place - np.array([[1], [1 + (len(s.order) >> 1)]])


def audit(k: Kernel, s: State, pairs: bool = True) -> Iterator[str]:
    """Yields what does not hold of the sorted bounds and the pairs."""
    order, due, place = _unpacked(s)
    yield from audit_lists(s.order.reshape(2, -1), (0, 2), 8)
    yield from audit_bounds(k, order, place, due, (0, 1), pairs)


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws the boxes, the pairs of those that overlap, and which two bounds pass next."""
    order, due, place = _unpacked(s)
    return draw_boxes(k, order, place, due)


class SweepAndPruneMatrix:
    """Sweep-and-prune on both axes: bounding boxes."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; any scene will do."""
        if scene.periodic:
            return circular_parts(scene, (0, 1))
        n = scene.capacity
        state = State(
            order=np.full(4 * n + 4, END, dtype=np.int32),
            bounds=np.full(8 * n, NEVER),
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
            drawn_as="boxes",
            pairs=4 * n + 64,
            ticks=(state.bounds.reshape(-1, 2, 4)[:, 0],),
        )
