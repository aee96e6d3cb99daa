"""``prepare`` can use the reaches at the start, with walls and without."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

import kinetile as kt
from kinetile.run.compose import compose_phases
from kinetile.run.engine.engine import Engine
from kinetile.toolbox import Kernel, hook, reach_of, reach_to, reaches_of
from kinetile.toolbox.reach import skin_at_start
from kinetile_conformance.strategies import scenes


def engine_of(scene: kt.Scene, **more) -> Engine:
    return Engine(scene, compose_phases(scene, "naive", more.get("narrow_phases"), {}), keep_contacts=False)


def without_walls(scene: kt.Scene) -> kt.Scene:
    return kt.Scene(
        scene.position, scene.velocity, scene.radius, scene.mass, turns=scene.turns, start=scene.start
    )


def assert_known(scene: kt.Scene) -> None:
    reach = engine_of(scene).k.bodies.reach
    assert reach_of(scene).tobytes() == np.asarray(reach).tobytes()


RECIPES = [
    pytest.param(name, marks=[pytest.mark.slow] if name == "grown" else [])  # a run makes it
    for name in kt.registry().names("scene")
    if name != "frame"
]


@pytest.mark.parametrize("name", RECIPES)
def test_it_is_that_of_the_tables_for_every_recipe(name):
    scene = kt.make_scene(name)
    assert_known(scene)
    assert_known(without_walls(scene))


@pytest.mark.small
@settings(max_examples=30, deadline=None, database=None)
@given(scenes())
def test_it_is_that_of_the_tables_for_drawn_scenes(scene):
    assert_known(scene)
    assert_known(without_walls(scene))


def test_where_walls_are_left_out_bodies_reach_further_and_arrange_sees_it():
    scene = kt.make_scene("two-discs")
    engine = engine_of(without_walls(scene))
    skin = skin_at_start(scene, walls=False).delta
    assert (engine.k.bodies.reach == scene.radius + skin).all()
    assert (engine.k.bodies.reach > reach_of(scene)).all()


def test_arrange_is_called_again_when_reaches_have_grown():
    scene = kt.make_scene("grid", bodies=9, density=0.3)
    seen = []
    composition = compose_phases(scene, "naive", None, {})
    broad = replace(composition.broad, arrange=lambda k, s: seen.append(k.bodies.reach.max()))
    engine = Engine(scene, replace(composition, broad=broad), keep_contacts=False)
    engine.lay_out(1e6 * engine.speed)
    assert seen[0] == reach_of(scene).max() < seen[1] == engine.k.bodies.reach.max()


@hook
def four(k: Kernel, body: int) -> tuple[float, float, float, float]:
    plan = k.bodies[body]
    skin = k.clock[0].limits.skin
    return reach_to(plan, 0, skin), reach_to(plan, 1, skin), reach_to(plan, 2, skin), reach_to(plan, 3, skin)


def test_a_body_reaches_to_each_side_as_far_as_its_shape_does():
    shape = kt.Shape(((-1.0, -0.5), (2.0, -0.5), (2.0, 0.25)), 0.5)
    k = engine_of(kt.Scene([(5.0, 5.0)], [(0.0, 0.0)], shape=shape)).k
    skin = float(k.clock[0].limits.skin)
    assert four(k, 0) == tuple(reaches_of(k)[0].tolist()) == (1.5 + skin, 2.5 + skin, 1.0 + skin, 0.75 + skin)
    assert k.bodies.reach[0] == shape.reach + skin


def test_a_disc_reaches_as_far_to_all_sides():
    k = engine_of(kt.make_scene("two-discs")).k
    assert four(k, 1) == tuple(reaches_of(k)[1].tolist()) == (k.bodies.reach[1],) * 4
