"""Lists of contacts: right ones are found right to the end, wrong ones at their first wrong line, and why."""

import contextlib
import json
import re
from functools import cache

import numpy as np
import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import Refused
from kinetile.kernel.log import LOG
from kinetile.records.contacts import CONTACT_LINE
from kinetile_accuracy import certify_log
from kinetile_accuracy.specification import certify
from kinetile_accuracy.specification.arithmetic import tick_of, unit_bits
from kinetile_accuracy.specification.certify import LogCertifier, explain_difference
from kinetile_accuracy.specification.course import Course

UNTIL = 1.0


def whole_rows(scene, until):
    course, rows = Course(scene), []
    end = tick_of(until, scene.start, unit_bits(scene))
    while (event := course.next(end)) is not None:
        course.carry_out()
        a = course.plans[event.a]
        b = course.plans[event.b] if event.b >= 0 else None
        plans = [a.x, a.y, a.vx, a.vy, *([b.x, b.y, b.vx, b.vy] if b else [np.nan] * 4)]
        epoch, tick = event.tick >> 52, event.tick & (2**52 - 1)
        time = scene.start + (epoch + tick * 2.0**-52) * scene.time_unit
        rows.append((time, epoch, tick, event.a, event.b, *plans))
    return np.array(rows, LOG)


def contacts_among(rows):
    return rows[rows["b"] >= -4][list(CONTACT_LINE.names)].astype(CONTACT_LINE)


@pytest.fixture(scope="module")
def gas():
    scene = kt.make_scene("grid", bodies=25, density=0.5)
    return scene, contacts_among(whole_rows(scene, UNTIL))


def wrong(scene, log, until=UNTIL):
    found = certify_log(scene, log, until)
    assert not found.right
    assert found.finished
    assert found.fingerprint is None
    assert found.wrong.index == found.lines
    return found.wrong.index, found.wrong.why


def test_rows_and_lists_of_any_form_are_lists_of_contacts(gas):
    scene, log = gas
    lists = log, log.tolist(), [*log], [list(row) for row in log.tolist()], np.array(log.tolist())
    assert len({certify_log(scene, each, UNTIL).fingerprint for each in lists}) == 1


def test_times_of_doubles_are_right_within_a_distance(gas, tmp_path):
    scene, _ = gas
    timed = whole_rows(scene, UNTIL)[["time", "a", "b"]]
    timed = timed[timed["b"] >= -4]
    timed["time"] *= 1.0 + 1e-12
    for within, right in ((1e-10, True), (1e-14, False)):
        assert certify_log(scene, timed.tolist(), UNTIL, within=within).right is right
    late = certify_log(scene, timed[:-1], UNTIL, within=1e-10)
    assert (late.wrong.index, late.wrong.found) == (len(timed) - 1, None)
    file = tmp_path / "times"
    for end, code in (("\n", 0), ("\n1 2\n", 2)):
        file.write_text("\n".join("{:.17g} {} {}".format(*row) for row in timed.tolist()) + end)
        line = f"certify-log grid -s bodies=25 -s density=0.5 {file} --until {UNTIL} --within 1e-10"
        kinetile(line, code=code)


def test_all_lines_are_right(gas):
    scene, log = gas
    found = certify_log(scene, log, UNTIL)
    assert found.right
    assert found.lines == found.total == len(log) > 500
    assert str(found) == f"all lines are right: {len(log)}, to time 1.0"
    assert json.loads(json.dumps(found.as_dict()))["right"] is True
    pair = int(np.flatnonzero(log["b"] >= 0)[20])
    index, why = wrong(scene, np.insert(log, pair, log[pair]))
    assert (index, "these two have just met, at" in why) == (pair + 1, True)


def test_a_list_may_be_a_beginning(gas):
    scene, log = gas
    assert certify_log(scene, log[:100]).right
    assert certify_log(scene, log[:100], UNTIL, max_contacts=100).right
    assert certify_log(scene, log[:0]).right
    assert not certify_log(scene, log[:0], UNTIL).right


