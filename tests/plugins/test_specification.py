"""kinetile against the test vectors of its specification: rules 3 to 6 and 9 one by one, then whole runs."""

import json
from collections import Counter
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinetile as kt
from agreement import ALL, choices
from kinetile.errors import Refused, SceneError
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.compiled import NOTHING_IS_COMPILED, compose, disowned, to_be_filled_in
from kinetile.kernel.flight import anchor_at
from kinetile.kernel.tables import NEVER, Kernel, allocate
from kinetile.scene.bodies import Bodies
from kinetile.scene.reader import unit_of
from kinetile_plugins.disc import Disc
from kinetile_plugins.wall import Wall
from lanes import first
from vectors.make import doubles, scene_of

VECTORS = Path(__file__).parents[1] / "vectors"
CONTACTS = sorted(path.stem for path in (VECTORS / "contacts").iterdir())
RUNS = {
    f"{path.stem}: {number} {run['name']}": run
    for path in sorted((VECTORS / "runs").iterdir())
    for number, run in enumerate(json.loads(path.read_text(encoding="ascii"))["runs"])
}
CLAUSES = {
    f"{path.stem}: {number} {run['name']}": run
    for path in sorted((VECTORS / "rules").iterdir())
    for number, run in enumerate(json.loads(path.read_text(encoding="ascii"))["runs"])
}
OF_PAIRS = Disc().prepare(kt.Scene([(0.0, 0.0), (3.0, 0.0)], [(0.0, 0.0)] * 2, 1.0, mass=[1.0, 2.0]))
OF_EQUALS = Disc().prepare(kt.Scene([(0.0, 0.0), (3.0, 0.0)], [(0.0, 0.0)] * 2, 1.0))
ACCELERATED = kt.Scene([(0.5, 0.5)], [(0.0, 0.0)], 0.1, arena=(1.0, 1.0), gravity=(0.0, -1.0))
OF_ONE = kt.Scene([(0.5, 0.5)], [(0.0, 0.0)], 0.1, arena=(1.0, 1.0))


def rows(name: str) -> list[Any]:
    """Returns all rows of a file of questions, whatever their family, as [family, *row]."""
    families = json.loads((VECTORS / f"{name}.json").read_text(encoding="ascii"))["families"]
    return [[family, *row] for family, questions in families.items() for row in questions]


def tables(plans: list[list[str]], accelerated: bool = False) -> Kernel:
    k = allocate(len(plans), near=0, log_rows=0, accelerated=accelerated)
    for body, (*numbers, anchor), pull in zip(
        k.bodies, (plan[:6] for plan in plans), (plan[6:] for plan in plans), strict=True
    ):
        body.x, body.y, body.vx, body.vy, body.radius = doubles(numbers)
        body.anchor = int(anchor)
        if accelerated:
            body.ax, body.ay = doubles(pull)
    k.bodies.last = -1
    k.clock[0].contact_guess = NEVER
    k.clock[0].limits.tolerance = np.inf
    return k


def ticks(exponents: list[int]) -> Any:
    return np.ldexp(1.0, -52 - np.array(exponents))


meet = collide = reach_wall = to_be_filled_in


def meet_all(k: Kernel, tick: Any, answers: Any) -> None:
    """Asks ``meet`` for the bodies 2i and 2i + 1, and then the other way round."""
    k = disowned(k)
    for i in range(len(tick)):
        k.clock[0].per_tick = tick[i]
        k.clock[0].per_time = 1.0 / tick[i]
        answers[2 * i] = meet(k, 2 * i, 2 * i + 1)
        answers[2 * i + 1] = meet(k, 2 * i + 1, 2 * i)


def reach_all(k: Kernel, tick: Any, sides: Any, answers: Any) -> None:
    """Asks ``reach_wall`` for every body, in an arena of its own."""
    k = disowned(k)
    for i in range(len(tick)):
        k.clock[0].per_tick = tick[i]
        k.clock[0].per_time = 1.0 / tick[i]
        k.clock[0].limits.width = sides[i, 0]
        k.clock[0].limits.height = sides[i, 1]
        answers[i, 0], answers[i, 1] = reach_wall(k, k.bodies[i])


