"""Checks of contacts: a run's contacts, its end and the final state, compared with those of another run.

The other is the reference's run, or one of the phase's own that should have the same result. The last
checks are large and long, since six bodies and 150 contacts fill no list, no table and no counter.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from kinetile.errors import BadOption, KinetileError, Refused
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile_conformance.cases import (
    CONTACTS,
    LATTICE_CONTACTS,
    MARATHON_CONTACTS,
    SCALED_CONTACTS,
    SWARM_CONTACTS,
    RunOutcome,
    Subject,
    difference,
    horizon,
    outcome,
)
from kinetile_conformance.checks.check import (
    Check,
    Disagreement,
    Reference,
    agree,
    check,
    near_fault,
)
from kinetile_conformance.strategies.bulk import lattice_scenes, marathon_scenes
from kinetile_conformance.strategies.changes import changed
from kinetile_conformance.strategies.gallery import gallery
from kinetile_conformance.strategies.shapes import shape_scenes, shape_torus_scenes
from kinetile_conformance.strategies.small import Strategy, torus_scenes
from kinetile_conformance.strategies.swarms import (
    burst_scenes,
    corridor_scenes,
    giant_scenes,
    scaled_scenes,
    swarm_scenes,
)


@check()
def same_contacts(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It gives the reference's contacts, end and final state, bit for bit."""
    agree(subject, scene, reference)


