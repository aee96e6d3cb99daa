"""Phases from packages of their own, installed as anybody's would be, give the one answer too."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import kinetile as kt
from agreement import difference, outcome
from kinetile.errors import BadOption, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile_conformance import check_broad_phase

NAMES = ("stripes", "boxes")
WIDTH = {"stripes": "width", "boxes": "side"}
"""The option of each that is a length."""

LESS = 20 if INTERPRETED else 1
"""How many times shorter the runs are where the loop is interpreted."""

pytestmark = pytest.mark.skipif(
    not {*NAMES, "squares"} <= {each.spec.name for each in kt.registry()},
    reason="they are not installed; install them with: pip install ./tests/foreign/kinetile-stripes "
    "./tests/foreign/kinetile-boxes ./tests/foreign/kinetile-squares",
)
both = pytest.mark.parametrize("name", NAMES)


def assert_as_naive(name, scene, width=None, *, until=None, max_contacts=None):
    """Assert that a phase gives naive's contacts, end and final state, bit for bit; return its simulation."""
    options = {} if width is None else {WIDTH[name]: width}
    most = None if max_contacts is None else max_contacts // LESS
    reference, expected = outcome(scene, "naive", {}, until, most)
    sim, found = outcome(scene, name, options, until, most)
    if found != expected:
        raise AssertionError(difference(reference, sim, name, expected, found))
    return sim


def assert_complete(sim):
    """Assert that a phase's candidate pairs are those that its state says, with all that touch among them."""
    place, reach = sim.positions(), sim.scene.radius + sim.explain()["numbers"]["skin"]
    a, b = np.triu_indices(len(reach), 1)
    near = {"stripes": in_neighbouring_stripes, "boxes": in_common_cells}[sim.broad_phase](sim, a, b)
    candidates = set(map(tuple, sim.candidate_pairs().tolist()))
    assert candidates == set(zip(a[near].tolist(), b[near].tolist(), strict=True))
    assert near[np.hypot(*(place[a] - place[b]).T) <= reach[a] + reach[b]].all()


def in_neighbouring_stripes(sim, a, b):
    """Return which pairs are in one stripe or in two beside each other; the lists of stripes are whole."""
    state, n = sim.state, len(sim.scene)
    off = sim.positions()[:, 0] / state.width[1] - state.stripe
    assert (off > -1e-9).all()
    assert (off < 1.0 + 1e-9).all()
    for slot in range(n, len(state.after)):
        body = state.after[slot]
        while body != slot:
            assert n + state.stripe[body] % n == slot
            assert state.before[state.after[body]] == body
            body = state.after[body]
    return abs(state.stripe[a] - state.stripe[b]) <= 1


def in_common_cells(sim, a, b):
    """Return which pairs' cells overlap; each pair is named once."""
    named = sim.near()
    assert len(np.unique(named, axis=0)) == len(named)
    first, beyond = sim.state.box[:, :2], sim.state.box[:, :2] + sim.state.box[:, 2:3]
    return ((first[a] < beyond[b]) & (first[b] < beyond[a])).all(axis=1)


@both
def test_it_is_found_by_name_with_its_distribution(name):
    (row,) = (each for each in kt.registry() if each.spec.name == name)
    assert (row.kind, row.distribution) == ("broad phase", f"kinetile-{name}")


def test_it_conforms():
    """`boxes` does; of `stripes` docs/writing-a-broad-phase.md says so, and CI."""
    report = check_broad_phase("boxes", examples=5)
    assert report.ok, str(report)


def random_scenes(seed: int) -> Iterator[kt.Scene]:
    rng = np.random.default_rng(seed)
    for ratio in (1.0, 3.0, 20.0, 300.0):
        bodies, density = int(rng.integers(1, 121)), float(rng.uniform(0.05, 0.3))
        mass_ratio = float(rng.choice([1.0, 1e6]))
        yield kt.make_scene(
            "random", bodies=bodies, density=density, radius_ratio=ratio, mass_ratio=mass_ratio, seed=seed
        )


