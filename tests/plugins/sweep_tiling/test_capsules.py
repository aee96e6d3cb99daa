"""Level capsules, beside discs and in each other's way: contacts as under ``cells``, and a true tiling."""

import math

import numpy as np
import pytest

import kinetile as kt
from agreement import agree
from kinetile.errors import Refused
from lanes import first

CELL = 8.0, 1.0


def drawn(seed: int) -> kt.Scene:
    """Discs and level capsules on a lattice: of even seeds in quarters, with exact ties."""
    rng, ties = np.random.default_rng(seed), seed % 2 == 0
    shapes = []
    for radius in (0.5, 0.25, 0.125) if ties else rng.uniform(0.05, 0.5, 3):
        shapes.append(kt.disc(float(radius)))
        for _ in range(2):
            half = rng.integers(1, 12) / 4 if ties else rng.uniform(0.01, 3.0)
            off = rng.integers(-2, 3) / 4 if ties else rng.uniform(-0.5, 0.5)
            shapes.append(kt.capsule((off - half, 0.0), (off + half, 0.0), float(radius)))
    bodies = int(rng.integers(2, 14))
    columns = math.ceil(math.sqrt(bodies))
    shape = rng.integers(len(shapes), size=bodies)
    at = np.arange(bodies)
    x = np.full(bodies, CELL[0] / 2)
    if not ties:
        left, right = np.array([shapes[each].reaches[:2] for each in shape]).T
        x = np.where(left + right < CELL[0], left + rng.random(bodies) * (CELL[0] - left - right), x)
    position = np.column_stack([at % columns * CELL[0] + x, (at // columns + 0.5) * CELL[1]])
    velocity = rng.integers(-8, 9, (bodies, 2)) / 4 if ties else rng.uniform(-2.0, 2.0, (bodies, 2))
    mass = rng.choice([1.0, 2.0, 0.5], bodies)
    mass[0] = math.inf if seed % 5 == 0 else mass[0]
    arena = (columns * CELL[0], -(-bodies // columns) * CELL[1]) if seed % 3 else None
    periodic = "x" if arena and seed % 4 == 1 and columns > 1 else ""
    return kt.Scene(position, velocity, mass=mass, shape=shape, shapes=shapes, arena=arena, periodic=periodic)


@pytest.mark.parametrize("seed", first(4, range(120)))
def test_level_capsules_meet_as_under_cells(seed):
    """What bodies reach to the left and to the right are their bounds, and an audit looks at every tile."""
    scene = drawn(seed)
    most = 40 if seed < 8 else 120
    agree(scene, "cells", "sweep-tiling", until=20.0, contacts=most, audit=10)[1].drawing()


def test_capsules_come_and_go():
    scene = drawn(7)
    middle = np.mean(scene.shapes[scene.shape[2]].core, axis=0)

    def play(sim):
        sim.run(1.0)
        sim.remove(1)
        place = sim.positions()[1] + middle  # of body 2
        sim.remove(2)
        sim.insert(place, (0.5, 0.25), shape=kt.capsule((-0.0078125, 0.0), (0.015625, 0.0), 0.03125))
        sim.run(4.0)

    agree(scene, "cells", "sweep-tiling", play=play, live=True, audit=5)


SLANTED = kt.capsule((-1.0, 0.0), (1.0, 0.5), 0.25)
LEVEL = kt.capsule((-1.0, 0.0), (1.0, 0.0), 0.25)


def test_no_immovable_body_and_no_other_shape_comes_by_hand():
    sim = kt.Simulation(
        kt.Scene([(2.0, 2.0)], [(0.0, 0.0)], mass=math.inf, shape=LEVEL, arena=(8.0, 4.0)),
        "sweep-tiling",
        live=True,
    )
    before = sim.snapshot()
    with pytest.raises(ValueError, match="it is immovable, so it may overlap another, and sweep-tiling"):
        sim.insert((2.0, 2.0), (0.0, 0.0), mass=math.inf, shape=LEVEL)
    with pytest.raises(Refused, match="other shapes"):
        sim.insert((6.0, 2.0), (0.0, 0.0), shape=SLANTED)
    assert sim.snapshot() == before
