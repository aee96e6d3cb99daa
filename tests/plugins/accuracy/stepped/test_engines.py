"""The engines: they run the given scene, and report their results."""

from collections.abc import Sequence

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import Refused
from kinetile_accuracy.stepped.engines import ENGINES, EngineName, engine_settings, run_engine
from kinetile_accuracy.stepped.snapshots import SteppedRun

PACKAGES = {"chipmunk": "pymunk", "box2d": "Box2D", "box2d-bullets": "Box2D"}


@pytest.fixture(params=ENGINES)
def peer(request: pytest.FixtureRequest) -> EngineName:
    name: EngineName = request.param
    pytest.importorskip(PACKAGES[name])
    return name


def listed(run: SteppedRun) -> list[tuple[int, int]]:
    return list(dict.fromkeys((int(row["a"]), int(row["b"])) for row in run.contacts))


def head_on(speed: float = 1.0, masses: Sequence[float] = (1.0, 1.0)) -> kt.Scene:
    return kt.Scene([(1.0, 2.0), (4.0, 2.0)], [(speed, 0.0), (-speed, 0.0)], 1.0, masses, (5.0, 4.0))


def test_two_discs_exchange_their_velocities(peer: EngineName) -> None:
    run = run_engine(peer, head_on(), 0.01, 1.0, watched="depths")
    assert listed(run) == [(0, 1)]
    assert 50 <= run.contacts["step"][0] <= 52
    np.testing.assert_allclose(run.velocity, [(-1.0, 0.0), (1.0, 0.0)], atol=1e-3)
    np.testing.assert_allclose(run.position, [(1.0, 2.0), (4.0, 2.0)], atol=0.05)
    assert 0.0 <= run.deepest < 0.03
    assert run.steps == 100
    assert run.cpu_seconds > 0.0


@pytest.mark.parametrize(
    ("speed", "masses", "after"), [(1.0, [3.0, 1.0], (0.0, 2.0)), (1e-3, [1.0, 1.0], (-1e-3, 1e-3))]
)
def test_masses_count_and_slow_pairs_bounce_as_well(
    peer: EngineName, speed: float, masses: list[float], after: tuple[float, float]
) -> None:
    run = run_engine(peer, head_on(speed, masses), 0.01 / speed, 0.7 / speed)
    np.testing.assert_allclose(run.velocity[:, 0], after, atol=2e-3 * speed)


@pytest.mark.small
def test_walls_reflect_and_are_named(peer: EngineName) -> None:
    scene = kt.Scene([(0.3, 0.3)], [(1.0, -0.9)], 0.1, arena=(1.0, 1.2))
    simulation = kt.Simulation(scene)
    simulation.run(3.0)
    run = run_engine(peer, scene, 1e-3, 3.0, watched="depths")
    assert sorted(listed(run)) == sorted({(int(row["a"]), int(row["b"])) for row in simulation.contacts})
    np.testing.assert_allclose(run.position, simulation.positions(), atol=0.03)
    assert run.energy_drift < 1e-3


@pytest.mark.compiled
def test_many_discs_keep_their_energy_and_stay_inside(peer: EngineName) -> None:
    scene = kt.make_scene("grid", bodies=100, density=0.25, seed=1)
    simulation = kt.Simulation(scene)
    simulation.run(1.0)
    run = run_engine(peer, scene, 1e-3, 1.0, watched="depths")
    assert run.energy_drift < 0.01
    assert (run.position > 0.0).all()
    assert (run.position < 1.0).all()
    discs = (run.contacts["b"] >= 0).sum()
    assert discs == pytest.approx(simulation.readings.contacts_disc, rel=0.2)
    assert run.deepest < (0.01 if peer == "box2d-bullets" else 0.3)


def test_what_is_not_watched_is_missing(peer: EngineName) -> None:
    scene = kt.make_scene("grid", bodies=9, density=0.25, seed=1)
    timed = run_engine(peer, scene, 0.01, 1.0)
    assert len(timed.contacts) == 0
    assert np.isnan(timed.deepest)
    seen = run_engine(peer, scene, 0.01, 1.0, watched="contacts")
    assert len(seen.contacts) > 0
    assert np.isnan(seen.deepest)
    np.testing.assert_array_equal(seen.position, timed.position)


def test_it_says_what_it_is_set_to(peer: EngineName) -> None:
    text = engine_settings(peer)
    assert text.startswith(PACKAGES[peer])
    assert any(letter.isdigit() for letter in text.partition(":")[0])
    bullets = {"chipmunk": "", "box2d": "no disc is a bullet", "box2d-bullets": "every disc is a bullet"}
    for word in ("friction 0", "iterations", "continuous", bullets[peer]):
        assert word in text


def test_scenes_that_an_engine_is_not_given(peer: EngineName) -> None:
    still = [(0.5, 0.5)], [(0.0, 0.0)], 0.1
    with pytest.raises(Refused):
        run_engine(peer, kt.Scene(*still), 0.01, 1.0)
    with pytest.raises(Refused):
        run_engine(peer, kt.Scene(*still, arena=(1.0, 1.0), turns=[(0, 1.0, (0.0, 1.0))]), 0.01, 1.0)
    with pytest.raises(ValueError, match="dt"):
        run_engine(peer, kt.Scene(*still, arena=(1.0, 1.0)), 0.0, 1.0)
    assert run_engine(peer, kt.Scene(*still, arena=(1.0, 1.0)), 0.01, 1.0).energy_drift == 0.0
