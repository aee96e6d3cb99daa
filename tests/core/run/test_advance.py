"""Runs event by event, and runs that stop at chosen contacts."""

import pickle
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings

import kinetile as kt
from agreement import ALL
from fresh_scenes import fresh, row_of
from kinetile.errors import KinetileError, Refused
from kinetile.kernel.log import REANCHORED
from kinetile_conformance.strategies import scenes
from lanes import BUILT_IN, GENERAL, examples, first
from sensors import LATE, foretold, world


def grid(bodies: int = 9, **more) -> kt.Scene:
    return kt.make_scene("grid", bodies=bodies, density=0.5, seed=3).replace(**more)


@settings(max_examples=examples(10), deadline=None)
@given(scene=scenes())
def test_the_next_event_is_the_one_that_comes(scene):
    for phase, options in ALL:
        try:
            sim = kt.Simulation(scene, phase, options=options, turning=True)
        except Refused:
            continue
        for _ in range(25):
            ahead = sim.next_event
            assert sim.next_event == ahead
            try:
                event = sim.step()
            except KinetileError:
                break
            if event is None or event.epoch > 500:  # beyond, plans are noted again on the way
                break
            assert ahead is not None
            assert foretold(event) == ahead
            assert sim.exact_time == (event.epoch, event.tick) or event.kind == "structural"


def test_steps_ended_before_their_time_in_a_scene_of_slow_bodies():
    scene = kt.Scene([(1.0, 1.0), (2.5, 1.0)], [(1e-8, 0.0), (0.0, 0.0)], 0.5, arena=(4.0, 4.0))
    sim = kt.Simulation(scene)
    assert [event.kind for event in sim.steps(until=1e8)] == ["disc"]
    assert sim.time == 1e8


def on_top(**more) -> kt.Scene:
    """Returns a body that begins on a sensor, and is removed while a second one is inserted on it."""
    return kt.Scene(
        [(1.0, 1.0), (1.5, 1.0), (3.0, 3.0)],
        [(0.5, 0.0), (0.0, 0.0), (0.0, 0.0)],
        [0.25, 0.5, 0.125],
        arena=(4, 4),
        kind=["ball", "sensor", "ball"],
        responses={("ball", "sensor"): "pass"},
        **more,
    )


COMES_AND_GOES = [kt.Insert(0.5, (1.5, 1.5), (0.0, 0.0), 0.125, kind="ball"), kt.Remove(1, 0.75)]
"""With ``on_top``: passings that begin by an insertion and end by a removal."""


@pytest.mark.parametrize("seed", first(3, [10, 17, 49, 13, *range(100, 130)]))
def test_steps_of_scenes_drawn_freshly_are_the_rows_of_the_log(seed):
    scene, until = fresh(seed, 8)
    free, stepped = (kt.Simulation(scene, "cells" if seed % 3 else "sap-2d") for _ in range(2))
    parts = [np.zeros(0, kt.LOG)]
    try:
        free.run(until, max_contacts=40, recorder=parts.append)
        free.run(free.time, recorder=parts.append)
    except KinetileError:
        return
    rows = np.concatenate(parts)
    rows = rows[rows["b"] != REANCHORED]
    events = []
    while len(events) < free.readings.events:
        ahead = stepped.next_event
        events.append(stepped.step())
        # Not foreseen: plans that are noted again on the way, and structures that are for an insertion.
        assert ahead == foretold(events[-1]) or scene.periodic or events[-1].kind == "structural"
    assert [row_of(event) for event in events if event.kind != "structural"] == [
        tuple(row) for row in rows[["epoch", "tick", "a", "b"]].tolist()
    ]
    assert sum(event.kind == "structural" for event in events) == free.readings.structural_events
    assert stepped.fingerprint == free.fingerprint


@pytest.mark.parametrize("phase", first(1, BUILT_IN[1:]))
def test_an_insertion_that_made_room_was_two_steps_and_a_structural_event_none(phase):
    """A structure that is built again for more bodies may have an event before the insertion."""
    for seed in range(6):
        velocities = np.random.default_rng(seed).uniform(-2.0, 2.0, (3, 2))
        places = [(0.5, 0.5), (0.9 + 0.02 * seed, 1.5), (1.2, 2.5)]
        insert = kt.Insert(0.3, (3.5, 3.5), (0.0, 0.0), 0.05)
        stepped = kt.Simulation(kt.Scene(places, velocities, 0.2, arena=(4, 4), commands=[insert]), phase)
        events = list(stepped.steps(0.35))
        assert [event.kind for event in events].count("insert") == 1
        assert len(events) == stepped.readings.events


