"""The part of the report on long runs: what ``kinetile.accuracy.drift`` measures, in words and pictures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import kinetile as kt
from kinetile.accuracy.drift import Clock, Drift, WayBack, clocks, drifts, way_back
from kinetile.accuracy.parts import Budget, Picture, Progress, Section, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["measure"]

MOST: dict[Budget, int] = {"quick": 10**6, "normal": 10**7, "full": 10**8}
"""Contacts of the long run."""

WAYS = {
    0.5: (0.02, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24, 0.32, 0.4, 0.5, 0.6, 0.7, 0.8),
    0.1: (0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6),
}
"""How long a run goes before it is turned back, in the scene's time, by density."""


def measure(budget: Budget, progress: Progress) -> Section:
    """Measure all of this on the thesis's grid of 100 discs."""
    most = MOST[budget]
    scene = kt.make_scene("grid", bodies=100, density=0.5, seed=1)
    drift = drifts(scene, most, progress)
    progress("clocks", 0, 1)
    clock = clocks(scene, min(most, 10**6) // 10)
    back: list[WayBack] = []
    for density, times in WAYS.items():
        for until in times:
            progress("the way back", len(back), sum(map(len, WAYS.values())))
            back.append(way_back(kt.make_scene("grid", bodies=100, density=density, seed=1), density, until))
    return Section(
        name="drift",
        title="What a long run loses",
        about=(
            f"The thesis's grid, 100 discs at density 0.5, seed 1, with sweep-tiling, for {most:,} contacts "
            f"of discs and walls; between contacts, {drift[-1].audits:,} times, an audit rebuilt the "
            "structure and compared it, and looked by brute force for pairs that are no candidates. No "
            "contact was missed, or the run would have stopped. Below: the same scene with other clocks, and "
            "on the way back."
        ),
        findings=tuple(_findings(drift, clock, back)),
        tables=(
            Table("drift", "The readings after so many contacts.", tuple(drift), _DRIFT_HEADS),
            Table("clocks", "The same scene with clocks that begin late.", tuple(clock), _CLOCK_HEADS),
            Table("way-back", "Runs turned back after a while.", tuple(back), _BACK_HEADS),
        ),
        pictures=(
            Picture(
                "drift",
                "Energy, momentum, deepest overlap and distance at contact against contacts. The grey dotted "
                "line is how a random walk of one rounding a contact would grow.",
                lambda: _draw_drift(drift),
            ),
            Picture(
                "way-back",
                "How far a run that is turned back misses its beginning. The slope is the chaos of the "
                "discs; at an error of one radius a trajectory means nothing any more.",
                lambda: _draw_back(back),
            ),
        ),
    )


_DRIFT_HEADS = {
    "contacts": "contacts",
    "energy": "energy",
    "momentum": "momentum",
    "deepest_overlap": "deepest overlap / r",
    "gap_median": "gap / R, median",
    "gap_p99": "99 %",
    "gap_max": "max",
    "late": "overlapping",
    "lateness": "lateness",
    "audits": "audits",
}
_CLOCK_HEADS = {
    "start": "clock begins at",
    "contacts": "contacts",
    "deepest_overlap": "deepest overlap / r",
    "energy": "energy",
    "same": "same contacts",
}
_BACK_HEADS = {
    "density": "density",
    "until": "turned back at",
    "contacts_per_disc": "contacts a disc",
    "error": "error / r",
}


def _findings(drift: list[Drift], clock: list[Clock], back: list[WayBack]) -> list[str]:
    last = drift[-1]
    middle = drift[len(drift) // 2]
    growth = last.deepest_overlap / middle.deepest_overlap if middle.deepest_overlap else 1.0
    found = [
        f"After {last.contacts:,} contacts the energy has changed by {last.energy:.1e} of itself, and the "
        f"momentum that contacts of two discs left over is {last.momentum:.1e}.",
        f"The deepest overlap at any contact is {last.deepest_overlap:.1e} radii, {growth:.1f} times that "
        f"of the first {middle.contacts:,}; half of all contacts are within {last.gap_median:.1e} R of the "
        f"exact distance, 99 % within {last.gap_p99:.1e}.",
    ]
    others = [row for row in clock if row.start != 0.0]
    starts = " and ".join(f"2^{math.log2(row.start):.0f}" for row in others)
    if all(row.same for row in clock):
        found.append(
            f"With the clock at {starts} the {clock[0].contacts:,} contacts are the same to the last bit."
        )
    else:
        wrong = ", ".join(f"{row.start:g}" for row in clock if not row.same)
        found.append(f"With the clock at {wrong} the contacts are others: that must not be.")
    for density in dict.fromkeys(row.density for row in back):
        rows = [row for row in back if row.density == density]
        lost = next((row for row in rows if row.error > 1.0), None)
        if lost is not None:
            found.append(
                f"At density {density:g} a run turned back after {lost.contacts_per_disc:.0f} contacts a "
                "disc does not find its beginning (more than a radius off)."
            )
    return found


def _draw_drift(rows: list[Drift]) -> Figure:
    from kinetile.accuracy.drawing import new_figure

    figure, panel = new_figure(1)
    contacts = [row.contacts for row in rows]
    lines: tuple[tuple[str, str, str, str], ...] = (
        ("energy", "energy", "#0072B2", "o-"),
        ("momentum", "momentum", "#009E73", "s--"),
        ("deepest_overlap", "deepest overlap / r", "#D55E00", "^-"),
        ("gap_p99", "distance at contact, 99 %, / R", "#000000", "v-."),
    )
    for field, label, colour, look in lines:
        values = [getattr(row, field) or math.nan for row in rows]
        panel.plot(contacts, values, look, color=colour, markersize=4, linewidth=1.2, label=label)
    walk = [2.0**-53 * math.sqrt(n) for n in contacts]
    panel.plot(contacts, walk, ":", color="0.5", linewidth=1.0, label="a random walk of roundings")
    panel.set(xscale="log", yscale="log", xlabel="contacts", ylabel="relative")
    panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _draw_back(rows: list[WayBack]) -> Figure:
    from kinetile.accuracy.drawing import new_figure

    figure, panel = new_figure(1)
    looks: Any = iter((("#0072B2", "o-"), ("#D55E00", "s--"), ("#000000", "^:")))
    for density in dict.fromkeys(row.density for row in rows):
        colour, look = next(looks)
        chosen = [row for row in rows if row.density == density]
        panel.plot(
            [row.contacts_per_disc for row in chosen],
            [max(row.error, 1e-17) for row in chosen],
            look,
            color=colour,
            markersize=4,
            linewidth=1.2,
            label=f"density {density:g}",
        )
    panel.axhline(1.0, color="0.5", linewidth=1.0, linestyle=":")
    panel.set(yscale="log", xlabel="contacts a disc until the run is turned back", ylabel="error / r")
    panel.legend()
    return figure
