"""A wrong broad phase is named: each defect ends in its own typed error with a sentence."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import pytest

import broken_phases
import kinetile as kt
from kinetile.errors import AuditError, MissedContactError, PhaseError
from kinetile.kernel.compiled import INTERPRETED
from kinetile.toolbox import MY_FAULT, NEVER, BroadPhaseParts, Kernel, Records, blame, hook, schedule
from registering import registered


def head_on(partner: bool = False) -> kt.Scene:
    """Two discs that meet at time 0.25; with a partner, a third hits one of them while it should be gone."""
    position = [[1.0, 1.0], [2.0, 1.0]]
    velocity = [[1.0, 0.0], [-1.0, 0.0]]
    if partner:
        position.append([1.25, 1.8125])
        velocity.append([0.0, -1.0])
    return kt.Scene(position, velocity, 0.25, arena=(4.0, 4.0))


@pytest.mark.interpreted
def test_a_pair_that_is_reported_when_deep_in_each_other_was_missed():
    sim = kt.Simulation(head_on(partner=True), "adds-when-deep")
    with pytest.raises(MissedContactError, match="overlap more than rounding explains") as caught:
        sim.run(until=4.0)
    assert "'adds-when-deep'" in str(caught.value)
    assert caught.value.time > 0.25


@pytest.mark.interpreted
def test_a_pair_that_is_reported_late_is_named_with_its_time():
    sim = kt.Simulation(head_on(), "adds-too-late")
    with pytest.raises(MissedContactError, match="reported the pair too late") as caught:
        sim.run(until=4.0)
    assert caught.value.bodies == (0, 1)
    assert caught.value.time == 0.5


@pytest.mark.interpreted
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


@pytest.mark.interpreted
def test_a_newcomer_that_repair_does_not_name_is_told_by_the_next_audit():
    sim = kt.Simulation(head_on(), "keeps-a-newcomer-to-itself")
    sim.run(until=0.2)
    said = "bodies 0 and 1 is awaited never at the earliest, but by their plans they meet at tick"
    with pytest.raises(MissedContactError, match=said) as caught:
        sim.audit()
    assert caught.value.bodies == (0, 1)


@pytest.mark.interpreted
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


@pytest.mark.interpreted
def test_what_was_done_before_a_fault_stays():
    rows = []
    sim = kt.Simulation(head_on(partner=True), "adds-when-deep")
    with pytest.raises(MissedContactError):
        sim.run(until=4.0, recorder=rows.append)
    assert len(sim.contacts) == sum(len(chunk) for chunk in rows) > 0
    assert sim.readings.contacts_disc == len(sim.contacts)


@pytest.mark.interpreted
@pytest.mark.parametrize("phase", ["naive", "sap-1d", "cells"])
@pytest.mark.parametrize(
    "more", [{}, {"mass": [1.0, 2.0]}, {"responses": "stop"}, {"arena": (2.0**21, 1.0), "periodic": "xy"}]
)
def test_discs_that_met_on_one_place_went_on_at_no_place(phase, more):
    """Their velocities, and with them their positions and the energy, were no numbers after the error."""
    velocity = [[1.0, 0.0], [-1.0, 0.0]]
    scene = kt.Scene([[1048577.0, 0.5], [1048577.75, 0.5]], velocity, 1e-20, **more)
    sim = kt.Simulation(scene, phase)
    with pytest.raises(PhaseError, match="bodies 0 and 1 has no outcome in finite numbers"):
        sim.run(until=1.0)
    assert len(sim.contacts) == 0
    assert sim.velocities().tolist() == velocity
    assert sim.positions().tolist() == [[1048577.375, 0.5]] * 2
    assert sim.readings.energy_drift == 0.0


class State(NamedTuple):
    """Which of its faults it blames."""

    which: Records  # (1,)


@hook
def everyone(k: Kernel, s: State, body: int) -> int:
    for other in range(len(k.bodies)):
        k.near[other] = other
    return len(k.bodies)


@hook
def soon(k: Kernel, s: State) -> None:
    schedule(k, 0, k.clock[0].now + (1 << 50))


@hook
def give_up(k: Kernel, s: State, body: int) -> int:
    schedule(k, body, NEVER)
    blame(k, MY_FAULT + s.which[0], body, 17)
    blame(k, MY_FAULT, 5, 5)
    return 0


class GivesUp:
    """A phase that gives up at time 0.125, with the fault that it is told."""

    def __init__(self, *, which: int = 0) -> None:
        self.which = which

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        said = ("the table of {a} is full: it has {b} places", "nothing is left of {b}")
        return BroadPhaseParts(everyone, State(np.array([self.which])), soon, give_up, faults=said)


class Faulty:
    """A phase whose parts have what was given for its faults."""

    def __init__(self, *, faults: object = ()) -> None:
        self.faults = faults

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(everyone, State(np.zeros(1, int)), faults=self.faults)  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def _registered():
    specs = (kt.BroadPhaseSpec("gives-up", GivesUp), kt.BroadPhaseSpec("faulty", Faulty))
    with registered(broken_phases.Plugin(), *specs):
        yield


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("which", "said"),
    [
        (0, "cannot go on: the table of 0 is full: it has 17 places"),
        (1, "cannot go on: nothing is left of 17"),
        (2, "left its fault MY_FAULT + 2 (0, 17), and its parts have 2 sentences for faults of its own"),
    ],
)
def test_a_fault_of_its_own_is_told_in_its_own_words(which, said):
    sim = kt.Simulation(kt.make_scene("two-discs"), "gives-up", options={"which": which})
    who = "at time 0.125 broad phase 'gives-up' of gives-up (added in this process)"
    with pytest.raises(PhaseError, match=f"^{re.escape(f'{who} {said}')}$"):
        sim.run(until=1.0)


@pytest.mark.interpreted
@pytest.mark.parametrize(
    "given", ["one sentence", None, 7, ("all is well", 7), ("{c}",), ("{",), ("{a.b}",), ("",)]
)
def test_what_is_no_sentence_is_refused(given):
    with pytest.raises(
        PhaseError, match=r"faults (is|has) .*; expected a tuple of sentences, in which \{a\} and"
    ):
        kt.Simulation(kt.make_scene("two-discs"), "faulty", options={"faults": given})


@pytest.mark.interpreted
@pytest.mark.parametrize("given", [(), ("all is over",), ("{a} and {b:>4}", "{b}")])
def test_sentences_are_taken(given):
    sim = kt.Simulation(kt.make_scene("two-discs"), "faulty", options={"faults": given})
    assert sim.composition.broad.faults == given
