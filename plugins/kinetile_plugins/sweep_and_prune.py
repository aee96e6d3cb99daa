"""Sweep-and-prune: the bounds of all bodies, kept sorted while bodies move, on one axis, on both axes, or
along any number of lines of any direction (thesis, section 3.2 and appendix A.4).

On an axis each body has a lower bound L and an upper bound R, as far from the body's place as it reaches to
the two sides. A list holds the 2n bounds in order, and each two neighbours have a certificate: the left bound
is not right of the right one. When a certificate fails, the two bounds are exchanged, and the three gaps
around them are scheduled again (thesis, figure 9). Overlaps change only when an R and an L pass::

    R(a) L(b)  ->  L(b) R(a)    the intervals meet
    L(a) R(b)  ->  R(b) L(a)    the intervals part

``sap-1d`` sorts one axis; its candidate pairs are the bodies whose intervals overlap there. ``sap-2d`` sorts
both axes; its candidate pairs are the bodies whose boxes overlap. When two intervals meet on one axis, the
other axis decides. For this the thesis stores a matrix: for each pair, the number of axes on which they
overlap (figure 8). Here the two lists replace the matrix: the places of four bounds say whether two bodies
overlap on an axis, so memory is O(n + overlaps), while a stored matrix needs n^2. ``sap-k`` has k lists; its
candidate pairs overlap in all of them. ``sap-1d`` and ``sap-2d`` are cases of it.

The list defines the order of bounds. The sign of the relative velocity decides whether a certificate will
fail (``falls``), so no rounded coordinate is ever compared to restore an order that history has fixed.
Coordinates are sorted once, at the start; ties by velocity (the order an instant later), R before L, number.

A body owns the gaps behind its bounds, and schedules the first of them to close: one certificate a body, so
the queue holds n entries. Each failure repairs one gap, so the exchanges are exactly the exchanges of the
thesis. Ticks and places of a body are eight adjacent numbers, a cache line. A failure costs O(1), and
``near`` reads the list of a body's pairs. The weakness of one axis is the number of pairs: 2 r n^2 for n
bodies of radius r in a unit box, all pairs in the worst case (figure 10). Two axes have twice the events and
about 0.6 n pairs in a dense gas, and in the worst case all pairs as well (figure 11).

**Slanted lines.** For whole numbers p and q, a place on the line is (p x + q y) / (|p| + |q|). So it is no
further from 0 than a coordinate is, and has a few more roundings, from projecting places and velocities.
``WIDER`` moves each bound out by as much. Along a slanted line a shape counts as its circle.

**Periodic axes.** The images of all bounds lie on an endless line and repeat after a period. The list of an
axis holds one image of each bound, together one period of the line. Behind its last bound is the first one, a
period further right, and this gap is watched like any other. When it closes, the two bounds are exchanged:
from then on the list holds an image of one that is a period further left, and of the other an image that is a
period further right. So borders are no events. Places count along this line, ``TURN`` to a period. A bound's
stored place is for the image at the body's unwrapped place, whole turns from its place in the list::

    place of a bound = slot in the list + TURN * periods from the bound in the list to the unwrapped one

Only differences of places are read, so places may overflow. Four places give the number of images through
which two bodies overlap along an axis. A pair is held once for each image through which two boxes overlap. A
body is no pair with its own images: their gap never changes. An axis with walls has a list with two ends, and
places below ``TURN``, so all of this holds there too.

The hooks are compiled for a number of lists, along the axes or slanted, and for scenes with or without
periodic axes (``constants``). Directions are in the state, so all sets of k slanted lines share one loop.
"""

import math
import re
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from kinetile.errors import BadOption, Refused
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
    position_at,
    positions_now,
    remove_pair,
    schedule,
    smaller,
    unchecked,
    with_constants,
)

from .sorted_bounds import Lengths, Lists, audit_bounds, draw_bounds, offset, offsets

PLACE = 4
"""The distance in ``bounds`` from the tick of a bound to its place, with up to two lists."""

