"""Scenes of docs/shapes.md and docs/scenes.md: each is one run under every broad phase that takes it."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from agreement import assert_one_answer
from lanes import first

SCENES = Path(__file__).parents[1] / "docs" / "scenes"
CONTACTS = {"sinai": 61, "stadium": 28, "maze": 64, "brick-breaker": 50} | {
    "bullet": 2,
    "bouncing-ball": 8,
    "column": 64,
    "slope": 64,
    "traffic": 1,
    "robots": 0,
    "pinball": 64,
    "galton": 64,
    "sedimentation": 64,
    "hopper": 64,
}
"""Of the whole run, or 64."""


def test_no_scene_is_left_out():
    assert {path.stem for path in SCENES.iterdir()} == set(CONTACTS)


@pytest.mark.small
@pytest.mark.parametrize("name", first(1, list(CONTACTS)))
def test_a_scene_has_one_answer(name):
    scene = kt.load_scene(SCENES / f"{name}.toml")
    sim = assert_one_answer(scene, until=scene.settings.until, max_contacts=64)
    assert len(sim.contacts) == CONTACTS[name]


@pytest.mark.small
def test_the_recorded_game_is_the_file():
    play = runpy.run_path(str(SCENES.parent / "examples" / "brick_breaker.py"))["play"]
    recorded = play().recorded()
    assert recorded == kt.load_scene(SCENES / "brick-breaker.toml")


@pytest.mark.slow
@pytest.mark.compiled
def test_a_disc_meets_the_stadium_as_often_as_it_must():
    """The disc's middle has a smaller polygon for itself, and the rate is exact (docs/shapes.md)."""
    stadium = kt.load_scene(SCENES / "stadium.toml")
    corners, disc = stadium.position[:-1], len(stadium) - 1  # anticlockwise
    sides = np.roll(corners, -1, axis=0) - corners
    way = np.arctan2(sides[:, 1], sides[:, 0])
    s, lengths = stadium.radius[disc], np.hypot(*sides.T)
    lost = 2 * s * np.tan((way - np.roll(way, 1)) % (2 * math.pi) / 2).sum()  # of the outline, at all corners
    x, y = corners.T
    area = (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    exact = np.hypot(*stadium.velocity[disc]) * (lengths.sum() - lost)
    exact /= math.pi * (area - s * lengths.sum() + s * lost / 2)
    sim = kt.Simulation(stadium, keep_contacts=False)
    sim.run(until=800_000.0, observe=["rates"])  # the file's own end is at 60
    rate = sim.observed["rates"]["pairs"]
    assert abs(rate.mean - exact) < 4 * rate.error
    assert rate.error < 0.005 * exact
