"""Judging a phase in processes of their own: whatever it does, the one that asked goes on.

A phase can crash the interpreter, run for ever or take all memory. So the checks run in a child with limits
(``child``, ``processes``); when it dies, the check that it was at is told what it died of (``deaths``,
``stacks``), and a new child does the rest (``hearing``).
"""

from __future__ import annotations

__all__: list[str] = []
