"""Scenes with gravity: known answers, one answer under all phases, refusals."""

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest

import kinetile as kt
import lanes
from agreement import assert_one_answer
from inside import engine_of
from kinetile.errors import Refused
from kinetile.scene.files import dumps_scene, loads_scene
from kinetile.toolbox import WallParts, hook
from kinetile_accuracy.specification.arithmetic import unit_bits
from registering import registered

BALL = kt.Scene([[0.5, 0.75]], [[0.0, 0.0]], 0.25, arena=(1.0, 2.0), gravity=(0.0, -1.0))
"""At rest, .5 above the floor."""


ROOM = {"position": [[0.5, 0.5]], "velocity": [[0.0, 1.0]], "radius": 0.25, "arena": (1.0, 1.0)}


def falling(seed: int, bodies: int = 9) -> kt.Scene:
    rng = np.random.default_rng(seed)
    side = math.isqrt(bodies - 1) + 2
    cells = rng.permutation(side * side)[:bodies]
    place = np.column_stack(np.divmod(cells, side)) + 0.5
    velocity = rng.integers(-2, 3, (bodies, 2)) / 2.0
    if seed % 2:
        place, velocity = place + rng.uniform(-0.1, 0.1, place.shape), rng.normal(size=place.shape)
    velocity[:, 1] = np.where(velocity[:, 1] == 0.0, 0.25, velocity[:, 1])  # nothing rests on the floor
    gravity = [(0.0, -0.5), (0.25, -1.0), (0.0, 2.0), (-1.0, 0.0)][seed // 2 % 4]
    periodic = "x" if gravity[0] == 0.0 and seed % 3 == 0 else ""
    turns = [(int(rng.integers(1, bodies)), float(time), (0.5, 1.0)) for time in rng.integers(1, 24, 3) / 8]
    kinds = (
        {"kind": (rng.integers(0, 2, bodies) + 1).tolist(), "responses": RULES[seed % 5]} if seed % 5 else {}
    )
    spot = kt.Insert(time=1.375, position=(side - 0.25, side - 0.25), velocity=(-1.0, 0.5), radius=0.125)
    commands = [kt.Remove(0, 1.75)] if seed % 7 else [kt.Remove(0, 1.75), spot]
    return kt.Scene(
        place,
        velocity,
        0.375,
        arena=(side, side),
        gravity=gravity,
        periodic=periodic,
        turns=turns,
        commands=commands,
        **kinds,
    )


NO_ROOM = {49, 77, 105, 133, 189, 196}
"""Seeds of scenes with an insertion at the place of another body: so ends the run, under every phase."""

RULES = {
    1: {(1, 2): kt.Response("pass")},
    2: {(2, 2): kt.Response("elastic")},
    3: {("*", each): kt.Response("restitution", e=0.75, contact_time=0.01) for each in ("*", "wall")},
    4: {(1, 1): kt.Response("pass"), (2, 2): kt.Response("restitution", e=0.5, contact_time=0.01)},
}


def test_a_ball_bounces_at_times_of_the_formula():
    sim = kt.Simulation(BALL, "naive")
    sim.run(until=64.0)
    assert sim.contacts["time"].tolist() == [1.0 + 2.0 * bounce for bounce in range(32)]
    assert set(sim.contacts["b"].tolist()) == {-3}
    assert sim.positions().tolist() == [[0.5, 0.75]]
    assert sim.velocities().tolist() == [[0.0, 0.0]]
    assert sim.readings.unaccounted_energy == 0.0


@pytest.mark.parametrize("seed", lanes.first(1, range(200)))
def test_all_phases_give_one_answer(seed):
    scene = falling(seed)
    sim = assert_one_answer(scene, until=3.0, ends="NoRoom" if seed in NO_ROOM else "ran")
    assert len(sim.contacts) > 10
    if not scene.responses and not scene.commands:
        assert sim.readings.unaccounted_energy < 1e-12


def test_before_a_wall_the_contacts_are_those_without_gravity():
    """All bodies fall alike; but where they are is rounded otherwise after contacts."""
    place = [[2.0 + 1.5 * column, 24.0 + 1.25 * row] for row in range(3) for column in range(4)]
    velocity = [[(5 * i % 7 - 3) / 4.0, (3 * i % 5 - 2) / 4.0] for i in range(12)]
    plain = kt.Scene(place, velocity, 0.375, arena=(8.0, 32.0), unit=1.0)
    lists = []
    for scene in (plain, plain.replace(gravity=(0.0, -0.5))):
        sim = kt.Simulation(scene, "cells")
        sim.run(until=8.0)
        first = np.flatnonzero(sim.contacts["b"] < 0)[0]
        lists.append(sim.contacts[:first])
    both = min(map(len, lists))
    assert both >= 8
    for name in ("a", "b"):
        assert (lists[0][name][:both] == lists[1][name][:both]).all()
    assert np.abs(lists[0]["time"][:both] - lists[1]["time"][:both]).max() < 1e-12


def test_commands_by_hand_are_of_the_room():
    sim = kt.Simulation(BALL.replace(arena=(2.0, 2.0)), "cells", live=True)
    sim.run(until=1.625)
    assert sim.velocities().tolist() == [[0.0, 0.375]]
    sim.set_velocity(0, (0.5, 0.25))
    number = sim.insert((1.5, 1.5), (0.0, -0.5), 0.25)
    assert sim.velocities().tolist() == [[0.5, 0.25], [0.0, -0.5]]
    assert sim.positions()[1].tolist() == [1.5, 1.5]
    made = sim.insert_many([(0.25, 1.5), (1.5, 1.5)], (0.0, 0.5), 0.25)
    assert made.refused.tolist() == [False, True]
    assert sim.cast((1.0, 1.5, 0.125), (0.5, -0.5)).body == number
    sim.run(until=3.0)
    assert sim.readings.unaccounted_energy < 1e-14
    again = kt.Simulation(sim.recorded(), "sap-1d")
    again.run()
    assert again.fingerprint == sim.fingerprint


def test_an_empty_scene_with_gravity_had_another_unit_than_with_its_first_body():
    empty = kt.Scene([], [], [], arena=(1.0, 1.0), gravity=(0.0, -100.0))
    body = (0.5, 0.75), (0.1, 0.0), 0.1
    by_hand, planned = empty, empty.replace(commands=[kt.Insert(0.0, *body)])
    assert by_hand.time_unit == planned.time_unit == 2.0 ** -unit_bits(empty) == 0.0625
    runs = [kt.Simulation(each, "naive", live=True) for each in (by_hand, planned)]
    runs[0].insert(*body)
    for sim in runs:
        sim.run(until=1.0)
    assert runs[0].contacts.tolist() == runs[1].contacts.tolist() != []


def test_what_stops_is_at_rest_in_the_room():
    ball = {"radius": 0.25, "arena": (4.0, 8.0), "gravity": (0.0, -1.0), "responses": "stop"}
    sim = kt.Simulation(kt.Scene([[1.0, 6.0], [3.0, 6.0]], [[1.0, 0.5], [-1.0, 0.5]], **ball), "naive")
    sim.run(max_contacts=1)
    assert sim.time == 0.75
    assert sim.velocities().tolist() == [[0.0, 0.0], [0.0, 0.0]]
    assert sim.readings.unaccounted_energy < 1e-15


def test_a_trajectory_is_made_of_parabolas(tmp_path):
    pytest.importorskip("pyarrow")
    sim = kt.Simulation(falling(3), "cells")
    with kt.EventRecorder(tmp_path / "events.parquet", sim.scene) as recorder:
        sim.run(until=1.125, recorder=recorder)
        places, velocities = sim.positions(), sim.velocities()
        sim.run(until=2.5, recorder=recorder)
    path = kt.Trajectory.read(tmp_path / "events.parquet")
    assert np.abs(path.positions(1.125) - places).max() < 1e-14
    assert np.abs(path.velocities(1.125) - velocities).max() < 1e-14


def events(sim: kt.Simulation, until: float) -> list[kt.Event]:
    """All but the ends of chords, which are structural."""
    return [event for event in sim.steps(until=until) if event.kind != "structural"]


def test_what_is_foreseen_is_what_happens():
    slow = kt.Simulation(BALL.replace(gravity=(0.0, -1.0 / 64.0)), "cells")
    assert slow.next_contact_of(0)[:3] == (8.0, 8, 0)
    assert [event.time for event in events(slow, 60.0)] == [8.0, 24.0, 40.0, 56.0]
    sim = kt.Simulation(kt.make_scene("grid", bodies=4, density=0.3, seed=1, gravity=(0.0, -1.0)), "naive")
    for _ in range(20):
        answers = [sim.next_contact_of(body, scheduled=True) for body in range(4)]
        sim.run(max_contacts=1)
        assert min(each for each in answers if each is not None) == sim.contacts[-1].item()


@pytest.mark.slow
@pytest.mark.own_loop
@pytest.mark.compiled
def test_the_walls_carry_the_weight():
    """Compiled: in a column of discs the floor has N m g more than the ceiling."""
    scene = kt.make_scene("grid", bodies=100, density=0.2, seed=3, gravity=(0.0, -1.0))
    sim = kt.Simulation(scene, "cells", keep_contacts=False)
    sim.run(until=100.0, observe=["pressure", "energy:every=1"])
    found = sim.observed["pressure"]
    weight = found["P_bottom"].mean - found["P_top"].mean
    assert abs(weight - 100.0) < 5.0 * math.hypot(found["P_bottom"].error, found["P_top"].error)
    energies = sim.observed["energy:every=1"]
    assert energies["E"].mean + energies["U"].mean == pytest.approx(100.0)
    assert sim.readings.unaccounted_energy < 1e-12


def column(bodies: int, density: float, time: float, strips: int, away: float) -> tuple[Any, Any, Any, Any]:
    """Returns edges of strips of an arena of side 1 with gravity 2, from a number of radii away from the
    walls; how many discs an area are in each, (20, strips) in blocks of time; their kT (20,); their area."""
    scene = kt.make_scene("grid", bodies=bodies, density=density, seed=3, gravity=(0.0, -2.0))
    sim = kt.Simulation(scene, "cells", keep_contacts=False)
    away *= float(scene.radius[0])
    edges = np.linspace(away, 1.0 - away, strips + 1)
    found, heat = np.zeros((20, strips)), np.zeros(20)
    sim.run(until=20.0)
    for block in range(20):
        for _ in range(60):
            sim.run(until=sim.time + time / (20 * 60))
            x, y = sim.positions().T
            found[block] += np.histogram(y[(away < x) & (x < 1.0 - away)], edges)[0] / 60.0
            heat[block] += (sim.velocities() ** 2).mean() / 60.0
    return edges, found / np.diff(edges) / (1.0 - 2.0 * away), heat, math.pi * float(scene.radius[0]) ** 2


@pytest.mark.slow
@pytest.mark.own_loop
@pytest.mark.compiled
def test_a_dilute_gas_obeys_the_barometric_law():
    edges, found, heat, _ = column(900, 0.0005, 600.0, strips=8, away=1.0)
    share = (found.T / found.sum(axis=1)).T
    error = share.std(axis=0, ddof=1) / math.sqrt(20)
    below = np.exp(-2.0 * edges / heat.mean())
    wanted = np.diff(below) / (below[-1] - below[0])
    assert (error < 0.01 * wanted + 1e-4).all()
    assert (np.abs(share.mean(axis=0) - wanted) < 4.0 * error).all()


@pytest.mark.slow
@pytest.mark.own_loop
@pytest.mark.compiled
def test_the_pressure_of_a_column_carries_what_is_above():
    """dP/dy = -m g rho, between middles of strips, with the equation of state P A/(N kT) of Henderson, Mol.
    Phys. 30, 971 (1975), which is right to some 1e-3 at these densities; errors are of the jackknife."""
    edges, found, heat, area = column(900, 0.3, 300.0, strips=8, away=8.0)

    def parts(blocks: Any) -> tuple[Any, Any]:
        rho, kT = found[blocks].mean(axis=0), heat[blocks].mean()
        eta = rho * area
        pressure = rho * kT * (1.0 + eta**2 / 8.0) / (1.0 - eta) ** 2
        return -np.diff(pressure), (rho[1:] + rho[:-1]) * np.diff(edges)[1:]  # 2 rho dy: gravity is 2

    drop, weight = parts(range(20))
    rests = [np.subtract(*parts([each for each in range(20) if each != out])) for out in range(20)]
    error = np.std(rests, axis=0) * math.sqrt(19)
    whole = float(np.std(np.sum(rests, axis=1)) * math.sqrt(19))
    assert (np.abs(drop - weight) < 4.0 * error).all()
    assert whole < 0.015 * weight.sum()
    assert abs(drop.sum() - weight.sum()) < 4.0 * whole


def test_bodies_fall_in_later_spans_of_the_clock_and_come_into_an_empty_room():
    coming = kt.Insert(time=1500.0, position=(0.5, 1.0), velocity=(0.0, 0.25), radius=0.25)
    scene = BALL.replace(commands=[kt.Remove(0, 3.5), coming, kt.Turn(1, 1500.5, (0.0, 1.0))])
    sim = kt.Simulation(scene, "cells")
    kinds = [event.kind for event in events(sim, 1505.0)]
    assert kinds == ["wall", "wall", "remove", "insert", "turn", "wall"]
    assert sim.contacts["time"][-1] == pytest.approx(1501.5 + math.sqrt(2.5))  # .75 high, and up for 1
    sim.remove(1)
    assert sim.step() is None
    assert sim.time == 1505.0
    sim.insert((0.5, 1.0), (0.0, 0.0), 0.25)
    assert events(sim, 1507.0)[0].time == pytest.approx(1505.0 + math.sqrt(1.5))


@hook
def anything(k, body):
    raise NotImplementedError


@hook
def any_answer(k, body, wall):
    raise NotImplementedError


@pytest.mark.parametrize(
    ("narrow", "why"),
    [(("disc",), "of disc none is for walls"), (("disc", "elsewhere"), "does not support accelerations")],
)
def test_walls_that_do_not_know_falling_bodies_are_refused(narrow, why):
    class Elsewhere:
        def prepare(self, scene):
            return WallParts(anything, any_answer)

    spec = kt.NarrowPhaseSpec("elsewhere", Elsewhere, role="wall")
    with registered(spec), pytest.raises(Refused, match=why):
        kt.Simulation(BALL, narrow_phases=narrow)


def test_what_just_falls_is_taken():
    kt.Scene(**ROOM, gravity=(0.0, 2.0**-200))
    kt.Scene(**ROOM | {"position": [[0.5, 0.25]]}, gravity=(0.0, -1.0))  # at the wall, and it moves
    resting = ROOM | {"velocity": [[0.0, 0.0]]}
    assert kt.Scene(**resting, gravity=(0.0, -3.0)).time_unit == 0.25  # of the speed after a fall: 6 ** 0.5


def test_no_gravity_is_none():
    plain = kt.Scene(**ROOM)
    for gravity in ((0.0, 0.0), [0, -0.0], None):
        scene = kt.Scene(**ROOM, gravity=gravity)
        assert scene == plain
        assert repr(scene.gravity) == "(0.0, 0.0)"
        assert not scene.accelerated
        assert engine_of(kt.Simulation(scene)).loop is engine_of(kt.Simulation(plain)).loop


def test_files_and_recipes_have_gravity():
    assert loads_scene(dumps_scene(BALL)) == BALL
    made = kt.make_scene("grid", bodies=4, gravity=(0.0, -2.0))
    assert made.gravity == (0.0, -2.0)
    assert copy.deepcopy(made) == pickle.loads(pickle.dumps(made)) == made
    assert made != kt.make_scene("grid", bodies=4)
