"""The first tiling is the right one, against brute force, on a plane and on a cylinder."""

from collections import Counter

import numpy as np
import pytest

import kinetile as kt
from kinetile_plugins.sweep_tiling.audit import audit, tiles_of
from lanes import first
from tilings import LOWER, OUTER, UPPER, Steps, random_scene, tiling_of


def built(scene: kt.Scene) -> Steps:
    steps = Steps(scene)
    steps.audit()
    return steps


@pytest.mark.parametrize("block", first(1, range(10)))
def test_random_scenes_are_tiled_as_by_brute_force(block):
    for seed in range(10 * block, 10 * block + 10):
        steps = built(random_scene(seed))
        assert tiling_of(steps.state) == steps.by_force(), f"seed {seed}"


@pytest.mark.compiled
@pytest.mark.parametrize(("bodies", "ratio"), first(1, [(200, 30.0), (200, 1.0), (300, 1000.0)]))
def test_larger_scenes_are_tiled_as_by_brute_force(bodies, ratio):
    steps = built(kt.make_scene("random", bodies=bodies, density=0.3, radius_ratio=ratio, seed=bodies))
    assert tiling_of(steps.state) == steps.by_force()


@pytest.mark.compiled
@pytest.mark.parametrize("seed", range(5))
def test_a_construction_in_the_midst_of_a_run_is_the_maintained_tiling(seed):
    steps = Steps(random_scene(seed, bodies=40))
    for _ in range(20):
        steps.step(budget=25)
        if steps.to_the_middle():
            maintained = tiling_of(steps.state)
            steps.sim.rebuild()
            assert tiling_of(steps.state) == maintained == steps.by_force()


def test_no_body_is_one_tile_and_one_body_four():
    empty = built(kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 1.0, arena=(1.0, 1.0)))
    assert tiling_of(empty.state).links == {8 + OUTER: OUTER}
    one = tiling_of(built(kt.Scene([[0.5, 0.5]], [[0.0, 0.0]], 0.25, arena=(1.0, 1.0))).state)
    assert one.links == {UPPER: 8 + UPPER, LOWER: 8 + LOWER, 8 + OUTER: 16 + OUTER, 24 + OUTER: OUTER}
    assert one.ends == {0: (1, 2), 8: (1, 2)}


@pytest.mark.parametrize("seed", first(1, range(3)))
@pytest.mark.parametrize("density", first(2, [0.5, 0.01, 0.25, 0.125]))
@pytest.mark.parametrize("bodies", first(2, [25, 100, 400]))
def test_a_grid_whose_columns_tie_starts_without_an_event(bodies, density, seed):
    steps = Steps(kt.make_scene("grid", bodies=bodies, density=density, seed=seed))
    assert not steps.step(until=0)
    assert steps.next_tick > 0
    if bodies < 400:
        steps.audit()
        if steps.to_the_middle():  # with the ties gone, brute force can tell
            assert tiling_of(steps.state) == steps.by_force()


def pairs(scene: kt.Scene, phase: str, **options: object) -> set[tuple[int, int]]:
    found = kt.Simulation(scene, phase, options=options).candidate_pairs()
    return {(int(a), int(b)) for a, b in found}


@pytest.mark.parametrize("bodies", [3, 21])
def test_figure_16_one_body_over_all_others(bodies):
    """Locality n for one body, and yet O(n) pairs, where sweep-and-prune has O(n^2)."""
    scene = kt.make_scene("figure-16", bodies=bodies)
    built(scene)
    tiled = pairs(scene, "sweep-tiling")
    seen = Counter(body for pair in tiled for body in pair)
    assert seen[0] == bodies - 1, "the wide body sees all others"
    assert len(tiled) == 2 * bodies - 3
    assert len(pairs(scene, "sap-1d", axis="x")) == bodies * (bodies - 1) // 2


def test_a_tile_may_reach_round_the_cylinder():
    """One body sees its own image: three tiles, and no candidate pair."""
    scene = kt.Scene([(0.9, 0.5)], [(1.0, 0.25)], 0.125, arena=(1.0, 1.0), periodic="x")
    steps = Steps(scene)
    tiles = tiles_of(steps.engine.k, steps.state)
    assert len(tiles.left) == 3
    assert sorted(tiles.away.tolist()) == [0.0, 0.0, 1.0]
    assert len(steps.sim.candidate_pairs()) == 0


def test_the_audit_sees_a_link_through_other_periods():
    scene = kt.Scene([(0.9, 0.5), (0.3, 0.25)], [(1.0, 0.25), (0, 0)], 0.125, arena=(1, 1), periodic="x")
    steps = Steps(scene)
    assert list(audit(steps.engine.k, steps.state)) == []
    left = int(tiles_of(steps.engine.k, steps.state).left[0])
    steps.state.turns[left] += 1
    complaints = "\n".join(audit(steps.engine.k, steps.state))
    assert "leads through other periods from its left than from its right" in complaints
    steps.state.turns[steps.state.web[left]] -= 1
    assert "is not the gap between" in "\n".join(audit(steps.engine.k, steps.state))
