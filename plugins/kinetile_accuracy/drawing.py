"""Figures in one common look: fit to print, legible in grey and for colour-blind readers."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from kinetile.instruments import figure_bytes, write_file
from kinetile.lazy import needed
from kinetile_accuracy.sections import Figure

WIDTH = 6.9
"""Inches: the text width of an A4 page."""

LOOKS = (
    ("#0072B2", "o", "-"),
    ("#D55E00", "s", "--"),
    ("#000000", "^", ":"),
    ("#009E73", "D", "-."),
    ("#CC79A7", "v", (0, (6, 1))),
    ("#56B4E9", "P", (0, (3, 1, 1, 1, 1, 1))),
)
"""Colour, marker and line of the first, second, ... curve."""

_STYLE: dict[str, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": "0.88",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "hatch.linewidth": 0.6,
    "svg.hashsalt": "kinetile",
}


def matplotlib_module(name: str = "matplotlib") -> Any:
    """Returns matplotlib, or a module of it; raises MissingExtra without it."""
    return needed("Drawing the figures", "matplotlib", "figures", name)


def house_style() -> AbstractContextManager[None]:
    """Within this context figures are drawn, and written, in the common style."""
    context: AbstractContextManager[None] = matplotlib_module().rc_context(_STYLE)
    return context


def new_figure(panels: int = 1, height: float = 3.2, rows: int = 1, **options: Any) -> tuple[Figure, Any]:
    """Returns a figure of the page's width with some panels side by side, and the panel, or the flat array of
    panels, row by row; options go to ``Figure.subplots``. Raises MissingExtra without matplotlib."""
    figure: Figure = matplotlib_module("matplotlib.figure").Figure((WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, panels, **options)
    return figure, axes if rows == panels == 1 else axes.ravel()


def curve(panel: Any, x: Sequence[float], y: Sequence[float], look: int, **options: Any) -> None:
    """Draws the curve of a number in ``LOOKS``."""
    colour, marker, line = LOOKS[look]
    usual = {"marker": marker, "linestyle": line, "markersize": 4, "linewidth": 1.2}
    panel.plot(x, y, **({"color": colour} | usual | options))


def legend_below(figure: Figure, columns: int) -> None:
    """Puts one legend of all curves below the panels."""
    shown = [axes.get_legend_handles_labels() for axes in figure.axes]
    unique = {label: line for lines, labels in shown for label, line in zip(labels, lines, strict=True)}
    figure.legend(unique.values(), unique.keys(), loc="outside lower center", ncols=columns)


def save_figure(figure: Figure, stem: Path, description: str = "") -> list[Path]:
    """Writes a figure as SVG, with a description in its metadata, and as PNG to print; returns the paths."""
    svg, png = (stem.with_name(f"{stem.name}.{ending}") for ending in ("svg", "png"))
    write_file(svg, as_svg(figure, description))
    write_file(png, figure_bytes(figure, "png", dpi=300))
    return [svg, png]


def as_svg(figure: Figure, description: str = "") -> bytes:
    """Returns a figure as SVG, the same bytes for the same figure, with a description in its metadata."""
    undated = {"Date": None, "Description": description or None}
    return figure_bytes(figure, "svg", metadata=undated)
