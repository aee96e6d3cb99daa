"""Sweep-and-prune: the bounds of all bodies, kept sorted while they move, on one axis or on both (thesis,
section 3.2 and appendix A.4).

On an axis each body has a lower bound L and an upper bound R, as far from its place as it reaches to either
side. The 2n bounds are in a list in their order, and each two neighbours have a certificate: the left one is
not right of the right one. When it fails, they change places and the three gaps around them are scheduled
again (thesis, figure 9). Two intervals overlap until an R and an L pass::

    R(a) L(b)  ->  L(b) R(a)    the intervals meet
    L(a) R(b)  ->  R(b) L(a)    the intervals part

``sap-1d`` sorts one axis, and its candidate pairs are the bodies whose intervals overlap there. ``sap-2d``
sorts both, and its pairs are those whose boxes overlap. When two intervals meet on one axis, the answer
depends on the other one; the thesis keeps a matrix for that, with the number of axes on which each two bodies
overlap (figure 8). Here the two lists are the matrix: the places of four bounds say whether two bodies
overlap on an axis, so memory is O(n + overlaps) where a stored matrix needs n^2.

The list defines which bound is left. The sign of the relative velocity decides whether a certificate will
fail (``falls``), so no rounded coordinate is ever compared to restore an order that history has fixed;
coordinates are sorted once, at the start, with ties broken by velocity (the order an instant later), then R
before L, then number.

A body owns the gaps behind its bounds, and schedules the first of them to close: one certificate a body, so
that the queue holds n entries. Each failure repairs one gap, so the exchanges are those of the thesis, one by
one. Ticks and places of a body are eight numbers side by side, a cache line. A failure costs O(1), and
``near`` walks the list of a body's pairs. The weakness of one axis is the number of pairs: 2 r n^2 for n
bodies of radius r in a unit box, all of them in the worst case (figure 10). Two axes have twice the events
and about 0.6 n pairs in a dense gas, and in the worst case all pairs as well (figure 11).

**Periodic axes.** The images of all bounds are on an endless line, and repeat after a period. The list of
an axis holds one image of each bound, a period of the line, and its last bound has the first one behind it, a
period further right. That gap is watched like any other. When it closes, the two exchange, and the list holds
from then on the image of one that is a period further left, and of the other that is one further right. So a
border is no event. Places are counted on that line, ``TURN`` of them to a period. The place that is kept of a
bound is that of the image whose body is at its unwrapped place; the one in the list is whole turns away::

    place of a bound = slot in the list + TURN * periods from the bound in the list to the unwrapped one

Differences of places say all that is needed, so places may overflow. Through how many images two bodies
overlap along an axis is read off four of them. A pair is held once for each image through which two boxes
overlap. A body's own images are no pairs: their gap never changes. An axis with walls has a list with two
ends, and places below ``TURN``, so all of this holds there too.

The hooks are made for a choice of sorted axes and for scenes with or without periodic ones, which are
constants in them: the compiled loop has no code for the rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

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
    larger,
    pairs_of,
    positions_now,
    remove_pair,
    schedule,
    since_anchor,
    smaller,
    unchecked,
)

from .sorted_bounds import Lists, audit_bounds, draw_bounds, offset, offsets

PLACE = 4
"""How far the place of a bound is behind its tick in ``bounds``."""

END = -1
"""The entry of the order before the first bound of an axis and behind the last."""

BITS = 28
TURN = 1 << BITS
"""Places in a period of the endless line: more than the list has slots."""


class State(NamedTuple):
    """The sorted lists. A body's bounds are numbered 8 * body + 0 to 3: L and R on x, L and R on y."""

    order: Records  # for each sorted axis 2n + 2: the bounds from left to right, after one END and before
    # others; n slots
    bounds: Records  # (8n,) when each bound passes the one after it; at PLACE behind that, its place
    span: Records  # (2,) of a body's four bounds, the first that is sorted, and the one behind the last


def arrange(k: Kernel, s: State) -> None:
    """Sorts the bounds of each axis as they are now, and will be a moment later."""
    place, torus = positions_now(k), k.clock[0].torus
    s.order[:] = END
    body, upper = np.divmod(np.arange(2 * len(place)), 2)
    away = offsets(k)
    for at, axis in enumerate(_axes(s)):
        speed, period, per = ((k.bodies.vx, torus.x, torus.per_x), (k.bodies.vy, torus.y, torus.per_y))[axis]
        edge = place[body, axis] + away[body, 2 * axis + upper]
        turns = np.floor(edge * per).astype(np.int64)
        order = np.lexsort((body, 1 - upper, speed[body], edge - turns * period))
        slots = 1 + at * (len(s.order) >> 1) + np.arange(len(order))
        s.order[slots] = 8 * body[order] + 2 * axis + upper[order]
        if period:
            turns += (k.images.ky if axis else k.images.kx)[body]
        s.bounds[s.order[slots] + PLACE] = slots + turns[order] * TURN


