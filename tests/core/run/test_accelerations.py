"""Bodies with accelerations of their own: known answers, margins of chords, commands."""

import math
from fractions import Fraction

import numpy as np
import pytest

import by_the_rules
import kinetile as kt
import lanes
from agreement import agree, assert_one_answer
from kinetile.errors import NoRoom, PhaseError, Refused
from kinetile.scene.files import dumps_scene, loads_scene
from kinetile.show.player.view import view_file
from kinetile.toolbox import reach
from lanes import first

FRAME = {"arena": (4.0, 4.0), "gravity": (0.0, -1.0)}
PHASES = ("naive", "cells", "sap-1d", "sap-2d", "sweep-tiling", "power")


def contacts(scene: kt.Scene, until: float, phase: str = "cells") -> list[tuple[float, int, int]]:
    sim = kt.Simulation(scene, phase)
    sim.run(until)
    return [(each["time"].item(), each["a"].item(), each["b"].item()) for each in sim.contacts]


@pytest.mark.parametrize("phase", PHASES)
def test_a_ball_bounces_on_the_floor_and_on_a_peg_at_times_of_the_formula(phase):
    floor = kt.Scene([[1.0, 0.5]], [[0.0, 1.0]], 0.5, arena=(4.0, 8.0), gravity=(0.0, -1.0))
    assert contacts(floor, 8.0, phase) == [(time, 0, -3) for time in (2.0, 4.0, 6.0, 8.0)]
    mass, places = [1.0, math.inf], [[2.0, 2.5], [2.0, 1.0]]
    peg = kt.Scene(places, [[0.0, 1.0], [0.0, 0.0]], [0.5, 1.0], mass, (4.0, 8.0), gravity=(0.0, -1.0))
    assert contacts(peg, 8.0, phase) == [(time, 0, 1) for time in (2.0, 4.0, 6.0, 8.0)]


@pytest.mark.parametrize("phase", PHASES)
def test_flights_halve_at_each_bounce_until_they_are_as_short_as_the_contact_time(phase):
    rules = {("*", "wall"): kt.Response("restitution", e=0.5, contact_time=2.0**-4)}
    ball = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, responses=rules, **FRAME)
    flights = [1.0, 0.5, 0.25, 0.125] + [2.0**-4] * 18
    assert contacts(ball, 4.0, phase) == [(time, 0, -3) for time in np.cumsum([1.0, *flights])]


def test_what_stops_at_a_wall_falls_along_it_and_hops_on_the_floor():
    ball = kt.Scene([[1.0, 2.625]], [[-1.0, 0.0]], 0.5, responses={("*", "wall"): "stop"}, **FRAME)
    sim = kt.Simulation(ball, "naive")
    sim.run(8.0, max_contacts=4)
    assert sim.contacts[["time", "b"]].tolist() == [
        (0.5, -1),
        (2.5, -3),
        (2.5 + 2.0**-14, -3),
        (2.5 + 2.0**-13, -3),
    ]


BOX = kt.box(2.0, 1.0)
TRIANGLE = kt.polygon([(-0.5, -0.5), (0.5, -0.5), (0.0, 0.5)])
SHAPES = kt.disc(0.5), kt.box(1.0, 0.5), TRIANGLE
CAPSULE = kt.capsule((-0.5, 0.0), (0.5, 0.0), 0.5)
FALLING = {"disc": kt.disc(0.5), "box": kt.box(1.0, 1.0), "triangle": TRIANGLE, "capsule": CAPSULE}


@pytest.mark.small
@pytest.mark.parametrize("name", FALLING)
@pytest.mark.parametrize("phase", ["naive", "cells", "sap-2d"])
def test_what_falls_on_a_box_is_back_at_times_of_the_formula(name, phase):
    """Each reaches half a unit down, and begins half a unit above the box."""
    scene = kt.Scene(
        [[2.0, 1.0], [2.0, 2.5]],
        [[0.0, 0.0], [0.0, 0.0]],
        mass=[math.inf, 1.0],
        arena=(4.0, 8.0),
        shapes=[BOX, FALLING[name]],
        shape=[0, 1],
        gravity=(0.0, -1.0),
    )
    assert contacts(scene, 8.0, phase) == [(time, 0, 1) for time in (1.0, 3.0, 5.0, 7.0)]


