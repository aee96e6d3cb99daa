"""The part ``chart`` of the report: the cost of a unit of simulated time, and the errors of a method in it.

A kinetic method has no step: it is a point. A method in steps is a curve. Two errors are shown: *the deepest
overlap* of two discs in the snapshots of the method in a unit of time, in radii, and *first encounters
missed*: the share of these (``methods``) that the method does not have, over many scenes.
"""

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

import kinetile as kt
from kinetile.errors import MissingExtra
from kinetile_accuracy import sections
from kinetile_accuracy.drawing import legend_below, new_figure
from kinetile_accuracy.sections import Column, grouped, number
from kinetile_accuracy.stepped.engines import ENGINES, TITLES, engine_settings
from kinetile_accuracy.stepped.methods import ROUNDS, UNTIL, Method, SpeedError, measure_rows
from kinetile_accuracy.stepped.snapshots import Finder

ROUNDING = 1e-10
"""Overlaps below this, in radii, are roundings, and belong to the strip beyond the chart's break."""

SCENE = ("bodies", "density")
"""The fields of a row that identify its scenes."""
FINDERS: tuple[Finder, ...] = ("sweep", "cells")
_STEPS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4)
_SCENES = ((100, 0.25), (400, 0.25), (100, 0.5), (400, 0.5))

NAMES = {"sweep": "the snapshot method (sweep)", "cells": "the snapshot method (cells)"} | TITLES


@dataclass(frozen=True)
class Setting:
    """The settings of an engine, in words."""

    engine: Annotated[str, Column("its name", "engine")]
    configured: Annotated[str, Column("all of its settings", "set to")]


class Effort(NamedTuple):
    """The measurements within a budget: (bodies, density) of the recipe ``grid``, the number of timed scenes
    of each, the approximate number of first encounters, and the steps of snapshots and of engines."""

    scenes: tuple[tuple[int, float], ...]
    seeds: int
    encounters: int
    steps: tuple[float, ...]
    engine_steps: tuple[float, ...]


EFFORTS: dict[sections.Budget, Effort] = {
    "quick": Effort(_SCENES[:1], 2, 2000, (*_STEPS, 1e-4, 3e-5, 1e-5), _STEPS),
    "normal": Effort(_SCENES, 3, 6000, (*_STEPS, 1e-4, 3e-5), _STEPS[:4]),
    "full": Effort(_SCENES, 5, 12000, (*_STEPS, 1e-4, 3e-5, 1e-5), (*_STEPS, 1e-4)),
}


def measure(budget: sections.Budget, progress: sections.ReportProgress) -> sections.Section:
    """Measures all methods; returns the part of the report that shows speed against error."""
    effort = EFFORTS[budget]
    engines, left_out = _installed()
    methods = [Method("kinetic", name) for name in kt.registry().names("broad phase")]
    methods += [Method("snapshots", finder, dt) for finder in FINDERS for dt in effort.steps]
    methods += [Method("engine", engine, dt) for engine in engines for dt in effort.engine_steps]
    found: list[list[SpeedError]] = []

    def show(done: int, total: int) -> None:
        before, whole = len(found) * total, len(effort.scenes) * total
        progress("speed against error, {} discs at {:g}".format(*scene), before + done, whole)

    for scene in effort.scenes:
        how: dict[str, Any] = {"seeds": effort.seeds, "encounters": effort.encounters}
        found.append(measure_rows(methods, *scene, progress=show, **how))
    rows = tuple(row for some in found for row in some)
    tables = [sections.Table("methods", "The cost of a unit of simulated time, and its errors.", rows)]
    if engines:
        tables.append(sections.Table("engines", "The settings of the engines.", tuple(engines.values())))
    return sections.Section(
        name="chart",
        title="Speed against error",
        about=(
            "Discs on a grid are set off at the same speed in random directions (recipe grid). Cost is the "
            f"CPU time of the loop for a unit of simulated time (runs go to {UNTIL:g}): the median of at "
            f"least {ROUNDS} runs on each of {effort.seeds} scenes, less set-up and compilation. Snapshots "
            "are the pseudo-dynamic method, in compiled Python like the kinetic methods: every dt all "
            "discs are moved, and pairs that overlap and approach get the elastic impulse; pairs are found "
            "by static sweep-and-prune with insertion sort (sweep) or by a grid (cells); walls are exact. "
            "The deepest overlap is of two discs, in radii, as far as the method itself sees it: at its "
            "snapshots, or at contacts for kinetic methods. First encounters are contacts of two discs that "
            "have touched neither disc nor wall before, taken from the kinetic run under naive; a method "
            "misses one that it does not have as the first contact of both discs, where contacts of one "
            "snapshot count as simultaneous (which favours long steps)."
        ),
        findings=findings(rows),
        claims=claims(rows),
        tables=tuple(tables),
        pictures=tuple(map(_picture, found)),
        left_out=left_out,
    )


