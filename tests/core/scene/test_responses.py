"""Kinds and responses of a scene: accepted ones, refused ones, and files."""

import math
import pickle
import subprocess
import sys

import pytest

import kinetile as kt
from kinetile.errors import Refused, SceneError
from kinetile.scene.files import dumps_scene, loads_scene
from registering import registered

BALLS = {"position": [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]], "velocity": [[0.0, 0.0]] * 3, "radius": 0.5}


def scene(**more) -> kt.Scene:
    return kt.Scene(**{**BALLS, "arena": (4.0, 4.0), **more})


def names(of: kt.Scene) -> list[list[str]]:
    return [[response.name for response in row] for row in of.meets]


def test_without_rules_all_is_elastic():
    assert names(scene()) == [["elastic", "elastic"]]
    assert not scene()._ruled


def test_the_most_specific_rule_counts():
    rules = {("*", "*"): "stop", ("a", "*"): "pass", ("a", "b"): "elastic", ("b", "wall"): "stop"}
    found = scene(kind=["a", "b", "c"], responses=rules)
    assert found.kinds == ("a", "b", "c")
    assert names(found) == [
        ["pass", "elastic", "pass", "elastic"],
        ["elastic", "stop", "stop", "stop"],
        ["pass", "stop", "stop", "elastic"],
    ]


FIXED = {"mass": [math.inf, math.inf, 1.0], "kind": ["post", "paddle", "ball"]}
BOXES = {"radius": None, "shape": 0, "shapes": [kt.box(0.5, 0.5)], **FIXED}
COMES = kt.Insert(1.0, (3.0, 3.0), (0.0, 0.0), shape=0, kind="paddle")


@pytest.mark.parametrize("pair", [("post", "paddle"), ("paddle", "paddle")])
@pytest.mark.parametrize("name", ["stop", "pass"])
def test_a_rule_for_immovable_bodies_alone_among_shapes_is_refused(pair, name):
    """It was accepted and did nothing: they never meet (rule 7s)."""
    wanted = f"found '{name}', for immovable bodies alone; expected no rule: two immovable bodies never meet"
    with pytest.raises(SceneError, match=wanted):
        scene(**BOXES, commands=[COMES._replace(mass=math.inf)], responses={pair: name})


@pytest.mark.small
def test_a_rule_that_some_bodies_can_have_is_accepted():
    rule = {("post", "paddle"): "stop"}
    for commands in ([COMES], [kt.SetKind(2, 1.0, "paddle")]):
        assert scene(**BOXES, commands=commands, responses=rule).responses
    assert scene(**FIXED, responses=rule).responses  # discs meet
    assert scene(**BOXES, responses={("paddle", "*"): "stop", ("paddle", "wall"): "stop"}).responses
    by_hand = {"kinds": ["post", "paddle", "ball", "later"], "responses": {("paddle", "later"): "stop"}}
    sim = kt.Simulation(scene(**BOXES, **by_hand), "cells", live=True)
    sim.insert((3.0, 3.0), shape=0, mass=math.inf, kind="later")
    assert loads_scene(dumps_scene(sim.recorded())).responses


@pytest.mark.parametrize(("name", "walls"), [("stop", "stop"), ("elastic", "elastic"), ("pass", "elastic")])
def test_one_response_for_a_scene_left_its_walls_elastic(name, walls):
    """A rule for every two kinds is still for bodies alone; a written scene is read as the same scene."""
    body, of_two = "[[bodies]]\nposition = [1.0, 1.0]\nradius = 0.5\n", [[name, name, walls]] * 2
    for beside in ('recipe = "grid"\n', f"arena = [4.0, 4.0]\n{body}"):
        one = loads_scene(f'{beside}[[responses]]\nresponse = "{name}"\n')
        assert names(one) == [[name, walls]]
        fenced = loads_scene(f"{dumps_scene(one)}[[obstacles]]\npoints = [[0, 0], [0.1, 0]]")
        assert names(fenced) == of_two
        rule = f'[[responses]]\nbetween = ["*", "*"]\nresponse = "{name}"\n'
        assert names(loads_scene(beside + rule)) == [[name, "elastic"]]
    for made in (scene(responses=name), scene().replace(responses=kt.Response(name)), one):
        assert made.responses == tuple(kt.Response(name).for_all.items())
        assert loads_scene(dumps_scene(made)) == pickle.loads(pickle.dumps(made)) == made
    assert names(kt.with_obstacles(scene(responses=name), kt.polyline([(0, 0), (0.1, 0)]))) == of_two
    assert names(scene(responses={("*", "*"): name})) == [[name, "elastic"]]


