"""Checks between events: a run is stopped after each event, and what must hold there is tested.

They often find a fault long before a contact is missed, and name it.
"""

from __future__ import annotations

from collections.abc import Iterator

from kinetile.errors import AuditError, KinetileError, StalledError
from kinetile.kernel.clock import TICKS
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.toolbox import box_gaps, reaches_of
from kinetile_conformance.cases import CONTACTS, Subject, horizon
from kinetile_conformance.checks.check import Disagreement, Reference, check

WINDOWS = 5
EVENTS = 20_000
"""A phase makes progress if so many events take it further than a millionth of the way; 5 windows are
tested."""


def stepped(subject: Subject, scene: Scene, most: int) -> Iterator[Simulation]:
    """Yield a simulation when it is built and after each of its first events."""
    sim = subject.simulation(scene)
    sim.build()
    yield sim
    events = sim.steps(horizon(scene))
    for _ in range(most):
        try:
            if next(events, None) is None or len(sim.contacts) >= CONTACTS:
                return
        except KinetileError:
            return  # whether a run may end so, the other checks compare
        yield sim


def audit_between_events(subject: Subject, scene: Scene) -> None:
    """Raise Disagreement for the first thing that does not hold after one of the first events."""
    for sim in stepped(subject, scene, 150):
        try:
            sim.audit()
        except AuditError as error:
            raise Disagreement(str(error)) from error


def ticks(sim: Simulation) -> int:
    """Return the present moment in ticks since the scene's start."""
    epoch, tick = sim.exact_time
    return epoch * TICKS + tick


DRAWN = 6
"""Events from one drawing of the structure to the next."""

AUDITED = 8
"""Contacts from one audit to the next; other checks test what lies between two audits."""


@check(turns=True, share=0.5)
def never_misses_a_pair(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Every two bodies that touch are a candidate pair, at contacts and between."""
    sim = subject.simulation(scene, audit=AUDITED)
    step = (horizon(scene) - scene.start) / 16
    try:
        for sixteenth in range(1, 17):  # each run ends with an audit
            sim.run(until=max(scene.start + sixteenth * step, sim.time), max_contacts=CONTACTS)
    except AuditError as error:
        raise Disagreement(str(error)) from error
    except KinetileError:
        return  # whether a run may end so, the other checks compare


@check(turns=True, share=0.25)
def its_structure_is_true(subject: Subject, scene: Scene, reference: Reference) -> None:
    """What must hold between events holds after each of them: queue, pairs, and the phase's own audit."""
    audit_between_events(subject, scene)


@check()
def makes_progress(subject: Subject, scene: Scene, reference: Reference) -> None:
    """It gets on: no endless events at one moment, and not without number."""
    sim = subject.simulation(scene)
    end = horizon(scene)
    least = int((end - scene.start) / scene.time_unit * TICKS) >> 20
    try:
        for _ in range(WINDOWS):
            begun = ticks(sim)
            sim.run(until=end, max_contacts=CONTACTS - len(sim.contacts), max_events=EVENTS)
            if sim.time >= end or len(sim.contacts) >= CONTACTS:
                return
            if ticks(sim) - begun <= least:
                raise Disagreement(
                    f"at time {sim.time!r}, with {len(sim.contacts)} contacts, it does not get on: "
                    f"{EVENTS} events took it next to nowhere"
                )
    except StalledError as error:
        raise Disagreement(str(error)) from error
    except KinetileError:
        return  # whether a run may end so, the other checks compare


@check(turns=True, share=0.3, compares=False)
def can_be_drawn(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Its structure can be drawn between any two events: draw raises nothing, writes nothing and is the same
    when it is called again."""
    for count, sim in enumerate(stepped(subject, scene, 60)):
        if count % DRAWN == 0 and repr(sim.drawing()) != repr(sim.drawing()):
            raise Disagreement(f"at time {sim.time!r} it is drawn otherwise when it is drawn once more")


@check(feature="boxes")
def pairs_are_overlapping_boxes(subject: Subject, scene: Scene, reference: Reference) -> None:
    """Its candidate pairs are those whose bounding boxes overlap."""
    for sim in stepped(subject, scene, 60):
        coming = sim.next_event
        if coming is not None and (coming.epoch, coming.tick) <= sim.exact_time:
            continue
        k = sim.tables
        place, sides = sim.positions(), reaches_of(k)
        gap = box_gaps((place[:, None] - place[None]).transpose(2, 0, 1), sides, sides)
        skin = 2.0 * float(k.clock[0].limits.skin)
        held = {tuple(pair) for pair in sim.candidate_pairs().tolist()}
        for a in range(len(scene)):
            for b in range(a + 1, len(scene)):
                if gap[a, b] < -skin and (a, b) not in held:
                    raise Disagreement(
                        f"at time {sim.time!r} the boxes of {a} and {b} overlap, and they are no pair"
                    )
                if gap[a, b] > skin and (a, b) in held:
                    raise Disagreement(
                        f"at time {sim.time!r} {a} and {b} are a pair, and their boxes are apart"
                    )
