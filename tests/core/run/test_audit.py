"""Faults that the kernel's own audit sees: tables broken by hand, and the sentence about it."""

from typing import Any, NamedTuple

import numpy as np
import pytest

import kinetile as kt
import lanes
from inside import engine_of
from kinetile.errors import AuditError, UnawaitedContactError
from kinetile.kernel.loop.calendar import move
from kinetile.kernel.tables import GUESS, NEVER, NOBODY, PAIR, STRUCTURAL, Kernel
from kinetile.run.engine.engine import Engine
from kinetile.toolbox import BroadPhaseParts, Records, add_pair, hook, pairs_of, remove_pair
from messages import table
from registering import fixture, registered


class State(NamedTuple):
    """Nothing that matters."""

    nothing: Records


@hook
def add_all(k: Kernel, s: State) -> None:
    for a in range(len(k.bodies)):
        for b in range(a):
            add_pair(k, a, b)


@hook
def in_a_pair(k: Kernel, s: State, body: int) -> int:
    return pairs_of(k, body)


class AllPairs:
    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(near=in_a_pair, state=State(np.zeros(1)), build=add_all, pairs=100)


_registered = fixture(kt.BroadPhaseSpec("all-pairs", AllPairs), scope="module")


def engine(phase: str = "naive") -> Engine:
    """Three discs near each other in an arena, the first two approaching, and one alone."""
    position = [[0.3, 0.5], [0.55, 0.5], [0.425, 0.7], [0.85, 0.15]]
    velocity = [[0.5, 0.0], [-0.5, 0.0], [0.0, -0.5], [0.0, 1.0]]
    sim = kt.Simulation(kt.Scene(position, velocity, 0.1, arena=(1.0, 1.0)), phase)
    assert sim.next_event is not None  # the first contact is known exactly
    sim.audit()
    return engine_of(sim)


@pytest.fixture
def e() -> Engine:
    found = engine()
    assert found.k.queue[first(found)].kind == PAIR
    return found


@pytest.fixture
def all_pairs() -> Engine:
    return engine("all-pairs")


def refile(found: Engine, body: int, key: int, kind: int) -> None:
    found.k.queue[body].kind = kind
    move(found.k, body, key)


def first(found: Engine) -> int:
    return int(np.argmin(found.k.queue.key))


@pytest.mark.parametrize("phase", lanes.first(3, lanes.BUILT_IN))
@pytest.mark.parametrize("seed", lanes.first(1, range(4)))
def test_between_any_two_events_everything_holds(seed, phase):
    """Structural failures of the very tick included, and guesses that ran ahead of the clock."""
    sim = kt.Simulation(kt.make_scene("lattice", bodies=9, seed=seed, turns=6), phase)
    for number, _ in enumerate(sim.steps(until=0.25)):
        sim.audit()
        if number % 5 == 0:
            assert sim.next_event is not None
            sim.audit()
        if number % 11 == 0:
            sim.set_velocity(number % 9, (0.5, -0.25))
            sim.audit()
        if number % 17 == 0:
            sim.rebuild()
            sim.audit()


@pytest.mark.compiled
def test_an_audit_after_the_calendar_was_given_other_slices_found_it_unfiled():
    sim = kt.Simulation(kt.make_scene("grid", bodies=100, density=0.5, seed=1), "naive")
    sim.run(max_contacts=1000)
    engine = engine_of(sim)
    engine.k.clock[0].calendar.shift += 8
    engine.k.clock[0].calendar.filed = 0
    engine.audit()
    assert engine.k.clock[0].calendar.filed


def filed(k: Kernel) -> int:
    return int(np.flatnonzero(k.rings < len(k.bodies))[0])


def flip(k: Kernel, at: int) -> None:
    k.marks[at >> 6] ^= np.uint64(1 << (at & 63)).astype(np.int64)


def unfile(k: Kernel, at: int) -> int:
    body = int(k.rings[at])
    k.rings[at] = len(k.bodies)
    flip(k, at)
    return body


def put(record: Any, **values: int) -> None:
    for name, value in values.items():
        record[name] = value


def file_in_another_slice(found: Engine) -> None:
    k = found.k
    at = filed(k)
    body, other = unfile(k, at), at ^ 1
    assert int(k.rings[other]) == 4
    k.rings[other] = body
    put(k.links[body], next=4, prev=~other)
    flip(k, other)


def replace_a_partner(found: Engine) -> None:
    k = found.k
    k.firsts[3] = np.flatnonzero((k.pairs.a == 0) & (k.pairs.b == 1))[0]


def unlink_backwards(found: Engine) -> None:
    live = found.k.pairs.a >= 0
    found.k.pairs.prev_a[live] = found.k.pairs.prev_b[live] = -1


def test_a_ring_out_of_order():
    found = engine()
    k = found.k
    put(k.clock[0].calendar, shift=54, filed=0)  # all bodies in one slice
    found.build()
    at, links = filed(k), k.links
    one = int(k.rings[at])
    two = int(links[one].next)
    three = int(links[two].next)
    k.rings[at], links[two].next, links[one].next = two, one, three
    links[two].prev, links[one].prev, links[three].prev = ~at, two, one
    said = rf"slice {at} of the calendar is out of order: body {two} is before body {one}"
    with pytest.raises(AuditError, match=said):
        found.audit()


