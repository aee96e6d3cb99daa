"""The plugin of this package: two structures of the thesis that kinetile itself does not have."""

from __future__ import annotations

import kinetile as kt

__all__ = ["kinetile_broad_phases"]


@kt.hookimpl
def kinetile_broad_phases() -> list[kt.BroadPhaseSpec]:
    """Registers the structures of this package."""
    line = "points on a line, kept in order: a kinetic data structure without collisions (thesis, section 2)"
    written = "sweep-tiling with the meeting as section 4.3 of the thesis has it, to be seen to break"
    return [
        kt.BroadPhaseSpec("sorted-list", "kinetile_thesis.sorted_list:SortedList", line, api=2),
        kt.BroadPhaseSpec("tiling-as-written", "kinetile_thesis.as_written:TilingAsWritten", written, api=2),
    ]
