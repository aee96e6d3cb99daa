"""Sweep-tiling where x is periodic: the answer of the rules and of ``naive``, with an audit after
each contact; bodies that come, go and are alone; and an audit that sees a link through other periods."""

from __future__ import annotations

import numpy as np
import pytest

import by_the_rules
import kinetile as kt
import torus_scenes
from kinetile.errors import Refused
from kinetile_plugins.sweep_tiling.audit import audit, tiles_of
from lanes import first
from tilings import Steps


def tiling(scene: kt.Scene, every: int = 1, **given) -> kt.Simulation:
    return kt.Simulation(scene, "sweep-tiling", audit=every, **given)


@pytest.mark.parametrize("seed", first(6, range(30)))
def test_the_answer_is_that_of_the_rules(seed):
    scene = torus_scenes.drawn(seed, axes=("x",))
    sim = tiling(scene)
    sim.run(until=10 * scene.time_unit, max_contacts=20)
    assert by_the_rules.rows(sim) == by_the_rules.answer(scene, 20, 10 << 52).contacts


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("seed", range(200))
def test_naive_gives_the_same_on_larger_scenes(seed):
    scene = torus_scenes.drawn(seed, (8, 13, 21, 34), ("x",))
    sims = kt.Simulation(scene, "naive"), tiling(scene, every=10)
    for sim in sims:
        sim.run(until=20 * scene.time_unit, max_contacts=300)
    assert sims[0].fingerprint == sims[1].fingerprint


SIZES = ((1.0, 1.0, 0.06), (1.0, 0.5, 0.03), (2.0, 1.0, 0.12))


@pytest.mark.parametrize("seed", first(2, range(20)))
def test_bodies_come_and_go_on_a_cylinder(seed):
    """Among them the last one, and one that comes to a cylinder on which there is nobody."""
    rng = np.random.default_rng(seed)
    width, height, radius = SIZES[seed % 3]
    scene = kt.Scene([(0.5, 0.25)], [rng.normal(size=2)], radius, arena=(width, height), periodic="x")
    sims = kt.Simulation(scene, "naive", live=True), tiling(scene, live=True, every=10)
    for sim in sims:
        sim.remove(0)
        assert len(sim.bodies) == 0
    time = 0.0
    for _ in range(12 if seed < 2 else 60):
        what = rng.random()
        bodies = list(sims[0].bodies)
        if what < 0.6 or not bodies:
            place = rng.uniform(-2 * width, 2 * width), rng.uniform(radius, height - radius)
            size, velocity = (
                rng.choice([radius, radius / 2]),
                rng.normal(size=2) * rng.choice([0.3, 1, 1, 20 if seed > 1 else 2]),
            )
            came = set()
            for sim in sims:
                try:
                    came.add(sim.insert(place, velocity, float(size)))
                except Refused:
                    came.add(None)
            assert len(came) == 1
        elif what < 0.85:
            gone = bodies[int(rng.integers(len(bodies)))]
            for sim in sims:
                sim.remove(gone)
        time += rng.choice([0.0, 0.01, 0.1])
        for sim in sims:
            sim.run(until=time)
        assert sims[0].fingerprint == sims[1].fingerprint


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


@pytest.mark.parametrize("periodic", ["y", "xy"])
def test_a_periodic_y_axis_is_refused(periodic):
    scene = kt.Scene([(0.5, 0.5)], [(1.0, 0.0)], 0.125, arena=(1.0, 1.0), periodic=periodic)
    with pytest.raises(Refused, match=f"periodic along {periodic}: .*: naive, cells, sap-1d, sap-2d"):
        kt.Simulation(scene, "sweep-tiling")
