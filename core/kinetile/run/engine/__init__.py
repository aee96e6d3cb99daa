"""The engine: the Python side of the kernel, which does what is to be done between two chunks of the loop."""

from __future__ import annotations

from kinetile.run.engine.engine import UNLIMITED, Engine

__all__ = ["UNLIMITED", "Engine"]
