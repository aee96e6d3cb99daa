"""Phases from packages of their own, installed like any other package, give the one answer too."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import kinetile as kt
from agreement import difference, outcome
from kinetile.errors import BadOption, Refused
from kinetile.kernel.compiled import INTERPRETED
from kinetile_conformance import check_broad_phase

LESS = 20 if INTERPRETED else 1
"""How many times shorter the runs are where the loop is interpreted."""

pytestmark = pytest.mark.skipif(
    not {"stripes", "squares"} <= {each.spec.name for each in kt.registry()},
    reason="they are not installed; install them with: "
    "pip install ./tests/foreign/kinetile-stripes ./tests/foreign/kinetile-squares",
)


def assert_as_naive(scene, width=None, *, until=None, max_contacts=None):
    """Assert that stripes give naive's contacts, end and final state, bit for bit; return the simulation."""
    options = {} if width is None else {"width": width}
    most = None if max_contacts is None else max_contacts // LESS
    reference, expected = outcome(scene, "naive", {}, until, most)
    sim, found = outcome(scene, "stripes", options, until, most)
    if found != expected:
        raise AssertionError(difference(reference, sim, "stripes", expected, found))
    return sim


def assert_complete(sim):
    """Assert that candidate pairs are those of neighbouring stripes, with all that touch among them, and that
    the lists of stripes are whole."""
    place, reach = sim.positions(), sim.scene.radius + sim.explain()["numbers"]["skin"]
    a, b = np.triu_indices(len(reach), 1)
    state, n = sim.state, len(sim.scene)
    off = place[:, 0] / state.width[1] - state.stripe
    assert (off > -1e-9).all()
    assert (off < 1.0 + 1e-9).all()
    for slot in range(n, len(state.after)):
        body = state.after[slot]
        while body != slot:
            assert n + state.stripe[body] % n == slot
            assert state.before[state.after[body]] == body
            body = state.after[body]
    near = abs(state.stripe[a] - state.stripe[b]) <= 1
    candidates = set(map(tuple, sim.candidate_pairs().tolist()))
    assert candidates == set(zip(a[near].tolist(), b[near].tolist(), strict=True))
    assert near[np.hypot(*(place[a] - place[b]).T) <= reach[a] + reach[b]].all()


@pytest.mark.parametrize(("name", "kind"), [("stripes", "broad phase"), ("squares", "narrow phase")])
def test_it_is_found_by_name_with_its_distribution(name, kind):
    (row,) = (each for each in kt.registry() if each.spec.name == name)
    assert (row.kind, row.distribution) == (kind, f"kinetile-{name}")


def test_stripes_conform():
    report = check_broad_phase("stripes", examples=5)
    assert report.ok, str(report)


def random_scenes(seed: int) -> Iterator[kt.Scene]:
    rng = np.random.default_rng(seed)
    for ratio in (1.0, 3.0, 20.0, 300.0):
        bodies, density = int(rng.integers(1, 121)), float(rng.uniform(0.05, 0.3))
        mass_ratio = float(rng.choice([1.0, 1e6]))
        yield kt.make_scene(
            "random", bodies=bodies, density=density, radius_ratio=ratio, mass_ratio=mass_ratio, seed=seed
        )


@pytest.mark.parametrize("seed", range(10))
def test_random_scenes(seed):
    for scene in random_scenes(seed):
        assert_as_naive(scene, max_contacts=1000)


@pytest.mark.parametrize("jitter", [0.0, 1e-15, 1e-10])
@pytest.mark.parametrize("turns", [0, 12])
@pytest.mark.parametrize("kind", ["dyadic", "non-dyadic"])
def test_lattices_with_exact_ties(kind, turns, jitter):
    """With centres on the borders of stripes, or anywhere."""
    for seed in range(12):
        bodies = 4 + seed % 5 * 4
        scene = kt.make_scene("lattice", bodies=bodies, kind=kind, jitter=jitter, turns=turns, seed=seed)
        assert_as_naive(scene, (0.25, None, 0.125)[seed % 3], until=6.0, max_contacts=200)


