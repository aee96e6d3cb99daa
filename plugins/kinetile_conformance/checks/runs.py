"""Observations of a run: its contacts and its end must equal the reference's, whatever was done at its stops;
and invariants at the stops, which often break long before a contact is missed, and name the fault."""

import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count, groupby, product
from pathlib import Path
from typing import Any

import numpy as np

import kinetile as kt
from kinetile import Accelerate, Insert, Move, Remove, Scene, SetKind, Simulation, Turn
from kinetile.arrays import Integers
from kinetile.errors import AuditError, KinetileError, NoRoom, TooThick
from kinetile.instruments import Command, as_python, first_difference, relabelled, with_commands
from kinetile.toolbox import NEVER, At, Box, Link, box_gaps, reaches_of
from kinetile_conformance.cases import RunOutcome, Subject, difference, horizon, is_living, outcome
from kinetile_conformance.checks.check import Case, Disagreement, DoesNotApply, compare, observation
from kinetile_conformance.deadline import spent
from kinetile_conformance.strategies.bulk import of_few
from kinetile_conformance.strategies.changes import only_bodies

Look = Callable[[Simulation], Simulation | None]
"""Called at a stop; returns the simulation that continues, None for the same one."""

STOPS = 16
"""Stops of a run of few bodies. Work of O(n^2) at each is done less often with many (``stops_for``)."""

EVERY = 4
"""Expensive checks are made at every moment of this number."""

STEPS = 30
"""Events of few bodies with a stop after each: twice as many find no more planted faults."""

FEW = 8
BY_HAND = 21
"""The most commands by hand that are followed by an action."""


