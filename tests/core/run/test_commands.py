"""Commands by hand and in scenes: turns, and bodies that come and go."""

import math
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from agreement import lattice_scene
from kinetile.errors import Refused, SceneError
from kinetile.scene.files import dumps_scene, loads_scene
from lanes import BUILT_IN, first

LIVING = BUILT_IN[1:]
SCENES = Path(__file__).parents[2] / "scenes"


def box(**more) -> kt.Scene:
    return kt.Scene([[1.0, 1.0], [3.0, 3.0]], [[0.0, 0.0], [0.0, 0.0]], 0.25, 1.0, (4.0, 4.0), **more)


@pytest.mark.parametrize("phase", first(3, BUILT_IN))
def test_a_body_comes_meets_and_goes(phase):
    sim = kt.Simulation(box(), phase)
    sim.run(until=0.5)
    new = sim.insert((2.0, 1.0), (-1.0, 0.0), 0.25)
    assert new == 2
    assert sim.bodies.tolist() == [0, 1, 2]
    sim.audit()
    sim.run(until=1.5)
    assert sim.contacts[["time", "a", "b"]].tolist() == [(1.0, 0, 2), (1.5, 0, -1)][: len(sim.contacts)]
    sim.remove(0)
    sim.audit()
    assert sim.bodies.tolist() == [1, 2]
    assert sim.positions().tolist() == [[3.0, 3.0], [1.5, 1.0]]
    sim.run(until=10.0)
    readings = sim.readings
    assert (readings.inserted, readings.removed) == (1, 1)
    assert readings.unaccounted_energy == 0.0


@pytest.mark.parametrize("phase", first(3, [name for name in BUILT_IN if name != "power"]))
@pytest.mark.parametrize("planned", [False, True])
def test_a_body_turned_back_meets_the_body_that_it_met_last(phase, planned):
    """After a contact the two part, and neither is a candidate of the other until one of them turns."""
    turns = [(0, 1.5, (3.0, 0.0))] if planned else []
    scene = kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]], 0.5, turns=turns)
    sim = kt.Simulation(scene, phase, live=not planned)
    sim.run(max_contacts=1)
    if not planned:
        sim.set_velocity(0, (2.0, 0.0))
    sim.run(until=5.0)
    assert sim.contacts[["a", "b"]].tolist() == [(0, 1), (0, 1)]


def test_what_commands_add_to_the_energy_is_no_drift():
    sim = kt.Simulation(box(responses="elastic"), "cells", live=True)
    for body, velocity in ((0, (1.0, 0.5)), (0, (0.25, 0.0)), (1, (-0.5, 0.0))):
        sim.set_velocity(body, velocity)
        assert sim.readings.unaccounted_energy == 0.0
    sim.insert((2.0, 2.0), (4.0, 2.0), 0.25, 8.0)
    assert sim.readings.unaccounted_energy == 0.0
    for body in (0, sim.insert((2.0, 3.0), (1.0, 0.0), 0.25, math.inf)):
        sim.remove(body)
        assert sim.readings.unaccounted_energy == 0.0


@pytest.mark.parametrize("seed", first(1, [1, 0, 4]))
def test_what_awaits_a_removed_body_is_filed_anew(seed):
    """In lattices, where contacts of one tick are filed in the order of the bodies' numbers."""
    sim = kt.Simulation(lattice_scene(seed), "cells", live=True)
    for body in sim.bodies[:-1].tolist():
        sim.run(until=sim.time + 1.0, max_contacts=1)
        sim.remove(body)
        sim.audit()


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_a_number_is_never_used_twice_and_a_slot_is(phase):
    sim = kt.Simulation(box(), phase, live=True)
    numbers = []
    for _ in range(70):
        numbers.append(sim.insert((2.0, 2.0), (0.0, 0.0), 0.25))
        sim.remove(numbers[-1])
    assert numbers == list(range(2, 72))
    assert len(sim.tables.bodies) <= 64
    for number in (2, 71):
        with pytest.raises(IndexError, match=f"no body {number} now: it has gone"):
            sim.set_velocity(number, (1.0, 0.0))
        with pytest.raises(IndexError, match="it has gone"):
            sim.remove(number)


