"""Kinds while a run goes on: whose they are, in events and event files, and as a filter of questions."""

import enum
import pickle

import numpy as np
import pytest

import kinetile as kt
from inside import engine_of
from kinetile.run.engine import layout
from lanes import first
from sensors import LATE, world


@pytest.fixture
def sim() -> kt.Simulation:
    return kt.Simulation(world(kinds=["ball", "sensor", "late", 7], commands=[LATE]), "naive", live=True)


def test_kinds_stand_beside_bodies(sim):
    assert sim.kinds.tolist() == ["ball", "sensor", "ball"]
    sim.run(until=1.5)
    assert sim.bodies[sim.kinds == "ball"].tolist() == [0, 2]
    assert sim.kinds.tolist() == ["ball", "sensor", "ball", "late"]
    assert kt.Simulation(kt.make_scene("grid", bodies=4), "naive").kinds.tolist() == [0, 0, 0, 0]


def test_contacts_have_kinds_whoever_has_gone_or_came_by_hand(sim):
    assert sim.kinds_of(3) == "late", "it is still to come"
    sim.run(until=1.5)
    assert sim.insert((8.0, 2.0), (0.0, -4.0), 0.5, kind=7) == 4
    sim.remove(2)
    sim.run(until=2.0)
    sim.remove(4)
    assert sim.bodies.tolist() == [0, 1, 3]
    met = sim.contacts
    assert met[["a", "b"]].tolist() == [(0, 1), (3, -4), (4, -3)]
    assert list(zip(sim.kinds_of(met["a"]), sim.kinds_of(met["b"]), strict=True)) == [
        ("ball", "sensor"),
        ("late", "wall"),
        (7, "wall"),
    ]
    assert sim.kinds_of([[0, 4], [-1, 2]]).tolist() == [["ball", 7], ["wall", "ball"]]
    for other in (pickle.loads(pickle.dumps(sim)), kt.Simulation(sim.recorded(), "cells")):
        assert other.kinds_of(np.arange(5)).tolist() == ["ball", "sensor", "ball", "late", 7]