def _installed() -> tuple[dict[str, Setting], tuple[str, ...]]:
    engines: dict[str, Setting] = {}
    left_out: list[str] = []
    for engine in ENGINES:
        try:
            engines[engine] = Setting(NAMES[engine], engine_settings(engine))
        except MissingExtra as error:
            left_out.append(str(error))
    return engines, tuple(dict.fromkeys(left_out))


def _picture(rows: Sequence[SpeedError]) -> sections.ReportFigure:
    bodies, density = rows[0].bodies, rows[0].density
    return sections.ReportFigure(
        f"{bodies}-discs-{density:.0%}".replace("%", "-percent"),
        f"{bodies} discs at density {density:g}: further down is faster, further left is truer. Kinetic "
        "methods are points; methods in steps are curves, from a short step at the top to a long one. The "
        "shaded strips lie beyond a break of the axis: overlaps of the size of rounding, and none missed of "
        f"{rows[0].encounters} first encounters (one missed is {1 / max(rows[0].encounters, 1):.2%}). The "
        f"line is at the cost of {fastest(rows).method}, the fastest kinetic method here.",
        partial(draw_speed_error, tuple(rows)),
        json.dumps(described(rows)),
    )


def described(rows: Sequence[SpeedError]) -> dict[str, Any]:
    """Returns the subject of a chart of these rows: the scenes, the counts of each phase in a unit of time,
    and the steps of other methods. A test compares it, in the chart's metadata, with the present phases."""
    kinetic = [row for row in rows if row.kind == "kinetic"]
    steps = {
        kind: {name: [row.dt for row in some] for name, some in grouped(of_kind, "method").items()}
        for kind, of_kind in grouped([row for row in rows if row.kind != "kinetic"], "kind").items()
    }
    return {
        "bodies": rows[0].bodies,
        "density": rows[0].density,
        "encounters": rows[0].encounters,
        "kinetic": {row.method: {"contacts": row.contacts, "events": row.events} for row in kinetic},
        "steps": steps,
    }


def crossing(curve: Sequence[SpeedError], cost: float) -> SpeedError | None:
    """Returns a row for the step of a method at this cost, between two of its rows, if any. Step and overlap
    follow the logarithm of the cost; the missed share is linear in the logarithm of the step."""
    for fine, coarse in pairwise(sorted(curve, key=_step)):
        if fine.cost >= cost >= coarse.cost and fine.cost > coarse.cost:
            part = math.log(fine.cost / cost) / math.log(fine.cost / coarse.cost)
            return replace(
                fine,
                cost=cost,
                dt=_between(_step(fine), _step(coarse), part),
                deepest=_between(fine.deepest, coarse.deepest, part),
                missed_share=fine.missed_share + part * (coarse.missed_share - fine.missed_share),
            )
    return None


def _step(row: SpeedError) -> float:
    return row.dt or 0.0


def fastest(rows: Iterable[SpeedError]) -> SpeedError:
    """Returns the row of the kinetic method with the least cost, the reference of the others."""
    return min((row for row in rows if row.kind == "kinetic"), key=lambda row: row.cost)


def claims(rows: Sequence[SpeedError]) -> tuple[sections.Claim, ...]:
    """Returns the claims on the kinetic methods, with the measured values."""
    kinetic = [row for row in rows if row.kind == "kinetic"]
    missed, deepest = max(row.missed for row in kinetic), max(row.deepest_high for row in kinetic)
    best = {scene: fastest(some) for scene, some in grouped(rows, *SCENE).items()}
    each = sum(row.encounters for row in best.values())
    names = ", ".join(dict.fromkeys(row.method for row in best.values()))
    beside = [(row, best[row.bodies, row.density]) for row in rows if row.kind != "kinetic"]
    stepped = [(row.cost <= its.cost, row.deepest <= its.deepest) for row, its in beside]
    fast, true, both = sum(f for f, _ in stepped), sum(t for _, t in stepped), sum(map(all, stepped))
    shallow = f"Overlaps of kinetic methods are roundings: no deeper than {number(ROUNDING)} radii"
    better = f"No method in steps is both as fast as the fastest kinetic one ({names}) and as true"
    measured = f"of {len(stepped)} measurements {fast} are as fast, {true} as true, {both} both"
    return (
        sections.Claim("Kinetic methods miss no first encounter", f"{missed:,} of {each:,}", not missed),
        sections.Claim(shallow, f"{number(deepest)} radii", deepest <= ROUNDING),
        sections.Claim(better, measured, not both),
    )


def findings(rows: Sequence[SpeedError]) -> tuple[str, ...]:
    """Compares each method in steps with the fastest kinetic one, at its cost, and at the shortest step."""
    sentences = []
    for (bodies, density), scene in grouped(rows, *SCENE).items():
        best = fastest(scene).cost
        head = f"{bodies} discs at density {density:g} ({fastest(scene).method}: {number(best * 1e3)} ms)"
        for method, curve in grouped([row for row in scene if row.kind != "kinetic"], "method").items():
            nearest = min(curve, key=lambda row: abs(math.log(row.cost / best)))
            shown = (crossing(curve, best) or nearest, min(curve, key=_step))
            costs = "; ".join(dict.fromkeys(_cost_and_errors(at, best) for at in shown))
            sentences.append(f"{head}: {NAMES[method]} takes {costs}.")
    return tuple(sentences)


