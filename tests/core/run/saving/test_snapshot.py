"""Snapshots, copies, files: a run goes on to the same bits, under its own phase and under another."""

import copy
import pickle
import random
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

import kinetile as kt
from by_the_rules import answer, rows
from inside import engine_of
from kinetile.kernel.clock import SPAN
from kinetile.kernel.tables import JAMMED, LONG_AGO, NEVER, Quantity, Role, declared
from kinetile.run.engine.fields import all_ticks
from kinetile.run.engine.spans import count_from_next
from kinetile.run.engine.state import contents_of
from kinetile.run.saving.snapshot import check_state, resumed
from kinetile.run.simulation import composition_of
from lanes import BUILT_IN, first


def lively(name: str) -> kt.Simulation:
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=1), name, live=True, room=1)
    sim.run(0.2)
    sim.remove(3)
    sim.insert_many([(0.01, 0.01), (0.01, 0.02), (0.02, 0.01)], radius=0.004)  # more than there were slots
    assert len(sim.bodies) == 11
    sim.set_velocity(4, (1.0, 0.5))
    sim.run(max_contacts=1)
    return sim


@pytest.mark.parametrize("name", first(3, BUILT_IN))
def test_every_way_goes_on_to_the_same_bits(tmp_path, name):
    sim = lively(name)
    there = sim.snapshot()
    sim.save(tmp_path / "s.kt")
    restored = kt.Simulation(sim.scene, sim.broad_phase)
    restored.restore(there)
    taken_up = [copy.copy(sim), copy.deepcopy(sim), pickle.loads(pickle.dumps(sim))]
    taken_up += [restored, kt.resume(tmp_path / "s.kt")]
    assert all(each.snapshot() == there for each in taken_up)
    sim.run(0.5)
    assert sim.snapshot() != there
    for each in taken_up:
        each.run(0.5)
        assert each.fingerprint == sim.fingerprint
        assert each.contacts.tobytes() == sim.contacts.tobytes()
        assert each.recorded() == sim.recorded()
    sim.restore(there)
    assert sim.snapshot() == there


def play(sim: kt.Simulation, rng: random.Random) -> None:
    """Gives a simulation one order, or runs it: also to more bodies, pairs and speed than its tables have."""
    bodies = sim.bodies.tolist()
    order = rng.randrange(5) if bodies else 4
    if order == 0:
        sim.set_velocity(rng.choice(bodies), (rng.uniform(-9, 9), rng.uniform(-1, 1)))
    elif order == 1:
        sim.remove(rng.choice(bodies))
    elif order == 2:
        with suppress(kt.errors.NoRoom):
            sim.insert((rng.uniform(0.1, 0.9), rng.uniform(0.1, 0.9)), (1.0, 0.0), rng.choice([0.003, 0.03]))
    elif order == 3:
        sim.run(max_contacts=1)
    else:
        sim.run(until=sim.time + rng.choice([0.0, 0.01, 0.1]))


@pytest.mark.small
@pytest.mark.parametrize("seed", first(2, range(30)))
@pytest.mark.parametrize("name", first(2, BUILT_IN))
def test_a_simulation_that_goes_back_is_one_that_is_made_anew(name, seed):
    """Its own snapshot has its structure too, and is put back in place; another's is laid out."""
    rng = random.Random(seed)
    scene = kt.make_scene("grid", bodies=9, seed=seed)
    sim, made_anew = (kt.Simulation(scene, name, live=rng.randrange(2) == 0) for _ in range(2))
    snapshots = []
    for _ in range(24):
        snapshots.append(sim.snapshot())
        play(sim, rng)
        if rng.randrange(4) == 0:
            there = rng.choice(snapshots)
            assert there.whole.engine is engine_of(sim)
            sim.restore(there)
            made_anew.restore(there)
            assert sim.snapshot() == made_anew.snapshot() == there == pickle.loads(pickle.dumps(there))
            seed = rng.random()
            play(sim, random.Random(seed))
            play(made_anew, random.Random(seed))
            assert sim.snapshot() == made_anew.snapshot()
            sim.audit()
            assert sim.recorded() == made_anew.recorded()


@pytest.mark.small
def test_a_simulation_whose_hook_has_raised_goes_back():
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive", live=True)
    there = sim.snapshot()
    engine_of(sim).broken = kt.errors.PhaseError("a hook raised")
    with pytest.raises(kt.errors.PhaseError, match="cannot go on"):
        sim.run(0.1)
    sim.restore(there)
    sim.run(0.1)
    assert sim.fault is None


