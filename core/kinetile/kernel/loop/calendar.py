"""The calendar: the priority queue of the bodies, one entry each, by the tick of their first event.

A calendar queue (Brown 1988): time is cut into slices of 2^shift ticks, about as long as the time between two
events, and each body is filed in the ring of its slice. There are more rings than bodies, and the slices use
them in turn, so a ring may also hold entries of a later year. The calendar sorts a ring when it reaches the
ring's slice; until then it inserts bodies at the front, and writes one link of the other entries. So the
bodies of the current slice are the first of their ring, in order, and a thousand bodies that are due at one
tick cost no search. A bit for each ring says whether the ring is empty. Insertion, removal and finding the
head cost O(1) while slices have about the right length; the length is adjusted between two chunks of a run.
The calendar is faster than a heap because it touches one entry and not a path of entries. The order of events
is total and does not depend on the calendar (``precedes``).
"""

import numpy as np

from kinetile.kernel.compiled import hook, larger, smaller, template, to_be_filled_in
from kinetile.kernel.features import ACCELERATIONS, PASSINGS, RESTING, WALLED
from kinetile.kernel.tables import (
    CHORD,
    GUESS,
    NEVER,
    NOBODY,
    NOT_ASKED,
    PAIR,
    PARTING,
    STRUCTURAL,
    TAKEN_OUT,
    WALL,
    Kernel,
)
from kinetile.kernel.vectors import lowest_bit

HORIZON = 1 << 60
"""Ticks. Further ahead than this the calendar does not try ``inside``: it computes the wall contact."""

inside = reach_wall = to_be_filled_in


@hook
def precedes(k: Kernel, a: int, b: int) -> bool:
    """Returns True if the first event of body a is before the first event of body b."""
    one = k.queue[a]
    two = k.queue[b]
    if one.key != two.key:
        return bool(one.key < two.key)
    if one.kind != two.kind:
        return bool(one.kind < two.kind)
    if one.kind == PAIR:
        partner = k.queue[one.partner].number
        rival = k.queue[two.partner].number
        if smaller(one.number, partner) != smaller(two.number, rival):
            return bool(smaller(one.number, partner) < smaller(two.number, rival))
        if larger(one.number, partner) != larger(two.number, rival):
            return bool(larger(one.number, partner) < larger(two.number, rival))
    return bool(one.number < two.number)


def rank(number: int, key: int, kind: int, partner: int) -> tuple[int, ...]:
    """Returns a sort key ordered as ``precedes``, by the numbers of body and partner; not for hooks."""
    pair = (min(number, partner), max(number, partner)) if kind == PAIR else (number, number)
    return (key, kind, *pair, number)


@hook
def ring_of(k: Kernel, day: int) -> int:
    """Returns the ring of a slice, which is also the index of its bit in the marks."""
    return int(day & (len(k.rings) - 1))


@hook
def _link(k: Kernel, before: int, body: int, after: int) -> None:
    """Inserts a body between two links: a body or a ring (``~ring``), and a body or the end."""
    links = k.links
    links[body].next = after
    links[body].prev = before
    links[after].prev = body
    if before < 0:
        k.rings[~before] = body
    else:
        links[before].next = body


@hook
def _file(k: Kernel, body: int, key: int) -> None:
    """Inserts a body into the ring of its slice: at the front, or in order if the calendar has reached that
    slice. For an earlier slice the calendar moves back to the slice before it, and reaches it again.
    """
    calendar = k.clock[0].calendar
    day = key >> calendar.shift
    ring = np.int64(ring_of(k, day))  # in Python the bit of a shorter integer would be lost
    reached = calendar.slice
    before = int(~ring)
    after = int(np.int64(k.rings[ring]))
    if day < reached:
        calendar.slice = day - 1
    elif ring == ring_of(k, reached):
        while after < len(k.bodies) and precedes(k, after, body):
            before = after
            after = int(np.int64(k.links[after].next))
    _link(k, before, body, after)
    k.marks[ring >> 6] |= 1 << (ring & 63)


@hook
def _take_out(k: Kernel, body: int) -> None:
    """Removes a body from its ring."""
    links = k.links
    after = np.int64(links[body].next)
    before = np.int64(links[body].prev)
    links[after].prev = before
    if before < 0:
        ring = ~before
        k.rings[ring] = after
        k.marks[ring >> 6] &= ~(int(after == len(k.bodies)) << (ring & 63))
    else:
        links[before].next = after


@hook
def move(k: Kernel, body: int, key: int) -> None:
    """Files a body under another tick; ``NEVER`` removes it from the calendar. O(1)."""
    entry = k.queue[body]
    before = entry.key
    if before < TAKEN_OUT:
        _take_out(k, body)
    entry.key = key
    counts = k.counts[0]
    if key != NEVER:
        _file(k, body, key)
        if before == NEVER:
            counts.queued += 1
            counts.queue_max = larger(counts.queue_max, counts.queued)
    elif before != NEVER:
        counts.queued -= 1


@hook
def forget(k: Kernel, h: int) -> None:
    """Clears the contacts of an entry, before all near bodies are compared. The body awaits nothing, and is
    out of the calendar until it is filed again; but it counts as queued meanwhile."""
    entry = k.queue[h]
    if entry.key < TAKEN_OUT:
        _take_out(k, h)
        entry.key = TAKEN_OUT
    entry.tick = NEVER
    entry.guard = NEVER
    entry.partner = NOBODY
    entry.exact = 0


