"""Questions as users have them, and the command that measures what each costs."""

import importlib.util
import math
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from kinetile.kernel.flight import positions_now


def asked() -> kt.Simulation:
    return kt.Simulation(kt.make_scene("grid", bodies=16, density=0.5, seed=4), "sap-1d")


def ask_all(sim: kt.Simulation) -> list:
    return [
        sim.next_contact(0, 1),
        sim.next_contact_of(2),
        sim.next_contact_of(2, scheduled=True),
        sim.cast((0.5, 0.5, 0.01), (1.0, 0.0)),
        sim.bodies_in((0.0, 0.0, 0.5, 0.5)).tolist(),
        sim.bodies_in((0.0, 0.0, 0.5, 0.5), whole=True).tolist(),
        sim.bodies_near((0.5, 0.5), radius=0.2).tolist(),
        sim.bodies_near((0.5, 0.5), k=3).tolist(),
        sim.ray((0.5, 0.5), (0.6, 0.8)),
    ]


def test_asking_changes_nothing():
    sim, other = asked(), asked()
    ask_all(sim)  # before anything is built
    for time in (0.05, 0.15):
        sim.run(until=time)
        before = [table.tobytes() for table in (*sim.tables, *sim.state)]
        first = ask_all(sim)
        assert ask_all(sim) == first
        assert [table.tobytes() for table in (*sim.tables, *sim.state)] == before
    other.run(until=0.15)
    assert sim.fingerprint == other.fingerprint


def test_places_are_those_that_the_simulation_shows():
    sim = asked()
    sim.run(until=0.15)
    some = np.array([3, 0, 7])
    k = sim.tables
    assert positions_now(k, some).tobytes() == sim.positions()[some].tobytes()
    assert (sim._query().places == sim.positions()).all()
    for body, (x, y) in enumerate(sim.positions().tolist()):
        assert body in sim.bodies_in((x, y, x, y)).tolist()
        assert sim.ray((x, y), (1.0, 0.0), most=1)[0].distance == 0.0


def test_a_simulation_without_bodies_has_answers():
    sim = kt.Simulation(kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 1.0), "naive")
    sim.run(until=1e6)
    assert sim.bodies_in((0.0, 0.0, 1.0, 1.0)).tolist() == []
    assert sim.bodies_near((0.0, 0.0), radius=1.0, k=3).tolist() == []
    assert sim.ray((0.0, 0.0), (1.0, 0.0), most=2) == []
    assert sim.cast((0.0, 0.0, 1.0), (1.0, 0.0)) is None


def test_numbers_may_come_from_arrays():
    sim = asked()
    one = np.float64(0.5)
    assert sim.bodies_in(np.array([0.0, 0.0, 0.5, 0.5])).tolist() == sim.bodies_in((0, 0, one, one)).tolist()
    assert sim.ray(np.array([0.5, 0.5]), np.array([3, 4])) == sim.ray((0.5, 0.5), (3.0, 4.0))
    assert sim.bodies_near([one, one], k=np.int64(2)).tolist() == sim.bodies_near((0.5, 0.5), k=2).tolist()


def test_what_is_cast_is_said_to_have_flown_so_far():
    sim = kt.Simulation(kt.Scene([(4.0, 0.0), (0.0, -8.0)], [(0.0, 0.0), (0.0, 0.0)], 1.0), "naive")
    assert sim.cast((0.0, 0.0, 1.0), (0.5, 0.0)) == (4.0, 4, 0, 0, 2.0)
    assert sim.cast((0.0, 0.0, 1.0), (0.0, -1.0), acceleration=(0.0, -1.0)).distance == 6.0
    room = kt.Simulation(kt.Scene([(7.0, 7.0)], [(0.0, 0.0)], 0.5, arena=(8.0, 8.0)), "naive")
    box = (2.0, 1.0, kt.box(2.0, 1.0))
    assert room.cast(box, (-0.5, 0.0), kinds="wall") == (2.0, 2, 0, -1, 1.0)
    assert room.cast(box, (0.0, 2.0), acceleration=(0.0, -1.0), kinds="wall").body == -3
    assert room.cast(box, (-0.5, 0.0)) is None


def test_the_distance_is_that_of_outlines():
    box = kt.box(2.0, 2.0)
    assert kt.distance((0.0, 0.0, 1.0), (3.0, 4.0, 0.5)) == 3.5
    assert kt.distance((0.0, 0.0, box), [4.0, 5.0, 0.0]) == 5.0
    assert kt.distance((1.0, 1.0, box), (3.0, 1.0, box)) == 0.0
    assert kt.distance((1.0, 1.0, box), (2.5, 1.0, box)) == -0.5