def test_a_contact_through_an_image_that_is_another():
    """Two discs alone, that meet in turn at one side and at the other."""
    places, velocities = [(0.25, 0.5), (0.75, 0.5)], [(1.0, 0.0), (0.0, 0.0)]
    scene = kt.Scene(places, velocities, 0.125, arena=(1.0, 1.0), periodic="xy")
    log = contacts_among(whole_rows(scene, 4.0))
    assert (log["epoch"] + log["tick"] / 2**52).tolist() == [0.25 + 0.5 * k for k in range(8)]
    assert certify_log(scene, log, 4.0).right
    later = log.copy()
    later["tick"][2] += 1
    index, why = wrong(scene, later, 4.0)
    assert (index, f"its tick should be epoch 1, tick {2**50}, 1 tick earlier" in why) == (2, True)
    again = np.insert(log, 1, log[0])
    index, why = wrong(scene, again, 4.0)
    assert (index, f"its tick should be epoch 0, tick {3 * 2**50}" in why) == (1, True)


def test_the_end(gas):
    scene, log = gas
    index, why = wrong(scene, log[:-1])
    assert index == len(log) - 1
    assert "there is one more before the end" in why
    index, why = wrong(scene, log, 0.5)
    assert "is after the end" in why
    assert log["tick"][index - 1] <= 2**51 < log["tick"][index]
    assert "there are to be 7 contacts" in str(certify_log(scene, log, max_contacts=7))
    assert certify_log(scene, log[:80], max_contacts=80).right
    found = certify_log(scene, log[:79], max_contacts=80)
    assert (found.right, found.wrong.index, found.wrong.found) == (False, 79, None)
    assert "there are to be 80 contacts: body" in str(found)
    alone = kt.Scene([[0.0, 0.0], [3.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], 1.0)
    one = np.array([(1, 0, 0, 1)], CONTACT_LINE)
    assert certify_log(alone, one, max_contacts=80).right, "nothing comes after it"
    assert not certify_log(alone, one[:0], max_contacts=80).right
    assert "no walls" in wrong(alone, np.array([(1, 0, 0, -1)], CONTACT_LINE), 5.0)[1]


FORGED = {
    "dropped": (lambda log: np.delete(log, 40), "before it comes body"),
    "added": (lambda log: np.insert(log, 40, log[10]), "next is body"),
    "a tick later": (lambda log: moved_by(log, 1), "its tick should be epoch .*, 1 tick earlier"),
    "a tick earlier": (lambda log: moved_by(log, -1), "its tick should be epoch .*, 1 tick later"),
    "much later": (lambda log: moved_by(log, 10**6), "1,000,000 ticks earlier"),
    "swapped": (lambda log: log[[*range(40), 41, 40, *range(42, len(log))]], "comes too early: before it"),
    "another body": (lambda log: with_field(log, "a", 0, "b", 24), "these two do not meet; next"),
    "a false time": (lambda log: with_field(log, "time", np.nextafter(log["time"][40], 9.0)), "of its tick"),
    "no time": (lambda log: with_field(log, "time", np.nan), "is nan, and not the time of its tick"),
    "twice": (lambda log: np.insert(log, 40, log[39]), "these two have just met, at|the wall that"),
    "another wall": (lambda log: with_field(log, "b", -4 if log["b"][40] != -4 else -1), "the wall that it"),
}


def with_field(log, *fields):
    log = log.copy()
    for name, value in zip(fields[::2], fields[1::2], strict=True):
        log[name][40] = value
    return log


def moved_by(log, ticks):
    return with_field(log, "tick", log["tick"][40] + ticks)


@cache
def certified(unit):
    """Returns a scene and its contacts, on a clock of its own, which are right."""
    scene = kt.make_scene("grid", bodies=25, density=0.5, speed=3.0).replace(unit=unit)
    sim = kt.Simulation(scene, "naive")
    sim.run(until=0.25)
    assert certify_log(scene, sim.contacts, 0.25, fingerprint=sim.fingerprint).right
    return scene, sim.contacts


@pytest.mark.parametrize("unit", [None, 2.0**-7])
@pytest.mark.parametrize("forged", FORGED)
def test_runs_on_a_clock_of_their_own_and_forged_ones(unit, forged):
    scene, contacts = certified(unit)
    change, reason = FORGED[forged]
    for until in (0.25, None):
        index, why = wrong(scene, change(contacts), until)
        assert index == 40
        assert re.search(reason, why)


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ((0, 2**52, 1, 2), "a tick is from 0 to"),
        ((0, -1, 1, 2), "a tick is from 0 to"),
        ((0, 5, 25, -1), "there is no body 25: the scene has 25"),
        ((0, 5, 1, 25), "there is no body 25"),
        ((0, 5, -1, 2), "there is no body -1: the scene has 25; a wall is written as b, behind the body"),
        ((0, 5, 7, 7), "not in ascending order"),
        ((0, 5, 7, 3), "not in ascending order"),
        ((0, 5, 7, -13), "there is no wall -13"),
        ((0, 5, 7, -7), "nothing of the kind happens then"),
        ((0, 5, 7, -5), "nothing of the kind happens then"),
    ],
)
def test_what_no_line_can_be(gas, line, why):
    scene, log = gas
    log = log[:3].copy()
    log[1] = line
    log["tick"][1] += log["tick"][0] * (line[1] == 5)  # between the first two
    index, text = wrong(scene, log, None)
    assert index == 1
    assert why in text