@cache
def _hooks(first: int, end: int, circular: bool) -> dict[str, Any]:
    """Returns the hooks, by their names.

    Args:
        first: the first of a body's four bounds that is sorted.
        end: the one behind the last.
        circular: whether an axis of the scene is periodic.
    """
    both = end - first == 4

    @hook
    def period_of(k: Kernel, bound: int) -> float:
        """Return the period of a bound's axis, or 0."""
        if not circular:
            return 0.0
        torus = k.clock[0].torus
        return float(torus.x if bound & 2 == 0 else torus.y)

    @hook
    def slot_of(s: State, bound: int) -> int:
        """Return the slot of a bound in the order."""
        return int(s.bounds[bound + PLACE] & (TURN - 1)) if circular else int(s.bounds[bound + PLACE])

    @hook
    def first_slot(s: State, bound: int) -> int:
        """Return the slot of the first bound of an axis in the order."""
        return 1 + (len(s.order) >> 1) if both and bound & 2 else 1

    @hook
    def before(k: Kernel, s: State, bound: int) -> int:
        """Return the bound left of a bound, or END. All bodies that are present have their bounds in the
        list."""
        slot = slot_of(s, bound)
        left = s.order[slot - 1]
        if circular and left == END and period_of(k, bound) > 0.0:
            left = s.order[slot + 2 * k.clock[0].present - 1]
        return int(left)

    @hook
    def behind(k: Kernel, s: State, bound: int) -> int:
        """Return the bound right of a bound, or END."""
        right = s.order[slot_of(s, bound) + 1]
        if circular and right == END and period_of(k, bound) > 0.0:
            right = s.order[first_slot(s, bound)]
        return int(right)

    @hook
    def edge(k: Kernel, bound: int, at: int) -> float:
        """Return where a bound is at a tick, by the place of its body's plan."""
        body = k.bodies[bound >> 3]
        elapsed = since_anchor(k, body, at)
        place = body.x + body.vx * elapsed if bound & 2 == 0 else body.y + body.vy * elapsed
        return float(place + offset(k, body, bound & 3))

    @hook
    def gap_between(k: Kernel, s: State, left: int, right: int, at: int) -> float:
        """Return how far the first image of a bound that is behind another one in the order is right of
        it."""
        gap = edge(k, right, at) - edge(k, left, at)
        if circular:
            one = k.images[left >> 3]
            other = k.images[right >> 3]
            taken_off = other.kx - one.kx if left & 2 == 0 else other.ky - one.ky
            away = s.bounds[left + PLACE] - s.bounds[right + PLACE] + taken_off * TURN
            gap += ((away >> BITS) + 1) * period_of(k, left)
        return float(gap)

    @hook
    def watch(k: Kernel, s: State, left: int, right: int) -> None:
        """Watch the gap between two neighbours on an axis, for the body of the left one."""
        due = NEVER
        if right != END:
            p = k.bodies[left >> 3]
            q = k.bodies[right >> 3]
            since = larger(p.anchor, q.anchor)
            rate = q.vx - p.vx if left & 2 == 0 else q.vy - p.vy
            due = falls(k, since, gap_between(k, s, left, right, since), rate)
        s.bounds[left] = due
        own = left & -4
        soonest = smaller(s.bounds[own + first], s.bounds[own + first + 1])
        if both:
            soonest = smaller(soonest, smaller(s.bounds[own + 2], s.bounds[own + 3]))
        schedule(k, left >> 3, soonest)

    @hook
    def overlaps(s: State, one: int, other: int) -> int:
        """Return through how many images two bodies overlap on an axis, given their Ls there: on one that is
        not sorted, one.

        Those are the whole turns by which the second can be moved for its R to be right of the first one's L,
        and its L left of the first one's R.
        """
        if not both and (one & 2) != first:
            return 1
        one += PLACE
        other += PLACE
        if not circular:
            return int(s.bounds[one] < s.bounds[other + 1] and s.bounds[other] < s.bounds[one + 1])
        most = s.bounds[one + 1] - s.bounds[other]
        least = s.bounds[one] - s.bounds[other + 1]
        return int((most - (least & -TURN)) >> BITS)

    @hook
    def holds(s: State, a: int, b: int) -> int:
        """Return through how many images the boxes of two bodies overlap."""
        return overlaps(s, 8 * a, 8 * b) * overlaps(s, 8 * a + 2, 8 * b + 2)

    @unchecked
    @hook
    def build(k: Kernel, s: State) -> None:
        """Watch all gaps; hold a pair once for every L of another body between the bounds of one, on the
        first sorted axis, and every image through which the two overlap on the other."""
        for body in range(k.clock[0].bodies):
            for bound in range(8 * body, 8 * body + 4):
                s.bounds[bound] = NEVER
        for body in range(k.clock[0].bodies):
            for bound in range(8 * body + first, 8 * body + end):
                watch(k, s, bound, behind(k, s, bound))
            lower = 8 * body + first
            steps = slot_of(s, lower + 1) - slot_of(s, lower)
            if circular:
                turns = (s.bounds[lower + 1 + PLACE] - (s.bounds[lower + PLACE] & -TURN)) >> BITS
                steps += 2 * k.clock[0].present * turns
            inside = lower
            for _ in range(steps):
                inside = behind(k, s, inside)
                if inside & 1 == 0 and inside != lower:
                    for _ in range(overlaps(s, lower ^ 2, inside ^ 2)):
                        add_pair(k, body, inside >> 3)

    @unchecked
    @hook
    def repair(k: Kernel, s: State, body: int) -> int:
        """A bound passes the one behind it on its axis: exchange them, compare the other axis, watch the
        three gaps around."""
        left = 8 * body + first
        for bound in range(left + 1, left + end - first):
            if s.bounds[bound] < s.bounds[left]:
                left = bound
        right = behind(k, s, left)
        here = slot_of(s, left)
        there = slot_of(s, right)
        step = there - here
        if circular and step < 0:  # the link from the last to the first
            step += TURN
        s.order[here] = right
        s.order[there] = left
        s.bounds[left + PLACE] += step
        s.bounds[right + PLACE] -= step
        if (left ^ right) & 1:
            for _ in range(overlaps(s, (left ^ 2) & -2, (right ^ 2) & -2)):
                if left & 1:
                    add_pair(k, body, right >> 3)
                else:
                    remove_pair(k, body, right >> 3)
        outer = before(k, s, right)
        if outer != END:
            watch(k, s, outer, right)
        watch(k, s, right, left)
        watch(k, s, left, behind(k, s, left))
        return 0

    @unchecked
    @hook
    def replan(k: Kernel, s: State, body: int) -> None:
        """A body's plan changed: watch the gaps on both sides of its bounds."""
        for bound in range(8 * body + first, 8 * body + end):
            outer = before(k, s, bound)
            if outer != END:
                watch(k, s, outer, bound)
            watch(k, s, bound, behind(k, s, bound))

    @hook
    def insert_bound(k: Kernel, s: State, bound: int) -> None:
        """Put a bound into the list of its axis, right of all that are not right of it; those behind it move
        up. Of its images that one is taken which is less than a period right of the first bound. O(n)."""
        now = k.clock[0].now
        place = first_slot(s, bound)
        head = s.order[place]
        there = edge(k, bound, now)
        turns = 0
        if circular:
            torus = k.clock[0].torus
            image = k.images[bound >> 3]
            turns = image.kx if bound & 2 == 0 else image.ky
            if head != END:
                there -= edge(k, head, now)
                periods = math.floor(there * (torus.per_x if bound & 2 == 0 else torus.per_y))
                there -= periods * period_of(k, bound)
                other = k.images[head >> 3]
                gone = other.kx if bound & 2 == 0 else other.ky
                turns += int(periods) + (s.bounds[head + PLACE] >> BITS) - gone
        while s.order[place] != END:
            place += 1
        while s.order[place - 1] != END:
            left = s.order[place - 1]
            stands = 0.0
            if not circular:
                stands = edge(k, left, now)
            elif left != head:
                stands = gap_between(k, s, head, left, now)
            if stands <= there:
                break
            s.order[place] = left
            s.bounds[left + PLACE] += 1
            place -= 1
        s.order[place] = bound
        s.bounds[bound + PLACE] = place + turns * TURN

    @hook
    def take_bound_out(s: State, bound: int) -> None:
        """Take a bound out of the list of its axis; those behind it close the gap. O(n)."""
        place = slot_of(s, bound)
        while s.order[place] != END:
            after = s.order[place + 1]
            s.order[place] = after
            if after != END:
                s.bounds[after + PLACE] -= 1
            place += 1

    @unchecked
    @hook
    def enter(k: Kernel, s: State, body: int) -> None:
        """A body is inserted: its bounds find their places, and its pairs are the bodies whose intervals or
        boxes overlap its own."""
        for bound in range(8 * body, 8 * body + 4):
            s.bounds[bound] = NEVER
        for bound in range(8 * body + first, 8 * body + end):
            insert_bound(k, s, bound)
        replan(k, s, body)
        for other in range(k.clock[0].bodies):
            if other != body and is_there(k, other):
                for _ in range(holds(s, body, other)):
                    add_pair(k, body, other)

    @unchecked
    @hook
    def leave(k: Kernel, s: State, body: int) -> None:
        """A body is removed, and its pairs with it; the gaps that close behind its bounds are watched."""
        for at in range(pairs_of(k, body)):
            for _ in range(holds(s, body, k.near[at])):
                remove_pair(k, body, k.near[at])
        for bound in range(8 * body + first, 8 * body + end):
            s.bounds[bound] = before(k, s, bound)  # while all are there; its own tick is needed no more
        for bound in range(8 * body + first, 8 * body + end):
            take_bound_out(s, bound)
        for bound in range(8 * body + first, 8 * body + end):
            outer = s.bounds[bound]
            s.bounds[bound] = NEVER
            if outer != END and outer >> 3 != body:
                watch(k, s, outer, behind(k, s, outer))

    made = (build, repair, replan, enter, leave)
    return {each.__name__: each for each in made}


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies whose intervals or boxes overlap a body's."""
    return pairs_of(k, body)


