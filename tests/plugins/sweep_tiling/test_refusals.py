"""What sweep-tiling cannot do it refuses, and names the phases that can."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
import trial_pairs
from kinetile.errors import PhaseError, Refused
from kinetile.plugin.protocols import check_parts
from kinetile_plugins.sweep_tiling import SweepTiling
from lanes import GENERAL
from messages import table
from registering import fixture

POSITION = [[0.25, 0.5], [0.75, 0.5]]
VELOCITY = [[1.0, 0.0], [-1.0, 0.0]]
WALLED = kt.Scene(POSITION, VELOCITY, 0.125, arena=(1.0, 1.0))
BOXES = kt.Scene(POSITION, VELOCITY, shape=kt.box(0.2, 0.1), arena=(1.0, 1.0))


def others_named(scene: kt.Scene, narrow: tuple[str, ...] | None = None) -> None:
    """Runs a scene that sweep-tiling refuses: all phases that take it are named."""
    with pytest.raises(Refused) as caught:
        kt.Simulation(scene, "sweep-tiling", narrow_phases=narrow)
    for name in GENERAL:
        assert name in str(caught.value)
        kt.Simulation(scene, name, narrow_phases=narrow).run(until=0.5)
    raise caught.value


test_message = table(globals())


_trial = fixture(trial_pairs, autouse=False)


@pytest.mark.usefixtures("_trial")
def test_bodies_that_come_closer_lost_a_contact_without_a_word():
    """Of squares in circles: there were 55 of 56 contacts, and no fault. Each is taken at its word."""

    def with_trial(name: str, **options: str) -> kt.Simulation:
        return kt.Simulation(WALLED, name, narrow_phases={"trial": options, "wall": {}})

    with pytest.raises(Refused) as caught:
        with_trial("sweep-tiling")
    sentence = str(caught.value)
    assert sentence.startswith("sweep-tiling is right only while bodies touch at the sum of their radii, and")
    assert "narrow phase 'trial' of trial_pairs" in sentence
    assert "contact_distance='closer'" in sentence
    for name in GENERAL:
        assert name in sentence
        with_trial(name)
    with_trial("sweep-tiling", says="sum of radii")
    said = "contact_distance is 'far'; expected 'sum of radii' or 'outlines' or 'closer'"
    with pytest.raises(PhaseError, match=said):
        with_trial("naive", says="far")


def condition_of_the_proof(scene: kt.Scene) -> float:
    """The thickest skin that docs/sweep-tiling.md proves to be right."""
    return float(scene.radius.min() ** 2 / (8.0 * scene.radius.max()))


@given(st.integers(1, 40), st.floats(0.0, 7.0), st.floats(0.0, 12.0), st.integers(0, 99))
@settings(deadline=None, max_examples=20)
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
    """Two discs in the open plane: the further they come, the wider the skin."""
    return kt.Scene(POSITION, [[1.0, 0.0], [1.0, 0.5]], radius)


@pytest.mark.slow
@pytest.mark.compiled
def test_a_run_refused_on_its_way_had_gone_on_half():
    """It is refused before anything changes, and again at the next try; other phases go on."""
    first = kt.Simulation(leaving(1e-3), "sap-1d").explain()["numbers"]["skin"]
    scene = leaving(8.0 * 1.2 * first)
    sim = kt.Simulation(scene, "sweep-tiling")
    ends = []
    for _ in range(3):
        with pytest.raises(Refused, match=r"sweep-tiling is right only while .*: choose another broad phase"):
            sim.run(until=1e5)
        ends.append((sim.time, sim.positions().tobytes(), sim.explain()["numbers"]["skin"]))
        sim.audit()
    assert len(set(ends)) == 1
    assert 1000.0 < sim.time < 3000.0
    other = kt.Simulation(scene, "sap-1d")
    other.run(until=sim.time)
    assert other.positions().tobytes() == sim.positions().tobytes()
    other.run(until=1e5)


def test_a_structure_that_no_page_can_compute_is_refused_by_name():
    parts = replace(SweepTiling().prepare(kt.make_scene("grid", bodies=4)), drawn_as="tiles")
    with pytest.raises(PhaseError, match=r"drawn_as is 'tiles'; expected one of \('', 'tiling'"):
        check_parts("sweep-tiling", parts)
