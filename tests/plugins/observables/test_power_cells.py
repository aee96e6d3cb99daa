"""Power cells fill the arena and have the points of least power; flips are counted one by one."""

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import Refused
from kinetile_observables.power_cells import cells_of
from lanes import first

SCENES = [(1, 1.0, 0), (2, 3.0, 1), (3, 1.0, 2), (40, 1.0, 3), (60, 10.0, 4), (300, 30.0, 5)]
POINTS = 20_000


@pytest.mark.parametrize("periodic", ["", "x", "y", "xy"])
@pytest.mark.parametrize(("bodies", "ratio", "seed"), first(3, SCENES))
def test_cells_fill_the_arena_and_have_the_points_of_least_power(bodies, ratio, seed, periodic):
    scene = kt.make_scene("random", bodies=bodies, density=0.25, radius_ratio=ratio, seed=seed)
    scene = scene.replace(periodic=periodic)
    cells = cells_of(scene, scene.position, scene.radius)
    width, height = scene.arena
    assert cells.area.sum() == pytest.approx(width * height, rel=1e-12)
    assert (cells.area > np.pi * scene.radius**2).all()
    if periodic == "xy":  # by Euler's formula
        assert (cells.neighbours.sum(), cells.walled.any()) == (
            6 * bodies if bodies > 1 else 4,
            False,
        )  # Euler
    points = np.random.default_rng(seed).random((POINTS, 2)) * scene.arena
    apart = points[:, None] - scene.position
    apart -= np.rint(apart / scene.arena) * scene.arena * np.isin(["x", "y"], [*periodic])
    owner = ((apart**2).sum(axis=2) - scene.radius**2).argmin(axis=1)
    share = cells.area / (width * height)
    spread = 5.0 * np.sqrt(share * (1.0 - share) / POINTS) + 5.0 / POINTS
    assert (np.abs(np.bincount(owner, minlength=bodies) / POINTS - share) < spread).all()


def test_neighbours_are_the_edges_that_power_keeps():
    """But for those whose cells adjoin beyond a wall, and those that flip within a thousandth of r^2."""
    scene = kt.make_scene("random", bodies=60, density=0.3, radius_ratio=5.0, seed=2)
    sim = kt.Simulation(scene, "power")
    sim.run(until=0.1)
    cells = cells_of(scene, sim.positions(), sim.radii())
    edges = np.bincount(sim.candidate_pairs().ravel(), minlength=60)
    inside = ~cells.walled
    assert inside.sum() > 25
    assert (edges >= cells.neighbours).mean() > 0.95
    assert (edges == cells.neighbours)[inside].mean() > 0.95


@pytest.mark.parametrize(("crystal", "number"), [("hexagonal", 6), ("square", 4)])
def test_crystals_have_the_neighbours_of_their_lattice(crystal, number):
    """Corners of four cells are sides of length 0, which rounding makes longer."""
    scene = kt.make_scene(crystal, columns=6, rows=6, walls=False)
    step = float(scene.position[1, 0] - scene.position[0, 0])
    sides = 6.0 * step, 6.0 * step * (1.0 if number == 4 else np.sqrt(0.75))
    scene = scene.replace(arena=sides, periodic="xy")
    sim = kt.Simulation(scene, "naive")
    sim.run(1e-12, observe=["cells"])
    found = sim.observed["cells"]
    assert found["neighbours"].mean[number] == 1.0
    assert found["defects"].mean == float(number != 6)
    assert found["free"].mean == pytest.approx(sides[0] * sides[1] / 36 - np.pi * scene.radius[0] ** 2)
    assert found["free_spread"].mean == pytest.approx(0.0, abs=1e-9)


def test_flips_are_the_pairs_that_become_neighbours_one_by_one():
    scene = kt.make_scene("grid", bodies=9, density=0.4, seed=1)
    stepped, sim = (kt.Simulation(scene, "power") for _ in range(2))
    came, pairs = 0, {*map(tuple, stepped.candidate_pairs().tolist())}
    for event in stepped.steps(0.5):
        now = {*map(tuple, stepped.candidate_pairs().tolist())}
        came += len(now - pairs) if event.kind == "structural" else 0
        pairs = now
    sim.run(0.5, observe=["flips:every=0.05"])
    assert came > 4
    assert sim.observed["flips:every=0.05"]["flips"].mean == pytest.approx(came / 0.5)


def test_flips_are_those_of_power(tmp_path):
    grid = kt.make_scene("grid", bodies=4)
    sentence = "'flips' is of the structure of broad phase power, and this run is under cells: run it"
    sim = kt.Simulation(grid, "power")
    sim.run(1.0, max_contacts=2, observe=["flips:every=0.1"])
    sim.save(tmp_path / "half.kt")
    again = kt.resume(tmp_path / "half.kt", "cells")
    with pytest.raises(Refused, match=sentence):
        again.run(1.0, observe=again.observed)
