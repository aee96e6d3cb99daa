"""The rooms of docs/shapes.md: each is the same run under every broad phase that takes it."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

import kinetile as kt
from lanes import GENERAL, first

SCENES = Path(__file__).parents[1] / "docs" / "scenes"
CONTACTS = {"sinai": 61, "stadium": 28, "maze": 64, "brick-breaker": 50}
"""Of the whole run, or 64; the page has the maze's."""


def test_no_scene_is_left_out():
    assert {path.stem for path in SCENES.iterdir()} == set(CONTACTS)


@pytest.mark.small
@pytest.mark.parametrize("name", first(1, list(CONTACTS)))
def test_a_scene_has_one_answer(name):
    scene = kt.load_scene(SCENES / f"{name}.toml")
    prints = set()
    for phase in GENERAL:
        sim = kt.Simulation(scene, phase)
        sim.run(until=scene.settings.until, max_contacts=64)
        assert len(sim.contacts) == CONTACTS[name]
        prints.add(sim.fingerprint)
    assert len(prints) == 1


@pytest.mark.small
def test_the_recorded_game_is_the_file():
    play = runpy.run_path(str(SCENES.parent / "examples" / "brick_breaker.py"))["play"]
    recorded = play().recorded()
    assert recorded == kt.load_scene(SCENES / "brick-breaker.toml")
