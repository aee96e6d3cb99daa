"""The part ``oracle`` of the report: the agreement of a run in doubles with the certified oracle."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Annotated, NamedTuple

import numpy as np

import kinetile as kt
from kinetile_accuracy import sections
from kinetile_accuracy.drawing import LOOKS, legend_below, new_figure
from kinetile_accuracy.oracle.agreement import Agreement, certify
from kinetile_accuracy.sections import Column, grouped, listed, number


class Requirement(NamedTuple):
    """A density of the thesis's grid, its number of discs, and the contacts a disc that must agree."""

    density: float
    bodies: int
    required: float


REQUIREMENTS = (Requirement(0.5, 16, 40.0), Requirement(0.1, 16, 13.0), Requirement(0.01, 25, 4.5))
SEEDS: dict[sections.Budget, int] = {"quick": 3, "normal": 10, "full": 50}
LONG_ENOUGH = 2000
"""Contacts of a compared run: far more than can agree."""


@dataclass(frozen=True)
class Horizon:
    """The agreement of one run with the oracle."""

    phase: Annotated[str, Column("the broad phase of the run", "broad phase")]
    density: Annotated[float, Column("of the scene", "density")]
    bodies: Annotated[int, Column("how many discs", "discs")]
    seed: Annotated[int, Column("of the scene", "seed")]
    contacts: Annotated[int, Column("how many contacts agree, in order", "contacts agree")]
    contacts_per_disc: Annotated[float, Column("each contact counted for each disc in it", "a disc")]
    required: Annotated[float, Column("contacts a disc that must agree", "required")]
    holds: Annotated[bool, Column("whether that many contacts a disc agree")]
    bits: Annotated[int, Column("the precision that certified the run", "bits")]
    first_ticks: Annotated[
        float, Column("largest error in the first tenth of the required contacts", "off by, first tenth")
    ]
    growth: Annotated[float, Column("growth of errors in bits with each contact a disc", "bits a contact")]
    differs: Annotated[str, Column("the first contact that does not agree")]


def measure(budget: sections.Budget, progress: sections.ReportProgress) -> sections.Section:
    """Measures the horizons of three densities on a few seeds."""
    found: list[tuple[Agreement, Horizon]] = []
    for requirement in REQUIREMENTS:
        for seed in range(SEEDS[budget]):
            progress("agreement with the oracle", len(found), len(REQUIREMENTS) * SEEDS[budget])
            found.append(measure_horizon(requirement, seed))
    rows = [row for _, row in found]
    phases = listed(list(grouped(rows, "phase")))
    return sections.Section(
        name="oracle",
        title="How long a run agrees with the certified oracle",
        about=(
            f"The oracle follows scenes of the recipe grid in ball arithmetic and proves the order of the "
            f"contacts; they are run under {phases}. A run agrees up to the first different contact in the "
            "two lists. Contacts a disc count each contact for each disc in it. Times are off in ticks of "
            "2^-52 of a time unit."
        ),
        findings=findings(rows),
        claims=(
            sections.Claim(
                "Runs agree with the certified oracle for as many contacts a disc as is required",
                f"{sum(row.holds for row in rows)} of {len(rows)} runs",
                all(row.holds for row in rows),
            ),
        ),
        tables=(sections.Table("horizons", "How far each run agrees.", tuple(rows)),),
        pictures=(
            sections.ReportFigure(
                "oracle",
                "How far the times of a run are off from the certified ones, against contacts a disc, all "
                "seeds together. The points end where the contacts are no longer the same; the marks on top "
                "are the contacts a disc that must agree.",
                lambda: _draw(found),
            ),
        ),
    )


def measure_horizon(requirement: Requirement, seed: int) -> tuple[Agreement, Horizon]:
    """Runs a grid and compares it with the oracle."""
    scene = kt.make_scene("grid", bodies=requirement.bodies, density=requirement.density, seed=seed)
    sim = kt.Simulation(scene)
    found = certify(sim, max_contacts=LONG_ENOUGH)
    errors = np.abs(found.ticks)
    large = errors > 10.0
    slope = np.polyfit(found.paces[large], np.log2(errors[large]), 1)[0] if large.sum() > 2 else 0.0
    return found, Horizon(
        phase=sim.broad_phase,
        density=requirement.density,
        bodies=requirement.bodies,
        seed=seed,
        contacts=found.contacts,
        contacts_per_disc=found.contacts_per_disc,
        required=requirement.required,
        holds=found.contacts_per_disc >= requirement.required,
        bits=found.oracle.bits,
        first_ticks=float(errors[found.paces <= requirement.required / 10.0].max(initial=0.0)),
        growth=float(slope),
        differs=str(found.disagreement or found.oracle.ending),
    )


def findings(rows: Sequence[Horizon]) -> tuple[str, ...]:
    """Returns sentences on the agreement of runs, with the requirement, and on the growth of errors."""
    whole, growth = [], []
    for density, some in grouped(rows, "density").items():
        at, paces = f"at density {density:g}", [row.contacts_per_disc for row in some]
        whole.append(f"{min(paces):.1f} to {max(paces):.1f} ({some[0].required:g} required) {at}")
        growth.append(f"{median(row.growth for row in some):.1f} bits {at}")
    return (
        f"Runs agree with the certified oracle, in order, for so many contacts a disc: {listed(whole)}.",
        "In the first tenth of the required contacts times are off by at most "
        f"{number(max(row.first_ticks for row in rows), 3)} ticks; after that, for each contact a disc, the "
        f"error grows by {listed(growth)}, as chaos makes it.",
    )


def _draw(found: Sequence[tuple[Agreement, Horizon]]) -> sections.Figure:
    figure, panel = new_figure()
    for look, requirement in enumerate(REQUIREMENTS):
        colour, marker, _ = LOOKS[look]
        some = [agreed for agreed, row in found if row.density == requirement.density]
        paces = np.concatenate([np.empty(0), *(agreed.paces for agreed in some)])
        errors = np.concatenate([np.empty(0), *(np.abs(agreed.ticks) for agreed in some)])
        label = f"density {requirement.density:g}, {requirement.bodies} discs"
        style = {"color": colour, "markersize": 2.0, "alpha": 0.5, "label": label, "rasterized": True}
        panel.plot(paces, np.maximum(errors, 0.1), marker, **style)
        panel.axvline(requirement.required, 0.95, 1.0, color=colour, linewidth=1.5)
    panel.set(
        yscale="log",
        ylim=(0.1, 2.0**52),
        xlabel="contacts a disc (each counted for each disc in it)",
        ylabel="time of contact off by (ticks of 2^-52)",
    )
    panel.grid(True, which="major", axis="y")
    legend_below(figure, len(REQUIREMENTS))
    return figure