@pytest.mark.small
def test_what_settles_by_the_one_response_of_its_scene_rests_on_the_floor():
    land = kt.Response("restitution", e=0.5, contact_time=1e-6, settle=0.05)
    box = kt.Scene([(2, 1)], [(0, 0)], shape=kt.box(1, 1), arena=(4, 4), gravity=(0, -1), responses=land)
    sim = kt.Simulation(box, "naive")
    sim.run(until=20.0)
    assert sim.supports() == [(-3,)]


@pytest.mark.small
def test_kinds_that_are_declared_may_come_by_hand():
    world = scene(kinds=["ball", "bullet"], responses={("ball", "bullet"): "pass"})
    assert (world.kind, world.kinds) == (("ball",) * 3, ("ball", "bullet"))
    assert loads_scene(dumps_scene(world)) == pickle.loads(pickle.dumps(world)) == world
    assert world != scene(kind="ball")
    sim = kt.Simulation(world, "naive", live=True)
    assert sim.insert((1.25, 1.0), (0.0, 0.0), 0.125, kind="bullet") == 3, "it overlaps one that it passes"
    with pytest.raises(ValueError, match=r"'bulet' is no kind of this scene.*'ball', 'bullet'"):
        sim.insert((1.25, 1.0), (0.0, 0.0), 0.125, kind="bulet")
    assert sim.recorded().kinds == world.kinds


def test_bodies_that_are_given_no_kind_are_of_the_first_in_python_as_in_a_file():
    come = [kt.Insert(1.0, (3.0, 3.0), (0.0, 0.0), 0.25, kind="sensor")]
    made = scene(commands=come, responses={("sensor", "sensor"): "stop"})
    assert (made.kind, made.kinds) == ((0, 0, 0), (0, "sensor"))
    assert names(made) == [["elastic"] * 3, ["elastic", "stop", "elastic"]]
    body = "[[bodies]]\nposition = [1, 1]\nradius = 0.5\n"
    assert loads_scene(body).kind == (0,)
    assert scene(kind=["b", None, "a"], kinds=["a", "b"]).kind == ("b", "a", "a")
    assert loads_scene(f'kinds = ["a", "b"]\n{body}').kind == ("a",)


def test_a_scene_without_bodies_has_the_kinds_that_its_rules_name():
    empty = kt.Scene([], [], [], arena=(4.0, 4.0), responses={("ball", "sensor"): "pass"})
    assert empty.kinds == ("ball", "sensor")
    assert loads_scene(dumps_scene(empty)) == empty


def test_files_declare_kinds_beside_bodies_or_a_recipe():
    body = '[[bodies]]\nposition = [1, 1]\nradius = 0.5\nkind = "ball"'
    assert loads_scene(f'kinds = ["ball", "sensor"]\n{body}').kinds == ("ball", "sensor")
    made = loads_scene(
        'recipe = "grid"\nkinds = [0, "probe"]\n[[responses]]\nbetween = [0, "probe"]\nresponse = "pass"'
    )
    assert (made.kinds, set(made.kind)) == ((0, "probe"), {0})


def test_a_response_is_looked_up_once():
    class Spring:
        """Nothing here is run."""

    with registered(kt.ResponseSpec("spring", Spring)):
        made = scene(responses="spring")
    assert pickle.loads(pickle.dumps(made)) == made.replace(start=0.0) == made
    with pytest.raises(SceneError, match="'spring', which is the name of no response"):
        scene(responses="spring")


def test_what_one_response_refuses_is_said_once():
    class Spring:
        def prepare(self, scene):
            raise Refused("no scene is soft enough")

    with registered(kt.ResponseSpec("spring", Spring)), pytest.raises(SceneError) as told:
        scene(responses="spring")
    assert [each.found for each in told.value.mistakes] == ["'spring'"]


def test_a_scene_of_elastic_bodies_looks_for_no_plugins():
    rules = "{('a', 'a'): 'pass', ('a', 'wall'): 'elastic'}"
    made = f"kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, kind='a', responses={rules})"
    code = f"import sys, kinetile as kt; {made}; assert 'kinetile.plugin.registry' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_event_file_is_read_where_its_response_is_not_installed():
    text = dumps_scene(scene(responses="stop")).replace('"stop"', '"of another machine"')
    read = loads_scene(text, look_up=False)
    assert names(read) == [["of another machine"] * 2]
    assert names(read.replace(start=-1.0)) == names(read)


def test_a_body_that_comes_without_a_kind_is_of_the_first():
    coming = [kt.Insert(1.0, (9.0, 9.0), (0.0, 0.0), 0.25)]
    two = kt.Scene([(0.0, 0.0), (3.0, 0.0)], [(0.0, 0.0)] * 2, 0.25, kind=["a", "b"], commands=coming)
    assert two.commands[0].kind == "a"