@pytest.mark.small
@pytest.mark.parametrize(("higher", "times"), [(-(2.0**-36), 1), (-(2.0**-42), 0), (0.0, 0), (2.0**-42, 0)])
def test_a_ball_is_thrown_past_the_tip_of_a_triangle_by_a_strip(higher, times):
    """Its vertex is right above the tip, where it would be tangent; the strip is 2^-39 times 1."""
    thrown = kt.Scene(
        [[2.0, 2.0 + higher], [4.0, 1.5]],
        [[1.0, 0.5], [0.0, 0.0]],
        mass=[1.0, math.inf],
        arena=(8.0, 8.0),
        shapes=[kt.disc(0.5), TRIANGLE],
        shape=[0, 1],
        gravity=(0.0, -0.25),
    )
    assert len(contacts(thrown, 4.0)) == times


@pytest.mark.small
@pytest.mark.parametrize("phase", ["naive", "cells", "sap-2d"])
def test_what_flies_since_long_is_deep_by_its_velocity_of_now(phase):
    """Two boxes rise and fall, one flush on the other and along it. The floor stops the lower one, and so
    they meet at once, while the plan of the upper one is still its first, when it rose."""
    falling = kt.Scene(
        [[2.0, 0.75 + 3.0 / 256.0], [2.25, 0.25 + 3.0 / 256.0]],
        [[0.125, 2.0**-8], [-0.125, 2.0**-8]],
        arena=(4.0, 4.0),
        shapes=[kt.box(1.0, 0.5)],
        shape=[0, 0],
        gravity=(0.0, -(2.0**-5)),
        responses={("*", "wall"): "stop"},
    )
    assert contacts(falling, 1.0, phase)[:2] == [(1.0, 1, -3), (1.0, 0, 1)]


OPEN = ("naive", "cells", "sap-1d", "sap-2d", "sweep-tiling")
"""Phases that take scenes without walls."""


@pytest.mark.parametrize("phase", OPEN)
def test_without_walls_bodies_fall_up_to_the_end_of_the_scene(phase):
    """A ball falls on one that flies on with its speed: each time it meets it again after 4."""
    end = kt.Settings(until=21.0)
    pulls = [[0.0, -1.0], [0.0, 0.0]]
    scene = kt.Scene([[0.0, 3.0], [0.0, 0.0]], [[0.0, 0.0]] * 2, 0.5, acceleration=pulls, settings=end)
    assert contacts(scene, 21.0, phase) == [(time, 0, 1) for time in (2.0, 6.0, 10.0, 14.0, 18.0)]
    sim = kt.Simulation(scene, phase)
    sim.run(7.0)
    with pytest.raises(ValueError, match=r"until=22.0 is after the scene's end, 21.0: expected at most that"):
        sim.run(22.0)
    with pytest.raises(Refused, match="wall needs an arena"):
        kt.Simulation(scene, phase, narrow_phases=["disc", "wall"])
    saved = sim.snapshot()
    for _ in range(2):
        sim.run(max_contacts=100)
        assert (sim.time, len(sim.contacts)) == (21.0, 5)
        sim.restore(saved)


def pair(start: list[float], flies: list[float], reach: float, pulls: list[list[float]]) -> kt.Scene:
    """Two discs in the open plane that touch at this distance; the first is at the origin, and starts at
    rest."""
    places, velocities = [[0.0, 0.0], start], [[0.0, 0.0], flies]
    return kt.Scene(places, velocities, reach / 2.0, acceleration=pulls, settings=kt.Settings(until=9.0))


