"""The chart of speed against error: two panels, one for each error, over one axis of cost.

Down is faster, left is truer. The kinetic methods' errors are so far from the others that each panel has a
strip beyond a break of its axis: for overlaps of the size of rounding, and for "none missed", which a
logarithm has no place for. A line at the cost of sweep-tiling parts what is faster from what is slower.
Methods are told apart in grey by markers and line styles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from kinetile_accuracy.drawing import is_narrow, legend_below, new_figure
from kinetile_accuracy.parts import grouped
from kinetile_accuracy.stepped.runs import SpeedError
from kinetile_accuracy.wording import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["BEST", "ROUNDING", "draw_speed_error"]


class _Look(NamedTuple):
    name: str
    colour: str
    marker: str
    line: str


_LOOKS = {
    ("kinetic", "naive"): _Look("naive", "#0072B2", "s", ""),
    ("kinetic", "cells"): _Look("cells", "#0072B2", "*", ""),
    ("kinetic", "sap-1d"): _Look("sap-1d", "#0072B2", "^", ""),
    ("kinetic", "sap-2d"): _Look("sap-2d", "#0072B2", "X", ""),
    ("kinetic", "sweep-tiling"): _Look("sweep-tiling", "#0072B2", "o", ""),
    ("snapshots", "sweep"): _Look("snapshots, sweep", "#000000", "o", "-"),
    ("snapshots", "cells"): _Look("snapshots, cells", "#777777", "s", "--"),
    ("engine", "chipmunk"): _Look("Chipmunk", "#009E73", "D", "-."),
    ("engine", "box2d"): _Look("Box2D 2.3, no bullets", "#D55E00", "v", ":"),
    ("engine", "box2d-bullets"): _Look("Box2D 2.3, bullets", "#D55E00", "P", "-"),
}
"""By kind and name: a phase and a way to find pairs in snapshots may have one name."""

BEST = "sweep-tiling"
"""The kinetic method that the others are compared with."""

_LINE = _LOOKS["kinetic", BEST].colour

ROUNDING = 1e-10
"""Overlaps below this, in radii, are roundings, and belong to the strip beyond the break."""


def draw_speed_error(rows: Sequence[SpeedError]) -> Figure:
    """Return the chart of the rows of one kind of scene."""
    figure, panels = new_figure(4, 4.4, sharey=True, width_ratios=(3, 7, 3, 7))
    if is_narrow(figure):
        figure, panels = new_figure(2, 8.0, rows=2, sharey=True, width_ratios=(3, 7))
    figure.supylabel("CPU seconds for one unit of simulated time", fontsize="medium")
    panels[0].set(yscale="log", ylim=(0.6 * min(r.cost for r in rows), 1.7 * max(r.cost for r in rows)))
    for strip, main, error in ((*panels[:2], "deepest"), (*panels[2:], "missed_share")):
        _lay_out(strip, main, error, rows)
        for some in grouped(rows, "kind", "method").values():
            _draw_method(strip, main, error, some)
        best = next(row.cost for row in rows if row.method == BEST)
        for panel in (strip, main):
            panel.axhline(best, color=_LINE, linewidth=0.9, zorder=1)
        for said, side, up in (("slower", "bottom", 2), ("faster", "top", -2)):
            _write(main, said, (main.get_xlim()[0], best), (2, up), va=side, color=_LINE)
    for row in rows:
        if row.method == "sweep":
            said = f"dt = {number(row.dt or 0.0)}"
            _write(panels[1], said, (row.deepest, row.cost), (-4, -2), va="top", ha="right", color="0.25")
    legend_below(figure, 4)
    return figure


def _write(panel: Any, text: str, at: tuple[float, float], shift: tuple[int, int], **look: Any) -> None:
    """Write beside a point, ``shift`` in points of print."""
    options = {"xytext": shift, "textcoords": "offset points", "fontsize": 6.5}
    panel.annotate(text, at, **(options | look)).set_in_layout(False)


def _lay_out(strip: Any, main: Any, error: str, rows: Sequence[SpeedError]) -> None:
    """Set the axes of a panel and its strip, and mark the break between them."""
    values = [getattr(row, error) for row in rows if getattr(row, error) > ROUNDING]
    least, most = min(values, default=1e-3), max(values, default=1.0)
    main.set(xscale="log")
    if error == "deepest":
        main.set(xlim=(least / 20.0, most * 2.5), xlabel="deepest overlap of two discs, in radii")
        strip.set(xscale="log", xlim=(2e-16, ROUNDING), xticks=[1e-15, 1e-12])
    else:
        main.set(xlim=(least / 6.0, most * 3.0), xlabel=f"first encounters missed (of {rows[0].encounters})")
        ticks = [10.0**k for k in range(-6, 1) if 1.5 * main.get_xlim()[0] <= 10.0**k <= main.get_xlim()[1]]
        main.set_xticks(ticks, [f"{100 * tick:g} %" for tick in ticks])
        strip.set(xlim=(-1.0, 1.0))
        strip.set_xticks([0.0], ["none"])
    strip.set(facecolor="#EEF5FA")
    main.set(facecolor="none")
    main.spines["left"].set_visible(False)
    main.tick_params(axis="y", length=0, labelleft=False)
    look: dict[str, Any] = {"marker": [(-1, -2), (1, 2)], "markersize": 7, "color": "0.3", "clip_on": False}
    for panel, end in ((strip, 1.0), (main, 0.0)):
        panel.minorticks_off()
        panel.grid(True, axis="y")
        (mark,) = panel.plot([end], [0.0], transform=panel.transAxes, **look)
        mark.set_in_layout(False)


def _draw_method(strip: Any, main: Any, error: str, rows: Sequence[SpeedError]) -> None:
    """Draw the points of a method, joined where it has steps; those beyond the break go to the strip."""
    look = _LOOKS.get((rows[0].kind, rows[0].method)) or _Look(rows[0].method, "#56B4E9", "X", ":")
    rows = sorted(rows, key=lambda row: row.dt or 0.0)
    style: dict[str, Any] = {"color": look.colour, "marker": look.marker, "clip_on": False}
    kinetic = rows[0].kind == "kinetic"
    # An edge tells one from another that it lies over.
    solid = {"markersize": 7.0, "markeredgecolor": "white", "markeredgewidth": 0.6}
    style |= solid if kinetic else {"markersize": 4.0, "markerfacecolor": "white"}
    style["label"] = look.name
    beyond = [row for row in rows if getattr(row, error) <= ROUNDING]
    if beyond:
        places = [max(row.deepest, 2e-16) if error == "deepest" else 0.0 for row in beyond]
        strip.plot(places, [row.cost for row in beyond], linestyle="", zorder=4, **style)
    if len(beyond) < len(rows):
        x = [value if (value := getattr(row, error)) > ROUNDING else math.nan for row in rows]
        main.plot(x, [row.cost for row in rows], linestyle=look.line, linewidth=1.2, zorder=3, **style)
