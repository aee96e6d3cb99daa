"""Shows what a simulation models and what it leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["explanation_lines"]

_UNITS = {
    "time_unit": "of the scene's time",
    "tick": "of the scene's time",
    "speed_bound": "length / time",
    "skin": "length",
    "skin_in_radii": "of the smallest radius",
    "structural_error": "length",
}


def explanation_lines(explanation: Mapping[str, Any]) -> list[str]:
    """Return ``Simulation.explain()`` as lines of text: each list under its heading, then the numbers."""
    lines: list[str] = []
    for heading, content in explanation.items():
        lines.append(f"{heading}:")
        if isinstance(content, Mapping):
            width = max(map(len, content), default=0)
            for name, value in content.items():
                shown = f"{value:.6g}" if isinstance(value, float) else f"{value:,}"
                label = name.replace("_", " ")
                lines.append(f"  {label:{width}}  {shown} {_UNITS.get(name, '')}".rstrip())
        else:
            lines += [f"  - {sentence}" for sentence in content]
    return lines
