"""What sweep-tiling cannot do it refuses, and says who can; the default goes to one of them."""

from __future__ import annotations

import numpy as np
import pytest

import kinetile as kt
import kinetile_plugins.sweep_tiling as phase
from agreement import outcome
from kinetile.errors import Refused
from tilings import crevice

POSITION = [[0.25, 0.5], [0.75, 0.5]]
VELOCITY = [[1.0, 0.0], [-1.0, 0.0]]
OPEN = kt.Scene(POSITION, VELOCITY, 0.125)
WALLED = kt.Scene(POSITION, VELOCITY, 0.125, arena=(1.0, 1.0))


def can(sentence: str) -> list[str]:
    """The broad phases that a sentence names, other than sweep-tiling."""
    return [name for name in ("naive", "sap-1d", "sap-2d") if name in sentence]


def test_a_scene_without_an_arena():
    with pytest.raises(Refused) as caught:
        kt.Simulation(OPEN, "sweep-tiling")
    sentence = str(caught.value)
    assert sentence.startswith("sweep-tiling tiles an arena, and this scene has none")
    assert len(can(sentence)) == 3
    for name in can(sentence):
        kt.Simulation(OPEN, name).run(until=0.5)


@pytest.mark.parametrize("narrow", [(), ("wall",)])
def test_bodies_that_pass_through_each_other(narrow):
    with pytest.raises(Refused) as caught:
        kt.Simulation(WALLED, "sweep-tiling", narrow_phases=narrow)
    sentence = str(caught.value)
    assert sentence.startswith("sweep-tiling is right only while bodies cannot pass through each other")
    assert len(can(sentence)) == 3
    for name in can(sentence):
        kt.Simulation(WALLED, name, narrow_phases=narrow).run(until=0.5)


def too_different(ratio: float) -> kt.Scene:
    return kt.Scene(POSITION, VELOCITY, [0.125, 0.125 / ratio], arena=(1.0, 1.0))


def test_radii_that_differ_beyond_measure():
    """Beyond a ratio of about 3e6 for a disc of an eighth of the arena."""
    kt.Simulation(too_different(2e6), "sweep-tiling")
    with pytest.raises(Refused) as caught:
        kt.Simulation(too_different(1e9), "sweep-tiling")
    sentence = str(caught.value)
    assert "the radii, from 1.25e-10 to 0.125, are too different" in sentence
    assert len(can(sentence)) == 3
    assert kt.Simulation(too_different(2e6)).broad_phase == "sweep-tiling"
    assert kt.Simulation(too_different(1e9)).broad_phase == "sap-2d"


def crevices_that_differ(small: float, scenes: int = 200) -> int:
    """In how many scenes the contacts or the end are not those of naive."""
    differ = 0
    for seed in range(scenes):
        scene = crevice(seed, small)
        ends = [outcome(scene, name, {}, 5.0, 30)[1] for name in ("naive", "sweep-tiling")]
        differ += ends[0] != ends[1]
    return differ


@pytest.mark.compiled
def test_up_to_the_limit_contacts_agree_and_far_beyond_they_would_not(monkeypatch):
    assert crevices_that_differ(1.2e-7) == 0
    with pytest.raises(Refused):
        crevices_that_differ(1e-9)
    monkeypatch.setattr(phase, "FINEST", 0.0)
    assert crevices_that_differ(1e-8) == 0
    assert crevices_that_differ(1e-10) > 5


@pytest.mark.compiled
@pytest.mark.slow
def test_three_thousand_crevices(monkeypatch):
    monkeypatch.setattr(phase, "FINEST", 0.0)
    for small in (1.2e-7, 3e-8, 1e-8):
        assert crevices_that_differ(small, 1000) == 0


def test_without_a_name_it_is_the_default_where_it_applies():
    assert kt.Simulation(WALLED).broad_phase == "sweep-tiling"
    assert kt.Simulation(WALLED, narrow_phases=("disc",)).broad_phase == "sweep-tiling"
    empty = kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), 1.0, arena=(1.0, 1.0))
    assert kt.Simulation(empty).broad_phase == "sweep-tiling"


def test_without_a_name_and_where_it_does_not_apply_it_is_sap_2d():
    assert kt.Simulation(OPEN).broad_phase == "sap-2d"
    assert kt.Simulation(WALLED, narrow_phases=("wall",)).broad_phase == "sap-2d"


def test_a_name_is_taken_at_its_word():
    scene = kt.Scene(POSITION, VELOCITY, 0.125, settings=kt.Settings(broad_phase="sweep-tiling"))
    with pytest.raises(Refused, match="give the scene an arena"):
        kt.Simulation(scene)