def _cost_and_errors(at: SpeedError, best: float) -> str:
    share = at.missed_share
    missed = f"{share:.{1 if share >= 0.01 else 2}%} of" if share else "no"
    times = "as long" if at.cost == best else f"{number(at.cost / best)} times as long"
    return (
        f"{times} at dt = {number(_step(at))}, with overlaps up to {number(at.deepest)} radii and {missed} "
        "first encounters missed"
    )


def _between(fine: float, coarse: float, part: float) -> float:
    """Returns the value ``part`` of the way from fine to coarse, by logarithms if both are positive."""
    if fine > 0.0 and coarse > 0.0:
        return float(fine * (coarse / fine) ** part)
    return fine + part * (coarse - fine)


# The chart: two panels, one for each error, over one axis of cost. Lower is faster, left is more accurate.
# The errors of kinetic methods are so far from the others that each panel has a strip beyond a break of its
# axis: for overlaps of the size of rounding, and for "none missed", which has no logarithm. A line at the
# cost of the fastest kinetic method separates faster from slower ones. Markers and lines are distinct in
# grey too.


_LOOKS = {
    ("snapshots", "sweep"): ("snapshots, sweep", "#000000", "o", "-"),
    ("snapshots", "cells"): ("snapshots, cells", "#777777", "s", "--"),
    ("engine", "chipmunk"): ("Chipmunk", "#009E73", "D", "-."),
    ("engine", "box2d"): ("Box2D 2.3, no bullets", "#D55E00", "v", ":"),
    ("engine", "box2d-bullets"): ("Box2D 2.3, bullets", "#D55E00", "P", "-"),
}
"""Names, colours, markers and lines of methods in steps. Kinetic ones share a colour; each has its marker."""

_LINE = "#0072B2"
_MARKERS = "s*^XopdhH8<>"


def draw_speed_error(rows: Sequence[SpeedError]) -> sections.Figure:
    """Returns the chart of the rows of one kind of scene."""
    figure, panels = new_figure(4, 4.4, sharey=True, width_ratios=(3, 7, 3, 7))
    kinetic = list(grouped([row for row in rows if row.kind == "kinetic"], "method"))
    figure.supylabel("CPU seconds for one unit of simulated time", fontsize="medium")
    panels[0].set(yscale="log", ylim=(0.6 * min(r.cost for r in rows), 1.7 * max(r.cost for r in rows)))
    for strip, main, error in ((*panels[:2], "deepest"), (*panels[2:], "missed_share")):
        _lay_out(strip, main, error, rows)
        for (kind, method), some in grouped(rows, "kind", "method").items():
            look = _LOOKS.get((kind, method))
            if look is None:
                look = method, _LINE, _MARKERS[kinetic.index(method) % len(_MARKERS)], ""
            _draw_method(strip, main, error, some, look)
        best = fastest(rows).cost
        for panel in (strip, main):
            panel.axhline(best, color=_LINE, linewidth=0.9, zorder=1)
        for word, side, up in (("slower", "bottom", 2), ("faster", "top", -2)):
            _write(main, word, (main.get_xlim()[0], best), (2, up), va=side, color=_LINE)
    for row in rows:
        if row.method == "sweep":
            step = f"dt = {number(_step(row))}"
            _write(panels[1], step, (row.deepest, row.cost), (-4, -2), va="top", ha="right", color="0.25")
    legend_below(figure, 4)
    return figure


def _write(panel: Any, text: str, at: tuple[float, float], shift: tuple[int, int], **look: Any) -> None:
    options = {"xytext": shift, "textcoords": "offset points", "fontsize": 6.5}
    panel.annotate(text, at, **(options | look)).set_in_layout(False)


def _lay_out(strip: Any, main: Any, error: str, rows: Sequence[SpeedError]) -> None:
    """Sets the axes of a panel and its strip, and marks the break between them."""
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


def _draw_method(
    strip: Any, main: Any, error: str, rows: Sequence[SpeedError], look: tuple[str, ...]
) -> None:
    rows = sorted(rows, key=_step)
    name, colour, marker, line = look
    style: dict[str, Any] = {"color": colour, "marker": marker, "label": name, "clip_on": False}
    kinetic = rows[0].kind == "kinetic"
    # A white edge separates a marker from another that it lies over.
    solid = {"markersize": 7.0, "markeredgecolor": "white", "markeredgewidth": 0.6}
    style |= solid if kinetic else {"markersize": 4.0, "markerfacecolor": "white"}
    beyond = [row for row in rows if getattr(row, error) <= ROUNDING]
    if beyond:
        places = [max(row.deepest, 2e-16) if error == "deepest" else 0.0 for row in beyond]
        strip.plot(places, [row.cost for row in beyond], linestyle="", zorder=4, **style)
    if len(beyond) < len(rows):
        x = [value if (value := getattr(row, error)) > ROUNDING else math.nan for row in rows]
        main.plot(x, [row.cost for row in rows], linestyle=line, linewidth=1.2, zorder=3, **style)
