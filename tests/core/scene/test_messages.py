"""Invalid scenes, and the reports of their mistakes: the rows of ``messages.toml``."""

from pathlib import Path

import numpy as np

import kinetile as kt
from messages import table

STILL = {"velocity": [[0.0, 0.0]], "radius": 0.1}
ACCELERATED = {**STILL, "arena": (4.0, 4.0), "gravity": (0.0, -1.0)}
ONE = kt.Scene([[0.0, 0.0]], **STILL, start=1.0)
TOUCHING = {"velocity": np.zeros((2, 2)), "radius": 0.1, "arena": (1.0, 1.0)}
TWO = {"position": [[0.0, 0.0], [5.0, 0.0]], "velocity": np.zeros((2, 2)), "radius": 1.0}
KINDS = ["ball", "sensor"]
MISSPELT = {("ball", "sensr"): "pass"}
OVERLAP = [[1.0, 1.0], [1.25, 1.0], [3.0, 3.0]]
COMES = kt.Insert(1.0, (3.0, 3.0), (0.0, 0.0), 0.25, kind="sensor")
BODY = "[[bodies]]\nposition = [0.5, 0.5]\nradius = 0.1\n"
BODY_OF_SHAPE = "[[bodies]]\nposition = [0, 0]\nshape = 0\n"
BOX = '[[shapes]]\nkind = "box"\nwidth = 0.5\nheight = 0.25\n'
TURN = "[[bodies.turns]]\n"
COMMAND = "[[commands]]\ntime = 2\n"
GOES_THEN_TURNS = f"{COMMAND}remove = 0\n{COMMAND}turn = 0\nvelocity = [0, 0]\n"
RULE = 'recipe = "grid"\n[[responses]]\n'
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
OF_COMMANDS_AND_RESPONSES = f"""unit = 0.3
{BODY}mass = -1
{COMMAND}
{COMMAND}insert = {{ position = [3, 3], radius = -1 }}
[[responses]]
between = ['*', 'wall']
response = 'pass'
[[responses]]
between = [0, 'nobody']
response = 'stop'
[[obstacles]]
points = [[0, 0]]
"""
SHAPED = ("shape = 0", "radius = 1", "shape = 1\nradius = 0.1", "shape = 'a'", "mass = 1", "shape = 9")
OF_SHAPES = """
[[shapes]]
kind = "box"
width = 1.0
[[shapes]]
kind = "bix"
[[shapes]]
kind = "polygon"
corners = [[0.0, 0.0], [1.0, "a"]]
[[shapes]]
kind = "disc"
radius = 1.0
width = 2.0
[[shapes]]
kind = "capsule"
from = [0.0, 0.0]
to = [0.0, 0.0]
radius = 1.0
[[shapes]]
kind = "polygon"
corners = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]
[[shapes]]
radius = 1.0
""" + "".join(f"[[bodies]]\nposition = [{9 * k}, 0]\n{text}\n" for k, text in enumerate(SHAPED))


def shaped(**more) -> kt.Scene:
    places = [(1.0, 1.0), (3.0, 1.0), (5.0, 3.0), (2.0, 4.0)]
    shapes = (
        kt.box(1.0, 2.0),
        kt.capsule((-0.5, 0.0), (0.5, 0.25), 0.25),
        kt.polygon([(-0.5, -0.5), (0.5, -0.5), (0.0, 0.5)], 0.125),
        kt.disc(0.5),
        kt.segment((0.0, 0.0), (1.0, 1.0)),
        kt.polygon([(2.0, 3.0)], 0.1),
    )
    values = {"shape": [0, 1, 2, 3], "shapes": shapes, "arena": (8.0, 8.0)}
    return kt.Scene(places, np.zeros((4, 2)), **(values | more))


def balls(**more) -> kt.Scene:
    places = [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]]
    return kt.Scene(
        **{"position": places, "velocity": np.zeros((3, 2)), "radius": 0.5, "arena": (4.0, 4.0), **more}
    )


def written(content: bytes) -> Path:
    Path("scene.toml").write_bytes(content)
    return Path("scene.toml")


test_message = table(globals())