def test_a_run_whose_bodies_are_all_immovable_could_not_go_on():
    """The bound of speeds is from energy, and theirs has none."""
    scene = kt.Scene([(1.0, 1.0), (3.0, 1.0)], [(0.0, 0.0)] * 2, 0.25, mass=float("inf"), arena=(4.0, 4.0))
    sim = kt.Simulation(scene, "cells", live=True)
    sim.set_velocity(0, (0.25, 0.0))
    sim.run(until=1.5)
    again = pickle.loads(pickle.dumps(sim))
    for each in (sim, again):
        each.run(until=8.0)
    assert again.fingerprint == sim.fingerprint
    assert len(sim.contacts) == 1


OTHERS = {
    **{Quantity.PAST: (LONG_AGO, LONG_AGO + 5), Quantity.DUE: (NEVER, SPAN + 3), Quantity.SLOT: (-1, 1)},
    **{Quantity.PARTNER: (-4, 2), Quantity.NUMBER: (-1, 1), Quantity.COUNT: (1, 77), Quantity.VALUE: (3, -2)},
}
"""Values of a field that a run may have in place of its own, by the meaning of the field."""
TICKS = Quantity.TICK, Quantity.PAST, Quantity.DUE
PASSING = {"kind": ["a", "b"], "responses": {("a", "b"): "pass"}, "arena": (8.0, 8.0)}


@pytest.mark.small
@pytest.mark.parametrize("value", range(2))
def test_each_declared_field_is_compared_saved_restored_and_counted_from_the_next_span(value):
    places, flies = [(1.0, 1.0), (1.75, 1.0)], [(0.5, 0.0), (0.0, 0.0)]
    settles = {("*", "wall"): kt.Response("restitution", e=1.0, settle=1.0)}
    more = {"periodic": "x", "gravity": (0.0, -(2.0**-9)), "responses": PASSING["responses"] | settles}
    turn = kt.Turn(1, 1.5, (1.0, 0.0))
    scene = kt.Scene(places, flies, 0.25, commands=[turn], **PASSING | more)
    sim = kt.Simulation(scene, "naive")
    sim.remove(0)
    sim.insert((0.9, 1.0), (0.5, 0.0), 0.25, kind="a")  # so its slot is not its number
    sim.run(max_contacts=1)
    there = sim.snapshot()
    contents = copy.deepcopy(there.state.contents)
    contents.clock["fault.code"] = JAMMED  # else the fault has no bodies

    def snapshot():
        return replace(there, whole=replace(there.state, contents=copy.deepcopy(contents)))

    for table in contents[:2] + contents[3:]:
        for name, form, quantity, role in declared(table.dtype, Role.CARRIED, Role.COST):
            if (
                quantity in OTHERS
                and form != "f8"
                and name not in ("number", "a", "b", "fault.code", "supports")
            ):
                old, before = snapshot(), table[name].copy()
                table[name] = OTHERS[quantity][value]
                same = role is Role.COST or (table[name] == before).all()
                assert (old == snapshot()) == same, f"{name} is not compared"
    assert pickle.loads(pickle.dumps(snapshot())) == snapshot()
    engine = resumed(snapshot(), sim.scene, composition_of(sim))
    restored, body = contents_of(engine.k), int(contents.clock["fault.a"][0])
    assert engine.k.clock[0].fault.a == (body if body < 0 else engine.k.slots[body]), "a slot is a number"
    count_from_next(engine.k, all_ticks(engine.k, ()))
    for kept, again, moved in zip(contents, restored, contents_of(engine.k), strict=True):
        for name, _, quantity, _ in declared(kept.dtype, Role.CARRIED, Role.COST):
            values, by = kept[name].tolist(), SPAN if quantity in TICKS else 0
            assert again[name].tolist() == values, f"{name} is not restored"
            values = [max(each - by, LONG_AGO) if by and each != NEVER else each for each in values]
            assert moved[name].tolist() == values, f"{name} is not counted from the next span"


@pytest.mark.small
def test_a_passing_of_four_spans_ended_late_for_it_began_in_the_future():
    places, flies = [(1.0, 1.0), (1.75, 1.0)], [(2.0**-12, 0.0), (0.0, 0.0)]
    scene = kt.Scene(places, flies, 0.25, commands=[kt.Turn(0, 4000.0, (0.125, 0.0))], **PASSING)
    sim = kt.Simulation(scene, "naive")
    sim.run(max_contacts=2)
    assert rows(sim) == answer(scene, 2, 5000 << 52).contacts


def refuse(state, scene: kt.Scene, wrong: list[tuple]) -> None:
    """Asserts that a state is right, and that each change of it, in a row of a table, is refused."""
    check_state(state, scene)
    taken = []
    for name, at, field, value in wrong:
        rows = getattr(state.contents, name).copy()
        rows[field][at] = value
        with suppress(ValueError):
            check_state(replace(state, contents=state.contents._replace(**{name: rows})), scene)
            taken.append((name, at, field, value))
    assert taken == []


