"""``run(on_contact=f, on_part=g)``: called with each contact, at its time; their commands happen there."""

import math
import random
from contextlib import suppress

import pytest

import kinetile as kt
from capabilities import moments_of
from kinetile.run import simulation
from kinetile_accuracy import certify_log
from lanes import BUILT_IN, first
from sensors import foretold

pytestmark = pytest.mark.small

KINDS = {"kind": ["ball", "ball", "bullet", "peg"], "mass": [1.0, 1.0, 1.0, float("inf")]}
RULES = {("ball", "bullet"): "pass", ("bullet", "wall"): "stop"}


def scene(seed=0):
    rng = random.Random(seed)
    places = [(1.0, 1.0), (3.0, 1.0), (1.0, 3.0), (2.5, 2.5)]
    flies = [(rng.uniform(-2, 2), rng.uniform(-2, 2)) for _ in range(3)] + [(0.0, 0.0)]
    return kt.Scene(places, flies, 0.25, arena=(4.0, 4.0), responses=RULES, **KINDS)


@pytest.mark.parametrize("phase", first(2, BUILT_IN))
def test_it_is_called_with_every_contact_in_order_and_changes_nothing(phase):
    told, rows = [], []
    sim, plain = (kt.Simulation(kt.make_scene("grid", bodies=6, seed=1), phase) for _ in range(2))
    plain.run(until=1.0, observe=["pressure"])
    recorder = {"recorder": lambda some: rows.append(len(some))}
    sim.run(1.0, on_contact=told.append, on_part=told.append, observe=["pressure"], **recorder)
    assert moments_of(told) == moments_of(sim) == moments_of(plain)
    assert sim.time == 1.0
    assert sum(rows) == len(told)
    assert sim.observed == plain.observed


def test_a_true_of_numpy_stops_a_run_too():
    sim = kt.Simulation(scene())
    _, event = sim.run(until=30.0, on_contact=lambda event: sim.positions()[0, 0] > 0.0)
    assert len(sim.contacts) == 1
    assert event is not None


def test_kinds_choose_what_is_called():
    told = {"ball": [], "two": [], "wall": []}
    of = {
        "ball": told["ball"].append,
        ("ball", "peg"): told["two"].append,
        ("wall", "bullet"): told["wall"].append,
    }
    sim = kt.Simulation(scene(), "cells")
    sim.run(until=30.0, on_contact=of, on_part={key: of[key] for key in ("ball", ("ball", "peg"))})
    met = [({*sim.kinds_of(list(bodies)).tolist()}, bodies) for _, _, bodies in moments_of(sim)]
    assert len(told["ball"]) == sum("ball" in kinds for kinds, _ in met) > 5
    assert len(told["two"]) == sum(kinds == {"ball", "peg"} for kinds, _ in met) > 0
    assert len(told["wall"]) == sum(kinds == {"bullet"} for kinds, _ in met) > 0
    assert all(each.kinds == ("bullet",) and each.wall for each in told["wall"])


ONE_KIND = kt.Scene([(1, 1), (3, 1)], [(1, 0.5), (0, 0)], 0.25, arena=(4, 4))
KEYS = ["ball", ("peg", "ball"), ("wall", "bullet"), ("bullet", "ball"), ("peg", "peg"), ("ball", "*")]
KEYS += ["*", ("*", "*"), ("*", "wall"), ("ball", "bottom"), ("top", "*")]
SIDES = {"left", "right", "bottom", "top"}


def is_meant(key, event):
    """Whether a function of a key is called at a contact."""
    kinds = event.kinds or (0,) * len(event.bodies)
    named = list(key) if isinstance(key, tuple) else [key]
    for each in named:
        if each == "wall" or each in SIDES:
            others = [other for other in named if other != each]
            return each in ("wall", event.wall) and bool(event.wall) and others[0] in ("*", *kinds)
    if len(named) == 1:
        return named[0] in ("*", *kinds)
    orders = [kinds, kinds[::-1]] if len(kinds) == 2 else []
    return any(all(name in ("*", kind) for name, kind in zip(named, each, strict=True)) for each in orders)