def test_a_fingerprint_is_that_of_the_lines(gas):
    scene, log = gas
    right = certify_log(scene, log, UNTIL).fingerprint
    assert certify_log(scene, log, UNTIL, fingerprint=right).right
    found = certify_log(scene, log, UNTIL, fingerprint="0" * 64)
    assert found.wrong.index == len(log)
    assert right in found.wrong.why


@pytest.fixture(scope="module")
def turning():
    scene = kt.make_scene("grid", bodies=9, density=0.3)
    turns = [(3, 0.25, (0.5, -0.5)), (4, 0.25, (-0.5, 0.0)), (3, 0.5, (0.0, 1.0))]
    scene = kt.Scene(scene.position, scene.velocity, scene.radius, arena=scene.arena, turns=turns)
    return scene, whole_rows(scene, UNTIL)


def test_rows_with_plans_are_right(turning):
    scene, rows = turning
    assert (rows["b"] == -5).sum() == 3
    assert certify_log(scene, rows, UNTIL).right
    rows = rows.copy()
    at = int(np.flatnonzero(rows["b"] >= 0)[0])
    rows["avx"][rows["avx"] == 0.0] = -0.0  # the sign of a zero is no part of the answer
    assert certify_log(scene, rows, UNTIL).right
    rows["bvy"][at] = np.nextafter(rows["bvy"][at], 9.0)
    index, why = wrong(scene, rows)
    assert index == at
    assert f"vy of body {rows['b'][at]} after" in why
    assert "by rules 4 and 9 it is" in why


def test_a_turn_that_is_left_out_or_is_another(turning):
    scene, rows = turning
    at = int(np.flatnonzero(rows["b"] == -5)[0])
    index, why = wrong(scene, np.delete(rows, at))
    assert index == at
    assert "the turn of body 3 at" in why
    other = rows.copy()
    other["avx"][at] = 0.75
    assert wrong(scene, other) == (
        at,
        "vx of body 3 after the turn of body 3 is 0.75; by rules 4 and 9 it is 0.5",
    )
    invented = np.insert(rows, 2, rows[at])
    invented["tick"][2] = rows["tick"][1] + 1
    assert "nothing of the kind happens then" in wrong(scene, invented)[1]


def test_a_check_that_is_broken_off_says_how_far_it_is(gas):
    scene, log = gas

    def enough(state):
        assert state.total == len(log)
        if state.lines > 300:
            raise KeyboardInterrupt

    certifier = LogCertifier(scene, log, UNTIL)
    with pytest.raises(KeyboardInterrupt):
        certifier.run(enough)
    assert 300 < certifier.report.lines < len(log)
    assert not certifier.report.right
    assert "broken off there" in str(certifier.report)


@pytest.mark.parametrize(
    ("bodies", "contacts"), [(25, 300), pytest.param(100, 100_000, marks=pytest.mark.long)]
)
def test_a_run_of_kinetile_is_right_to_its_end(bodies, contacts):
    scene = kt.make_scene("grid", bodies=bodies, density=0.5, seed=4)
    sim = kt.Simulation(scene, "cells")
    sim.run(max_contacts=contacts)
    log = sim.contacts
    found = certify_log(scene, log, max_contacts=contacts, fingerprint=sim.fingerprint)
    assert found.right, str(found)


