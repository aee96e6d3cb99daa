"""The main loop: its queue, its predictions, and what it does with the head."""

from __future__ import annotations

from kinetile.kernel.loop.advance import (
    BLOCKED,
    BUDGET_SPENT,
    COMMAND_DUE,
    CONTACTS_REACHED,
    CROWDED,
    FASTER,
    FAULT,
    LOG_FULL,
    NO_ROOM,
    TIME_REACHED,
    WATCHED,
    advance,
)

__all__ = [
    "BLOCKED",
    "BUDGET_SPENT",
    "COMMAND_DUE",
    "CONTACTS_REACHED",
    "CROWDED",
    "FASTER",
    "FAULT",
    "LOG_FULL",
    "NO_ROOM",
    "TIME_REACHED",
    "WATCHED",
    "advance",
]
