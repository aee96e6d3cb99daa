"""The tiling stays right after every event, compared with brute force; and in the open plane."""

from collections.abc import Callable

import numpy as np
import pytest

import kinetile as kt
from agreement import agree
from kinetile.toolbox import Box
from lanes import first
from tilings import Steps, audited_events, columns, hard_scenes, lattice, random_scene, tiling_of

HARD = dict(hard_scenes())
KNOWN = ("figure-10", "figure-16", "break", "cradle")


def grid(seed: int) -> kt.Scene:
    bodies = (9, 25, 49)[seed // 4]
    return kt.make_scene("grid", bodies=bodies, density=(0.5, 0.25, 0.125, 0.01)[seed % 4], seed=bodies)


MAKERS: dict[str, tuple[Callable[[int], kt.Scene], int, int]] = {
    "grids": (grid, 12, 400),
    "random": (random_scene, 40, 150),  # up to 60 bodies, radii 1,000 apart and masses a million
    "lattices": (lambda seed: lattice(seed, jitter=False), 25, 100),
    "jittered lattices": (lambda seed: lattice(seed, jitter=True), 25, 100),
    "columns": (columns, 25, 100),
    "hard scenes": (lambda seed: [*HARD.values()][seed], len(HARD), 200),
    "known scenes": (lambda seed: kt.make_scene(KNOWN[seed]), len(KNOWN), 300),
}
"""Kinds of scenes: how to make one, how many there are, and how many events of each are audited."""


@pytest.mark.parametrize("seed", first(1, range(3)))
def test_few_bodies_are_right_after_every_event(seed):
    """Small enough to be run interpreted."""
    assert audited_events(random_scene(seed, bodies=6), 12) == 12
    assert audited_events(columns(seed), 12) > 0
    assert audited_events(lattice(seed, jitter=False), 12) > 0


WITH_TURNS = ("lattices", "jittered lattices")  # some of them, which would be a loop to compile


@pytest.mark.compiled
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.slow) if kind in WITH_TURNS else kind for kind in MAKERS]
)
@pytest.mark.parametrize("part", first(1, range(40)))
def test_the_tiling_is_right_after_every_event(kind, part):
    make, count, most = MAKERS[kind]
    for seed in range(count)[part::40]:
        events = audited_events(make(seed), most)
        assert events == most or kind not in ("grids", "random")


@pytest.mark.compiled
@pytest.mark.parametrize("block", first(1, range(20)))
def test_between_events_the_tiling_is_that_of_brute_force(block):
    compared = 0
    for seed in range(2 * block, 2 * block + 2):
        steps = Steps(random_scene(seed))
        for _ in range(40):
            assert steps.step()
            if steps.to_the_middle():
                compared += 1
                assert tiling_of(steps.state) == steps.by_force(), f"seed {seed}, event {steps.events}"
    assert compared > 50


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


@pytest.mark.parametrize("seed", first(1, range(40)))
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
