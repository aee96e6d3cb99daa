"""Sorted bounds on a circle: both kinds of sweep-and-prune where an axis is periodic.

The images of all bounds stand on an endless line, and repeat after a period. The list of an axis holds one
image of each bound, a period of the line, and its last bound has the first one behind it, a period further
right. That gap is watched like any other. When it closes, the two exchange, and the list holds from then on
the image of one that is a period further left, and of the other that is one further right. So a border is no
event, and nothing is sorted anew.

Places are counted on that line, ``TURN`` of them to a period. The place that is kept of a bound is that of
the image whose body is at its unwrapped place; the one in the list is whole turns away::

    place of a bound = slot in the list + TURN * periods from the bound in the list to the unwrapped one

Differences of places say all that is needed, so places may overflow. Through how many images two bodies
overlap along an axis is read off four of them. A pair is held once for each image through which two boxes
overlap. A body's own images are no pairs: their gap never changes.

An axis with walls has a list with two ends, and one that is not sorted has places too, by which all bodies
overlap there once. So the hooks are the same for one sorted axis and for two, each periodic or not.
"""

from __future__ import annotations

import math
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
    larger,
    pairs_of,
    positions_now,
    remove_pair,
    schedule,
    since_anchor,
    smaller,
    unchecked,
)

from .sorted_bounds import Whole, audit_bounds, audit_lists, draw_boxes, draw_line, offset, offsets

PLACE = 4
"""Where the place of a bound stands behind its tick in ``bounds``."""

END = -1
"""What stands in the order before the first bound of an axis and behind the last."""

BITS = 28
TURN = 1 << BITS
"""Places in a period of the endless line: more than the list has slots."""


class State(NamedTuple):
    """The sorted lists. A body's bounds are numbered 8 * body + 0 to 3: L and R on x, L and R on y."""

    order: Records  # (4n + 4,) the bounds on x from left to right, then those on y, each list after one END
    # and before others; n slots
    bounds: Records  # (8n,) when each bound passes the one after it; at PLACE behind that, its place
    span: Records  # (2,) of a body's four bounds, the first that is sorted, and the one behind the last


def arrange(k: Kernel, s: State) -> None:
    """Sorts the bounds of each axis as they stand now, and will a moment later."""
    place, torus = positions_now(k), k.clock[0].torus
    s.order[:] = END
    body, upper = np.divmod(np.arange(2 * len(place)), 2)
    away = offsets(k)
    along_x = k.bodies.vx, k.images.kx, torus.x, torus.per_x
    along_y = k.bodies.vy, k.images.ky, torus.y, torus.per_y
    for axis in range(s.span[0] >> 1, s.span[1] >> 1):
        speed, taken_off, period, per = along_y if axis else along_x
        edge = place[body, axis] + away[body, 2 * axis + upper]
        turn = np.floor(edge * per)
        order = np.lexsort((body, 1 - upper, speed[body], edge - turn * period))
        slots = 1 + axis * (len(s.order) >> 1) + np.arange(len(order))
        s.order[slots] = 8 * body[order] + 2 * axis + upper[order]
        turns = turn.astype(np.int64) + taken_off[body]
        s.bounds[s.order[slots] + PLACE] = slots + turns[order] * TURN


@hook
def period_of(k: Kernel, bound: int) -> float:
    """Return the period of a bound's axis, or 0."""
    torus = k.clock[0].torus
    return float(torus.x if bound & 2 == 0 else torus.y)


@hook
def slot_of(s: State, bound: int) -> int:
    """Return where a bound stands in the order."""
    return int(s.bounds[bound + PLACE] & (TURN - 1))


@hook
def first_slot(s: State, bound: int) -> int:
    """Return where the first bound of an axis stands in the order."""
    return 1 if bound & 2 == 0 else 1 + (len(s.order) >> 1)


@hook
def before(k: Kernel, s: State, bound: int) -> int:
    """Return the bound left of a bound, or END. All bodies that are present have their bounds in the list."""
    slot = slot_of(s, bound)
    left = s.order[slot - 1]
    if left == END and period_of(k, bound) > 0.0:
        left = s.order[slot + 2 * k.clock[0].present - 1]
    return int(left)