def _axes(s: State) -> range:
    """Returns the sorted axes, 0 and 1."""
    return range(int(s.span[0]) >> 1, int(s.span[1]) >> 1)


def _lists(k: Kernel, s: State) -> Lists:
    """Returns the lists in ``sorted_bounds``'s numbers: a turn is as long as the list, and places count from
    where the body's plan has it."""
    axes = tuple(_axes(s))
    order = s.order.reshape(len(axes), -1)[:, 1 : 1 + 2 * int(k.clock[0].present)].astype(np.int64)
    due, place = s.bounds.reshape(-1, 2, 2, 2)[:, :, axes].transpose(1, 2, 0, 3).reshape(2, len(axes), -1)
    away = place - np.array([[1 + at * (len(s.order) >> 1)] for at in range(len(axes))])
    if len(k.images):
        away -= np.stack([k.images.kx, k.images.ky])[axes, :].repeat(2, axis=1) * TURN
    place = (away & (TURN - 1)) + (away >> BITS) * order.shape[1]
    return Lists(axes, order >> 3 << 1 | order & 1, place, due)


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields what does not hold of the sorted bounds and the pairs."""
    return audit_bounds(k, _lists(k, s))


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws the sorted bounds, and which two pass next."""
    return draw_bounds(k, _lists(k, s))


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
        return _parts(
            scene, 0 if self.axis == "x" else 1, 1, f"bounds {self.axis}", self.axis in scene.periodic
        )


class SweepAndPruneMatrix:
    """Sweep-and-prune on both axes: bounding boxes."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; any scene will do."""
        return _parts(scene, 0, 2, "boxes", bool(scene.periodic))


def _parts(scene: Scene, axis: int, count: int, drawn_as: str, circular: bool) -> BroadPhaseParts:
    """Returns the parts for ``count`` sorted axes from an axis on; ``circular``: one of them is periodic."""
    n, first, end = scene.capacity, 2 * axis, 2 * (axis + count)
    state = State(
        order=np.full(count * (2 * n + 2), END, dtype=np.int32),
        bounds=np.full(8 * n, NEVER),
        span=np.array([first, end]),
    )
    return BroadPhaseParts(
        state=state,
        near=near,
        arrange=arrange,
        **_hooks(first, end, circular),
        room=n,
        audit=audit,
        draw=draw,
        drawn_as="" if circular else drawn_as,
        pairs=4 * n + 64,
        ticks=(state.bounds.reshape(-1, 2, 4)[:, 0],),
        periodic=True,
    )
