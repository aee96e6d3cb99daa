"""What sweep-tiling cannot do it refuses, and names the phases that can."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
import square_pairs
from agreement import outcome
from kinetile.errors import PhaseError, Refused
from kinetile.plugin.protocols import check_parts
from kinetile_plugins.sweep_tiling import SweepTiling
from lanes import GENERAL
from messages import table
from registering import fixture
from tilings import crevice, take_the_limit_away

POSITION = [[0.25, 0.5], [0.75, 0.5]]
VELOCITY = [[1.0, 0.0], [-1.0, 0.0]]
WALLED = kt.Scene(POSITION, VELOCITY, 0.125, arena=(1.0, 1.0))
BOXES = kt.Scene(POSITION, VELOCITY, shape=kt.box(0.2, 0.1), arena=(1.0, 1.0))


def others_named(scene: kt.Scene, narrow: tuple[str, ...] | None = None) -> None:
    """Run a scene that sweep-tiling refuses: all phases that take it are named."""
    with pytest.raises(Refused) as caught:
        kt.Simulation(scene, "sweep-tiling", narrow_phases=narrow)
    for name in GENERAL:
        assert name in str(caught.value)
        kt.Simulation(scene, name, narrow_phases=narrow).run(until=0.5)
    raise caught.value


test_message = table(globals())


_squares = fixture(square_pairs, autouse=False)


def as_squares(name: str, **options: str) -> kt.Simulation:
    scene = kt.make_scene("random", bodies=12, density=0.3, seed=20)
    return kt.Simulation(scene, name, narrow_phases={"squares": options, "wall": {}})


@pytest.mark.usefixtures("_squares")
def test_squares_lost_a_contact_without_a_word():
    """Squares come closer than the sum of their radii: of 56 contacts there were 55, and no fault."""
    with pytest.raises(Refused) as caught:
        as_squares("sweep-tiling")
    sentence = str(caught.value)
    assert sentence.startswith("sweep-tiling is right only while bodies touch at the sum of their radii, and")
    assert "narrow phase 'squares' of square_pairs" in sentence
    assert "contact_distance='closer'" in sentence
    runs = [as_squares(name) for name in GENERAL if name in sentence]
    for sim in runs:
        sim.run(until=1.0)
    assert [len(sim.contacts) for sim in runs] == [56] * 4
    assert len({sim.fingerprint for sim in runs}) == 1


@pytest.mark.usefixtures("_squares")
def test_a_pair_phase_is_taken_at_its_word():
    as_squares("sweep-tiling", says="sum of radii")
    with pytest.raises(
        PhaseError, match="contact_distance is 'far'; expected 'sum of radii' or 'outlines' or 'closer'"
    ):
        as_squares("naive", says="far")


def condition_of_the_proof(scene: kt.Scene) -> float:
    """The thickest skin that docs/sweep-tiling.md proves to be right."""
    return float(scene.radius.min() ** 2 / (8.0 * scene.radius.max()))


@given(st.integers(1, 40), st.floats(0.0, 7.0), st.floats(0.0, 12.0), st.integers(0, 99))
@settings(deadline=None, max_examples=60)
def test_what_is_accepted_is_proved(bodies, ratio, mass_ratio, seed):
    scene = kt.make_scene(
        "random", bodies=bodies, density=0.1, radius_ratio=10.0**ratio, mass_ratio=10.0**mass_ratio, seed=seed
    )
    try:
        sim = kt.Simulation(scene, "sweep-tiling")
    except Refused:
        skin = kt.Simulation(scene, "sap-1d").explain()["numbers"]["skin"]
        assert skin > 0.999 * condition_of_the_proof(scene)
    else:
        assert sim.explain()["numbers"]["skin"] <= 1.001 * condition_of_the_proof(scene)


def leaving(radius: float) -> kt.Scene:
    """Two discs that leave an arena without walls: the further they come, the wider the skin."""
    return kt.Scene(POSITION, [[1.0, 0.0], [1.0, 0.5]], radius, arena=(1.0, 1.0))


@pytest.mark.slow
@pytest.mark.compiled
def test_a_run_refused_on_its_way_had_gone_on_half():
    """It is refused before anything changes, and again at the next try; other phases go on."""
    walls = {"narrow_phases": ["disc"]}
    first = kt.Simulation(leaving(1e-3), "sap-1d", **walls).explain()["numbers"]["skin"]
    scene = leaving(8.0 * 1.2 * first)
    sim = kt.Simulation(scene, "sweep-tiling", **walls)
    ends = []
    for _ in range(3):
        with pytest.raises(Refused, match=r"sweep-tiling is right only while .*: choose another broad phase"):
            sim.run(until=1e5)
        ends.append((sim.time, sim.positions().tobytes(), sim.explain()["numbers"]["skin"]))
        sim.audit()
    assert len(set(ends)) == 1
    assert 1000.0 < sim.time < 3000.0
    other = kt.Simulation(scene, "sap-1d", **walls)
    other.run(until=sim.time)
    assert other.positions().tobytes() == sim.positions().tobytes()
    other.run(until=1e5)


def crevices_that_differ(small: float, scenes: int = 200) -> int:
    differ = 0
    for seed in range(scenes):
        scene = crevice(seed, small)
        ends = [outcome(scene, name, {}, 5.0, 30)[1] for name in ("naive", "sweep-tiling")]
        differ += ends[0] != ends[1]
    return differ


@pytest.mark.slow
@pytest.mark.compiled
def test_up_to_the_limit_contacts_agree_and_far_beyond_they_would_not(monkeypatch):
    assert crevices_that_differ(8e-7) == 0
    with pytest.raises(Refused):
        crevices_that_differ(1e-7)
    take_the_limit_away(monkeypatch)
    assert crevices_that_differ(1e-8) == 0
    assert crevices_that_differ(1e-10) > 5


def test_a_structure_that_no_page_can_compute_is_refused_by_name():
    parts = replace(SweepTiling().prepare(kt.make_scene("grid", bodies=4)), drawn_as="tiles")
    with pytest.raises(PhaseError, match=r"drawn_as is 'tiles'; expected one of \('', 'tiling'"):
        check_parts("sweep-tiling", parts)
