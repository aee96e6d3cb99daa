"""Simulation: what its public names promise."""

import os
import subprocess
import sys
from time import sleep

import numpy as np
import pytest

import kinetile as kt
from agreement import PHASES, agree, assert_one_answer
from kinetile.errors import PhaseError
from kinetile.kernel.compiled import INTERPRETED
from lanes import first
from registering import registered


def grid(bodies: int = 9, seed: int = 1, **more) -> kt.Scene:
    scene = kt.make_scene("grid", bodies=bodies, density=0.5, seed=seed)
    return kt.Scene(scene.position, scene.velocity, scene.radius, scene.mass, scene.arena, **more)


@pytest.mark.compiled
@pytest.mark.parametrize(("phase", "options"), PHASES)
def test_running_on_is_the_same_as_running_through(phase, options):
    through = kt.Simulation(grid(), phase, options=options)
    through.run(until=2.0)
    pieces = kt.Simulation(grid(), phase, options=options)
    for time in (0.0, 0.3, 0.3, 1.0, 1.25):
        pieces.run(until=time)
        assert pieces.time == time
    pieces.run(max_contacts=7)
    assert pieces.time == pieces.contacts[-1]["time"]
    pieces.run(until=2.0)
    assert pieces.fingerprint == through.fingerprint
    assert (pieces.contacts == through.contacts).all()
    assert (pieces.positions() == through.positions()).all()
    assert (pieces.velocities() == through.velocities()).all()


def test_contacts_are_in_canonical_form():
    sim = kt.Simulation(grid(), "sap-1d")
    sim.run(until=1.0)
    contacts = sim.contacts
    assert contacts.dtype == kt.CONTACT
    assert (np.diff(contacts["epoch"] * 2.0**52 + contacts["tick"]) >= 0).all()
    discs = contacts["b"] >= 0
    assert (contacts["a"][discs] < contacts["b"][discs]).all()
    assert set(contacts["b"][~discs].tolist()) <= {-1, -2, -3, -4}
    exact = (contacts["epoch"] + contacts["tick"] * 2.0**-52) * sim.time_unit
    assert (contacts["time"] == exact).all()
    readings = sim.readings
    assert readings.contacts == len(contacts)
    assert readings.contacts_disc == discs.sum()
    assert readings.contacts_wall == (~discs).sum()
    assert readings.events == len(contacts) + readings.structural_events


@pytest.mark.compiled
def test_the_fingerprint_does_not_see_the_start_of_the_clock():
    zero = kt.Simulation(grid(), "sap-1d")
    zero.run(until=2.0)
    late = kt.Simulation(grid(start=2.0**40), "sap-1d")
    late.run(until=2.0**40 + 2.0)
    assert late.fingerprint == zero.fingerprint
    assert (late.positions() == zero.positions()).all()
    assert late.contacts[0]["time"] == 2.0**40 + zero.contacts[0]["time"]


def test_a_body_that_flies_for_ever_is_anchored_anew_and_still_met():
    scene = kt.Scene([[0, 0], [10, 0.1], [0.5, 30.0]], [[1e-3, 0], [0, 0], [0, 0]], 0.5)
    sim = assert_one_answer(scene, until=50_000.0)
    assert len(sim.contacts) == 1
    assert sim.contacts[0]["time"] == pytest.approx((10 - np.sqrt(1 - 0.01)) / 1e-3, rel=1e-12)


@pytest.mark.parametrize(("phase", "options"), PHASES)
def test_set_velocity_is_a_turn_now(phase, options):
    def play(sim):
        sim.run(until=0.2)
        before = sim.positions()
        sim.set_velocity(3, (0.0, 40.0))  # far above any speed so far: the skin must follow
        assert (sim.velocities()[3] == (0.0, 40.0)).all()
        assert (sim.positions() == before).all()
        sim.run(until=0.3)
        assert sim.readings.turns == 1
        assert sim.readings.energy_drift < 1e-13

    axis = f":axis={options['axis']}" if options else ""
    agree(grid(9), "naive", phase + axis, play=play)