@pytest.mark.parametrize("phase", OPEN)
@pytest.mark.parametrize(("rest", "roots"), [(1.0, 0), (-1.0, 2)])
def test_a_quartic_on_which_a_solver_never_returned(phase, rest, roots):
    """t^4 + t^3 + 1 of toastedcrumpets/stator, issue 2, and the same with -1: the distance of two discs, with
    t for time - 2, since |(t^2 + t/2 - 17/8, 2 t + 17/32)|^2 is t^4 + t^3 + 4913/1024."""
    reach = math.sqrt(4913.0 / 1024.0 - rest)
    scene = pair([0.875, 17.0 / 32.0 - 4.0], [-3.5, 2.0], reach, [[0.0, 0.0], [2.0, 0.0]])
    sim = kt.Simulation(scene, phase)
    sim.run(max_contacts=1)
    assert len(sim.contacts) == roots // 2  # from the other root on they part
    for epoch, tick in sim.contacts[["epoch", "tick"]].tolist():
        ticks = Fraction((epoch << 52) + tick)
        now, then = ((ticks + more) / 2**52 * Fraction(scene.time_unit) - 2 for more in (0, 1))
        left = Fraction(4913, 1024) - Fraction(reach) ** 2
        assert now**4 + now**3 + left >= 0 > then**4 + then**3 + left


@pytest.mark.parametrize("phase", OPEN)
@pytest.mark.parametrize(
    ("gap", "speed", "times"),
    [(8.0, -5.0, ["1.6"]), (0.0, -5.0, ["0"]), (0.0, 0.0, []), (0.0, 5.0, []), (8.0, 5.0, [])],
)
def test_a_quartic_that_is_a_quadratic(phase, gap, speed, times):
    """Two balls with one acceleration, as in ekiefl/pooltool, 354: solvers of quartics had a contact at once,
    or none. Those that touch meet if they come nearer."""
    scene = pair([1.0 + gap, 0.0], [speed, 0.0], 1.0, [[0.25, -1.0]] * 2)
    sim = kt.Simulation(scene, phase)
    sim.run()
    ticks = [math.floor(Fraction(time) / Fraction(scene.time_unit) * 2**52) for time in times]
    assert [(epoch << 52) + tick for epoch, tick in sim.contacts[["epoch", "tick"]].tolist()] == ticks


@pytest.mark.parametrize("seed", first(2, range(8)))
def test_without_walls_no_body_is_faster_than_the_bound(seed):
    random = np.random.default_rng(seed)
    place = np.stack(np.meshgrid(range(3), range(2)), axis=-1).reshape(-1, 2) * 1.5
    pulls = random.choice([-1.0, 1.0], place.shape) - 0.5 * (place - place.mean(axis=0))
    mass = 4.0 ** random.integers(-4, 5, len(place))
    end = kt.Settings(until=6.0)
    scene = kt.Scene(place, 0.0 * place, 0.5, mass, acceleration=pulls, settings=end)
    sim = kt.Simulation(scene, "cells", live=True)
    for step in range(13):
        sim.run(0.5 * step)
        if step == 6:
            sim.insert((-9.0, -9.0), (0.0, 0.0), 0.5, mass=2.0**-9)
            sim.set_acceleration(0, (0.5, 0.5))
        assert (np.hypot(*sim.velocities().T) <= math.sqrt(sim.tables.clock[0].limits.speed2)).all()
        sim.audit()
    agree(sim.recorded(), *OPEN[:2])


def lane(gap: float) -> kt.Scene:
    """A car with a speed of 4 that brakes by 1, so that it stops after 8, behind one that stands."""
    places = [[0.5, 0.5], [1.5 + gap, 0.5]]
    stops = [kt.Accelerate(0, 4.0, (0.0, 0.0))]
    pulls = [[-1.0, 0.0], [0.0, 0.0]]
    return kt.Scene(
        places, [[4.0, 0.0], [0.0, 0.0]], 0.5, arena=(16.0, 1.0), acceleration=pulls, commands=stops
    )


