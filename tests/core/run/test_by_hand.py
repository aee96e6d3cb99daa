"""Commands by hand: their place among those that wait, their rows, and what is not done for each."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from kinetile.errors import Refused
from kinetile.kernel.log import TURNED
from kinetile.kernel.tables import COMMAND, allocate
from kinetile.run.engine.commands import by_hand
from kinetile.run.engine.commands.agenda import Agenda, to_the_front
from kinetile.run.engine.dials import dials


def numbered(first: int, ticks: list[int]) -> np.ndarray:
    rows = np.zeros(len(ticks), COMMAND)
    rows["tick"], rows["code"] = ticks, TURNED
    rows["body"] = np.arange(first, first + len(ticks))
    return rows


steps = st.lists(
    st.one_of(
        st.tuples(st.just("give"), st.integers(1, 150), st.integers(0, 150)),
        st.tuples(st.just("pass"), st.integers(0, 3), st.just(0)),
    ),
    max_size=12,
)


@given(st.lists(st.integers(0, 6), max_size=8), steps)
def test_commands_by_hand_stand_behind_those_of_their_tick_and_before_all_others(planned, steps):
    """Against a list that is sorted each time. Of those of this tick, so many are carried out."""
    k = allocate(1, 1, 1)
    dial = dials(k.clock)
    expected = [(tick, at) for at, tick in enumerate(sorted(planned))]
    if planned:
        k = to_the_front(k, dial, numbered(0, sorted(planned)))
    given_so_far = 1000
    for what, many, done in steps:
        if what == "pass":
            dial.now[0] += many
            gone = [each for each in expected if each[0] < dial.now[0]]
            dial.command[0] += len(gone)
            expected = expected[len(gone) :]
            continue
        tick = dial.now[0]
        rows = numbered(given_so_far, [tick] * many)
        k = to_the_front(k, dial, rows)
        expected = sorted([*expected, *((tick, given_so_far + at) for at in range(many))], key=lambda e: e[0])
        behind = len([each for each in expected if each[0] > tick])
        found = k.commands[dial.command[0] : dial.commands[0]]
        assert list(zip(found.tick.tolist(), found.body.tolist(), strict=True)) == expected
        done = min(done, len(expected) - behind)
        dial.command[0] += done
        expected = expected[done:]
        given_so_far += many


def test_hundreds_by_hand_among_those_of_the_scene():
    """More than there are free rows in front, one by one and in one call, beside what is scheduled."""
    scene = kt.make_scene("grid", bodies=25, density=0.2, seed=2)
    planned = [kt.Turn(body, 0.25 * (body + 1), (0.5, -0.5)) for body in range(5)]
    planned.append(kt.Remove(20, 700.0))  # in a later span of the clock
    scene = kt.Scene(scene.position, scene.velocity, scene.radius, 1.0, scene.arena, commands=planned)
    sim = kt.Simulation(scene, "cells", live=True)
    random = np.random.default_rng(5)
    for frame in range(6):
        for body in random.integers(5, 20, 90).tolist():
            sim.set_velocity(body, tuple(random.normal(size=2)))
        sim.set_velocities(np.arange(300) % 25, random.normal(size=(300, 2)))
        sim.run(until=0.2 * (frame + 1))
    sim.remove(4)  # and with it, what was scheduled for it
    sim.run(until=1.5)
    assert sim.readings.turns == 6 * 390 + 4
    for phase in ("naive", "sap-1d"):
        again = kt.Simulation(sim.recorded(), phase)
        again.run(until=1.5)
        assert again.fingerprint == sim.fingerprint
        assert (again.positions() == sim.positions()).all()


def test_who_is_refused_leaves_what_is_scheduled_for_this_very_tick():
    planned = [kt.Turn(0, 0.5, (0.0, 1.0)), kt.Turn(1, 1.0, (0.0, -1.0))]
    scene = kt.Scene([[1.0, 1.0], [3.0, 3.0]], [[0.0, 0.0]] * 2, 0.25, 1.0, (4.0, 4.0), commands=planned)
    sim = kt.Simulation(scene, "cells", live=True)
    sim.run(until=0.5)
    for _ in range(3):
        with pytest.raises(Refused, match="into body 1"):
            sim.insert((3.1, 3.0), (0.0, 0.0), 0.25)
    assert sim.next_event.time == 1.0
    sim.run(until=1.0)
    assert sim.velocities().tolist() == [[0.0, 1.0], [0.0, -1.0]]
    assert sim.recorded().commands == scene.commands


def test_rows_of_commands_wait_for_the_next_recorder_with_their_own_times():
    """Though the clock's base has moved on since they were given."""
    sim = kt.Simulation(kt.Scene([[0.5, 0.5]], [[0.0, 0.0]], 0.25, 1.0, (1.0, 1.0)), "cells", live=True)
    sim.set_velocity(0, (0.0, 0.0))
    for _ in sim.steps(until=600.0):
        pass
    sim.set_velocity(0, (0.5, 0.0))
    rows = []
    sim.run(until=600.25, recorder=lambda part: rows.extend(part.tolist()))
    assert [row[0] for row in rows] == [0.0, 600.0]
    assert [row[4] for row in rows] == [TURNED, TURNED]


