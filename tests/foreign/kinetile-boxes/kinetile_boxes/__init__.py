"""The broad phase boxes, as kinetile finds it; its own module is imported when somebody selects it."""

from __future__ import annotations

import kinetile as kt

__all__ = ["kinetile_broad_phases"]


@kt.hookimpl
def kinetile_broad_phases() -> list[kt.BroadPhaseSpec]:
    """Name the broad phase that this package brings."""
    summary = "a grid for mixed sizes: a body is in all cells that its bounding box touches"
    return [kt.BroadPhaseSpec("boxes", "kinetile_boxes.boxes:Boxes", summary, api=2)]