@pytest.mark.parametrize(
    ("made", "keys"),
    [
        (scene(), KEYS),
        (ONE_KIND, [0, (0, 0), (0, "wall"), ("left", 0), ("*", "*")]),
        (ONE_KIND.replace(mass=[1, math.inf]), [(0, 0), (0, "wall")]),
    ],
    ids=["several kinds", "one", "one, with rules"],
)
def test_the_loop_stops_for_no_other_contact(monkeypatch, made, keys):
    """It stopped at all of the first kind: of 400 discs with one target at 3,564, for 11 calls."""
    stops, every = [], []
    advance = simulation.advance
    monkeypatch.setattr(simulation, "advance", lambda *given: stops.append(advance(*given)) or stops[-1])
    kt.Simulation(made, "cells").run(until=3.0, on_contact=every.append)
    for key in keys:
        called = []
        stops.clear()
        kt.Simulation(made, "cells").run(until=3.0, on_contact={key: called.append})
        assert moments_of(called) == moments_of([event for event in every if is_meant(key, event)])
        assert len(stops) == len(called) + 1
        names = key if isinstance(key, tuple) and not {*key} & {"wall", *SIDES} else (key, "*")
        two = [each.kinds for each in called if len(each.kinds) == 2]
        assert all(name in ("*", kind) for kinds in two for name, kind in zip(names, kinds, strict=True))
    stops.clear()
    kt.Simulation(made, "cells").run(until=3.0, on_contact={})
    assert stops == [("until", None)]


def test_one_coin_counted_twice():
    """It was called where a passing ends, too; and bodies came by their numbers, whatever the key."""
    scene = kt.Scene(
        [(1, 1), (3, 1)], [(1, 0), (0, 0)], 0.25, kind=["ball", "coin"], arena=(8, 2), responses="pass"
    )
    taken, left = [], []
    sim = kt.Simulation(scene)
    sim.run(6.0, on_contact={("coin", "ball"): taken.append}, on_part={("ball", "coin"): left.append})
    assert [(each.kind, each.bodies, each.kinds) for each in taken] == [("pass", (1, 0), ("coin", "ball"))]
    assert [(each.kind, each.bodies, each.kinds) for each in left] == [("part", (0, 1), ("ball", "coin"))]
    sim = kt.Simulation(scene, live=True)
    counted = []
    sim.run(6.0, on_contact={"coin": lambda event: (counted.append(event), sim.remove(event.bodies[0]))})
    assert (len(counted), sim.bodies.tolist()) == (1, [0])


@pytest.mark.parametrize("before", [False, True])
def test_stop_at_takes_pairs_of_kinds(before):
    every = []
    kt.Simulation(scene(), "cells").run(9.0, on_contact=every.append, on_part=every.append)
    for pairs in ([("ball", "peg")], [["bullet", "ball"], ("ball", "top")], [(1, "wall"), ("*", "peg")]):
        for parts in (False, True):
            sim, stop = kt.Simulation(scene(), "cells"), kt.StopAt(pairs=pairs, parts=parts, before=before)
            found = []
            while event := sim.run(9.0, stop_at=stop).event:
                found.append(event)
            meant = [
                event
                for event in every
                if (parts or event.kind != "part")
                and any(
                    (1 in event.bodies and event.wall) if pair == (1, "wall") else is_meant(pair, event)
                    for pair in map(tuple, pairs)
                )
            ]
            assert found == ([*map(foretold, meant)] if before else meant)


def test_a_removal_after_a_step_is_no_contact():
    both = {"kind": ["ball", "bullet"], "responses": RULES, "commands": [kt.Remove(0, 0.25)]}
    sim = kt.Simulation(kt.Scene([(1.0, 1.0), (1.25, 1.0)], [(0.0, 0.0)] * 2, 0.25, arena=(4.0, 4.0), **both))
    assert [sim.step().kind for _ in range(2)] == ["pass", "part"]
    called = []
    sim.run(until=1.0, on_contact=called.append)
    assert called == []
    assert sim.bodies.tolist() == [1]


@pytest.mark.parametrize("key", [("robot", "zone"), ("crate", "zone"), None])
@pytest.mark.parametrize("how", ["between", "on_contact", "progress", "planned"])
def test_it_is_called_with_the_end_of_a_passing_whose_body_goes(how, key):
    """It was by the body's kind at its insertion, and not at all where ``progress`` removed it."""
    rules = {("robot", "zone"): "pass", ("crate", "zone"): "pass"}
    scene = kt.Scene([(0, 0)], [(0, 0)], 1, kinds=["crate", "robot", "zone"], kind=["zone"], responses=rules)
    planned = [kt.Insert(0, (-3, 0), (1, 0), 0.25, kind="crate"), kt.SetKind(1, 1, "robot"), kt.Remove(1, 3)]
    sim, told = kt.Simulation(scene.replace(commands=planned if how == "planned" else ()), "cells"), []

    def leave(event_or_progress):
        if event_or_progress.time > 1.0 and 1 in sim.bodies:
            sim.remove(1)

    def note(event):
        told.append((event.kind, event.kinds))
        if how == "on_contact":
            leave(event)

    if how != "planned":
        sim.insert((-3, 0), (1, 0), 0.25, kind="crate")
        sim.run(until=1.0)
        sim.set_kind(1, "robot")
    calls = {"on_contact": note if key is None else {key: note, ("robot", "wall"): print}}
    calls["on_part"] = note if key is None else {key: note}
    sim.run(until=2.5, **calls, progress=leave if how == "progress" else None)
    if how == "between":
        sim.remove(1)
    sim.run(until=4.0, **calls)
    kinds = ("zone", "robot") if key is None else key
    met = [("pass", kinds), ("part", kinds)]
    assert told == ([] if key == ("crate", "zone") else met)
    assert sim.kinds_of([0, 1]).tolist() == ["zone", "robot"]


