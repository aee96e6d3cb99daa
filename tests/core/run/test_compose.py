"""Composition: the messages on phases that do not accept a scene, and which others are proposed."""

import itertools
import re

import numpy as np
import pytest

import kinetile as kt
import lanes
from kinetile.errors import Refused
from kinetile.plugin.choices import read_phase, read_phases

THREE = {
    "position": [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]],
    "velocity": [[1.0, 0.5], [-1.0, 0.25], [0.5, -1.0]],
}
ROWS = np.stack(np.meshgrid(np.arange(64.0), np.arange(64.0)), axis=-1).reshape(-1, 2) + 0.5


def scene(**more) -> kt.Scene:
    return kt.Scene(**{**THREE, "radius": 0.5, "arena": (4.0, 4.0), **more})


def far(**more) -> kt.Scene:
    place = [[5e8, 5e8], [5e8 + 1.0, 5e8]]
    return kt.Scene(place, [[1.0, 0.0], [0.0, 0.0]], 3e-5, **more)


SLANTED = {"sap-1d": {"axis": "3:4"}, "cells": {"side": 0.001}}
SCENES = {
    "walls": scene(),
    "torus": scene(periodic="xy"),
    "torus, with options": scene(periodic="x", settings=kt.Settings(options=SLANTED)),
    "plane, far away": far(),
    "passing": scene(kind=["a", "b", "a"], responses={("a", "b"): "pass"}),
    "boxes": scene(radius=None, shape=[0] * 3, shapes=[kt.box(0.5, 0.25)]),
    "arena, far away": far(arena=(1e9, 1e9)),
    "plane": scene(arena=None),
    "strip": scene(periodic="y"),
    "gravity": scene(gravity=(0.0, -1.0)),
    "sizes": scene(radius=[1e-5, 0.5, 0.25]),
    "small": scene(radius=1e-6),
    "no bodies": scene(position=[], velocity=[], radius=[]),
    "many": kt.Scene(ROWS, np.ones((4096, 2)), 0.25, arena=(64.0, 64.0)),
}
CHOICES = [
    *((name, {}) for name in lanes.BUILT_IN),
    ("sap-1d", {"axis": "3:4"}),
    ("sap-k", {"directions": "x+1:1"}),
    ("cells", {"side": 0.001}),
    ("sweep-and-prune", {"axis": "auto"}),
]


@pytest.mark.parametrize("name", lanes.first(6, list(SCENES)))
@pytest.mark.parametrize("narrow", lanes.first(1, [None, ["disc"], ["wall"], []]))
def test_phases_that_a_refusal_proposed_refused_as_well(name, narrow):
    """sap-1d:axis=3:4 was refused and sap-1d proposed; power was proposed without walls, and sweep-tiling
    where its skin is too thick."""
    for (phase, options), live in itertools.product(CHOICES, (False, True)):
        try:
            kt.Simulation(SCENES[name], phase, options=options, narrow_phases=narrow, live=live)
        except Refused as refused:
            proposed = re.search("phases that accept this scene: (?!none)(.*)$", str(refused))
            for text in read_phases(proposed[1]) if proposed else ():
                other, needs = read_phase(text)
                assert (other, needs) != (phase, {})
                kt.Simulation(SCENES[name], other, options=needs, narrow_phases=narrow, live=live)
