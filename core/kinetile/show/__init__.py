"""What people look at: ``picture`` draws a moment of a run, with the structure of its broad phase; ``player``
makes a page in which a run plays, exactly, from its flight plans."""

from __future__ import annotations

__all__: list[str] = []
