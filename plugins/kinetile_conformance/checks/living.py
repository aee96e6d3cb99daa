"""Checks of scenes in which bodies come and go.

A phase without ``enter`` and ``leave`` is built anew for each of them, and has to be right as well.
"""

from __future__ import annotations

from typing import Any

from kinetile.run.simulation import Simulation
from kinetile.scene import Insert, Remove, Scene, with_commands
from kinetile_conformance.cases import CONTACTS, Outcome, Subject, horizon
from kinetile_conformance.checks.between_events import audit_between_events
from kinetile_conformance.checks.check import Reference, agree, agree_by_hand, check

__all__ = [
    "its_structure_is_true_as_bodies_come_and_go",
    "same_contacts_as_bodies_come_and_go",
    "same_contacts_when_commanded_by_hand",
]


def living() -> Any:
    """Return the strategy; Hypothesis is imported when something is drawn."""
    from kinetile_conformance.strategies.living import living_scenes

    return living_scenes()


@check(scenes=living, since="3.1")
def same_contacts_as_bodies_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts while bodies come and go."""
    agree(subject, scene, reference)


@check(scenes=living, share=0.5, since="3.1")
def its_structure_is_true_as_bodies_come_and_go(subject: Subject, scene: Scene, reference: Reference) -> None:
    """What must hold between events holds while bodies come and go."""
    audit_between_events(subject, scene)


@check(scenes=living, share=0.25, since="3.1")
def same_contacts_when_commanded_by_hand(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The same when the commands are given by hand, between two runs."""

    def ran(on_trial: Subject) -> Outcome:
        sim = on_trial.simulation(_without_commands(scene), live=True)

        def by_hand() -> None:
            _command(sim, scene)
            sim.run(until=max(horizon(scene), sim.time), max_contacts=CONTACTS)

        return Outcome.after(sim, by_hand)

    agree_by_hand(subject, ran)


def _without_commands(scene: Scene) -> Scene:
    """Return a scene on the same clock without its commands."""
    return with_commands(scene, [])


def _command(sim: Simulation, scene: Scene) -> None:
    """Give a scene's commands by hand, each at its time."""
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
