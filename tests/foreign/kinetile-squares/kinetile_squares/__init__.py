"""The narrow phase squares, as kinetile finds it; its own module is imported when somebody selects it."""

import kinetile as kt

__all__ = ["kinetile_narrow_phases"]


@kt.hookimpl
def kinetile_narrow_phases() -> list[kt.NarrowPhaseSpec]:
    """Names the narrow phase that this package brings."""
    summary = "squares that do not rotate, elastic"
    target = "kinetile_squares.squares:Squares"
    return [kt.NarrowPhaseSpec("squares", target, summary, role="pair", shapes=("box",), api=2)]
