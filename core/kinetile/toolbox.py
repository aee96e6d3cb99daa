"""What a plugin author builds a phase from: everything a hook may call, in one place.

A hook receives the kernel's tables as ``k`` (see ``kinetile.tables``) and, in a broad phase, its own state as
``s``.
"""

from __future__ import annotations

from kinetile.certificates import falls, falls_many, ticks_after
from kinetile.compiled import hook
from kinetile.faults import TOO_DEEP, blame
from kinetile.flight import positions_now, since_anchor
from kinetile.log import BOTTOM, LEFT, RIGHT, TOP
from kinetile.pairs import add_pair, remove_pair
from kinetile.protocols import BroadPhase, BroadPhaseParts, NarrowPhase, PairParts, WallParts
from kinetile.queue import schedule_own as schedule
from kinetile.tables import NEVER, NOBODY, Kernel, Records

__all__ = [
    "BOTTOM",
    "LEFT",
    "NEVER",
    "NOBODY",
    "RIGHT",
    "TOO_DEEP",
    "TOP",
    "BroadPhase",
    "BroadPhaseParts",
    "Kernel",
    "NarrowPhase",
    "PairParts",
    "Records",
    "WallParts",
    "add_pair",
    "blame",
    "falls",
    "falls_many",
    "hook",
    "positions_now",
    "remove_pair",
    "schedule",
    "since_anchor",
    "ticks_after",
]