@pytest.mark.interpreted
def test_two_bodies_that_touch_and_are_no_candidates():
    position = [[0.25, 0.5], [0.5, 0.5]]
    sim = kt.Simulation(kt.Scene(position, np.zeros((2, 2)), 0.125, arena=(1.0, 1.0)), "all-pairs")
    sim.build()
    remove_pair(engine_of(sim).k, 0, 1)
    with pytest.raises(AuditError, match=r"bodies 0 and 1 touch \(gap 0\) and are not a candidate pair"):
        sim.audit()


def delay(found: Engine, body: int, kind: int) -> None:
    entry = found.k.queue[body]
    entry.tick += 1
    entry.exact = kind == PAIR
    refile(found, body, int(entry.tick), kind)


def delay_a_wall(found: Engine) -> None:
    entry = found.k.queue[3]
    assert entry.kind != PAIR
    entry.wall = 77
    refile(found, 3, 77, 3)


def forget_a_wall(found: Engine) -> None:
    entry = found.k.queue[3]
    entry.wall = NEVER
    refile(found, 3, int(entry.tick), GUESS if entry.tick != NEVER else STRUCTURAL)


def forget(found: Engine, body: int) -> None:
    entry = found.k.queue[body]
    entry.tick = entry.guard = NEVER
    entry.partner = NOBODY
    refile(found, body, NEVER, STRUCTURAL)


def test_a_contact_that_nobody_awaits():
    sim = kt.Simulation(kt.Scene([[0.0, 0.0], [4.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], 0.5), "naive")
    sim.build()
    for body in (0, 1):
        forget(engine_of(sim), body)
    with pytest.raises(UnawaitedContactError, match=r"bodies 0 and 1 is awaited never at the earliest, but"):
        sim.audit()


def test_a_guard_behind_which_a_contact_comes():
    """Three discs in a row: the middle one's guard holds the later contact."""
    position = [[0.0, 0.0], [2.0, 0.0], [5.0, 0.0]]
    sim = kt.Simulation(kt.Scene(position, [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.5), "naive")
    assert sim.next_event is not None
    forget(engine_of(sim), 2)
    sim.audit()  # the middle one covers both
    entry = engine_of(sim).k.queue[1]
    assert (entry.partner, entry.tick < entry.guard) == (0, True)
    entry.guard = NEVER
    with pytest.raises(UnawaitedContactError, match="bodies 1 and 2 is awaited never at the earliest"):
        sim.audit()


def test_a_contact_that_comes_after_another_of_its_tick():
    """Both outer discs reach the middle one at one tick: the pair of the smaller numbers comes first."""
    position = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0]]
    sim = kt.Simulation(kt.Scene(position, [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.5), "naive")
    assert sim.next_event == kt.Event(1.0, 1, 0, "disc", (0, 1))
    sim.audit()
    found = engine_of(sim)
    forget(found, 0)
    forget(found, 2)
    entry = found.k.queue[1]
    entry.tick = entry.guard = 1 << 52
    entry.partner, entry.seen, entry.exact = 2, found.k.stamps[2], 1
    refile(found, 1, 1 << 52, PAIR)
    with pytest.raises(UnawaitedContactError, match=r"bodies 0 and 1 are looked at too late, but by their"):
        sim.audit()


@pytest.mark.parametrize("periodic", ["", "xy"])
@pytest.mark.parametrize("phase", lanes.first(1, ["cells", "naive", *lanes.BUILT_IN[2:]]))
def test_a_stop_before_a_contact_left_it_unfiled_and_the_audit_blamed_a_sound_run(phase, periodic):
    if periodic:
        periodic = {"sweep-tiling": "x", "sap-k": "", "power": ""}.get(phase, periodic)  # what it takes
    scene = kt.make_scene("grid", bodies=9, density=0.3, seed=2, periodic=periodic)
    sim = kt.Simulation(scene, phase, audit=1)
    stops, by_hand = 0, kt.Simulation(scene, phase)
    while stops < 4:
        stop = kt.StopAt(bodies=[0, 1, 2], before=True)
        event, same = (each.run(100.0, stop_at=stop).event for each in (sim, by_hand))
        assert event == same is not None
        by_hand.audit()
        stops += 1
    plain = kt.Simulation(scene, phase)
    plain.run(max_contacts=len(sim.contacts))
    assert plain.fingerprint == sim.fingerprint == by_hand.fingerprint


def test_an_audit_blames_nobody():
    """A narrow phase that reports an overlap during a second call leaves no fault behind."""
    found = engine()
    found.k.bodies[0].x += 0.1
    found.k.places[0].x += 0.1
    with pytest.raises(AuditError):
        found.audit()
    assert found.k.clock[0].fault.code == 0


def _own(k: Kernel, s: State):
    yield "body 1 is in no place"


class ToldByItsOwn:
    """Names no body, and its audit says why."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(in_a_pair, State(np.zeros(1)), audit=_own, pairs=1)


@pytest.mark.interpreted
def test_the_phases_own_audit_comes_before_what_follows_from_its_structure():
    scene = kt.Scene([[1.0, 1.0], [1.5, 1.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25)  # they touch, and are no pair
    own = pytest.raises(AuditError, match=r"the phase's own audit: body 1 is in no place$")
    with registered(kt.BroadPhaseSpec("told-by-its-own", ToldByItsOwn)), own:
        kt.Simulation(scene, "told-by-its-own").audit()


test_message = table(globals())
