"""Questions about the next event, compared with the event itself, in every state of a run."""

import math
import random
from copy import copy

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from inside import engine_of
from kinetile.errors import KinetileError, SceneError
from lanes import examples

LONG = 3.0
"""How far a copy is run on; where an axis is periodic up to the next beat, which anchors plans again."""

ROWS = 25
SPEEDS = (-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0)
FRAME = {
    "kinds": ("ball", "wisp", "probe"),
    "responses": {("ball", "wisp"): "pass", ("wisp", "wisp"): "pass"},
}


def begun(rng: random.Random, periodic: str) -> kt.Simulation:
    bodies: dict[str, list] = {"position": [], "velocity": [], "radius": [], "kind": []}
    made = None
    for _ in range(rng.randrange(2, 6)):
        place = [rng.randrange(4, 29) / 8, rng.randrange(4, 13) / 8]
        if bodies["position"] and rng.random() < 0.3:
            place = [at + rng.randrange(-1, 2) / 16 for at in rng.choice(bodies["position"])]
        new = (place, velocity(rng), rng.choice((0.5, 0.25, 0.125)), rng.choice(("ball", "wisp")))
        tried = {name: [*column, each] for (name, column), each in zip(bodies.items(), new, strict=True)}
        try:
            made = kt.Scene(**tried, arena=(4.0, 2.0), periodic=periodic, **FRAME)
        except SceneError:
            continue
        bodies = tried
    assert made is not None
    return kt.Simulation(made, "naive", live=True)


def velocity(rng: random.Random) -> tuple[float, float]:
    return rng.choice(SPEEDS), rng.choice(SPEEDS)


def changed(rng: random.Random, sim: kt.Simulation) -> None:
    """Runs on, up to a time or a contact or just before it, or gives a command."""
    there = sim.bodies.tolist()
    how = rng.randrange(6)
    try:
        if how == 0:
            sim.run(until=sim.time + rng.randrange(5) / 8)
        elif how in (1, 2):
            sim.run(until=sim.time + 1.0, stop_at=kt.StopAt(before=how == 1))
        elif how == 3 and there:
            sim.set_velocity(rng.choice(there), velocity(rng))
        elif how == 4 and there:
            at = sim.positions()[rng.randrange(len(there))]
            sim.insert(at, velocity(rng), rng.choice((0.25, 0.5)), kind=rng.choice(("ball", "wisp")))
        elif how == 5 and len(there) > 2:
            sim.remove(rng.choice(there))
    except (KinetileError, ValueError):
        pass  # no room


def rows_to_come(sim: kt.Simulation) -> tuple[list[tuple], float]:
    """Returns the rows that follow undisturbed, up to and with the first that changes a plan, and the
    time up to which these are all."""
    ahead, seen, end = copy(sim), len(sim.contacts), sim.time + LONG
    if sim.scene.periodic:
        clock = copy(sim).tables.clock[0]
        end = min(end, math.nextafter(float(clock.torus.beat * clock.per_tick), 0.0))
    ahead.run(until=end, max_contacts=seen + ROWS - len(sim.contacts))
    rows = [row.item() for row in ahead.contacts[seen:]]
    kinds = dict(zip(sim.bodies.tolist(), sim.kinds.tolist(), strict=True))
    for number, (*_, a, b) in enumerate(rows, 1):
        if b < 0 or kinds[a] == kinds[b] == "ball":
            return rows[:number], rows[number - 1][0]
    return rows, rows[-1][0] if len(rows) == ROWS else end


def compare(found: tuple | None, rows: list[tuple], end: float, what: str) -> None:
    if rows:
        assert found == rows[0], what
    else:
        assert found is None or found[0] >= end, what


