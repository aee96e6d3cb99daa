"""Commands of an engine: those still to come, those given by hand and carried out at once, and what was
given."""

from __future__ import annotations

__all__: list[str] = []
