"""The part ``drift`` of the report: energy and overlaps in a long run, and contacts under late clocks. One
run, which audits itself, is measured at 10^3, 10^4, ... contacts. Other runs of the same scene begin with the
clock at 2^20 and at 2^40: the contacts must be the same."""

import math
from dataclasses import dataclass
from typing import Annotated

import kinetile as kt
from kinetile_accuracy import sections
from kinetile_accuracy.drawing import curve, legend_below, new_figure
from kinetile_accuracy.sections import Column, number

MOST: dict[sections.Budget, int] = {"quick": 10**6, "normal": 10**7, "full": 10**8}
GRID, PARAMETERS = "grid", {"bodies": 100, "density": 0.5, "seed": 1}
STARTS = (0.0, 2.0**20, 2.0**40)


@dataclass(frozen=True)
class Drift:
    """The readings of a run after a number of contacts."""

    phase: Annotated[str, Column("the broad phase of the run")]
    contacts: Annotated[int, Column("contacts of discs and walls", "contacts")]
    time: Annotated[float, Column("in the scene's time")]
    energy: Annotated[float, Column("relative change of the kinetic energy", "energy")]
    deepest_overlap: Annotated[float, Column("at any contact so far, in radii", "deepest overlap / r")]
    lateness: Annotated[float, Column("how far in the past a structural event was found", "lateness")]
    audits: Annotated[int, Column("times that all was compared with the bodies by brute force", "audits")]
    seconds: Annotated[float, Column("processor time in the loop")]


@dataclass(frozen=True)
class LateClock:
    """A run whose clock begins late."""

    phase: Annotated[str, Column("the broad phase of the run")]
    start: Annotated[float, Column("when the clock begins", "clock begins at")]
    contacts: Annotated[int, Column("of discs and walls", "contacts")]
    same: Annotated[bool, Column("whether the contacts are the same as with the clock at 0", "same contacts")]


def drifts(scene: kt.Scene, most: int, progress: sections.ReportProgress) -> list[Drift]:
    """Runs a scene for ``most`` contacts, audited a thousand times; returns readings at 10^3, 10^4, ..."""
    sim = kt.Simulation(scene, keep_contacts=False, audit=max(most // 1000, 1000))
    rows: list[Drift] = []
    for mark in [10**k for k in range(3, int(math.log10(most)) + 1)]:
        sim.run(
            max_contacts=mark - (rows[-1].contacts if rows else 0),
            progress=lambda now: progress("a long run", now.contacts, most),
        )
        now = sim.readings
        errors = now.unaccounted_energy, now.deepest_overlap, now.lateness
        rows.append(Drift(sim.broad_phase, now.contacts, sim.time, *errors, now.audits, now.cpu_seconds))
    return rows


def clocks(scene: kt.Scene, contacts: int) -> list[LateClock]:
    """Runs a scene with its clock at each of ``STARTS``."""
    rows: list[LateClock] = []
    first = ""
    for start in STARTS:
        sim = kt.Simulation(scene.replace(start=start), keep_contacts=False)
        sim.run(max_contacts=contacts)
        first = first or sim.fingerprint
        rows.append(LateClock(sim.broad_phase, start, sim.readings.contacts, sim.fingerprint == first))
    return rows


def measure(budget: sections.Budget, progress: sections.ReportProgress) -> sections.Section:
    """Measures a long run and late clocks on the thesis's grid of 100 discs."""
    most = MOST[budget]
    scene = kt.make_scene(GRID, **PARAMETERS)
    drift = drifts(scene, most, progress)
    progress("clocks", 0, 1)
    clock = clocks(scene, min(most, 10**6) // 10)
    last, middle = drift[-1], drift[len(drift) // 2]
    given = ", ".join(f"{name} {value:g}" for name, value in PARAMETERS.items())
    growth = last.deepest_overlap / middle.deepest_overlap if middle.deepest_overlap else 1.0
    return sections.Section(
        name="drift",
        title="The losses of a long run",
        about=(
            f"The recipe {GRID} with {given}, under {last.phase}, for {last.contacts:,} contacts of discs "
            f"and walls; between contacts, {last.audits:,} times, an audit rebuilt the structure and "
            "compared it, and looked by brute force for pairs that are no candidates. No contact was missed, "
            f"or the run would have stopped. Below: the same scene under {clock[0].phase} with other clocks."
        ),
        findings=(
            f"The deepest overlap at any contact is {number(last.deepest_overlap)} radii, {growth:.1f} times "
            f"the one of the first {middle.contacts:,}.",
        ),
        tables=(
            sections.Table("drift", "The readings after so many contacts.", tuple(drift)),
            sections.Table("clocks", "The same scene with clocks that begin late.", tuple(clock)),
        ),
        claims=_claims(drift, clock, most),
        pictures=(
            sections.ReportFigure(
                "drift",
                "Energy and deepest overlap against contacts. The grey dotted line is how a random walk of "
                "one rounding a contact would grow.",
                lambda: _draw(drift),
            ),
        ),
    )


def _claims(drift: list[Drift], clock: list[LateClock], most: int) -> tuple[sections.Claim, ...]:
    last = drift[-1]
    walk = _walk(last.contacts)
    return (
        sections.Claim(
            f"A run of {most:,} contacts comes to its end under audit",
            f"{last.contacts:,} contacts, {last.audits:,} audits",
            last.contacts >= most and last.audits > 0,
        ),
        sections.Claim(
            "Energy wanders no further than one rounding a contact would take it",
            f"{number(last.energy)}; the walk: {number(walk)}",
            last.energy <= walk,
        ),
        sections.Claim(
            "Late clocks show the same contacts, to the last bit",
            f"{sum(row.same for row in clock)} of {len(clock)} clocks, {clock[0].contacts:,} contacts",
            all(row.same for row in clock),
        ),
    )


def _walk(contacts: int) -> float:
    """Returns the distance of a random walk of one rounding a contact."""
    return 2.0**-53 * math.sqrt(contacts)


def _draw(rows: list[Drift]) -> sections.Figure:
    figure, panel = new_figure()
    contacts = [row.contacts for row in rows]
    for look, (field, label) in enumerate((("energy", "energy"), ("deepest_overlap", "deepest overlap / r"))):
        curve(panel, contacts, [getattr(row, field) or math.nan for row in rows], look, label=label)
    panel.plot(contacts, [_walk(n) for n in contacts], ":", color="0.5", label="random walk of roundings")
    panel.set(xscale="log", yscale="log", xlabel="contacts", ylabel="relative")
    legend_below(figure, 3)
    return figure
