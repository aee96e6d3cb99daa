"""Swarms, marathons and lattices find what six bodies do not show; and what is right passes them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, find, settings

import kinetile as kt
import toy_grids
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject, outcome
from kinetile_conformance.checks import check_named
from kinetile_conformance.compare import difference
from kinetile_conformance.drawing import reduced
from kinetile_conformance.runner import CheckRun
from kinetile_conformance.strategies.bulk import LATTICES, lattices, marathon
from kinetile_conformance.strategies.swarms import GIANTS, KINDS, numbered, swarm
from kinetile_plugins.cells.layout import sides_for
from registering import registered

MOST_LEFT = {
    "truncation for floor": 160,
    "a table of 64 places": 100,
    "lists of 4": 40,
    "lists of 24": 40,
    "numbers of bodies of 7 bits and a sign": 160,
    "a count of 16 bits": 160,
    "numbers of lanes of 32 bits": 160,
}
"""Bodies that may be left: little more than the fault needs, in the seconds that there are."""


@pytest.fixture
def toy_grid() -> Iterator[str]:
    """The name of a grid with a fault of choice, registered for one test."""
    with registered(kt.BroadPhaseSpec("toy-grid", toy_grids.ToyGrid)):
        yield "toy-grid"


@pytest.mark.parametrize("kind", [*KINDS, *GIANTS])
def test_a_swarm_of_every_kind_and_size_can_be(kind):
    for variation, bodies in itertools.product(range(8), [8, 91, 400]):
        scene = swarm(kind, bodies, seed=bodies, variation=variation)
        assert len(scene) == bodies
        assert (scene.mass == 1.0).all()
        assert scene == swarm(kind, bodies, seed=bodies, variation=variation)


def test_a_far_swarm_lies_beyond_lane_2_to_the_31():
    for seed in range(8):
        scene = swarm("far", 30, seed, variation=0)
        assert (np.abs(scene.position) / (2.0 * scene.radius.max()) > 2.0**31).all()


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


@pytest.mark.long
@pytest.mark.compiled
@pytest.mark.parametrize("label", toy_grids.FAULTS)
def test_a_faulty_grid_is_killed_with_a_reduced_scene(label, toy_grid):
    subject = Subject(toy_grid, {"fault": toy_grids.FAULTS[label]})
    for name in ("same-contacts-in-a-swarm", "same-contacts-in-a-marathon"):
        each = check_named(name)
        seen = CheckRun(each, subject)
        try:
            scene = find(
                each.scenes(),
                lambda scene: not seen.holds(scene),  # noqa: B023 - called here, or never
                settings=settings(
                    max_examples=max(1, round(100 * each.share)),
                    phases=[Phase.generate],
                    database=None,
                    deadline=None,
                    suppress_health_check=list(HealthCheck),
                ),
                random=Random(0),
            )
        except Exception as error:
            if type(error).__name__ != "NoSuchExample":
                raise
            continue
        small = reduced(scene, lambda scene: not CheckRun(each, subject).holds(scene), 10.0)  # noqa: B023
        assert not CheckRun(each, subject).holds(small)
        assert len(small) <= min(len(scene), MOST_LEFT[label])
        return
    pytest.fail(f"{label} survives")


@pytest.mark.long
@pytest.mark.compiled
@pytest.mark.parametrize("name", ["same-contacts-in-a-swarm", "same-contacts-on-lattices"])
def test_a_grid_without_a_fault_passes(name, toy_grid):
    each = check_named(name)
    subject = Subject(toy_grid, {})
    for kind in KINDS if "swarm" in name else range(4):
        scene = swarm(kind, 60, 5) if "swarm" in name else lattices(20, kind, bool(kind & 1))
        seen = CheckRun(each, subject)
        assert seen.holds(scene), seen.said


def some(kinds: Iterable[str], count: int) -> list[Scene]:
    """Return swarms by their numbers, as the kit does; Hypothesis would mix in constants of the sources."""
    numbers = np.random.default_rng(0).integers(0, 2**24, count)
    return [numbered(kinds, int(number)) for number in numbers]


def test_sizes_are_drawn_for_which_cells_has_three_levels() -> None:
    levels = [len(sides_for(scene, None)) for scene in some(KINDS, 200)]
    assert levels.count(3) >= 8
    assert levels.count(1) >= 100


def test_giants_are_drawn_for_which_cells_has_two_levels() -> None:
    assert sum(len(sides_for(scene, None)) > 1 for scene in some(GIANTS, 30)) >= 20


@pytest.mark.small
def test_sizes_over_octaves_have_one_answer() -> None:
    scene = swarm("giants", 140, 3, 5)
    assert len(sides_for(scene, None)) == 3
    expected = outcome(Subject("naive", {}), scene, 40)
    assert len(expected.contacts) == 40
    assert difference(outcome(Subject("cells", {}), scene, 40), expected, "cells") is None