def test_a_turn_made_by_hand_goes_before_those_to_come():
    turns = [(3, 0.5, (0.0, 2.0)), (3, 0.75, (0.0, -2.0))]
    sim = kt.Simulation(grid(turns=turns), "sap-2d")
    sim.run(until=0.5)
    sim.set_velocity(3, (0.0, 0.0))
    sim.set_velocity(4, (0.0, 0.0))
    assert sim.readings.turns == 3
    assert not sim.velocities()[3].any()
    sim.run(until=1.0)
    assert sim.readings.turns == 4


@pytest.mark.parametrize(("phase", "options"), first(1, PHASES))
def test_candidate_pairs_hold_all_that_touch(phase, options):
    sim = kt.Simulation(grid(), phase, options=options)
    for time in (0.0, 0.4, 0.8):
        pairs = sim.candidate_pairs() if time == 0.0 else None
        sim.run(until=time)
        pairs = sim.candidate_pairs()
        assert pairs.shape[1] == 2
        assert (pairs[:, 0] < pairs[:, 1]).all()
        assert (np.lexsort((pairs[:, 1], pairs[:, 0])) == np.arange(len(pairs))).all()
        at = sim.positions()
        apart = np.abs(at[:, None] - at[None]) - 2 * sim.scene.radius[0]
        box = np.argwhere(np.triu((apart <= 0).all(axis=2), 1))
        assert {tuple(p) for p in box} <= {tuple(p) for p in pairs}
        if phase == "sap-2d":
            assert {tuple(p) for p in box} == {tuple(p) for p in pairs}


@pytest.mark.compiled
def test_tables_grow_without_the_user_noticing():
    n = 70  # sap-1d needs hundreds of pairs, the tables begin with 344
    rng = np.random.default_rng(2)
    position = np.column_stack([rng.uniform(0.5, 3.5, n), np.arange(n) + 0.5])
    velocity = rng.normal(size=(n, 2))
    scene = kt.Scene(position, velocity, 0.25, arena=(4.0, float(n)))
    assert_one_answer(scene, max_contacts=1000)
    sim = kt.Simulation(scene, "sap-1d")
    sim.run(max_contacts=1000)
    assert sim.readings.pairs_max > 4 * n + 64
    assert len(sim.tables.pairs) >= sim.readings.pairs_max


@pytest.mark.slow
@pytest.mark.parametrize(
    "phase", ["sap-1d", *(pytest.param(each, marks=pytest.mark.slow) for each in ("naive", "sap-2d"))]
)
def test_another_process_compiled_or_interpreted_gives_the_same_fingerprint(phase):
    sim = kt.Simulation(grid(), phase)
    sim.run(until=0.4)
    program = (
        "import kinetile as kt; s = kt.make_scene('grid', bodies=25, density=0.5, seed=1);"
        f"sim = kt.Simulation(s, '{phase}'); sim.run(until=0.4); print(sim.fingerprint)"
    )
    for interpreted in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": interpreted}
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", program],
            env=environment,
            capture_output=True,
            text=True,
            timeout=600,
            check=True,
        )
        assert done.stdout.strip() == sim.fingerprint


@pytest.mark.compiled
def test_progress_is_told():
    told = []
    sim = kt.Simulation(grid(100), "sap-1d")
    sim.run(until=3.0, progress=told.append)
    assert told[-1].time == 3.0
    assert told[-1].contacts == len(sim.contacts)
    assert [p.events for p in told] == sorted(p.events for p in told)


def test_without_contacts_there_is_still_a_fingerprint():
    kept = kt.Simulation(grid())
    kept.run(until=1.0)
    sim = kt.Simulation(grid(), keep_contacts=False)
    sim.run(until=1.0)
    assert sim.fingerprint == kept.fingerprint


def test_phases_follow_from_the_scene_unless_named():
    assert kt.Simulation(grid()).narrow_phases == ("disc", "wall")
    scene = kt.Scene([[0.0, 0.0]], [[1.0, 0.0]], 0.5)
    assert kt.Simulation(scene).narrow_phases == ("disc",)
    settings = kt.Settings(broad_phase="sap-1d", options={"sap-1d": {"axis": "y"}})
    sim = kt.Simulation(grid(settings=settings))
    assert (sim.broad_phase, dict(sim.options)) == ("sap-1d", {"axis": "y"})
    assert kt.Simulation(grid(settings=settings), options={"axis": "x"}).options["axis"] == "x"
    assert kt.Simulation(grid(settings=settings), "naive").options == {}


