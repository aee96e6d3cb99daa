"""Checks of scenes in which bodies come and go, and of scenes with kinds of bodies and responses.

A phase without ``enter`` and ``leave`` is built anew for each command, and has to be right as well.

A response is no business of a broad phase. But bodies that pass through each other lie on top of one another
in its structure, those that have stopped touch for good, and a body between two immovable ones becomes faster
than any body was.
"""

from __future__ import annotations

from kinetile.run.simulation import Simulation
from kinetile.scene import Insert, Remove, Scene, with_commands
from kinetile_conformance.cases import CONTACTS, RunOutcome, Subject, horizon
from kinetile_conformance.checks.between_events import audit_between_events
from kinetile_conformance.checks.check import Reference, agree, agree_when_commanded, check, drawn_from

LIVING = drawn_from("commands", "living_scenes")
PASSING = drawn_from("commands", "ruled_scenes")
SOLID = drawn_from("commands", "solid_scenes")


@check(scenes=LIVING, since="3.1")
def same_contacts_as_bodies_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts while bodies come and go."""
    agree(subject, scene, reference)


@check(scenes=LIVING, share=0.5, since="3.1")
def its_structure_is_true_as_bodies_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """What must hold between events holds while bodies come and go."""
    audit_between_events(subject, scene)


@check(scenes=LIVING, share=0.25, since="3.1")
def same_contacts_when_commanded_by_hand(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The same when the commands are given by hand, between two runs."""

    def ran(tested: Subject) -> RunOutcome:
        sim = tested.simulation(with_commands(scene, []), live=True)

        def run() -> None:
            _command(sim, scene)
            sim.run(until=max(horizon(scene), sim.time), max_contacts=CONTACTS)

        return RunOutcome.after(sim, run)

    agree_when_commanded(subject, ran)


def _command(sim: Simulation, scene: Scene) -> None:
    """Give a scene's commands between runs, each at its time."""
    given: dict[int, int] = {}
    for command in scene.commands:
        sim.run(until=max(command.time, sim.time), max_contacts=CONTACTS)
        body = given.get(command.body, command.body)
        if isinstance(command, Insert):
            place, flies = command.position, command.velocity
            given[command.body] = sim.insert(place, flies, command.radius, command.mass)
        elif isinstance(command, Remove):
            sim.remove(body)
        else:
            sim.set_velocity(body, command.velocity)


@check(scenes=SOLID, share=0.25, since="3.2")
def same_contacts_with_responses(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts where bodies stop, lose energy, or cannot be moved."""
    agree(subject, scene, reference)


@check(scenes=PASSING, share=0.25, since="3.2")
def same_contacts_while_some_pass(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts where bodies pass through others; a phase that cannot do that says so."""
    agree(subject, scene, reference)


@check(scenes=PASSING, share=0.1, since="3.2")
def its_structure_is_true_while_some_pass(subject: Subject, scene: Scene, reference: Reference) -> None:
    """What must hold between events holds while bodies pass through others."""
    audit_between_events(subject, scene)