@both
@pytest.mark.parametrize("seed", range(10))
def test_random_scenes(name, seed):
    for scene in random_scenes(seed):
        assert_as_naive(name, scene, max_contacts=1000)


@both
@pytest.mark.parametrize("jitter", [0.0, 1e-15, 1e-10])
@pytest.mark.parametrize("turns", [0, 12])
@pytest.mark.parametrize("kind", ["dyadic", "non-dyadic"])
def test_lattices_with_exact_ties(name, kind, turns, jitter):
    """With centres on the borders of stripes and cells, or anywhere."""
    for seed in range(12):
        bodies = 4 + seed % 5 * 4
        scene = kt.make_scene("lattice", bodies=bodies, kind=kind, jitter=jitter, turns=turns, seed=seed)
        assert_as_naive(name, scene, (0.25, None, 0.125)[seed % 3], until=6.0, max_contacts=200)


@both
def test_bodies_that_stand_on_borders_and_change_their_mind_there(name):
    position = [[x, 0.125 + 0.25 * row] for x in (0.25, 0.75) for row in range(4)]
    velocity = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 0.0]] * 2
    turns = [kt.Turn(body, tick / 8, ((-1.0) ** tick, 0.0)) for body in (0, 3, 4) for tick in range(1, 9)]
    turns += [kt.Turn(1, 0.25, (0.0, 0.0)), kt.Turn(5, 0.25, (0.0, 0.0)), kt.Turn(5, 1.0, (-1.0, 0.0))]
    scene = kt.Scene(position, velocity, 0.0625, arena=(1.0, 1.0), turns=turns)
    for width in (0.25, 0.125, 0.0):
        assert_complete(assert_as_naive(name, scene, width, until=3.0))


@both
@pytest.mark.parametrize("arena", [True, False])
@pytest.mark.parametrize(("ratio", "width"), [(2.0, 0.0), (20.0, 0.0), (20.0, 0.01), (20.0, 0.5)])
def test_every_two_that_touch_are_a_candidate_pair(name, ratio, width, arena):
    made = kt.make_scene("random", bodies=60, density=0.3, radius_ratio=ratio, seed=5)
    scene = made if arena else kt.Scene(made.position - 0.5, made.velocity, made.radius)
    sim = kt.Simulation(scene, name, options={WIDTH[name]: width}, audit=50)
    assert_complete(sim)
    for time in np.linspace(0.01, 1.5, 30):
        sim.run(until=float(time))
        assert_complete(sim)
    assert sim.readings.structural_events > 30


@both
def test_a_turn_that_widens_the_skin_builds_the_structure_anew(name):
    scene = kt.make_scene("random", bodies=25, density=0.3, radius_ratio=20.0, seed=2)
    sims = [kt.Simulation(scene, phase) for phase in ("naive", name)]
    for sim in sims:
        sim.run(until=0.3)
        sim.set_velocity(7, (4000.0, -3000.0))
        sim.run(until=0.301)
    assert_complete(sims[1])
    assert sims[0].fingerprint == sims[1].fingerprint
    if name == "stripes":
        skin = sims[1].explain()["numbers"]["skin"]
        assert sims[1].state.width[1] == 2.0 * (scene.radius.max() + skin)


@both
def test_far_from_the_origin_and_long_after_the_start(name):
    scene = kt.Scene([[-900.0, 1.0], [-3.0, 1.5], [500.0, 1.0]], [[0.5, 0.0], [0.0, 0.0], [-0.25, 0.0]], 0.5)
    sim = assert_as_naive(name, scene, until=9000.0)
    assert len(sim.contacts) > 0
    assert_complete(sim)


