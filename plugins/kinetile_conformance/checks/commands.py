"""Checks of living scenes, in which bodies come, go and turn, and of scenes with kinds and responses.

A phase without ``enter`` and ``leave`` is rebuilt for each command, and has to be right as well.

A response is no business of a broad phase. But bodies that pass through each other lie on top of one another
in its structure, those that have stopped touch for good, and a body between two immovable ones becomes faster
than any body was.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import kinetile as kt
from kinetile.errors import AuditError, KinetileError, Refused
from kinetile.run.simulation import Simulation
from kinetile.scene import Insert, Remove, Scene, with_commands
from kinetile_conformance.cases import CONTACTS, LIVING_CONTACTS, RunOutcome, Subject, horizon
from kinetile_conformance.checks.check import Disagreement, Reference, agree, agree_when_commanded, check
from kinetile_conformance.strategies.living import only_solid

AUDITS = 24
"""Audits in a living scene; one takes O(n^2), so there are fewer among more than a hundred bodies."""

DRAWN = 2
"""Drawings in a living scene: with hundreds of bodies one takes up to a second."""


@check(living="living", share=0.32)
def same_contacts_as_bodies_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts while bodies come and go."""
    agree(subject, scene, reference, contacts=LIVING_CONTACTS)


@check(living="living", share=0.12)
def its_structure_is_true_as_bodies_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """What must hold between events holds while bodies come and go."""
    _audit(subject, scene)


@check(living="living", share=0.08)
def same_contacts_when_commanded_by_hand(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The same when the commands are given by hand, between two runs, and the simulation is looked at, drawn,
    and put back to where it was."""
    looks = (
        _refuse,
        Simulation.near,
        Simulation.candidate_pairs,
        lambda sim: sim.restore(sim.snapshot()),
        lambda sim: sim.next_event,
    )

    def ran(tested: Subject) -> RunOutcome:
        def look(sim: Simulation, count: int) -> Simulation:
            if tested is subject:
                looks[count % len(looks)](sim)
                if count % (1 + len(scene.commands) // DRAWN) == 0:
                    sim.drawing()
            return sim

        return _by_hand(tested, scene, look)

    agree_when_commanded(subject, ran)


def _refuse(sim: Simulation) -> None:
    """Give commands that are refused; raise Disagreement unless the simulation is as before."""
    sim.build()
    before, there = sim.snapshot(), sim.bodies
    wrong: list[Callable[[], object]] = [
        lambda: sim.remove(-1),
        lambda: sim.set_velocity(1 << 30, (0.0, 0.0)),
    ]
    if len(there):
        place, radius = sim.positions()[0], float(sim.radii()[0])
        wrong += [
            lambda: sim.insert(place, (0.0, 0.0), radius),
            lambda: sim.set_velocity(int(there[0]), (math.nan, 0.0)),
        ]
    for command in wrong:
        try:
            command()
        except (KinetileError, IndexError, ValueError):
            continue
        raise Disagreement(f"at time {sim.time!r} a command that cannot be carried out is not refused")
    if sim.snapshot() != before:
        raise Disagreement(f"at time {sim.time!r} a command that is refused changes the simulation")


@check(living="living", share=0.06)
def resumes_as_bodies_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Saved to a file on the way and resumed from it, it goes on as without that."""
    after = {len(scene.commands) // 3, len(scene.commands) // 2, len(scene.commands) - 1}

    def ran(tested: Subject) -> RunOutcome:
        def saved(sim: Simulation, count: int) -> Simulation:
            if tested is not subject or count not in after:
                return sim
            with tempfile.TemporaryDirectory() as folder:
                sim.save(Path(folder) / "saved")
                return kt.resume(Path(folder) / "saved")

        return _by_hand(tested, scene, saved)

    agree_when_commanded(subject, ran)


def _by_hand(tested: Subject, scene: Scene, between: Callable[[Simulation, int], Simulation]) -> RunOutcome:
    """Run a scene whose commands are given by hand; ``between`` is called after each command, and returns the
    simulation that goes on. What is refused, as there is no room by now, is left out."""
    sim = tested.simulation(with_commands(scene, []), room=None)
    numbers = {body: body for body in range(len(scene))}
    ended = "ran"
    try:
        for count, command in enumerate(scene.commands):
            if command.time > sim.time:
                sim.run(until=command.time, max_contacts=CONTACTS)
            had = len(sim.contacts)
            if isinstance(command, Insert):
                _, place, flies, radius, mass, *_, shape = command
                try:
                    numbers[command.body] = sim.insert(place, flies, radius, mass, command.kind, shape)
                except (KinetileError, ValueError):
                    continue
            elif command.body not in numbers:
                continue
            elif isinstance(command, Remove):
                sim.remove(numbers[command.body])
            else:
                sim.set_velocity(numbers[command.body], command.velocity)
            if len(sim.contacts) != had and scene.kinds == (0,):  # with kinds, a passing may begin or end
                raise Disagreement(f"at time {sim.time!r} a command runs {len(sim.contacts) - had} contacts")
            sim = between(sim, count)
        sim.run(until=max(horizon(scene), sim.time), max_contacts=CONTACTS)
    except KinetileError as error:
        ended = f"{type(error).__name__}: {error}"
    return RunOutcome.of(sim, ended)


def _audit(subject: Subject, scene: Scene) -> None:
    """Raise Disagreement for the first thing that does not hold after one of some commands."""
    every = 1 + len(scene.commands) * max(1, len(scene) ** 2 // 8192) // AUDITS

    def audited(sim: Simulation, count: int) -> Simulation:
        if count % every == 0:
            try:
                sim.audit()
            except AuditError as error:
                raise Disagreement(str(error)) from error
        return sim

    _by_hand(subject, scene, audited)


@check(living="shapes", share=0.04, judges="broad")
def same_contacts_as_shapes_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts while bodies of several shapes come and go; what must hold between events
    does."""
    agree(subject, scene, reference, contacts=LIVING_CONTACTS)
    _audit(subject, scene)


@check(living="solid", share=0.08)
def same_contacts_with_responses(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts where bodies stop, lose energy, or cannot be moved."""
    try:
        subject.composition(scene)
    except Refused:
        scene = only_solid(scene)
    agree(subject, scene, reference, contacts=LIVING_CONTACTS)


@check(living="passing", share=0.08)
def same_contacts_while_some_pass(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts where bodies pass through others; a phase that cannot do that says so."""
    agree(subject, scene, reference, contacts=LIVING_CONTACTS)


@check(living="passing", share=0.08)
def its_structure_is_true_while_some_pass(subject: Subject, scene: Scene, reference: Reference) -> None:
    """What must hold between events holds while bodies pass through others."""
    _audit(subject, scene)
