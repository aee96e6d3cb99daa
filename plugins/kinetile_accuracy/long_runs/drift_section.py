"""The part of the report on long runs: what ``drift`` measures, in words and pictures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import kinetile as kt
from kinetile_accuracy.drawing import curve, legend_below, new_figure
from kinetile_accuracy.long_runs.drift import Clock, Drift, WayBack, clocks, drifts, way_back
from kinetile_accuracy.parts import Budget, Claim, Picture, Progress, Section, Table, grouped
from kinetile_accuracy.wording import listed, number

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
            Table("drift", "The readings after so many contacts.", tuple(drift)),
            Table("clocks", "The same scene with clocks that begin late.", tuple(clock)),
            Table("way-back", "Runs turned back after a while.", tuple(back)),
        ),
        claims=tuple(_claims(most, drift, clock)),
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


def _claims(most: int, drift: list[Drift], clock: list[Clock]) -> list[Claim]:
    last = drift[-1]
    walk = _walk(last.contacts)
    return [
        Claim(
            f"A run of {most:,} contacts comes to its end under audit",
            f"{last.contacts:,} contacts, {last.audits:,} audits",
            last.contacts >= most and last.audits > 0,
        ),
        *(
            Claim(
                f"{name.capitalize()} wanders no further than one rounding a contact would take it",
                f"{number(off)}; the walk: {number(walk)}",
                off <= walk,
            )
            for name, off in (("energy", last.energy), ("momentum", last.momentum))
        ),
        Claim(
            "Late clocks show the same contacts, to the last bit",
            f"{sum(row.same for row in clock)} of {len(clock)} clocks, {clock[0].contacts:,} contacts",
            all(row.same for row in clock),
        ),
    ]


def _walk(contacts: int) -> float:
    """Return how far a random walk of one rounding a contact comes."""
    return 2.0**-53 * math.sqrt(contacts)


def _findings(drift: list[Drift], clock: list[Clock], back: list[WayBack]) -> list[str]:
    last = drift[-1]
    middle = drift[len(drift) // 2]
    growth = last.deepest_overlap / middle.deepest_overlap if middle.deepest_overlap else 1.0
    found = [
        f"After {last.contacts:,} contacts the energy has changed by {number(last.energy)} of itself, and "
        f"the momentum that contacts of two discs left over is {number(last.momentum)}.",
        f"The deepest overlap at any contact is {number(last.deepest_overlap)} radii, {growth:.1f} times "
        f"that of the first {middle.contacts:,}; half of all contacts are within {number(last.gap_median)} R "
        f"of the exact distance, 99 % within {number(last.gap_p99)}.",
    ]
    if all(row.same for row in clock):
        starts = listed([f"2^{math.log2(row.start):.0f}" for row in clock if row.start])
        found.append(
            f"With the clock at {starts} the {clock[0].contacts:,} contacts are the same to the last bit."
        )
    else:
        wrong = listed([number(row.start) for row in clock if not row.same])
        found.append(f"With the clock at {wrong} the contacts are others: that must not be.")
    for density, rows in grouped(back, "density").items():
        lost = next((row for row in rows if row.error > 1.0), None)
        if lost is not None:
            found.append(
                f"At density {density:g} a run turned back after {lost.contacts_per_disc:.0f} contacts a "
                "disc does not find its beginning (more than a radius off)."
            )
    return found


def _draw_drift(rows: list[Drift]) -> Figure:
    figure, panel = new_figure()
    contacts = [row.contacts for row in rows]
    labels = {
        "energy": "energy",
        "deepest_overlap": "deepest overlap / r",
        "gap_p99": "distance at contact, 99 %, / R",
        "momentum": "momentum",
    }
    for look, (field, label) in enumerate(labels.items()):
        curve(panel, contacts, [getattr(row, field) or math.nan for row in rows], look, label=label)
    panel.plot(contacts, [_walk(n) for n in contacts], ":", color="0.5", label="random walk of roundings")
    panel.set(xscale="log", yscale="log", xlabel="contacts", ylabel="relative")
    legend_below(figure, 3)
    return figure


def _draw_back(rows: list[WayBack]) -> Figure:
    figure, panel = new_figure()
    for look, (density, some) in enumerate(grouped(rows, "density").items()):
        errors = [max(row.error, 1e-17) for row in some]
        curve(panel, [row.contacts_per_disc for row in some], errors, look, label=f"density {density:g}")
    panel.axhline(1.0, color="0.5", linewidth=1.0, linestyle=":")
    panel.set(yscale="log", xlabel="contacts a disc until the run is turned back", ylabel="error / r")
    legend_below(figure, 2)
    return figure