def test_a_step_may_be_saved_between_two_contacts_of_one_command():
    sim = kt.Simulation(on_top(commands=COMES_AND_GOES), "cells")
    kinds = []
    for _ in range(6):
        sim = pickle.loads(pickle.dumps(sim))
        kinds.append(sim.step().kind)
    assert kinds == ["pass", "insert", "pass", "part", "part", "remove"]


def test_what_began_by_hand_or_in_a_run_is_a_step_or_is_not():
    sim = kt.Simulation(on_top(), "cells", live=True)
    sim.build()
    assert (sim.next_event.kind, sim.next_event.bodies) == ("pass", (0, 1))
    sim.run(sim.time)  # all that happens at the start has happened
    assert sim.next_event.kind == "part"
    sim.insert((1.5, 1.0), (0.0, 0.0), 0.125, kind="ball")
    assert (sim.next_event.kind, sim.next_event.bodies) == ("pass", (1, 3))
    assert sim.next_event == foretold(sim.step())
    sim.remove(1)
    assert [(event.kind, event.bodies) for event in islice(sim.steps(), 2)] == [
        ("part", (0, 1)),
        ("part", (1, 3)),
    ]
    assert (sim.next_event.kind, sim.next_event.bodies) == ("disc", (0, 3))


def test_a_run_stops_at_each_passing_that_begins_at_the_start_or_by_a_command():
    for built in (False, True):
        sim = kt.Simulation(on_top(commands=COMES_AND_GOES), "cells")
        if built:
            sim.build()
        found = stops(sim, kt.StopAt(kinds=["sensor"], parts=True), 2.0)
        assert [(event.time, event.kind, event.bodies) for event in found] == [
            (0.0, "pass", (0, 1)),
            (0.5, "pass", (1, 3)),
            (0.75, "part", (0, 1)),
            (0.75, "part", (1, 3)),
        ]


def test_a_step_where_nothing_is_awaited_runs_nothing():
    alone = kt.Simulation(kt.Scene([[0.0, 0.0]], [[0.0, 0.0]], 1.0), "naive")
    assert alone.next_event is None
    assert alone.step() is None
    assert list(alone.steps(until=2.5)) == []
    assert alone.time == 2.5


def test_a_turn_spans_away_is_the_next_event():
    scene = kt.Scene([[0.0, 0.0]], [[0.0, 0.0]], 1.0, turns=[(0, 5000.25, (1.0, 0.0))])
    sim = kt.Simulation(scene, "naive")
    ahead = sim.next_event
    assert ahead == kt.Event(5000.25, 5000, 2**50, "turn", (0,))
    assert sim.time == 0.0
    assert sim.step() == ahead
    assert sim.time == 5000.25
    assert sim.step() is None


@pytest.mark.parametrize(("phase", "options"), first(3, ALL))
def test_state_is_right_before_the_first_run(phase, options):
    unbuilt, begun = (kt.Simulation(grid(), phase, options=options) for _ in range(2))
    state = unbuilt.state
    begun.build()  # and no event: under cells, bodies on an edge go over at the first tick
    for mine, other in zip(state, begun.state, strict=True):
        assert mine.tobytes() == other.tobytes()
    unbuilt.audit()
    assert (unbuilt.time, len(unbuilt.contacts)) == (0.0, 0)


def test_tables_and_state_can_only_be_read():
    sim = kt.Simulation(grid(), "sap-1d")
    for table in (*sim.tables, *sim.state):
        assert not table.flags.writeable


@pytest.mark.parametrize(("phase", "options"), first(2, ALL))
def test_max_events_stops_after_so_many(phase, options):
    whole, pieces = (kt.Simulation(grid(4), phase, options=options) for _ in range(2))
    whole.run(until=0.5)
    before = 0
    while pieces.time < 0.5:
        pieces.run(until=0.5, max_events=7)
        made = pieces.readings.events - before
        assert made == 7 or (made < 7 and pieces.time == 0.5)
        before += made
    assert pieces.fingerprint == whole.fingerprint
    pieces.run(max_events=0)
    assert pieces.readings.events == before