@check(turns=True)
def same_contacts_with_turns(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The same while bodies turn at scheduled times."""
    agree(subject, scene, reference)


TURNS = 8
"""How often each of two simulations takes its turn."""


@check(scenes=swarm_scenes, share=0.12)
def instances_are_independent(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Two simulations under it that run by turns do not disturb each other."""
    # As many bodies, flying the other way: state shared between the two would show.
    both = [scene, changed(scene, velocity=-scene.velocity)]
    alone = [outcome(subject, each) for each in both]
    side_by_side = [subject.simulation(each) for each in both]
    ended = ["ran", "ran"]
    for _ in range(TURNS):
        for which, sim in enumerate(side_by_side):
            left = min(CONTACTS - len(sim.contacts), 1 + CONTACTS // TURNS)
            if ended[which] == "ran" and left:
                try:
                    sim.run(until=max(horizon(scene), sim.time), max_contacts=left)
                except KinetileError as error:
                    ended[which] = f"{type(error).__name__}: {error}"
    for sim, end, expected in zip(side_by_side, ended, alone, strict=True):
        if end.partition(":")[0] != expected.ended.partition(":")[0]:
            raise Disagreement(f"side by side with another it ended with {end}; alone {expected.ended}")
        if sim.contacts.tobytes() != expected.contacts.tobytes():
            raise Disagreement("side by side with another it does not give the contacts that it gives alone")


@check(turns=True, share=0.5)
def stops_and_goes_on(subject: Subject, scene: Scene, reference: Reference) -> None:
    """A run that is stopped and goes on is the run that was not stopped."""
    whole = outcome(subject, scene)
    if whole.ended != "ran" or len(whole.contacts) >= CONTACTS:
        return
    sim = subject.simulation(scene)
    for part in (0.25, 0.25, 0.5, 1.0):
        sim.run(until=scene.start + part * (horizon(scene) - scene.start))
        sim.candidate_pairs()
    said = difference(RunOutcome.of(sim), whole, subject.name)
    if said is not None:
        raise Disagreement(f"stopped and gone on with, {said}")


@check(turns=True)
def survives_being_built_anew(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Rebuilt in the middle of a run it goes on as before."""
    expected = reference(scene)
    if expected.ended != "ran" or len(expected.contacts) >= CONTACTS:
        return
    sim = subject.simulation(scene)
    for part in (0.3, 0.6, 1.0):
        sim.run(until=scene.start + part * (horizon(scene) - scene.start))
        if part < 1.0:
            sim.rebuild()
    said = difference(RunOutcome.of(sim), expected, subject.name)
    if said is not None:
        raise Disagreement(f"rebuilt on the way, {said}")


@check(draws=False, replayed_by="same-contacts")
def survives_the_smallest_scenes(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It runs where there is nothing, one body, or nothing that moves."""
    nobody = np.zeros((0, 2))
    for small in (
        Scene(nobody, nobody, np.zeros(0), arena=(1.0, 1.0)),
        Scene([[0.5, 0.5]], [[0.0, 0.0]], 0.25, arena=(1.0, 1.0)),
        Scene([[0.5, 0.5]], [[1.0, 0.5]], 0.25, arena=(1.0, 1.0)),
        Scene([[0.25, 0.5], [0.75, 0.5]], np.zeros((2, 2)), 0.25, arena=(1.0, 1.0)),
        Scene([[0.5, 0.5], [1.5, 0.5]], [[1.0, 0.0], [1.0, 0.0]], 0.5, arena=(8.0, 1.0)),
    ):
        agree(subject, small, reference, f"with {len(small)} bodies, ")


@check(draws=False, replayed_by="same-contacts")
def same_contacts_in_the_gallery(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The fixed gallery: gases, worst cases, billiards, lattices full of ties, a row between two bodies."""
    seen = 0
    refusal = None
    for title, picture in gallery():
        try:
            agree(subject, picture, reference, f"{title}: ")
            seen += 1
        except Refused as error:
            refusal = error
        except KinetileError as error:
            raise Disagreement(f"{title}: {type(error).__name__}: {error}", picture) from error
    if refusal is not None and not seen:
        raise refusal


@check(draws=False, judges="broad")
def rejects_unknown_options(subject: Subject, scene: Scene, reference: Reference) -> None:
    """An option that it does not have is refused by name."""
    try:
        Simulation(scene, subject.name, options={**subject.options, "no_such_option": 1})
    except BadOption:
        return
    raise Disagreement("it takes an option called 'no_such_option' without a word")


LOOKS = 4
"""Tests of `near` over the course of a swarm."""


@check(scenes=swarm_scenes, share=0.5)
def same_contacts_in_a_swarm(subject: Subject, scene: Scene, reference: Reference) -> None:
    """The reference's contacts among hundreds of bodies, and those that touch are near each other."""
    agree(subject, scene, reference, contacts=SWARM_CONTACTS)
    sim = subject.simulation(scene)
    step = (horizon(scene) - scene.start) / LOOKS
    for look in range(1, LOOKS + 1):
        try:
            sim.run(until=max(scene.start + look * step, sim.time), max_contacts=SWARM_CONTACTS // LOOKS)
        except KinetileError:
            return  # so did the reference's, or it would not have agreed
        said = near_fault(sim)
        if said is not None:
            raise Disagreement(f"at time {sim.time!r} {said}")


def _compared(name: str, sentence: str, scenes: Strategy, contacts: int, share: float, **more: Any) -> Check:
    """Return the check that compares contacts, up to a limit, on the scenes of a strategy."""
    return Check(name, sentence, partial(agree, contacts=contacts), scenes=scenes, share=share, **more)


IN_LARGE_SCENES = (
    _compared(
        "same-contacts-beside-giants",
        "The reference's contacts where few large bodies fly through many small ones that hardly move.",
        *(giant_scenes, SWARM_CONTACTS, 0.3),
    ),
    _compared(
        "same-contacts-on-lattices",
        "The reference's contacts on a hundred small lattices at once, where exact ties abound.",
        *(lattice_scenes, LATTICE_CONTACTS, 0.7),
    ),
    _compared(
        "same-contacts-in-a-scaled-swarm",
        "The reference's contacts of swarms at any scale of length and time, and far from the origin.",
        *(scaled_scenes, SCALED_CONTACTS, 1.0),
    ),
    _compared(
        "same-contacts-in-a-burst",
        "The reference's contacts where up to two hundred bodies cross one border at one tick.",
        *(burst_scenes, SWARM_CONTACTS, 0.3),
    ),
    _compared(
        "same-contacts-in-a-corridor",
        "The reference's contacts where all fly fast along a corridor, or almost along an axis.",
        *(corridor_scenes, SWARM_CONTACTS, 0.3),
    ),
    _compared(
        "same-contacts-on-a-torus",
        "The reference's contacts where axes are periodic; a phase that knows no images refuses them.",
        *(torus_scenes, CONTACTS, 0.5),
    ),
    _compared(
        "same-contacts-of-shapes",
        "The reference's contacts of boxes, capsules and polygons; a phase that is solid refuses them.",
        *(shape_scenes, CONTACTS, 0.5),
        judges="broad",
    ),
    _compared(
        "same-contacts-of-shapes-on-a-torus",
        "The same where axes are periodic.",
        *(shape_torus_scenes, CONTACTS, 0.5),
        judges="broad",
    ),
    _compared(
        "same-contacts-in-a-marathon",
        "The reference's contacts for a hundred thousand of them, while the base of the clock moves often.",
        *(marathon_scenes, MARATHON_CONTACTS, 0.03),
    ),
)
"""The same comparison on other strategies, most of them of large scenes."""
