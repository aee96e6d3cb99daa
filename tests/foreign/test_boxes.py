"""A broad phase for mixed sizes, from a package of its own, gives the one answer too."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from agreement import difference, outcome
from kinetile.errors import BadOption
from kinetile.kernel.compiled import INTERPRETED
from kinetile_conformance import check_broad_phase

pytestmark = pytest.mark.skipif(
    "boxes" not in kt.registry().names("broad phase"),
    reason="kinetile-boxes is not installed; install it with: pip install ./tests/foreign/kinetile-boxes",
)

LESS = 20 if INTERPRETED else 1
"""How many times shorter the runs are where the loop is interpreted."""


def assert_as_naive(scene, options=None, *, until=None, max_contacts=None):
    """Assert that boxes gives naive's contacts, end and final state, bit for bit; return its simulation."""
    reference, expected = outcome(scene, "naive", {}, until, max_contacts)
    sim, found = outcome(scene, "boxes", options or {}, until, max_contacts)
    if found != expected:
        raise AssertionError(difference(reference, sim, "boxes", expected, found))
    return sim


def assert_pairs_share_cells(sim):
    """Assert that candidate pairs are those whose cells overlap, each named once, with all that touch."""
    box, place = sim.state.box, sim.positions()
    reach = sim.scene.radius + sim.explain()["numbers"]["skin"]
    a, b = np.triu_indices(len(box), 1)
    first, beyond = box[:, :2], box[:, :2] + box[:, 2:3]
    sharing = ((first[a] < beyond[b]) & (first[b] < beyond[a])).all(axis=1)
    candidates = set(map(tuple, sim.candidate_pairs().tolist()))
    assert candidates == set(zip(a[sharing].tolist(), b[sharing].tolist(), strict=True))
    touching = np.hypot(*(place[a] - place[b]).T) <= reach[a] + reach[b]
    assert sharing[touching].all()
    named = sim.near()
    assert len(np.unique(named, axis=0)) == len(named)


def test_it_is_found_by_name_with_its_distribution():
    row = next(p for p in kt.registry() if p.spec.name == "boxes")
    assert row.kind == "broad phase"
    assert row.distribution == "kinetile-boxes"


def test_it_conforms():
    report = check_broad_phase("boxes", examples=5)
    assert report.ok, str(report)


@pytest.mark.parametrize("radius_ratio", [1.0, 20.0, 300.0])
@pytest.mark.parametrize("seed", range(10))
def test_random_scenes(seed, radius_ratio):
    rng = np.random.default_rng(seed)
    scene = kt.make_scene(
        "random",
        bodies=int(rng.integers(1, 121)),
        density=float(rng.uniform(0.05, 0.3)),
        radius_ratio=radius_ratio,
        seed=seed,
    )
    assert_as_naive(scene, max_contacts=1000 // LESS)


@pytest.mark.parametrize("side", [0.0, 0.125, 0.25])
@pytest.mark.parametrize("turns", [0, 12])
@pytest.mark.parametrize("kind", ["dyadic", "non-dyadic"])
def test_lattices_with_exact_ties(kind, turns, side):
    for seed in range(12):
        scene = kt.make_scene("lattice", bodies=4 + seed % 5 * 4, kind=kind, turns=turns, seed=seed)
        assert_as_naive(scene, {"side": side}, until=6.0, max_contacts=200 // LESS)


@pytest.mark.parametrize("arena", [True, False])
@pytest.mark.parametrize("side", [0.0, 0.01, 0.5])
def test_pairs_are_those_that_share_a_cell(arena, side):
    made = kt.make_scene("random", bodies=60, density=0.3, radius_ratio=20.0, seed=5)
    scene = made if arena else kt.Scene(made.position - 0.5, made.velocity, made.radius)
    sim = kt.Simulation(scene, "boxes", options={"side": side}, audit=50)
    assert_pairs_share_cells(sim)
    for time in np.linspace(0.01, 1.0, 20):
        sim.run(until=float(time))
        assert_pairs_share_cells(sim)


@pytest.mark.parametrize("gap", [10.0, 1e3, 1e6])
def test_bodies_a_whole_turn_of_the_table_apart_are_not_near(gap):
    scene = kt.Scene([[-gap, 0.5], [0.0, 0.5], [gap, 0.5]], [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.5)
    sim = assert_as_naive(scene, {"side": 1.0}, max_contacts=3)
    assert_pairs_share_cells(sim)


def test_one_wide_body_among_many_small_ones():
    """The wide one is in as many cells as there is room for, and no cell of the table is its own twice."""
    made = kt.make_scene("figure-16", bodies=100)
    for side in (0.0, 1e-9):
        sim = assert_as_naive(made, {"side": side}, max_contacts=500 // LESS)
        assert (sim.state.box[:, 2] <= sim.state.table.min()).all()
        assert_pairs_share_cells(sim)


def test_a_turn_that_widens_the_skin_builds_the_cells_anew():
    scene = kt.make_scene("random", bodies=25, density=0.3, radius_ratio=20.0, seed=2)
    sims = [kt.Simulation(scene, phase) for phase in ("naive", "boxes")]
    for sim in sims:
        sim.run(until=0.3)
        sim.set_velocity(7, (4000.0, -3000.0))
        sim.run(until=0.301)
    assert_pairs_share_cells(sims[1])
    assert sims[0].fingerprint == sims[1].fingerprint


@pytest.mark.parametrize("side", [-1.0, np.nan, np.inf])
def test_a_side_that_is_none(side):
    with pytest.raises(BadOption, match="side must be a finite number"):
        kt.Simulation(kt.make_scene("two-discs"), "boxes", options={"side": side})


def test_it_draws_what_it_keeps():
    sim = kt.Simulation(kt.make_scene("random", bodies=8, density=0.3, radius_ratio=2.0, seed=3), "boxes")
    sim.run(until=0.1)
    items, event = sim.drawing(), sim.next_event
    side, place, reach = float(sim.state.side[1]), sim.positions(), sim.scene.radius
    assert len(items) == len(place)
    for item, (x, y), r in zip(items, place.tolist(), reach.tolist(), strict=True):
        assert item.high[0] - item.low[0] == pytest.approx(item.high[1] - item.low[1])
        assert (item.high[0] - item.low[0]) / side == pytest.approx(int(item.label[0]))
        for at, low, high in zip((x, y), item.low, item.high, strict=True):
            assert low - 1e-9 <= at - r
            assert at + r <= high + 1e-9
    if event.kind == "structural":
        assert min(item.fails for item in items if item.fails) == event.epoch * 2**52 + event.tick
