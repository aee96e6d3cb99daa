"""The pictures of the part on queries: a line for each family, a mark for each form."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from kinetile.accuracy.drawing import new_figure
from kinetile.accuracy.queries.truth import ALLOWED
from kinetile.accuracy.queries.verdicts import QueryRow

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_depths", "draw_errors"]

_LOOKS = {
    "kernel": ("#000000", "o", "black"),
    "naive": ("#D55E00", "s", "white"),
    "citardauq": ("#0072B2", "^", "white"),
    "cross product": ("#009E73", "D", "white"),
}
"""Colour, marker and what it is filled with; also told apart in grey."""


def draw_depths(rows: list[QueryRow]) -> Figure:
    """Draw the deepest overlap at a computed contact, in units of 2^-53 times the separation."""
    figure, panel = _panel(rows)
    edge = 0.3
    for place, row in _places(rows):
        _mark(panel, row, max(row.depth_separation, edge), place)
    panel.axvline(ALLOWED, color="black", linewidth=0.9, linestyle="--", zorder=1)
    panel.annotate(
        f" allowed: {ALLOWED:g}",
        (ALLOWED, 1.0),
        (0, 2),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        va="bottom",
    )
    panel.set_xlim(left=edge / 1.3)
    panel.set_xlabel("deepest overlap at the computed contact / (2$^{-53}$ × separation at the anchor)")
    _legend(figure, rows)
    return figure


def draw_errors(rows: list[QueryRow]) -> Figure:
    """Draw the error of the time of contact: the 99th percentile and the largest."""
    figure, panel = _panel(rows)
    edge = 3e-17
    for place, row in _places(rows):
        usual, worst = row.error_p99 or 0.0, row.error_max or 0.0
        colour = _LOOKS[row.form][0]
        panel.plot([max(usual, edge), max(worst, edge)], [place, place], color=colour, linewidth=1.0)
        _mark(panel, row, max(usual, edge), place)
    panel.set_xlim(left=edge / 1.5)
    panel.set_xlabel("error of the time × closing speed / R  (mark: 99th percentile; line: to the largest)")
    _legend(figure, rows)
    return figure


def _panel(rows: list[QueryRow]) -> tuple[Figure, Any]:
    """Return a figure with a panel whose lines are the families, from the top down."""
    families = _families(rows)
    figure, panel = new_figure(1, height=1.0 + 0.34 * len(families))
    panel.set(xscale="log", ylim=(len(families) - 0.5, -0.5))
    panel.set_yticks(range(len(families)), families)
    panel.tick_params(axis="y", length=0)
    panel.grid(False, axis="y")
    for line in range(1, len(families)):
        panel.axhline(line - 0.5, color="0.88", linewidth=0.6, zorder=0)
    return figure, panel


def _families(rows: list[QueryRow]) -> list[str]:
    return list(dict.fromkeys(row.family for row in rows))


def _places(rows: list[QueryRow]) -> list[tuple[float, QueryRow]]:
    """Return each row with its height: its family's line, the forms a little apart."""
    line: Callable[[str], int] = _families(rows).index
    forms = [form for form in _LOOKS if any(row.form == form for row in rows)]
    step = 0.7 / len(forms)
    return [(line(row.family) + step * (forms.index(row.form) - (len(forms) - 1) / 2), row) for row in rows]


def _mark(panel: Any, row: QueryRow, value: float, place: float) -> None:
    colour, marker, fill = _LOOKS[row.form]
    panel.plot(
        value, place, marker, color=colour, markerfacecolor=fill, markersize=4, label=row.form, clip_on=False
    )


def _legend(figure: Figure, rows: list[QueryRow]) -> None:
    handles, labels = figure.axes[0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    figure.legend(unique.values(), unique.keys(), loc="outside upper center", ncols=len(unique))
