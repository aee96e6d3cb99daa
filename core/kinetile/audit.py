"""Auditing a run: between two events, check slowly everything that must hold.

Every structure of the kernel is compared with what it stands for, every two bodies are looked at whether they
are a candidate pair where they must be, and the broad phase is asked for its own invariants. The first thing
that does not hold ends the run with an ``AuditError``, close to the event that broke it.

The cost is O(n^2) an audit; ``Simulation(..., audit=N)`` audits every N contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from kinetile.flight import positions_now
from kinetile.protocols import BroadPhaseParts
from kinetile.tables import Kernel

__all__ = ["complaints"]

ROWS = 1 << 9
"""Bodies compared with all others at a time: bounds the memory of an audit."""


def complaints(k: Kernel, parts: BroadPhaseParts, delta: float, pairs: bool) -> Iterator[str]:
    """Yield a sentence for everything that does not hold now.

    ``delta`` is the skin; ``pairs`` says whether there is a narrow phase for pairs, and so a need for
    candidates.
    """
    yield from _queue(k)
    yield from _pairs(k)
    if pairs and not _repairs_are_due(k):
        yield from _candidates(k, delta)
    if parts.audit is not None:
        yield from parts.audit(k, parts.state)


def _repairs_are_due(k: Kernel) -> bool:
    """Whether a structural certificate fails at this very tick and has not been repaired yet."""
    clock = k.clock[0]
    waiting = k.queue[: int(clock.queued)]
    return bool(((waiting.tick <= clock.now) & (waiting.certificate < clock.structural)).any())


def _queue(k: Kernel) -> Iterator[str]:
    """The queue is a heap, and every certificate knows its place in it."""
    size = int(k.clock[0].queued)
    heap = k.queue[:size]
    if size and (k.certificates.place[heap.certificate] != np.arange(size)).any():
        yield "a certificate does not stand in the queue where it says it does"
    queued = int((k.certificates.place >= 0).sum())
    if queued != size:
        yield f"the queue has {size} entries, but {queued} certificates say that they are queued"
    parent = (np.arange(1, size) - 1) >> 2
    if (heap.tick[1:] < heap.tick[parent]).any():
        yield "the queue is out of order"


def _pairs(k: Kernel) -> Iterator[str]:
    """Every candidate pair stands once in the list of each of its bodies, and the count is right."""
    live = np.flatnonzero(k.certificates.a >= 0)
    if len(live) != int(k.clock[0].pairs):
        yield f"there are {len(live)} candidate pairs, but the kernel counts {int(k.clock[0].pairs)}"
    listed = 0
    for body in range(len(k.bodies)):
        at = int(k.bodies[body].first)
        while at >= 0 and listed <= 2 * len(live):
            record = k.certificates[at]
            if body not in (int(record.a), int(record.b)):
                yield f"the list of body {body} has the pair ({int(record.a)}, {int(record.b)}) in it"
                return
            listed += 1
            at = int(record.next_a if record.a == body else record.next_b)
    if listed != 2 * len(live):
        yield f"the bodies' lists have {listed} entries for {len(live)} candidate pairs"


def _candidates(k: Kernel, delta: float) -> Iterator[str]:
    """Every two bodies closer than a skin are a candidate pair."""
    place: Any = positions_now(k)
    radius = np.asarray(k.bodies.radius)
    table = k.certificates
    held = {(int(a), int(b)) for a, b in zip(table.a, table.b, strict=True) if a >= 0}
    for first in range(0, len(place), ROWS):
        rows = slice(first, first + ROWS)
        apart = np.hypot(
            place[rows, 0, None] - place[None, :, 0], place[rows, 1, None] - place[None, :, 1]
        ) - (radius[rows, None] + radius[None, :])
        for a, b in np.argwhere(apart <= delta):
            one, two = int(a) + first, int(b)
            if one < two and (one, two) not in held:
                yield f"bodies {one} and {two} touch (gap {apart[a, b]:.3g}) and are not a candidate pair"