def test_a_body_that_was_turned_after_a_look_ahead_was_placed_too_far_from_the_common_clock():
    """Bounds are good within a span of the common clock's origin, and this had gone on to the next event."""
    position, velocity = [[0.25, 0.5], [0.75, 0.25]], [[0.001, 0.0], [0.0, 0.0]]
    sim = kt.Simulation(
        kt.Scene(position, velocity, 0.125, [1e6, 1.0], arena=(1.0, 1.0)), "naive", turning=True
    )
    assert sim.next_event is not None
    sim.set_velocity(1, (5e-4, 2.5e-4))  # so little energy that nothing is built again
    clock = sim.tables.clock[0]
    assert abs(int(clock.origin) - int(clock.now)) <= int(clock.limits.span)
    sim.audit()


def stops(sim: kt.Simulation, stop: kt.StopAt, until: float) -> list[kt.Event]:
    found = []
    while event := sim.run(until=until, stop_at=stop).event:
        found.append(event)
        assert sim.exact_time == (event.epoch, event.tick)
        assert len(found) < 500
    return found


@pytest.mark.parametrize("before", [False, True])
def test_it_stops_at_every_contact_of_a_kind_at_its_exact_time(before):
    sim = kt.Simulation(world(), "cells")
    found = stops(sim, kt.StopAt(kinds=["sensor"], before=before, parts=True), 6.0)
    assert [(event.time, event.kind, event.bodies) for event in found] == [
        (1.7, "pass", (0, 1)),
        (2.25, "pass", (1, 2)),
        (2.3, "part", (0, 1)),
        (3.75, "part", (1, 2)),
    ]
    assert sim.time == 6.0
    unstopped = kt.Simulation(world(), "cells")
    unstopped.run(until=6.0)
    assert sim.fingerprint == unstopped.fingerprint


@pytest.mark.parametrize("phase", GENERAL)
def test_a_run_stops_at_a_contact_after_which_a_body_is_faster_than_any_before(phase):
    places, velocities = [[1.0, 1.0], [3.0, 1.0]], [[0.0, 0.0], [-1.0, 0.0]]
    scene = kt.Scene(places, velocities, 0.25, mass=[1.0, np.inf], arena=(4.0, 2.0))
    unstopped, sim = kt.Simulation(scene, phase), kt.Simulation(scene, phase)
    unstopped.run(until=2.125)
    met = []
    while event := sim.run(until=2.125, stop_at=kt.StopAt()).event:
        met.append((event.time, event.bodies))
        assert len(sim.contacts) == len(met)
    assert [bodies for _, bodies in met[:3]] == [(0, 1), (0,), (0, 1)]
    assert [time for time, _ in met] == unstopped.contacts["time"].tolist()


@pytest.mark.parametrize("phase", GENERAL)
def test_a_run_stops_at_a_passing_that_a_command_begins_or_ends(phase):
    """Rebuilt phases counted such a contact, gave it only to the next run, and did not stop."""
    rules = {("*", "*"): kt.Response("pass")}
    commands = [kt.Insert(1.0, (1.25, 1.5), (0.0, 0.5), 0.25), kt.Remove(2, 2.0)]
    scene = kt.Scene([[1, 1], [3, 1]], [[0.25, 0.5], [0, 0.5]], 0.25, arena=(4, 4), responses=rules)
    scene = scene.replace(commands=commands)
    for most in (1, 2):
        sim = kt.Simulation(scene, phase)
        sim.run(max_contacts=most)
        assert sim.contacts[["time", "a", "b"]].tolist() == [(1.0, 0, 2), (2.0, 2, 0)][:most]
    sim = kt.Simulation(scene, phase)
    found = [sim.run(until=9.0, stop_at=kt.StopAt(bodies=[2], parts=True)).event for _ in range(2)]
    assert [(event.time, event.kind, event.bodies) for event in found] == [
        (1.0, "pass", (0, 2)),
        (2.0, "part", (0, 2)),
    ]


