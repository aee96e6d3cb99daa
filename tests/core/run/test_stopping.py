"""Runs that stop at chosen contacts, before them or after."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from kinetile.errors import KinetileError
from kinetile_conformance.strategies.ruled import ruled_scenes
from kinetile_conformance.strategies.small import box_scenes

PHASES = ("naive", "cells", "sap-1d", "sap-2d", "sweep-tiling")


def three(**more) -> kt.Scene:
    """Return a ball and a slower one on their ways through a sensor at (5, 5)."""
    return kt.Scene(
        [[1.0, 5.0], [5.0, 5.0], [5.0, 2.0]],
        [[2.0, 0.0], [0.0, 0.0], [0.0, 1.0]],
        [0.1, 0.5, 0.25],
        arena=(10.0, 10.0),
        kind=["ball", "sensor", "ball"],
        responses={("ball", "sensor"): "pass"},
        **more,
    )


def stops(sim: kt.Simulation, stop: kt.StopAt, until: float) -> list[kt.Event]:
    """Return the events at which a run stops on its way to a time."""
    found = []
    while (event := sim.run(until=until, stop_at=stop)) is not None:
        found.append(event)
        assert sim.exact_time == (event.epoch, event.tick)
        assert len(found) < 500
    return found


@pytest.mark.parametrize("before", [False, True])
def test_it_stops_at_every_contact_of_a_kind_at_its_exact_time(before):
    sim = kt.Simulation(three(), "cells")
    found = stops(sim, kt.StopAt(kinds=["sensor"], before=before), 6.0)
    assert [(event.time, event.kind, event.bodies) for event in found] == [
        (1.7, "pass", (0, 1)),
        (2.25, "pass", (1, 2)),
        (2.3, "part", (0, 1)),
        (3.75, "part", (1, 2)),
    ]
    assert sim.time == 6.0
    straight = kt.Simulation(three(), "cells")
    straight.run(until=6.0)
    assert sim.fingerprint == straight.fingerprint


@pytest.mark.parametrize("before", [False, True])
@settings(max_examples=8, deadline=None)
@given(data=st.data())
def test_stopping_everywhere_changes_nothing_and_misses_nothing(before, data):
    scene = data.draw(st.one_of(ruled_scenes(), box_scenes()))
    straight, sim = (kt.Simulation(scene, "cells", live=True) for _ in range(2))
    until = scene.settings.until
    try:
        straight.run(max_contacts=100)
    except KinetileError:
        return
    count, heads = len(straight.contacts), []
    while len(heads) < count:
        event = sim.run(until=until, stop_at=kt.StopAt(before=before))
        if event is None:
            break
        assert scene.ruled or len(sim.contacts) == len(heads) + (not before)
        heads.append((event.epoch, event.tick, set(event.bodies)))
    told = [
        (int(row["epoch"]), int(row["tick"]), {int(n) for n in (row["a"], row["b"]) if n >= 0})
        for row in straight.contacts
    ]
    if not scene.ruled:  # who comes on top of others begins to pass them in the same event
        assert heads == told[: len(heads)]
    assert (
        sim.contacts.tolist()[: len(heads)] == straight.contacts.tolist()[: len(sim.contacts)][: len(heads)]
    )


@pytest.mark.parametrize("phase", PHASES[:4])
def test_what_is_commanded_before_a_contact_can_avert_it(phase):
    sim = kt.Simulation(three(), phase, live=True)
    event = sim.run(until=6.0, stop_at=kt.StopAt(pairs=[(1, 0)], before=True))
    assert (event.kind, event.bodies, event.time) == ("pass", (0, 1), 1.7)
    sim.set_velocity(0, (-2.0, 0.0))
    event = sim.run(until=6.0, stop_at=kt.StopAt(pairs=[(0, "wall"), (0, 1)]))
    assert (event.kind, event.wall, event.time) == ("wall", "left", 3.85)
    assert (0, 1) not in sim.contacts[["a", "b"]].tolist()
    again = kt.Simulation(sim.recorded(), "naive")
    again.run(until=sim.time)
    assert again.fingerprint == sim.fingerprint


def test_a_body_that_comes_during_the_run_is_of_its_kind():
    sim = kt.Simulation(three(commands=[kt.Insert(1.0, (8.0, 8.0), (0.0, 2.0), 0.5, kind="late")]))
    event = sim.run(until=6.0, stop_at=kt.StopAt(kinds=["late"]))
    assert (event.time, event.bodies, event.wall) == (1.75, (3,), "top")
    assert sim.run(until=6.0) is None


@pytest.mark.parametrize(
    ("stop", "said"),
    [
        (kt.StopAt(bodies=[7]), "there is no body 7: numbers up to 2 have been given"),
        (kt.StopAt(bodies=["a"]), "a body goes by its number; found 'a'"),
        (
            kt.StopAt(kinds=["ghost"]),
            "stop_at: 'ghost' is no kind of this scene; there are: 'ball', 'sensor'",
        ),
        (kt.StopAt(pairs=[(1, 2, 3)]), "stop_at: a pair is two numbers of bodies, or one and 'wall'"),
    ],
)
def test_what_is_not_there_is_refused(stop, said):
    sim = kt.Simulation(three())
    with pytest.raises((ValueError, IndexError, TypeError), match=said):
        sim.run(until=1.0, stop_at=stop)
    assert sim.time == 0.0
    assert sim.run(until=1.0) is None
