"""Kinds and responses of a scene: what is said of whom, what is refused, and files."""

from __future__ import annotations

import math
import pickle
import tomllib

import pytest

import kinetile as kt
from kinetile.errors import SceneError
from kinetile.plugin.by_name import loads_scene
from kinetile.scene.text.files import dumps_scene

BALLS = {"position": [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]], "velocity": [[0.0, 0.0]] * 3, "radius": 0.5}
LOSSY = kt.Response("restitution", e=0.5, contact_time=1e-6)


def scene(**more) -> kt.Scene:
    return kt.Scene(**{**BALLS, "arena": (4.0, 4.0), **more})


def names(of: kt.Scene) -> list[list[str]]:
    return [[response.name for response in row] for row in of.meets]


def test_without_rules_all_is_elastic():
    assert names(scene()) == [["elastic", "elastic"]]
    assert not scene().ruled


def test_the_most_specific_rule_counts():
    rules = {("*", "*"): "stop", ("a", "*"): "pass", ("a", "b"): "elastic", ("b", "wall"): "stop"}
    found = scene(kind=["a", "b", "c"], responses=rules)
    assert found.kinds == ("a", "b", "c")
    assert names(found) == [
        ["pass", "elastic", "pass", "elastic"],
        ["elastic", "stop", "stop", "stop"],
        ["pass", "stop", "stop", "elastic"],
    ]


def test_who_passes_may_overlap_and_nobody_else():
    place = [[1.0, 1.0], [1.25, 1.0], [3.0, 3.0]]
    with pytest.raises(SceneError, match=r"bodies\[0\] and bodies\[1\]: found an overlap of 0.75"):
        scene(position=place, kind=["a", "b", "a"], responses={("a", "a"): "pass"})
    assert scene(position=place, kind=["a", "b", "a"], responses={("b", "a"): "pass"}).ruled


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
    ],
)
def test_mistakes_say_where_and_what(more, said):
    with pytest.raises(SceneError, match=said):
        scene(**more)


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


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        (
            'between = ["*", "*"]\nresponse = "stopp"',
            "which is the name of no response; .* did you mean 'stop'",
        ),
        ('between = ["*", "*"]\nresponse = "restitution"\noptions = { e = 0.5 }', "there is no contact_time"),
        ('between = ["*", "*"]\nresponse = "stop"\noptions = { e = 0.5 }', "options.stop.e"),
        ('between = ["*"]\nresponse = "stop"', r"responses\[0\].between"),
        ('between = ["*", "*"]', r"responses\[0\].response: found nothing"),
        ('between = ["*", "*"]\nrespons = "stop"', "did you mean 'response'"),
    ],
)
def test_files_are_told_what_is_wrong(rule, said):
    with pytest.raises(SceneError, match=said):
        loads_scene(f'recipe = "grid"\n[[responses]]\n{rule}\n')
