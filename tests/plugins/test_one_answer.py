"""The law: every broad phase gives the same contacts, compared with ``==``, on random and on hard scenes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from agreement import ALL, assert_one_answer, lattice_scene, outcome
from kinetile.errors import ZenoError
from kinetile.kernel import skin
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile_conformance import check_broad_phase
from lanes import BUILT_IN, first


@pytest.mark.quick
@pytest.mark.compiled
def test_two_phases_compile_and_have_one_answer():
    sims = [kt.Simulation(kt.make_scene("grid", bodies=25), phase) for phase in ("cells", "naive")]
    for sim in sims:
        sim.run(until=1.0)
    assert sims[0].fingerprint == sims[1].fingerprint


def random_scene(seed: int) -> kt.Scene:
    rng = np.random.default_rng(seed)
    return kt.make_scene(
        "random",
        bodies=int(rng.integers(2, 41)),
        density=float(rng.choice([0.02, 0.1, 0.2])),
        radius_ratio=float(10.0 ** rng.uniform(0, 2)),
        mass_ratio=float(10.0 ** rng.uniform(0, 6)),
        seed=seed,
    )


@pytest.mark.compiled
@pytest.mark.parametrize("block", first(2, range(10)))
def test_two_hundred_random_scenes_of_all_sizes_and_masses(block):
    for seed in range(20 * block, 20 * block + 20):
        assert_one_answer(random_scene(seed), max_contacts=400)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("name", ["figure-10", "figure-11", "figure-16", "break", "two-discs", "cradle"])
def test_the_worst_cases_and_the_billiards(name):
    assert_one_answer(kt.make_scene(name), until=20.0, max_contacts=2000)


def assert_agrees(scene: kt.Scene, until: float, contacts: int) -> None:
    """Asserts one answer; jams must be found by all at the same contact."""
    reference = kt.Simulation(scene, "naive")
    try:
        reference.run(until=until, max_contacts=contacts)
        ends = "ran"
    except ZenoError as error:
        ends = type(error).__name__
    assert_one_answer(scene, until=until, max_contacts=contacts, ends=ends)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("block", first(4, range(16)))
def test_a_sample_of_the_lattices(block):
    for seed in range(50 * block, 50 * block + 50):
        assert_agrees(lattice_scene(seed), 20.0, 200)


@pytest.mark.compiled
def test_lattices_do_have_exact_ties():
    tied = total = 0
    for seed in range(0, 200, 8):
        sim = kt.Simulation(lattice_scene(seed), "cells")
        sim.run(until=20.0, max_contacts=200)
        moments = sim.contacts["epoch"] * 2**52 + sim.contacts["tick"]
        tied += int((np.diff(moments) == 0).sum())
        total += len(moments)
    assert tied > 0.05 * total


dyadic = st.integers(-8, 8).map(lambda i: i / 4)


@st.composite
def tie_scenes(draw):
    """Few bodies in small dyadic numbers, on a line or in the plane: what shrinks, and what ties."""
    n = draw(st.integers(1, 6))
    line = draw(st.booleans())
    cells = draw(
        st.lists(
            st.tuples(st.integers(0, 7), st.just(0) if line else st.integers(0, 3)),
            min_size=n,
            max_size=n,
            unique=True,
        )
    )
    radius = [draw(st.sampled_from([0.5, 0.25, 0.125])) for _ in range(n)]
    nudge = [draw(st.sampled_from([0.0, 0.25, -0.25])) if r < 0.5 else 0.0 for r in radius]
    position = [(x + 0.5 + d, y + 0.5) for (x, y), d in zip(cells, nudge, strict=True)]
    velocity = [(draw(dyadic), 0.0 if line and draw(st.booleans()) else draw(dyadic)) for _ in range(n)]
    mass = [draw(st.sampled_from([1.0, 1.0, 2.0, 0.5])) for _ in range(n)]
    turns = [
        (body, draw(st.integers(0, 32)) / 8, (draw(dyadic), draw(dyadic)))
        for body in range(n)
        for _ in range(draw(st.integers(0, 1)))
    ]
    arena = (8.0, 4.0) if draw(st.booleans()) else None
    return kt.Scene(position, velocity, radius, mass, arena, turns=turns)


@given(tie_scenes())
@settings(max_examples=6 if NOTHING_IS_COMPILED else 150)
def test_small_dyadic_scenes(scene):
    assert_agrees(scene, 8.0, 300)


wide = st.floats(-1e3, 1e3, allow_nan=False)


@st.composite
def wide_scenes(draw):
    """Bodies anywhere, without walls, at any speed: realism rather than ties."""
    n = draw(st.integers(2, 5))
    far = draw(st.sampled_from([0.0, 0.0, 2.0**20, -(2.0**30)]))
    position = [(far + 4.0 * i + draw(st.floats(-0.9, 0.9)), far + draw(wide)) for i in range(n)]
    velocity = [(draw(wide), draw(wide)) for _ in range(n)]
    radius = [draw(st.floats(1e-3, 1.0)) for _ in range(n)]
    return kt.Scene(position, velocity, radius, draw(st.sampled_from([1.0, 3.0])))


@pytest.mark.slow
@pytest.mark.compiled
@given(wide_scenes())
@settings(max_examples=100)
def test_wide_scenes_without_walls(scene):
    assert_one_answer(scene, until=50.0, max_contacts=300)


@pytest.mark.parametrize("seed", first(2, [0, 3, 6, 12]))
def test_a_few_small_lattices(seed):
    scene = kt.make_scene("lattice", bodies=5, turns=seed, seed=seed)
    assert_one_answer(scene, until=20.0, max_contacts=25)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("phase", BUILT_IN)
def test_a_built_in_phase_conforms(phase):
    """As anybody's has to: it repeats itself, its structure is true, near is mutual, and more."""
    report = check_broad_phase(phase)
    assert report.ok, str(report)


@pytest.mark.parametrize(
    ("seeds", "least"),
    [((19, 41), 2), pytest.param(range(100), 6, marks=(pytest.mark.slow, pytest.mark.compiled))],
    ids=["some", "many"],
)
def test_without_the_skin_ties_part(seeds, least, monkeypatch):
    """The lattices are hard enough: with bodies no fatter than they are, phases differ on some."""
    whole = skin.Skin.of.__func__

    def bare(cls, *sizes):
        return whole(cls, *sizes)._replace(delta=0.0, theta=float("inf"))

    monkeypatch.setattr(skin.Skin, "of", classmethod(bare))
    parted = 0
    for seed in seeds:
        scene, phases = lattice_scene(seed), ("naive", "sap-1d", "sap-2d", "sweep-tiling")
        most = 60 if NOTHING_IS_COMPILED else 200
        parted += len({outcome(scene, phase, {}, 20.0, most)[1] for phase in phases}) > 1
    assert parted >= least


@pytest.mark.parametrize(("phase", "options"), ALL)
def test_a_scene_may_be_without_bodies_get_one_and_lose_it(phase, options):
    """Arrays without rows: ``sap-1d`` raised in ``arrange``."""
    nothing = kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 0.25, arena=(2.0, 2.0))
    sim = kt.Simulation(nothing, phase, options=options, live=True, audit=1)
    sim.run(1.0)
    body = sim.insert((1.0, 1.0), (1.0, 0.5), 0.25)
    sim.run(3.0)
    assert len(sim.contacts) > 1
    sim.remove(body)
    sim.run(4.0)
    sim.audit()
    sim.drawing()
    assert len(sim.bodies) == 0
