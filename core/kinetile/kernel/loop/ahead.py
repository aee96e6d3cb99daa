"""Look-ahead: the data that the coming events will read is prefetched while the present ones run.

The tables of a large scene do not fit into the processor's caches. Each contact waits for the memory dozens
of times, because each address is read from the record before it: slice, body, home, cell. But the calendar
has the next bodies in order. A *scout* goes over its slices, some dozens of slices before the head, whenever
the head advances. It finds all bodies of the slice and the partner that each awaits, and prefetches for them
in stages, separated by a few bodies: each reads the data that the stage before it has prefetched. No answer
depends on this. In a small scene this costs more than it saves, so it is composed only from ``LARGE_SCENE``
bodies on. In smaller scenes the two bodies of the contact at the head are prefetched before its exact tick.
"""

from typing import Any

from kinetile.kernel.compiled import larger, smaller, template, to_be_filled_in
from kinetile.kernel.features import AHEAD, PERIODIC, only_with
from kinetile.kernel.loop.calendar import next_marked, ring_of
from kinetile.kernel.tables import FOUND, Kernel
from kinetile.kernel.vectors import prefetch

LARGE_SCENE = 1 << 13
"""The least number of bodies that it pays for (docs/which-broad-phase.md)."""

LEAD, AFAR = 48, 128
"""The scout's least and largest lead over the head, in slices."""

SIGHT = 16
"""Slices ahead of the scout whose ring is prefetched: else the scout would wait for it."""

STAGE = 5
"""Bodies found between two stages of one body."""

soon = to_be_filled_in


@template
def look_ahead(k: Kernel, s: Any, seen: int, scout: int, turn: int) -> tuple[int, int, int]:
    """Moves the scout on by a slice if the calendar has moved since slice ``seen``; returns the calendar's
    slice, the scout's slice, and the number of bodies that the scout has found."""
    day = k.clock[0].calendar.slice
    if day == seen:
        return seen, scout, turn
    scout = larger(scout, day + LEAD)
    if scout < day + AFAR:
        scout = next_marked(k, scout + 1)
        prefetch(k.rings, ring_of(k, scout + SIGHT))
        body = k.rings[ring_of(k, scout)]
        while body < len(k.bodies):
            turn += 1
            _do_stages(k, s, body, turn)
            body = k.links[body].next
    return day, scout, turn


@template
def fetch_two(k: Kernel, s: Any, a: int, b: int) -> None:
    """Prefetches the plans of two bodies that may meet next, and the data of the first stage, at once: else a
    load would find the elder, the next one its plan, and a third one, after the contact, its home."""
    if not AHEAD:
        prefetch(k.bodies, a)
        prefetch(k.bodies, b)
        soon(k, s, a, 0)
        soon(k, s, b, 0)


@template
def _do_stages(k: Kernel, s: Any, body: int, turn: int) -> None:
    """Does the first stage for a body, and one stage each for bodies found before and for partners. Whether a
    body awaits a partner is practically random: so there is no branch, and a body without a partner stands in
    for it.
    """
    found = k.found
    found[turn & (FOUND - 1)].body = body
    _fetch(k, body)
    soon(k, s, body, 0)
    before = found[(turn - STAGE) & (FOUND - 1)].body
    partner = k.queue[before].partner
    partner = partner if partner >= 0 else before
    found[turn & (FOUND - 1)].partner = partner
    _fetch(k, partner)
    soon(k, s, partner, 0)
    prefetch(k.bodies, k.bodies[before].last)
    soon(k, s, before, 1)
    earlier = found[(turn - STAGE) & (FOUND - 1)].partner
    prefetch(k.links, k.links[earlier].next)  # the links that its removal from its ring writes
    prefetch(k.rings, larger(~k.links[earlier].prev, 0))
    soon(k, s, earlier, 1)
    soon(k, s, found[(turn - 2 * STAGE) & (FOUND - 1)].body, 2)


@template
def _fetch(k: Kernel, body: int) -> None:
    """Prefetches the kernel's own data of a body."""
    prefetch(k.queue, body)
    prefetch(k.bodies, body)
    prefetch(k.places, body)
    prefetch(k.links, body)
    prefetch(k.stamps, body)
    if PERIODIC:
        prefetch(k.images, body)


@only_with(AHEAD)
@template
def fetch_ring(k: Kernel, body: int) -> None:
    """Prefetches the ring that a body will be filed in, unless a wall comes first."""
    entry = k.queue[body]
    prefetch(k.rings, ring_of(k, smaller(entry.certificate, entry.tick) >> k.clock[0].calendar.shift))
