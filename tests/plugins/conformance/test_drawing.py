"""Reduction keeps what fails, and leaves little else; ``fails`` is made up here, so nothing runs."""

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinetile.scene import Scene
from kinetile_conformance.drawing import reduced
from kinetile_conformance.strategies import scenes
from kinetile_conformance.strategies.swarms import swarm

PLENTY = 60.0


def with_velocities(wanted: set[tuple[float, float]]):
    """Returns a ``fails`` that finds bodies by their velocities, and the scenes of its calls."""
    asked: list[Scene] = []

    def fails(scene: Scene) -> bool:
        asked.append(scene)
        return wanted <= set(map(tuple, scene.velocity.tolist()))

    return fails, asked


def test_of_four_hundred_bodies_the_two_that_matter_are_left():
    scene = swarm("gas", 400, seed=3)
    wanted = {tuple(scene.velocity[body].tolist()) for body in (17, 333)}
    fails, asked = with_velocities(wanted)
    small = reduced(scene, fails, PLENTY)
    assert set(map(tuple, small.velocity.tolist())) == wanted
    assert len(asked) < 300


def test_what_needs_many_keeps_as_many_as_it_needs():
    scene = swarm("gas", 60, seed=3)
    assert len(reduced(scene, lambda scene: len(scene) >= 25, PLENTY)) == 25


def test_turns_are_left_out_with_their_bodies_and_apart_from_them():
    scene = swarm("cloud", 60, seed=3)
    wanted = scene.turns[20]
    small = reduced(
        scene, lambda scene: any(turn.velocity == wanted.velocity for turn in scene.turns), PLENTY
    )
    assert len(small) == 2
    assert [turn.velocity for turn in small.turns] == [wanted.velocity]


def test_numbers_become_simple():
    scene = swarm("gas", 30, seed=3)
    small = reduced(scene, lambda scene: len(scene) >= 2, PLENTY)
    for array in (small.position, small.velocity, small.radius):
        assert (array * 16.0 == (array * 16.0).round()).all()
    assert small.settings.until == 0.0


def test_what_cannot_be_made_smaller_is_returned():
    scene = swarm("gas", 12, seed=3)
    assert reduced(scene, lambda other: other == scene, PLENTY) is scene


def test_the_time_that_there_is_is_kept_to():
    def slowly(scene: Scene) -> bool:
        end = time.process_time() + 0.05
        while time.process_time() < end:
            pass
        return len(scene) >= 100

    began = time.process_time()
    small = reduced(swarm("gas", 400, seed=3), slowly, 0.25)
    assert time.process_time() - began < 0.75
    assert 100 <= len(small) < 400


def test_what_a_check_raises_is_not_hidden():
    def broken(scene: Scene) -> bool:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        reduced(swarm("gas", 12, seed=3), broken, PLENTY)


@settings(max_examples=8, deadline=None)
@given(scenes(), st.integers(2, 6))
def test_what_is_left_fails_and_is_no_larger(scene, bodies):
    def fails(other: Scene) -> bool:
        return len(other) >= min(bodies, len(scene)) and other.radius.max() == scene.radius.max()

    small = reduced(scene, fails, 5.0)
    assert fails(small)
    assert len(small) == min(bodies, len(scene))
    assert len(small.turns) <= len(scene.turns)