@both
@pytest.mark.parametrize("gap", [10.0, 1e3, 1e6])
def test_bodies_a_whole_turn_of_the_table_apart_are_not_near(name, gap):
    scene = kt.Scene([[-gap, 0.5], [0.0, 0.5], [gap, 0.5]], [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.5)
    assert_complete(assert_as_naive(name, scene, 1.0, max_contacts=3 * LESS))


def test_one_wide_body_among_many_small_ones():
    """The wide one is in as many cells as there is room for, and no cell of the table is its own twice."""
    for side in (0.0, 1e-9):
        sim = assert_as_naive("boxes", kt.make_scene("figure-16", bodies=100), side, max_contacts=500)
        assert (sim.state.box[:, 2] <= sim.state.table.min()).all()
        assert_complete(sim)


@both
@pytest.mark.parametrize("width", [-1.0, np.nan, np.inf])
def test_a_width_that_is_none(name, width):
    with pytest.raises(BadOption, match=f"{WIDTH[name]} must be a finite number"):
        kt.Simulation(kt.make_scene("two-discs"), name, options={WIDTH[name]: width})


@both
def test_it_draws_what_it_keeps(name):
    sim = kt.Simulation(kt.make_scene("random", bodies=8, density=0.3, radius_ratio=2.0, seed=3), name)
    sim.run(until=0.1)
    items, event = sim.drawing(), sim.next_event
    place, reach = sim.positions().tolist(), sim.scene.radius.tolist()
    if name == "stripes":
        width, stripes = float(sim.state.width[1]), sim.state.stripe.tolist()
        borders = {item.a[0] for item in items if item.role == "cell"}
        assert borders == {(stripe + side) * width for stripe in stripes for side in (0, 1)}
        ahead = [item.a[0].body for item in items if item.role == "certificate"]
        assert ahead == list(range(len(place)))
    else:
        for item, at, r in zip(items, place, reach, strict=True):
            low, high = np.array(item.low), np.array(item.high)
            assert (high - low) / float(sim.state.side[1]) == pytest.approx([int(item.label[0])] * 2)
            assert (low - 1e-9 <= np.array(at) - r).all()
            assert (np.array(at) + r <= high + 1e-9).all()
    if event.kind == "structural":
        assert min(item.fails for item in items if item.fails) == event.epoch * 2**52 + event.tick


def test_squares_conform():
    report = check_broad_phase("cells", narrow_phases=["squares"], examples=20)
    assert report.ok, str(report)
    assert [each.check for each in report.results if each.status == "passed"] == [
        "a-contact-of-shapes-depends-on-two-plans-alone",
        "same-contacts-as-convex",
    ]


SIDES = (1.0, 0.1, 0.7, 1e-3, 1.0 / 3.0)


@pytest.mark.parametrize("seed", range(8))
def test_squares_give_the_list_of_convex(seed):
    """Of sides whose sums are no doubles, and on a lattice, where sides and corners meet at one tick."""
    rng = np.random.default_rng(seed)
    lattice = seed % 2 == 0
    place = [(1.0 + 1.5 * column, 1.0 + 1.5 * row) for row in range(5) for column in range(5)]
    velocity = rng.integers(-2, 3, (25, 2)) / 2.0 if lattice else rng.normal(size=(25, 2))
    scene = kt.Scene(
        place,
        velocity,
        mass=rng.choice([1.0, 2.0, np.inf], 25),
        shape=rng.integers(0, len(SIDES), 25) if not lattice else 0,
        shapes=[kt.box(side, side) for side in SIDES],
        arena=(8.0, 8.0),
    )
    prints = set()
    for broad, narrow in (("naive", "convex"), ("naive", "squares"), ("cells", "squares")):
        sim = kt.Simulation(scene, broad, narrow_phases=[narrow, "wall"])
        sim.run(max_contacts=1000 // LESS)
        assert len(sim.contacts) == 1000 // LESS
        prints.add(sim.fingerprint)
    assert len(prints) == 1


def test_squares_refuse_what_is_no_square():
    scene = kt.Scene([(1.0, 1.0)], [(0.0, 0.0)], shape=kt.box(1.0, 0.5))
    with pytest.raises(Refused, match="all boxes are squares"):
        kt.Simulation(scene, narrow_phases=["squares"])
