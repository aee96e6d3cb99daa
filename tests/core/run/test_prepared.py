"""Prepared scenes: the values that a run computes of a scene for its phases stay a value of the run."""

import math

import kinetile as kt
from kinetile.run.engine.state import contents_at_start
from kinetile.run.prepared import LEAST_SLOTS, Prepared, present_scene
from kinetile.scene import are_alike

SCENE = kt.Scene([(1, 1), (3, 1)], [(600, 0), (0, 0)], 0.25, mass=[1.0, math.inf], arena=(4, 4))


def test_the_room_of_a_run_was_a_hidden_attribute_of_its_scene() -> None:
    room = Prepared.of(SCENE)
    assert (SCENE.capacity, room.capacity, Prepared.of(SCENE, 5).capacity) == (2, LEAST_SLOTS, 5)
    assert room == SCENE
    assert vars(room).keys() - vars(SCENE).keys() == {"capacity", "_ruled", "movable_shapes"}
    other = room.replace(start=1.0)
    assert type(other) is kt.Scene
    assert other.capacity == 2
    alike = kt.make_scene("grid", bodies=4)
    assert are_alike(alike)
    assert not are_alike(Prepared.of(alike)), "a body of another size may come"


def test_in_the_middle_of_a_run_a_scene_keeps_its_clock_and_its_rules() -> None:
    contents = contents_at_start(SCENE)
    contents = contents._replace(plans=contents.plans[:1])
    left = present_scene(contents.plans, contents.clock["now"], SCENE, 3)
    assert not kt.Scene([(1, 1)], [(600, 0)], 0.25, arena=(4, 4))._ruled, "the immovable body has gone"
    assert left._ruled
    assert (len(left), left.capacity) == (1, 3)
    assert left.time_unit == SCENE.time_unit < 1.0
    assert left.commands == ()
    assert present_scene(contents.plans, contents.clock["now"], left, 3)._ruled
