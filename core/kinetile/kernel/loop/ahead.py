"""Look-ahead: what the events to come will read is prefetched while the present ones run.

The tables of a large scene do not fit into the processor's caches, and each contact waits for the memory
dozens of times, because each address is read from what the address before it names: slice, body, home, cell,
bodies there. But the calendar says which bodies come next. When it moves on to a slice, the first bodies of
four later slices are looked at, each at a stage of its own: what one stage has prefetched, the next one
reads. Nothing is written, so no answer depends on any of it; an event that comes sooner than foreseen waits
as before.

In a small scene this costs more than it saves, so it is composed only from ``LARGE`` bodies on.
"""

from __future__ import annotations

from typing import Any

from kinetile.kernel.compiled import template, to_be_filled_in
from kinetile.kernel.tables import Kernel
from kinetile.kernel.vectors import prefetch

LARGE = 1 << 14
"""Bodies from which on it pays (docs/benchmark.md)."""

STAGE = 16
"""Slices between two stages: about as many events, each some hundred nanoseconds."""

MOST = 4
"""Slices that are caught up with after a jump; the others are past."""

soon = to_be_filled_in


@template
def look_ahead(k: Kernel, s: Any, seen: int) -> int:
    """Look ahead from every slice that the calendar has come to since ``seen``; return the present one."""
    day = k.clock[0].calendar.slice
    if day - seen > MOST or day < seen:
        seen = day - 1
    while seen < day:
        seen += 1
        _look_from(k, s, seen)
    return seen


@template
def _look_from(k: Kernel, s: Any, day: int) -> None:
    """Do one stage for the first body of each of four slices, and for the partner that it awaits."""
    links = k.links
    bodies = len(k.bodies)
    mask = len(links) - bodies - 1
    for stage in range(3):
        body = links[bodies + ((day + (3 - stage) * STAGE) & mask)].next
        if body < bodies:
            if stage == 0:
                _fetch(k, body)
            soon(k, s, body, stage)
            partner = k.queue[body].partner if stage > 0 else -1
            if partner >= 0:
                if stage == 1:
                    _fetch(k, partner)
                soon(k, s, partner, stage - 1)
    body = links[bodies + ((day + STAGE // 2) & mask)].next
    if body < bodies and k.queue[body].partner >= 0:
        soon(k, s, k.queue[body].partner, 2)


@template
def _fetch(k: Kernel, body: int) -> None:
    """Prefetch what the kernel itself has of a body."""
    prefetch(k.queue, body)
    prefetch(k.bodies, body)
    prefetch(k.places, body)
    prefetch(k.links, body)
