"""A broad phase from a package of its own, installed as anybody's would be, gives the one answer too."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from agreement import difference, outcome
from kinetile.errors import BadOption
from kinetile.kernel.compiled import INTERPRETED

pytestmark = pytest.mark.skipif(
    "stripes" not in kt.registry().names("broad phase"),
    reason="kinetile-stripes is not installed; install it with: pip install ./tests/foreign/kinetile-stripes",
)

LESS = 20 if INTERPRETED else 1
"""How many times shorter the runs are where the loop is interpreted."""


def assert_as_naive(scene, options=None, *, until=None, max_contacts=None):
    """Assert that stripes gives naive's contacts, end and final state, bit for bit; return its simulation."""
    reference, expected = outcome(scene, "naive", {}, until, max_contacts)
    sim, found = outcome(scene, "stripes", options or {}, until, max_contacts)
    if found != expected:
        raise AssertionError(difference(reference, sim, "stripes", expected, found))
    return sim


def skin(sim):
    """Return by how much bodies are fattened for the broad phase, as a length."""
    return sim.explain()["numbers"]["skin"]


def assert_complete(sim):
    """Assert that any two bodies whose fattened discs touch are a candidate pair, and the lists are whole."""
    place, reach, state = sim.positions(), sim.scene.radius + skin(sim), sim.state
    a, b = np.triu_indices(len(reach), 1)
    touching = np.hypot(*(place[a] - place[b]).T) <= reach[a] + reach[b]
    candidates = set(map(tuple, sim.candidate_pairs().tolist()))
    assert set(zip(a[touching].tolist(), b[touching].tolist(), strict=True)) <= candidates
    near = abs(state.stripe[a] - state.stripe[b]) <= 1
    assert candidates == set(zip(a[near].tolist(), b[near].tolist(), strict=True))
    off = place[:, 0] / state.width[1] - state.stripe
    assert (off > -1e-9).all()
    assert (off < 1.0 + 1e-9).all()
    n = len(reach)
    for slot in range(n, len(state.after)):
        body = state.after[slot]
        while body != slot:
            assert n + state.stripe[body] % n == slot
            assert state.before[state.after[body]] == body
            body = state.after[body]


def test_it_is_found_by_name_with_its_distribution():
    row = next(p for p in kt.registry() if p.spec.name == "stripes")
    assert row.kind == "broad phase"
    assert row.distribution == "kinetile-stripes"


@pytest.mark.parametrize("density", [0.5, 0.25, 0.125, 0.01])
@pytest.mark.parametrize("bodies", [25, 100])
def test_the_grid(bodies, density):
    assert_as_naive(
        kt.make_scene("grid", bodies=bodies, density=density, seed=3), max_contacts=20 * bodies // LESS
    )


@pytest.mark.parametrize("seed", range(20))
def test_random_scenes(seed):
    rng = np.random.default_rng(seed)
    scene = kt.make_scene(
        "random",
        bodies=int(rng.integers(1, 41)),
        density=float(rng.uniform(0.05, 0.3)),
        radius_ratio=float(rng.choice([1.0, 3.0, 20.0])),
        mass_ratio=float(rng.choice([1.0, 1e6])),
        seed=seed,
    )
    assert_as_naive(scene, max_contacts=400 // LESS)


@pytest.mark.parametrize("jitter", [0.0, 1e-15, 1e-10])
@pytest.mark.parametrize("turns", [0, 12])
@pytest.mark.parametrize("kind", ["dyadic", "non-dyadic"])
def test_lattices_with_exact_ties(kind, turns, jitter):
    for seed in range(12):
        bodies = 4 + seed % 5 * 4
        scene = kt.make_scene("lattice", bodies=bodies, kind=kind, jitter=jitter, turns=turns, seed=seed)
        options = {"width": 0.25} if seed % 2 else {}  # centres on the borders of stripes, or anywhere
        assert_as_naive(scene, options, until=6.0, max_contacts=200 // LESS)


def test_bodies_that_stand_on_borders_and_change_their_mind_there():
    position = [[0.25, 0.125 + 0.25 * row] for row in range(4)] + [
        [0.75, 0.125 + 0.25 * row] for row in range(4)
    ]
    velocity = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 0.0]] * 2
    turns = [kt.Turn(body, tick / 8, ((-1.0) ** tick, 0.0)) for body in (0, 3, 4) for tick in range(1, 9)]
    turns += [kt.Turn(1, 0.25, (0.0, 0.0)), kt.Turn(5, 0.25, (0.0, 0.0)), kt.Turn(5, 1.0, (-1.0, 0.0))]
    scene = kt.Scene(position, velocity, 0.0625, arena=(1.0, 1.0), turns=turns)
    for width in (0.25, 0.125, 0.0):
        assert_complete(assert_as_naive(scene, {"width": width}, until=3.0))