@pytest.fixture
def three_in_a_row():
    """Disc 2 meets disc 1 at 0.5; disc 0 meets disc 1 later."""
    scene = kt.Scene([[1.0, 1.0], [3.0, 1.0], [4.0, 1.0]], [[0.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.25)
    return scene, np.array([(0, 2**51, 1, 2), (2, 0, 0, 1)], CONTACT_LINE)


def test_the_one_that_is_as_the_specification_says_is_right(three_in_a_row):
    scene, right = three_in_a_row
    late = right.copy()
    late["tick"][1] = 5
    text = explain_difference(scene, {"one": right, "other": late}, 1)
    assert text.startswith("by the specification one is right there; other is wrong in contact 1: body 0")
    assert "its tick should be epoch 2, tick 0, 5 ticks earlier" in text
    text = explain_difference(scene, {"one": late[:1], "other": right}, 1)
    assert text.startswith("by the specification one is wrong in contact 1: ")
    assert text.endswith("; other is right there")
    text = explain_difference(scene, {"phase": right, "naive": right[1:]}, 0)
    assert "phase is right there; naive is wrong in contact 0" in text, "the reference may be wrong"


def test_where_the_specification_does_not_say_it_says_nothing(three_in_a_row, monkeypatch):
    scene, right = three_in_a_row
    lists = {"one": right, "other": right[:1]}
    assert explain_difference(scene, lists, 1, ["disc"])
    assert not explain_difference(scene, lists, 1, ["sticky"])
    assert not explain_difference(scene, lists, 1, ["disc", "wall"])  # and no walls to meet
    monkeypatch.setattr(certify, "_FARTHEST", 0)
    assert not explain_difference(scene, lists, 1)


def test_a_body_that_is_not_there_has_no_contact():
    places, velocities = [(0.25, 0.5), (0.75, 0.5)], [(0.25, 0.0), (-0.25, 0.0)]
    commands = [kt.Remove(1, 0.25), kt.Insert(1.0, (0.75, 0.25), (0.0, 0.0), 0.125)]
    scene = kt.Scene(places, velocities, 0.125, arena=(1.0, 1.0), commands=commands)
    text = {}
    for name, line in {
        "gone": (0, 2**51, 0, 1),
        "to come": (0, 2**51, 0, 2),
        "never": (0, 2**51, 0, 3),
    }.items():
        text[name] = wrong(scene, np.array([line], CONTACT_LINE), None)[1]
    assert text["gone"] == "body 1 is not there: it is still to come, or has gone"
    assert text["to come"] == "body 2 is not there: it is still to come, or has gone"
    assert text["never"] == "there is no body 3: the scene has 3"


@pytest.mark.parametrize(
    ("place", "periodic", "room"),
    [
        ((0.4375, 0.75 - 2.0**-40), "", False),
        ((0.4375, 0.75), "", True),
        ((1.4375, 0.75 - 2.0**-40), "x", False),
        ((-0.4375, 0.5), "x", False),
        ((-0.3125, 0.5), "x", True),
        ((float.fromhex("0x1.c000000000466p-1"), 0.5), "", False),  # at a wall, by a last bit
        ((float.fromhex("0x1.c000000000465p-1"), 0.5), "", True),
    ],
)
@pytest.mark.small
def test_an_insertion_without_room_ends_the_answer(place, periodic, room):
    """The first body is at (0.4375, 0.5) when the other comes, and at (-0.5625, 0.5)."""
    commands = [kt.Insert(0.5, place, (0.0, 0.0), 0.125)]
    scene = kt.Scene(
        [(0.4375, 0.25)], [(0.0, 0.5)], 0.125, arena=(1.0, 1.0), commands=commands, periodic=periodic
    )
    sim = kt.Simulation(scene, "naive")
    with contextlib.nullcontext() if room else pytest.raises(Refused, match="room"):
        sim.run(until=1.5)
    assert certify_log(scene, sim.contacts, 1.5).right
    assert (Course(scene).next(2**51) is not None) == room


@pytest.mark.parametrize("bodies", [0, 1])
@pytest.mark.small
def test_insertions_count_for_the_unit(bodies):
    commands = [kt.Insert(0.5, (0.5, 0.75), (20.0, 3.0), 0.125), kt.Remove(bodies, 1.0)]
    places, velocities = np.full((bodies, 2), 0.25), np.full((bodies, 2), 0.5)
    scene = kt.Scene(places, velocities, 0.125, arena=(1.0, 1.0), commands=commands)
    sim = kt.Simulation(scene, "naive")
    sim.run(until=2.0)
    assert len(sim.contacts) > 10
    assert certify_log(scene, sim.contacts, 2.0).right