def test_who_touches_has_room():
    sim = kt.Simulation(box(), "sweep-tiling")
    assert sim.insert((1.5, 1.0), (0.0, 0.0), 0.25) == 2
    assert sim.insert((1.5, 0.5), (0.0, 0.0), 0.25) == 3
    sim.audit()
    sim.run(until=1.0)
    assert len(sim.contacts) == 0


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_commands_of_a_scene_are_carried_out_at_their_times(phase):
    commands = [
        kt.Insert(0.5, (2.0, 1.0), (-1.0, 0.0), 0.25),
        kt.Turn(2, 0.75, (0.0, 1.0)),
        kt.Remove(1, 1.0),
        kt.Insert(1.0, (3.0, 3.0), (0.0, 0.0), 0.25),
    ]
    sim = kt.Simulation(box(commands=commands), phase)
    events = [
        (event.time, event.kind, event.bodies) for event in sim.steps(2.0) if event.kind != "structural"
    ]
    assert events[:4] == [
        (0.5, "insert", (2,)),
        (0.75, "turn", (2,)),
        (1.0, "remove", (1,)),
        (1.0, "insert", (3,)),
    ]
    sim.audit()
    assert sim.bodies.tolist() == [0, 2, 3]


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_a_scheduled_body_without_room_ends_the_run_until_there_is_room(phase):
    scene = box(commands=[kt.Insert(0.5, (1.25, 1.0), (0.0, 0.0), 0.25)])
    sim = kt.Simulation(scene, phase)
    for _ in range(2):
        with pytest.raises(Refused, match=r"no room for body 2 at .* it reaches 0.25 into body 0"):
            sim.run(until=1.0)
        assert sim.time == 0.5
    sim.set_velocity(1, (0.0, -0.5))  # a command by hand comes before the insertion that waits
    before = sim.snapshot()
    with pytest.raises(Refused, match="there is no room"):
        sim.insert((3.0, 3.0), (0.0, 0.0), 0.25)
    assert sim.snapshot() == before
    with pytest.raises(Refused, match="there is no room for body 2"):
        sim.run(until=1.0)
    sim.remove(0)
    sim.run(until=1.0)
    assert sim.bodies.tolist() == [1, 2]
    again = kt.Simulation(sim.recorded(), phase)
    again.run(until=1.0)
    assert again.fingerprint == sim.fingerprint


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_an_insertion_without_room_stopped_at_the_last_event_before_it(phase):
    sim = kt.Simulation(kt.load_scene(SCENES / "insertion-without-room.toml"), phase)
    with pytest.raises(Refused, match=r"at time 6\.625 there is no room for body 18"):
        sim.run()
    assert sim.time == 6.625
    assert sim.positions().tolist() == [[2.75, 0.8125]]


def test_who_goes_takes_its_schedule_along():
    scene = box(commands=[kt.Turn(0, 1.0, (1.0, 0.0)), kt.Remove(0, 2.0), kt.Turn(1, 2.0, (0.0, 1.0))])
    sim = kt.Simulation(scene, "cells")
    sim.remove(0)
    sim.run(until=3.0)
    assert (sim.readings.turns, sim.readings.removed) == (1, 1)


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_what_was_done_by_hand_is_a_scene_with_the_same_contacts(phase):
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, density=0.3, seed=2), phase)
    random = np.random.default_rng(3)
    for _ in range(8):
        sim.run(until=sim.time + 0.3, max_contacts=3)  # stops among contacts of one tick as well
        try:
            sim.insert(random.uniform(0.1, 0.9, 2), random.normal(size=2), 0.03, mass=2.0)
        except Refused:
            sim.remove(int(sim.bodies[0]))
    end = sim.time
    recorded = sim.recorded()
    assert recorded.time_unit == sim.time_unit
    for other in ("naive", "sweep-tiling"):
        again = kt.Simulation(recorded, other)
        again.run(until=end)
        assert again.fingerprint == sim.fingerprint
        assert (again.positions() == sim.positions()).all()


