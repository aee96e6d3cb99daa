"""What the kernel's own audit sees: tables broken by hand, and the sentence about it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

import kinetile as kt
import lanes
from kinetile.errors import AuditError, UnawaitedContactError
from kinetile.kernel.loop.calendar import move
from kinetile.kernel.tables import GUESS, NEVER, NOBODY, PAIR, STRUCTURAL, Kernel
from kinetile.run.engine.engine import Engine
from kinetile.toolbox import BroadPhaseParts, Records, add_pair, hook, pairs_of, remove_pair

PHASES = ["naive", "cells", "sap-1d", "sap-2d", "sweep-tiling"]


class State(NamedTuple):
    """Nothing that matters."""

    nothing: Records


@hook
def add_all(k: Kernel, s: State) -> None:
    """Put every pair into the pair set."""
    for a in range(len(k.bodies)):
        for b in range(a):
            add_pair(k, a, b)


@hook
def in_a_pair(k: Kernel, s: State, body: int) -> int:
    """Name who is in a pair with a body."""
    return pairs_of(k, body)


@hook
def one_sided(k: Kernel, s: State, body: int) -> int:
    """Name all bodies of greater numbers."""
    count = 0
    for other in range(body + 1, len(k.bodies)):
        k.near[count] = other
        count += 1
    return count


class AllPairs:
    """Keeps every pair in the pair set."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(near=in_a_pair, state=State(np.zeros(1)), build=add_all, pairs=100)


