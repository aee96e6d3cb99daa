"""Commands by hand: their place among those that wait, the work saved for each, and pending contacts."""

import math
import pickle
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from inside import engine_of
from kinetile import StopAt
from kinetile.errors import Refused, ZenoError
from kinetile.kernel.log import INSERTED, TURNED
from kinetile.kernel.tables import COMMAND, Role, allocate, column, declared
from kinetile.run.arguments import read_insertion
from kinetile.run.engine import by_hand
from kinetile.run.engine import engine as engines
from kinetile.run.engine.commands import LAST, History, to_the_front
from kinetile.run.engine.fields import Tables
from kinetile.run.engine.state import contents_of
from kinetile.scene.files import dumps_scene, loads_scene
from lanes import BUILT_IN, examples, first


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
def test_commands_by_hand_stand_before_all_that_wait(planned, steps):
    """Against a list. Some commands of this tick are carried out."""
    tables = Tables()
    tables.k = allocate(1, 1, 1)
    fields = tables.fields
    expected = [(tick, at) for at, tick in enumerate(sorted(planned))]
    if planned:
        to_the_front(tables, numbered(0, sorted(planned)))
    given_so_far = 1000
    for what, many, done in steps:
        if what == "pass":
            fields.now[0] += many
            gone = [each for each in expected if each[0] < fields.now[0]]
            fields.lists.command[0] += len(gone)
            expected = expected[len(gone) :]
            continue
        tick = fields.now[0]
        rows = numbered(given_so_far, [tick] * many)
        to_the_front(tables, rows)
        expected = [*((tick, given_so_far + at) for at in range(many)), *expected]
        behind = len([each for each in expected if each[0] > tick])
        found = tables.k.commands[fields.lists.command[0] : fields.lists.commands[0]]
        assert list(zip(found.tick.tolist(), found.body.tolist(), strict=True)) == expected
        done = min(done, len(expected) - behind)
        fields.lists.command[0] += done
        expected = expected[done:]
        given_so_far += many


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
    for each in (sim, pickle.loads(pickle.dumps(sim))):
        rows = []
        for until in (600.25, 600.375):  # the second run has none of them
            each.run(until=until, recorder=lambda part, rows=rows: rows.extend(part.tolist()))
        assert [row[0] for row in rows] == [0.0, 600.0]
        assert [row[4] for row in rows] == [TURNED, TURNED]


def test_energy_is_not_summed_up_for_each_command(monkeypatch):
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, density=0.2, seed=1), "cells", live=True)
    calls, summed, random = [], by_hand.squares_of_bodies, np.random.default_rng(1)
    monkeypatch.setattr(by_hand, "squares_of_bodies", lambda k: calls.append(k) or summed(k))
    for frame in range(20):
        sim.set_velocities(np.arange(8), random.normal(0.0, 0.5, (8, 2)))
        body, place = sim.bodies[-1], sim.positions()[-1]
        sim.remove(int(body))
        sim.insert(place, (0.5, 0.5), 0.01)
        engine = engine_of(sim)
        assert engine.bounds.squares >= summed(engine.k)
        assert np.hypot(*sim.velocities().T).max() <= engine.speed
        sim.run(until=(frame + 1) / 60)
    assert len(calls) < 8


@pytest.mark.parametrize("odd", [0.25, np.float32(0.25), True, math.nan, math.inf, -1.0, 2.0**201, "a", None])
@pytest.mark.parametrize("name", ["position", "velocity", "radius", "mass"])
def test_a_plain_disc_is_read_as_one_value_by_value(name, odd):
    engine = engine_of(kt.Simulation(kt.make_scene("grid", bodies=4), "naive", live=True))
    for pair in ([0.5, odd], (0.5, odd, 0.5), np.array([0.5, odd]), np.array(odd), {0.5: 1, odd: 2}):
        given = {"position": (0.25, 0.5), "velocity": np.array([0.1, 0.2]), "radius": 0.01, "mass": 2.0}
        new = kt.Insert(0.0, **given | {name: odd if name in ("radius", "mass") else pair})
        found = []
        for each in (new, new._replace(kind=engine.scene.kinds[0])):  # with a kind it is read value by value
            try:
                found.append(read_insertion(engine, each)[0].tolist())
            except ValueError as error:
                found.append(str(error))
        assert found[0] == found[1]


