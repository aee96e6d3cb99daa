"""The part ``oracle`` of the report: how long a run in doubles agrees with the certified oracle.

Beside each run stands what it could have been at best, its twin: the same scene with every coordinate of the
start moved by one unit in the last place, up or down, followed in certified arithmetic without any further
rounding. Where the twin departs from its scene, chaos has spent the bits of a double.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np

import kinetile as kt
from kinetile_accuracy.drawing import LOOKS, curve, legend_below, new_figure
from kinetile_accuracy.oracle.agreement import Agreement, certify
from kinetile_accuracy.oracle.oracle import CertifiedRun, Ending, Oracle
from kinetile_accuracy.sections import (
    Budget,
    Claim,
    Column,
    ReportFigure,
    ReportProgress,
    Section,
    Table,
    grouped,
    listed,
    number,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Requirement(NamedTuple):
    """A density of the thesis's grid, with how many discs, and the contacts a disc that must agree."""

    density: float
    bodies: int
    required: float


REQUIREMENTS = (Requirement(0.5, 16, 40.0), Requirement(0.1, 16, 13.0), Requirement(0.01, 25, 4.5))
SEEDS: dict[Budget, int] = {"quick": 3, "normal": 10, "full": 50}
TWINS = 3
CLOSE = 0.95
"""A run that agrees for this part of its twin's time agrees for about as long."""
LONG_ENOUGH = 2000
"""Contacts of a run that is compared, and of a certified one that a twin follows: far more than can agree."""


@dataclass(frozen=True)
class Horizon:
    """How far one run agrees with the oracle; its twin: how far the median of a few agrees."""

    density: Annotated[float, Column("of the scene", "density")]
    bodies: Annotated[int, Column("how many discs", "discs")]
    seed: Annotated[int, Column("of the scene", "seed")]
    contacts: Annotated[int, Column("how many contacts agree, in order", "contacts agree")]
    disc_contacts: Annotated[int, Column("how many of these are of two discs")]
    contacts_per_disc: Annotated[float, Column("each contact counted for each disc in it", "a disc")]
    required: Annotated[float, Column("contacts a disc that must agree", "required")]
    collisions_per_disc: Annotated[float, Column("the same without contacts with walls", "collisions a disc")]
    holds: Annotated[bool, Column("whether so many contacts a disc agree")]
    holds_without_walls: Annotated[bool, Column("whether so many collisions a disc agree")]
    twin_contacts_per_disc: Annotated[float, Column("for how many contacts a disc the twin agrees")]
    twin_collisions_per_disc: Annotated[float, Column("for how many collisions a disc it does", "the twin's")]
    bits: Annotated[int, Column("the precision that certified all this", "bits")]
    worst_ticks: Annotated[float, Column("largest error of a time, first half", "off by, first half: ticks")]
    worst_ulps: Annotated[float, Column("the same in units of the last place of the time", "ulps")]
    differs: Annotated[str, Column("what the first contact is that does not agree")]


@dataclass(frozen=True)
class ErrorGrowth:
    """The errors of times about this many contacts a disc from the start, on all seeds."""

    density: Annotated[float, Column("of the scenes", "density")]
    contacts_per_disc: Annotated[float, Column("the middle of the bin", "contacts a disc")]
    contacts: Annotated[int, Column("contacts in the bin", "contacts")]
    median_ticks: Annotated[float, Column("how far off: median", "off by ticks, median")]
    worst_ticks: Annotated[float, Column("how far off: the worst", "worst")]