def test_bodies_that_stand_on_borders_and_change_their_mind_there():
    position = [[x, 0.125 + 0.25 * row] for x in (0.25, 0.75) for row in range(4)]
    velocity = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 0.0]] * 2
    turns = [kt.Turn(body, tick / 8, ((-1.0) ** tick, 0.0)) for body in (0, 3, 4) for tick in range(1, 9)]
    turns += [kt.Turn(1, 0.25, (0.0, 0.0)), kt.Turn(5, 0.25, (0.0, 0.0)), kt.Turn(5, 1.0, (-1.0, 0.0))]
    scene = kt.Scene(position, velocity, 0.0625, arena=(1.0, 1.0), turns=turns)
    for width in (0.25, 0.125, 0.0):
        assert_complete(assert_as_naive(scene, width, until=3.0))


def test_bodies_fall_through_stripes():
    """In a frame that falls they are outside of the arena at times; stripes know nothing of it."""
    scene = kt.make_scene("random", bodies=40, density=0.3, seed=2, gravity=(2.0, -1.0))
    sim = assert_as_naive(scene, max_contacts=4000)
    assert sim.scene.falls


@pytest.mark.parametrize("arena", [True, False])
@pytest.mark.parametrize(("ratio", "width"), [(2.0, 0.0), (20.0, 0.0), (20.0, 0.01), (20.0, 0.5)])
def test_every_two_that_touch_are_a_candidate_pair(ratio, width, arena):
    made = kt.make_scene("random", bodies=60, density=0.3, radius_ratio=ratio, seed=5)
    scene = made if arena else kt.Scene(made.position - 0.5, made.velocity, made.radius)
    sim = kt.Simulation(scene, "stripes", options={"width": width}, audit=50)
    assert_complete(sim)
    for time in np.linspace(0.01, 1.5, 30):
        sim.run(until=float(time))
        assert_complete(sim)
    assert sim.readings.structural_events > 30


def test_a_turn_that_widens_the_skin_builds_the_structure_again():
    scene = kt.make_scene("random", bodies=25, density=0.3, radius_ratio=20.0, seed=2)
    sims = [kt.Simulation(scene, phase) for phase in ("naive", "stripes")]
    for sim in sims:
        sim.run(until=0.3)
        sim.set_velocity(7, (4000.0, -3000.0))
        sim.run(until=0.301)
    assert_complete(sims[1])
    assert sims[0].fingerprint == sims[1].fingerprint
    skin = sims[1].explain()["numbers"]["skin"]
    assert sims[1].state.width[1] == 2.0 * (scene.radius.max() + skin)


def test_far_from_the_origin_and_long_after_the_start():
    scene = kt.Scene([[-900.0, 1.0], [-3.0, 1.5], [500.0, 1.0]], [[0.5, 0.0], [0.0, 0.0], [-0.25, 0.0]], 0.5)
    sim = assert_as_naive(scene, until=9000.0)
    assert len(sim.contacts) > 0
    assert_complete(sim)


@pytest.mark.parametrize("gap", [10.0, 1e3, 1e6])
def test_bodies_a_whole_turn_of_the_table_apart_are_not_near(gap):
    scene = kt.Scene([[-gap, 0.5], [0.0, 0.5], [gap, 0.5]], [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.5)
    assert_complete(assert_as_naive(scene, 1.0, max_contacts=3 * LESS))


@pytest.mark.parametrize("width", [-1.0, np.nan, np.inf])
def test_a_width_that_is_none(width):
    with pytest.raises(BadOption, match="width must be a finite number"):
        kt.Simulation(kt.make_scene("two-discs"), "stripes", options={"width": width})


def test_it_draws_its_stripes_and_the_next_certificate():
    sim = kt.Simulation(kt.make_scene("random", bodies=8, density=0.3, radius_ratio=2.0, seed=3), "stripes")
    sim.run(until=0.1)
    items, event = sim.drawing(), sim.next_event
    width, stripes = float(sim.state.width[1]), sim.state.stripe.tolist()
    borders = {item.a[0] for item in items if item.role == "cell"}
    assert borders == {(stripe + side) * width for stripe in stripes for side in (0, 1)}
    assert [item.a[0].body for item in items if item.role == "certificate"] == list(range(len(stripes)))
    if event.kind == "structural":
        assert min(item.fails for item in items if item.fails) == event.epoch * 2**52 + event.tick


def test_squares_conform():
    report = check_broad_phase("cells", narrow_phases=["squares"], examples=20)
    assert report.ok, str(report)
    assert [each.check for each in report.results if each.status == "passed"] == [
        "a-contact-depends-on-two-plans-alone-of-shapes",
        "a-contact-adds-no-energy-of-shapes",
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
