"""A case: one scene, how far to run it, and what a phase made of it. Saved as TOML it replays exactly."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene

__all__ = [
    "CONTACTS",
    "REFERENCE",
    "Case",
    "Outcome",
    "Subject",
    "brief_outcome",
    "difference",
    "load_case",
    "not_saved",
    "outcome",
    "save_case",
]

REFERENCE = "naive"
CONTACTS = 150
"""A run ends after so many contacts, if not before; one that is made in pieces, each of them."""

UNTIL = 8.0


@dataclass(frozen=True)
class Subject:
    """The phase on trial: its name and options."""

    name: str
    options: Mapping[str, Any]

    def simulation(self, scene: Scene, **more: Any) -> Simulation:
        """Return a simulation of a scene under this phase; the loop is the same for all cases of a kind."""
        return Simulation(scene, self.name, options=self.options, turning=True, **more)


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
    def of(cls, sim: Simulation, ended: str) -> Outcome:
        """Read a simulation out."""
        from kinetile.conformance.checks.tables import left_behind

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
    """Run a case; an error of the run is part of its outcome. ``Refused`` and ``BadOption`` are not
    caught."""
    sim = subject.simulation(scene, **more)
    ended = "ran"
    try:
        sim.run(until=horizon(scene), max_contacts=contacts)
    except KinetileError as error:
        ended = f"{type(error).__name__}: {error}"
    return Outcome.of(sim, ended)


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
    from kinetile.conformance.checks.tables import left_otherwise

    return left_otherwise(found.left, expected.left)


def _contact(result: Outcome, at: int) -> str:
    from kinetile.kernel.log import WALLS

    row = result.contacts[at]
    partner = f"the {WALLS[int(row['b'])]} wall" if row["b"] < 0 else f"body {row['b']}"
    return f"body {row['a']} with {partner} at time {float(row['time'])!r}"


def save_case(scene: Scene, path: Path, check: str, subject: Subject, said: str) -> None:
    """Write a case as a scene file; what was on trial, with its options, and what was said stand in comments
    at its head."""
    from kinetile.scene.files import dumps_scene

    head = [f"check: {check}", f"broad phase: {subject.name}"]
    if subject.options:
        head.append(f"options: {json.dumps(dict(subject.options), default=repr)}")
    head += [f"said: {line}" for line in said.splitlines()[:6]]
    text = "".join(f"# {line}\n" for line in head)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text + dumps_scene(scene), encoding="utf-8")


def not_saved(what: str, error: OSError) -> str:
    """Return the line of a report that says why a file is missing: no fault of the phase on trial."""
    return f"(the {what} could not be saved: {error.strerror or error})"


@dataclass(frozen=True)
class Case:
    """A case as it was saved: the scene, and the check, phase and options that its file names; None, where it
    names none."""

    scene: Scene
    check: str | None
    name: str | None
    options: Mapping[str, Any]


def load_case(path: Path) -> Case:
    """Read a case; a scene file that the kit has not written is one as well."""
    from kinetile.plugin.by_name import load_scene

    head: dict[str, str] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("# "):
            break
        key, _, value = line[2:].partition(":")
        head.setdefault(key, value.strip())
    options = {}
    if "check" in head:
        with contextlib.suppress(ValueError):
            options = json.loads(head.get("options", "{}"))
    check = head.get("check")
    return Case(load_scene(path), check, head.get("broad phase") if check else None, options)