def test_who_is_there_is_looked_up_when_somebody_comes_or_goes():
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.2, seed=1), "sap-1d", live=True)
    engine = engine_of(sim)
    first = engine.taken
    sim.run(until=0.5)
    assert engine.taken is first
    place = sim.positions()[3]
    sim.remove(3)
    assert sim.bodies.tolist() == [*range(3), *range(4, 16)]
    for at in range(40):  # until the tables are laid out again
        assert sim.insert(place + np.array([1e-4 * at, 0.0]), radius=1e-6) == 16 + at
        assert sim.bodies.tolist() == [*range(3), *range(4, 17 + at)]


@pytest.mark.parametrize("mixed", [False, True])
def test_new_contacts_are_those_after_the_old_ones(mixed):
    """However many calls ago, with or without requests for all in between."""
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.4, seed=2), "cells")
    counts, parts, random = [0], [], np.random.default_rng(2)
    for at in range(30):
        sim.run(max_contacts=int(random.integers(0, 9)))
        new = sim.contacts_since(counts[-1])
        assert not new.flags.writeable
        parts.append(new)
        counts.append(counts[-1] + len(new))
        since = int(random.integers(max(0, counts[-1] - 16) if at % 2 else 0, counts[-1] + 3))
        if mixed and at % 3 == 2:  # so that contacts of several runs wait
            assert (sim.contacts_since(since) == sim.contacts[since:]).all()
    assert (np.concatenate(parts) == sim.contacts).all()
    for count in counts:
        assert (sim.contacts_since(count) == sim.contacts[count:]).all()


def row_of_touching_bodies(**more: Any) -> kt.Scene:
    """Six unit discs that touch in pairs, three of the pairs closing in at once, so that contacts of one tick
    follow each other; dyadic numbers, so that ties are exact."""
    x = [2.0, 4.0, 7.0, 9.0, 12.0, 14.0]
    v = [0.5, -0.5, 0.5, -0.5, 0.5, -0.5]
    return kt.Scene([[a, 4.0] for a in x], [[a, 0.0] for a in v], 1.0, 1.0, (16.0, 8.0), **more)


def through_a_file(scene: kt.Scene) -> kt.Scene:
    found = loads_scene(dumps_scene(scene))
    assert found == scene
    return found


def replayed(recording: kt.Scene, phase: str) -> kt.Simulation:
    sim = kt.Simulation(recording, phase)
    for _ in range(20):
        try:
            sim.run()
        except ZenoError:
            continue
        return sim
    raise AssertionError("more than twenty jams")


def same(one: kt.Simulation, other: kt.Simulation) -> None:
    assert other.fingerprint == one.fingerprint
    assert other.exact_time == one.exact_time
    assert other.bodies.tolist() == one.bodies.tolist()
    assert (other.positions() == one.positions()).all()
    assert (other.velocities() == one.velocities()).all()


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_a_command_for_a_third_body_ran_the_contact_that_it_was_to_avert(phase):
    scene = kt.Scene([[1, 1], [2, 1], [3, 3]], [[0.5, 0], [-0.5, 0], [0, 0]], 0.25, 1.0, (4, 4))
    sim = kt.Simulation(scene, phase, live=True)
    assert sim.run(5.0, stop_at=StopAt(pairs=[(0, 1)], before=True)).event.bodies == (0, 1)
    sim.set_velocity(2, (0.125, 0.0))
    sim.remove(2)
    sim.set_velocities([], [])
    sim.insert((3.0, 3.0), (0.0, 0.0), 0.125)
    assert len(sim.contacts) == 0
    sim.set_velocities([0, 1], [(-0.5, 0.0), (0.5, 0.0)])  # they part, and never touch
    sim.run(1.0)
    assert len(sim.contacts) == 0
    for other in BUILT_IN:
        same(sim, replayed(sim.recorded(), other))


@pytest.mark.parametrize("phase", ["cells", "naive"])
def test_a_body_for_which_tables_were_made_again_moved_the_time(phase):
    """From the list of the run's end to the list of its tick, and not under every phase."""
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=2), phase, live=phase != "naive")
    sim.run(until=0.1)
    sim.insert((0.01, 0.01), radius=0.004)
    assert sim.time == 0.1