@pytest.mark.parametrize("phase", GENERAL)
def test_what_is_commanded_before_a_contact_can_avert_it(phase):
    sim = kt.Simulation(world(), phase, live=True)
    _, event = sim.run(until=6.0, stop_at=kt.StopAt(pairs=[(1, 0)], before=True))
    assert (event.kind, event.bodies, event.time) == ("pass", (0, 1), 1.7)
    sim.set_velocity(0, (-2.0, 0.0))
    _, event = sim.run(until=6.0, stop_at=kt.StopAt(pairs=[(0, "wall"), (0, 1)]))
    assert (event.kind, event.wall, event.time) == ("wall", "left", 3.85)
    assert (0, 1) not in sim.contacts[["a", "b"]].tolist()
    again = kt.Simulation(sim.recorded(), "naive")
    again.run(until=sim.time)
    assert again.fingerprint == sim.fingerprint


def test_a_run_says_why_it_has_ended():
    def ended(*given, scene=None, **options):
        return kt.Simulation(world() if scene is None else scene, "cells").run(*given, **options)

    alone = kt.Scene([(1, 1)], [(0, 0)], 0.25, arena=(4, 4))
    reasons = [
        ("until", ended(1.0)),
        ("until", ended(1.0, max_contacts=500, max_events=5000)),
        ("max_contacts", ended(6.0, max_contacts=2)),
        ("max_contacts", ended(6.0, max_contacts=2, observe=["msd:every=0.25"])),
        ("max_events", ended(6.0, max_events=2)),
        ("stop_at", ended(6.0, stop_at=kt.StopAt())),
        ("stop_at", ended(6.0, stop_at=kt.StopAt(), observe=["msd:every=0.25"])),
        ("on_contact", ended(6.0, on_contact=lambda event: True)),
        ("until", ended(6.0, on_contact=lambda event: None, observe=["msd:every=0.25"])),
        ("idle", ended(scene=alone, max_contacts=1)),
    ]
    for reason, each in reasons:
        assert (each.reason, bool(each)) == (reason, reason == "until")
        assert (each.event is None) == (reason not in ("stop_at", "on_contact"))


def test_a_run_stops_for_a_body_that_comes_by_hand_into_an_empty_scene():
    sim = kt.Simulation(kt.Scene([], [], [], arena=(4.0, 4.0)), "naive", live=True)

    def bring(_):
        if not len(sim.bodies):
            sim.insert((2.0, 3.0), (0.0, 1.0), 0.25)

    _, event = sim.run(until=600.0, stop_at=kt.StopAt(), progress=bring)
    assert (event.bodies, event.wall) == ((0,), "top")


def test_a_body_that_comes_during_the_run_is_of_its_kind():
    sim = kt.Simulation(world(commands=[LATE]))
    _, event = sim.run(until=6.0, stop_at=kt.StopAt(kinds=["late"]))
    assert (event.time, event.bodies, event.wall) == (1.75, (3,), "top")
    assert sim.run(until=6.0)


@pytest.mark.parametrize("kind", [None, "sensor"])
def test_a_body_that_comes_is_watched_where_no_kinds_are_named(kind):
    comes = kt.Insert(1.0, (1.0, 3.5), (0.0, 2.0), 0.25)
    kinds = {} if kind is None else {"kind": [kind], "kinds": [kind, "other"]}
    scene = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], 0.5, arena=(4.0, 4.0), commands=[comes], **kinds)
    sim = kt.Simulation(scene, live=True)
    by_hand = sim.insert((3.0, 1.0), (2.0, 0.0), 0.25)
    found = stops(sim, kt.StopAt(kinds=[kind or 0]), 1.25)
    assert [(event.time, event.bodies) for event in found] == [(0.375, (by_hand,)), (1.125, (1,))]


def test_the_next_event_was_the_move_of_a_passing_body_and_the_step_returned_the_end_of_its_passing():
    sim = kt.Simulation(on_top(commands=[kt.Move(0, 0.125, (1.0, 3.0))]), "cells")
    assert sim.step().kind == "pass"
    for _ in range(3):
        event = sim.next_event
        assert event == sim.step()
        if event.kind == "move":
            return
    pytest.fail("it was not moved")