@pytest.mark.parametrize(("room", "slots"), [(None, 64), (0, 2), (2, 2), (3, 3)])
def test_there_is_room_for_as_many_as_are_asked_for_and_then_for_more(room, slots):
    sim, usual = (kt.Simulation(box(), "sap-1d", live=True, room=each) for each in (room, None))
    assert len(sim.tables.bodies) == slots
    for each in (sim, usual):
        each.run(until=1.0)
        each.insert((2.0, 2.0), (0.5, 0.25), 0.25)
        each.insert((2.0, 1.0), (0.0, 0.25), 0.125)
        each.run(until=8.0)
    assert sim.fingerprint == usual.fingerprint


@pytest.mark.parametrize("phase", first(2, LIVING))
def test_where_a_run_stopped_before_an_insertion_that_needs_room_leaves_no_trace(phase):
    """Cells fitted the places at the last stop."""
    row = [[0.25 + each / 2, 3.0] for each in range(5)]
    scene = kt.Scene([[0.5, 1.0], *row], [[1.75, 0.0], *[[0.0, 0.0]] * 5], 0.0625, arena=(4.0, 4.0))
    scene = scene.replace(commands=[kt.Insert(1.5, (2.0, 2.0), (0.5, 0.25), 0.03125)])
    unstopped, stopped = (kt.Simulation(scene, phase, live=True) for _ in range(2))
    for time in (0.5, 1.25, 1.5):
        stopped.run(until=time)
    unstopped.run(until=1.5)
    assert stopped.drawing() == unstopped.drawing()


@pytest.mark.parametrize("phase", first(2, LIVING))
def test_when_bodies_are_jammed_does_not_depend_on_the_phase(phase):
    """Nor does the speed that the layout assumes: a phase without ``enter`` is built again for each."""
    limits = []
    for name in (phase, "naive"):
        sim = kt.Simulation(box(), name, live=True)
        seen = []
        for command in (
            lambda sim=sim: sim.insert((2.0, 1.0), (0.3, 0.1), 0.25),
            lambda sim=sim: sim.set_velocity(2, (0.1, 0.7)),
            lambda sim=sim: sim.remove(0),
            lambda sim=sim: sim.insert((1.0, 3.0), (0.7, 0.2), 0.125),
            lambda sim=sim: sim.set_velocity(1, (1.1, 0.3)),
        ):
            command()
            clock = sim.tables.clock[0]
            seen.append((int(clock.jam.window), int(clock.jam.window_size)))
        limits.append(seen)
    assert limits[0] == limits[1]
    assert len(set(limits[0])) > 1


@pytest.mark.filterwarnings("error")
def test_where_nobody_was_for_long_clocks_were_wrong():
    """The common clock's origin ran out of bits; without slots, contacts had the epoch of when all went."""
    sims = [kt.Simulation(box(), phase, live=True) for phase in ("naive", "cells")]
    for sim in sims:
        sim.remove(0)
        sim.remove(1)
        sim.run(until=4099.5)
        sim.insert((1.0, 2.0), (0.25, 0.0), 0.25)
        sim.insert((3.0, 2.0), (-0.25, 0.0), 0.25)
        sim.run(until=4110.0)
        sim.audit()
    assert len(sims[0].contacts) > 0
    assert sims[0].fingerprint == sims[1].fingerprint


