"""One event at a time: the same run, seen closer; and what can be seen between two events."""

from __future__ import annotations

from collections import Counter
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings

import kinetile as kt
from agreement import PHASES, TILING
from kinetile.errors import KinetileError, Refused
from kinetile.kernel.log import WALLS
from kinetile_conformance.strategies import scenes

ALL = PHASES + TILING


def grid(bodies: int = 9, **more) -> kt.Scene:
    scene = kt.make_scene("grid", bodies=bodies, density=0.5, seed=3)
    return kt.Scene(scene.position, scene.velocity, scene.radius, scene.mass, scene.arena, **more)


def contact_of(event: kt.Event) -> tuple:
    """Return an event as the contact that it is."""
    codes = {name: code for code, name in WALLS.items()}
    b = codes[event.wall] if event.wall is not None else event.bodies[1]
    return (event.time, event.epoch, event.tick, event.bodies[0], b)


@pytest.mark.parametrize(("phase", "options"), ALL)
def test_steps_are_the_run_event_by_event(phase, options):
    scene = grid(turns=[(2, 0.25, (1.0, 0.5)), (2, 0.25, (0.5, 1.0)), (0, 0.5, (0.0, 0.0))])
    run = kt.Simulation(scene, phase, options=options)
    run.run(until=0.75)
    stepped = kt.Simulation(scene, phase, options=options)
    events = list(stepped.steps(until=0.75))
    assert stepped.fingerprint == run.fingerprint
    assert (stepped.time, stepped.readings.events) == (0.75, run.readings.events)
    assert stepped.positions().tobytes() == run.positions().tobytes()
    kinds = Counter(event.kind for event in events)
    read = run.readings
    assert kinds["structural"] == read.structural_events
    assert (kinds["disc"], kinds["wall"], kinds["turn"]) == (read.contacts_disc, read.contacts_wall, 3)
    contacts = [contact_of(event) for event in events if event.kind in ("disc", "wall")]
    assert contacts == run.contacts.tolist()
    moments = [(event.epoch, event.tick) for event in events if event.kind != "structural"]
    assert moments == sorted(moments)
    assert all((event.certificate is not None) == (event.kind == "structural") for event in events)


@settings(max_examples=15, deadline=None)
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
            if event is None or event.epoch > 500:  # beyond, plans are written down anew on the way
                break
            assert ahead is not None
            assert event._replace(wall=None) == ahead
            assert sim.exact_time == (event.epoch, event.tick) or event.kind == "structural"


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


def test_steps_go_on_across_shifts_of_the_clock():
    scene = kt.Scene([[0.5, 0.5]], [[0.01, 0.0]], 0.25, arena=(1.0, 1.0))
    run = kt.Simulation(scene, "naive")
    run.run(until=2000.0)
    sim = kt.Simulation(scene, "naive")
    assert all(event.kind == "wall" and event.wall in ("left", "right") for event in sim.steps(until=2000.0))
    assert sim.fingerprint == run.fingerprint
    assert sim.time == 2000.0
    assert len(sim.contacts) == 40


def test_bodies_may_be_turned_between_two_steps():
    stepped = kt.Simulation(grid(), "sap-1d")
    for event in stepped.steps(until=1.0):
        if event.kind == "disc":
            stepped.set_velocity(event.bodies[0], (0.5, 0.25))
            break
    stepped.run(until=1.0)
    run = kt.Simulation(grid(), "sweep-tiling")
    while not (run.contacts["b"] >= 0).any():
        run.run(max_contacts=1)
    run.set_velocity(int(run.contacts[-1]["a"]), (0.5, 0.25))
    run.run(until=1.0)
    assert stepped.fingerprint == run.fingerprint


@pytest.mark.parametrize(("phase", "options"), ALL)
def test_state_is_right_before_the_first_run(phase, options):
    fresh, begun = (kt.Simulation(grid(), phase, options=options) for _ in range(2))
    state = fresh.state
    begun.build()  # and no event: under cells, bodies on an edge go over at the first tick
    for mine, other in zip(state, begun.state, strict=True):
        assert mine.tobytes() == other.tobytes()
    fresh.audit()
    assert (fresh.time, len(fresh.contacts)) == (0.0, 0)


def test_tables_and_state_can_only_be_read():
    sim = kt.Simulation(grid(), "sap-1d")
    for table in (*sim.tables, *sim.state):
        assert not table.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        sim.tables.bodies.x[0] = 1.0


@pytest.mark.parametrize(("phase", "options"), ALL)
def test_max_events_stops_after_so_many(phase, options):
    whole, pieces = (kt.Simulation(grid(), phase, options=options) for _ in range(2))
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


def test_built_anew_a_run_goes_on_as_before():
    sim, other = kt.Simulation(grid()), kt.Simulation(grid())
    for _ in islice(sim.steps(), 40):
        sim.rebuild()
        sim.audit()
    sim.run(until=1.0)
    other.run(until=1.0)
    assert sim.fingerprint == other.fingerprint
    assert np.array_equal(sim.contacts_since(5), other.contacts[5:])


def test_a_body_that_was_turned_after_a_look_ahead_was_placed_too_far_from_the_common_clock():
    """Bounds are good within a span of the common clock's origin, and that had gone on to what comes next."""
    position, velocity = [[0.25, 0.5], [0.75, 0.25]], [[0.001, 0.0], [0.0, 0.0]]
    sim = kt.Simulation(
        kt.Scene(position, velocity, 0.125, [1e6, 1.0], arena=(1.0, 1.0)), "naive", turning=True
    )
    assert sim.next_event is not None
    sim.set_velocity(1, (5e-4, 2.5e-4))  # so little energy that nothing is built anew
    clock = sim.tables.clock[0]
    assert abs(int(clock.origin) - int(clock.now)) <= int(clock.span)
    sim.audit()
