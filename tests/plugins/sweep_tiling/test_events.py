"""The tiling stays right: audited after every event, and compared with brute force between events."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import Refused
from lanes import first
from tilings import (
    Steps,
    audited_contacts,
    audited_events,
    columns,
    hard_scenes,
    lattice,
    random_scene,
    take_the_limit_away,
    tiling_of,
)

DENSITIES = (0.5, 0.25, 0.125, 0.01)


def grid(bodies: int, density: float) -> kt.Scene:
    return kt.make_scene("grid", bodies=bodies, density=density, seed=bodies)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("bodies", [9, *(pytest.param(each, marks=pytest.mark.slow) for each in (25, 49))])
def test_grids_are_right_after_every_event(bodies):
    for density in DENSITIES:
        assert audited_events(grid(bodies, density), 400) == 400


@pytest.mark.compiled
@pytest.mark.parametrize("block", first(1, range(8)))
def test_random_scenes_are_right_after_every_event(block):
    """Up to 60 bodies, radius ratios up to 1000, mass ratios up to a million."""
    for seed in range(5 * block, 5 * block + 5):
        assert audited_events(random_scene(seed), 150) == 150


@pytest.mark.compiled
@pytest.mark.parametrize("name", dict(hard_scenes()))
def test_hard_scenes_are_right_after_every_event(name):
    audited_events(dict(hard_scenes())[name], 200)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize(
    "make", [lambda seed: lattice(seed, False), lambda seed: lattice(seed, True), columns]
)
@pytest.mark.parametrize("block", first(1, range(5)))
def test_ties_are_right_after_every_event(make, block):
    for seed in range(5 * block, 5 * block + 5):
        audited_events(make(seed), 100)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("jitter", [False, True])
@pytest.mark.parametrize("block", first(1, range(5)))
def test_lattices_are_right_at_every_contact(jitter, block):
    seeds = range(100 + 12 * block, 112 + 12 * block)
    assert sum(audited_contacts(lattice(seed, jitter), 25) for seed in seeds) > 150


@pytest.mark.parametrize("seed", range(3))
def test_few_bodies_are_right_after_every_event(seed):
    """Small enough to be run interpreted."""
    assert audited_events(random_scene(seed, bodies=6), 60) == 60
    assert audited_events(columns(seed), 40) > 0
    assert audited_events(lattice(seed, jitter=False), 30) > 0


@pytest.mark.compiled
@pytest.mark.parametrize("block", first(1, range(4)))
def test_between_events_the_tiling_is_that_of_brute_force(block):
    compared = 0
    for seed in range(10 * block, 10 * block + 10):
        steps = Steps(random_scene(seed))
        for _ in range(40):
            assert steps.step()
            if steps.to_the_middle():
                compared += 1
                assert tiling_of(steps.state) == steps.by_force(), f"seed {seed}, event {steps.events}"
    assert compared > 300


@pytest.mark.compiled
@pytest.mark.parametrize("name", ["figure-10", "figure-16", "break", "cradle"])
def test_worst_cases_and_billiards_are_right_after_every_event(name):
    audited_events(kt.make_scene(name), 300)


@pytest.mark.slow
@pytest.mark.compiled
def test_bodies_may_leave_an_arena_that_has_no_walls():
    left = 0
    for seed in range(20):
        for scene in (random_scene(seed), lattice(4 * seed, jitter=False), columns(seed)):
            prints = set()
            for phase, audit in (("sweep-tiling", 5), ("naive", None)):
                try:
                    sim = kt.Simulation(scene, phase, narrow_phases=("disc",), audit=audit)
                except Refused:  # without walls, radii may differ less
                    break
                sim.run(until=2000.0 if seed % 5 == 0 else 3.0, max_contacts=200)
                prints.add((sim.fingerprint, sim.positions().tobytes()))
                left += bool(((sim.positions() < 0.0) | (sim.positions() > np.array(scene.arena))).any())
            assert len(prints) <= 1, f"seed {seed}"
    assert left >= 80  # of 120 runs


def beyond_the_proof(ratio: float, mass_ratio: float, scenes: int, contacts: int) -> list[float]:
    """Run random scenes with such radii and masses under naive and, audited, under sweep-tiling; return by
    which factors their skins are wider than the proof allows. Skins wider than an eighth of the smallest
    radius do not count."""
    factors = []
    for seed in range(scenes):
        scene = kt.make_scene(
            "random",
            bodies=5 + seed % 35,
            density=(0.1, 0.3)[seed % 2],
            radius_ratio=ratio,
            mass_ratio=mass_ratio,
            seed=seed,
        )
        tiling = kt.Simulation(scene, "sweep-tiling", audit=10)
        skin = tiling.explain()["numbers"]["skin"]
        if skin > 0.125 * scene.radius.min():
            continue
        naive = kt.Simulation(scene, "naive")
        for sim in (naive, tiling):
            sim.run(until=50.0, max_contacts=contacts)
        assert tiling.fingerprint == naive.fingerprint, f"seed {seed}"
        factors.append(skin / (scene.radius.min() ** 2 / (8.0 * scene.radius.max())))
    return factors


@pytest.mark.compiled
@pytest.mark.parametrize(("ratio", "mass_ratio"), [(1e6, 1.0), (1e6, 1e6), (3e6, 1.0)])
def test_a_skin_wider_than_the_proof_allows(ratio, mass_ratio, monkeypatch):
    take_the_limit_away(monkeypatch)
    assert max(beyond_the_proof(ratio, mass_ratio, 20, 100)) > 5.0


@pytest.mark.compiled
@pytest.mark.long
def test_skins_wider_than_the_proof_allows_by_far(monkeypatch):
    take_the_limit_away(monkeypatch)
    factors = []
    for ratio, mass_ratio in ((1e6, 1.0), (1e6, 1e6), (1e6, 1e9), (3e6, 1.0), (1e7, 1.0)):
        factors += beyond_the_proof(ratio, mass_ratio, 100, 600)
    beyond = [factor for factor in factors if factor > 1.0]
    print(f"{len(factors)} scenes, {len(beyond)} of them beyond the proof, by up to {max(beyond):.3g}")
    assert len(beyond) > 200


@pytest.mark.compiled
@pytest.mark.long
def test_a_quarter_of_a_million_events():
    events = 0
    for seed in range(80):
        events += audited_events(random_scene(seed), 2000)
    for bodies in (25, 49):
        for density in DENSITIES:
            events += audited_events(grid(bodies, density), 3000)
    for _, scene in hard_scenes():
        events += audited_events(scene, 1500)
    for seed in range(200):
        events += audited_events(lattice(seed, jitter=seed % 4 == 3), 250)
        events += audited_events(columns(seed), 250)
    print(f"{events} events audited")
    assert events >= 250_000


@pytest.mark.compiled
@pytest.mark.long
@pytest.mark.parametrize("jitter", [False, True])
@pytest.mark.parametrize("block", range(10))
def test_two_thousand_lattices_of_each_kind(block, jitter):
    contacts = 0
    for seed in range(200 * block, 200 * block + 200):
        contacts += audited_contacts(lattice(seed, jitter), 60)
    print(f"{contacts} contacts audited")
    assert contacts > 5000
