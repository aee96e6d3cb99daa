"""Kinds and responses of a scene: what is accepted, what is refused, and files."""

from __future__ import annotations

import math
import pickle
import subprocess
import sys
import tomllib

import pytest

import kinetile as kt
from kinetile.errors import SceneError
from kinetile.scene.files import dumps_scene, loads_scene
from registering import registered

BALLS = {"position": [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]], "velocity": [[0.0, 0.0]] * 3, "radius": 0.5}
LOSSY = kt.Response("restitution", e=0.5, contact_time=1e-6)
KINDS = ["ball", "sensor"]
MISSPELT = {("ball", "sensr"): "pass"}


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


def test_bodies_that_pass_may_overlap_and_no_others():
    place = [[1.0, 1.0], [1.25, 1.0], [3.0, 3.0]]
    with pytest.raises(SceneError, match=r"bodies\[0\] and bodies\[1\]: found an overlap of 0.75"):
        scene(position=place, kind=["a", "b", "a"], responses={("a", "a"): "pass"})
    assert scene(position=place, kind=["a", "b", "a"], responses={("b", "a"): "pass"})._ruled


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"kind": ["a", "b"]}, "kind: found 2 kinds; expected one for each of the 3 bodies, or one for all"),
        ({"kind": ["a", "wall", -1]}, r"bodies\[1\].kind: found 'wall'.*\n.*bodies\[2\].kind: found -1"),
        ({"responses": {("a", "wall"): "pass"}}, "walls cannot be passed"),
        ({"responses": {("a", "b", "c"): "stop"}}, r"expected two kinds, or one and 'wall'; '\*' for any"),
        ({"responses": {("wall", "wall"): "stop"}}, "expected two kinds"),
        ({"responses": {("a", "b"): 7}}, "found 7; expected the name of a response"),
        ({"responses": {("a", "b"): "stop", ("b", "a"): "pass"}}, "expected one response"),
        ({"responses": [1]}, "expected a mapping from two kinds to a response"),
        (
            {"kind": ["a", "b", "a"], "responses": {("a", "*"): "stop", ("b", "*"): "pass"}},
            "nothing, Response.* by their kinds; expected a response for these two",
        ),
        ({"mass": [1.0, -math.inf, 1.0]}, "expected a number greater than 0, or inf"),
        (
            {"kinds": KINDS, "kind": ["ball", "bal", "ball"]},
            r"bodies\[1\].kind: found 'bal', which is none of",
        ),
        (
            {"kinds": KINDS, "commands": [kt.Insert(1.0, (3.0, 3.0), (0.0, 0.0), 0.25, kind="sensr")]},
            r"commands\[0\].kind: found 'sensr'.* expected one of ball, sensor; did you mean 'sensor'",
        ),
        ({"kinds": KINDS, "responses": MISSPELT}, "found 'sensr', a kind that no body has"),
        (
            {"kinds": "ball"},
            r"kinds: found 'ball'; expected all kinds of bodies, such as \['ball', 'sensor'\]",
        ),
        ({"kinds": 3}, "kinds: found 3; expected all kinds"),
        ({"kinds": ["ball", "wall", 1.5]}, r"kinds\[1\]: found 'wall'.*\n.*kinds\[2\]: found 1.5"),
    ],
)
def test_mistakes_say_where_and_what(more, said):
    with pytest.raises(SceneError, match=said):
        scene(**more)


@pytest.mark.parametrize(
    ("response", "said"),
    [
        (kt.Response("restitution", e=0.5, contacttime=1e-6), "contacttime: found no .* mean 'contact_time'"),
        (
            kt.Response("restitution", e=1.5),
            "found {'e': 1.5}; expected what the response can use: .* at most 1",
        ),
        (
            kt.Response("restitution", contact_time=1.0),
            "options.e: found nothing; expected a value: it has no",
        ),
        (kt.Response("elastic", e=0.5), "options.e: found no option of this name"),
        (kt.Response("pass", e=0.5), "options.e: found no option of this name"),
    ],
)
def test_options_of_a_response_were_first_read_by_the_simulation(response, said):
    for make in (scene, scene().replace):
        with pytest.raises(SceneError, match=said):
            make(responses=response)


def test_files_and_pickles_give_it_back():
    rules = {("ball", "sensor"): "pass", ("*", "wall"): LOSSY, (0, "ball"): "stop"}
    come = [kt.Insert(1.0, (3.0, 3.0), (0.0, 0.0), 0.25, math.inf, kind="sensor")]
    made = scene(kind=["ball", "sensor", 0], mass=[1.0, math.inf, 2.0], responses=rules, commands=come)
    again = loads_scene(dumps_scene(made))
    assert again == made
    assert (again.kinds, again.kind, again.meets) == (made.kinds, made.kind, made.meets)
    assert pickle.loads(pickle.dumps(made)) == made
    assert made != scene(kind=["ball", "sensor", 0], mass=[1.0, math.inf, 2.0], commands=come)
    assert tomllib.loads(dumps_scene(made))["bodies"][1]["mass"] == math.inf


def test_a_recipe_takes_responses_for_all():
    text = 'recipe = "grid"\n[[responses]]\nbetween = ["*", "*"]\nresponse = "stop"\n'
    assert names(loads_scene(text)) == [["stop", "elastic"]]


