"""Periodic scenes: the answer of the rules under every phase, and what follows from symmetry."""

from collections.abc import Iterator

import numpy as np
import pytest

import box_scenes
import by_the_rules
import convex_scenes
import kinetile as kt
import torus_scenes
from agreement import choices
from by_the_rules import rows
from kinetile.errors import Refused, SceneError, ZenoError
from lanes import GENERAL, first


def every(scene: kt.Scene, **more) -> Iterator[kt.Simulation]:
    for phase, options in choices(scene):
        yield kt.Simulation(scene, phase, options=options, **more)


def assert_rules(scene: kt.Scene, most: int, units: int, plans=lambda contacts: False) -> int:
    """Asserts that every phase has the contacts of the rules, and their plans at the end where ``plans`` of
    their number; returns that number. Shapes may jam."""
    wanted, expected = by_the_rules.answer(scene, most, units << 52)
    for sim in every(scene, audit=1):
        try:
            sim.run(until=units * scene.time_unit, max_contacts=most or None)
        except ZenoError:
            assert scene.shapes
            assert rows(sim) == wanted[: len(sim.contacts)]
            continue
        assert rows(sim)[: most or None] == wanted
        if plans(len(wanted)):
            assert [(at.x, at.y) for at in sim.tables.bodies] == [(plan.x, plan.y) for plan in expected]
            assert [(at.kx, at.ky) for at in sim.tables.images] == [plan.turns for plan in expected]
    return len(wanted)


@pytest.mark.parametrize("seed", first(2, range(60)))
def test_the_answer_is_that_of_the_rules(seed):
    units = (3, 10, 30)[seed % 3]
    assert_rules(torus_scenes.drawn(seed), 20, units, lambda contacts: contacts == 20 and units > 3)


def box(position, velocity, radius, periodic="xy", arena=(1.0, 1.0)) -> kt.Scene:
    return kt.Scene(position, velocity, radius, arena=arena, periodic=periodic)


HARD = {
    "alone": (0, box([[0.9, 0.5]], [[30.0, 1.0]], 1 / 2.1)),
    "two images at one tick": (5, box([[0.5, 0.5], [0.0, 0.1]], [[0, 0], [0, 1.0]], [0.4, 0.2])),
    "no wider than a body": (9, box([[0.5, 0.5], [0, 0]], [[1.0, 0.5], [-3.0, 1.0]], [1 / 2.1, 0.01])),
    "a reach of more than half the box": (
        5,
        box([[0.3, 0.6], [0.3, 1.7]], [[1, 0], [0.25, -1]], [0.5 - 2**-54, 0.05], arena=(1.0, 3.0)),
    ),
    "fifty boxes": (5, box([[0.1, 0.2], [0.6, 0.7], [0.3, 0.9]], [[50, 3], [-41, 9], [0.1, 0]], 0.1)),
    "other periods": (5, box([[0.1, 0.2], [2.6, 0.1]], [[1, 2], [-4, 9]], 0.06, arena=(4.0, 0.25))),
}


@pytest.mark.parametrize("name", HARD)
def test_hard_scenes_have_the_answer_of_the_rules(name):
    contacts, scene = HARD[name]
    assert assert_rules(scene, contacts, 20) == contacts


def with_shapes(seed: int, bodies: tuple[int, ...] = (6, 8, 10)) -> kt.Scene:
    return (convex_scenes if seed % 2 else box_scenes).drawn(seed, bodies, ("x", "y", "xy", "xy"))


@pytest.mark.parametrize("seed", first(1, range(60)))
def test_shapes_have_the_answer_of_the_rules(seed):
    """Among them contacts at one tick, and wrapped places at the end."""
    units = (3, 10, 30)[seed % 3]
    assert_rules(with_shapes(seed), 40, units, lambda contacts: contacts < 40 and units == 3)


def test_shapes_along_an_axis_that_is_not_periodic_may_be_wider_than_half_of_it():
    floor = kt.segment((-2.0, 0.0), (2.0, 0.0))
    one = {"position": [(2.0, 0.5)], "velocity": [(0, 0)], "shape": 0, "arena": (4.0, 3.0), "mass": np.inf}
    whole = kt.Scene(shapes=[floor], periodic="", **one)
    assert whole.replace(periodic="y", arena=(4.0, 8.5)).shapes == (floor,)
    pieces = kt.polyline([(0.0, 0.5), (1.0, 0.5), (2.0, 0.5), (3.0, 0.5), (4.0, 0.5)])
    ball = kt.Scene([(0.25, 2.0)], [(1.0, -1.0)], 0.25, arena=(4.0, 3.0), periodic="xy")
    sim = kt.Simulation(kt.with_obstacles(ball, pieces), "naive")
    sim.run(max_contacts=6)
    assert (sim.contacts["b"] > 0).all()