def measure(budget: Budget, progress: ReportProgress) -> Section:
    """Measures the horizons of three densities on a few seeds."""
    rows: list[Horizon] = []
    growth: list[ErrorGrowth] = []
    seeds = SEEDS[budget]
    for requirement in REQUIREMENTS:
        agreements = []
        for seed in range(seeds):
            progress("agreement with the oracle", len(rows), len(REQUIREMENTS) * seeds)
            agreed, row = measure_horizon(requirement, seed)
            agreements.append(agreed)
            rows.append(row)
        growth += _growth(requirement, agreements)
    return Section(
        name="oracle",
        title="How long a run agrees with the certified oracle",
        about=(
            "The oracle follows the thesis's grid in ball arithmetic and proves the order of the contacts. A "
            "run agrees up to the first contact at which the two lists differ. Contacts a disc count each "
            "contact for each disc in it; collisions a disc leave the walls out, which multiply no error. "
            "The twin is an exact run, too, of the scene with each coordinate of the start moved by one unit "
            "in the last place, up or down: no run in doubles can hope for more than that. Times are off in "
            "ticks of 2^-52 of a time unit."
        ),
        findings=findings(rows, growth),
        claims=(
            Claim(
                "Runs agree with the certified oracle for as many contacts a disc as is required",
                f"{sum(row.holds for row in rows)} of {len(rows)} runs; "
                f"{sum(row.holds_without_walls for row in rows)} if contacts with walls do not count",
                all(row.holds for row in rows),
            ),
            Claim(
                "Runs agree for as long as chaos lets an exact run that begins one last digit off",
                f"{_beside_twin(rows):.0%} of it",
                _beside_twin(rows) > CLOSE,
            ),
        ),
        tables=(
            Table("horizons", "How far each run agrees.", tuple(rows)),
            Table("growth", "How far times are off, all seeds together.", tuple(growth)),
        ),
        pictures=(
            ReportFigure(
                "oracle",
                "How far the times of a run are off from the certified ones, against contacts a disc: the "
                "median over all seeds, and the worst (thin). The curves end where the contacts are no "
                "longer the same; the marks on top are the contacts a disc that must agree.",
                lambda: _draw(growth),
            ),
        ),
    )