@pytest.mark.parametrize(("field", "value"), [("kind", 1), ("kind", -1), ("form", 1), ("form", -1)])
def test_a_command_of_a_later_span_has_a_kind_and_a_shape_that_there_are(field, value):
    coming = [kt.Insert(5000.0, (0.5, 0.5), (0.0, 0.0), 2.0**-9)]
    scene = kt.make_scene("grid", bodies=4).replace(commands=coming)
    state = kt.Simulation(scene, "naive").snapshot().state
    check_state(state, scene)
    rows = state.later.rows.copy()
    rows[field] = value
    with pytest.raises(ValueError, match="a command for body 4 has values that no body has"):
        check_state(replace(state, later=state.later._replace(rows=rows)), scene)


def test_the_first_value_that_is_wrong_is_refused():
    """In a run with passings, comers and leavers, and commands to come: nine bodies, and one that comes."""
    kinds = ["one", "two", "one"] * 3
    coming = [kt.Insert(0.6, (0.5, 0.5), (0.0, 0.0), 2.0**-9, kind="two"), kt.Turn(9, 0.7, (1.0, 0.0))]
    scene = kt.make_scene("grid", bodies=9, seed=1).replace(
        kind=kinds, responses={("one", "two"): kt.Response("pass")}, commands=[*coming, kt.Remove(2, 0.75)]
    )
    sim = kt.Simulation(scene, "naive")
    sim.run(0.5)
    state = sim.snapshot().state
    now, speed = int(state.contents.clock["now"][0]), state.bounds.speed
    first = state.contents.commands["tick"][0]
    wrong = [
        *(("plans", 8, "number", value) for value in (7, 10)),
        *(("plans", 8, "last", value) for value in (-2, 10)),
        *((table, 0, "kind", value) for table in ("plans", "commands") for value in (-1, 2)),
        *(("plans", 8, "form", value) for value in (-2, 0)),
        *(("plans", 0, field, 0.0) for field in ("radius", "mass")),
        *(("plans", 0, "anchor", value) for value in (now + 1, -(1 << 62) - SPAN - 1)),
        ("plans", 0, "vx", 1.001 * speed),
        ("plans", 0, "y", 2.0**217),
        ("passings", 0, "b", state.contents.passings["a"][0]),
        ("passings", 0, "b", 9),  # it is still to come
        ("counts", 0, "contacts_disc", -1),
        ("counts", 0, "deepest", np.inf),
        *(("clock", 0, field, value) for field in ("fault.a", "fault.b") for value in (-5, 10)),
        ("clock", 0, "torus.number", -1),
        *(("clock", 0, field, -2) for field in ("now", "met_there", "jam.window")),
        ("clock", 0, "fault.code", 2 if JAMMED != 2 else 1),
        *(("commands", 0, "body", value) for value in (-1, 8, 10)),
        *(("commands", 1, "body", value) for value in (-1, 10)),
        ("commands", 0, "tick", now - 1),
        ("commands", 1, "tick", first - 1),
        ("commands", 0, "code", -9),
        *(("commands", 0, field, 2.0**201) for field in ("x", "y", "vx", "vy", "radius")),
        *(("commands", 0, field, 0.0) for field in ("radius", "mass")),
    ]
    refuse(state, scene, wrong)
    with pytest.raises(ValueError, match="overlaps at the start"):
        check_state(replace(state, overlapping=np.array([[0, 9]])), scene)


def test_a_shape_that_there_is_not_is_refused_and_so_is_another_radius():
    boxes = {"shape": kt.box(0.5, 0.25), "arena": (4.0, 4.0)}
    coming = [kt.Insert(0.5, (3.0, 3.0), (0.0, 0.0), shape=kt.box(0.25, 0.25))]
    scene = kt.Scene([(1.0, 1.0), (3.0, 1.0)], [(0.0, 0.0)] * 2, **boxes, commands=coming)
    sim = kt.Simulation(scene, "naive")
    sim.run(0.25)
    wrong = [(table, 0, "form", value) for table in ("plans", "commands") for value in (-1, 2)]
    refuse(
        sim.snapshot().state,
        scene,
        [*wrong, *((table, 0, "radius", 0.125) for table in ("plans", "commands"))],
    )


def test_snapshots_with_one_field_that_differs_are_not_equal():
    there = lively("cells").snapshot()
    state = there.state
    changes = {"base": 1, "requested": 9.0, "audits": 5, "overlapping": np.array([[0, 1]])}
    others = [{name: value} for name, value in changes.items()]
    entries = [{"rows": 9}, {"pending_events": ((0, 1, 0, 1),)}, {"unrecorded": (np.zeros(1),)}]
    others += [{"entries": state.entries._replace(**each)} for each in entries]
    for each in others:
        assert replace(there, whole=replace(state, **each)) != there, each
    assert replace(there, start_energy=0.5) != there != replace(there, audit=9)
    assert replace(there, whole=replace(state, cpu_seconds=9.0)) == there


