"""The checks: what a broad phase must do, a sentence each, and how it is seen.

A check is given a subject and a scene, and raises ``Disagreement`` where the sentence does not hold. Nothing
is compared with a tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinetile.clock import SPAN
from kinetile.conformance.cases import CONTACTS, REFERENCE, Outcome, Subject, difference, horizon, outcome
from kinetile.errors import AuditError, BadOption, KinetileError, Refused
from kinetile.kernel import BUDGET_SPENT
from kinetile.scene import Scene, Turn
from kinetile.simulation import Simulation

__all__ = ["CHECKS", "Check", "Disagreement", "check_named"]

WINDOWS = 5
EVENTS = 20_000
"""A phase gets on if so many events take it further than a millionth of the way; it is looked at 5 times."""


class Disagreement(AssertionError):
    """A phase does not do what a check says; the message is what was seen."""


@dataclass(frozen=True)
class Check:
    """One thing that a broad phase must do.

    Attributes:
        name: how it is called on the command line.
        sentence: what it says.
        run: called with the subject, a scene, and the reference's outcome on that scene (made when asked
            for).
        draws: whether it is run on drawn scenes; if not, it is run once, on an empty scene.
        turns: whether the scenes that it draws have turns.
        feature: it applies only to phases that declare this feature; None: to all.
        since: the version of the kit that it came with.
    """

    name: str
    sentence: str
    run: Callable[[Subject, Scene, Callable[[Scene], Outcome]], None]
    draws: bool = True
    turns: bool = False
    feature: str | None = None
    since: str = "1.0"


CHECKS: list[Check] = []
Reference = Callable[[Scene], Outcome]
Run = Callable[[Subject, Scene, Reference], None]


def check(sentence: str, **how: Any) -> Callable[[Run], Run]:
    """Add a function to the checks, named after it."""

    def add(function: Run) -> Run:
        CHECKS.append(Check(function.__name__.replace("_", "-"), sentence, function, **how))
        return function

    return add


def check_named(name: str) -> Check:
    """Return the check of a name; raise ValueError, with the names there are."""
    for each in CHECKS:
        if each.name == name:
            return each
    raise ValueError(f"there is no check {name!r}; there are: {', '.join(c.name for c in CHECKS)}")


def agree(subject: Subject, scene: Scene, reference: Reference, how: str = "") -> None:
    """Raise unless the subject's outcome on a scene is the reference's, bit for bit."""
    expected = reference(scene)  # first, lest the subject change the scene for both
    said = difference(outcome(subject, scene), expected, subject.name)
    if said is not None:
        raise Disagreement(f"{how}{said}")


@check("It gives the reference's contacts, end and final state, bit for bit.")
def same_contacts(subject: Subject, scene: Scene, reference: Reference) -> None:
    agree(subject, scene, reference)


@check("The same while bodies turn at scheduled times.", turns=True)
def same_contacts_with_turns(subject: Subject, scene: Scene, reference: Reference) -> None:
    agree(subject, scene, reference)


@check("The same when bodies are turned by hand between runs.")
def same_contacts_when_turned_by_hand(subject: Subject, scene: Scene, reference: Reference) -> None:
    ends = []
    for on_trial in (Subject(REFERENCE, {}), subject):
        sim = on_trial.simulation(scene)
        ended = "ran"
        try:
            for step in range(1, 4):
                sim.run(until=scene.start + step * 0.5, max_contacts=CONTACTS)
                if len(scene):
                    sim.set_velocity(step % len(scene), (0.5 * step, -1.0))
            sim.run(until=scene.start + 4.0, max_contacts=CONTACTS)
        except KinetileError as error:
            ended = f"{type(error).__name__}: {error}"
        ends.append(Outcome.of(sim, ended))
    said = difference(ends[1], ends[0], subject.name)
    if said is not None:
        raise Disagreement(said)


@check("Every two bodies that touch are a candidate pair, at every contact and between.", turns=True)
def never_misses_a_pair(subject: Subject, scene: Scene, reference: Reference) -> None:
    sim = subject.simulation(scene, audit=1)
    step = (horizon(scene) - scene.start) / 16
    try:
        for sixteenth in range(1, 17):  # each run ends with an audit
            sim.run(until=max(scene.start + sixteenth * step, sim.time), max_contacts=CONTACTS)
    except AuditError as error:
        raise Disagreement(str(error)) from error
    except KinetileError:
        return  # whether a run may end so is what the other checks compare


def last_tick(sim: Simulation) -> int:
    """Return the tick at which a case ends, or that at which the clock's base would have to move on."""
    clock = sim._engine.clock
    return min(clock.relative(clock.ticks(horizon(sim.scene))), SPAN - 1)


