"""Which bodies are near each other: none from afar, but for cells of the open plane that share a place."""

from __future__ import annotations

import numpy as np

import kinetile as kt
from grids import state_of
from kinetile.kernel.flight import positions_now
from kinetile.kernel.tables import NEVER


def test_near_names_no_body_from_afar():
    scene = kt.make_scene("grid", bodies=100, density=0.25)
    sim = kt.Simulation(scene, "cells")
    sim.run(max_contacts=50)
    level = state_of(sim).levels[0]
    place = positions_now(sim._engine.k)
    found = sim.candidate_pairs()
    assert 100 < len(found) < 1500
    assert (np.abs(place[found[:, 0]] - place[found[:, 1]]) <= 2.0 * (level.side + level.slack)).all()


def test_a_body_at_rest_has_no_certificate():
    position = [[0.25, 0.25], [0.75, 0.75]]
    sim = kt.Simulation(kt.Scene(position, [[0.0, 0.0], [0.0, -0.5]], 0.1, arena=(1.0, 1.0)), "cells")
    sim._engine.build()
    own = sim._engine.k.queue.own
    assert own[0] == NEVER
    assert own[1] < NEVER


def test_cells_a_whole_turn_apart_share_a_place_and_cost_time_alone():
    """In the open: two discs that meet, and two exactly one turn of the table away, which are near them."""
    at = np.array([[0.5, 0.5], [1.5, 0.5]])
    sim = kt.Simulation(
        kt.Scene(np.vstack([at, at + np.array([3.0, 5.0])]), np.array([[1, 0], [-1, 0]] * 2), 0.25),
        "cells",
        options={"side": 1.0},
    )
    level = state_of(sim).levels[0]
    assert (level.columns, level.cells) == (3, 15)
    sim.run(until=1.0)
    assert sim.contacts[["a", "b"]].tolist() == [(0, 1), (2, 3)]
