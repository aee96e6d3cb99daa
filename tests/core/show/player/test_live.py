"""The run that a page computes: with any commands, its contacts are those of kinetile."""

import numpy as np
import pytest

import kinetile as kt
from kinetile.show.player import view_scene
from lanes import first
from player_pages import PLAYED, ask_node, needs_node
from player_pages import SCENES as SHOWN

SCENES = {
    "fifty": kt.make_scene("grid", bodies=50, density=0.4, seed=1),
    "sizes": kt.make_scene("random", bodies=24, density=0.4, radius_ratio=4, seed=4),
    "ties": kt.Scene(
        [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0], [3.0, 3.0]],
        [[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0]],
        0.5,
        arena=(4.0, 4.0),
    ),
    "masses": SHOWN["masses"],
}


@needs_node
@pytest.mark.parametrize("commands", ["none", "turns", "insertion"])
@pytest.mark.parametrize("name", first(2, list(SCENES)))
def test_its_contacts_are_those_of_kinetile(name, commands, tmp_path):
    scene, until = SCENES[name], {"ties": 8.0, "masses": 5.0}.get(name, 0.6)
    page = view_scene(scene, [("cells", {})], until=until, steps=False).page
    sim = kt.Simulation(scene, "cells")
    sim.run(until=until / 3)
    turns, inserts = [], []
    if commands == "turns":
        turns = [[0, [0.3, -0.7]], [2, [0.0, 0.0]]]
        for body, velocity in turns:
            sim.set_velocity(body, velocity)
    if commands == "insertion":
        radius = float(scene.radius.min()) / 4
        for place in np.random.default_rng(1).uniform(0.1, 0.9, (50, 2)) * scene.arena:
            try:
                sim.insert(place.tolist(), (0.5, 0.25), radius=radius, mass=2.0)
            except kt.errors.Refused:
                continue
            inserts = [[place.tolist(), [0.5, 0.25], radius, 2.0]]
            break
        assert inserts
    moment = list(sim.exact_time)
    sim.run(until=until)
    found = ask_node(tmp_path, page, PLAYED, moment=moment, turns=turns, inserts=inserts)
    wanted = [[int(each[part]) for part in ("epoch", "tick", "a", "b")] for each in sim.contacts]
    assert len(wanted) > 8
    assert found == wanted