def test_without_the_disc_phase_bodies_pass_through_each_other():
    sim = kt.Simulation(grid(), narrow_phases=["wall"])
    sim.run(until=1.0)
    assert sim.readings.contacts_disc == 0
    assert sim.readings.contacts_wall > 0


def test_a_narrow_phase_must_be_what_its_spec_says():
    class Confused:
        def prepare(self, scene):
            return kt.registry().target("narrow phase", "wall")().prepare(scene)

    said = "returned WallParts, not PairParts, as its role 'pair' has it"
    scene = kt.make_scene("grid", bodies=4)
    spec = kt.NarrowPhaseSpec("confused", Confused, role="pair")
    with registered(spec), pytest.raises(PhaseError, match=said):
        kt.Simulation(scene, "naive", narrow_phases=["confused", "wall"])


def test_explain_names_what_is_left_out():
    told = kt.Simulation(grid()).explain()
    assert any("four walls" in line for line in told["modelled"])
    assert any("turns" in line for line in told["left out"])
    assert any("masses: all are equal" in line for line in told["left out"])
    assert told["numbers"]["skin_in_radii"] < 1e-6
    plain = grid(4)
    uneven = kt.Scene(plain.position, plain.velocity, plain.radius, [1.0, 2.0, 3.0, 4.5], plain.arena)
    assert "masses from 1.0 to 4.5" in kt.Simulation(uneven).explain()["modelled"]


def test_a_turn_made_while_a_run_is_recorded_stays_in_the_record():
    chunks = []
    sim = kt.Simulation(grid(9), "sap-1d", turning=True)
    turned = []

    def turn_once(progress):
        if not turned:
            turned.append(progress.time)
            sim.set_velocity(2, (0.5, 0.5))

    sim.run(max_contacts=40, recorder=chunks.append, progress=turn_once)
    sim.run(max_contacts=40, recorder=chunks.append)
    rows = np.concatenate(chunks)
    assert (rows["b"] == -5).sum() == 1
    assert (rows["b"] > -5).sum() == len(sim.contacts)


def test_a_run_cannot_be_started_from_within_itself():
    sim = kt.Simulation(grid(9), "sap-1d")
    with pytest.raises(RuntimeError, match="this simulation is running"):
        sim.run(until=1.0, progress=lambda progress: sim.run(until=2.0))
    sim.run(until=2.0)
    assert sim.time == 2.0


def test_slow_bodies_that_are_turned_to_be_fast_are_not_taken_for_jammed():
    slow = grid(9)
    scene = kt.Scene(slow.position, slow.velocity * 1e-12, slow.radius, slow.mass, slow.arena)
    sim = kt.Simulation(scene, "sap-1d")
    sim.run(until=0.0)
    for body, velocity in enumerate(slow.velocity.tolist()):
        sim.set_velocity(body, tuple(velocity))
    sim.run(max_contacts=9000 if not INTERPRETED else 50)
    assert sim.time > 0.01


def test_the_time_of_the_last_contact_is_now_however_it_is_rounded():
    for seed in range(12):
        sim = kt.Simulation(grid(9, seed=seed), "sap-1d")
        sim.run(max_contacts=7)
        before = sim.time
        sim.run(until=sim.time)
        assert sim.time == before
        assert len(sim.contacts) >= 7
    sim.run(until=30.3 if not INTERPRETED else 1.3)
    now = sim.time
    sim.run(max_contacts=0)
    assert sim.time == now


def test_the_cpu_time_to_make_it_ready_was_that_of_the_clock_on_the_wall(monkeypatch):
    sim = kt.Simulation(kt.make_scene("two-discs"), "naive")
    monkeypatch.setattr("kinetile.run.engine.engine.make_ready", lambda *arguments: sleep(0.5))
    assert sim.compile() < 0.25
    assert sim.readings.compile_seconds == sim.compile()