def measure_horizon(requirement: Requirement, seed: int, twins: int = TWINS) -> tuple[Agreement, Horizon]:
    """Runs a grid, certify it, and follow its twins."""
    scene = kt.make_scene("grid", bodies=requirement.bodies, density=requirement.density, seed=seed)
    found = certify(kt.Simulation(scene), max_contacts=LONG_ENOUGH)
    certified = Oracle(scene).run(max_contacts=found.contacts * 5 // 4 + requirement.bodies)
    steps = np.random.default_rng(seed)
    others = []
    for _ in range(twins):
        partners, certified = _follow_to_the_end(_moved(scene, steps), scene, certified)
        others.append(_paces(partners, requirement.bodies))
    half = found.contacts // 2
    return found, Horizon(
        density=requirement.density,
        bodies=requirement.bodies,
        seed=seed,
        contacts=found.contacts,
        disc_contacts=found.disc_contacts,
        contacts_per_disc=found.contacts_per_disc,
        collisions_per_disc=found.collisions_per_disc,
        required=requirement.required,
        holds=found.contacts_per_disc >= requirement.required,
        holds_without_walls=found.collisions_per_disc >= requirement.required,
        twin_contacts_per_disc=median(pace for pace, _ in others),
        twin_collisions_per_disc=median(pace for _, pace in others),
        bits=found.oracle.bits,
        worst_ticks=float(np.abs(found.ticks[:half]).max(initial=0.0)),
        worst_ulps=float(np.abs(found.ulps[:half]).max(initial=0.0)),
        differs=str(found.disagreement or found.oracle.ending),
    )


def _moved(scene: kt.Scene, steps: np.random.Generator) -> kt.Scene:
    """Returns a scene whose discs start a unit in the last place further on, or back, on each axis."""
    towards = np.where(steps.integers(0, 2, scene.position.shape), np.inf, -np.inf)
    return scene.replace(position=np.nextafter(scene.position, towards))


def _follow_to_the_end(
    twin: kt.Scene, scene: kt.Scene, certified: CertifiedRun
) -> tuple[list[int], CertifiedRun]:
    """Follows a twin until it departs from its scene, however far the run itself came.

    Returns the second bodies of the contacts in common, and the certified run, longer where that took
    more of it.
    """
    while True:
        partners, ended = _follow(twin, certified)
        if (ended, certified.ended) != ("contacts", "contacts") or len(certified.contacts) >= LONG_ENOUGH:
            return partners, certified
        certified = Oracle(scene).run(max_contacts=2 * len(certified.contacts))


def _follow(scene: kt.Scene, certified: CertifiedRun) -> tuple[list[int], Ending]:
    """Returns the second bodies of the contacts that a scene has in common with others, certified.

    And why there are no more: "stopped" where the scene departs from the others.
    """
    there = certified.contacts

    def departs(index: int, a: int, b: int) -> bool:
        return (a, b) != (there[index].a, there[index].b)

    run = Oracle(scene).run(max_contacts=len(there), stop=departs)
    agree = len(run.contacts) - (run.ended == "stopped")
    return [contact.b for contact in run.contacts[:agree]], run.ended


def _paces(partners: Sequence[int], bodies: int) -> tuple[float, float]:
    """Returns contacts per disc, and collisions per disc."""
    discs = sum(b >= 0 for b in partners)
    return (discs + len(partners)) / bodies, 2 * discs / bodies


def _growth(requirement: Requirement, agreements: Sequence[Agreement]) -> list[ErrorGrowth]:
    """Returns how errors grow, in bins of a tenth of the required contacts per disc."""
    width = requirement.required / 10.0
    paces = np.concatenate([found.paces for found in agreements])
    ticks = np.abs(np.concatenate([found.ticks for found in agreements]))
    rows = []
    for k in range(int(paces.max(initial=0.0) / width) + 1):
        here = ticks[(paces > k * width) & (paces <= (k + 1) * width)]
        if len(here):
            middle, worst = float(np.median(here)), float(here.max())
            rows.append(ErrorGrowth(requirement.density, (k + 0.5) * width, len(here), middle, worst))
    return rows


def findings(rows: Sequence[Horizon], growth: Sequence[ErrorGrowth]) -> tuple[str, ...]:
    """Returns how long runs agree, beside what is required and beside their twins, and how errors grow."""

    def each(text: Callable[[list[Horizon]], str]) -> str:
        by_density = grouped(rows, "density").items()
        return listed([f"{text(some)} at density {density:g}" for density, some in by_density])

    def span(field: str, some: list[Horizon]) -> str:
        paces = [getattr(row, field) for row in some]
        return f"{min(paces):.1f} to {max(paces):.1f}"

    whole = each(lambda some: f"{span('contacts_per_disc', some)} ({some[0].required:g} required)")
    discs = each(
        lambda some: (
            f"{span('collisions_per_disc', some)} (their twins {span('twin_collisions_per_disc', some)})"
        )
    )
    densities = grouped(growth, "density")
    slopes = []
    for density, bins in densities.items():
        some = [row for row in bins if row.median_ticks > 10.0]
        if len(some) > 2:
            bits = [math.log2(row.median_ticks) for row in some]
            slope = np.polyfit([row.contacts_per_disc for row in some], bits, 1)[0]
            slopes.append(f"{slope:.1f} bits at density {density:g}")
    first = [bins[0] for bins in densities.values()]
    return (
        f"Runs agree with the certified oracle, in order, for so many contacts a disc: {whole}.",
        f"Contacts of two discs alone, a disc: {discs}.",
        "In the first tenth of the required contacts times are off by at most "
        f"{number(max(row.worst_ticks for row in first), 3)} ticks, by "
        f"{number(max(row.median_ticks for row in first))} in the median; after that, for each contact a "
        f"disc, the error grows by {', '.join(slopes)}, as chaos makes it.",
    )


def _beside_twin(rows: Sequence[Horizon]) -> float:
    """Returns for which part of their twins' time runs agree, the median."""
    return median(row.collisions_per_disc / max(row.twin_collisions_per_disc, 1e-9) for row in rows)


def _draw(growth: Sequence[ErrorGrowth]) -> Figure:
    figure, panel = new_figure()
    for look, requirement in enumerate(REQUIREMENTS):
        some = [row for row in growth if row.density == requirement.density]
        across = [row.contacts_per_disc for row in some]
        label = f"density {requirement.density:g}, {requirement.bodies} discs"
        curve(panel, across, [max(row.median_ticks, 0.1) for row in some], look, label=label)
        worst = [max(row.worst_ticks, 0.1) for row in some]
        curve(panel, across, worst, look, marker="", linewidth=0.6)
        panel.axvline(requirement.required, 0.95, 1.0, color=LOOKS[look][0], linewidth=1.5)
    panel.set(
        yscale="log",
        ylim=(0.1, 2.0**52),
        xlabel="contacts a disc (each counted for each disc in it)",
        ylabel="time of contact off by (ticks of 2^-52)",
    )
    panel.grid(True, which="major", axis="y")
    legend_below(figure, len(REQUIREMENTS))
    return figure
