"""Swarms, marathons and lattices find what six bodies do not show; and right phases pass them."""

import importlib
import itertools
from collections.abc import Iterable

import numpy as np
import pytest

from kinetile.scene import Scene
from kinetile_conformance.cases import REFERENCE, Subject, difference, outcome
from kinetile_conformance.strategies.bulk import LATTICES, falling, lattices, marathon
from kinetile_conformance.strategies.small import DRAWS
from kinetile_conformance.strategies.swarms import GIANTS, KINDS, swarm, swarm_numbered
from kinetile_plugins.cells.layout import sides_for


@pytest.mark.parametrize("kind", [*KINDS, *GIANTS])
def test_a_swarm_of_every_kind_and_size_can_be(kind):
    for variation, bodies in itertools.product(range(2), [8, 91]):
        scene = swarm(kind, bodies, seed=bodies, variation=variation)
        assert len(scene) == bodies
        assert (scene.mass == 1.0).all()
        assert scene == swarm(kind, bodies, seed=bodies, variation=variation)


def test_a_far_swarm_lies_beyond_lane_2_to_the_31():
    for seed in range(8):
        scene = swarm("far", 30, seed, variation=0)
        assert (np.abs(scene.position) / (2.0 * scene.radius.max()) > 2.0**31).all()


def test_a_seed_has_the_same_scenes_whatever_is_imported(tmp_path, monkeypatch):
    """Hypothesis draws constants of loaded modules, too: of an author's phase, or of another test."""
    (tmp_path / "constants_of_an_author.py").write_text("X = 0.28, 0.3, 1.7, 11.5, 12.25", encoding="utf-8")
    before = list(DRAWS["small scenes"](40, 3))
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("constants_of_an_author")
    assert list(DRAWS["small scenes"](40, 3)) == before


def test_a_lattice_is_the_same_wherever_it_stands():
    """Its places are dyadic with few digits, so shifted by a dyadic number they are exact."""
    scene = lattices(LATTICES, 3, arena=False)
    assert 2 * LATTICES <= len(scene) <= 9 * LATTICES
    for array in (scene.position, scene.radius, 4.0 * scene.velocity):
        assert (array * 16.0 == np.round(array * 16.0)).all()


def test_a_marathon_is_so_slow_that_the_base_of_the_clock_moves():
    from kinetile.kernel.clock import SPAN, TICKS

    for bodies in range(2, 10):
        scene = marathon(bodies, seed=bodies)
        assert len(scene) == bodies
        assert scene.time_unit == 1.0
        assert scene.settings.until >= 40 * (SPAN // TICKS)


def some(kinds: Iterable[str], count: int) -> list[Scene]:
    """Returns swarms by their numbers, as the kit does; Hypothesis would mix in constants of the sources."""
    numbers = np.random.default_rng(0).integers(0, 2**24, count)
    return [swarm_numbered(kinds, int(number)) for number in numbers]


def test_sizes_are_drawn_for_which_cells_has_three_levels() -> None:
    """And of giants two."""
    levels = [len(sides_for(scene, None)) for scene in some(KINDS, 100)]
    assert levels.count(3) >= 2
    assert levels.count(1) >= 50
    assert sum(len(sides_for(scene, None)) > 1 for scene in some(GIANTS, 10)) >= 5


@pytest.mark.small
@pytest.mark.parametrize("phase", ["sweep-tiling", "power"])
def test_the_skin_of_accelerated_bodies_may_depend_on_the_limit_of_a_phase(phase):
    """Both phases were condemned in all falling scenes: their chords have a smaller margin than others."""
    found, expected = (outcome(Subject(name, {}), falling(1), 3) for name in (phase, REFERENCE))
    assert difference(found, expected, phase) is None
