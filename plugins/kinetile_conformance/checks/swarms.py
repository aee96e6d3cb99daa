"""Large and long: swarms, marathons and lattices by the hundred, compared with the reference to the last bit.

Their scenes are in ``strategies``: six bodies and 150 contacts fill no list, no table and no counter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinetile.errors import KinetileError
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject, horizon
from kinetile_conformance.checks.check import Disagreement, Reference, agree, check
from kinetile_conformance.checks.claims import amiss_with_near

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

__all__ = [
    "same_contacts_beside_giants",
    "same_contacts_in_a_marathon",
    "same_contacts_in_a_swarm",
    "same_contacts_on_lattices",
]

LOOKS = 4
"""How often it is looked at who is near whom, over the course of a swarm."""


def _swarms() -> SearchStrategy[Scene]:
    from kinetile_conformance.strategies.swarms import swarm_scenes

    return swarm_scenes()


def _giants() -> SearchStrategy[Scene]:
    from kinetile_conformance.strategies.swarms import giant_scenes

    return giant_scenes()


def _marathons() -> SearchStrategy[Scene]:
    from kinetile_conformance.strategies.marathons import marathon_scenes

    return marathon_scenes()


def _lattices() -> SearchStrategy[Scene]:
    from kinetile_conformance.strategies.lattices import lattice_scenes

    return lattice_scenes()


@check(scenes=_swarms, share=0.5, since="3.0")
def same_contacts_in_a_swarm(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts among hundreds of bodies as well, and whoever touch are near each other."""
    from kinetile_conformance.strategies.swarms import CONTACTS

    agree(subject, scene, reference, contacts=CONTACTS)
    sim = subject.simulation(scene)
    step = (horizon(scene) - scene.start) / LOOKS
    for look in range(1, LOOKS + 1):
        try:
            sim.run(until=max(scene.start + look * step, sim.time), max_contacts=CONTACTS // LOOKS)
        except KinetileError:
            return  # so did the reference's, or it would not have agreed
        said = amiss_with_near(sim)
        if said is not None:
            raise Disagreement(f"at time {sim.time!r} {said}")


@check(scenes=_giants, share=0.3, since="3.3")
def same_contacts_beside_giants(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts where few large bodies fly through many small ones that hardly move."""
    from kinetile_conformance.strategies.swarms import CONTACTS

    agree(subject, scene, reference, contacts=CONTACTS)


@check(scenes=_marathons, share=0.03, since="3.0")
def same_contacts_in_a_marathon(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts for a hundred thousand of them, while the base of the clock moves often."""
    from kinetile_conformance.strategies.marathons import CONTACTS

    agree(subject, scene, reference, contacts=CONTACTS)


@check(scenes=_lattices, share=1.0, since="3.0")
def same_contacts_on_lattices(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts on a hundred small lattices at once, where exact ties abound."""
    from kinetile_conformance.strategies.lattices import CONTACTS

    agree(subject, scene, reference, contacts=CONTACTS)
