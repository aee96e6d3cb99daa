"""The engine: the Python side of the kernel, which does what is to be done between two chunks of the loop."""

from __future__ import annotations

from kinetile.run.engine.agenda import Command
from kinetile.run.engine.by_hand import UNLIMITED, carry_out
from kinetile.run.engine.engine import Engine
from kinetile.run.engine.spans import move_base

__all__ = ["UNLIMITED", "Command", "Engine", "carry_out", "move_base"]