HALL = {"arena": (8.0, 8.0), "kind": ["one", "two"], "kinds": ["one", "two", "three"]}
LATER = kt.Turn(1, 9000.0, (1.0, 0.0))


def hall(phase: str = "naive", place: float = 1.0, commands: tuple = (), **more) -> kt.Simulation:
    rules = HALL | {"responses": {("one", "two"): "pass"}, "commands": commands}
    scene = kt.Scene([(place, 1.0), (3.0, 1.0)], [(1.0, 0.25), (0.0, 0.0)], 0.5, **rules)
    return kt.Simulation(scene, phase, live=True, **more)


@pytest.mark.small
def test_two_states_had_one_fingerprint_until_the_first_contact():
    orders = [
        lambda sim: None,
        lambda sim: sim.set_position(0, (1.5, 1.5)),
        lambda sim: sim.set_velocity(0, (1.0, -0.25)),
        lambda sim: sim.set_kind(1, "three"),
        lambda sim: sim.insert((6.0, 6.0), radius=0.25),
        lambda sim: sim.remove(1),
        lambda sim: sim.run(until=0.5),
    ]
    sims = [hall(place=1.25), hall(commands=(kt.Turn(1, 1.0, (1.0, 0.0)),)), hall(commands=(LATER,))]
    sims += [hall() for _ in orders]
    for sim, order in zip(sims[3:], orders, strict=True):
        order(sim)
    assert len({sim.fingerprint for sim in sims}) == 1
    there = [sim.snapshot() for sim in sims]
    assert len({each.state_fingerprint for each in there}) == len({*there}) == len(sims)
    assert hall().snapshot() in {*there}
    for each in there:  # no hash of a text, which differs from process to process
        assert hash(pickle.loads(pickle.dumps(each))) == int(each.state_fingerprint[:15], 16)


@pytest.mark.small
def test_a_state_has_one_fingerprint_under_all_phases_however_the_run_came_there(tmp_path):
    found = set()
    for phase, pieces, kept in (("naive", 1, True), ("naive", 3, False), ("cells", 2, False)):
        sim = hall(phase, commands=(LATER,), keep_contacts=kept, keep_commands=kept)
        states = []
        for frame in range(1, 9):
            for piece in range(1, pieces + 1):
                sim.run(until=0.5 * (frame - 1 + piece / pieces))
            if frame == 3:
                sim.set_velocity(1, (0.0, 0.5))
                assert sim.passings.tolist() == [[0, 1]]
            if frame == 5:
                sim.insert((6.0, 6.0), (-1.0, 0.5), 0.25, kind="three")
            states.append(sim.state_fingerprint)
        sim.save(tmp_path / "s.kt")
        assert kt.resume(tmp_path / "s.kt", "sap-1d").state_fingerprint == states[-1]
        found.add(tuple(states))
    assert len(found) == 1


@pytest.mark.small
def test_a_snapshot_of_a_game_grew_with_each_command():
    """And with each one before a step, whose rows waited for a recorder that missed the step in any case."""
    sim, sizes = hall(keep_contacts=False, keep_commands=False), []
    sim.set_velocity(0, (0.0, 0.0))
    for frame in range(1, 25):
        sim.set_kind(1, ["three", "two"][frame % 2])
        sim.remove(sim.insert((6.0, 6.0), radius=0.25, kind="three"))
        sim.run(until=frame / 64)
        sizes.append(len(pickle.dumps(sim.snapshot())))
    assert max(sizes) - min(sizes) < 256
    again = pickle.loads(pickle.dumps(sim))
    assert again.snapshot() == sim.snapshot() != hall().snapshot()
    for each in (sim, again):
        assert each.kinds_of(range(2, 2 + 24)).tolist() == ["three"] * 24
        assert each.insert((4.0, 6.0), radius=0.25, kind="one") == 26
        with pytest.raises(ValueError, match="keep_commands=False"):
            each.recorded()
    sim.set_velocity(0, (0.0, 1.0))
    assert sim.step().kind == "wall"
    assert sim.snapshot().state.entries.unrecorded == ()


@pytest.mark.small
@pytest.mark.parametrize("lifetime", [5.0, 600.0])
def test_a_recording_with_a_far_lifetime_had_another_state(lifetime):
    sim = kt.Simulation(kt.Scene([[4, 2]], [[0.25, 0.125]], 0.25, arena=(8, 4)), "cells", live=True)
    sim.run(0.5)
    sim.insert((1, 1), (1, 0), radius=0.125, lifetime=lifetime)
    sim.run(0.75)
    again = kt.Simulation(sim.recorded(), "cells")
    again.run()
    assert again.state_fingerprint == sim.state_fingerprint