def stepped(subject: Subject, scene: Scene, most: int) -> Iterator[Simulation]:
    """Yield a simulation after each of its events, within the first span of the clock."""
    sim = subject.simulation(scene)
    engine = sim._engine
    end = last_tick(sim)
    engine.build(subject.name)
    yield sim
    for _ in range(most):
        try:
            reason = engine.chunk(end, CONTACTS, subject.name, budget=1)
        except KinetileError:
            return
        if reason != BUDGET_SPENT:
            return
        yield sim


@check(
    "What must hold between events holds after each of them: queue, pairs, and the phase's own audit.",
    turns=True,
)
def its_structure_is_true(subject: Subject, scene: Scene, reference: Reference) -> None:
    for sim in stepped(subject, scene, 150):
        try:
            sim._engine.audit(subject.name)
        except AuditError as error:
            raise Disagreement(str(error)) from error


@check("Its own events move no body and turn none, and never go back in time.", turns=True)
def structural_events_move_nothing(subject: Subject, scene: Scene, reference: Reference) -> None:
    before: tuple[int, bytes, int] | None = None
    for sim in stepped(subject, scene, 300):
        k = sim._engine.k
        structural = int(k.counts[0].structural)
        bodies = b"".join(
            k.bodies[field].tobytes() for field in ("x", "y", "vx", "vy", "anchor", "radius", "reach")
        )
        now = int(k.clock[0].now)
        if before is not None:
            if structural > before[0] and bodies != before[1]:
                raise Disagreement(f"at time {sim.time!r} a failure of its certificates changed a body")
            if now < before[2]:
                raise Disagreement(f"at time {sim.time!r} time went back by {before[2] - now} ticks")
        before = structural, bodies, now


@check("It gets on: no endless events at one moment, and not without number.")
def makes_progress(subject: Subject, scene: Scene, reference: Reference) -> None:
    sim = subject.simulation(scene)
    engine = sim._engine
    end = last_tick(sim)
    least = (end - engine.now) >> 20
    try:
        for _ in range(WINDOWS):
            begun, events = engine.now, engine.events
            while engine.events - events < EVENTS:
                if engine.chunk(end, CONTACTS, subject.name, budget=EVENTS) != BUDGET_SPENT:
                    return
            if engine.now - begun <= least:
                raise Disagreement(
                    f"at time {sim.time!r}, with {engine.contacts} contacts, it does not get on: "
                    f"{EVENTS} events took it next to nowhere"
                )
    except KinetileError as error:
        if "does not get on" in str(error):
            raise Disagreement(str(error)) from error


@check("It repeats itself: the same contacts and the same number of events, twice.", turns=True)
def repeats_itself(subject: Subject, scene: Scene, reference: Reference) -> None:
    runs = []
    for _ in range(2):
        sim = subject.simulation(scene)
        try:
            sim.run(until=horizon(scene), max_contacts=CONTACTS)
        except KinetileError as error:
            runs.append((type(error).__name__, sim.fingerprint, sim.readings.events))
        else:
            runs.append(("ran", sim.fingerprint, sim.readings.events))
    if runs[0] != runs[1]:
        raise Disagreement(
            f"the first run {runs[0][0]}, {runs[0][2]} events; the second {runs[1][0]}, {runs[1][2]}"
        )


@check("Two simulations under it do not disturb each other.")
def instances_are_independent(subject: Subject, scene: Scene, reference: Reference) -> None:
    both = [scene, changed(scene, velocity=-scene.velocity)]  # as large, and nowhere in the same order
    alone = [outcome(subject, each) for each in both]
    side_by_side = [subject.simulation(each) for each in both]
    step = (horizon(scene) - scene.start) / 4
    ended = ["ran", "ran"]
    for quarter in range(1, 5):
        for which, sim in enumerate(side_by_side):
            left = CONTACTS - len(sim.contacts)
            if ended[which] == "ran" and left:
                try:
                    sim.run(until=max(scene.start + quarter * step, sim.time), max_contacts=left)
                except KinetileError as error:
                    ended[which] = f"{type(error).__name__}: {error}"
    for sim, end, expected in zip(side_by_side, ended, alone, strict=True):
        if end.partition(":")[0] != expected.ended.partition(":")[0]:
            raise Disagreement(f"side by side with another it ended with {end}; alone {expected.ended}")
        if sim.contacts.tobytes() != expected.contacts.tobytes():
            raise Disagreement("side by side with another it does not give the contacts that it gives alone")


