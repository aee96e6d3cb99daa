"""The narrow phase squares, as kinetile finds it; its own module is imported when somebody selects it."""

from __future__ import annotations

import kinetile as kt

__all__ = ["kinetile_narrow_phases"]


@kt.hookimpl
def kinetile_narrow_phases() -> list[kt.NarrowPhaseSpec]:
    """Name the narrow phase that this package brings."""
    summary = "squares that do not rotate, elastic"
    return [kt.NarrowPhaseSpec("squares", "kinetile_squares.squares:Squares", summary, role="pair", api=2)]
