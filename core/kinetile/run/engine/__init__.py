"""The engine: the Python side of the kernel, which does what is to be done between two chunks of the loop."""

from __future__ import annotations

from kinetile.run.engine.commands.agenda import Command, Rows
from kinetile.run.engine.commands.by_hand import UNLIMITED, carry_out, command_rows
from kinetile.run.engine.commands.given import Given
from kinetile.run.engine.engine import Engine
from kinetile.run.engine.spans import move_base, skip

__all__ = [
    "UNLIMITED",
    "Command",
    "Engine",
    "Given",
    "Rows",
    "carry_out",
    "command_rows",
    "move_base",
    "skip",
]
