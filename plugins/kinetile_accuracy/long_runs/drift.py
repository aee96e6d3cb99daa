"""What a long run loses: energy, momentum, the distance at contact, the way back, and what the clock shows.

A trajectory of hard discs cannot be compared with the truth for long (the part ``oracle`` says for how long).
What can be asked after any number of contacts is whether each contact was still a contact of these discs at
that distance, and whether what the laws keep was kept. So the readings are taken at 10^3, 10^4, ... contacts
of one run, which audits itself, and beside them:

- *momentum* is not kept in an arena, but by every contact of two discs. The sum of what these contacts leave
  over is taken from the log, in extended precision where the machine has it;
- *the distance at contact* comes from the log too: |d| - R when the two bodies are brought to the tick, in
  units of R. It is the formula's rounding, that of the two flights, and up to a tick of flight;
- *the clock* begins at 0, at 2^20 and at 2^40. The contacts must be the same;
- *the way back*: all velocities are reversed after a while, and the run returns to where it began, but for
  its rounding, which chaos has doubled many times. It is a measure of chaos, not of the kernel, and says how
  many contacts a disc may have before a trajectory means nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt

import kinetile as kt
from kinetile_accuracy.parts import Column, Progress

__all__ = ["Clock", "Drift", "WayBack", "clocks", "contacts_of", "drifts", "way_back"]

STARTS = (0.0, 2.0**20, 2.0**40)
_BINS_PER_OCTAVE = 8
_SMALLEST = -80  # octaves


@dataclass(frozen=True)
class Drift:
    """The readings of a run after so many contacts."""

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
class Clock:
    """A run whose clock begins late."""

    start: Annotated[float, Column("when the clock begins", "clock begins at")]
    contacts: Annotated[int, Column("of discs and walls", "contacts")]
    deepest_overlap: Annotated[float, Column("at any contact, in radii", "deepest overlap / r")]
    energy: Annotated[float, Column("relative change of the kinetic energy", "energy")]
    same: Annotated[bool, Column("whether the contacts are those of the clock at 0", "same contacts")]


@dataclass(frozen=True)
class WayBack:
    """A run that is turned back."""

    density: Annotated[float, Column("of the scene", "density")]
    until: Annotated[float, Column("when it is turned back", "turned back at")]
    contacts_per_disc: Annotated[
        float, Column("until then; a contact of two discs counts for both", "contacts a disc")
    ]
    error: Annotated[float, Column("largest distance from where a disc began, in radii", "error / r")]


class _FromTheLog:
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
        """Take in the rows of a chunk."""
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
        """What is left over of momentum, relative to the sum of m |v|."""
        return float(np.hypot(*self._left)) / self._scale

    @property
    def late(self) -> float:
        """Share of the contacts at which the discs overlap."""
        return self._late / max(self._zero + int(self._bins.sum()), 1)

    def gap(self, share: float) -> float:
        """Return the distance that this share of the contacts does not exceed, within a tenth."""
        seen = self._zero + np.cumsum(self._bins)
        if seen[-1] == 0 or self._zero >= share * seen[-1]:
            return 0.0
        return float(2.0 ** (_SMALLEST + (np.searchsorted(seen, share * seen[-1]) + 1) / _BINS_PER_OCTAVE))


def contacts_of(sim: kt.Simulation) -> int:
    """Return how many contacts a simulation has had, of discs and walls."""
    return sim.readings.contacts_disc + sim.readings.contacts_wall


def drifts(scene: kt.Scene, most: int, progress: Progress, broad_phase: str | None = None) -> list[Drift]:
    """Run a scene for ``most`` contacts, audited a thousand times; return its readings at 10^3, 10^4, ..."""
    ledger = _FromTheLog(scene)
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


def clocks(scene: kt.Scene, contacts: int, starts: tuple[float, ...] = STARTS) -> list[Clock]:
    """Run a scene with its clock at each of these starts."""
    rows: list[Clock] = []
    usual: str | None = None
    for start in starts:
        sim = kt.Simulation(replace(scene, start=start), keep_contacts=False)
        sim.run(max_contacts=contacts)
        found = sim.readings
        usual = found.fingerprint if usual is None else usual
        rows.append(
            Clock(
                start=start,
                contacts=contacts_of(sim),
                deepest_overlap=found.deepest_overlap,
                energy=found.energy_drift,
                same=found.fingerprint == usual,
            )
        )
    return rows


def way_back(scene: kt.Scene, density: float, until: float) -> WayBack:
    """Run a scene to a time, reverse all velocities, and run it back."""
    sim = kt.Simulation(scene, turning=True, keep_contacts=False)
    sim.run(until=until)
    found = sim.readings
    for body, (vx, vy) in enumerate(sim.velocities()):
        sim.set_velocity(body, (-vx, -vy))
    sim.run(until=2.0 * until)
    error = np.hypot(*(sim.positions() - scene.position).T) / scene.radius
    return WayBack(
        density=density,
        until=until,
        contacts_per_disc=(2 * found.contacts_disc + found.contacts_wall) / len(scene),
        error=float(error.max()),
    )