@pytest.mark.parametrize(("apart", "overlap"), [((0.75, 0.0), False), ((0.6875, 0.0), True)])
def test_shapes_overlap_at_the_start_through_images(apart, overlap):
    """Through a border and its corner, and some periods away; touching is no overlap."""
    place = np.array([(0.25, 0.125), (-apart[0] + 0.25 + 12.0, 0.125 - 8.0)])
    frame = {"shape": 0, "shapes": [kt.box(0.75, 0.25)], "arena": (4.0, 4.0), "periodic": "xy"}
    if overlap:
        with pytest.raises(SceneError, match=r"bodies\[0\] and bodies\[1\]: found an overlap"):
            kt.Scene(place, np.zeros((2, 2)), **frame)
    else:
        assert len(kt.Scene(place, np.zeros((2, 2)), **frame)) == 2


@pytest.mark.parametrize("seed", first(1, range(150)))
def test_passings_are_those_of_the_rules(seed):
    """A pair passes through an image, through several at a time, and meets through others meanwhile."""
    assert_rules(torus_scenes.with_passing(torus_scenes.drawn(seed, (2, 3, 4)), seed), 30, 20)


def test_two_that_pass_through_two_images_at_once():
    """They overlap through the images -1 and 0, and 0 and 1 once the second is written a period away."""
    for away in (0.0, -1.0):
        kinds = {"kind": ["wisp"] * 2, "responses": {("wisp", "wisp"): "pass"}, "unit": 1.0}
        places = [(0.0, 0.0), (0.5 + away, 0.0)]
        scene = kt.Scene(places, [(0, 1), (0, -1)], 0.3, arena=(1, 4), periodic="xy", **kinds)
        assert assert_rules(scene, 6, 8) == 6


@pytest.mark.parametrize("seed", first(1, range(30)))
def test_bodies_that_pass_come_and_go(seed):
    """And are saved and restored while they pass."""
    rng = np.random.default_rng(seed)
    scene = torus_scenes.with_passing(torus_scenes.drawn(seed, (2, 3, 5)), seed)
    unit, edge = scene.time_unit, 0.0 if scene.periodic == "xy" else 0.25
    coming = [
        kt.Insert(
            (0.5 + at) * unit,
            rng.uniform(edge, 1 - edge, 2) * scene.arena,
            scene.velocity[0],
            0.24 * min(scene.arena),
            kind="wisp",
        )
        for at in range(3)
    ]
    scene = scene.replace(commands=[*coming, kt.Remove(0, 2.25 * unit)])
    found = set()
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase, live=True, audit=1 if seed % 8 == 0 else None)
        try:
            sim.run(until=2.0 * unit, max_contacts=40)
            again = kt.Simulation(scene, phase, live=True)
            again.restore(sim.snapshot())
            for each in (sim, again):
                each.run(until=5.0 * unit, max_contacts=80)
            assert again.fingerprint == sim.fingerprint
            played = kt.Simulation(sim.recorded(), "naive", live=True)
            played.run()
            assert played.fingerprint == sim.fingerprint
        except Refused as error:
            found.add(str(error))
        found.add((sim.fingerprint, sim.time))
    assert len(found) - any(isinstance(each, str) for each in found) == 1


def test_a_body_written_some_periods_away_is_the_same_body():
    rng = np.random.default_rng(1)
    places = [(i / 4 + 1 / 8, j / 4 + 1 / 8) for i in range(4) for j in range(4)]
    scene = kt.Scene(places, rng.normal(size=(16, 2)), 1 / 16, arena=(1, 1), periodic="xy")
    far = scene.replace(position=scene.position + [(i % 3, -2.0 * (i % 2)) for i in range(16)])
    one, two = kt.Simulation(scene, "cells"), kt.Simulation(far, "cells")
    one.run(until=1.0)
    two.run(until=1.0)
    assert rows(one) == rows(two)
    assert (one.positions() == two.positions()).all()
    assert np.allclose(two.unwrapped() - one.unwrapped(), far.position - scene.position, atol=1e-12)


@pytest.mark.slow
@pytest.mark.compiled
def test_a_long_thin_torus_cost_an_event_for_each_round_of_its_short_axis():
    """Each of up to three rows is near all: crossing them, ten thousand times a contact, was an event."""
    n, length = 8, 1e5
    places = np.column_stack([(np.arange(n) + 0.5) * length / n, np.full(n, 0.5)])
    velocities = 3e4 * np.random.default_rng(2).normal(size=(n, 2))
    scene = kt.Scene(places, velocities, 0.1, arena=(length, 1.0), periodic="xy")
    sims = [kt.Simulation(scene, phase) for phase in ("naive", "cells")]
    for sim in sims:
        sim.run(max_contacts=100)
        sim.audit()
    assert sims[0].fingerprint == sims[1].fingerprint
    assert sims[1].readings.structural_events < 5 * 100