def test_a_rule_for_a_kind_of_no_body_is_refused_with_the_nearest_name():
    said = r"responses\[\('ball', 'sensr'\)\]: found 'sensr', a kind that no body has; expected one of ball, "
    with pytest.raises(SceneError, match=said + r"sensor; did you mean 'sensor'\? \(kinds=\[...\] declares"):
        scene(kind=["ball", "sensor", "ball"], responses=MISSPELT)
    with pytest.raises(SceneError, match=r"found 'bal'.* did you mean 'ball'"):
        scene(kind="ball", responses={("bal", "wall"): "stop"})
    with pytest.raises(
        SceneError, match="found 'ball', a kind that no body has; expected 0, the kind of bodies"
    ):
        scene(responses={("ball", "ball"): "stop"})


def test_the_kinds_of_those_that_come_are_kinds_as_well():
    come = [kt.Insert(1.0, (3.0, 3.0), (0.0, 0.0), 0.25, kind="sensor")]
    made = scene(kind="ball", commands=come, responses={("ball", "sensor"): "pass"})
    assert made.kinds == ("ball", "sensor")
    with pytest.raises(SceneError, match="did you mean 'sensor'"):
        scene(kind="ball", commands=come, responses=MISSPELT)


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


SENSOR = """
[[bodies]]
position = [1, 1]
radius = 0.5
kind = "ball"
[[commands]]
time = 1.0
insert = { position = [3.0, 3.0], radius = 0.25, kind = "sensor" }
[[responses]]
between = ["ball", "sensr"]
response = "pass"
"""


RULE = 'recipe = "grid"\n[[responses]]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f'{RULE}between = ["*", "*"]\nresponse = "stopp"', "name of no response; .* did you mean 'stop'"),
        (
            f'{RULE}between = ["*", "*"]\nresponse = "restitution"\noptions = {{ e = 0.5 }}',
            "there is no contact_time",
        ),
        (
            f'{RULE}between = ["*", "*"]\nresponse = "stop"\noptions = {{ e = 0.5 }}',
            r"responses\[0\].options.e",
        ),
        (f'{RULE}between = ["*"]\nresponse = "stop"', r"responses\[0\].between"),
        (f'{RULE}between = ["*", "*"]', r"responses\[0\].response: found nothing"),
        (f'{RULE}between = ["*", "*"]\nrespons = "stop"', "did you mean 'response'"),
        (f'{RULE}between = ["a", "a"]\nresponse = "stop"', "found 'a', a kind that no"),
        (SENSOR, "found 'sensr', a kind that no body has; expected one of ball, sensor; did you mean 'sen"),
        (
            f"kinds = [[1],'ball','sensor','sensr']\n{SENSOR}[[bodies]]\nposition = [2, 2]\nradius = 0.1\n",
            r"1 mistake\n  kinds\[0\]: found \[1\]; expected the name of a kind",
        ),
        (f"kinds = 3\n{SENSOR}", "1 mistake\n  kinds: found 3; expected a list of all kinds of bodies"),
        (SENSOR.replace("time = 1.0", ""), r"1 mistake\n  commands\[0\].time: found nothing"),
        (f"kind = ['ball', 'sensr']\n{SENSOR}", "did you mean 'kinds'"),
    ],
)
def test_mistakes_of_files_say_where_and_what(text, said):
    with pytest.raises(SceneError, match=said):
        loads_scene(text)


def test_files_declare_kinds_beside_bodies_or_a_recipe():
    made = loads_scene(f'kinds = ["ball", "sensor", "sensr"]\n{SENSOR}')
    assert made.kinds == ("ball", "sensor", "sensr")
    made = loads_scene(
        'recipe = "grid"\nkinds = [0, "probe"]\n[[responses]]\nbetween = [0, "probe"]\nresponse = "pass"'
    )
    assert (made.kinds, set(made.kind)) == ((0, "probe"), {0})


@pytest.mark.parametrize("rule", ["stpo", kt.Response("stpo"), kt.Response("stpo", e=0.5)])
def test_a_scene_finds_responses_that_there_are_not(rule):
    said = (
        r"responses\[\('\*', '\*'\)\]: found 'stpo', which is the name of no response; .*did you mean 'stop'"
    )
    with pytest.raises(SceneError, match=said):
        scene(responses=rule)


def test_a_response_is_looked_up_once():
    class Spring:
        """Nothing here is run."""

    class Springs:
        @kt.hookimpl
        def kinetile_responses(self) -> list[kt.ResponseSpec]:
            return [kt.ResponseSpec("spring", Spring, "pushes back")]

    with registered(Springs()):
        made = scene(responses="spring")
    assert pickle.loads(pickle.dumps(made)) == made.replace(start=0.0) == made
    with pytest.raises(SceneError, match="'spring', which is the name of no response"):
        scene(responses="spring")


def test_a_scene_of_elastic_bodies_looks_for_no_plugins():
    rules = "{('a', 'a'): 'pass', ('a', 'wall'): 'elastic'}"
    made = f"kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, kind='a', responses={rules})"
    code = f"import sys, kinetile as kt; {made}; assert 'kinetile.plugin.registry' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_event_file_is_read_where_its_response_is_not_installed():
    text = dumps_scene(scene(responses="stop")).replace('"stop"', '"of another machine"')
    read = loads_scene(text, look_up=False)
    assert names(read) == [["of another machine", "elastic"]]
    assert names(read.replace(start=-1.0)) == names(read)