@pytest.mark.parametrize("recorded", first(1, [True, False]))
def test_a_log_grows_with_the_bodies_that_a_command_may_find(monkeypatch, recorded):
    """A body that comes waits for room to begin a passing with every other: it waited for ever."""
    monkeypatch.setattr(layout, "LOG_ROWS", 4)
    place = [(1.0 + 2.0 * (i % 6), 1.0 + 2.0 * (i // 6)) for i in range(12)]
    coming = [kt.Insert(0.01 * i, place[i], (0.0, 0.0), 0.5, kind="ball") for i in range(2, 12)]
    more = {"kind": ["ball", "sensor"], "responses": {("ball", "sensor"): "pass"}, "commands": coming}
    sim = kt.Simulation(
        kt.Scene(place[:2], np.zeros((2, 2)), [0.5, 0.5], arena=(14.0, 14.0), **more), "naive"
    )
    rows = []
    with engine_of(sim).ledger.recording(rows.extend if recorded else None):
        for _ in range(40):
            engine_of(sim).chunk(2**52, 2**60)
    assert len(sim.bodies) == 12
    assert len(rows) == (10 if recorded else 0)


def test_events_say_of_which_kinds_their_bodies_are(sim):
    assert sim.next_event.kinds == ("late",)
    told = [(event.kind, event.kinds) for event in sim.steps(until=2.5)]
    assert told == [
        ("insert", ("late",)),
        ("pass", ("ball", "sensor")),
        ("wall", ("late",)),
        ("pass", ("sensor", "ball")),
        ("part", ("ball", "sensor")),
    ]
    _, event = sim.run(until=6.0, stop_at=kt.StopAt(kinds="sensor", parts=True))
    assert (event.kind, event.bodies, event.kinds) == ("part", (1, 2), ("sensor", "ball"))
    assert sim.step().kinds in (("ball",), ("late",))
    plain = kt.Simulation(kt.make_scene("two-discs"), "naive")
    assert plain.step().kinds == ()


def test_questions_can_be_about_some_kinds(sim):
    everywhere = (0.0, 0.0, 10.0, 10.0)
    assert sim.bodies_in(everywhere, kinds="ball").tolist() == [0, 2]
    assert sim.bodies_in(everywhere, kinds=["sensor", 7]).tolist() == [1]
    assert sim.bodies_in(everywhere, kinds=[]).tolist() == []
    assert sim.bodies_near((1.0, 5.0), k=1).tolist() == [0]
    assert sim.bodies_near((1.0, 5.0), k=1, kinds=["sensor"]).tolist() == [1]
    assert [hit.body for hit in sim.ray((0.0, 5.0), (1.0, 0.0))] == [0, 1]
    assert [hit.body for hit in sim.ray((0.0, 5.0), [1.0, 0.0], most=1, kinds="sensor")] == [1]
    assert sim.cast((9.0, 5.0, 0.1), np.array([-4.0, 0.0])).body == 1
    assert sim.cast([9.0, 5.0, 0.1], (-4.0, 0.0), kinds="ball").body == 0, "through the sensor"
    assert sim.cast((9.0, 5.0, 0.1), (-4.0, 0.0), kinds=7) is None


def test_a_scene_of_one_kind_can_be_asked_about_it_and_one_without_bodies_has_walls():
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    assert sim.bodies_in((0.0, 0.0, 1.0, 1.0), kinds=0).tolist() == [0, 1, 2, 3]
    assert sim.bodies_in((0.0, 0.0, 1.0, 1.0), kinds=()).tolist() == []
    empty = kt.Simulation(kt.Scene([], [], [], arena=(4.0, 4.0)), "naive")
    assert (empty.kinds.tolist(), empty.kinds_of([-1]).tolist()) == ([], ["wall"])


def test_a_simulation_is_shown_in_a_line(sim):
    assert repr(sim) == "<Simulation: naive, 3 bodies, time 0.0, 0 contacts>"
    sim.run(until=2.0)
    assert repr(sim) == "<Simulation: naive, 4 bodies, time 2.0, 2 contacts>"
    one = kt.Simulation(kt.Scene([[0.0, 0.0]], [[0.0, 0.0]], 1.0), "naive")
    assert repr(one) == "<Simulation: naive, 1 body, time 0.0, 0 contacts>"


def test_an_event_file_has_the_kinds_of_all_bodies(sim, tmp_path):
    path = tmp_path / "run.parquet"

    def throw(_):
        if sim.bodies[-1] < 5:
            sim.insert((8.0, 2.0), (0.0, -4.0), 0.5, kind=7)  # while the recorder takes rows

    with kt.EventRecorder(path, sim.scene) as recorder:
        sim.run(until=0.5)
        sim.insert((2.0, 8.0), (0.0, 4.0), 0.25, kind="sensor")  # where no recorder is
        sim.remove(4)
        sim.run(until=1.0, progress=throw, recorder=recorder)
        sim.insert((8.0, 4.0), (0.0, -4.0), 0.5, kind=7)
        sim.run(until=2.0, recorder=recorder)
    found = kt.read_events(path)
    there = [[k, k, kind] for k, kind in enumerate(["ball", "sensor", "ball", "late", "sensor"])]
    assert found.metadata["kinds"] == [*there, [5, 6, 7]]
    for name in ("a", "b"):
        known = found.rows[name] >= -4
        kinds = found.kinds_of(found.rows[name][known])
        assert kinds.tolist() == sim.kinds_of(found.rows[name][known]).tolist()
    assert found.kinds_of([6, 7, -1]).tolist() == [7, None, "wall"]


def test_a_file_that_goes_on_after_a_kill_has_the_kinds_of_before(sim, tmp_path):
    path = tmp_path / "run.parquet"
    with kt.EventRecorder(path, sim.scene) as recorder:
        sim.insert((8.0, 2.0), (0.0, -4.0), 0.5, kind=7)
        sim.run(until=1.0, recorder=recorder)
        sim.save(tmp_path / "run.kt")
    again = kt.resume(tmp_path / "run.kt")
    with kt.EventRecorder(path, again.scene, behind=again) as recorder:
        again.insert((2.0, 8.0), (0.0, 4.0), 0.25, kind="sensor")
        again.run(until=2.0, recorder=recorder)
    assert kt.read_events(path).metadata["kinds"][-2:] == [[4, 4, 7], [5, 5, "sensor"]]


class Text(enum.StrEnum):
    BALL = "ball"


class Mixed(str, enum.Enum):  # noqa: UP042 - it is printed in another way than a StrEnum
    BALL = "ball"


class Whole(enum.IntEnum):
    SEVEN = 7


class Unequal(enum.Enum):
    BALL = "ball"


EQUAL = {
    "ball": [np.str_("ball"), np.array(["ball"])[0], Text.BALL, Mixed.BALL],
    7: [np.int64(7), np.array([7], np.uint8)[0], Whole.SEVEN],
}
UNEQUAL = [Unequal.BALL, True, None, 7.5, b"ball", np.array(["ball", 7], object)]


def mixture(**more):
    places, flies = [(1.0, 1.0), (3.0, 1.0), (1.0, 3.0)], [(1.0, 0.5), (-1.0, 0.25), (0.5, -1.0)]
    return kt.Scene(places, flies, 0.25, arena=(4.0, 4.0), kind=["ball", 7, 1], **more)


def called(sim, *keys):
    calls = []
    sim.run(until=4.0, on_contact=dict.fromkeys(keys, calls.append))
    return calls


ENTRANCES = {
    "on_contact": called,
    "on_contact, two": lambda sim, kind: called(sim, (1, kind), (kind, "wall")),
    "stop_at": lambda sim, kind: sim.run(until=4.0, stop_at=kt.StopAt(kinds=[kind])).event,
    "set_kind": lambda sim, kind: (sim.set_kind(2, kind), sim.kinds.tolist()),
    "insert": lambda sim, kind: (sim.insert((3.0, 3.0), radius=0.1, kind=kind), sim.kinds.tolist()),
    "bodies_in": lambda sim, kind: sim.bodies_in((0.0, 0.0, 4.0, 4.0), kinds=[kind]).tolist(),
    "next_contact_of": lambda sim, kind: sim.next_contact_of(2, kinds=[kind, "wall"]),
}


@pytest.mark.parametrize("entrance", ENTRANCES)
def test_what_equals_a_kind_is_that_kind_and_what_does_not_is_refused(entrance):
    """Those that are printed otherwise were never called for, and some errors were Python's own."""

    def answer(kind):
        return ENTRANCES[entrance](kt.Simulation(mixture(), "naive", live=True), kind)

    for kind, values in EQUAL.items():
        expected = answer(kind)
        assert expected
        for value in [*values, *([7.0] if kind == 7 else [])]:
            assert answer(value) == expected, value
    for value in UNEQUAL:
        no_key = isinstance(value, np.ndarray) and entrance.startswith("on_contact")
        if not no_key and not (value is None and entrance == "insert"):
            with pytest.raises(ValueError, match="is no kind of this scene; there are: 'ball', 7, 1"):
                answer(value)


def test_scenes_read_kinds_as_runs_do():
    for kind, values in EQUAL.items():
        scenes = [
            mixture(responses={(each, "wall"): "stop"}, commands=[kt.SetKind(2, 1.0, each)])
            for each in [kind, *values]
        ]
        assert len(set(scenes)) == 1
