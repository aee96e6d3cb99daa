"""Running one scene under one phase, as far as a case goes, and comparing what comes of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError
from kinetile.kernel.log import WALLS
from kinetile.plugin.registry import Provided, registry
from kinetile.plugin.specs import NarrowPhaseSpec
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile_conformance.cases.tables import left_behind, left_otherwise

__all__ = [
    "CONTACTS",
    "REFERENCE",
    "Outcome",
    "Subject",
    "brief_outcome",
    "difference",
    "horizon",
    "outcome",
    "provided",
]

REFERENCE = "naive"
CONTACTS = 150
"""A run ends after so many contacts, if not before; one that is made in pieces, each of them."""

UNTIL = 8.0


@dataclass(frozen=True)
class Subject:
    """What is on trial: a broad phase with its options, alone or with narrow phases.

    ``narrow`` has the options of each narrow phase that is named. It takes the place of the usual one of its
    role: ``disc`` for pairs, ``wall`` for walls.
    """

    name: str
    options: Mapping[str, Any]
    narrow: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def simulation(self, scene: Scene, **more: Any) -> Simulation:
        """Return a simulation of a scene under these phases; the loop is the same for all cases of a kind."""
        chosen = {"narrow_phases": self.narrow_phases(scene)} | more
        return Simulation(scene, self.name, options=self.options, turning=True, **chosen)

    def narrow_phases(self, scene: Scene) -> dict[str, Mapping[str, Any]] | None:
        """Return the narrow phases for a scene; None where none is named: those that the scene says."""
        if not self.narrow:
            return None
        pairs, walls = (self.of_role(role) for role in ("pair", "wall"))
        return (pairs or {"disc": {}}) | ((walls or {"wall": {}}) if scene.arena is not None else {})

    def of_role(self, role: str) -> dict[str, Mapping[str, Any]]:
        """Return the narrow phases of a role that are named."""
        found = {name: registry().spec("narrow phase", name) for name in self.narrow}
        return {n: self.narrow[n] for n, spec in found.items() if cast(NarrowPhaseSpec, spec).role == role}

    @property
    def pair(self) -> str | None:
        """The narrow phase for pairs that is named; None: it is the usual one."""
        return next(iter(self.of_role("pair")), None)

    def under(self, broad_phase: str) -> Subject:
        """Return another broad phase with the same narrow phases."""
        return Subject(broad_phase, {}, self.narrow)


def provided(subject: Subject) -> tuple[Provided, ...]:
    """Return who provides the phases on trial, the broad phase first."""
    narrow = (registry().provided("narrow phase", name) for name in subject.narrow)
    return registry().provided("broad phase", subject.name), *narrow


@dataclass(frozen=True)
class Outcome:
    """What is left of a run: everything that must be the same under every phase."""

    contacts: npt.NDArray[np.void]
    ended: str
    time: float
    positions: npt.NDArray[np.float64]
    velocities: npt.NDArray[np.float64]
    left: Mapping[str, npt.NDArray[np.generic]] = field(default_factory=dict)

    @classmethod
    def after(cls, sim: Simulation, run: Callable[[], object]) -> Outcome:
        """Return what is left of a simulation after a run; an error of the run is part of it."""
        ended = "ran"
        try:
            run()
        except KinetileError as error:
            ended = f"{type(error).__name__}: {error}"
        return cls.of(sim, ended)

    @classmethod
    def of(cls, sim: Simulation, ended: str = "ran") -> Outcome:
        """Read a simulation out."""
        left = left_behind(sim) if ended == "ran" else {}
        return cls(sim.contacts, ended, sim.time, sim.positions(), sim.velocities(), left)


def horizon(scene: Scene) -> float:
    """Return until when a case runs."""
    return scene.settings.until if scene.settings.until is not None else scene.start + UNTIL


def brief_outcome(subject: Subject, scene: Scene, until: float | None = None) -> tuple[str, str, int]:
    """Run a case, until its horizon if not otherwise; return how it ended, its fingerprint, and how many
    events of all kinds it had: what two runs of one phase have in common."""
    sim = subject.simulation(scene)
    ended = "ran"
    try:
        sim.run(until=horizon(scene) if until is None else until, max_contacts=CONTACTS)
    except KinetileError as error:
        ended = type(error).__name__
    return ended, sim.fingerprint, sim.readings.events


def outcome(subject: Subject, scene: Scene, contacts: int = CONTACTS, **more: Any) -> Outcome:
    """Run a case; an error of the run is part of its outcome, but not one of preparing it: ``Refused`` and
    ``BadOption`` are raised."""
    sim = subject.simulation(scene, **more)
    return Outcome.after(sim, lambda: sim.run(until=horizon(scene), max_contacts=contacts))


def difference(found: Outcome, expected: Outcome, name: str) -> str | None:
    """Return where an outcome first parts from the expected one, in a sentence; None where it nowhere
    does."""
    rows = min(len(found.contacts), len(expected.contacts))
    parted = np.flatnonzero(found.contacts[:rows] != expected.contacts[:rows])
    if len(parted):
        at = int(parted[0])
        return f"contact {at} is {_contact(found, at)}, and should be {_contact(expected, at)}"
    same_end = found.ended.partition(":")[0] == expected.ended.partition(":")[0]
    if not same_end:
        return f"{name} ended with {found.ended}; {REFERENCE} {expected.ended}"
    if len(found.contacts) < len(expected.contacts):
        return f"contact {rows} is missing: {_contact(expected, rows)}"
    if len(found.contacts) > len(expected.contacts):
        return f"contact {rows} is one too many: {_contact(found, rows)}"
    for which in ("positions", "velocities"):
        mine, right = getattr(found, which), getattr(expected, which)
        if mine.tobytes() != right.tobytes():
            body = int(np.flatnonzero((mine != right).any(axis=1))[0]) if len(mine) else 0
            return (
                f"at the end the {which} of body {body} are {mine[body].tolist()}, not {right[body].tolist()}"
            )
    if found.time != expected.time:
        return f"the run ended at time {found.time!r}, and should have at {expected.time!r}"
    return left_otherwise(found.left, expected.left)


def _contact(result: Outcome, at: int) -> str:
    row = result.contacts[at]
    partner = f"the {WALLS[int(row['b'])]} wall" if row["b"] < 0 else f"body {row['b']}"
    return f"body {row['a']} with {partner} at time {float(row['time'])!r}"