def test_energy_is_not_summed_up_for_each_command(monkeypatch):
    sim = kt.Simulation(kt.make_scene("grid", bodies=64, density=0.2, seed=1), "cells", live=True)
    calls = Counter()
    summed = by_hand._squares

    def counted(k):
        calls["squares"] += 1
        return summed(k)

    monkeypatch.setattr(by_hand, "_squares", counted)
    random = np.random.default_rng(1)
    for frame in range(40):
        sim.set_velocities(np.arange(8), random.normal(0.0, 0.5, (8, 2)))
        body = sim.bodies[-1]
        place = sim.positions()[-1]
        sim.remove(int(body))
        sim.insert(place, (0.5, 0.5), 0.01)
        engine = sim._engine
        assert engine.squares >= summed(engine.k)
        assert np.hypot(*sim.velocities().T).max() <= engine.speed
        sim.run(until=(frame + 1) / 60)
    assert calls["squares"] < 12


@settings(max_examples=10)
@given(st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=12))
def test_no_body_is_faster_than_the_bound(speeds):
    sim = kt.Simulation(kt.make_scene("grid", bodies=4, density=0.1, seed=1), "naive", live=True)
    for at, speed in enumerate(speeds):
        sim.set_velocity(at % 4, (speed, 0.0))
        energy = float((sim.velocities() ** 2).sum())
        assert energy <= sim._engine.squares * (1.0 + 1e-12)
        assert energy**0.5 <= sim._engine.speed
        sim.run(max_contacts=2)


def test_who_is_there_is_looked_up_when_somebody_comes_or_goes():
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.2, seed=1), "sap-1d", live=True)
    engine = sim._engine
    first = engine.taken
    sim.run(until=0.5)
    assert engine.taken is first
    place = sim.positions()[3]
    sim.remove(3)
    assert sim.bodies.tolist() == [*range(3), *range(4, 16)]
    for at in range(40):  # until the tables are laid out anew
        assert sim.insert(place + np.array([1e-4 * at, 0.0]), radius=1e-6) == 16 + at
        assert sim.bodies.tolist() == [*range(3), *range(4, 17 + at)]
    with pytest.raises(ValueError, match="read-only"):
        engine.taken[0] = 1


def test_an_agenda_of_later_spans_hands_over_span_by_span():
    scene = kt.Scene(
        [[0.5, 0.5]],
        [[0.0, 0.0]],
        0.25,
        1.0,
        (1.0, 1.0),
        commands=[kt.Turn(0, time, (0.0, 0.0)) for time in (1.0, 600.0, 1300.0)],
    )
    sim = kt.Simulation(scene, "naive")
    assert isinstance(sim._engine.agenda, Agenda)
    assert [event.time for event in sim.steps(until=1500.0)] == [1.0, 600.0, 1300.0]
    assert sim.next_event is None


@pytest.mark.parametrize("mixed", [False, True])
def test_new_contacts_are_those_after_the_old_ones(mixed):
    """However many calls ago, and whether or not all are asked for in between."""
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.4, seed=2), "cells")
    counts, parts, random = [0], [], np.random.default_rng(2)
    for _ in range(30):
        sim.run(max_contacts=int(random.integers(0, 9)))
        new = sim.contacts_since(counts[-1])
        assert not new.flags.writeable
        parts.append(new)
        counts.append(counts[-1] + len(new))
        since = int(random.integers(0, counts[-1] + 3))
        if mixed:
            assert (sim.contacts_since(since) == sim.contacts[since:]).all()
    assert (np.concatenate(parts) == sim.contacts).all()
    for count in counts:
        assert (sim.contacts_since(count) == sim.contacts[count:]).all()