def anchor_all(k: Kernel, tick: Any, at: Any) -> None:
    k = disowned(k)
    for i in range(len(tick)):
        k.clock[0].per_tick = tick[i]
        anchor_at(k, k.bodies[i], at[i])


def collide_all(k: Kernel, pairs: int) -> None:
    k = disowned(k)
    for i in range(pairs):
        collide(k, 2 * i, 2 * i + 1)


def differing(wrong: list[str], count: int) -> str:
    return f"{len(wrong)} of {count} differ; " + "; ".join(wrong[:5])


def check_meetings(k: Kernel, questions: list[Any], meet: Any) -> None:
    """Asserts that ``meet`` returns the tick of its row for each question, in both orders."""
    found = np.zeros(2 * len(questions), dtype=np.int64)
    asking = compose(meet_all, {"meet": meet}, "vectors", Kernel)
    with np.errstate(all="ignore"):
        asking(k, ticks([q[1] for q in questions]), found)
    wrong = [
        f"{family}, {i // 2}: {tick} and not {answer}"
        for i, tick in enumerate(found.tolist())
        for family, *_, answer in [questions[i // 2]]
        if tick != (NEVER if answer is None else int(answer))
    ]
    assert not wrong, differing(wrong, len(found))


@pytest.mark.parametrize("name", first(2, [*CONTACTS]))
def test_bodies_meet_at_the_tick_of_the_rule_in_either_order(name: str) -> None:
    questions = rows(f"contacts/{name}")[:: 10 if NOTHING_IS_COMPILED else 1]
    k = tables([plan for row in questions for plan in row[2:4]])
    check_meetings(k, questions, OF_PAIRS.meet)


def test_accelerated_bodies_meet_at_the_tick_of_the_rule_in_either_order() -> None:
    questions = rows("accelerated_contacts")[:: 15 if NOTHING_IS_COMPILED else 1]
    k = tables([plan for row in questions for plan in row[3:5]], accelerated=True)
    for i, (_, _, met, *_) in enumerate(questions):
        if met:
            k.bodies[2 * i].last, k.bodies[2 * i + 1].last = 2 * i + 1, 2 * i
    check_meetings(k, questions, Disc().prepare(ACCELERATED).meet)


@pytest.mark.parametrize("accelerated", [False, True])
def test_bodies_reach_the_wall_of_the_rule_at_its_tick(accelerated: bool) -> None:
    questions = [row for row in rows("walls") if (len(row[3]) == 8) == accelerated]
    questions = questions[:: 4 if NOTHING_IS_COMPILED else 1]
    k = tables([plan for *_, plan, _ in questions], accelerated)
    sides = np.array([doubles(q[2]) for q in questions])
    found = np.zeros((len(questions), 2), dtype=np.int64)
    hook = Wall().prepare(ACCELERATED if accelerated else OF_ONE).reach_wall
    with np.errstate(all="ignore"):
        asking = compose(reach_all, {"reach_wall": hook}, "vectors", Kernel)
        asking(k, ticks([q[1] for q in questions]), sides, found)
    wrong = [
        f"{family}, {i}: {tick, wall} and not {answer}"
        for i, ((tick, wall), (family, *_, answer)) in enumerate(zip(found.tolist(), questions, strict=True))
        if (tick != NEVER and answer is None) or (answer and (tick, wall) != (int(answer[0]), answer[1]))
    ]
    assert not wrong, differing(wrong, len(found))


@pytest.mark.parametrize("accelerated", [False, True])
def test_an_anchored_plan_is_where_the_rule_has_it(accelerated: bool) -> None:
    questions = rows("accelerated_places" if accelerated else "places")
    plans = [plan if accelerated else [*plan, "0x0p+0", anchor[0]] for _, _, plan, *anchor, _, _ in questions]
    k = tables(plans, accelerated)
    at = np.array([int(tick) for *_, tick, _ in questions])
    compose(anchor_all, {}, "vectors", Kernel)(k, ticks([q[1] for q in questions]), at)
    assert np.array_equal(k.bodies.anchor, at)
    wrong = [
        f"{family}, {i}: {place} and not {answer}"
        for i, (*place, (family, *_, answer)) in enumerate(
            zip(*(k.bodies[name].tolist() for name in ("x", "y", "vx", "vy")), questions, strict=True)
        )
        if tuple(place)[: len(answer)] != doubles(answer)
    ]
    assert not wrong, differing(wrong, len(questions))


@pytest.mark.parametrize("equal", [True, False])
def test_bodies_leave_a_contact_with_the_velocities_of_the_rule(equal: bool) -> None:
    questions = [row for row in rows("exchanges") if (row[1] is None) == equal]
    k = tables([[*plan, "0x1p+0", "0"] for _, _, one, two, _ in questions for plan in (one, two)])
    if not equal:
        k.mass[:] = np.array([doubles(masses) for _, masses, *_ in questions]).ravel()
    hook = (OF_EQUALS if equal else OF_PAIRS).collide
    with np.errstate(all="ignore"):
        compose(collide_all, {"collide": hook}, "vectors", Kernel)(k, len(questions))
    after = np.column_stack([k.bodies.vx, k.bodies.vy]).reshape(-1, 4).tolist()
    wrong = [
        f"{family}, {i}: {velocities} and not {doubles(answer)}"
        for i, (velocities, (family, *_, answer)) in enumerate(zip(after, questions, strict=True))
        if tuple(velocities) != doubles(answer)
    ]
    assert not wrong, differing(wrong, len(questions))


def test_a_scene_has_the_unit_of_the_rule() -> None:
    for family, arena, bodies, turned, e in rows("units"):  # of any size: nothing is refused
        numbers = [doubles(body) for body in bodies]
        table = np.array(numbers).reshape(-1, 5)
        given = Bodies(table[:, :2], table[:, 2:4], table[:, 4], np.ones(len(table)), {})
        turns = [kt.Turn(0, 0.0, doubles(velocity)) for velocity in turned]
        unit = unit_of(given, None if arena is None else doubles(arena), turns, (0.0, 0.0))
        assert unit == 2.0**-e, family


def test_a_time_has_the_tick_of_the_rule() -> None:
    for family, e, start, time, tick in rows("times"):
        clock = Clock(float.fromhex(start), 2.0**-e)
        assert clock.ticks(float.fromhex(time)) == int(tick), family


def assert_follows(run: dict[str, Any], phase: str, options: dict[str, Any]) -> None:
    """Asserts that a run under a phase has the answer of the vectors, and ends as it does."""
    scene = scene_of(run["scene"])
    assert scene.time_unit == 2.0 ** -run["e"]
    if scene.settings.end is None:
        assert Clock(scene.start, scene.time_unit).ticks(scene.settings.until) == int(run["end"])
    sim = kt.Simulation(scene, phase, options=options)
    with pytest.raises(Refused) if run.get("ended") == "no room" else nullcontext():
        sim.run()
    found = [[str(epoch), str(tick), a, b] for _, epoch, tick, a, b in sim.contacts.tolist()]
    for number, (mine, right) in enumerate(zip(found, run["contacts"], strict=False)):
        assert mine == right, f"{phase} {options}: contact {number}"
    assert len(found) == run["count"], f"{phase} {options}"
    assert sim.fingerprint == run["fingerprint"], f"{phase} {options}"
    happened, readings = Counter(run["happened"]), sim.readings
    assert readings.contacts_wall == happened["wall"]
    assert readings.contacts_disc == happened["pair"] + happened["begin"] + happened["end"]
    assert (readings.turns, readings.inserted, readings.removed) == (
        sum(happened[each] for each in ("turn", "acceleration", "kind", "move")),
        happened["insertion"],
        happened["removal"],
    )


@pytest.mark.parametrize("name", CLAUSES)
def test_a_clause_is_followed(name: str) -> None:
    assert_follows(CLAUSES[name], *ALL[0])


@pytest.mark.parametrize(("family", "name", "said", "right"), rows("scenes"))
def test_a_scene_has_commands_for_bodies_that_are_there_and_new_numbers(
    family: str, name: str, said: dict[str, Any], right: bool
) -> None:
    why = {
        "accelerations": r"gravity|acceler|at rest on the|\.body: found",
        "responses": r"restitution: e is ",
    }.get(family, r"commands\[\d\]\.(insert\.body|turn|remove): found \d")
    with nullcontext() if right else pytest.raises(SceneError, match=why):
        scene_of(said)


def test_a_wall_is_met_up_to_a_rounding_and_a_segment_in_its_place_exactly() -> None:
    """Rules 5s and 6s: the same bodies, which meet the one and the other at ticks that may differ."""
    both = (rows(name) for name in ("shapes", "shape_walls"))
    segments, walls = ([row for row in each if row[0] == "a segment for a wall"] for each in both)
    differ = []
    for (_, _, segment, body, met), (_, _, arena, alone, reached) in zip(segments, walls, strict=True):
        assert body == alone
        differ.append(met != reached[0])
        if differ[-1] or sum(differ) == 0:
            with_segment = first_tick([segment, body], mass=[np.inf, 1.0])
            assert (with_segment, first_tick([body], arena=doubles(arena))) == (met, reached[0])
    assert 5 < sum(differ) < len(differ) - 5


def first_tick(bodies: list[Any], **more: Any) -> str:
    """Returns the tick of the first contact of bodies as ``shapes.json`` has them, in a unit of 1."""
    states = np.array([doubles(plan[:4]) for _, _, plan in bodies])
    shapes = [
        kt.polygon([doubles(corner) for corner in core], float.fromhex(radius))
        if len(core) != 2 or float.fromhex(radius)
        else kt.segment(*(doubles(corner) for corner in core))
        for core, radius, _ in bodies
    ]
    scene = kt.Scene(states[:, :2], states[:, 2:], shapes=shapes, shape=range(len(shapes)), unit=1.0, **more)
    sim = kt.Simulation(scene, "naive")
    sim.run(max_contacts=1)
    _, epoch, tick, _, _ = sim.contacts[0].tolist()
    return str(epoch * TICKS + tick)


@pytest.mark.interpreted
@pytest.mark.parametrize("name", first(4, [*CLAUSES][5:] + [*CLAUSES][:5]))  # five have more events
def test_a_clause_is_followed_under_every_other_phase(name: str) -> None:
    """These are a dozen loops a phase, each for a few events: compiling them would take minutes."""
    run = CLAUSES[name]
    taken = choices(scene_of(run["scene"]))
    for phase, options in ALL[1:]:
        if (phase, options) in taken:
            assert_follows(run, phase, options)
        else:
            with pytest.raises(Refused):
                kt.Simulation(scene_of(run["scene"]), phase, options=options).build()


@pytest.mark.parametrize("phase", ["naive", "cells"])
def test_a_command_by_hand_is_one_after_the_contacts_that_its_tick_has_had(phase: str) -> None:
    run = next(run for name, run in CLAUSES.items() if name.startswith("orders: 1 "))
    late, early = run["scene"]["commands"]
    sim = kt.Simulation(scene_of({**run["scene"], "commands": [early]}), phase)
    sim.run(max_contacts=1)
    sim.set_velocity(late["turn"], doubles(late["velocity"]))
    assert [command.at for command in sim.recorded().commands] == [None, tuple(late["at"])]
    sim.run()
    assert sim.fingerprint == run["fingerprint"]


REFUSED = ("mixtures: 2 gas, masses up to 2^99 apart",)
"""Runs that sweep-tiling and power refuse, for their skin is too thick."""


SMALL = [
    pytest.param(name, marks=pytest.mark.small) if "periodic" in run["scene"] else name
    for name, run in RUNS.items()
]
"""All runs; runs of periodic boxes are short, and each kind of box would be a loop to compile."""


@pytest.mark.parametrize("name", first(5, SMALL[::4] + [each for at, each in enumerate(SMALL) if at % 4]))
def test_a_run_has_the_contacts_of_the_specification(name: str) -> None:
    assert_follows(RUNS[name], *ALL[0])


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("name", RUNS)
def test_a_run_has_them_under_every_other_phase(name: str) -> None:
    run = RUNS[name]
    for phase, options in choices(scene_of(run["scene"]))[1:]:
        limited = phase in ("sweep-tiling", "power") and name in REFUSED
        with pytest.raises(Refused) if limited else nullcontext():
            assert_follows(run, phase, options)
