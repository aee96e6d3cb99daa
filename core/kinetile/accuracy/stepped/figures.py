"""The chart of speed against error: two panels, one for each error, over one axis of cost.

Down is faster, left is truer. The kinetic methods' errors are so far from the others that each panel has a
strip beyond a break of its axis: for overlaps of the size of rounding, and for "none missed", which a
logarithm has no place for. A line at the cost of sweep-tiling parts what is faster from what is slower.
Methods are named at their curves, where there is room, and told apart in grey by markers and line styles.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from kinetile.accuracy.drawing import is_narrow, new_figure
from kinetile.accuracy.parts import grouped
from kinetile.accuracy.stepped.runs import SpeedError
from kinetile.accuracy.wording import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["ROUNDING", "draw_speed_error"]


class _Look(NamedTuple):
    name: str
    short: str
    colour: str
    marker: str
    line: str


_LOOKS = {
    "naive": _Look("naive", "naive", "#0072B2", "s", ""),
    "sap-1d": _Look("sap-1d", "sap-1d", "#0072B2", "^", ""),
    "sweep-tiling": _Look("sweep-tiling", "sweep-tiling", "#0072B2", "o", ""),
    "sweep": _Look("snapshots, sweep", "snapshots", "#000000", "o", "-"),
    "cells": _Look("snapshots, cells", "snapshots", "#777777", "s", "--"),
    "chipmunk": _Look("Chipmunk", "Chipmunk", "#009E73", "D", "-."),
    "box2d": _Look("Box2D 2.3,\nno bullets", "no bullets", "#D55E00", "v", ":"),
    "box2d-bullets": _Look("Box2D 2.3,\nbullets", "bullets", "#D55E00", "P", "-"),
}
_BEST = "sweep-tiling"
_KINETIC = "#0072B2"
_HEIGHT = 4.2
_COST = "CPU seconds for one unit of simulated time"
_PLACES = (
    (0.085, 0.11, 0.13, 0.86),
    (0.225, 0.11, 0.295, 0.86),
    (0.555, 0.11, 0.13, 0.86),
    (0.695, 0.11, 0.295, 0.86),
)
_NARROW_PLACES = (
    (0.15, 0.56, 0.2, 0.42),
    (0.37, 0.56, 0.58, 0.42),
    (0.15, 0.06, 0.2, 0.42),
    (0.37, 0.06, 0.58, 0.42),
)
"""Left, bottom, width and height of each panel, in sizes of the figure: a strip, its main part, twice."""
ROUNDING = 1e-10
"""Overlaps below this belong to the strip beyond the break."""


def draw_speed_error(rows: Sequence[SpeedError]) -> Figure:
    """Return the chart of the rows of one kind of scene."""
    figure, panels = new_figure(4, height=_HEIGHT, sharey=True)
    figure.set_layout_engine("none")  # names stand outside of their axes on purpose
    places = _PLACES
    if is_narrow(figure):
        figure.set_figheight(2.0 * _HEIGHT)
        places = _NARROW_PLACES
        panels[2].tick_params(axis="y", labelleft=True)
        panels[2].set(ylabel=_COST)
    for panel, place in zip(panels, places, strict=True):
        panel.set_position(place)
    panels[0].set(yscale="log", ylabel=_COST)
    panels[0].set(ylim=(0.6 * min(row.cost for row in rows), 1.7 * max(row.cost for row in rows)))
    for strip, main, error in ((*panels[:2], "deepest"), (*panels[2:], "missed_share")):
        _lay_out(strip, main, error, rows)
        for some in grouped(rows, "method").values():
            _draw_method(strip, main, error, some)
        _draw_equal_cost(strip, main, rows)
    room = _Room(figure, panels)
    _name_sides(room, panels[1::2], rows)
    _name_curves(room, panels[1], "deepest", rows)
    _name_curves(room, panels[3], "missed_share", rows)
    _name_steps(room, panels[1], rows)
    return figure


def _lay_out(strip: Any, main: Any, error: str, rows: Sequence[SpeedError]) -> None:
    """Set the axes of a panel and its strip, and mark the break between them."""
    values = [getattr(row, error) for row in rows if getattr(row, error) > ROUNDING]
    least, most = min(values, default=1e-3), max(values, default=1.0)
    main.set(xscale="log")
    if error == "deepest":
        main.set(xlim=(least / 10.0, most * 9.0), xlabel="deepest overlap of two discs, in radii")
        strip.set(xscale="log", xlim=(2e-16, ROUNDING), xticks=[1e-15, 1e-12])
    else:
        main.set(
            xlim=(least / 6.0, min(most * 9.0, max(1.2 * most, 0.9))),
            xlabel=f"first encounters missed (of {rows[0].encounters})",
        )
        ticks = [10.0**k for k in range(-6, 1) if 1.5 * main.get_xlim()[0] <= 10.0**k <= main.get_xlim()[1]]
        main.set_xticks(ticks, [f"{100 * tick:g} %" for tick in ticks])
        strip.set(xlim=(-0.28, 1.0))
        strip.set_xticks([0.0], ["none"])
    strip.set(facecolor="#EEF5FA")
    main.set(facecolor="none")
    main.spines["left"].set_visible(False)
    main.tick_params(axis="y", length=0, labelleft=False)
    for panel, end in ((strip, 1.0), (main, 0.0)):
        panel.minorticks_off()
        panel.grid(True, axis="y")
        panel.plot(
            [end],
            [0.0],
            transform=panel.transAxes,
            marker=[(-1, -2), (1, 2)],
            markersize=7,
            color="0.3",
            clip_on=False,
        )


def _draw_method(strip: Any, main: Any, error: str, rows: Sequence[SpeedError]) -> None:
    """Draw the points of a method, joined where it has steps; those beyond the break go to the strip."""
    look = _look(rows[0].method)
    kinetic = rows[0].kind == "kinetic"
    rows = sorted(rows, key=lambda row: row.dt or 0.0)
    style = {"color": look.colour, "marker": look.marker, "clip_on": False}
    style |= {"markersize": 6.5} if kinetic else {"markersize": 4.0, "markerfacecolor": "white"}
    beyond = [row for row in rows if getattr(row, error) <= ROUNDING]
    places = [max(row.deepest, 2e-16) if error == "deepest" else 0.0 for row in beyond]
    strip.plot(places, [row.cost for row in beyond], linestyle="", zorder=4, **style)
    x = [value if (value := getattr(row, error)) > ROUNDING else math.nan for row in rows]
    main.plot(x, [row.cost for row in rows], linestyle=look.line, linewidth=1.2, zorder=3, **style)
    if kinetic and beyond:
        best = rows[0].method == _BEST  # whose name stands below the line of its cost
        place = {"va": "top", "weight": "bold"} if best else {"va": "center"}
        shift = (6.0, -2.0 if best else 0.0)
        _write(strip, look.name, (places[0], rows[0].cost), shift, color=look.colour, **place)


def _draw_equal_cost(strip: Any, main: Any, rows: Sequence[SpeedError]) -> None:
    """Draw a line at the cost of sweep-tiling."""
    for panel in (strip, main):
        panel.axhline(_best_cost(rows), color=_KINETIC, linewidth=0.9, zorder=1)


def _name_sides(room: _Room, mains: Iterable[Any], rows: Sequence[SpeedError]) -> None:
    """Say what lies above and below the line of equal cost, near its left end."""
    for main in mains:
        left, right = main.get_xlim()
        ats = [(left * (right / left) ** (0.03 + 0.01 * k), _best_cost(rows)) for k in range(90)]
        look: dict[str, Any] = {"color": _KINETIC, "fontsize": 7}
        room.write(main, "slower", ats, [(0.0, 2.0)], va="bottom", **look)
        room.write(main, "faster", ats, [(0.0, -3.0)], va="top", **look)


def _name_curves(room: _Room, main: Any, error: str, rows: Sequence[SpeedError]) -> None:
    """Write the name of each curve beside one of its points, and a name that two curves share once."""
    named = set()
    for method in dict.fromkeys(row.method for row in reversed(rows) if row.kind != "kinetic"):
        look = _look(method)
        name = look.name if error == "deepest" else look.short
        curve = sorted((row for row in rows if row.method == method), key=lambda row: row.dt or 0.0)
        ats = [(getattr(row, error), row.cost) for row in curve if getattr(row, error) > ROUNDING]
        if name not in named:
            room.write(
                main, name, ats, _LEFT + _RIGHT if method == "sweep" else _RIGHT + _LEFT, color=look.colour
            )
        named.add(name)


def _name_steps(room: _Room, main: Any, rows: Sequence[SpeedError]) -> None:
    """Write the step beside those points of the snapshots' curve that have room for it."""
    for row in rows:
        if row.method == "sweep":
            at = (row.deepest, row.cost)
            room.write(
                main,
                f"dt = {number(row.dt or 0.0)}",
                [at],
                _LEFT + _RIGHT,
                needed=False,
                color="0.25",
                fontsize=6.5,
            )