def stops_for(case: Case, most: int) -> int:
    """Returns the number of stops of a run, which decreases with the number of bodies."""
    return int(np.clip(most * 8192 // max(len(case.scene), 1) ** 2, 2, most))


def moments(case: Case, most: int) -> list[float]:
    """Returns the times of a run's stops: between contacts, at contacts and at commands of the reference."""
    scene, expected = case.scene, case.expected
    parts = np.arange(1, most + 1) / (most + 1)
    met, between = expected.contacts["time"], scene.start + parts * (expected.time - scene.start)
    at_contacts = met[(parts * len(met)).astype(np.int64)] if len(met) else met
    found = np.concatenate([between, at_contacts, [command.time for command in scene.commands]])
    found = np.unique(found[(found >= scene.start) & (found <= expected.time)])
    chosen = np.unique(np.linspace(0, max(len(found) - 1, 0), most).astype(np.int64))[: len(found)]
    times: list[float] = found[chosen].tolist()
    return times


def watch(case: Case, look: Look, most: int = STOPS, steps: int = STEPS, every: int = 1) -> None:
    """Runs a case; calls ``look`` after the build, after each of its first events, and at moments of its run,
    or at every ``every``-th of these; raises Disagreement unless its outcome is the reference's."""
    sim, number = case.subject.simulation(case.scene), count()

    def see() -> Simulation:
        return (look(sim) or sim) if next(number) % every == 0 else sim

    ended = "ran"
    try:
        sim.build()
        sim = see()
        events = sim.steps(horizon(case.scene))
        for _ in range(steps if len(case.scene) <= FEW else 0):
            if len(sim.contacts) >= case.contacts or next(events, None) is None:
                break
            sim = see()
        for moment in moments(case, most):
            if _run(case, sim, moment):
                sim = see()
        _run(case, sim, horizon(case.scene))
    except KinetileError as error:
        ended = f"{type(error).__name__}: {error}"
    compare(case, _left(sim, ended))


def _left(sim: Simulation, ended: str) -> RunOutcome:
    """Returns the outcome without the numbers of the plans: a body that is put back has a new plan."""
    found = RunOutcome.of(sim, ended)
    return replace(found, tables={name: found.tables[name] for name in found.tables if name != "stamps"})


def _run(case: Case, sim: Simulation, until: float) -> bool:
    """Runs until a time, unless a case has all its contacts; returns True if it did not have them."""
    left = case.contacts - len(sim.contacts)
    if left > 0:
        sim.run(until=max(until, sim.time), max_contacts=left)
    return left > 0


@observation()
def same_contacts(case: Case) -> None:
    """It gives the reference's contacts, end and final state, bit for bit"""
    _ = case.expected  # first, lest the subject change the scene for both
    compare(case, outcome(case.subject, case.scene, case.contacts))


@observation()
def its_structure_is_true(case: Case) -> None:
    """What must hold between events does: by the kernel's audit, its own, and what it draws. Stopped and
    looked at, built anew, put back, resumed or commanded by hand, it goes on as if nothing had been done"""
    stages = STAGES if case.number is None else STAGES[case.number % len(STAGES) :][:1]
    for stage in dict.fromkeys(stages):
        stage(case)


def _is_true(case: Case) -> None:
    """Audits a run and draws it; both must change nothing, and repeat with the same result."""
    number = count()

    def look(sim: Simulation) -> None:
        _audit(sim)
        if next(number) % EVERY == 0:
            _check_drawing(sim)

    watch(case, look, stops_for(case, STOPS))


def _audit(sim: Simulation) -> None:
    try:
        sim.audit()
    except AuditError as error:
        raise Disagreement(str(error)) from error


MOST_DRAWN = 512
"""Bodies above which a scene is not drawn: a phase that names all pairs draws a line for each."""


def _check_drawing(sim: Simulation) -> None:
    if len(sim.bodies) > MOST_DRAWN:
        return
    items = sim.drawing()
    if items != sim.drawing():
        raise Disagreement(f"at time {sim.time!r} it is drawn otherwise when it is drawn once more")
    links = {(min(i.a, i.b), max(i.a, i.b)) for i in items if isinstance(i, Link) and i.role == "pair"}
    fixed = {*sim.bodies[np.isinf(sim.masses())].tolist()}  # no two of these have a line between them
    held = {pair for pair in map(tuple, sim.candidate_pairs().tolist()) if not fixed.issuperset(pair)}
    for a, b in sorted(links ^ held)[: len(links)][:1]:
        drawn = "is a link, and they are no" if (a, b) in links else "is no link, and they are a"
        raise Disagreement(f"at time {sim.time!r} between {a} and {b} there {drawn} candidate pair")
    boxes = [(*each.low, *each.high) for each in items if isinstance(each, Box) and each.role == "bound"]
    moves = any(isinstance(side, At) for box in boxes for side in box)
    if sim.scene.periodic or len(boxes) != len(sim.bodies) or moves:
        return
    sides, place = np.array(boxes, float).reshape(-1, 1, 4), sim.positions()
    within = ((sides[..., :2] <= place) & (place <= sides[..., 2:])).all(axis=2).any(axis=0)
    for body in sim.bodies[~within][:1]:
        raise Disagreement(f"at time {sim.time!r} none of its boxes holds the centre of body {body}")


def look_at(sim: Simulation) -> None:
    """Reads all public values between two runs."""
    _ = sim.next_event, sim.readings
    if len(sim.bodies) <= MOST_DRAWN:
        sim.candidate_pairs(), sim.near(), sim.drawing()


def put_back(sim: Simulation) -> None:
    """Restores a simulation to its present state, with its structure built again."""
    there = sim.snapshot()
    sim.restore(replace(there, whole=there.state))
    _audit(sim)


def rebuild(sim: Simulation) -> None:
    """Builds the structure again."""
    sim.rebuild()
    _audit(sim)


def resume(sim: Simulation) -> Simulation:
    """Saves a simulation; returns the one that continues from the file, audited and drawn."""
    with tempfile.TemporaryDirectory() as folder:
        sim.save(Path(folder) / "saved")
        sim = kt.resume(Path(folder) / "saved")
    _audit(sim)
    look_at(sim)
    return sim


WAYS: dict[str, Look] = {
    "stopped and looked at": look_at,
    "resumed from a file": resume,
    "built anew": rebuild,
    "put back": put_back,
}
"""Actions at the stops of a run, in turn; so a resumed simulation is also built again."""


def _goes_on(case: Case) -> None:
    """Takes one of these actions at each stop of a run, in turn."""
    way, ways = "", list(WAYS.items()) * 2
    stops = count()

    def look(sim: Simulation) -> Simulation | None:
        nonlocal way
        had = sim.contacts
        if first_difference(had, case.expected.contacts[: len(had)]) is not None:
            compare(case, RunOutcome.of(sim))
        way, act = ways[next(stops) % len(ways)]
        return act(sim)

    try:
        most = min(len(ways) - 1, stops_for(case, 4 * STOPS))
        watch(case, look, most, steps=0)
    except Disagreement as error:
        text = str(error)
        raise Disagreement(text if text.startswith(way) else f"{way}, {text}", error.scene) from error


def _is_commanded(case: Case) -> None:
    """Gives commands between two runs, simultaneous insertions by one call, and takes an action after some.
    Without insertions or removals it audits: the skin includes scheduled turns, so it would differ."""
    if not is_living(case.scene):
        return _is_true(case)
    scene, looks = case.scene, (*WAYS.values(), _audit)
    # Insertions with a time and an acceleration in common are given by one call.
    together = groupby(scene.commands, lambda c: (c.time, c.acceleration) if isinstance(c, Insert) else id(c))
    batches = [list(each) for _, each in together]
    every = 1 + len(batches) // BY_HAND
    sim = case.subject.simulation(with_commands(scene, [], kinds=scene.kinds), room=None)
    numbers = {body: body for body in range(len(scene))}
    ended = "ran"
    try:
        for at, batch in enumerate(batches):
            if batch[0].time > sim.time:
                _run(case, sim, batch[0].time)
                if len(sim.contacts) < case.contacts:
                    next(sim.steps(), None)  # it may be an error of the phase's structure
            if len(sim.contacts) >= case.contacts:
                break
            _give(sim, batch, numbers)
            if at % every == 0:
                sim = looks[at // every % len(looks)](sim) or sim
        _run(case, sim, horizon(scene))
    except KinetileError as error:
        ended = f"{type(error).__name__}: {error}"
    until = replace(scene.settings, until=max(horizon(scene), sim.time))
    expected = case.reference(relabelled(sim.recorded(), settings=until), case.contacts)
    text = difference(_left(sim, ended), expected, case.subject.name)
    if text is not None:
        raise Disagreement(text)


def _give(sim: Simulation, batch: list[Command], numbers: dict[int, int]) -> None:
    """Gives a command, or insertions at once, to bodies that have other ``numbers``, unless it is refused."""
    command = batch[0]
    if isinstance(command, Insert):
        coming = [each for each in batch if isinstance(each, Insert)]
        given: dict[str, Any] = {
            name: [getattr(each, name) for each in coming]
            for name in ("position", "velocity", "radius", "mass", "kind", "shape")
        }
        shapes = given["shape"] if sim.scene.shapes else None
        kinds = None if None in given["kind"] else given["kind"]
        given |= {"shape": shapes, "kind": kinds, "acceleration": command.acceleration}
        try:
            new = sim.insert_many(given.pop("position"), given.pop("velocity"), **given).numbers.tolist()
            numbers.update((each.body, n) for each, n in zip(coming, new, strict=True) if n >= 0)
        except TooThick:
            raise
        except (KinetileError, ValueError):
            pass
    elif command.body not in numbers:
        pass
    elif isinstance(command, Remove):
        sim.remove(numbers[command.body])
    elif isinstance(command, SetKind):
        with suppress(NoRoom):
            sim.set_kind(numbers[command.body], command.kind)
    elif isinstance(command, Move):
        with suppress(NoRoom):
            sim.set_position(numbers[command.body], command.position)
    elif isinstance(command, Accelerate):
        sim.set_acceleration(numbers[command.body], command.acceleration)
    else:
        assert isinstance(command, Turn)
        sim.set_velocity(numbers[command.body], command.velocity)


STAGES = _is_commanded, _is_true, _goes_on, _is_true
"""Stages for the scenes of a check, in turn."""


TRIES = 5
"""The most changes of velocities by a rounding until a tie is exact."""


@observation()
def same_contacts_at_ties_of_its_own(case: Case) -> None:
    """It gives the reference's contacts where a body's first certificate fails at one tick for its motion
    along both axes, as at a corner of its cell"""
    tied = replace(case, scene=_tied(case.subject, case.scene))
    watch(tied, _audit, stops_for(tied, STOPS))


def _tied(subject: Subject, scene: Scene) -> Scene:
    """Returns a scene with velocities so that many bodies have such ties: by trial, bodies fly along one axis
    alone, then along the other, and the motion that fails first is slowed."""
    velocity = np.where(scene.velocity == 0.0, 0.5 * np.abs(scene.velocity).max(initial=0.0), scene.velocity)
    moved = np.arange(len(scene)) != np.argmax(np.hypot(*velocity.T))  # the clock depends on the fastest

    def due(axis: int) -> Integers:
        alone = np.where((np.arange(2) == axis) | ~moved[:, None], velocity, 0.0)
        sim = subject.simulation(scene.replace(velocity=alone))
        sim.build()
        own = sim.tables.queue.certificate[: len(scene)]
        return np.where(own < NEVER, own - sim.tables.clock[0].now, 0)

    ticks = np.column_stack([due(0), due(1)])
    goal, first = ticks.max(axis=1), ticks.argmin(axis=1)
    moved_first = moved & (ticks.min(axis=1) > 0)
    for turn, axis in product(range(TRIES), range(2)):
        own, speed = due(axis), velocity[:, axis]
        slower = speed * own / np.maximum(goal, 1)
        nearly = np.nextafter(speed, np.where(own < goal, 0.0, 2.0 * speed))
        off = moved_first & (first == axis) & (own != goal)
        velocity[:, axis] = np.where(off, nearly if turn else slower, speed)
    return scene.replace(velocity=velocity)


MANY = (2_000, 8_000, 33_000)
"""Bodies: few, so that code is loaded; some, which are timed; and more than numbers of 16 bits count."""

PATIENCE = 15.0
"""CPU seconds allowed for the last, if the time grows from the others with the square of the number."""


@observation(judges="broad")
def same_contacts_among_tens_of_thousands(case: Case) -> None:
    """Among 33,000 bodies, all but a few at rest, these meet as they do alone"""
    if as_python():
        raise DoesNotApply("with interpreted hooks so many bodies would take minutes")
    for bodies in MANY:
        scene, chosen = of_few(bodies)
        few = outcome(case.subject.reference, only_bodies(scene, chosen), MANY[-1])
        began, expected = spent(), few.contacts.copy()
        found = outcome(case.subject, scene, MANY[-1])
        for name in ("a", "b"):  # few bodies have the first numbers; walls stay
            expected[name] = np.where(expected[name] < 0, expected[name], chosen[expected[name]])
        whole = replace(few, contacts=expected, tables={}, positions=found.positions)
        text = difference(replace(found, tables={}), replace(whole, velocities=found.velocities), "it")
        if text is not None:
            raise Disagreement(f"among {bodies:,} bodies {text}")
        if bodies == MANY[1] and (spent() - began) * (MANY[2] / MANY[1]) ** 2 > PATIENCE:
            raise DoesNotApply(f"for phases that run {MANY[2]:,} bodies within {PATIENCE:g} CPU s")


@observation(feature="boxes")
def pairs_are_overlapping_boxes(case: Case) -> None:
    """Its candidate pairs are those whose bounding boxes overlap"""

    def look(sim: Simulation) -> None:
        k = sim.tables
        if (k.queue.certificate <= k.clock[0].now).any():
            return  # a certificate fails at this moment: invariants hold again after its repair
        place, sides = sim.positions(), reaches_of(k)[k.slots[sim.bodies]]
        between = (place[:, None] - place[None]).transpose(2, 0, 1)
        gap, skin = box_gaps(between, sides, sides), 2.0 * float(k.clock[0].limits.skin)
        held = np.zeros(gap.shape, dtype=np.bool_)
        held[tuple(sim.candidate_pairs().T)] = True
        for text, wrong in (
            ("overlap, and they are no pair", (gap < -skin) & ~held),
            ("are apart, and they are a pair", (gap > skin) & held),
        ):
            for a, b in np.argwhere(np.triu(wrong, 1))[:1].tolist():
                raise Disagreement(f"at time {sim.time!r} the boxes of {a} and {b} {text}")

    watch(case, look, 4)