@hook
def behind(k: Kernel, s: State, bound: int) -> int:
    """Return the bound right of a bound, or END."""
    right = s.order[slot_of(s, bound) + 1]
    if right == END and period_of(k, bound) > 0.0:
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
    """Return how far the first image of a bound that is behind another one in the order is right of it."""
    one = k.images[left >> 3]
    other = k.images[right >> 3]
    taken_off = other.kx - one.kx if left & 2 == 0 else other.ky - one.ky
    away = s.bounds[left + PLACE] - s.bounds[right + PLACE] + taken_off * TURN
    periods = (away >> BITS) + 1
    return float((edge(k, right, at) - edge(k, left, at)) + periods * period_of(k, left))


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
    first = left & -4
    on_x = smaller(s.bounds[first], s.bounds[first + 1])
    on_y = smaller(s.bounds[first + 2], s.bounds[first + 3])
    schedule(k, left >> 3, smaller(on_x, on_y))


@hook
def overlaps(s: State, one: int, other: int) -> int:
    """Return through how many images two bodies overlap on an axis, given their Ls there.

    Those are the whole turns by which the second can be moved for its R to be right of the first one's L, and
    its L left of the first one's R.
    """
    one += PLACE
    other += PLACE
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
    """Watch all gaps; hold a pair once for every L of another body between the bounds of one, on the first
    sorted axis, and every image through which the two overlap on the other."""
    for body in range(k.clock[0].bodies):
        for bound in range(8 * body, 8 * body + 4):
            s.bounds[bound] = NEVER
    for body in range(k.clock[0].bodies):
        for bound in range(8 * body + s.span[0], 8 * body + s.span[1]):
            watch(k, s, bound, behind(k, s, bound))
        lower = 8 * body + s.span[0]
        turns = (s.bounds[lower + 1 + PLACE] - (s.bounds[lower + PLACE] & -TURN)) >> BITS
        inside = lower
        steps = slot_of(s, lower + 1) - slot_of(s, lower) + 2 * k.clock[0].present * turns
        for _ in range(steps):
            inside = behind(k, s, inside)
            if inside & 1 == 0 and inside != lower:
                for _ in range(overlaps(s, lower ^ 2, inside ^ 2)):
                    add_pair(k, body, inside >> 3)


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A bound passes the one behind it on its axis: exchange them, look at the other axis, watch the three
    gaps around."""
    left = 8 * body
    for bound in range(left + 1, left + 4):
        if s.bounds[bound] < s.bounds[left]:
            left = bound
    right = behind(k, s, left)
    here = slot_of(s, left)
    there = slot_of(s, right)
    step = there - here
    if step < 0:  # the link from the last to the first
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
    for bound in range(8 * body + s.span[0], 8 * body + s.span[1]):
        outer = before(k, s, bound)
        if outer != END:
            watch(k, s, outer, bound)
        watch(k, s, bound, behind(k, s, bound))


@hook
def insert_bound(k: Kernel, s: State, bound: int) -> None:
    """Put a bound into the list of its axis, right of all that are not right of it; those behind it move up.
    Of its images that one is taken which is less than a period right of the first bound. O(n)."""
    now = k.clock[0].now
    torus = k.clock[0].torus
    place = first_slot(s, bound)
    head = s.order[place]
    image = k.images[bound >> 3]
    turns = image.kx if bound & 2 == 0 else image.ky
    there = 0.0
    if head != END:
        there = edge(k, bound, now) - edge(k, head, now)
        periods = math.floor(there * (torus.per_x if bound & 2 == 0 else torus.per_y))
        there -= periods * period_of(k, bound)
        other = k.images[head >> 3]
        turns += int(periods) + (s.bounds[head + PLACE] >> BITS) - (other.kx if bound & 2 == 0 else other.ky)
    while s.order[place] != END:
        place += 1
    while s.order[place - 1] != END:
        left = s.order[place - 1]
        if (0.0 if left == head else gap_between(k, s, head, left, now)) <= there:
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
    """A body comes: its bounds find their places, and whose boxes overlap its own are its pairs."""
    for bound in range(8 * body, 8 * body + 4):
        s.bounds[bound] = NEVER
    for bound in range(8 * body + s.span[0], 8 * body + s.span[1]):
        insert_bound(k, s, bound)
    replan(k, s, body)
    for other in range(k.clock[0].bodies):
        if other != body and is_there(k, other):
            for _ in range(holds(s, body, other)):
                add_pair(k, body, other)


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """A body goes, and its pairs with it; the gaps that close behind its bounds are watched."""
    for at in range(pairs_of(k, body)):
        for _ in range(holds(s, body, k.near[at])):
            remove_pair(k, body, k.near[at])
    first = 8 * body + s.span[0]
    end = 8 * body + s.span[1]
    for bound in range(first, end):
        s.bounds[bound] = before(k, s, bound)  # while all are there; its own tick is needed no more
    for bound in range(first, end):
        take_bound_out(s, bound)
    for bound in range(first, end):
        outer = s.bounds[bound]
        s.bounds[bound] = NEVER
        if outer != END and outer >> 3 != body:
            watch(k, s, outer, behind(k, s, outer))


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies whose boxes overlap a body's, on the axes that are sorted."""
    return pairs_of(k, body)


