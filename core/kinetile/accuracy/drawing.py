"""The look that all figures share: fit to print, legible in grey and for the colour-blind."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinetile.errors import MissingExtra

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["WIDTH", "check_figures", "house_style", "new_figure", "save_figure"]

WIDTH = 6.9
"""Inches: the text width of an A4 page."""

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


def check_figures() -> None:
    """Raise MissingExtra where figures cannot be drawn."""
    _matplotlib()


@contextmanager
def house_style() -> Iterator[None]:
    """Within this context figures are drawn, and written, in the look that all share."""
    with _matplotlib().rc_context(_STYLE):
        yield


def new_figure(panels: int = 1, height: float = 3.2, rows: int = 1, **options: Any) -> tuple[Figure, Any]:
    """Return a figure of the page's width with so many panels side by side, and the panel, or the flat array
    of them, row by row.

    Options are those of ``Figure.subplots``. Raises MissingExtra without matplotlib.
    """
    _matplotlib()
    figure: Figure = import_module("matplotlib.figure").Figure((WIDTH, height), layout="constrained")
    axes = figure.subplots(rows, panels, **options)
    return figure, axes if rows == panels == 1 else axes.ravel()


def save_figure(figure: Figure, stem: Path) -> list[Path]:
    """Write a figure as SVG, the same bytes for the same figure, and as PNG to print; return the paths."""
    written = []
    options: dict[str, dict[str, Any]] = {"svg": {"metadata": {"Date": None}}, "png": {"dpi": 300}}
    for ending, extra in options.items():
        written.append(stem.with_name(f"{stem.name}.{ending}"))
        figure.savefig(written[-1], **extra)
    return written


def _matplotlib() -> Any:
    try:
        return import_module("matplotlib")
    except ImportError as error:
        raise MissingExtra("Drawing the figures", "matplotlib", "figures") from error
