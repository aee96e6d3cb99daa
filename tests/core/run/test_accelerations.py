"""Bodies with accelerations of their own: known answers, margins of chords, commands."""

import math

import numpy as np
import pytest

import kinetile as kt
import lanes
from agreement import agree
from kinetile.errors import NoRoom
from kinetile.scene.files import dumps_scene, loads_scene
from kinetile.toolbox import reach

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


def drawn(seed: int, bodies: int = 12) -> kt.Scene:
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
        places, speed, radius, mass, (8.0, 8.0), gravity=gravity, acceleration=own, commands=changes
    )


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
    assert sim.readings.energy_drift < 1e-13


@pytest.mark.parametrize("periodic", ["", "x"])
def test_what_is_cast_meets_as_what_is_inserted(periodic):
    """It falls as all do that have no acceleration of their own."""
    rng, hits = np.random.default_rng(3), 0
    own = np.column_stack([np.zeros(4), [0.5, math.nan, -0.25, math.nan]])
    own[np.isnan(own[:, 1])] = math.nan
    scene = kt.Scene(
        [[1.0, 1.0], [4.0, 2.0], [6.5, 6.0], [3.0, 6.5]],
        rng.normal(size=(4, 2)),
        0.5,
        arena=(8.0, 8.0),
        gravity=(0.0, -0.5),
        acceleration=own,
        periodic=periodic,
    )
    for _ in range(12):
        sim = kt.Simulation(scene, "naive", live=True)
        sim.run(0.25)
        place, speed = rng.uniform(1.0, 7.0, 2).tolist(), rng.normal(size=2).tolist()
        hit = sim.cast((*place, 0.25), speed)
        try:
            body = sim.insert(place, speed, 0.25)
        except NoRoom:
            continue
        answers = [sim.next_contact(other, body) for other in range(4)]
        first = min((each for each in answers if each is not None), default=None)
        hits += hit is not None
        assert (hit and (hit.epoch, hit.tick, hit.body)) == (first and (first.epoch, first.tick, first.a))
    assert hits > 3
    with pytest.raises(ValueError, match="what is cast is a disc"):
        sim.cast((4.0, 4.0, kt.box(0.5, 0.5)), (1.0, 0.0))


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
    """The end of a passing did not ask again, and no other event did before the bodies met."""
    places, speeds, own = [(3.0, 1.0), (1.0, 1.0)], [(0.0, 0.0), (2.5, 0.0)], [(0.0, 0.0), (-1.0, 0.0)]
    more = more | {"kind": ["ball", "ball"], "responses": {("ball", "ball"): "pass"}}
    scene = kt.Scene(places, speeds, 0.25, arena=(6.0, 6.0), acceleration=own, **more)
    outer, inner = math.sqrt(3.25), math.sqrt(1.25)
    found = contacts(scene, 4.5, phase)
    assert [each[1:] for each in found] == [(0, 1), (1, 0), (0, 1), (1, 0)]
    times = [2.5 - outer, 2.5 - inner, 2.5 + inner, 2.5 + outer]
    assert [each[0] for each in found] == pytest.approx(times)
