"""The course of events: its bounds, and who has just met."""

import numpy as np
import pytest

import kinetile as kt
from kinetile_accuracy.specification import course
from kinetile_accuracy.specification.course import Course, CourseEvent


def events(scene: kt.Scene, count: int) -> list[CourseEvent]:
    found, happened = Course(scene), []
    while len(happened) < count and (event := found.next(2**60)) is not None:
        found.carry_out()
        happened.append(event)
    return happened


@pytest.mark.parametrize("few", [1, 2, 8])
def test_how_many_partners_have_a_bound_of_their_own_changes_nothing(
    few: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = kt.make_scene("grid", bodies=16, density=0.5, seed=1)
    usual = events(scene, 300)
    monkeypatch.setattr(course, "_FEW", few)
    assert events(scene, 300) == usual


def test_two_have_just_met_until_one_has_another_plan() -> None:
    scene = kt.make_scene("grid", bodies=16, density=0.5)
    found = Course(scene)
    pairs = 0
    while pairs < 50:
        event = found.next(2**60)
        assert event is not None
        found.carry_out()
        if event.b >= 0:
            pairs += 1
            assert found.have_just_met(event.a, event.b)
            assert found.have_just_met(event.b, event.a)
            others = set(range(len(scene))) - {event.b}
            assert not any(found.have_just_met(event.a, other) for other in others)


def test_without_bodies_nothing_happens() -> None:
    empty = kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), arena=(1.0, 1.0))
    assert events(empty, 1) == []
