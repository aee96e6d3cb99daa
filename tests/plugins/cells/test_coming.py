"""Bodies that come: cells are as wide as the scene asks for that they have been prepared for, not as wide as
those ask for who are there when they are laid out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from lanes import first

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.mark.parametrize("path", sorted(SCENES.glob("wide-newcomer-*.toml")), ids=lambda path: path.stem)
def test_one_who_is_wider_than_all_who_are_there_is_not_overlooked(path):
    scene = kt.load_scene(path)
    wanted = kt.Simulation(scene, "naive")
    wanted.run()
    sim = kt.Simulation(scene, "cells", audit=1)
    sim.run()
    assert len(wanted.contacts) > 1
    assert sim.contacts.tobytes() == wanted.contacts.tobytes()


@pytest.mark.parametrize("bodies", first(1, [4, 60]))
def test_a_wide_one_comes_by_hand(bodies):
    """With four bodies there is one level, with sixty that crowd there are more."""
    place = np.column_stack([0.5 + np.arange(bodies) % 10, 0.5 + np.arange(bodies) // 10]) * 0.25
    flight = np.column_stack([np.cos(np.arange(bodies)), np.sin(np.arange(bodies))])
    scene = kt.Scene(place, flight, 0.1, arena=(12.0, 4.0))
    sims = [kt.Simulation(scene, "naive", live=True), kt.Simulation(scene, "cells", live=True, audit=1)]
    for sim in sims:
        sim.run(until=0.5)
        sim.insert((9.0, 2.0), (-1.0, 0.25), 1.5)
        sim.run(until=8.0, max_contacts=300)
    met = sims[0].contacts[["a", "b"]].tolist()
    assert any(bodies in pair and min(pair) >= 0 for pair in met), "the wide one meets another body"
    assert sims[1].contacts.tobytes() == sims[0].contacts.tobytes()
