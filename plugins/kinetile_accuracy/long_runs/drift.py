"""The part ``drift`` of the report: errors of energy, momentum and distance at contact in a long run.

A trajectory of hard discs cannot be compared with an exact one for long (the part ``oracle`` says how long).
After any number of contacts it can still be measured whether each was a contact of these discs at that
distance, and whether the conserved values were kept. So the readings are taken at 10^3, 10^4, ... contacts
of one run, which audits itself, and beside them:

- *momentum* is not kept in an arena, but by every contact of two discs. The sum of the errors of these
  contacts is taken from the log, in extended precision if the machine has it;
- *the distance at contact* comes from the log too: |d| - R when the two bodies are brought to the tick, in
  units of R. It is the formula's rounding, that of the two flights, and up to a tick of flight;
- *the clock* begins at 0, at 2^20 and at 2^40. The contacts must be the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
import numpy.typing as npt

import kinetile as kt
from kinetile_accuracy.drawing import curve, legend_below, new_figure
from kinetile_accuracy.sections import (
    Budget,
    Claim,
    Column,
    ReportFigure,
    ReportProgress,
    Section,
    Table,
    number,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


STARTS = (0.0, 2.0**20, 2.0**40)
_BINS_PER_OCTAVE = 8
_SMALLEST = -80  # octaves


@dataclass(frozen=True)
class Drift:
    """The readings of a run after a number of contacts."""

    phase: Annotated[str, Column("the broad phase of the run")]
    contacts: Annotated[int, Column("contacts of discs and walls", "contacts")]
    time: Annotated[float, Column("in the scene's time")]
    energy: Annotated[float, Column("relative change of the kinetic energy", "energy")]
    momentum: Annotated[
        float, Column("what contacts of two discs left over, of the sum of m |v|", "momentum")
    ]
    deepest_overlap: Annotated[float, Column("at any contact so far, in radii", "deepest overlap / r")]
    gap_median: Annotated[
        float, Column("distance at contact from the exact one, in R: median", "gap / R, median")
    ]
    gap_p99: Annotated[float, Column("the same: 99 % are no further off", "99 %")]
    gap_max: Annotated[float, Column("the same: the furthest", "max")]
    late: Annotated[
        float, Column("share of contacts at which discs overlap, by however little", "overlapping")
    ]
    lateness: Annotated[float, Column("how far in the past a structural event was found", "lateness")]
    audits: Annotated[int, Column("times that all was compared with the bodies by brute force", "audits")]
    seconds: Annotated[float, Column("processor time in the loop")]


@dataclass(frozen=True)
class LateClock:
    """A run whose clock begins late."""

    phase: Annotated[str, Column("the broad phase of the run")]
    start: Annotated[float, Column("when the clock begins", "clock begins at")]
    contacts: Annotated[int, Column("of discs and walls", "contacts")]
    deepest_overlap: Annotated[float, Column("at any contact, in radii", "deepest overlap / r")]
    energy: Annotated[float, Column("relative change of the kinetic energy", "energy")]
    same: Annotated[bool, Column("whether the contacts are those of the clock at 0", "same contacts")]


class LogReadings:
    """Takes from the log what contacts of two discs leave over of momentum, and their distances."""

    def __init__(self, scene: kt.Scene) -> None:
        self._mass = scene.mass.astype(np.longdouble)
        self._radius = scene.radius
        self._velocity = scene.velocity.astype(np.longdouble)
        self._scale = float((scene.mass * np.hypot(*scene.velocity.T)).sum()) or 1.0
        self._left = np.zeros(2, dtype=np.longdouble)
        self._bins = np.zeros(-_SMALLEST * _BINS_PER_OCTAVE + 1, dtype=np.int64)
        self._zero = self._late = 0
        self.gap_max = 0.0

    def __call__(self, rows: npt.NDArray[np.void]) -> None:
        """Takes in the rows of a chunk."""
        # The velocities that rows give, body by body, in the order of time. What a body gained at a contact
        # is the difference from the row before, or from what it had when the chunk began.
        pairs = rows["b"] >= 0
        both = rows[pairs]
        body = np.concatenate([rows["a"], both["b"]])
        place = np.concatenate([np.arange(len(rows)), np.flatnonzero(pairs)])
        x = np.concatenate([rows["avx"], both["bvx"]]).astype(np.longdouble)
        y = np.concatenate([rows["avy"], both["bvy"]]).astype(np.longdouble)
        order = np.lexsort((place, body))
        body, place, velocity = body[order], place[order], np.column_stack([x, y])[order]
        first = np.ones(len(body), dtype=bool)
        first[1:] = body[1:] != body[:-1]
        before = np.empty_like(velocity)
        before[1:] = velocity[:-1]
        before[first] = self._velocity[body[first]]
        last = np.roll(first, -1)
        self._velocity[body[last]] = velocity[last]
        gained = self._mass[body][:, None] * (velocity - before)
        self._left += gained[pairs[place]].sum(axis=0)
        self._distances(both)

    def _distances(self, both: npt.NDArray[np.void]) -> None:
        reach = self._radius[both["a"]] + self._radius[both["b"]]
        gap = (np.hypot(both["bx"] - both["ax"], both["by"] - both["ay"]) - reach) / reach
        size = np.abs(gap)
        self.gap_max = max(self.gap_max, float(size.max(initial=0.0)))
        self._zero += int((size == 0.0).sum())
        self._late += int((gap < 0.0).sum())
        octave = np.log2(size[size > 0.0])
        bins = np.clip(((octave - _SMALLEST) * _BINS_PER_OCTAVE).astype(np.int64), 0, len(self._bins) - 1)
        self._bins += np.bincount(bins, minlength=len(self._bins))

    @property
    def momentum(self) -> float:
        """The remaining momentum, relative to the sum of m |v|."""
        return float(np.hypot(*self._left)) / self._scale

    @property
    def late(self) -> float:
        """Share of the contacts at which the discs overlap."""
        return self._late / max(self._zero + int(self._bins.sum()), 1)

    def gap(self, share: float) -> float:
        """Returns the distance that this share of the contacts does not exceed, within a tenth."""
        seen = self._zero + np.cumsum(self._bins)
        if seen[-1] == 0 or self._zero >= share * seen[-1]:
            return 0.0
        return float(2.0 ** (_SMALLEST + (np.searchsorted(seen, share * seen[-1]) + 1) / _BINS_PER_OCTAVE))


def contacts_of(sim: kt.Simulation) -> int:
    """Returns how many contacts a simulation has had, of discs and walls."""
    return sim.readings.contacts_disc + sim.readings.contacts_wall


def drifts(
    scene: kt.Scene, most: int, progress: ReportProgress, broad_phase: str | None = None
) -> list[Drift]:
    """Runs a scene for ``most`` contacts, audited a thousand times; returns readings at 10^3, 10^4, ..."""
    ledger = LogReadings(scene)
    every = max(most // 1000, 1000)
    sim = kt.Simulation(scene, broad_phase, keep_contacts=False, audit=every)
    marks = [10**k for k in range(3, int(math.log10(most)) + 1)]
    rows = []
    for mark in marks:
        sim.run(
            max_contacts=mark - contacts_of(sim),
            recorder=ledger,
            progress=lambda now: progress("a long run", now.contacts, most),
        )
        found = sim.readings
        rows.append(
            Drift(
                phase=sim.broad_phase,
                contacts=contacts_of(sim),
                time=sim.time,
                energy=found.energy_drift,
                momentum=ledger.momentum,
                deepest_overlap=found.deepest_overlap,
                gap_median=ledger.gap(0.5),
                gap_p99=ledger.gap(0.99),
                gap_max=ledger.gap_max,
                late=ledger.late,
                lateness=found.lateness,
                audits=found.audits,
                seconds=found.cpu_seconds,
            )
        )
    return rows


def clocks(scene: kt.Scene, contacts: int, starts: tuple[float, ...] = STARTS) -> list[LateClock]:
    """Runs a scene with its clock at each of these starts."""
    rows: list[LateClock] = []
    usual: str | None = None
    for start in starts:
        sim = kt.Simulation(replace(scene, start=start), keep_contacts=False)
        sim.run(max_contacts=contacts)
        found = sim.readings
        usual = found.fingerprint if usual is None else usual
        rows.append(
            LateClock(
                phase=sim.broad_phase,
                start=start,
                contacts=contacts_of(sim),
                deepest_overlap=found.deepest_overlap,
                energy=found.energy_drift,
                same=found.fingerprint == usual,
            )
        )
    return rows


MOST: dict[Budget, int] = {"quick": 10**6, "normal": 10**7, "full": 10**8}
"""Contacts of the long run."""


GRID, PARAMETERS = "grid", {"bodies": 100, "density": 0.5, "seed": 1}
"""The recipe of the run, and its parameters."""


def measure(budget: Budget, progress: ReportProgress) -> Section:
    """Measures all of this on the thesis's grid of 100 discs."""
    most = MOST[budget]
    scene = kt.make_scene(GRID, **PARAMETERS)
    drift = drifts(scene, most, progress)
    progress("clocks", 0, 1)
    clock = clocks(scene, min(most, 10**6) // 10)
    last, middle = drift[-1], drift[len(drift) // 2]
    given = ", ".join(f"{name} {value:g}" for name, value in PARAMETERS.items())
    growth = last.deepest_overlap / middle.deepest_overlap if middle.deepest_overlap else 1.0
    return Section(
        name="drift",
        title="What a long run loses",
        about=(
            f"The recipe {GRID} with {given}, under {last.phase}, for {last.contacts:,} contacts of discs "
            f"and walls; between contacts, {last.audits:,} times, an audit rebuilt the structure and "
            "compared it, and looked by brute force for pairs that are no candidates. No contact was missed, "
            f"or the run would have stopped. Below: the same scene under {clock[0].phase} with other clocks."
        ),
        findings=(
            f"The deepest overlap at any contact is {number(last.deepest_overlap)} radii, {growth:.1f} times "
            f"that of the first {middle.contacts:,}; half of all contacts are within "
            f"{number(last.gap_median)} R of the exact distance, 99 % within {number(last.gap_p99)}.",
        ),
        tables=(
            Table("drift", "The readings after so many contacts.", tuple(drift)),
            Table("clocks", "The same scene with clocks that begin late.", tuple(clock)),
        ),
        claims=tuple(_claims(most, drift, clock)),
        pictures=(
            ReportFigure(
                "drift",
                "Energy, momentum, deepest overlap and distance at contact against contacts. The grey dotted "
                "line is how a random walk of one rounding a contact would grow.",
                lambda: _draw_drift(drift),
            ),
        ),
    )


def _claims(most: int, drift: list[Drift], clock: list[LateClock]) -> list[Claim]:
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
    """Returns how far a random walk of one rounding a contact comes."""
    return 2.0**-53 * math.sqrt(contacts)


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