@hook
def _put_in_order(k: Kernel, ring: int) -> None:
    """Sorts the bodies of a ring, by insertion from the front: in most rings a body that was filed late, and
    so is near the front, is due late."""
    links = k.links
    last = int(np.int64(k.rings[ring]))
    body = int(np.int64(links[last].next))
    while body < len(k.bodies):
        later = int(np.int64(links[body].next))
        if precedes(k, body, last):
            links[last].next = later
            links[later].prev = last
            before = ~ring
            after = int(np.int64(k.rings[ring]))
            while precedes(k, after, body):
                before = after
                after = int(np.int64(links[after].next))
            _link(k, before, body, after)
        else:
            last = body
        body = later


@hook
def file_all(k: Kernel) -> None:
    """Files all bodies by their keys, in slices of the present length. O(n)."""
    clock = k.clock[0]
    calendar = clock.calendar
    calendar.filed = 1
    calendar.slice = clock.now >> calendar.shift
    for at in range(len(k.rings)):
        k.rings[at] = len(k.bodies)
    for at in range(len(k.marks)):
        k.marks[at] = 0
    for body in range(clock.bodies):
        if k.queue[body].key != NEVER:
            _file(k, body, k.queue[body].key)


@hook
def next_marked(k: Kernel, day: int) -> int:
    """Returns the first slice from ``day`` on that is not empty; a year later if all are empty."""
    ring = ring_of(k, day)
    word = ring >> 6
    bits = k.marks[word] >> (ring & 63) << (ring & 63)
    looked = 0
    while bits == 0 and looked < len(k.marks):
        word = word + 1 if word + 1 < len(k.marks) else 0
        bits = k.marks[word]
        looked += 1
    if bits == 0:
        return day + len(k.rings)
    return day + (((word << 6) + lowest_bit(bits) - ring) & (len(k.rings) - 1))


@hook
def head(k: Kernel) -> int:
    """Returns the body of the next event, or NOBODY; the slice of this body becomes the calendar's."""
    clock = k.clock[0]
    calendar = clock.calendar
    queue = k.queue
    links = k.links
    bodies = len(k.bodies)
    day = calendar.slice
    end = day + len(k.rings) - 1
    first = np.int64(k.rings[ring_of(k, day)])
    while first >= bodies or queue[first].key >> calendar.shift != day:
        day = next_marked(k, day + 1)
        if day > end:  # nothing in a whole year: find the next entry itself
            soonest = NEVER
            for body in range(clock.bodies):
                soonest = smaller(soonest, queue[body].key)
            if soonest == NEVER:
                return NOBODY
            day = soonest >> calendar.shift
            end = day + len(k.rings) - 1
        ring = ring_of(k, day)
        first = np.int64(k.rings[ring])
        if links[first].next < bodies:  # more than one body
            _put_in_order(k, ring)
            first = np.int64(k.rings[ring])
    calendar.slice = day
    return int(first)


@hook
def runner_up(k: Kernel, first: int, partner: int) -> int:
    """Returns a lower bound of the next event's tick, except for the head and its partner: the tick of the
    next entry in the slice, or the end of the slice."""
    end = (k.clock[0].calendar.slice + 1) << k.clock[0].calendar.shift
    second = k.links[first].next
    if second == partner:
        second = k.links[second].next
    return int(smaller(end, k.queue[second].key)) if second < len(k.bodies) else int(end)


@template
def wall_is_before(k: Kernel, h: int, tick: int, more: int) -> bool:
    """Returns True if a body may be at a wall, or leave its support, at or before a tick. Computes the tick
    of that, unless ``inside`` of the narrow phase for walls says that the body reaches no wall until ``more``
    ticks later."""
    entry = k.queue[h]
    if entry.wall == NOT_ASKED:
        body = k.bodies[h]
        stays = True
        if RESTING:
            stays = body.ledge == NEVER
        if stays and tick < k.clock[0].now + HORIZON and inside(k, body, tick + more):
            return False
        entry.wall = reach_wall(k, body)[0]
        if RESTING:
            entry.wall = smaller(entry.wall, body.ledge)
    return bool(entry.wall <= tick)


SOON = 1 << 17
"""Ticks after its key while a body with NOT_ASKED is away from walls. A bound is rarely that early, so walls
are tested once, when a guess is filed, and not again when its contact is computed exactly."""


@template
def wall_may_be_before(k: Kernel, h: int, tick: int) -> bool:
    """Returns the same as ``wall_is_before``, for a body that is filed."""
    entry = k.queue[h]
    if entry.wall == NOT_ASKED and tick - SOON <= entry.key:
        return False
    return wall_is_before(k, h, tick, 0)


@template
def refile(k: Kernel, h: int) -> None:
    """Files a body under its first event."""
    entry = k.queue[h]
    key = entry.certificate
    kind = STRUCTURAL
    if entry.tick < key:
        key = entry.tick
        kind = PAIR if entry.exact else GUESS
    if ACCELERATIONS and k.bodies[h].end <= key and k.bodies[h].end != NEVER:
        key = k.bodies[h].end
        kind = CHORD
    may_come = WALLED and wall_is_before(k, h, key, SOON)
    if may_come and (entry.wall < key or (entry.wall == key and kind == PAIR)):
        key = entry.wall
        kind = WALL
    if PASSINGS and k.traits[h].leave < key:
        key = k.traits[h].leave
        kind = PARTING
    if key != entry.key or kind != entry.kind or kind == PAIR:
        entry.kind = kind
        move(k, h, key)
