"""The thesis's claims on sweep-tiling (sections 4 and 4.4), as tests."""

from collections import Counter

import pytest

import kinetile as kt
from kinetile_plugins.sweep_tiling.audit import tiles_of
from lanes import SHARED, first
from tilings import Steps, random_scene

SCENES = {
    "random": lambda: kt.make_scene("random", bodies=60, density=0.25, radius_ratio=3.0, seed=3),
    "all sizes": lambda: random_scene(5, bodies=60),
    "grid, dense": lambda: kt.make_scene("grid", bodies=49, density=0.5, seed=1),
    "grid, thin": lambda: kt.make_scene("grid", bodies=49, density=0.01, seed=2),
    "figure 16": lambda: kt.make_scene("figure-16"),
}


def ends(steps: Steps) -> Counter[tuple[int, int]]:
    tiles = tiles_of(steps.engine.k, steps.state)
    return Counter(zip(tiles.top.tolist(), tiles.bottom.tolist(), strict=True))


@pytest.mark.compiled
@pytest.mark.parametrize("name", first(2, [*SCENES]))
def test_one_tile_is_destroyed_and_one_is_made_at_each_event(name):
    """So there are 3n + 1 always. Top and bottom distinguish the tiles."""
    steps = Steps(SCENES[name]())
    n = len(steps.state.level)
    before = ends(steps)
    structural = 0
    while structural < 1000:
        passes = steps.next_bounds is not None
        structural += passes
        assert steps.step()
        after = ends(steps)
        assert after.total() == 3 * n + 1
        destroyed, made = before - after, after - before
        assert (destroyed.total(), made.total()) == ((1, 1) if passes else (0, 0))
        before = after


@pytest.mark.compiled
@pytest.mark.parametrize("name", first(2, [*SCENES]))
def test_its_pairs_are_among_those_of_sap_1d_at_every_contact(name):
    scene = SCENES[name]()
    tiling, sap = kt.Simulation(scene, "sweep-tiling"), kt.Simulation(scene, "sap-1d")
    for _ in range(250):
        few, many = set(), set()
        for sim, found in ((tiling, few), (sap, many)):
            sim.run(max_contacts=1)
            found.update((int(a), int(b)) for a, b in sim.candidate_pairs())
        assert tiling.time == sap.time
        assert few <= many
        assert len(few) <= 3 * len(scene) - 6


@pytest.mark.compiled
def test_at_most_3n_minus_6_pairs_and_it_comes_near():
    """In a dense scene nearly as many bodies see each other as can: walls cost some."""
    scene = kt.make_scene("grid", bodies=400, density=0.5, seed=1)
    sim = kt.Simulation(scene, "sweep-tiling", narrow_phases=SHARED)
    sim.run(until=0.2)
    assert 0.85 * (3 * 400 - 6) < len(sim.candidate_pairs()) <= 3 * 400 - 6