def test_who_is_in_a_polygon():
    triangle = kt.polygon([(0.0, 0.0), (4.0, 0.0), (0.0, 4.0)])
    spots = [(1.0, 1.0), (4.5, 3.5), (2.5, 2.5), (7.5, 1.0)]
    bodies = kt.Scene(spots, np.zeros((4, 2)), [1.0, 1.0, 0.75, 0.5], arena=(8.0, 8.0), periodic="x")
    sim = kt.Simulation(bodies, "naive")
    assert sim.bodies_in(triangle).tolist() == [0, 2, 3], "the last through its image at -0.5"
    assert sim.bodies_in(triangle, whole=True).tolist() == [0]
    assert sim.bodies_in((4.0, 0.0, triangle)).tolist() == [1, 3]
    assert sim.bodies_in((1.0, 1.0, 1.0), whole=True).tolist() == [0]
    for radius in (0.5, 1.5, 2.0):  # bodies near a point are those in a disc
        near = sim.bodies_near((2.0, 1.0), radius=radius)
        assert sim.bodies_in((2.0, 1.0, radius)).tolist() == sorted(near.tolist())


def test_who_is_passing_whom():
    scene = kt.Scene([(3.0, 0.0), (0.0, 0.0), (9.0, 0.0)], [(0.0, 0.0), (1.0, 0.0), (0.0, 0.0)], 0.5)
    sim = kt.Simulation(scene.replace(responses="pass"), "naive")
    pairs = []
    for time in (1.0, 2.5, 4.5, 8.5):
        sim.run(time)
        pairs.append(sim.passings.tolist())
    assert pairs == [[], [[0, 1]], [], [[1, 2]]]
    spots = [(9.0, 0.0), (0.3, 0.0), (0.0, 0.0), (1.0, 0.9)]  # the last is near and does not overlap
    scene = kt.Scene(spots, [(1.0, 0.0)] * 4, 0.5, responses="pass")
    begun, waiting = (kt.Simulation(scene, "naive") for _ in range(2))
    begun.run(until=0.0)
    assert begun.passings.tolist() == waiting.passings.tolist() == [[1, 2]]


COMMAND = Path(__file__).parents[4] / "docs" / "examples" / "time_questions.py"


def test_the_table_has_a_row_for_each_question(capsys, monkeypatch):
    spec = importlib.util.spec_from_file_location("time_questions", COMMAND)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "TIMES", 2)
    module.main([9, 16], lambda scene: kt.Simulation(scene, "naive"))
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split()[-2:] == ["9", "16"]
    assert len(rows) == 9
    assert all(float(number) > 0.0 for row in rows for number in row.split()[-2:])


@pytest.mark.parametrize("periodic", ["", "xy"])
def test_inside_a_shelf_a_cast_was_free_and_a_ray_met_it_at_once(periodic):
    """By ``exclude`` both go on from there, and a body from its own place."""
    places, flies, shapes = [(2, 2), (6, 2), (7, 6)], [(0, 0), (0, 0), (1, 0)], [kt.box(2, 1), kt.disc(0.25)]
    scene = kt.Scene(places, flies, mass=[math.inf, 1, 1], shapes=shapes, shape=[0, 1, 1], arena=(8, 8))
    sim = kt.Simulation(scene.replace(periodic=periodic), "naive")
    for way in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        for size in (0.0, 0.125, kt.box(0.25, 0.25)):
            assert sim.cast((2.25, 2.125, size), way) == (0.0, 0, 0, 0, 0.0)
        assert sim.ray((2.25, 2.125), way, within=7.0)[0] == (0, 0.0)
    assert sim.cast((2.25, 2.0, 0.0), (1, 0), exclude=0) == (3.5, 3, 1 << 51, 1, 3.5)
    assert sim.ray((2.25, 2.0), (1, 0), exclude=[0, 2], within=4.0) == [(1, 3.5)]
    assert sim.cast((2.0, 2.5, 0.0), (0, 1), exclude=[2]) is None or periodic
    own = sim.cast((6.0, 2.0, 0.25), (-1, 0), exclude=1)
    assert own == (2.75, 2, 3 << 50, 0, 2.75)
    with pytest.raises(IndexError, match="there is no body 5"):
        sim.ray((0.0, 0.0), (1, 0), exclude=[0, 5], within=1.0)
