"""Comparing broad phases: agreement to the last bit, and the first place where one is wrong."""

import json
from dataclasses import replace

import numpy as np
import pytest

import kinetile as kt
from kinetile.comparison import Outcome, compare, describe_row, find_divergence
from kinetile.errors import AuditError, Refused
from kinetile.run.compose import accepting
from registering import registered


def three_in_a_row() -> kt.Scene:
    """Disc 2 meets disc 1 at 0.5; disc 0 meets disc 1 later."""
    return kt.Scene([[1.0, 1.0], [3.0, 1.0], [4.0, 1.0]], [[0.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.25)


def test_phases_that_agree():
    scene = kt.make_scene("grid", bodies=9, density=0.5, seed=5)
    seen, done = [], []
    result = compare(
        scene,
        ["naive", ("sap-1d", {"axis": "x"}), "sap-2d"],
        0.5,
        start=lambda label, sim: seen.append((label, sim.broad_phase)),
        finish=done.append,
    )
    assert result.identical
    assert result.first_divergence is None
    assert seen == [("naive", "naive"), ("sap-1d:axis=x", "sap-1d"), ("sap-2d", "sap-2d")]
    assert tuple(done) == result.outcomes
    assert len({outcome.fingerprint for outcome in result.outcomes}) == 1
    assert {outcome.time for outcome in result.outcomes} == {0.5}
    assert result.outcomes[0].contacts > 0
    assert json.loads(json.dumps(result.as_dict()))["identical"] is True


def test_a_contact_that_is_missing_is_shown_with_exact_ticks(blind):
    result = compare(three_in_a_row(), ["naive", blind], 4.0)
    assert not result.identical
    first = result.first_divergence
    assert first.what == "contact"
    assert first.index == 1
    assert first.expected == {"time": 2.0, "epoch": 2, "tick": 0, "a": 0, "b": 1}
    assert first.found is None
    assert first.before == {"time": 0.5, "epoch": 0, "tick": 2**51, "a": 1, "b": 2}
    text = str(first)
    assert text.startswith("blind differs from naive at contact 1:")
    assert "body 0 with body 1 at time 2.0 (epoch 2, tick 0)" in text
    assert "no such contact" in text
    assert "by the specification naive is right there; blind is wrong in contact 1: " in text
    assert json.loads(json.dumps(result.as_dict()))["first_divergence"]["index"] == 1
    row = {"time": 0.5, "epoch": 0, "tick": 2**51, "a": 3, "b": -2}
    assert describe_row(row) == "body 3 with the right wall at time 0.5 (epoch 0, tick 2251799813685248)"


def test_an_audit_that_fails_is_part_of_the_answer(monkeypatch):
    def failing(simulation, *arguments, **options):
        raise AuditError("the queue is out of order")

    monkeypatch.setattr(kt.Simulation, "run", failing)
    result = compare(three_in_a_row(), ["naive", "naive"], 1.0)
    assert result.identical
    assert result.fault == "AuditError: the queue is out of order"


def test_the_end_and_the_bodies_are_compared_too():
    contacts, bodies = np.zeros(2, kt.CONTACT), np.array([3, 7])  # others have left
    places, velocities = np.zeros((2, 2)), np.zeros((2, 2))
    reference = Outcome(contacts, "ran", 1.0, bodies, places, velocities)
    assert find_divergence("a", "b", reference, replace(reference, contacts=contacts.copy())) is None
    ended = find_divergence("a", "b", reference, replace(reference, ended="ZenoError: jammed", time=0.5))
    assert ended.what == "end"
    assert "ended at time 0.5 with ZenoError" in str(ended)
    negative = velocities.copy()
    negative[1, 0] = -0.0
    moved = find_divergence("a", "b", reference, replace(reference, velocities=negative))
    assert (moved.what, moved.index) == ("body", 7)
    assert "vx -0.0" in str(moved)
    other = contacts.copy()
    other["tick"][0] = 1
    ticked = find_divergence("a", "b", reference, replace(reference, contacts=other))
    assert (ticked.what, ticked.index, ticked.before) == ("contact", 0, None)


def test_a_run_that_ended_otherwise_is_reported_before_contacts_that_are_missing_for_that_reason():
    contacts, none = np.zeros(2, kt.CONTACT), np.zeros((0, 2))
    reference = Outcome(contacts, "ran", 1.0, np.zeros(0, int), none, none)
    short = replace(reference, contacts=contacts[:1])
    assert find_divergence("a", "b", reference, short).what == "contact"
    assert find_divergence("a", "b", reference, replace(short, ended="PhaseError: no")).what == "end"


def test_by_default_all_phases_that_accept_the_scene_are_compared():
    """Names in the command's default left foreign phases out, and refused scenes that one of them refuses."""
    scene = kt.make_scene("grid", bodies=4)
    phases = kt.registry().names("broad phase")
    assert [each.phase for each in compare(scene, until=0.01).outcomes] == list(phases)
    strip = kt.make_scene("grid", bodies=4).replace(periodic="y")
    assert [name for name, _ in accepting(strip)] == [
        name for name in phases if name not in ("sap-k", "sweep-tiling", "power")
    ]


class Anywhere:
    def prepare(self, scene):
        return kt.registry().target("broad phase", "naive")().prepare(scene)


def test_a_foreign_phase_is_proposed_where_a_built_in_one_refuses():
    with (
        registered(kt.BroadPhaseSpec("anywhere", Anywhere)),
        pytest.raises(Refused, match="accept this scene: naive, cells, sap-1d, sap-2d, anywhere"),
    ):
        kt.Simulation(three_in_a_row().replace(arena=(8.0, 8.0), periodic="y"), "sweep-tiling")


def test_the_end_is_the_scenes_own_or_one_unit():
    scene = three_in_a_row()
    assert compare(scene, ["naive", "naive"]).outcomes[0].time == 1.0
    scene = scene.replace(settings=kt.Settings(until=0.75))
    assert compare(scene, ["naive", "naive"]).outcomes[0].time == 0.75
    by_count = compare(scene, ["naive", "naive"], max_contacts=1).outcomes[0]
    assert (by_count.contacts, by_count.time) == (1, 0.5)
