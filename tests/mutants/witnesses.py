"""Witnesses: for a mutant, a scene on which its answer or a rule of the contract is broken, without the kit.

A witness is called with the label under which the mutant is registered. It returns a sentence that says what
is wrong, or nothing where all is as it should be.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import kinetile as kt
from agreement import outcome
from kinetile.errors import AuditError, KinetileError, Refused
from kinetile.kernel.tables import column

__all__ = ["Accepts", "Audited", "Differs", "Later", "Surroundings", "Tampers", "Unlike"]

Make = Callable[[], kt.Scene]


@dataclass(frozen=True)
class Differs:
    """It gives other contacts, another end or another final state than the reference.

    Attributes:
        scene: makes the scene.
        until: until when; None: as the scene says.
        contacts: how many contacts, at most.
        options: of the phase.
    """

    scene: Make
    until: float | None = None
    contacts: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)

    def __call__(self, label: str) -> str:
        """Run both, and say whether they differ."""
        scene = self.scene()
        expected = outcome(scene, "naive", {}, self.until, self.contacts)[1]
        try:
            found = outcome(scene, label, dict(self.options), self.until, self.contacts)[1]
        except (IndexError, OverflowError) as error:  # interpreted; compiled it would be another's memory
            return f"{type(error).__name__}: {error}"
        if found == expected:
            return ""
        return f"{found.ended} with {len(found.contacts)} bytes of contacts, naive {expected.ended}"


@dataclass(frozen=True)
class Audited:
    """Two bodies that touch are not near each other, or near is not mutual, at some moment of a run."""

    scene: Make
    until: float
    narrow_phases: tuple[str, ...] | None = None
    steps: int = 20
    options: Mapping[str, Any] = field(default_factory=dict)

    def __call__(self, label: str) -> str:
        """Run in steps, audited between them."""
        sim = kt.Simulation(self.scene(), label, narrow_phases=self.narrow_phases, options=dict(self.options))
        try:
            for step in range(1, self.steps + 1):
                sim.run(until=self.until * step / self.steps)
                sim.audit()
                named = set(map(tuple, sim.near().tolist()))
                for a, b in sorted(named):
                    if (b, a) not in named:
                        return f"{b} is near {a}, and {a} not near {b}"
                place, radius = sim.positions(), sim.scene.radius
                for a, b in zip(*np.triu_indices(len(radius), 1), strict=True):
                    touching = np.hypot(*(place[a] - place[b])) <= radius[a] + radius[b]
                    if touching and (a, b) not in named:
                        return f"{a} and {b} touch at time {sim.time}, and are not near each other"
        except AuditError as error:
            return str(error)
        except KinetileError as error:
            return f"{type(error).__name__}: {error}"
        return ""


@dataclass(frozen=True)
class Accepts:
    """It takes a scene that the phase it is made from refuses, since it would not be right there."""

    scene: Make
    base: str

    def __call__(self, label: str) -> str:
        """See that only the phase it is made from refuses."""
        scene = self.scene()
        try:
            kt.Simulation(scene, self.base).build()
        except Refused as error:
            kt.Simulation(scene, label).build()
            return f"accepted, where {self.base} says: {error}"
        return ""


@dataclass(frozen=True)
class Tampers:
    """A hook changes what is not its own: after the same run it is not what it is under the untouched phase.

    Attributes:
        scene: makes the scene.
        base: the phase that the mutant is made from.
        table: of the kernel's tables.
        field: of its records; empty: the numbers of the table beyond those that may be written.
        until: until when.
    """

    scene: Make
    base: str
    table: str
    field: str
    until: float

    def __call__(self, label: str) -> str:
        """Run both, and say whether they differ."""
        left = []
        for phase in (self.base, label):
            sim = kt.Simulation(self.scene(), phase)
            sim.run(until=self.until)
            table = getattr(sim.tables, self.table)
            left.append(np.array(column(table, self.field) if self.field else table[len(sim.scene) + 8 :]))
        if np.array_equal(*left):
            return ""
        return f"{self.table}.{self.field} is {left[1].tolist()}, and under {self.base} {left[0].tolist()}"


@dataclass(frozen=True)
class Later:
    """It is right for a while: of many simulations the last ones differ from the reference."""

    scene: Make
    until: float
    times: int
    class_name: str

    def __call__(self, label: str) -> str:
        """Have many prepared, and compare the next one."""
        scene = self.scene()
        module = importlib.import_module(f"mutant_{label.replace('-', '_')}")
        for _ in range(self.times):
            getattr(module, self.class_name)().prepare(scene)
        return Differs(self.scene, self.until)(label)


@dataclass(frozen=True)
class Surroundings:
    """It is wrong where something is so that has nothing to do with a scene."""

    scene: Make
    until: float
    arrange: Callable[[Any], None]

    def __call__(self, label: str) -> str:
        """Compare while the surroundings are so."""
        import pytest

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["python"])
            self.arrange(patch)
            return Differs(self.scene, self.until)(label)


@dataclass(frozen=True)
class Unlike:
    """Of many simulations of one scene, not all give the reference's contacts."""

    scene: Make
    until: float
    times: int

    def __call__(self, label: str) -> str:
        """Make many, all at once, and compare each."""
        scene = self.scene()
        expected = kt.Simulation(scene, "naive")
        expected.run(until=self.until)
        sims = [kt.Simulation(scene, label) for _ in range(self.times)]
        for number, sim in enumerate(sims):
            try:
                sim.run(until=self.until)
            except KinetileError as error:
                return f"simulation {number}: {type(error).__name__}"
            if sim.fingerprint != expected.fingerprint:
                return f"simulation {number} of {self.times} differs from naive"
        return ""
