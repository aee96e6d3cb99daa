"""Calls to simulations that cannot be done: a sentence, and nothing has changed."""

import math

import numpy as np
import pytest

import kinetile as kt
import sensors
from messages import table

ROOM = {"position": [[0.5, 0.5]], "velocity": [[0.0, 1.0]], "radius": 0.25, "arena": (1.0, 1.0)}
BOXES_AND_A_DISC = kt.Scene(
    [[1.0, 1.0], [3.0, 1.0], [1.0, 3.0]],
    np.ones((3, 2)),
    shape=[0, 0, 1],
    shapes=[kt.box(0.5, 0.25), kt.disc(0.25)],
    arena=(4.0, 4.0),
)


@pytest.fixture
def grid():
    return kt.make_scene("grid", bodies=9, density=0.25, seed=3)


@pytest.fixture
def sim(grid):
    sim = kt.Simulation(grid, "cells", live=True)
    sim.run(0.125)
    return sim


@pytest.fixture
def lattice():
    return kt.Simulation(kt.Scene([(0.125, 0.125)], [(0, 0)], 0.125, arena=(1.0, 1.0), periodic="x"), "naive")


@pytest.fixture
def world():
    """With absent kinds."""
    scene = sensors.world(kinds=["ball", "sensor", "late", 7], commands=[sensors.LATE])
    return kt.Simulation(scene, "naive", live=True)


@pytest.fixture
def falls():
    scene = kt.Scene([[0.5, 0.75]], [[0.0, 0.0]], 0.25, arena=(2.0, 2.0), gravity=(0.0, -1.0))
    return kt.Simulation(scene, "cells", live=True)


@pytest.fixture
def pulled():
    """A ball that falls, and a peg."""
    places, mass = [[0.5, 0.75], [1.5, 0.5]], [1.0, math.inf]
    scene = kt.Scene(places, [[0.0, 0.0]] * 2, 0.25, mass, (2.0, 2.0), gravity=(0.0, -1.0))
    return kt.Simulation(scene, "cells", live=True)


@pytest.fixture
def late():
    """In the open plane, after the end of its scene."""
    end = kt.Settings(until=1.0)
    sim = kt.Simulation(kt.Scene([(0.0, 0.0)], [(1.0, 0.0)], 0.5, settings=end), "naive")
    sim.run(2.0)
    return sim


def unchanged(sim, call):
    before = sim.snapshot()
    try:
        call(sim)
    finally:
        assert sim.snapshot() == before


def unbuilt(call):
    sim = kt.Simulation(kt.make_scene("grid", bodies=9), "cells")
    try:
        call(sim)
    finally:
        assert (sim.time, sim.built) == (0.0, False)


test_message = table(globals())