class OneSided:
    """Is not symmetric."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        return BroadPhaseParts(near=one_sided, state=State(np.zeros(1)))


class Plugin:
    """Brings both."""

    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        return [kt.BroadPhaseSpec("all-pairs", AllPairs), kt.BroadPhaseSpec("one-sided", OneSided)]


@pytest.fixture(scope="module", autouse=True)
def registered():
    plugin = Plugin()
    kt.registry().add(plugin)
    yield
    kt.registry().remove(plugin)


def engine(phase: str = "naive") -> Engine:
    """Three discs near each other in an arena, the first two approaching, and one alone."""
    position = [[0.3, 0.5], [0.55, 0.5], [0.425, 0.7], [0.85, 0.15]]
    velocity = [[0.5, 0.0], [-0.5, 0.0], [0.0, -0.5], [0.0, 1.0]]
    sim = kt.Simulation(kt.Scene(position, velocity, 0.1, arena=(1.0, 1.0)), phase)
    assert sim.next_event is not None  # the first contact is known exactly
    sim._engine.audit()
    return sim._engine


def refile(found: Engine, body: int, key: int, kind: int) -> None:
    """File a body under a tick and a kind."""
    found.k.queue[body].kind = kind
    move(found.k, body, key)


def first(found: Engine) -> int:
    """Return the body that is looked at first."""
    return int(np.argmin(found.k.queue.key))


# Runs


@pytest.mark.small
@pytest.mark.parametrize("phase", PHASES)
def test_runs_of_every_phase_pass(phase):
    scene = kt.make_scene("random", bodies=8, density=0.3, radius_ratio=3.0, mass_ratio=4.0, seed=2)
    sim = kt.Simulation(scene, phase, audit=1)
    sim.run(until=20.0, max_contacts=50)
    assert sim.readings.contacts_disc > 10


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.parametrize("phase", PHASES)
def test_runs_with_turns_pass(phase):
    for seed in range(8):
        scene = kt.make_scene("lattice", bodies=12, turns=20, seed=seed)
        kt.Simulation(scene, phase, audit=1).run(until=4.0, max_contacts=100)


@pytest.mark.compiled
@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("seed", lanes.first(1, range(4)))
def test_between_any_two_events_everything_holds(seed, phase):
    """Structural failures of the very tick included, and guesses that ran ahead of the clock."""
    sim = kt.Simulation(kt.make_scene("lattice", bodies=9, seed=seed, turns=6), phase)
    for number, _ in enumerate(sim.steps(until=1.5)):
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
    engine = sim._engine
    engine.k.clock[0].calendar.shift += 8
    engine.k.clock[0].calendar.filed = 0
    engine.audit()
    assert engine.k.clock[0].calendar.filed


@pytest.mark.parametrize("phase", PHASES)
def test_after_shifts_of_the_clock_everything_holds(phase):
    scene = kt.Scene([[0.5, 0.5], [0.25, 0.125]], [[1e-4, 0.0], [0.0, 2e-4]], 0.0625, arena=(1.0, 1.0))
    sim = kt.Simulation(scene, phase)
    for until in (500.0, 1100.0, 1700.0, 2500.0, 9000.0):
        sim.run(until=until)
        sim.audit()
    assert sim.readings.contacts_wall > 1


# The calendar


def filed(found: Engine) -> int:
    """Return a slice of the calendar in which bodies stand."""
    return int(np.flatnonzero(found.k.links.next[len(found.k.bodies) :] < len(found.k.bodies))[0])


def bit(at: int) -> np.int64:
    """Return the bit of a slice in its word of marks."""
    return np.uint64(1 << (at & 63)).astype(np.int64)


def unfile(found: Engine, at: int) -> int:
    """Empty a slice; return who stood there first."""
    ring = len(found.k.bodies) + at
    body = int(found.k.links[ring].next)
    found.k.links[ring].next = found.k.links[ring].prev = ring
    found.k.marks[at >> 6] &= ~bit(at)
    return body


def test_a_mark_of_the_calendar():
    found = engine()
    found.k.marks[:] = 0
    with pytest.raises(AuditError, match=r"the mark of slice \d+ of the calendar is not true"):
        found.audit()


def test_the_number_of_bodies_in_the_calendar():
    found = engine()
    found.k.counts[0].queued -= 1
    with pytest.raises(
        AuditError, match="4 bodies stand in the calendar, and 4 await something; 3 are count"
    ):
        found.audit()


def test_a_body_that_stands_in_the_wrong_slice():
    found = engine()
    at = filed(found)
    body = unfile(found, at)
    other = at ^ 1
    assert int(found.k.links[4 + other].next) == 4 + other
    found.k.links[4 + other].next = found.k.links[4 + other].prev = body
    found.k.links[body].next = found.k.links[body].prev = 4 + other
    found.k.marks[other >> 6] |= bit(other)
    with pytest.raises(AuditError, match=r"body \d stands in slice \d+ of the calendar, where it does not"):
        found.audit()


def test_a_list_that_is_read_backwards():
    found = engine()
    found.k.links[first(found)].prev = 3
    with pytest.raises(AuditError, match=r"slice \d+ of the calendar cannot be read backwards at body \d"):
        found.audit()


def test_a_ring_out_of_order():
    found = engine()
    k = found.k
    k.clock[0].calendar.shift = 54  # all bodies in one slice
    k.clock[0].calendar.filed = 0
    found.build()
    at = filed(found)
    ring, links = 4 + at, k.links
    one = int(links[ring].next)
    two = int(links[one].next)
    three = int(links[two].next)
    links[ring].next, links[two].next, links[one].next = two, one, three
    links[two].prev, links[one].prev, links[three].prev = ring, two, one
    said = rf"slice {at} of the calendar is out of order: body {two} stands before body {one}"
    with pytest.raises(AuditError, match=said):
        found.audit()


def test_a_list_that_ends_elsewhere():
    found = engine()
    found.k.links[4 + filed(found)].prev += 1
    with pytest.raises(AuditError, match=r"slice \d+ of the calendar does not come back to where it began"):
        found.audit()


def test_a_body_that_is_lost_from_the_calendar():
    found = engine()
    unfile(found, filed(found))
    with pytest.raises(AuditError, match=r"\d bodies stand in the calendar, and 4 await something"):
        found.audit()


def test_the_slice_in_which_the_head_is_sought():
    found = engine()
    found.k.clock[0].calendar.slice += 1 << 9
    with pytest.raises(AuditError, match="a body is filed before the slice in which the head is sought"):
        found.audit()


# The entries


def test_a_body_that_is_filed_too_late():
    found = engine()
    refile(found, first(found), 2**60, PAIR)
    with pytest.raises(AuditError, match=r"body \d is filed at tick \d+, but what it awaits comes at tick"):
        found.audit()


def test_a_body_that_is_filed_as_something_else():
    found = engine()
    found.k.queue[first(found)].kind = STRUCTURAL
    with pytest.raises(AuditError, match=r"what awaits body \d is filed as of kind 0, and is of kind \d"):
        found.audit()


def test_a_guard_before_the_first_contact():
    found = engine()
    found.k.queue[first(found)].guard = int(found.k.queue[first(found)].tick) - 1
    with pytest.raises(AuditError, match=r"body \d has a contact before its first one"):
        found.audit()


def test_a_place_at_the_common_clock():
    found = engine()
    found.k.places[2].y += 2.0**-50
    with pytest.raises(AuditError, match="the place of body 2 at the common clock is not that of its plan"):
        found.audit()


# What the entries say of contacts


def test_the_time_of_a_contact_of_two_bodies():
    found = engine()
    body = first(found)
    entry = found.k.queue[body]
    assert entry.kind == PAIR
    entry.tick += 1
    refile(found, body, int(entry.tick), PAIR)
    with pytest.raises(
        UnawaitedContactError, match=r"bodies 0 and 1 is awaited at tick \d+, but by their pl"
    ):
        found.audit()


def test_a_guess_that_is_late():
    found = engine()
    body = first(found)
    entry = found.k.queue[body]
    entry.tick += 1
    entry.exact = 0
    refile(found, body, int(entry.tick), GUESS)
    with pytest.raises(
        UnawaitedContactError, match=r"0 and 1 is awaited at tick \d+ at the earliest, but by"
    ):
        found.audit()


def test_a_plan_that_was_changed_behind_the_kernels_back():
    found = engine()
    found.k.bodies[0].vx = 0.25
    with pytest.raises(AuditError, match="the place of body 0 at the common clock"):
        found.audit()


def forget(found: Engine, body: int) -> None:
    """Let a body know nothing of contacts."""
    entry = found.k.queue[body]
    entry.tick = entry.guard = NEVER
    entry.partner = NOBODY
    refile(found, body, NEVER, STRUCTURAL)


def test_a_contact_that_nobody_awaits():
    sim = kt.Simulation(kt.Scene([[0.0, 0.0], [4.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]], 0.5), "naive")
    sim.build()
    for body in (0, 1):
        forget(sim._engine, body)
    with pytest.raises(UnawaitedContactError, match=r"bodies 0 and 1 is awaited never at the earliest, but"):
        sim.audit()


def test_a_guard_behind_which_a_contact_comes():
    """Three discs in a row: what the middle one knows of the later contact is its guard."""
    position = [[0.0, 0.0], [2.0, 0.0], [5.0, 0.0]]
    sim = kt.Simulation(kt.Scene(position, [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0]], 0.5), "naive")
    assert sim.next_event is not None
    forget(sim._engine, 2)
    sim.audit()  # the middle one covers both
    entry = sim._engine.k.queue[1]
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
    found = sim._engine
    forget(found, 0)
    forget(found, 2)
    entry = found.k.queue[1]
    entry.tick = entry.guard = 1 << 52
    entry.partner, entry.seen, entry.exact = 2, found.k.bodies[2].stamp, 1
    refile(found, 1, 1 << 52, PAIR)
    with pytest.raises(UnawaitedContactError, match=r"bodies 0 and 1 are looked at too late, but by their"):
        sim.audit()


def test_the_time_of_a_contact_with_a_wall():
    found = engine()
    entry = found.k.queue[3]
    assert entry.kind != PAIR
    entry.wall = 77
    refile(found, 3, 77, 3)
    with pytest.raises(
        UnawaitedContactError, match="body 3 and a wall is awaited at tick 77, but by its plan"
    ):
        found.audit()


def test_a_wall_that_comes_before_a_body_is_looked_at():
    found = engine()
    found.k.queue[3].wall = NEVER
    refile(found, 3, int(found.k.queue[3].tick), GUESS if found.k.queue[3].tick != NEVER else STRUCTURAL)
    with pytest.raises(
        UnawaitedContactError, match=r"body 3 is looked at .* at the earliest, but by its plan"
    ):
        found.audit()


def test_an_audit_blames_nobody():
    """A narrow phase that reports an overlap while it is asked again leaves no fault behind."""
    found = engine()
    found.k.bodies[0].x += 0.1
    found.k.places[0].x += 0.1
    with pytest.raises(AuditError):
        found.audit()
    assert found.k.clock[0].fault.code == 0


# Who is near


@pytest.mark.interpreted
def test_two_bodies_that_touch_and_are_no_candidates():
    position = [[0.25, 0.5], [0.5, 0.5]]
    sim = kt.Simulation(kt.Scene(position, np.zeros((2, 2)), 0.125, arena=(1.0, 1.0)), "all-pairs")
    sim._engine.build()
    remove_pair(sim._engine.k, 0, 1)
    with pytest.raises(AuditError, match=r"bodies 0 and 1 touch \(gap 0\) and are not a candidate pair"):
        sim._engine.audit()


@pytest.mark.interpreted
def test_who_is_near_one_side_only():
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "one-sided")
    with pytest.raises(AuditError, match="body 1 is near body 0, but body 0 is not near body 1"):
        sim.audit()


# The pair set


@pytest.mark.small
def test_the_number_of_pairs():
    found = engine("all-pairs")
    found.k.clock[0].lists.pairs += 1
    with pytest.raises(AuditError, match="there are 6 pairs in the pair set, but the kernel counts 7"):
        found.audit()


@pytest.mark.small
def test_the_lookup():
    found = engine("all-pairs")
    found.k.lookup[:] = -1
    with pytest.raises(AuditError, match="the lookup does not hold each of the 6 pairs of the pair set once"):
        found.audit()


@pytest.mark.small
def test_the_lists_of_the_bodies():
    found = engine("all-pairs")
    found.k.firsts[3] = np.flatnonzero((found.k.pairs.a == 0) & (found.k.pairs.b == 1))[0]
    with pytest.raises(AuditError, match=r"the list of body 3 has the pair \(0, 1\) in it"):
        found.audit()
    found = engine("all-pairs")
    found.k.firsts[0] = -1
    with pytest.raises(AuditError, match=r"the bodies' lists have \d+ entries for 6 pairs"):
        found.audit()


@pytest.mark.small
def test_the_lists_read_backwards():
    found = engine("all-pairs")
    live = np.flatnonzero(found.k.pairs.a >= 0)
    found.k.pairs.prev_a[live] = -1
    found.k.pairs.prev_b[live] = -1
    with pytest.raises(AuditError, match=r"the list of body \d cannot be read backwards"):
        found.audit()


@pytest.mark.small
def test_the_free_records():
    found = engine("all-pairs")
    found.k.clock[0].lists.free = -1
    with pytest.raises(AuditError, match="of 100 records of the pair set 6 are taken and 0 free"):
        found.audit()
