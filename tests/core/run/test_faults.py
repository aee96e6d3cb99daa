"""A wrong broad phase is named, never believed: each defect ends in its own typed error with a sentence."""

from __future__ import annotations

import numpy as np
import pytest

import broken_phases
import kinetile as kt
from kinetile.errors import AuditError, MissedContactError, PhaseError
from kinetile.kernel.compiled import INTERPRETED


@pytest.fixture(autouse=True)
def _registered():
    plugin = broken_phases.Plugin()
    kt.registry().add(plugin)
    yield
    kt.registry().remove(plugin)


def head_on(partner: bool = False) -> kt.Scene:
    """Two discs that meet at time 0.25; with a partner, a third hits one of them while it should be gone."""
    position = [[1.0, 1.0], [2.0, 1.0]]
    velocity = [[1.0, 0.0], [-1.0, 0.0]]
    if partner:
        position.append([1.25, 1.8125])
        velocity.append([0.0, -1.0])
    return kt.Scene(position, velocity, 0.25, arena=(4.0, 4.0))


def test_a_pair_that_is_reported_when_deep_in_each_other_was_missed():
    sim = kt.Simulation(head_on(partner=True), "adds-when-deep")
    with pytest.raises(MissedContactError, match="overlap more than rounding explains") as caught:
        sim.run(until=4.0)
    assert "'adds-when-deep'" in str(caught.value)
    assert caught.value.time > 0.25


def test_a_pair_that_is_reported_late_is_named_with_its_time():
    sim = kt.Simulation(head_on(), "adds-too-late")
    with pytest.raises(MissedContactError, match="reported the pair too late") as caught:
        sim.run(until=4.0)
    assert caught.value.bodies == (0, 1)
    assert caught.value.time == 0.5


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("names-nobody", r"reported the pair \(0, 2\), which is not two bodies"),
        ("removes-nothing", r"removed the pair \(0, 1\), which was not in its pair set"),
        ("never-gets-on", "fail again and again at the same moment"),
        ("does-not-reschedule", "fail again and again at the same moment"),
    ],
)
def test_a_broken_promise_is_a_phase_error(name, said):
    sim = kt.Simulation(head_on(), name)
    with pytest.raises(PhaseError, match=said):
        sim.run(until=4.0)


def test_a_newcomer_that_repair_does_not_name_is_told_by_the_next_audit():
    sim = kt.Simulation(head_on(), "keeps-a-newcomer-to-itself")
    sim.run(until=0.2)
    said = "bodies 0 and 1 is awaited never at the earliest, but by their plans they meet at tick"
    with pytest.raises(MissedContactError, match=said) as caught:
        sim.audit()
    assert caught.value.bodies == (0, 1)


def test_a_body_that_is_near_another_one_way_only_is_told_by_an_audit():
    sim = kt.Simulation(head_on(), "is-near-one-way")
    with pytest.raises(AuditError, match="body 1 is near body 0, but body 0 is not near body 1"):
        sim.audit()


@pytest.mark.skipif(INTERPRETED, reason="nothing is compiled")
def test_a_hook_that_does_not_compile_is_a_phase_error():
    sim = kt.Simulation(head_on(), "does-not-compile")
    with pytest.raises(PhaseError, match=r"(?s)does-not-compile, disc, wall do not compile.*temperature"):
        sim.run(until=4.0)


def test_a_turn_into_another_body_is_named():
    scene = kt.Scene([[1.0, 1.0], [1.5, 1.0]], np.zeros((2, 2)), 0.25, arena=(4.0, 4.0))
    sim = kt.Simulation(scene, "naive")
    sim.set_velocity(0, (1.0, 0.0))
    sim.run(until=1.0)
    assert [(c["a"], c["b"], c["time"]) for c in sim.contacts[:1]] == [(0, 1, 0.0)]


def test_what_was_done_before_a_fault_stays():
    rows = []
    sim = kt.Simulation(head_on(partner=True), "adds-when-deep")
    with pytest.raises(MissedContactError):
        sim.run(until=4.0, recorder=rows.append)
    assert len(sim.contacts) == sum(len(chunk) for chunk in rows) > 0
    assert sim.readings.contacts_disc == len(sim.contacts)


@pytest.mark.parametrize("phase", ["naive", "sap-1d", "cells"])
def test_discs_that_met_on_one_place_went_on_at_no_place(phase):
    scene = kt.Scene([[1048577.0, 0.0], [1048577.75, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], 1e-20)
    sim = kt.Simulation(scene, phase)
    with pytest.raises(
        PhaseError, match="bodies 0 and 1 left a place or velocity that is not a finite number"
    ):
        sim.run(until=1.0)
    assert len(sim.contacts) == 0
