"""The kernel's memory: arrays of records, packed in one named tuple that every hook receives as ``k``.

Records, not separate arrays: a body fits one cache line, and passing many arrays by value costs more than the
work done on them. Counts and lengths that change live in the one-record tables ``clock`` and ``counts``,
because a named tuple cannot be changed in place.

Certificates are numbered in the order of their classes, which is also the order in which events of one tick
run::

    0 .. S-1          structural certificates, owned by the broad phase
    S                 the next turn
    S+1 .. S+n        one wall certificate a body
    S+n+1 ..          contact certificates of candidate pairs, recycled through a free list
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

__all__ = ["NEVER", "NOBODY", "Kernel", "Records", "allocate", "clear", "read_only", "record_table"]

Records: TypeAlias = Any
"""A one-dimensional record array: ``table[i].field`` reads and writes, compiled and interpreted alike."""

Tables = TypeVar("Tables", bound=tuple[Any, ...])

NEVER = 2**63 - 1
"""The failure time of a certificate that will not fail."""

NOBODY = -1

BODY = np.dtype(
    [
        ("x", "f8"),
        ("y", "f8"),
        ("vx", "f8"),
        ("vy", "f8"),
        ("anchor", "i8"),  # the tick at which x and y hold
        ("reach", "f8"),  # radius + skin: what broad phases use
        ("radius", "f8"),  # what contact times use
        ("last", "i4"),  # the partner of the contact that made this plan, or NOBODY
        ("first", "i4"),  # head of the list of this body's candidate pairs
    ],
    align=True,
)
CERTIFICATE = np.dtype(
    [
        ("place", "i4"),  # position in the queue, -1: not queued
        ("a", "i4"),  # the bodies of a pair, a < b; a = -1: a free record
        ("b", "i4"),
        ("next_a", "i4"),  # neighbours in a's and b's lists of pairs
        ("prev_a", "i4"),
        ("next_b", "i4"),
        ("prev_b", "i4"),
        ("holds", "i4"),  # how many reasons the broad phase gave for the pair
    ],
    align=True,
)
ENTRY = np.dtype([("tick", "i8"), ("certificate", "i4")], align=True)
TURN = np.dtype([("tick", "i8"), ("vx", "f8"), ("vy", "f8"), ("body", "i4"), ("code", "i4")], align=True)
ROW = np.dtype(
    [("tick", "i8"), ("a", "i4"), ("b", "i4")]
    + [(name, "f8") for name in ("ax", "ay", "avx", "avy", "bx", "by", "bvx", "bvy")],
    align=True,
)
CLOCK = np.dtype(
    [
        ("now", "i8"),
        ("tick", "f8"),  # length of a tick in the scene's time
        ("per_time", "f8"),  # ticks in one unit of the scene's time
        ("skin", "f8"),  # what a body's reach has over its radius
        ("theta", "f8"),  # an inversion deeper than this at the end of a tick is repaired at once
        ("tolerance", "f8"),  # an overlap deeper than this is a missed contact
        ("width", "f8"),
        ("height", "f8"),
        ("bodies", "i8"),
        ("structural", "i8"),  # S, the number of structural certificates
        ("built", "i8"),
        ("queued", "i8"),
        ("free", "i8"),  # head of the free list of pair certificates
        ("pairs", "i8"),
        ("wanted", "i8"),  # pairs for which there was no room: grow the tables and build again
        ("fresh", "i8"),
        ("logged", "i8"),
        ("turn", "i8"),  # the next turn
        ("turns", "i8"),
        ("spins", "i8"),  # structural events since the last progress of time or contact
        ("spin_limit", "i8"),
        ("window", "i8"),  # contacts since the last look at the rate
        ("window_size", "i8"),
        ("window_tick", "i8"),
        ("window_ticks", "i8"),  # fewer ticks than this for a window of contacts: jammed
        ("fault", "i8"),
        ("fault_a", "i8"),
        ("fault_b", "i8"),
    ],
    align=True,
)
COUNTS = np.dtype(
    [
        ("contacts_disc", "i8"),
        ("contacts_wall", "i8"),
        ("turns", "i8"),
        ("structural", "i8"),
        ("pairs_created", "i8"),
        ("updated", "i8"),
        ("queue_max", "i8"),
        ("pairs_max", "i8"),
        ("pairs_sum", "f8"),  # of live pairs, over contacts
        ("late", "i8"),
        ("deepest", "f8"),
        ("turned_energy", "f8"),
    ],
    align=True,
)


class Kernel(NamedTuple):
    """All tables of one simulation; hooks receive it as ``k``."""

    bodies: Records
    mass: Records
    certificates: Records
    queue: Records
    lookup: Records
    fresh: Records
    turns: Records
    log: Records
    clock: Records
    counts: Records


def record_table(dtype: np.dtype[Any], length: int, aligned: int = 0) -> Records:
    """Return a zeroed record array in which the record of number ``aligned`` starts on a cache line."""
    raw = np.zeros(length * dtype.itemsize + 64, dtype=np.uint8)
    offset = -(raw.ctypes.data + aligned * dtype.itemsize) % 64
    return raw[offset : offset + length * dtype.itemsize].view(dtype).view(np.recarray)


def allocate(bodies: int, structural: int, pairs: int, log_rows: int) -> Kernel:
    """Return empty tables for so many bodies, structural certificates, candidate pairs and log rows."""
    certificates = structural + 1 + bodies + pairs
    slots = 1 << max(4, (2 * pairs - 1).bit_length())
    k = Kernel(
        bodies=record_table(BODY, bodies),
        mass=np.ones(bodies),
        certificates=record_table(CERTIFICATE, certificates),
        queue=record_table(ENTRY, certificates, aligned=1),  # four siblings share a line
        lookup=np.full(slots, -1, dtype=np.int32),
        fresh=np.zeros(pairs, dtype=np.int32),
        turns=record_table(TURN, 0),
        log=record_table(ROW, log_rows),
        clock=record_table(CLOCK, 1),
        counts=record_table(COUNTS, 1),
    )
    k.clock[0].bodies = bodies
    k.clock[0].structural = structural
    return k


def clear(k: Kernel) -> None:
    """Forget every certificate and candidate pair; bodies, clock, counts and log stay."""
    clock = k.clock[0]
    table = k.certificates
    table.place = -1
    table.a = -1
    table.b = -1
    first = int(clock.structural) + 1 + int(clock.bodies)
    table.next_a[first:] = np.arange(first + 1, len(table) + 1)
    if len(table) > first:
        table.next_a[-1] = -1
    clock.free = first if len(table) > first else -1
    k.lookup[:] = -1
    k.bodies.first = -1
    for name in ("queued", "pairs", "wanted", "fresh", "built", "spins"):
        clock[name] = 0


def read_only(tables: Tables) -> Tables:
    """Return a named tuple of arrays, each as a view that can only be read."""
    views = [array.view() for array in tables]
    for view in views:
        view.flags.writeable = False
    return type(tables)(*views)
