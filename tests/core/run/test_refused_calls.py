"""A public call that is refused, or comes at the wrong moment, leaves the simulation exactly as it was."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from inside import engine_of
from kinetile.errors import BusyError, PhaseError, Refused
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.toolbox import BroadPhaseParts, Kernel, PairParts, hook
from kinetile_plugins.naive import Naive
from lanes import BUILT_IN, examples
from registering import fixture


class ThinSkinned(Naive):
    """naive, but right only with the skin that a scene begins with."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        parts = super().prepare(scene)
        limit = 1.01 * float(kt.Simulation(scene, "naive").explain()["numbers"]["skin"])
        return BroadPhaseParts(**{**vars(parts), "skin_limit": limit})


class Ghosts:
    def prepare(self, scene: kt.Scene) -> PairParts:
        from kinetile_plugins.disc import Disc

        return PairParts(Disc().prepare(scene).meet, let_pass)


@hook
def let_pass(k: Kernel, a: int, b: int) -> float:
    return 0.0


class Stumbling(Naive):
    """naive, with an ``arrange`` that raises when it is called a second time."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        calls: list[int] = []

        def arrange(k: Kernel, s: object) -> None:
            calls.append(1)
            if len(calls) > 1:
                raise OSError("the second time")

        return BroadPhaseParts(**{**vars(super().prepare(scene)), "arrange": arrange})


_registered = fixture(
    kt.BroadPhaseSpec("thin-skinned", ThinSkinned),
    kt.BroadPhaseSpec("stumbling", Stumbling),
    kt.NarrowPhaseSpec("ghosts", Ghosts, role="pair"),
)


BAD_NUMBERS = st.sampled_from([-1, -(2**31), 9, 10, 63, 64, 2**31, 2**63, 2**70, True, 1.0, 1.5, np.bool_(1)])
CALLS = {
    "remove": lambda sim, body: sim.remove(body),
    "set_velocity": lambda sim, body: sim.set_velocity(body, (0.0, 0.0)),
    "set_velocities": lambda sim, body: sim.set_velocities([0, body], (0.0, 0.0)),
    "next_contact": lambda sim, body: sim.next_contact(0, body),
    "next_contact_of": lambda sim, body: sim.next_contact_of(body),
    "stop at a body": lambda sim, body: sim.run(9.0, stop_at=kt.StopAt(bodies=[body])),
    "stop at a pair": lambda sim, body: sim.run(9.0, stop_at=kt.StopAt(pairs=[(0, body)])),
}


@settings(max_examples=examples(50), deadline=None)
@given(BAD_NUMBERS, st.sampled_from(sorted(CALLS)), st.sampled_from(BUILT_IN), st.booleans(), st.booleans())
def test_a_number_that_no_body_was_given_was_accepted(number, call, phase, live, one_has_gone):
    """In a simulation with room for bodies that come, the slot of a number that was never given counted."""
    sim = kt.Simulation(grid(), phase, live=live)
    sim.run(0.125)
    if one_has_gone:
        sim.remove(4)
        number = 4 if number == 9 else number
    before = sim.snapshot()
    with pytest.raises(IndexError, match="body"):
        CALLS[call](sim, number)
    assert sim.snapshot() == before


INSERTIONS = {
    "overlap": ("there", (0.0, 0.0), 0.01, 1.0, r"into body 3; nothing has changed"),
    "over the wall": ((0.0, 0.5), (0.0, 0.0), 0.01, 1.0, "beyond the left wall"),
    "too large": ((0.5, 0.5), (0.0, 0.0), 2.5, 1.0, "no room for body 9"),
    "fast and overlap": ("there", (400.0, 0.0), 0.01, 1.0, "into body 3"),
    "light and overlap": ("there", (1.0, 0.0), 0.001, 1e-6, "into body 3"),
    "too fast": ((0.5, 0.5), (1e300, 0.0), 0.01, 1.0, "velocity"),
    "no radius": ((0.5, 0.5), (0.0, 0.0), 0.0, 1.0, "radius is 0.0"),
    "less than none": ((0.5, 0.5), (0.0, 0.0), -1.0, 1.0, "radius is -1.0"),
    "nowhere": ((np.nan, 0.5), (0.0, 0.0), 0.01, 1.0, "position is"),
}
"""Place (or where body 3 is), velocity, radius, mass, and what is said."""


@settings(max_examples=examples(20), deadline=None)
@given(
    st.sampled_from(BUILT_IN),
    st.booleans(),
    st.sampled_from(sorted(INSERTIONS)),
    st.sampled_from([0.0, 0.25, 1.0]),
)
def test_a_refused_insertion_changed_skin_structure_and_clock(phase, live, why, until):
    sim = kt.Simulation(grid(), phase, live=live)
    sim.run(until)
    place, *how, said = INSERTIONS[why]
    before, there = sim.snapshot(), tuple(sim.positions()[3])
    with pytest.raises((Refused, ValueError), match=said):
        sim.insert(there if place == "there" else place, *how)
    assert sim.snapshot() == before
    sim.remove(3)
    assert sim.insert(there, (0.0, 0.0), float(sim.scene.radius[3])) == 9, "no number was used"


def grid(bodies: int = 9) -> kt.Scene:
    return kt.make_scene("grid", bodies=bodies, density=0.25, seed=3)


def everything(sim: kt.Simulation) -> tuple:
    tables = [table.tobytes() for table in (*sim.tables, *sim.state)]
    return (*tables, sim.time, sim.exact_time, sim.fingerprint, len(sim.contacts), str(sim.explain()))


REFUSED_CALLS = {
    "a body that is not there": lambda sim: sim.set_velocity(99, (0.0, 0.0)),
    "a velocity of one number": lambda sim: sim.set_velocity(0, (1.0,)),
    "a velocity that is no number": lambda sim: sim.set_velocity(0, ("fast", 0.0)),
    "a velocity that is not finite": lambda sim: sim.set_velocity(0, (np.inf, 0.0)),
    "a velocity too large for a float": lambda sim: sim.set_velocity(0, (10**400, 0)),
    "a velocity too fast for the clock": lambda sim: sim.set_velocity(0, (1e15, 0.0)),
    "a velocity too fast for the skin": lambda sim: sim.set_velocity(0, (1e3, 0.0)),
    "a time that is past": lambda sim: sim.run(until=0.1),
    "a time too large for a float": lambda sim: sim.run(until=10**400),
    "a time that is not finite": lambda sim: sim.run(until=np.nan),
    "a time that is no number": lambda sim: sim.run(until="soon"),
    "a run without an end": lambda sim: sim.run(),
    "a negative number of contacts": lambda sim: sim.run(max_contacts=-1),
    "a broken number of contacts": lambda sim: sim.run(max_contacts=1.5),
    "a negative number of events": lambda sim: sim.run(max_events=-1),
    "steps into the past": lambda sim: next(sim.steps(until=0.1)),
    "contacts since before the first": lambda sim: sim.contacts_since(-1),
}


@settings(max_examples=examples(30), deadline=None)
@given(st.lists(st.sampled_from(sorted(REFUSED_CALLS)), min_size=1, max_size=4))
def test_a_refused_call_changed_the_simulation(names):
    sim = kt.Simulation(grid(), "thin-skinned", turning=True)
    sim.run(until=0.3)
    before = everything(sim)
    for name in names:
        with pytest.raises((ValueError, IndexError, TypeError)) as refusal:
            REFUSED_CALLS[name](sim)
        assert not isinstance(refusal.value, OverflowError)
        assert everything(sim) == before, name
    sim.run(until=0.6)
    untouched = kt.Simulation(grid(), "naive", turning=True)
    untouched.run(until=0.6)
    assert sim.fingerprint == untouched.fingerprint


def test_an_empty_scene_took_for_ever_to_reach_a_late_time():
    nobody = kt.Scene(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0))
    for until in (1e300, 0.5e4, 511.5, 512.0, 1024.0, 3.0):
        sim = kt.Simulation(nobody, "naive")
        sim.run(until=until)
        assert sim.time == until
        assert list(sim.steps(until=until)) == []
    sim.run(until=1e200)
    assert sim.time == 1e200


@pytest.mark.interpreted
def test_a_phase_that_failed_while_it_was_built_anew_was_gone_on_with():
    sim = kt.Simulation(grid(), "stumbling")
    sim.run(until=0.1)
    with pytest.raises(PhaseError, match="the second time"):
        sim.rebuild()
    for again in (lambda: sim.run(until=1.0), sim.step, lambda: sim.set_velocity(0, (0.0, 0.0)), sim.audit):
        with pytest.raises(PhaseError, match=r"this simulation cannot go on: .*the second time"):
            again()


def test_a_recorder_that_looked_ahead_ran_the_loop_within_the_loop():
    sim = kt.Simulation(kt.make_scene("grid", bodies=9), "naive")
    with pytest.raises(BusyError, match="cannot look ahead from its own recorder"):
        sim.run(until=1.0, recorder=lambda rows: sim.next_event)
    other = kt.Simulation(kt.make_scene("grid", bodies=9), "naive")
    seen = []
    other.run(until=1.0, progress=lambda how: seen.append(other.next_event))
    assert len(seen) > 0


def test_candidate_pairs_were_written_where_a_run_in_another_thread_has_its_own():
    sim = kt.Simulation(kt.make_scene("grid", bodies=9), "naive")
    sim.build()
    engine_of(sim).k.near[:] = 77
    assert len(sim.candidate_pairs()) == 36
    assert (engine_of(sim).k.near == 77).all()


def test_a_recorder_that_turns_a_body_is_refused():
    sim = kt.Simulation(grid(), "sap-1d", turning=True)
    with pytest.raises(BusyError, match=r"cannot turn a body from its own recorder"):
        sim.run(until=1.0, recorder=lambda rows: sim.set_velocity(0, (0.0, 0.0)))
    for call in (sim.step, sim.rebuild, lambda: sim.run(until=2.0)):
        with pytest.raises(BusyError):
            sim.run(until=sim.time + 0.5, recorder=lambda rows, call=call: call())
    other = kt.Simulation(grid(), "naive", turning=True)
    sim.run(until=2.5)
    other.run(until=2.5)
    assert sim.fingerprint == other.fingerprint


def test_a_turn_from_a_second_thread_during_a_run_was_taken_for_a_missed_contact():
    sim, said = kt.Simulation(grid(), "sap-1d", turning=True), []

    def disturb() -> None:
        for call in (lambda: sim.set_velocity(0, (0.5, 0.0)), sim.step, lambda: sim.run(until=99.0)):
            with pytest.raises(BusyError):
                call()
            said.append(call)

    with ThreadPoolExecutor(1) as pool:
        sim.run(until=0.1, progress=lambda so_far: pool.submit(disturb).result())
    assert len(said) > 0 == len(said) % 3


@pytest.mark.compiled
def test_asking_for_contacts_copied_all_that_there_had_been():
    sim = kt.Simulation(kt.make_scene("grid", bodies=100, density=0.5, seed=1), "cells")
    sim.run(max_contacts=3_000)
    seen = sim.contacts
    copied = 0
    for _ in range(50):
        sim.run(max_contacts=1)
        copied += not np.shares_memory(sim.contacts, seen)
        seen = sim.contacts
    assert copied <= 1  # once where there is no room left, which then doubles
    assert sim.contacts_since(len(seen) - 3).tolist() == seen[-3:].tolist()
    assert len(sim.contacts_since(10**9)) == 0


def test_contacts_that_were_handed_out_change_while_the_run_goes_on():
    sim = kt.Simulation(grid(), "naive")
    kept = []
    for _ in range(60):
        sim.run(max_contacts=3)
        kept.append((sim.contacts, sim.contacts.tobytes()))
    assert all(contacts.tobytes() == then for contacts, then in kept)
    assert np.array_equal(np.concatenate([kept[0][0], sim.contacts_since(3)]), sim.contacts)


@pytest.mark.interpreted
def test_the_broad_phase_was_blamed_for_a_narrow_phase_that_lets_bodies_pass():
    scene = kt.make_scene("grid", bodies=16, density=0.5, seed=1)
    sim = kt.Simulation(scene, "naive", narrow_phases=["ghosts", "wall"])
    with pytest.raises(PhaseError, match=r"no contact of theirs has been missed: narrow phase 'ghosts'"):
        sim.run(until=30.0 if not NOTHING_IS_COMPILED else 5.0)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("form", [np.float16, np.float32, np.longdouble])
def test_numbers_of_other_widths_warned_of_a_cast_that_overflows(form):
    """Bounds of lengths are doubles that narrower floats cannot hold; a wider one may hold more."""
    scene = kt.Scene([[0.2, 0.2], [0.6, 0.6]], [[1.0, 0.0], [0.0, 1.0]], 0.125, arena=(form(1), form(1)))
    sim = kt.Simulation(scene, "cells", live=True)
    half = form(0.5)
    sim.set_velocities([0, 1], np.array([[half, half], [half, half]]))
    sim.insert((form(0.875), form(0.125)), (half, half), form(0.0625), mass=form(1))
    assert sim.bodies_near((half, half), radius=half).tolist() == [1, 0, 2]
    assert len(sim.ray((form(0), half), (half, form(0)), within=form(1))) >= 0
    assert sim.cast((half, form(0.875), form(0.0625)), (half, half)) is None
    assert kt.box(half, half).reach > 0.0
    if form is np.longdouble:
        with pytest.raises(ValueError, match="a velocity is two finite numbers"):
            sim.set_velocities([0], np.array([[half, form(10) ** form(400)]]))
