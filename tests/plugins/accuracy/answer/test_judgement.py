"""Who is right, where two lists of contacts differ."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
from kinetile.records.contacts import CONTACT_LINE
from kinetile_accuracy.answer import judgement
from kinetile_accuracy.answer.judgement import judged


@pytest.fixture
def three_in_a_row():
    """Disc 2 meets disc 1 at 0.5; disc 0 meets disc 1 later."""
    scene = kt.Scene([[1.0, 1.0], [3.0, 1.0], [4.0, 1.0]], [[0.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.25)
    return scene, np.array([(0, 2**51, 1, 2), (2, 0, 0, 1)], CONTACT_LINE)


def test_the_one_that_is_as_the_specification_says_is_right(three_in_a_row):
    scene, right = three_in_a_row
    late = right.copy()
    late["tick"][1] = 5
    said = judged(scene, {"one": right, "other": late}, 1)
    assert said.startswith("by the specification one is right there; other is wrong in contact 1: body 0")
    assert "its tick should be epoch 2, tick 0, 5 ticks earlier" in said
    said = judged(scene, {"one": late[:1], "other": right}, 1)
    assert said.startswith("by the specification one is wrong in contact 1: ")
    assert said.endswith("; other is right there")


def test_the_reference_may_be_the_one_that_is_wrong(three_in_a_row):
    scene, right = three_in_a_row
    said = judged(scene, {"phase": right, "naive": right[1:]}, 0)
    assert "phase is right there; naive is wrong in contact 0" in said


def test_where_the_specification_does_not_say_it_says_nothing(three_in_a_row, monkeypatch):
    scene, right = three_in_a_row
    lists = {"one": right, "other": right[:1]}
    assert judged(scene, lists, 1, ["disc"])
    assert not judged(scene, lists, 1, ["sticky"])
    assert not judged(scene, lists, 1, ["disc", "wall"])  # and no walls to meet
    monkeypatch.setattr(judgement, "_FARTHEST", 0)
    assert not judged(scene, lists, 1)
