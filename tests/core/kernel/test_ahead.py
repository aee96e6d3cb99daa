"""Looking ahead: it reads the memory early, and changes nothing."""

import numpy as np
import pytest

import kinetile as kt
from kinetile.kernel import compiled
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.kernel.tables import Kernel
from kinetile.kernel.vectors import prefetch
from kinetile.run import compose
from kinetile.run.simulation import composition_of
from lanes import first


def around_a_wide_one() -> kt.Scene:
    """Small discs around a wide one: under cells there are two levels."""
    rows = (np.indices((12, 12)).reshape(2, -1).T + 0.5) / 12.0
    small = rows[np.hypot(*(rows - 0.5).T) > 0.25]
    radius = np.append(np.full(len(small), 0.01), 0.2)
    velocity = np.random.default_rng(1).normal(size=(len(radius), 2))
    return kt.Scene(np.append(small, [[0.5, 0.5]], axis=0), velocity, radius, arena=(1.0, 1.0))


SCENES = {
    "grid": lambda: kt.make_scene("grid", bodies=100 if NOTHING_IS_COMPILED else 400, density=0.5, seed=2),
    "a few": lambda: kt.make_scene("random", bodies=5, density=0.01, seed=1),
    "on a torus": lambda: kt.make_scene("grid", bodies=64, density=0.5, seed=2, periodic="x"),
    "of two sizes": lambda: around_a_wide_one(),
    "nobody": lambda: kt.make_scene("random", bodies=0, seed=1),
}


@pytest.mark.small
@pytest.mark.parametrize("phase", ["cells", "sweep-tiling"])
@pytest.mark.parametrize("scene", first(3, ["on a torus", "nobody", "of two sizes", "a few", "grid"]))
def test_looking_ahead_changes_no_event(monkeypatch, scene, phase):
    """Composed for a small scene, with short rings and tables, it reads and prefetches within them only."""
    runs = []
    for large in (compose.LARGE_SCENE, 0):
        monkeypatch.setattr(compose, "LARGE_SCENE", large)
        sim = kt.Simulation(SCENES[scene](), phase)
        assert composition_of(sim).parts(compose.CommandSupport.NONE)["AHEAD"] is (large == 0)
        sim.run(until=20.0, max_contacts=20 if NOTHING_IS_COMPILED else 4000)
        readings = sim.readings
        runs.append((sim.fingerprint, sim.exact_time, readings.structural_events, readings.contacts_computed))
    assert runs[0] == runs[1]


def test_it_is_for_large_scenes_only():
    small, large = (kt.make_scene("grid", bodies=n, density=0.1) for n in (90**2, 91**2))
    for scene, ahead in ((small, False), (large, True)):
        composition = compose.compose_phases(scene, "cells", None, None)
        assert composition.parts(compose.CommandSupport.NONE)["AHEAD"] is ahead


def ask(table, row):
    prefetch(table, row)
    return table[row]


def test_a_row_that_is_asked_for_is_what_it_was():
    rows = np.arange(5.0)
    asking = compiled.compose(ask, {}, "ahead", Kernel)
    assert [asking(rows, row) for row in range(5)] == [0.0, 1.0, 2.0, 3.0, 4.0]