def test_a_car_stops_in_time_by_a_billionth_and_another_one_does_not():
    assert contacts(lane(8.0 + 1e-9), 6.0) == []
    assert contacts(lane(6.0), 2.5) == [(2.0, 0, 1)]
    ((time, *_),) = contacts(lane(8.0 - 1e-9), 6.0)
    assert time == pytest.approx(4.0 - math.sqrt(2e-9), abs=1e-9)


@pytest.mark.parametrize(("ulps", "times"), [(-1, 1), (0, 0), (1, 0)])
def test_a_ball_is_thrown_past_a_peg_by_an_ulp(ulps, times):
    """Its vertex is right above the peg, where it would be tangent."""
    height = 2.5 + ulps * math.ulp(2.5)
    thrown = kt.Scene(
        [[2.0, height], [4.0, 2.0]],
        [[1.0, 0.5], [0.0, 0.0]],
        0.5,
        [1.0, math.inf],
        (8.0, 8.0),
        gravity=(0.0, -0.25),
    )
    assert [row[1:] for row in contacts(thrown, 4.0)] == [(0, 1)] * times


def drawn(seed: int, bodies: int = 12, **more) -> kt.Scene:
    """Bodies at random, in cells of side 2, some immovable, and some with an acceleration of their own."""
    rng = np.random.default_rng(seed)
    at = rng.permutation(16)[:bodies]
    places = 1.0 + 2.0 * np.column_stack([at % 4, at // 4]) + rng.integers(-2, 3, (bodies, 2)) / 8.0
    fixed = np.arange(bodies) % 4 == 3
    own = rng.integers(-4, 5, (bodies, 2)) / 4.0
    own[rng.random(bodies) < 0.4] = np.nan
    own[fixed] = np.nan
    speed = np.where(fixed[:, None], 0.0, rng.integers(-4, 5, (bodies, 2)) / 4.0 + 0.125)
    mass = np.where(fixed, math.inf, 1.0 + np.arange(bodies) % 2)
    changes = [
        kt.Accelerate(0, 0.75, (0.5, -0.25)),
        kt.Turn(1, 1.0, (1.0, 0.5)),
        kt.Remove(2, 1.5),
        kt.Accelerate(4, 1.75, (0.0, 0.0)),
    ]
    radius = rng.choice([0.5, 0.625, 0.75], bodies)
    gravity = (0.0, -0.5)
    return kt.Scene(
        places, speed, radius, mass, (8.0, 8.0), gravity=gravity, acceleration=own, commands=changes, **more
    )


LOSSY = {("*", each): kt.Response("restitution", e=0.5, contact_time=2.0**-5) for each in ("*", "wall")}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_what_loses_speed_at_walls_and_bodies_has_one_list_and_it_is_that_of_the_rules(seed):
    scene = drawn(seed, responses=LOSSY, settings=kt.Settings(until=4.0))
    sim = assert_one_answer(scene)
    assert (sim.contacts["b"] < 0).sum() >= 5
    assert by_the_rules.answer_of_game(scene, 1000) == by_the_rules.rows(sim)


@pytest.mark.parametrize("seed", lanes.first(1, range(3)))
def test_all_phases_have_one_list_whatever_the_margin_of_chords(seed, monkeypatch):
    scene, found = drawn(seed), set()
    assert loads_scene(dumps_scene(scene)) == scene
    usual = reach.margin_of
    for share in (16.0, 1.0, 1.0 / 32.0):
        monkeypatch.setattr(
            "kinetile.toolbox.reach.margin_of", lambda *given, share=share: share * usual(*given)
        )
        for phase in ("cells", "sap-1d"):
            sim = kt.Simulation(scene, phase, audit=20)
            sim.run(3.0)
            assert len(sim.contacts) > 5
            found.add(sim.fingerprint)
    monkeypatch.undo()
    found.add(agree(scene, "naive", "sap-2d", "sap-k", until=3.0)[0].fingerprint)
    assert len(found) == 1


def test_accelerations_by_hand_are_recorded_and_saved():
    sim = kt.Simulation(drawn(7), "cells", live=True)
    sim.run(0.5)
    sim.set_accelerations([0, 1], [[0.25, 0.25], [0.0, 0.0]])
    body = sim.insert((4.0, 4.0), (0.5, 0.25), 0.125, acceleration=(0.0, 0.5))
    assert sim.accelerations()[[0, 1, -1]].tolist() == [[0.25, 0.25], [0.0, 0.0], [0.0, 0.5]]
    sim.run(1.25)
    sim.set_acceleration(body, (0.0, -0.5))
    saved = sim.snapshot()
    sim.run(3.0)
    again = kt.Simulation(sim.recorded(), "sap-1d")
    again.run(3.0)
    sim2 = kt.Simulation(drawn(7), "naive", live=True)
    sim2.restore(saved)
    sim2.run(3.0)
    assert sim.fingerprint == again.fingerprint == sim2.fingerprint
    assert sim.readings.unaccounted_energy < 1e-13


@pytest.mark.parametrize(
    ("periodic", "outlines"), lanes.first(2, [("", SHAPES), ("x", ()), ("", ()), ("x", SHAPES)])
)
def test_what_is_cast_meets_as_what_is_inserted(outlines, periodic):
    """It falls as all do that have no acceleration of their own, or by the one that it is given."""
    rng, hits = np.random.default_rng(3), 0
    own = np.column_stack([np.zeros(4), [0.5, math.nan, -0.25, math.nan]])
    own[np.isnan(own[:, 1])] = math.nan
    scene = kt.Scene(
        [[1.0, 1.0], [4.0, 2.0], [6.5, 6.0], [3.0, 6.5]],
        rng.normal(size=(4, 2)),
        None if outlines else 0.5,
        arena=(8.0, 8.0),
        shapes=outlines,
        shape=[1, 2, 0, 1] if outlines else None,
        gravity=(0.0, -0.5),
        acceleration=own,
        periodic=periodic,
    )
    for _ in range(12):
        sim = kt.Simulation(scene, "naive", live=True)
        sim.run(0.25)
        place, speed = rng.uniform(1.0, 7.0, 2).tolist(), rng.normal(size=2).tolist()
        shape = outlines[rng.integers(3)] if outlines else None
        pull = None if rng.random() < 0.5 else (0.0, rng.uniform(-0.5, 0.5))
        hit = sim.cast((*place, 0.25 if shape is None else shape), speed, acceleration=pull)
        try:
            body = sim.insert(place, speed, None if outlines else 0.25, shape=shape, acceleration=pull)
        except NoRoom:
            continue
        answers = [sim.next_contact(other, body) for other in range(4)]
        first = min((each for each in answers if each is not None), default=None)
        hits += hit is not None
        assert (hit and (hit.epoch, hit.tick, hit.body)) == (first and (first.epoch, first.tick, first.a))
    assert hits > 2


def test_a_periodic_axis_may_be_either():
    """The same scene with its axes exchanged has the same contacts, with other walls."""
    rng = np.random.default_rng(5)
    places, speeds = 1.0 + 2.0 * np.column_stack(np.divmod(np.arange(9), 3)), rng.normal(size=(9, 2))
    own = np.column_stack([np.zeros(9), rng.choice([-0.5, 0.25, 1.0], 9)])
    lists = []
    for flip, periodic in ((slice(None), "x"), (slice(None, None, -1), "y")):
        columns = (each[:, flip] for each in (places, speeds))
        scene = kt.Scene(*columns, 0.5, arena=(6.0, 6.0), acceleration=own[:, flip], periodic=periodic)
        sim = kt.Simulation(scene, "naive")
        sim.run(3.0)
        walls = {-3: -1, -4: -2} if periodic == "x" else {}
        lists.append([(*row[:4], walls.get(row[4], row[4])) for row in sim.contacts.tolist()])
    assert lists[0] == lists[1]
    assert sum(row[4] >= 0 for row in lists[0]) > 5


@pytest.mark.parametrize("place", [1.0, 5.0])
@pytest.mark.parametrize("drift", [0.0, 0.01, -0.01])
def test_what_an_acceleration_alone_brings_together_meets_beside_a_periodic_axis(place: float, drift: float):
    """The search of images left out the only column, which straight ways reach late or never."""
    pull = np.sign(3.0 - place)
    places, speeds = [(3.0, 1.0), (place, 1.0)], [(0.0, 0.0), (drift * pull, 0.0)]
    own = [(0.0, 0.0), (pull, 0.0)]
    scene = kt.Scene(places, speeds, 0.5, arena=(6.0, 6.0), acceleration=own, periodic="y")
    sim = kt.Simulation(scene, "naive")
    sim.run(3.0, max_contacts=1)
    found = sim.contacts[0]
    assert (found["a"], found["b"]) == (0, 1)
    assert found["time"] == pytest.approx(math.sqrt(2.0 + drift * drift) - drift, abs=1e-9)


@pytest.mark.parametrize("more", [{}, {"periodic": "y"}], ids=["walls", "periodic"])
@pytest.mark.parametrize("phase", ["naive", "cells"])
def test_what_has_passed_passes_again_on_its_way_back(phase: str, more: dict):
    """The end of a passing did not compute it again, and no other event did before the bodies met."""
    places, speeds, own = [(3.0, 1.0), (1.0, 1.0)], [(0.0, 0.0), (2.5, 0.0)], [(0.0, 0.0), (-1.0, 0.0)]
    more = more | {"kind": ["ball", "ball"], "responses": {("ball", "ball"): "pass"}}
    scene = kt.Scene(places, speeds, 0.25, arena=(6.0, 6.0), acceleration=own, **more)
    outer, inner = math.sqrt(3.25), math.sqrt(1.25)
    found = contacts(scene, 4.5, phase)
    assert [each[1:] for each in found] == [(0, 1), (1, 0), (0, 1), (1, 0)]
    times = [2.5 - outer, 2.5 - inner, 2.5 + inner, 2.5 + outer]
    assert [each[0] for each in found] == pytest.approx(times)


@pytest.mark.parametrize("phase", ["naive", "cells", "sap-1d", "sap-2d"])
def test_a_contact_came_through_the_image_of_another_guess(phase: str) -> None:
    """A guess was wrong, another pair came first, and its normal was that through the image of the guess."""
    scene = kt.Scene(
        [(0.75, 2.75), (1.0, 0.75), (2.0, 1.0), (2.5, 1.5), (0.25, 0.75)],
        [(0.5, 0.0), (-1.0, -2.0), (2.0, 0.0), (0.0, -2.0), (1.0, 0.5)],
        [0.25, 0.5, 0.25, 0.375, 0.25],
        [0.5, 2.0, 0.5, 2.0, 2.0],
        arena=(3.0, 3.0),
        periodic="y",
        acceleration=[(0.0, 0.0), (-0.25, 0.0), (-2.0, 0.0), (0.0, 0.0), (0.0, 0.0)],
    )
    sim = kt.Simulation(scene, phase, audit=1)
    sim.run(0.375)
    rows = [((epoch << 52) + tick, a, b) for _, epoch, tick, a, b in sim.contacts.tolist()]
    assert len(rows) == 6
    assert rows == by_the_rules.answer(scene, 6, 1 << 60).contacts


def court(periodic: str, gravity: tuple[float, float] | None) -> kt.Scene:
    """Bodies that keep their accelerations, if they have any."""
    places, speeds = [(1.0, 1.0), (3.0, 1.5), (2.0, 3.0)], [(2.5, 1.25), (-1.5, 0.5), (0.25, -1.75)]
    return kt.Scene(places, speeds, 0.25, arena=(4.0, 4.0), periodic=periodic, gravity=gravity)


def game(scene: kt.Scene, phase: str, live: bool, recorder=None) -> kt.Simulation:
    """A game in which they do not, by its commands, in a callback too."""
    sim, made = kt.Simulation(scene, phase, live=live, audit=4), []

    def changes(event):
        made.append(event)
        if len(made) == 2:
            sim.set_acceleration(event.bodies[0], (0.0, -2.0))
        if len(made) == 4:
            sim.insert((2.0, 2.0), (0.25, 0.0), 0.125, acceleration=(0.0, 8.0))

    sim.run(2.0, on_contact=changes, recorder=recorder)
    sim.insert_many([(0.5, 0.5), (0.5, 0.5), (3.5, 3.5)], (0.0, 0.25), 0.125, acceleration=(0.0, -9.0))
    return sim


@pytest.mark.parametrize(
    ("periodic", "gravity", "live"),
    first(2, [("", None, True), ("x", None, False), ("", (0.0, -1.0), False)]),
)
def test_accelerations_by_hand_need_no_promise_of_the_scene(periodic, gravity, live, tmp_path):
    """A scene without any refused all, and one of bodies that keep theirs all others."""
    scene = court(periodic, gravity)
    first_of_all, *others = sims = [game(scene, phase, live) for phase in ("naive", "cells", "sap-2d")]
    saved = first_of_all.snapshot()
    for sim in sims:
        sim.run(3.0)
    assert len({sim.fingerprint for sim in sims}) == 1
    assert len(first_of_all.contacts) > 9
    assert first_of_all.readings.unaccounted_energy < 1e-13
    assert first_of_all.pull == (0.0, 9.0)
    agree(first_of_all.recorded(), "naive", "sap-1d")
    for sim in sims[:2]:  # to the same engine, and to another one
        sim.restore(saved)
        sim.save(tmp_path / "saved")
        resumed = kt.resume(tmp_path / "saved", "sap-1d")
        resumed.run(3.0)
        assert resumed.fingerprint == others[-1].fingerprint
        assert sim.pull == resumed.pull


def test_the_file_of_a_run_that_was_accelerated_by_hand_has_its_motion(tmp_path):
    scene, path = court("", None), tmp_path / "run.parquet"
    with kt.EventRecorder(path, scene) as recorder:
        sim = game(scene, "cells", True, recorder)
        sim.run(3.0, recorder=recorder)
    flown = kt.Trajectory.read(path)
    for name in ("positions", "velocities", "accelerations"):
        assert np.array_equal(getattr(flown, name)(3.0), getattr(sim, name)())
    assert view_file(path).page.held["pull"]  # else a page has no accelerations
    assert "flying with accelerations up to [0.0, 9.0]" in sim.explain()["modelled"][0]
    with pytest.raises(PhaseError, match="accelerated by hand, and pressure by counts is of bodies that fly"):
        sim.run(3.5, observe=["pressure"])


def test_in_the_open_plane_a_first_acceleration_by_hand_sets_an_end_to_runs_and_steps():
    scene = kt.Scene(
        [(0.0, 0.0), (5.0, 0.0)], [(0.0, 0.0), (-1.0, 0.0)], 0.5, settings=kt.Settings(until=6.0)
    )
    sim = kt.Simulation(scene, "naive")
    with pytest.raises(ValueError, match=r"the scene's end, 6.0, and this run goes to 60.0"):
        sim.run(60.0, on_contact=lambda event: sim.set_acceleration(0, (1.0, 0.0)))
    steps = kt.Simulation(scene, "naive")
    with pytest.raises(ValueError, match=r"until=60.0 is after the scene's end, 6.0"):
        [steps.set_acceleration(event.bodies[0], (1.0, 0.0)) for event in steps.steps(60.0)]
    for each in (sim, steps):
        each.run()
        agree(each.recorded(), "naive", "cells")


def test_a_planned_acceleration_of_nothing_ended_the_run():
    stays = [kt.Accelerate(0, 0.5, (0.0, 0.0))]
    scene = kt.Scene(
        [(1.0, 1.0), (3.0, 1.0)], [(1.0, 0.0), (0.0, 0.0)], 0.5, arena=(4.0, 2.0), commands=stays
    )
    assert contacts(scene, 1.25) == [(1.0, 0, 1)]