@pytest.mark.parametrize(
    ("phase", "other"), first(1, [("cells", "sap-1d"), ("sap-k", "cells"), ("naive", "sap-2d")])
)
def test_a_lifetime_is_a_removal_planned_when_the_body_comes(phase, other, tmp_path):
    """At one moment the first to arrive goes first, after commands of the scene: the ends of passings, which
    are rows, say it. One that is removed by hand has no second removal, and one may be long."""
    planned = [kt.Insert(0.0, (2.0, 2.0), (0.0, 0.0), 0.5), kt.Remove(0, 1.25)]
    scene = box(responses={("*", "*"): "pass"}, commands=planned)
    sim = kt.Simulation(scene, phase, live=True)
    sim.run(until=0.25)
    one = sim.insert((1.5, 2.0), (0.5, 0.0), 0.25, lifetime=1.0, name="one")
    places = [(2.5, 2.0), (1.0, 1.0), (2.0, 2.5)]
    two, three, four = sim.insert_many(places, radius=0.25, lifetime=[1.0, 0.5, 3e3]).numbers.tolist()
    five = sim.insert((3.5, 1.0), radius=0.25, lifetime=1)
    sim.run(until=0.5)
    copy = kt.Simulation(scene, other, live=True)
    copy.restore(sim.snapshot())
    for each in (sim, copy):
        each.remove(three)
        each.run(until=1.0)
        assert each.bodies.tolist() == [0, 1, 2, one, two, four, five]
        assert each.next_contact_of(one, scheduled=True) is None  # for it goes before it parts
        each.run(until=1.5)
        assert each.bodies.tolist() == [1, 2, four]
    assert copy.fingerprint == sim.fingerprint
    ends = sim.contacts[sim.contacts["time"] == 1.25]
    assert [2, one] in np.sort(ends[["a", "b"]].tolist()).tolist()
    assert ends["a"].argmax() == len(ends) - 1
    kt.save_scene(sim.recorded(), tmp_path / "trace.toml")
    again = kt.Simulation(kt.load_scene(tmp_path / "trace.toml"), other)
    again.run()
    assert (again.fingerprint, again.bodies.tolist()) == (sim.fingerprint, sim.bodies.tolist())
    sim.run(until=3000.125)
    assert four in sim.bodies
    sim.run(until=3001.0)
    assert sim.bodies.tolist() == [1, 2]


def test_a_lifetime_in_a_scene_is_a_removal_unless_another_comes_before():
    last = {"radius": 0.25, "lifetime": 1.0}
    comes = [kt.Insert(0.5, (2.0, 2.0), (0.0, 0.0), **last, name=name) for name in ("one", "two", "three")]
    comes = [each._replace(position=(3.5, 0.5 + at)) for at, each in enumerate(comes)]
    scene = box(commands=[*comes, kt.Remove("two", 1.0)])
    removals = [(each.body, each.time) for each in scene.commands if isinstance(each, kt.Remove)]
    assert removals == [(3, 1.0), (2, 1.5), (4, 1.5)]
    text = dumps_scene(box()) + "[[commands]]\ntime = 0.5\ninsert = { position = [3.5, 0.5], radius = 0.25, "
    assert loads_scene(text + "lifetime = 1.0 }").commands[1] == kt.Remove(2, 1.5)
    with pytest.raises(SceneError, match=r"commands\[0\].lifetime: found -1.0; expected a finite number"):
        box(commands=[comes[0]._replace(lifetime=-1.0)])
    sim = kt.Simulation(box(), "cells", live=True)
    for wrong in (0, math.inf, "1"):
        with pytest.raises(ValueError, match=r"lifetime is .*, expected a finite number greater than 0"):
            sim.insert((2.0, 2.0), radius=0.25, lifetime=wrong)
    assert sim.recorded().commands == ()


def test_of_two_values_for_one_body_the_last_holds():
    sim = kt.Simulation(box(gravity=(0.0, -1.0)), "cells", live=True)
    sim.set_velocities([0, 1, 0], [(1.0, 0.0), (0.0, 0.0), (2.0, 0.0)])
    sim.set_accelerations([0, 1, 0], [(1.0, 0.0), (0.0, 0.0), (0.5, 0.0)])
    assert (sim.velocities()[0].tolist(), sim.accelerations()[0].tolist()) == ([2.0, 0.0], [0.5, 0.0])


@pytest.mark.parametrize("rules", [{}, {("paddle", "wall"): "stop"}])
def test_a_paddle_that_is_steered_into_a_wall_bounces_unless_it_stops_there(rules):
    scene = kt.Scene([[7.0, 1.0]], [[0.0, 0.0]], 0.5, math.inf, (8.0, 2.0), kind="paddle", responses=rules)
    sim, places = kt.Simulation(scene, "cells", live=True), []
    for frame in range(1, 7):
        sim.set_velocity(0, (2.0, 0.0))
        sim.run(until=frame / 8)
        places.append(float(sim.positions()[0, 0]))
    assert places == [7.25, 7.5, *([7.5] * 4 if rules else [7.25, 7.5] * 2)]