@pytest.mark.parametrize("arena", [True, False])
def test_every_two_that_touch_are_a_candidate_pair(arena):
    made = kt.make_scene("random", bodies=60, density=0.3, radius_ratio=2.0, seed=5)
    scene = made if arena else kt.Scene(made.position - 0.5, made.velocity, made.radius)
    sim = kt.Simulation(scene, "stripes")
    assert_complete(sim)
    for time in np.linspace(0.01, 1.5, 40):
        sim.run(until=float(time))
        assert_complete(sim)
    assert sim.readings.structural_events > 100


def test_a_turn_that_widens_the_skin_builds_the_stripes_anew():
    scene = kt.make_scene("grid", bodies=25, density=0.3, seed=2)
    sims = [kt.Simulation(scene, phase) for phase in ("naive", "stripes")]
    for sim in sims:
        sim.run(until=0.3)
        sim.set_velocity(7, (40.0, -30.0))
        sim.run(until=0.6)
    widths = sims[1].state.width
    assert widths[1] == 2.0 * (scene.radius.max() + skin(sims[1]))
    assert_complete(sims[1])
    assert sims[0].contacts.tobytes() == sims[1].contacts.tobytes()
    assert sims[0].fingerprint == sims[1].fingerprint


def test_far_from_the_origin_and_long_after_the_start():
    scene = kt.Scene([[-900.0, 1.0], [-3.0, 1.5], [500.0, 1.0]], [[0.5, 0.0], [0.0, 0.0], [-0.25, 0.0]], 0.5)
    sim = assert_as_naive(scene, until=9000.0)
    assert len(sim.contacts) > 0
    assert_complete(sim)


def test_the_empty_scene_and_one_body():
    assert len(assert_as_naive(kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 0.1), until=1.0).contacts) == 0
    one = kt.Scene([[0.5, 0.5]], [[1.0, 0.25]], 0.1, arena=(1.0, 1.0))
    assert len(assert_as_naive(one, until=5.0).contacts) > 0


@pytest.mark.parametrize("width", [-1.0, np.nan, np.inf])
def test_a_width_that_is_none(width):
    with pytest.raises(BadOption, match="width must be a finite number"):
        kt.Simulation(kt.make_scene("two-discs"), "stripes", options={"width": width})


def test_it_draws_what_it_keeps():
    sim = kt.Simulation(kt.make_scene("random", bodies=8, density=0.3, radius_ratio=2.0, seed=3), "stripes")
    sim.run(until=0.1)
    items, event = sim.drawing(), sim.next_event
    borders = {item.a[0] for item in items if item.role == "cell"}
    width = float(sim.state.width[1])
    assert borders == {(stripe + side) * width for stripe in sim.state.stripe.tolist() for side in (0, 1)}
    ahead = [item for item in items if item.role == "certificate"]
    assert [item.a[0].body for item in ahead] == list(range(len(sim.state.stripe)))
    if event.kind == "structural":
        assert min(item.fails for item in items if item.fails) == event.epoch * 2**52 + event.tick
