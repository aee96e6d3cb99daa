"""Commands that judge phases: conform, replay, compare, mutate."""

from __future__ import annotations

__all__: list[str] = []
