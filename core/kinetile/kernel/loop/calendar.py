"""The calendar: the queue of bodies, one entry each, by the tick of what awaits them first.

A calendar queue (Brown 1988): time is cut into slices of 2^shift ticks, about as long as events are apart,
and each body is filed in the ring of its slice. There are more slices than bodies, and they are used again
and again, so an entry of a later year may be in the same ring. A ring is put in order when the calendar
reaches its slice; until then bodies are filed first, and of the others there one link is written. So the
bodies of the slice that is reached are the first of its ring, in order, and a thousand that are due at one
tick cost no search. A bit for each ring says whether it is empty. To file a body, to take it out and to find
the head costs O(1) while slices have about the right length, which is mended between two chunks of a run. It
is faster than a heap because one entry is touched and not a path of them.
The order is total and owes nothing to the calendar (``precedes``).
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
"""Ticks. Later than this from now it is not worth to compute where a body will be: its wall is."""

inside = reach_wall = to_be_filled_in


@hook
def precedes(k: Kernel, a: int, b: int) -> bool:
    """Whether what awaits body a comes before what awaits body b."""
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
    """Returns a tuple in the order of ``precedes``, of a body's number and its partner's; not for hooks."""
    pair = (min(number, partner), max(number, partner)) if kind == PAIR else (number, number)
    return (key, kind, *pair, number)


@hook
def ring_of(k: Kernel, day: int) -> int:
    """The ring in which the bodies of a slice are, and the place of its mark."""
    return int(day & (len(k.rings) - 1))


@hook
def _link(k: Kernel, before: int, body: int, after: int) -> None:
    """Puts a body between two links: a body or a ring (``~ring``), and a body or the end."""
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
    """Puts a body into the ring of its slice: first, or in order in the ring of the slice that the calendar
    has reached. Filed before that slice, it lets the calendar go back to the one before, and reach it again.
    """
    calendar = k.clock[0].calendar
    day = key >> calendar.shift
    ring = np.int64(ring_of(k, day))  # as Python, the bit of a shorter number would be lost
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
    """Takes a body out of its ring."""
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
    """Files a body under another tick; ``NEVER`` takes it out of the calendar. O(1)."""
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
    """Clears what an entry says of contacts, before all that is near is looked at. It awaits nothing, and is
    out of the calendar until it is settled; but it counts as queued all the while."""
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
    """Puts the bodies of a ring in order, by insertion from its begin: what is filed late, and so is first
    here, comes late in most rings."""
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
    """Returns the first slice from ``day`` on that is not empty; a year later if none is."""
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
    """Returns the body that comes next, or NOBODY; the slice sought in becomes its slice."""
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
        if day > end:  # nothing in a whole year: look for the next entry itself
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
    """Returns a tick before which nothing happens but to the head and its partner: the next entry of the
    slice, or the end of the slice."""
    end = (k.clock[0].calendar.slice + 1) << k.clock[0].calendar.shift
    second = k.links[first].next
    if second == partner:
        second = k.links[second].next
    return int(smaller(end, k.queue[second].key)) if second < len(k.bodies) else int(end)


@template
def wall_is_before(k: Kernel, h: int, tick: int, more: int) -> bool:
    """Whether a body may be at a wall, or leave its support, at a tick or before. Computes when it does,
    unless ``inside`` of the narrow phase for walls says that it reaches none, for ``more`` ticks after that
    too."""
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
"""Ticks after its key up to which a body with NOT_ASKED is away from walls. A bound is rarely that early, so
walls are looked at once when a guess is filed, and not again when its contact is known exactly."""


@template
def wall_may_be_before(k: Kernel, h: int, tick: int) -> bool:
    """Returns what ``wall_is_before`` does, for a body that is filed."""
    entry = k.queue[h]
    if entry.wall == NOT_ASKED and tick - SOON <= entry.key:
        return False
    return wall_is_before(k, h, tick, 0)


@template
def refile(k: Kernel, h: int) -> None:
    """Files a body under the first of what awaits it."""
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
