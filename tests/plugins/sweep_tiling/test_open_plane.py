"""The open plane is tiled like an arena: no certificate asks where the edges are."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from agreement import agree
from kinetile.toolbox import Box
from lanes import first


def together_and_apart(seed: int) -> kt.Scene:
    """Returns a swarm that flies together, and then apart until nothing meets; each second one on a lattice,
    with exact ties."""
    rng = np.random.default_rng(seed)
    n, exact = int(rng.integers(2, 40)), seed % 2 == 0
    side = int(np.ceil(np.sqrt(n)))
    where = rng.permutation(side * side)[:n]
    place = np.column_stack([where % side, where // side]) - side // 2.0
    if exact:
        velocity, radius = rng.integers(-2, 3, (n, 2)) - place / 2, rng.choice([0.25, 0.5], n)
    else:
        place += rng.uniform(-0.1, 0.1, (n, 2))
        velocity, radius = rng.normal(size=(n, 2)) - 0.4 * place, rng.uniform(0.05, 0.4, n)
    return kt.Scene(place, velocity, radius)


@pytest.mark.parametrize("seed", first(2, range(40)))
def test_a_swarm_that_flies_together_and_apart_meets_as_under_naive(seed):
    agree(together_and_apart(seed), "naive", "sweep-tiling", until=200.0, contacts=2000, audit=20)


def test_tiles_are_drawn_to_a_box_around_the_bodies():
    sim = kt.Simulation(kt.Scene([(-3.0, 1.0), (5.0, 2.0)], [(0.0, 0.0)] * 2, 0.5), "sweep-tiling")
    tiles = [item for item in sim.drawing() if isinstance(item, Box)]
    assert len(tiles) == 7
    corners = {corner for tile in tiles for corner in (*tile.low, *tile.high) if isinstance(corner, float)}
    assert min(corners) < -3.5
    assert max(corners) > 5.5
    assert all(np.isfinite(list(corners)))
    assert kt.Simulation(kt.Scene([], [], []), "sweep-tiling").drawing() is not None