def assert_true(sim: kt.Simulation) -> None:
    rows, end = rows_to_come(sim)
    bodies = sim.bodies.tolist()
    kinds = dict(zip(bodies, sim.kinds.tolist(), strict=True))
    scheduled = [sim.next_contact_of(body, scheduled=True) for body in bodies]
    for body, soon in zip(bodies, scheduled, strict=True):
        of_body = [row for row in rows if body in row[3:]]
        first = sim.next_contact_of(body)
        compare(first, of_body, end, f"next_contact_of({body})")
        assert soon in (None, first)
        if of_body and first == next(row for row in rows if {*row[3:]} & {*first[3:]} & {*bodies}):
            assert soon == first, f"next_contact_of({body}, scheduled=True)"
        others = [kinds.get(row[4] if row[3] == body else row[3], "wall") for row in of_body]
        for kind in ("ball", "wisp", "wall"):
            of_kind = [row for row, other in zip(of_body, others, strict=True) if other == kind]
            compare(sim.next_contact_of(body, kinds=kind), of_kind, end, f"next_contact_of({body}, {kind})")
        for other in bodies:
            if other != body:
                of_pair = [row for row in of_body if other in row[3:]]
                found = sim.next_contact(body, other)
                compare(found, of_pair, end, f"next_contact({body}, {other})")
                said = sim.next_contact(body, other, scheduled=True)
                assert said == (soon if soon is not None and soon == found else None)
    if rows:
        assert rows[0] in scheduled
    else:
        assert all(each is None or each.time >= end for each in scheduled)
    cast_as_inserted(sim)
    event = next_event(sim)
    if rows and not engine_of(sim).ledger.pending_events:  # a passing that waits for a step
        assert (event.time, event.epoch, event.tick) == rows[0][:3]
        assert event.bodies == tuple(sorted(body for body in rows[0][3:] if body >= 0))


def next_event(sim: kt.Simulation) -> kt.Event | None:
    """Returns the next event of a copy: to look for it begins the passings of the start."""
    seen = len(sim.contacts)
    event = (ahead := copy(sim)).next_event
    if len(ahead.contacts) == seen:
        return event
    epoch, tick, a, b = ahead.contacts[["epoch", "tick", "a", "b"]][seen].item()
    return kt.Event(ahead.contacts["time"][seen].item(), epoch, tick, "pass", (a, b))


def cast_as_inserted(sim: kt.Simulation) -> None:
    """A cast disc meets the same bodies as a body that is inserted there, if there is room for it."""
    ahead = copy(sim)
    rng = random.Random(len(sim.contacts))
    place, speed = (rng.randrange(1, 31) / 8, rng.randrange(1, 15) / 8), velocity(rng)
    try:
        new = ahead.insert(place, speed, 0.0625, kind="probe")
    except KinetileError:
        return
    for kinds in (("ball", "wisp"), ("ball", "wisp", "wall"), ("wall",)):
        met, hit = ahead.next_contact_of(new, kinds=kinds), sim.cast((*place, 0.0625), speed, kinds=kinds)
        assert (hit and hit[:4]) == (None if met is None else (*met[:3], *{met.a, met.b} - {new}))


@settings(max_examples=examples(10), deadline=None)
@given(seed=st.integers(0, 2**32), periodic=st.sampled_from(["", "", "x", "y", "xy"]))
def test_answers_are_what_then_happens(seed, periodic):
    rng = random.Random(seed)
    sim = begun(rng, periodic)
    assert_true(sim)
    for _ in range(3):
        changed(rng, sim)
        assert_true(sim)


def passing(**more: object) -> kt.Scene:
    rules = {"kind": ["a", "b"], "responses": {("a", "b"): "pass"}}
    return kt.Scene(
        [[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]], 0.25, arena=(8.0, 4.0), **rules, **more
    )