@check("It leaves the scene as it is.", turns=True)
def leaves_the_scene_alone(subject: Subject, scene: Scene, reference: Reference) -> None:
    before = scene._bits()
    outcome(subject, scene)
    if scene._bits() != before:
        raise Disagreement("the scene is not what it was before the run")


@check("Its candidate pairs are pairs of bodies, a < b, each once.")
def names_real_pairs(subject: Subject, scene: Scene, reference: Reference) -> None:
    for count, sim in enumerate(stepped(subject, scene, 120)):
        if count % 3:
            continue
        table = sim._engine.k.certificates
        live = table[table.a >= 0]
        a, b = np.asarray(live.a, dtype=np.int64), np.asarray(live.b, dtype=np.int64)
        if ((a >= b) | (b >= len(scene))).any():
            raise Disagreement(f"at time {sim.time!r} a candidate pair is not of two bodies a < b")
        if len(set(zip(a.tolist(), b.tolist(), strict=True))) != len(a):
            raise Disagreement(f"at time {sim.time!r} a candidate pair is there twice")


@check("A run that is stopped and goes on is the run that was not stopped.", turns=True)
def stops_and_goes_on(subject: Subject, scene: Scene, reference: Reference) -> None:
    whole = outcome(subject, scene)
    if whole.ended != "ran" or len(whole.contacts) >= CONTACTS:
        return
    sim = subject.simulation(scene)
    for part in (0.25, 0.25, 0.5, 1.0):
        sim.run(until=scene.start + part * (horizon(scene) - scene.start))
        sim.candidate_pairs()
    said = difference(Outcome.of(sim, "ran"), whole, subject.name)
    if said is not None:
        raise Disagreement(f"stopped and gone on with, {said}")


@check("Built anew in the middle of a run it goes on as before.", turns=True)
def survives_being_built_anew(subject: Subject, scene: Scene, reference: Reference) -> None:
    expected = reference(scene)
    if expected.ended != "ran" or len(expected.contacts) >= CONTACTS:
        return
    sim = subject.simulation(scene)
    for part in (0.3, 0.6, 1.0):
        sim.run(until=scene.start + part * (horizon(scene) - scene.start))
        if part < 1.0:
            sim._engine.lay_out()
    said = difference(Outcome.of(sim, "ran"), expected, subject.name)
    if said is not None:
        raise Disagreement(f"built anew on the way, {said}")


@check("It does not see when the clock starts.", turns=True)
def does_not_see_the_start(subject: Subject, scene: Scene, reference: Reference) -> None:
    late = shifted_in_time(scene, 2.0**40)
    here, there = outcome(subject, scene), outcome(subject, late)
    for name in ("epoch", "tick", "a", "b"):
        if here.contacts[name].tolist() != there.contacts[name].tolist():
            raise Disagreement(f"started at 2^40, its contacts have another {name}")


def changed(scene: Scene, **fields: Any) -> Scene:
    """Return a scene with some fields changed."""
    names = ("position", "velocity", "radius", "mass", "arena", "turns", "start", "settings")
    return Scene(**({name: getattr(scene, name) for name in names} | fields))


def slowed(scene: Scene, by: float) -> Scene:
    """Return a scene in which everything takes so many times as long."""
    turns = [
        Turn(t.body, scene.start + by * (t.time - scene.start), (t.velocity[0] / by, t.velocity[1] / by))
        for t in scene.turns
    ]
    settings = replace(scene.settings, until=scene.start + by * (horizon(scene) - scene.start))
    return changed(scene, velocity=scene.velocity / by, turns=turns, settings=settings)


def shifted_in_time(scene: Scene, by: float) -> Scene:
    """Return a scene that starts later by so much."""
    turns = [Turn(t.body, t.time + by, t.velocity) for t in scene.turns]
    settings = replace(scene.settings, until=horizon(scene) + by)
    return changed(scene, start=scene.start + by, turns=turns, settings=settings)


