"""The event queue: an indexed four-ary heap of (failure time, certificate).

Each certificate knows its place in the heap, so a changed failure time moves one entry and nothing is ever
stale: the queue is as long as there are certificates that will fail. Four children a node rather than two:
half the levels, and siblings share a cache line.

The order is total and owes nothing to insertion: by tick, then by class (structural, turn, wall, pair: the
ranges in which certificates are numbered), then by number, and for pairs by the bodies, because a pair's
number depends on the history of the free list.
"""

from __future__ import annotations

from kinetile.kernel.compiled import hook
from kinetile.kernel.faults import BAD_CERTIFICATE, blame
from kinetile.kernel.tables import NEVER, NOBODY, Kernel

__all__ = ["precedes", "schedule", "schedule_own"]


@hook
def precedes(k: Kernel, tick: int, certificate: int, other_tick: int, other: int) -> bool:
    """Whether one event runs before another."""
    if tick != other_tick:
        return tick < other_tick
    clock = k.clock[0]
    first_pair = clock.structural + 1 + clock.bodies
    if certificate < first_pair or other < first_pair:
        return certificate < other
    one = k.certificates[certificate]
    two = k.certificates[other]
    if one.a != two.a:
        return bool(one.a < two.a)
    return bool(one.b < two.b)


@hook
def _first_of(k: Kernel, child: int) -> int:
    """Return the place of the first of up to four siblings.

    Ticks alone decide, without a branch that could be guessed wrong; only where some tie is the order asked.
    """
    queue = k.queue
    end = min(child + 4, k.clock[0].queued)
    best = child
    soonest = queue[child].tick
    tied = False
    for sibling in range(child + 1, end):
        tick = queue[sibling].tick
        tied = tied | (tick == soonest)
        best = sibling if tick < soonest else best
        soonest = min(tick, soonest)
    if tied:
        best = child
        for sibling in range(child + 1, end):
            if precedes(
                k, queue[sibling].tick, queue[sibling].certificate, queue[best].tick, queue[best].certificate
            ):
                best = sibling
    return best


@hook
def schedule(k: Kernel, certificate: int, tick: int) -> None:
    """Set a certificate's failure time; ``NEVER`` takes it out of the queue. O(log queue)."""
    clock = k.clock[0]
    queue = k.queue
    table = k.certificates
    place = table[certificate].place
    k.counts[0].updated += 1
    if place < 0:
        if tick == NEVER:
            return
        place = clock.queued
        clock.queued = place + 1
        k.counts[0].queue_max = max(k.counts[0].queue_max, place + 1)
    elif tick == NEVER:
        end = clock.queued - 1
        clock.queued = end
        table[certificate].place = -1
        if place == end:
            return
        tick = queue[end].tick  # the last entry fills the hole
        certificate = queue[end].certificate
    elif tick == queue[place].tick:
        return

    hole = place
    while hole > 0:
        parent = (hole - 1) >> 2
        if not precedes(k, tick, certificate, queue[parent].tick, queue[parent].certificate):
            break
        queue[hole] = queue[parent]
        table[queue[hole].certificate].place = hole
        hole = parent
    if hole == place:
        while True:
            child = 4 * hole + 1
            if child >= clock.queued:
                break
            best = _first_of(k, child)
            if not precedes(k, queue[best].tick, queue[best].certificate, tick, certificate):
                break
            queue[hole] = queue[best]
            table[queue[hole].certificate].place = hole
            hole = best
    queue[hole].tick = tick
    queue[hole].certificate = certificate
    table[certificate].place = hole


@hook
def schedule_own(k: Kernel, certificate: int, tick: int) -> None:
    """Set when one of a broad phase's own certificates fails; ``NEVER`` takes it out of the queue. O(log
    queue).

    This is what a phase is given as ``schedule``. A number that it has not declared would be written over
    somebody else's memory; asking costs half a percent of a run.
    """
    if certificate < 0 or certificate >= k.clock[0].structural:
        blame(k, BAD_CERTIFICATE, certificate, NOBODY)
        return
    schedule(k, certificate, tick)