END = -1
"""The entry of ``order`` before the first bound of an axis, and behind the last."""

BITS = 28
TURN = 1 << BITS
"""Places in a period of the endless line: more than the list has slots."""

WIDER = 1.25
"""The skin along a slanted line, in skins of the scene. Along it, rounding and a shorter unit move each gap
further from zero; with this skin, 2n such gaps still leave room (docs/one-answer.md)."""

AXES = {"x": (1, 0), "y": (0, 1)}
NAMES = {way: name for name, way in AXES.items()}

SIXTEEN = (
    *((1, 0), (5, 1), (5, 2), (3, 2), (1, 1), (2, 3), (2, 5), (1, 5)),
    *((0, 1), (-1, 5), (-2, 5), (-2, 3), (-1, 1), (-3, 2), (-5, 2), (-5, 1)),
)
"""Directions at steps of some 11 degrees, half a turn in all."""


class State(NamedTuple):
    """The sorted lists. With up to two lists, a body's bounds are numbered 8 * body + 0 to 3: L and R on x, L
    and R on y. With up to four lists, the numbers are 16 * body + 0 to 7, and so on."""

    # n slots for bodies, k lists
    order: Records  # 2n + 2 for each list: the bounds from left to right, after one END and before others
    bounds: Records  # (8n,) the tick of each bound to pass the next one; PLACE behind that, its place
    span: Records  # (2,) the first sorted bound of a body, and the one behind its last
    ways: Records  # (2k,) the directions of the lists, whole numbers
    # (4k,) if they are slanted: the shares of x and y in a place; the share of a body's reach in the distance
    # from the body to its bounds, and a constant added to that distance
    lines: Records