@check(
    "The reference's contacts on the mirrored, turned, renumbered, enlarged, moved and slowed scene as well.",
    turns=True,
)
def same_contacts_after_a_change_of_view(subject: Subject, scene: Scene, reference: Reference) -> None:
    arena = scene.arena
    flip = np.array([-1.0, 1.0])
    width = np.array([arena[0] if arena else 0.0, 0.0])
    order = np.arange(len(scene))[::-1]
    swap = [1, 0]
    views = {
        "mirrored, ": changed(
            scene,
            position=width + scene.position * flip,
            velocity=scene.velocity * flip,
            turns=[Turn(t.body, t.time, (-t.velocity[0], t.velocity[1])) for t in scene.turns],
        ),
        "with its axes exchanged, ": changed(
            scene,
            position=scene.position[:, swap],
            velocity=scene.velocity[:, swap],
            arena=None if arena is None else (arena[1], arena[0]),
            turns=[Turn(t.body, t.time, (t.velocity[1], t.velocity[0])) for t in scene.turns],
        ),
        "renumbered, ": changed(
            scene,
            position=scene.position[order],
            velocity=scene.velocity[order],
            radius=scene.radius[order],
            mass=scene.mass[order],
            turns=[Turn(len(scene) - 1 - t.body, t.time, t.velocity) for t in scene.turns],
        ),
        "32 times as large, ": changed(
            scene,
            position=scene.position * 32.0,
            velocity=scene.velocity * 32.0,
            radius=scene.radius * 32.0,
            arena=None if arena is None else (arena[0] * 32.0, arena[1] * 32.0),
            turns=[Turn(t.body, t.time, (t.velocity[0] * 32.0, t.velocity[1] * 32.0)) for t in scene.turns],
        ),
        "256 times as slow, ": slowed(scene, 256.0),  # so long that the clock's base moves on
    }
    if arena is None and len(scene):
        views["moved, "] = changed(scene, position=scene.position + np.array([2.0**12, -(2.0**9)]))
    for how, view in views.items():
        agree(subject, view, reference, how)


@check("Time reversed at the end, it still gives the reference's contacts.")
def same_contacts_back_in_time(subject: Subject, scene: Scene, reference: Reference) -> None:
    there = reference(scene)
    if there.ended != "ran":
        return
    try:
        back = changed(scene, position=there.positions, velocity=-there.velocities, turns=())
    except KinetileError:
        return  # rounding has left two touching bodies in each other: not a scene
    agree(subject, back, reference, "back in time, ")


@check("It runs where there is nothing, one body, or nothing that moves.", draws=False)
def survives_the_smallest_scenes(subject: Subject, scene: Scene, reference: Reference) -> None:
    nobody = np.zeros((0, 2))
    for small in (
        Scene(nobody, nobody, np.zeros(0), arena=(1.0, 1.0)),
        Scene([[0.5, 0.5]], [[0.0, 0.0]], 0.25, arena=(1.0, 1.0)),
        Scene([[0.5, 0.5]], [[1.0, 0.5]], 0.25, arena=(1.0, 1.0)),
        Scene([[0.25, 0.5], [0.75, 0.5]], np.zeros((2, 2)), 0.25, arena=(1.0, 1.0)),
        Scene([[0.5, 0.5], [1.5, 0.5]], [[1.0, 0.0], [1.0, 0.0]], 0.5, arena=(8.0, 1.0)),
    ):
        agree(subject, small, reference, f"with {len(small)} bodies, ")


@check(
    "The fixed gallery: dense and dilute gases, worst cases, billiards, lattices full of ties.", draws=False
)
def same_contacts_in_the_gallery(subject: Subject, scene: Scene, reference: Reference) -> None:
    from kinetile.conformance.gallery import gallery

    seen = 0
    refusal = None
    for title, picture in gallery():
        try:
            agree(subject, picture, reference, f"{title}: ")
            seen += 1
        except Refused as error:
            refusal = error
    if refusal is not None and not seen:
        raise refusal


@check("An option that it does not have is refused by name.", draws=False)
def rejects_unknown_options(subject: Subject, scene: Scene, reference: Reference) -> None:
    try:
        Simulation(scene, subject.name, options={**subject.options, "no_such_option": 1})
    except BadOption:
        return
    raise Disagreement("it takes an option called 'no_such_option' without a word")


@check("Its candidate pairs are those whose bounding boxes overlap.", feature="boxes")
def pairs_are_overlapping_boxes(subject: Subject, scene: Scene, reference: Reference) -> None:
    for sim in stepped(subject, scene, 60):
        k = sim._engine.k
        waiting = k.queue[: int(k.clock[0].queued)]
        if (waiting.tick <= k.clock[0].now).any():
            continue
        place = sim.positions()
        reach = k.bodies.reach
        gap = (np.abs(place[:, None] - place[None]) - (reach[:, None] + reach[None, :])[:, :, None]).max(
            axis=2
        )
        skin = 2.0 * float((reach - k.bodies.radius).max(initial=0.0))
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