def test_an_immovable_body_that_came_made_numpy_warn():
    scene = kt.Scene([(1, 1)], [(0.5, 0.25)], 0.25, arena=(8, 8), responses="elastic")
    sim = kt.Simulation(scene, "naive", live=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        body = sim.insert((4, 4), radius=0.25, mass=math.inf)
        sim.set_velocities([0, body], [(0.5, 0.5), (0.0, 0.0)])


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_one_command_after_two_contacts_gave_four(phase):
    sim = kt.Simulation(row_of_touching_bodies(), phase, live=True)
    sim.run(1.0, max_contacts=2)
    sim.set_velocity(4, (-0.5, 0.0))  # averts the third
    assert len(sim.contacts) == 2
    for other in BUILT_IN:
        same(sim, replayed(sim.recorded(), other))
    sim.run(0.0)
    assert len(sim.contacts) == 2


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_a_recording_between_two_contacts_of_a_tick_had_all_contacts_of_the_tick(phase):
    """And one that ends beside a double, at a start that is not zero, or at the very start."""
    for start, contacts in ((0.0, 0), (0.0, 1), (0.0, 2), (1e9 + 0.3, 1), (1e9 + 0.3, 7)):
        scene = row_of_touching_bodies(start=start)
        sim = kt.Simulation(scene, phase)
        sim.run(start + 20.0, max_contacts=contacts)
        again = replayed(through_a_file(sim.recorded()), "naive")
        same(sim, again)
        again.run(sim.time)  # stands at its end
        same(sim, again)


def test_an_exact_end_that_is_not_at_until_is_refused():
    """A recording whose ``until`` alone is changed would end where it did before."""
    sim = kt.Simulation(row_of_touching_bodies(), "naive")
    sim.run(0.5)
    text = dumps_scene(sim.recorded())
    for changed in ("until = 0.25", "start = 0.5\nuntil = 0.5", ""):
        with pytest.raises(kt.errors.SceneError, match="an end at until"):
            loads_scene(text.replace("until = 0.5", changed))
    with pytest.raises(kt.errors.SceneError, match=r"end: .* expected \[epoch, tick, contacts\]"):
        loads_scene(text.replace("end = [", 'end = ["'[:-1] + "0.5, "))


commands = st.lists(
    st.one_of(
        st.tuples(st.just("turn"), st.integers(0, 7), st.sampled_from([-0.5, 0.0, 0.25, 1.0])),
        st.tuples(st.just("remove"), st.integers(0, 7), st.just(0.0)),
        st.tuples(st.just("insert"), st.integers(0, 3), st.sampled_from([-0.5, 0.0, 0.5])),
        st.tuples(st.just("go on"), st.integers(1, 3), st.just(0.0)),
        st.tuples(st.just("stop before"), st.just(0), st.just(0.0)),
    ),
    max_size=8,
)


def play(sim: kt.Simulation, what: list[tuple[str, int, float]]) -> list[int]:
    found = []
    for name, number, value in what:
        contacts = len(sim.contacts)
        if name == "go on":
            sim.run(sim.time + 0.5, max_contacts=number)
        elif name == "stop before":
            sim.run(sim.time + 1.0, stop_at=StopAt(before=True))
        else:
            if name == "insert":
                before = sim.snapshot()
                try:
                    sim.insert((1.0 + 4.0 * number, 6.0 + value), (value, -1.0), 0.5)
                except Refused:
                    assert sim.snapshot() == before
            elif number in sim.bodies:
                sim.remove(number) if name == "remove" else sim.set_velocity(number, (value, 0.5 - value))
            assert len(sim.contacts) == contacts, (name, number, value)
        found.append(len(sim.contacts))
    return found


@settings(max_examples=examples(20), deadline=None)
@given(commands, st.booleans(), st.sampled_from(BUILT_IN))
def test_commands_at_a_stop_leave_pending_contacts_pending(what, turns_of_its_own, phase):
    own = [kt.Turn(0, 0.0, (0.5, 0.0)), kt.Insert(0.0, (2.0, 1.0), (0.0, 1.0), 0.5)]
    scene = row_of_touching_bodies(commands=own if turns_of_its_own else [])
    sims = [kt.Simulation(scene, each, live=True) for each in ("cells", phase)]
    what = [("turn", 0, 0.5), *what]  # with it those of the scene at its tick are carried out
    assert play(sims[0], what) == play(sims[1], what)
    same(*sims)
    same(sims[0], replayed(through_a_file(sims[0].recorded()), phase))


def squeezed() -> kt.Scene:
    """A ball that loses all its speed between a paddle that nothing can stop and a wall."""
    return kt.Scene(
        [[1.0, 1.0], [3.5, 1.0], [1.0, 3.0]],
        [[1.0, 0.0], [-0.25, 0.125], [0.125, 0.0]],
        [0.5, 0.25, 0.25],
        [math.inf, 1.0, 1.0],
        (4.0, 4.0),
        kind=["paddle", "ball", "other"],
        responses={("ball", "paddle"): "stop", ("ball", "wall"): "stop"},
    )


def jammed(sim: kt.Simulation) -> tuple[tuple[int, int], int]:
    with pytest.raises(ZenoError, match="between body"):
        sim.run(10.0)
    return sim.exact_time, len(sim.contacts)


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_a_jam_ended_the_game(phase, tmp_path):
    """The commands that end it are in the recording, which is not jammed: they come at the same contact."""
    sim = kt.Simulation(squeezed(), phase, live=True)
    there = jammed(sim)
    assert jammed(sim) == there, "nothing happens until a command is given"
    assert sim.fault is not None
    assert sim.next_event.kind in ("disc", "wall")  # a reading
    before = sim.snapshot()
    with pytest.raises(Refused):
        sim.insert((3.5, 1.0), (0.0, 0.0), 0.25)
    assert sim.snapshot() == before
    sim.save(tmp_path / "jam.kt")
    again = kt.resume(tmp_path / "jam.kt")
    for each in (again, sim):
        each.set_velocity(2, (0.0, 0.25))
        assert len(each.contacts) == there[1]
        jammed(each)  # that has not helped
        each.remove(1)
        each.run(3.0)
    same(sim, again)
    assert sim.fault is None
    assert sim.time == 3.0
    for other in ("naive", "cells"):
        same(sim, replayed(sim.recorded(), other))
    sim.set_velocity(2, (0.0, 500.0))  # the bounds of a scene know its commands beforehand
    sim.insert((3.5, 3.0), (0.0, 0.0), 2.0**-10)
    same(sim, replayed(sim.recorded(), "cells"))


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("phase", ["naive", "cells"])
def test_a_command_in_a_jam_was_carried_out_and_lost(phase):
    """With three contacts done ``remove`` raised ZenoError, the body was gone, and it was not written
    down."""
    sim = kt.Simulation(squeezed(), phase, live=True)
    _, event = sim.run(10.0, stop_at=StopAt(pairs=[(0, 1)]))
    assert event.bodies == (0, 1)
    sim.remove(2)
    assert sim.recorded().commands[-1].body == 2
    jammed(sim)
    assert sim.bodies.tolist() == [0, 1]


@pytest.mark.slow
@pytest.mark.compiled
def test_a_fault_names_bodies_by_their_numbers():
    """It named their slots: after a body's removal, other bodies' slots."""
    sim = kt.Simulation(squeezed(), "cells", live=True)
    sim.remove(2)
    sim.remove(1)
    ball = sim.insert((3.5, 1.0), (-0.25, 0.0), 0.25, kind="ball")
    sim.remove(0)
    paddle = sim.insert((1.0, 1.0), (1.0, 0.0), 0.5, math.inf, kind="paddle")
    with pytest.raises(ZenoError) as raised:
        sim.run(10.0)
    assert sim.bodies.tolist() == [ball, paddle]
    assert set(raised.value.bodies) <= {ball, paddle}


def test_a_history_is_the_same_however_often_it_is_read():
    read, unread = History(), History()
    for at in range(3 * LAST + 5):
        rows = numbered(at, [at] * (1 + at % 2))
        rows["code"] = INSERTED if at % 3 == 0 else TURNED
        read, unread = (each.with_rows(rows, at // 70) for each in (read, unread))
        assert read.told.inserted == ((0, sum(1 + i % 2 for i in range(0, at + 1, 3))),)
    assert unread.content == read.content
    assert [first for first, _ in read.content[1]] == [0, 105, 210]
    assert unread.told == read.told


def test_each_field_of_an_insertion_by_hand_is_in_the_recording_and_no_byte_of_a_row_is_spare():
    """Snapshots compare the bytes of rows."""
    shape, hers = kt.box(1.0, 0.5), kt.disc(0.5)
    rules = {"shapes": [hers, shape], "shape": 0, "kinds": ["one", "two"], "kind": "one"}
    scene = kt.Scene([[1.0, 1.0]], [[0.0, 0.0]], arena=(8.0, 8.0), **rules)
    given = {"position": (3.0, 3.0), "velocity": (1.0, 0.5), "mass": 3.0, "kind": "two", "shape": shape}
    sim = kt.Simulation(scene, "naive", live=True)
    sim.insert(**given)
    more = {name: given[name] for name in given if name not in ("position", "velocity")}
    assert not sim.insert_many([(3.0, 5.0)], given["velocity"], **more).refused.any()
    one, other = sim.recorded().commands
    made = {
        "time": 0.0,
        "at": (0, 0, 0),
        "body": 1,
        "radius": shape.reach,
        "acceleration": None,
        "name": None,
        "lifetime": None,
    }
    made |= given
    assert one._asdict() == made
    assert other._asdict() == made | {"body": 2, "position": (3.0, 5.0)}
    assert loads_scene(dumps_scene(sim.recorded())) == sim.recorded()
    assert sum(COMMAND[name].itemsize for name in COMMAND.names) == COMMAND.itemsize


def test_a_body_that_came_far_away_among_bodies_at_rest_had_the_skin_of_before():
    sim = kt.Simulation(kt.Scene([(0.0, 0.0), (3.0, 0.0)], np.zeros((2, 2)), 0.5), "naive", live=True)
    before = engine_of(sim).bounds.skin.delta
    sim.insert((1e6, 0.0), (0.0, 0.0), 0.5)
    assert engine_of(sim).bounds.skin.delta > before


@pytest.mark.parametrize(
    "more", [{}, {"gravity": (0.0, -1.0)}, {"periodic": "xy"}, {"kind": ["a", "b", "a"]}]
)
def test_a_body_has_nothing_of_the_one_that_had_its_slot(more):
    """A field that ``insert_body`` forgets would be a removed body's."""
    scene = kt.Scene([(1.0, 1.0), (3.0, 1.0), (5.0, 3.0)], np.ones((3, 2)), 0.25, arena=(8.0, 8.0), **more)
    found = []
    for odd in (False, True):
        sim = kt.Simulation(scene, "cells", live=True, compiled=False)
        sim.run(0.5)
        sim.remove(1)
        k = engine_of(sim).k
        empty = k.queue["number"] < 0
        for table in (k.bodies, k.traits, k.images) if odd else ():
            for field in declared(table.dtype, Role.CARRIED) if len(table) else ():
                column(table, field.name)[empty] = 7
        assert sim.insert((6.0, 6.0), (0.5, 0.25), 0.25) == 3
        assert empty[engine_of(sim).k.slots[3]]
        found.append(contents_of(engine_of(sim).k))
    assert (found[0].plans == found[1].plans).all()


def test_a_skin_that_is_refused_with_an_empty_slot_left_other_tables(monkeypatch):
    sim = kt.Simulation(kt.make_scene("grid", bodies=9), "cells", live=True, compiled=False)
    sim.remove(4)
    engine = engine_of(sim)
    before = engine.k, engine.bounds, engine.composition

    def refuses(scene: kt.Scene, limit: float | None = None) -> float:
        raise Refused("too thick")

    with monkeypatch.context() as patch:
        patch.setattr(engines, "margin_of", refuses)
        with pytest.raises(Refused, match="too thick"):
            engine.lay_out(2.0 * engine.speed)
    assert (engine.k, engine.bounds, engine.composition) == before
    sim.run(1.0)
    sim.audit()


def test_pairs_that_had_outgrown_their_table_had_no_more_room_where_a_slot_was_empty():
    sim = kt.Simulation(kt.make_scene("grid", bodies=9), "sap-2d", live=True, compiled=False)
    sim.remove(4)
    sim.build()
    engine = engine_of(sim)
    before = len(engine.k.pairs)
    engine._grow_pairs()
    assert len(engine.k.pairs) >= 2 * before
    sim.run(0.5)
    sim.audit()