@pytest.mark.parametrize("periodic", ["", "x", "xy"])
def test_a_ball_inside_a_sensor_was_said_to_meet_it_again(periodic):
    sim = kt.Simulation(passing(periodic=periodic), "naive", live=True)
    sim.run(until=5.0, stop_at=kt.StopAt())
    end = (2.5, 2, 2**51, 1, 0)
    assert sim.next_contact(0, 1) == sim.next_contact(1, 0, scheduled=True) == end
    sim.run(until=1.75)
    sim.set_velocity(0, (0.5, 0.0))
    assert sim.next_contact_of(0) == sim.next_contact_of(1, scheduled=True) == (3.25, 3, 2**50, 1, 0)
    assert sim.next_contact_of(0, kinds="b") == (3.25, 3, 2**50, 1, 0)
    sim.run(until=3.5)
    assert sim.contacts[-1].item() == (3.25, 3, 2**50, 1, 0)
    if not periodic:
        assert sim.next_contact(0, 1) is None
        assert sim.next_contact_of(0).b == -2


def test_a_passing_of_the_start_was_no_contact_to_come():
    scene = passing().replace(position=[[3.125, 1.0], [3.0, 1.0]])
    sim = kt.Simulation(scene, "naive")
    assert sim.next_contact(1, 0, scheduled=True) == (0.0, 0, 0, 0, 1)
    assert len(sim.contacts) == 0
    sim.run(until=0.0)
    assert sim.contacts[-1].item() == (0.0, 0, 0, 0, 1)
    assert sim.next_contact(0, 1) == (0.375, 0, 3 * 2**49, 1, 0)


def slow(rng: random.Random, periodic: str) -> kt.Scene:
    """Discs that take up to a thousand units of the clock to meet a body or a wall."""
    places = rng.sample([(x + 0.5, y + 0.5) for x in range(6) for y in range(4)], rng.randrange(2, 4))
    speeds = [[rng.choice((-1.0, -0.25, 0.0, 0.5)) * rng.random() * 0.1 for _ in "xy"] for _ in places]
    pulls = [(0.0, rng.choice((0.0, 2.0**-12)) * rng.choice((-1, 1)) * (periodic == "x")) for _ in places]
    accelerated = {"acceleration": pulls} if rng.random() < 0.5 else {}
    return kt.Scene(places, speeds, 0.25, arena=(6.0, 4.0), periodic=periodic, unit=1.0, **accelerated)


@pytest.mark.parametrize("periodic", ["x", "y", "xy"])
@given(seed=st.integers(0, 2**32))
@settings(max_examples=examples(20), deadline=None)
def test_a_wall_was_said_to_come_first_and_a_pair_not_to_meet_where_it_was_not_looked_far(periodic, seed):
    """Pairs were foreseen for eight units of the clock, and walls for a thousand."""
    sim = kt.Simulation(slow(random.Random(seed), periodic), "naive")
    sim.run(until=3.0)
    seen, bodies = len(sim.contacts), sim.bodies.tolist()
    first = [found for each in bodies if (found := sim.next_contact_of(each, scheduled=True))]
    found = min(first, default=None)
    sim.run(until=1002.0 if found is None else found.time + 1.0, max_contacts=1)
    assert (len(sim.contacts) > seen) == (found is not None)
    if found is not None:
        when, _, _, *pair = sim.contacts[seen].item()
        assert found.time == pytest.approx(when, abs=1e-9)
        assert [found.a, found.b] == pair


@pytest.mark.parametrize(
    ("ceiling", "speed", "met"), [(998.0, 0.0, True), (1003.0, 0.0, False), (998.0, 8.0, False)]
)
def test_no_wall_is_said_to_come_first_later_than_pairs_are_looked_for(ceiling, speed, met):
    """That is a thousand units, or as long as a body crosses 4,096 periods for another."""
    places, speeds = [(0.5, 0.5), (1.5, 0.25)], [(0.0, 1.0), (speed, 0.0)]
    scene = kt.Scene(places, speeds, 0.125, arena=(2.0, ceiling + 0.625), periodic="x", unit=1.0)
    answer = kt.Simulation(scene, "naive").next_contact_of(0)
    assert (answer is not None and answer.time == ceiling) is met
