"""The pictures of the part on queries: a line for each family, a mark for each form."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from kinetile_accuracy.drawing import LOOKS, is_narrow, legend_below, new_figure
from kinetile_accuracy.queries.verdicts import QueryRow

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_depths", "draw_errors"]

_FORMS = ("citardauq", "naive", "kernel", "cross product")
"""In the order of the looks."""


def draw_depths(rows: list[QueryRow]) -> Figure:
    """Draw the deepest overlap of discs anchored at an answer, in units of the proved bound."""
    figure, panel = _panel(rows)
    edge = 0.02
    for place, row in _places(rows):
        _mark(panel, row, max(row.depth_rho, edge), place)
    panel.axvline(1.0, color="black", linewidth=0.9, linestyle="--", zorder=1)
    panel.set_xlim(left=edge / 1.3)
    panel.set_xlabel("deepest overlap of discs anchored at the answer / rho")
    legend_below(figure, len(_FORMS))
    return figure


def draw_errors(rows: list[QueryRow]) -> Figure:
    """Draw what the answers are off the exact tick: the 99th percentile and the largest."""
    figure, panel = _panel(rows)
    edge = 3e-17
    for place, row in _places(rows):
        usual, worst = row.error_p99 or 0.0, row.error_max or 0.0
        colour = LOOKS[_FORMS.index(row.form)][0]
        panel.plot([max(usual, edge), max(worst, edge)], [place, place], color=colour, linewidth=1.0)
        _mark(panel, row, max(usual, edge), place)
    panel.set_xlim(left=edge / 1.5)
    panel.set_xlabel("time off the exact tick × closing speed / R")
    legend_below(figure, len(_FORMS))
    return figure


def _panel(rows: list[QueryRow]) -> tuple[Figure, Any]:
    """Return a figure with a panel whose lines are the families, from the top down."""
    families = _families(rows)
    figure, panel = new_figure(1, height=1.0 + 0.34 * len(families))
    panel.set(xscale="log", ylim=(len(families) - 0.5, -0.5))
    panel.set_yticks(range(len(families)), families)
    panel.tick_params(axis="y", length=0, labelsize=6.5 if is_narrow(figure) else 8.0)
    panel.grid(False, axis="y")
    for line in range(1, len(families)):
        panel.axhline(line - 0.5, color="0.88", linewidth=0.6, zorder=0)
    return figure, panel


def _families(rows: list[QueryRow]) -> list[str]:
    return list(dict.fromkeys(row.family for row in rows))


def _places(rows: list[QueryRow]) -> list[tuple[float, QueryRow]]:
    """Return each row with its height: its family's line, the forms a little apart."""
    line: Callable[[str], int] = _families(rows).index
    forms = [form for form in _FORMS if any(row.form == form for row in rows)]
    step = 0.7 / len(forms)
    return [(line(row.family) + step * (forms.index(row.form) - (len(forms) - 1) / 2), row) for row in rows]


def _mark(panel: Any, row: QueryRow, value: float, place: float) -> None:
    colour, marker, _ = LOOKS[_FORMS.index(row.form)]
    fill = colour if row.form == "kernel" else "white"
    panel.plot(
        value, place, marker, color=colour, markerfacecolor=fill, markersize=4, label=row.form, clip_on=False
    )