def _unpacked(k: Kernel, s: State) -> tuple[tuple[int, ...], Whole, Whole, Whole]:
    """Returns the sorted axes, and for each the order, the due ticks and the places, in ``sorted_bounds``'s
    numbers: a turn is as long as the list, and places count from where the body's plan has it."""
    axes = tuple(range(s.span[0] >> 1, s.span[1] >> 1))
    order = np.stack([each[each != END] for each in s.order.reshape(2, -1)[axes, :]]).astype(np.int64)
    due, place = s.bounds.reshape(-1, 2, 2, 2)[:, :, axes].transpose(1, 2, 0, 3).reshape(2, len(axes), -1)
    taken_off = np.stack([k.images.kx, k.images.ky])[axes, :].repeat(2, axis=1)
    away = place - taken_off * TURN - np.array([[1 + axis * (len(s.order) >> 1)] for axis in axes])
    return axes, order >> 3 << 1 | order & 1, due, (away & (TURN - 1)) + (away >> BITS) * order.shape[1]


def audit(k: Kernel, s: State, pairs: bool = True) -> Iterator[str]:
    """Yields what does not hold of the sorted bounds and the pairs."""
    axes, order, due, place = _unpacked(k, s)
    if s.span.tolist() not in ([0, 2], [2, 4], [0, 4]):
        yield f"bounds {s.span[0]} to {s.span[1]} are sorted, which are not those of axes"
    yield from audit_lists(s.order.reshape(2, -1)[axes, :], [2 * axis for axis in axes], 8)
    yield from audit_bounds(k, order, place, due, axes, pairs)


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws what the phase would draw between walls."""
    axes, order, due, place = _unpacked(k, s)
    if len(axes) == 1:
        return draw_line(k, order[0], due[0], axes[0])
    return draw_boxes(k, order, place, due)


def circular_parts(scene: Scene, axes: tuple[int, ...]) -> BroadPhaseParts:
    """Returns the parts of sweep-and-prune on these axes, 0 and 1, of which one at least is periodic."""
    n = scene.capacity
    state = State(
        order=np.full(4 * n + 4, END, dtype=np.int32),
        bounds=np.full(8 * n, NEVER),
        span=np.array([2 * axes[0], 2 * axes[-1] + 2]),
    )
    for axis in {0, 1}.difference(axes):
        state.bounds.reshape(-1, 2, 2, 2)[:, 1, axis] = 0, 1
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
        pairs=4 * n + 64,
        ticks=(state.bounds.reshape(-1, 2, 4)[:, 0],),
        periodic=True,
    )
