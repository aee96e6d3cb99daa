"""Speed against error: what a unit of simulated time costs, and what the method gets wrong in it.

Kinetic methods have no step: each is a point. Methods in steps are curves: a shorter step costs more and errs
less. There is no one error, so two are shown, and chaos hides neither:

- *the deepest overlap* of two discs that the method itself sees in a unit of time, in radii;
- *first encounters missed*: of the encounters between discs that have touched nothing before, the share that
  the method does not have as such (``kinetile_accuracy.stepped.encounters``), pooled over many scenes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

from kinetile.errors import MissingExtra
from kinetile_accuracy.parts import Budget, Claim, Column, Picture, Progress, Section, Table, grouped
from kinetile_accuracy.stepped.figures import BEST, ROUNDING, draw_speed_error
from kinetile_accuracy.stepped.peers import NAMES as ENGINES
from kinetile_accuracy.stepped.peers import PEERS, configured
from kinetile_accuracy.stepped.runs import ROUNDS, UNTIL, Method, SpeedError, measure_rows
from kinetile_accuracy.stepped.snapshot import Finder
from kinetile_accuracy.wording import number

__all__ = [
    "EFFORTS",
    "KINETIC",
    "Crossing",
    "Effort",
    "Setting",
    "crossing",
    "described",
    "findings",
    "measure",
]

KINETIC = ("naive", "cells", "sap-1d", "sap-2d", "sweep-tiling")
"""Every broad phase that comes with kinetile."""
SCENE = ("bodies", "density")
"""The fields of a row that say which scenes it is of."""
FINDERS: tuple[Finder, ...] = ("sweep", "cells")
_STEPS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4)
_SCENES = ((100, 0.25), (400, 0.25), (100, 0.5), (400, 0.5))

NAMES = {"sweep": "the snapshot method (sweep)", "cells": "the snapshot method (cells)"} | ENGINES


@dataclass(frozen=True)
class Setting:
    """What an engine is set to, in words."""

    engine: Annotated[str, Column("its name", "engine")]
    configured: Annotated[str, Column("all that it is set to", "set to")]


class Effort(NamedTuple):
    """What is measured within a budget.

    Attributes:
        scenes: (bodies, density) of the recipe ``grid``.
        seeds: how many scenes of each kind are timed.
        encounters: how many first encounters are looked for in each kind, about.
        steps, engine_steps: lengths of the step, for snapshots and for engines.
    """

    scenes: tuple[tuple[int, float], ...]
    seeds: int
    encounters: int
    steps: tuple[float, ...]
    engine_steps: tuple[float, ...]


EFFORTS: dict[Budget, Effort] = {
    "quick": Effort(_SCENES[:1], 2, 2000, (*_STEPS, 1e-4, 3e-5, 1e-5), _STEPS),
    "normal": Effort(_SCENES, 3, 6000, (*_STEPS, 1e-4, 3e-5), _STEPS[:4]),
    "full": Effort(_SCENES, 5, 12000, (*_STEPS, 1e-4, 3e-5, 1e-5), (*_STEPS, 1e-4)),
}


def measure(budget: Budget, progress: Progress) -> Section:
    """Measure all methods; return the part of the report that shows speed against error."""
    effort = EFFORTS[budget]
    engines, left_out = _installed()
    methods = [Method("kinetic", name) for name in KINETIC]
    methods += [Method("snapshots", finder, dt) for finder in FINDERS for dt in effort.steps]
    methods += [Method("engine", engine, dt) for engine in engines for dt in effort.engine_steps]
    rows: list[SpeedError] = []
    pictures = []
    for k, (bodies, density) in enumerate(effort.scenes):

        def tell(
            done: int, total: int, before: int = k, what: str = f"{bodies} discs at {density:g}"
        ) -> None:
            progress(f"speed against error, {what}", before * total + done, len(effort.scenes) * total)

        new = measure_rows(
            methods, bodies, density, seeds=effort.seeds, encounters=effort.encounters, progress=tell
        )
        pictures.append(_picture(new))
        rows += new
    tables = [Table("methods", "What a unit of simulated time costs, and how wrong it is.", tuple(rows))]
    if engines:
        tables.append(Table("engines", "What the engines are set to.", tuple(engines.values())))
    return Section(
        name="chart",
        title="Speed against error",
        about=_about(effort),
        findings=findings(rows),
        claims=claims(rows),
        tables=tuple(tables),
        pictures=tuple(pictures),
        left_out=left_out,
    )


def _installed() -> tuple[dict[str, Setting], tuple[str, ...]]:
    """Return the engines that are installed, and what is left out and why."""
    engines: dict[str, Setting] = {}
    left_out: dict[str, None] = {}
    for peer in PEERS:
        try:
            engines[peer] = Setting(NAMES[peer], configured(peer))
        except MissingExtra as error:
            left_out[str(error)] = None
    return engines, tuple(left_out)


def _about(effort: Effort) -> str:
    return (
        "Discs on a grid are set off at the same speed in random directions (recipe grid). Cost is the "
        f"CPU time of the loop for a unit of simulated time (runs go to {UNTIL:g}): the median of at least "
        f"{ROUNDS} runs on each of {effort.seeds} scenes, garbage collector off, set-up and compilation "
        "apart. Snapshots are the pseudo-dynamic method, in compiled Python as the kinetic methods are: "
        "every dt all discs are moved, and pairs that overlap and approach get the elastic impulse; pairs "
        "are found by static sweep-and-prune with insertion sort (sweep) or by a grid (cells); walls are "
        "exact. The deepest overlap is that of two discs, in radii, as far as the method itself sees it: "
        "at its snapshots, or at contacts for kinetic methods. First encounters are contacts of two discs "
        "that have touched neither disc nor wall before, taken from the kinetic run with all pairs; a "
        "method misses one that it does not have as the first contact of both discs, where contacts of "
        "one snapshot count as simultaneous (which favours long steps). The table says how many of them "
        "have no impulse at all (the only snapshots that see the overlap see the discs part), and how many "
        "are unseen; what is missed besides is of another order in time."
    )


def _picture(rows: Sequence[SpeedError]) -> Picture:
    bodies, density = rows[0].bodies, rows[0].density
    return Picture(
        f"{bodies}-discs-{density:.0%}".replace("%", "-percent"),
        f"{bodies} discs at density {density:g}: further down is faster, further left is truer. Kinetic "
        "methods are points; methods in steps are curves, from a short step at the top to a long one. The "
        "shaded strips lie beyond a break of the axis: overlaps of the size of rounding, and none missed of "
        f"{rows[0].encounters} first encounters (one missed is {1 / max(rows[0].encounters, 1):.2%}). The "
        f"line is at the cost of {BEST}.",
        partial(draw_speed_error, tuple(rows)),
        json.dumps(described(rows)),
    )


def described(rows: Sequence[SpeedError]) -> dict[str, Any]:
    """Return what a chart of these rows is of: the scenes, what each phase does in a unit of time, and the
    steps of each other method; nothing that a clock has measured.

    It stands in the chart's metadata: a chart that is of other phases than there are now is found out.
    """
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


class Crossing(NamedTuple):
    """Where a method in steps costs as much as another method: its step there, and its errors."""

    dt: float
    deepest: float
    missed_share: float


def crossing(curve: Sequence[SpeedError], cost: float) -> Crossing | None:
    """Return where a method in steps has this cost, between two of its rows; None where it never has.

    Step, cost and overlap are interpolated by their logarithms, the share that is missed linearly in that of
    the step.
    """
    rows = sorted(curve, key=lambda row: row.dt or 0.0)
    for fine, coarse in pairwise(rows):
        if fine.cost >= cost >= coarse.cost and fine.cost > coarse.cost:
            part = math.log(fine.cost / cost) / math.log(fine.cost / coarse.cost)
            return Crossing(
                _between(fine.dt or 0.0, coarse.dt or 0.0, part),
                _between(fine.deepest, coarse.deepest, part),
                fine.missed_share + part * (coarse.missed_share - fine.missed_share),
            )
    return None


def claims(rows: Sequence[SpeedError]) -> tuple[Claim, ...]:
    """Return what must hold of the kinetic methods, and what was found."""
    kinetic = [row for row in rows if row.kind == "kinetic"]
    missed, deepest = max(row.missed for row in kinetic), max(row.deepest_high for row in kinetic)
    each = sum(row.encounters for row in kinetic if row.method == BEST)
    fast, true, both = (len(some) for some in _rivals(rows))
    stepped = sum(row.kind != "kinetic" for row in rows)
    return (
        Claim("Kinetic methods miss no first encounter", f"{missed:,} of {each:,}", not missed),
        Claim(
            f"Overlaps of kinetic methods are roundings: no deeper than {number(ROUNDING)} radii",
            f"{number(deepest)} radii",
            deepest <= ROUNDING,
        ),
        Claim(
            f"No method in steps is both as fast as {BEST} and as true",
            f"of {stepped} measurements {fast} are as fast, {true} as true, {both} both",
            not both,
        ),
    )


def findings(rows: Sequence[SpeedError]) -> tuple[str, ...]:
    """Return what the rows say, in sentences."""
    return (
        _of_kinetic([row for row in rows if row.kind == "kinetic"]),
        *(said for some in grouped(rows, *SCENE).values() for said in _of_scene(some)),
        _of_rivals(rows),
    )


def _rivals(rows: Sequence[SpeedError]) -> tuple[list[SpeedError], list[SpeedError], list[SpeedError]]:
    """Return the rows of methods in steps that are as fast as BEST, that are as true, and that are both."""
    best = {(row.bodies, row.density): row for row in rows if row.method == BEST}
    beside = [(row, best[row.bodies, row.density]) for row in rows if row.kind != "kinetic"]
    fast = [row for row, its in beside if row.cost <= its.cost]
    true = [row for row, its in beside if row.deepest <= its.deepest]
    return fast, true, [row for row in fast if row in true]


def _of_kinetic(rows: Sequence[SpeedError]) -> str:
    missed, encounters = max(row.missed for row in rows), sum(row.encounters for row in rows)
    methods = ", ".join(dict.fromkeys(row.method for row in rows))
    deepest = max(row.deepest_high for row in rows)
    return f"Kinetic methods ({methods}): the deepest overlap is {number(deepest)} radii; " + (
        "none of the first encounters is missed."
        if not missed
        else f"up to {missed} first encounters are missed (of {encounters} in all)."
    )


def _of_scene(rows: Sequence[SpeedError]) -> list[str]:
    """Compare each method in steps with BEST on scenes of one kind."""
    best = next(row.cost for row in rows if row.method == BEST)
    head = f"{rows[0].bodies} discs at density {rows[0].density:g} ({BEST}: {number(best * 1e3)} ms)"
    sentences = []
    for method, some in grouped([row for row in rows if row.kind != "kinetic"], "method").items():
        curve = sorted(some, key=lambda row: row.dt or 0.0)
        cheapest = min(curve, key=lambda row: row.cost)
        equal = crossing(curve, best)
        said = (
            f"at dt = {number(cheapest.dt or 0.0)}, where it is fastest, {NAMES[method]} takes "
            f"{number(cheapest.cost / best)} times as long as {BEST}, {_errors(cheapest)}"
        )
        if equal is not None:
            said += f"; it takes as long at dt = {number(equal.dt)}, {_errors(equal)}"
        if cheapest is not curve[0]:
            finest = curve[0]
            said += (
                f"; at dt = {number(finest.dt or 0.0)}, {number(finest.cost / best)} times, {_errors(finest)}"
            )
        sentences.append(f"{head}: {said}.")
    return sentences


def _errors(at: SpeedError | Crossing) -> str:
    share = at.missed_share
    missed = (
        "no first encounters"
        if share == 0.0
        else f"{share:.{1 if share >= 0.01 else 2}%} of first encounters"
    )
    return f"with overlaps up to {number(at.deepest)} radii and {missed} missed"


def _of_rivals(rows: Sequence[SpeedError]) -> str:
    """Say what in steps is as fast as BEST, and what is as true."""
    stepped = [row for row in rows if row.kind != "kinetic"]
    as_fast, as_true, both = _rivals(rows)
    complete = sum(row.missed == 0 for row in as_fast)
    said = f"Of {len(stepped)} measurements of methods in steps, {len(as_fast) or 'none'}"
    said += f" are as fast as {BEST}"
    if as_fast:
        truest = min(as_fast, key=lambda row: row.deepest)
        said += f" (of these the least deepest overlap is {number(truest.deepest)} radii: {_called(truest)})"
    said += f", {len(as_true) or 'none'} overlap as little"
    if stepped:
        truest = min(stepped, key=lambda row: row.deepest)
        best = next(row for row in grouped(rows, *SCENE)[truest.bodies, truest.density] if row.method == BEST)
        times = truest.cost / best.cost
        cost = f"at {number(times)} times the time: {_called(truest)}"
        said += f" (the least is {number(truest.deepest)} radii, {cost})"
    return (
        f"{said}, and {len(both) or 'none'} are both. Of those as fast, {complete or 'none'} have every "
        "first encounter that was looked for."
    )


def _called(row: SpeedError) -> str:
    return f"{NAMES[row.method]}, dt = {number(row.dt or 0.0)}, {row.bodies} discs at {row.density:g}"


def _between(fine: float, coarse: float, part: float) -> float:
    """Return the value ``part`` of the way from ``fine`` to ``coarse``, by logarithms where there are any."""
    if fine > 0.0 and coarse > 0.0:
        return float(fine * (coarse / fine) ** part)
    return fine + part * (coarse - fine)