_LEFT = ((-6.0, -8.0), (-7.0, -2.0), (-7.0, 4.0), (-4.0, 8.0))
_RIGHT = ((7.0, 3.0), (7.0, -3.0), (7.0, -9.0))
"""Where a text may stand beside its point, in points of print."""


class _Room:
    """Finds room for texts in panels: free of curves, markers and of the other texts."""

    def __init__(self, figure: Figure, panels: Iterable[Any]) -> None:
        agg = import_module("matplotlib.backends.backend_agg").FigureCanvasAgg
        self._renderer = agg(figure).get_renderer()
        self._boxes = []
        self._points: list[tuple[float, float]] = []
        for panel in panels:
            self._boxes += [self._box(text) for text in panel.texts]
            for line in panel.lines:
                if line.get_transform() == panel.transData:
                    path = line.get_transform().transform(line.get_xydata())
                    self._points += [tuple(point) for point in path if math.isfinite(point[0])]
                    if line.get_linestyle() != "None":
                        for start, end in pairwise(path):
                            self._points += [tuple(start + (end - start) * k / 30) for k in range(30)]

    def write(
        self,
        panel: Any,
        text: str,
        ats: Iterable[tuple[float, float]],
        shifts: Iterable[tuple[float, float]],
        *,
        needed: bool = True,
        **look: Any,
    ) -> None:
        """Write at the first place that is free; if none is, at the first, or not at all if not needed."""
        ats = list(ats)
        places = [(at, shift) for shift in shifts for at in ats]
        for at, shift in places:
            written = _write(panel, text, at, shift, **look)
            box = self._box(written)
            inside = panel.bbox.x0 <= box.x0 <= box.x1 <= panel.bbox.x1 + 8
            inside &= panel.bbox.y0 <= box.y0 <= box.y1 <= panel.bbox.y1
            if inside and not any(box.overlaps(other) for other in self._boxes) and not self._hit(box):
                self._boxes.append(box)
                return
            written.remove()
        if needed and places:
            self._boxes.append(self._box(_write(panel, text, *places[0], **look)))

    def _box(self, text: Any) -> Any:
        return text.get_window_extent(self._renderer).padded(3.0, 0.0)

    def _hit(self, box: Any) -> bool:
        return any(box.x0 - 2 < x < box.x1 + 2 and box.y0 - 2 < y < box.y1 + 2 for x, y in self._points)


def _write(panel: Any, text: str, at: tuple[float, float], shift: tuple[float, float], **look: Any) -> Any:
    """Write beside a point, ``shift`` in points of print; texts to the left of it end there."""
    look = {"ha": "right" if shift[0] < 0.0 else "left", "zorder": 6} | look
    return panel.annotate(text, at, xytext=shift, textcoords="offset points", **look)


def _best_cost(rows: Sequence[SpeedError]) -> float:
    return next(row.cost for row in rows if row.method == _BEST)


def _look(method: str) -> _Look:
    return _LOOKS.get(method) or _Look(method, method, "#56B4E9", "X", ":")
