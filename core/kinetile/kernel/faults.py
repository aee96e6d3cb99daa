"""Faults: what a hook reports when something cannot be true. The loop ends at once and Python raises a
sentence."""

from __future__ import annotations

from kinetile.kernel.compiled import hook
from kinetile.kernel.tables import Kernel

__all__ = [
    "BAD_CERTIFICATE",
    "BAD_COUNT",
    "BAD_PAIR",
    "JAMMED",
    "LATE_CONTACT",
    "MY_FAULT",
    "NOT_FINITE",
    "STALLED",
    "TOO_DEEP",
    "UNKNOWN_PAIR",
    "blame",
]

BAD_PAIR, UNKNOWN_PAIR, LATE_CONTACT, TOO_DEEP, JAMMED, STALLED, NOT_FINITE = range(1, 8)
BAD_CERTIFICATE, BAD_COUNT = 8, 9

MY_FAULT = 1 << 16
"""The first fault of a broad phase's own, for which it has a sentence (``BroadPhaseParts.faults``); the next
one is ``MY_FAULT + 1``."""


@hook
def blame(k: Kernel, fault: int, a: int, b: int) -> None:
    """Report a fault of bodies ``a`` and ``b``; the first one counts."""
    clock = k.clock[0]
    if clock.fault == 0:
        clock.fault = fault
        clock.fault_a = a
        clock.fault_b = b