def orders(sim, seed):
    """A function that turns, inserts and removes at contacts."""
    rng = random.Random(seed)

    def order(event):
        bodies = sim.bodies.tolist()
        what = rng.randrange(4)
        if what == 0:
            sim.set_velocity(rng.choice(bodies), (rng.uniform(-2, 2), rng.uniform(-2, 2)))
        elif what == 1 and len(bodies) > 2:
            sim.remove(rng.choice(bodies))
        elif what == 2:
            place = (rng.uniform(0.3, 3.7), rng.uniform(0.3, 3.7))
            with suppress(kt.errors.NoRoom):
                sim.insert(place, (1.0, rng.uniform(-1, 1)), 0.125, kind=rng.choice(["ball", "bullet"]))

    return order


@pytest.mark.parametrize("seed", first(4, range(60)))
def test_what_it_orders_is_replayed_under_another_phase_and_certified(seed):
    sims = [kt.Simulation(scene(seed), phase, live=True) for phase in ("naive", "cells", "sap-1d")]
    for sim in sims:
        order = orders(sim, seed)
        sim.run(until=2.0, on_contact=order, on_part=order)
        there = sim.snapshot()
        sim.restore(there)
        sim.run(until=4.0, on_contact=order, on_part=order)
        sim.audit()
    assert len({sim.fingerprint for sim in sims}) == 1
    recorded = sims[0].recorded()
    again = kt.Simulation(recorded, "sap-2d")
    again.run()
    assert again.fingerprint == sims[0].fingerprint
    assert certify_log(recorded, sims[0].contacts).right


def test_new_bodies_of_a_kind_are_called_for():
    sim, told = kt.Simulation(scene(), "cells", live=True), []

    def split(event):
        told.append(event)
        if len(told) == 1:
            sim.insert((3.5, 3.5), (1.0, 0.5), 0.125, kind="bullet")

    sim.run(until=6.0, on_contact={"bullet": split})
    assert any(4 in event.bodies for event in told)


def test_true_stops_the_run_there_and_an_error_ends_it_at_that_contact():
    whole, sim = kt.Simulation(scene(), "cells"), kt.Simulation(scene(), "cells")
    whole.run(until=4.0)
    told = []
    _, met = sim.run(until=4.0, on_contact=lambda event: told.append(event) or len(told) == 3)
    assert (met, sim.time, len(sim.contacts)) == (told[2], told[2].time, 3)

    def fail(event):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sim.run(until=4.0, on_contact=fail)
    assert len(sim.contacts) == 4
    assert sim.fault is None
    sim.run(until=4.0)
    assert (sim.fingerprint, sim.positions().tolist()) == (whole.fingerprint, whole.positions().tolist())


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        ({"on_contact": 3}, TypeError, "on_contact is 3; expected a function or a mapping or None"),
        ({"on_contact": {"dart": print}}, ValueError, "dart"),
        ({"on_contact": {"wall": print}}, ValueError, "expected a kind, two, or a kind and 'wall'"),
        ({"on_contact": {("wall", "left"): print}}, ValueError, "expected a kind, two, or a kind and 'wall'"),
        ({"on_contact": {"ball": None}}, TypeError, "which is no function"),
        ({"on_part": {("ball", "top"): print}}, ValueError, "on_part: walls cannot be passed"),
        ({"stop_at": kt.StopAt(pairs=[(0, "ball")])}, ValueError, "0 is no kind of this scene"),
        ({"stop_at": kt.StopAt(pairs=("ball", "peg"))}, ValueError, "or two kinds; found 'ball'"),
        ({"stop_at": kt.StopAt(pairs=(0, 1))}, ValueError, "or two kinds; found 0"),
        ({"stop_at": kt.StopAt(pairs=[("ball",)])}, ValueError, "or two kinds; found"),
        ({"on_contact": int}, TypeError, "expected a function"),
        ({"on_contact": print, "stop_at": kt.StopAt()}, TypeError, "stop_at or on_contact"),
    ],
)
def test_what_is_refused_changes_nothing(given, error, says):
    sim = kt.Simulation(scene(), "cells")
    before = sim.snapshot()
    with pytest.raises(error, match=says):
        sim.run(until=1.0, **given)
    assert sim.snapshot() == before


def test_it_cannot_run_the_run_that_calls_it():
    sim = kt.Simulation(scene(), "cells")
    with pytest.raises(kt.errors.BusyError, match="from its own"):
        sim.run(until=4.0, on_contact=lambda event: sim.run(until=5.0))