def arrange(k: Kernel, s: State) -> None:
    """Sorts the bounds of each axis by their positions now; ties by their positions a moment later."""
    place, clock, first = positions_now(k), k.clock[0], int(s.span[0])
    s.order[:] = END
    body, upper = np.divmod(np.arange(2 * len(place)), 2)
    ways, stride = s.ways.reshape(-1, 2), _stride(int(s.span[1]))
    share = ways / np.abs(ways).sum(axis=1, keepdims=True)
    norm = np.hypot(*share.T)
    if len(s.lines):
        s.lines[:] = np.column_stack([share, norm, (WIDER - norm) * clock.limits.skin]).ravel()
    away = _away(k, s)
    for at, (x, y) in enumerate(share.tolist()):
        speed, period = x * k.bodies.vx + y * k.bodies.vy, x * clock.torus.x + y * clock.torus.y
        edge = (x * place[:, 0] + y * place[:, 1])[body] + away[at]
        turns = np.floor(edge * (x * clock.torus.per_x + y * clock.torus.per_y)).astype(np.int64)
        order = np.lexsort((body, 1 - upper, speed[body], edge - turns * period))
        slots = 1 + at * (len(s.order) // len(ways)) + np.arange(len(order))
        s.order[slots] = stride * body[order] + first + 2 * at + upper[order]
        if period:
            turns += (k.images.ky if y else k.images.kx)[body]
        s.bounds[s.order[slots] + (stride >> 1)] = slots + turns[order] * TURN


def arrange_best(k: Kernel, s: State) -> None:
    """Sorts the bounds along the one of sixteen directions with the fewest expected exchanges: the least mean
    relative speed of two bodies, divided by the spread of the bodies. Contacts turn velocities, so the speed
    along the direction and the mean speed along all have equal weight. The first of equal directions counts,
    so the choice is a function of the present plans."""
    place = positions_now(k)
    costs = np.array([np.inf])
    if len(place) > 1:
        rank = 2.0 * np.arange(len(place)) - (len(place) - 1)
        x, y = np.array(SIXTEEN).T / np.hypot(*np.array(SIXTEEN).T)
        along = np.sort(k.bodies.vx[:, None] * x + k.bodies.vy[:, None] * y, axis=0)
        speeds = (rank[:, None] * along).sum(axis=0)
        spread = np.ptp(place[:, :1] * x + place[:, 1:] * y, axis=0)
        costs = np.full(len(spread), np.inf)
        np.divide(speeds + speeds.mean(), spread, out=costs, where=spread > 0.0)
    s.ways[:] = SIXTEEN[int(np.argmin(costs))]
    arrange(k, s)


def _stride(end: int) -> int:
    """Returns the number of entries of a body in ``bounds``: a power of two."""
    return max(2 * PLACE, 1 << (2 * end - 1).bit_length())


FIRST, BEYOND = 0, 2
"""The first sorted bound of a body, and the one behind its last. This and all constants down to the hooks are
for one list along x; ``_hooks`` replaces them."""

CIRCULAR = SLANTED = False
"""True if an axis of the scene is periodic; True if lists are along lines of any direction, not the axes."""

COUNT, STRIDE, PLACE_AT, SHIFT = 1, 2 * PLACE, PLACE, 3
"""The number of lists; a body's entries in ``bounds``; entries from a tick to its place; log2 STRIDE."""


@hook
def own_list(bound: int) -> int:
    """Returns the number of a bound's list."""
    return (bound & (PLACE_AT - 1)) >> 1


@hook
def along(s: State, bound: int, x: float, y: float) -> float:
    """Returns the share of a vector along the slanted line of a bound's list."""
    at = 4 * own_list(bound)
    return float(s.lines[at] * x + s.lines[at + 1] * y)


@hook
def period_of(k: Kernel, bound: int) -> float:
    """Returns the period of a bound's axis, or 0."""
    if not CIRCULAR:
        return 0.0
    torus = k.clock[0].torus
    return float(torus.x if bound & 2 == 0 else torus.y)


@hook
def slot_of(s: State, bound: int) -> int:
    """Returns the position of a bound in ``order``."""
    return int(s.bounds[bound + PLACE_AT] & (TURN - 1)) if CIRCULAR else int(s.bounds[bound + PLACE_AT])


@hook
def first_slot(s: State, bound: int) -> int:
    """Returns the first position of a bound's list in ``order``."""
    return 1 + own_list(bound) * (len(s.order) // COUNT) if COUNT > 1 else 1


@hook
def before(k: Kernel, s: State, bound: int) -> int:
    """Returns the bound left of a bound, or END; all present bodies have bounds in the list."""
    slot = slot_of(s, bound)
    left = s.order[slot - 1]
    if CIRCULAR and left == END and period_of(k, bound) > 0.0:
        left = s.order[slot + 2 * k.clock[0].present - 1]
    return int(left)


@hook
def behind(k: Kernel, s: State, bound: int) -> int:
    """Returns the bound right of a bound, or END."""
    right = s.order[slot_of(s, bound) + 1]
    if CIRCULAR and right == END and period_of(k, bound) > 0.0:
        right = s.order[first_slot(s, bound)]
    return int(right)


@hook
def edge(k: Kernel, s: State, bound: int, at: int) -> float:
    """Returns the position of a bound at a tick, by the plan of its body."""
    body = k.bodies[bound >> SHIFT]
    x, y = position_at(k, body, at)
    if SLANTED:
        line = 4 * own_list(bound)
        away = s.lines[line + 2] * body.reach + s.lines[line + 3]
        place = along(s, bound, x, y)
        return float(place + away if bound & 1 else place - away)
    return float((x if bound & 2 == 0 else y) + offset(k, body, bound & 3))


@hook
def rate_between(k: Kernel, s: State, left: int, right: int) -> float:
    """Returns the rate of the gap between two bounds of a list. Along a slanted line it is the difference
    of one number of each bound, so it orders any three bounds consistently."""
    p = k.bodies[left >> SHIFT]
    q = k.bodies[right >> SHIFT]
    if SLANTED:
        return along(s, right, q.vx, q.vy) - along(s, left, p.vx, p.vy)
    return float(q.vx - p.vx if left & 2 == 0 else q.vy - p.vy)


@hook
def gap_between(k: Kernel, s: State, left: int, right: int, at: int) -> float:
    """Returns the distance from a bound to the next one in the order: to its first image behind the bound."""
    gap = edge(k, s, right, at) - edge(k, s, left, at)
    if CIRCULAR:
        one = k.images[left >> SHIFT]
        other = k.images[right >> SHIFT]
        taken_off = other.kx - one.kx if left & 2 == 0 else other.ky - one.ky
        away = s.bounds[left + PLACE_AT] - s.bounds[right + PLACE_AT] + taken_off * TURN
        gap += ((away >> BITS) + 1) * period_of(k, left)
    return float(gap)


@hook
def watch(k: Kernel, s: State, left: int, right: int) -> None:
    """Watches the gap between two neighbours on an axis, for the body of the left bound."""
    due = NEVER
    if right != END:
        since = larger(k.bodies[left >> SHIFT].anchor, k.bodies[right >> SHIFT].anchor)
        gap = gap_between(k, s, left, right, since)
        due = falls(k, since, gap, rate_between(k, s, left, right))
    s.bounds[left] = due
    own = left & -PLACE_AT
    soonest = smaller(s.bounds[own + FIRST], s.bounds[own + FIRST + 1])
    for bound in range(own + FIRST + 2, own + BEYOND, 2):
        soonest = smaller(soonest, smaller(s.bounds[bound], s.bounds[bound + 1]))
    schedule(k, left >> SHIFT, soonest)


@hook
def overlaps(s: State, one: int, other: int) -> int:
    """Returns the number of images through which two bodies overlap in a list, given their Ls there.

    It is the number of whole turns that move the second body so that its R is right of the first body's L,
    and its L is left of the first body's R.
    """
    one += PLACE_AT
    other += PLACE_AT
    if not CIRCULAR:
        return int(s.bounds[one] < s.bounds[other + 1] and s.bounds[other] < s.bounds[one + 1])
    most = s.bounds[one + 1] - s.bounds[other]
    least = s.bounds[one] - s.bounds[other + 1]
    return int((most - (least & -TURN)) >> BITS)


@hook
def elsewhere(s: State, one: int, other: int) -> int:
    """Returns the number of images through which two bodies overlap in all lists except their bounds' own."""
    times = 1
    if COUNT == 2:
        times = overlaps(s, (one ^ 2) & -2, (other ^ 2) & -2)
    elif COUNT > 2:
        for bound in range(FIRST, BEYOND, 2):
            if times and bound != one & (PLACE_AT - 2):
                times *= overlaps(s, (one & -STRIDE) + bound, (other & -STRIDE) + bound)
    return times


@hook
def holds(s: State, a: int, b: int) -> int:
    """Returns the number of images through which the intervals of two bodies overlap in all lists."""
    one = STRIDE * a + FIRST
    other = STRIDE * b + FIRST
    return overlaps(s, one, other) * elsewhere(s, one, other)


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Watches all gaps. Holds a pair of bodies once for every L of one between the bounds of the other in the
    first list, times the number of images through which the two overlap in the other lists."""
    for body in range(k.clock[0].bodies):
        for bound in range(STRIDE * body, STRIDE * body + PLACE_AT):
            s.bounds[bound] = NEVER
    for body in range(k.clock[0].bodies):
        for bound in range(STRIDE * body + FIRST, STRIDE * body + BEYOND):
            watch(k, s, bound, behind(k, s, bound))
        lower = STRIDE * body + FIRST
        steps = slot_of(s, lower + 1) - slot_of(s, lower)
        if CIRCULAR:
            turns = (s.bounds[lower + 1 + PLACE_AT] - (s.bounds[lower + PLACE_AT] & -TURN)) >> BITS
            steps += 2 * k.clock[0].present * turns
        inside = lower
        for _ in range(steps):
            inside = behind(k, s, inside)
            if inside & 1 == 0 and inside != lower:
                for _ in range(elsewhere(s, lower, inside)):
                    add_pair(k, body, inside >> SHIFT)


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """Exchanges a bound and the one behind it, which it passes; compares other lists; watches three gaps."""
    left = STRIDE * body + FIRST
    for bound in range(left + 1, left + BEYOND - FIRST):
        if s.bounds[bound] < s.bounds[left]:
            left = bound
    right = behind(k, s, left)
    here = slot_of(s, left)
    there = slot_of(s, right)
    step = there - here
    if CIRCULAR and step < 0:  # the link from the last to the first
        step += TURN
    s.order[here] = right
    s.order[there] = left
    s.bounds[left + PLACE_AT] += step
    s.bounds[right + PLACE_AT] -= step
    if (left ^ right) & 1:
        for _ in range(elsewhere(s, left, right)):
            if left & 1:
                add_pair(k, body, right >> SHIFT)
            else:
                remove_pair(k, body, right >> SHIFT)
    outer = before(k, s, right)
    if outer != END:
        watch(k, s, outer, right)
    watch(k, s, right, left)
    watch(k, s, left, behind(k, s, left))
    return 0


@unchecked
@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """Watches the gaps on both sides of a body's bounds, for its plan changed."""
    for bound in range(STRIDE * body + FIRST, STRIDE * body + BEYOND):
        outer = before(k, s, bound)
        if outer != END:
            watch(k, s, outer, bound)
        watch(k, s, bound, behind(k, s, bound))


@hook
def insert_bound(k: Kernel, s: State, bound: int) -> None:
    """Inserts a bound into the list of its axis, right of all bounds that are not right of it; bounds behind
    it move up. On a periodic axis, inserts its image less than a period right of the first bound. O(n)."""
    now = k.clock[0].now
    place = first_slot(s, bound)
    head = s.order[place]
    there = edge(k, s, bound, now)
    turns = 0
    if CIRCULAR:
        torus = k.clock[0].torus
        image = k.images[bound >> SHIFT]
        turns = image.kx if bound & 2 == 0 else image.ky
        if head != END:
            there -= edge(k, s, head, now)
            periods = math.floor(there * (torus.per_x if bound & 2 == 0 else torus.per_y))
            there -= periods * period_of(k, bound)
            other = k.images[head >> SHIFT]
            gone = other.kx if bound & 2 == 0 else other.ky
            turns += int(periods) + (s.bounds[head + PLACE_AT] >> BITS) - gone
    while s.order[place] != END:
        place += 1
    while s.order[place - 1] != END:
        left = s.order[place - 1]
        stands = 0.0
        if not CIRCULAR:
            stands = edge(k, s, left, now)
        elif left != head:
            stands = gap_between(k, s, head, left, now)
        if stands <= there:
            break
        s.order[place] = left
        s.bounds[left + PLACE_AT] += 1
        place -= 1
    s.order[place] = bound
    s.bounds[bound + PLACE_AT] = place + turns * TURN


@hook
def take_bound_out(s: State, bound: int) -> None:
    """Removes a bound from the list of its axis; bounds behind it move down. O(n)."""
    place = slot_of(s, bound)
    while s.order[place] != END:
        after = s.order[place + 1]
        s.order[place] = after
        if after != END:
            s.bounds[after + PLACE_AT] -= 1
        place += 1


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """Inserts a body: its bounds into the lists, and a pair for each body that overlaps it."""
    for bound in range(STRIDE * body, STRIDE * body + PLACE_AT):
        s.bounds[bound] = NEVER
    for bound in range(STRIDE * body + FIRST, STRIDE * body + BEYOND):
        insert_bound(k, s, bound)
    replan(k, s, body)
    for other in range(k.clock[0].bodies):
        if other != body and is_there(k, other):
            for _ in range(holds(s, body, other)):
                add_pair(k, body, other)


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """Removes a body and its pairs; watches the gaps left behind by its bounds."""
    for at in range(pairs_of(k, body)):
        for _ in range(holds(s, body, k.near[at])):
            remove_pair(k, body, k.near[at])
    for bound in range(STRIDE * body + FIRST, STRIDE * body + BEYOND):
        s.bounds[bound] = before(k, s, bound)  # while all are present; its own tick is no longer needed
    for bound in range(STRIDE * body + FIRST, STRIDE * body + BEYOND):
        take_bound_out(s, bound)
    for bound in range(STRIDE * body + FIRST, STRIDE * body + BEYOND):
        outer = s.bounds[bound]
        s.bounds[bound] = NEVER
        if outer != END and outer >> SHIFT != body:
            watch(k, s, outer, behind(k, s, outer))


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Names the bodies whose intervals or boxes overlap the body's."""
    return pairs_of(k, body)


@cache
def _hooks(first: int, beyond: int, circular: bool, slanted: bool) -> dict[str, Any]:
    """Returns the hooks by name, for a number of lists and a kind of scene."""
    inner = own_list, along, period_of, slot_of, first_slot, before, behind, edge, rate_between, gap_between
    outer = watch, overlaps, elsewhere, holds, insert_bound, take_bound_out
    called = build, repair, replan, enter, leave
    stride = _stride(beyond)
    made = with_constants(
        (*inner, *outer, *called),
        **{"FIRST": first, "BEYOND": beyond, "CIRCULAR": circular, "SLANTED": slanted, "STRIDE": stride},
        **{"COUNT": (beyond - first) >> 1, "PLACE_AT": stride >> 1, "SHIFT": stride.bit_length() - 1},
    )
    return {each.__name__: made[each.__name__] for each in called}


def _away(k: Kernel, s: State) -> Lengths:
    """Returns (lists, 2n) the offset of each bound to the right of its body's place."""
    if not len(s.lines):
        sides, count = offsets(k)[:, int(s.span[0]) : int(s.span[1])], len(s.ways) >> 1
        return sides.reshape(len(sides), count, 2).swapaxes(0, 1).reshape(count, -1)
    away = np.outer(s.lines[2::4], k.bodies.reach) + s.lines[3::4, None]
    return np.stack([-away, away], axis=2).reshape(len(away), -1)


def _lists(k: Kernel, s: State) -> Lists:
    """Returns the lists in the numbers of ``sorted_bounds``: a turn is as long as the list, and places count
    from the position that the body's plan gives."""
    ways, first, end = s.ways.reshape(-1, 2), int(s.span[0]), int(s.span[1])
    count, half = len(ways), _stride(end) >> 1
    order = s.order.reshape(count, -1)[:, 1 : 1 + 2 * int(k.clock[0].present)].astype(np.int64)
    mine = s.bounds.reshape(-1, 2, half)[:, :, first:end].reshape(-1, 2, count, 2)
    due, place = mine.transpose(1, 2, 0, 3).reshape(2, count, -1)
    away = place - np.array([[1 + at * (len(s.order) // count)] for at in range(count)])
    if len(k.images):
        away -= (ways @ np.stack([k.images.kx, k.images.ky])).repeat(2, axis=1) * TURN
    place = (away & (TURN - 1)) + (away >> BITS) * order.shape[1]
    shares = s.lines.reshape(-1, 4)[:, :2] if len(s.lines) else ways.astype(np.float64)
    names = tuple(NAMES.get((p, q), f"{p}:{q}") for p, q in ways.tolist())
    body, bound = order >> half.bit_length(), order & 1
    return Lists(names, shares, _away(k, s), 2 * body + bound, place, due)


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields a sentence for each fault of the sorted bounds and the pairs."""
    return audit_bounds(k, _lists(k, s))


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws the sorted bounds, and the two that pass next."""
    return draw_bounds(k, _lists(k, s))


class SweepAndPrune:
    """Sweep-and-prune on one axis, or along one line.

    Args:
        axis: the axis along which bounds are sorted, "x" (default) or "y"; or a direction, two whole numbers
            such as "3:4"; or "auto": the one of sixteen directions along which bodies are expected to pass
            each other least often, chosen at each start.
    """

    def __init__(self, *, axis: str = "x") -> None:
        self.ways = (SIXTEEN[0],) if axis == "auto" else (_read_way("sap-1d", "axis", axis, " or 'auto'"),)
        self.best = axis == "auto"

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; refuses a slanted line where an axis is periodic."""
        return _parts("sap-1d", scene, self.ways, self.best)


class SweepAndPruneBoxes:
    """Sweep-and-prune on both axes: bounding boxes."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; accepts every scene."""
        return _parts("sap-2d", scene, tuple(AXES.values()))


class SweepAndPruneMany:
    """Sweep-and-prune along k lines at once.

    Args:
        directions: the number of lines, 1 to 16, evenly spread from x on (default 3); or the lines
            themselves, such as "x+y+3:4".
    """

    def __init__(self, *, directions: int | str = 3) -> None:
        if type(directions) is int and 1 <= directions <= len(SIXTEEN):
            ways = [SIXTEEN[round(at * len(SIXTEEN) / directions)] for at in range(directions)]
        elif isinstance(directions, str):
            ways = [_read_way("sap-k", "each of directions", each) for each in directions.split("+")]
        else:
            ways = []
        if not 0 < len({*ways, *((-p, -q) for p, q in ways)}) == 2 * len(ways) <= 2 * len(SIXTEEN):
            raise BadOption(
                "sap-k sorts along 1 to 16 lines: directions must be their number, or different ones such as "
                f"'x+y+3:4', not {directions!r}"
            )
        self.ways = tuple(AXES.values()) if {*ways} == {*AXES.values()} else tuple(ways)

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; refuses slanted lines where an axis is periodic."""
        return _parts("sap-k", scene, self.ways)


def _read_way(phase: str, option: str, way: object, also: str = "") -> tuple[int, int]:
    """Returns a direction, given as "x", "y", or two whole numbers as text."""
    found = re.fullmatch(r"(-?\d{1,6}):(-?\d{1,6})", way) if isinstance(way, str) else None
    p, q = map(int, found.groups()) if found else AXES.get(str(way), (0, 0))
    if not p and not q:
        raise BadOption(
            f"{phase} sorts along lines: {option} must be 'x' or 'y', two whole numbers such as '3:4'{also}, "
            f"not {way!r}"
        )
    short = math.gcd(p, q) if (p, q) > (0, 0) else -math.gcd(p, q)
    return p // short, q // short


def _parts(
    phase: str, scene: Scene, ways: tuple[tuple[int, int], ...], best: bool = False
) -> BroadPhaseParts:
    """Returns the parts for lists along some directions, or along the best one."""
    n, count = scene.capacity, len(ways)
    slanted = best or ways not in ((AXES["x"],), (AXES["y"],), (AXES["x"], AXES["y"]))
    if slanted and scene.periodic:
        raise Refused(
            f"{phase} sorts along a slanted line, and this scene is periodic along {scene.periodic}: the "
            "images of a body make no circle on such a line; sort along x or y"
        )
    first = 2 * int(ways == (AXES["y"],))
    end = first + 2 * count
    circular = not slanted and any(NAMES[way] in scene.periodic for way in ways)
    state = State(
        order=np.full(count * (2 * n + 2), END, dtype=np.int32),
        bounds=np.full(_stride(end) * n, NEVER),
        span=np.array([first, end]),
        ways=np.array(ways).ravel(),
        lines=np.zeros(4 * count if slanted else 0),
    )
    flat = "" if slanted or circular else "boxes" if count == 2 else f"bounds {NAMES[ways[0]]}"
    return BroadPhaseParts(
        state=state,
        near=near,
        arrange=arrange_best if best else arrange,
        **_hooks(first, end, circular, slanted),
        room=n,
        audit=audit,
        draw=draw,
        drawn_as=flat,
        pairs=4 * n + 64,
        ticks=(state.bounds.reshape(-1, 2, _stride(end) >> 1)[:, 0],),
        periodic=True,
    )
