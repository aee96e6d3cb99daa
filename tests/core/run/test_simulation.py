"""Simulation: what its public names promise."""

import math
from concurrent.futures import ThreadPoolExecutor
from time import sleep

import numpy as np
import pytest

import kinetile as kt
from agreement import assert_one_answer
from kinetile.errors import PhaseError
from kinetile.kernel.compiled import NOTHING_IS_COMPILED
from kinetile.run.compose import CALLED_WITH, CommandSupport, compose_phases
from kinetile.run.simulation import composition_of
from lanes import SHARED
from registering import registered


def grid(bodies: int = 9, seed: int = 1, **more) -> kt.Scene:
    return kt.make_scene("grid", bodies=bodies, density=0.5, seed=seed).replace(**more)


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


def test_a_body_that_flies_for_ever_is_anchored_anew_and_still_met():
    scene = kt.Scene([[0, 0], [10, 0.1], [0.5, 30.0]], [[1e-2, 0], [0, 0], [0, 0]], 0.5)
    sim = assert_one_answer(scene, until=5_000.0)
    assert len(sim.contacts) == 1
    assert sim.contacts[0]["time"] == pytest.approx((10 - np.sqrt(1 - 0.01)) / 1e-2, rel=1e-12)


@pytest.mark.compiled
def test_tables_grow_without_the_user_noticing():
    n = 70  # sap-1d needs hundreds of pairs, the tables begin with 344
    rng = np.random.default_rng(2)
    position = np.column_stack([rng.uniform(0.5, 3.5, n), np.arange(n) + 0.5])
    velocity = rng.normal(size=(n, 2))
    scene = kt.Scene(position, velocity, 0.25, arena=(4.0, float(n)))
    assert_one_answer(scene, max_contacts=1000)
    sim = kt.Simulation(scene, "sap-1d", narrow_phases=SHARED)
    sim.run(max_contacts=1000)
    assert sim.readings.pairs_max > 4 * n + 64
    assert len(sim.tables.pairs) >= sim.readings.pairs_max


def test_phases_follow_from_the_scene_unless_named():
    assert kt.Simulation(grid()).narrow_phases == ("disc", "wall")
    scene = kt.Scene([[0.0, 0.0]], [[1.0, 0.0]], 0.5)
    assert kt.Simulation(scene).narrow_phases == ("disc",)
    settings = kt.Settings(broad_phase="sap-1d", options={"sap-1d": {"axis": "y"}})
    sim = kt.Simulation(grid(settings=settings))
    assert (sim.broad_phase, dict(sim.options)) == ("sap-1d", {"axis": "y"})
    assert kt.Simulation(grid(settings=settings), options={"axis": "x"}).options["axis"] == "x"
    assert kt.Simulation(grid(settings=settings), "naive").options == {}


def test_a_narrow_phase_must_be_what_its_spec_says():
    class Confused:
        def prepare(self, scene):
            return kt.registry().target("narrow phase", "wall")().prepare(scene)

    said = "returned WallParts, not PairParts, as its role 'pair' has it"
    scene = kt.make_scene("grid", bodies=4)
    spec = kt.NarrowPhaseSpec("confused", Confused, role="pair")
    with registered(spec), pytest.raises(PhaseError, match=said):
        kt.Simulation(scene, "naive", narrow_phases=["confused", "wall"])


EXPLAINED = {
    "PAIRS": "contacts of two bodies (",
    "WALLED": "walls around",
    "PERIODIC": "images: ",
    "ACCELERATIONS": "on chords",
    "UNEQUAL": "accelerations up to",
    "RULES": "responses by kind",
    "PASSINGS": "pass, ",
    "COMMANDS": "commands: ",
}
"""Words of the line about a feature; without a line are those that change no answer."""


def test_explain_names_what_is_left_out():
    told = kt.Simulation(grid()).explain()
    assert any("four walls" in line for line in told["modelled"])
    assert any("turns" in line for line in told["left out"])
    assert any("masses: all are equal" in line for line in told["left out"])
    assert told["numbers"]["skin_in_radii"] < 1e-6
    plain = grid(4)
    uneven = kt.Scene(plain.position, plain.velocity, plain.radius, [1.0, 2.0, 3.0, 4.5], plain.arena)
    assert "masses from 1.0 to 4.5" in kt.Simulation(uneven).explain()["modelled"]
    coming = kt.Simulation(kt.make_scene("galton", rows=2, balls=1)).explain()
    assert "masses from 1.0 to inf" in coming["modelled"]  # it was: all are equal, those of the pegs
    pegs = kt.Scene(plain.position, np.zeros((4, 2)), 0.05, math.inf, plain.arena, gravity=(0.0, -1.0))
    by_hand = kt.Simulation(pegs, live=True).explain()["modelled"][0]
    assert "flying with accelerations up to [0.0, 1.0]" in by_hand  # it was: the acceleration [0.0, 0.0]
    passing = plain.replace(responses={("*", "*"): "pass"}, periodic="xy")
    for scene in (plain, passing, kt.make_scene("galton", rows=2, balls=1), plain.replace(arena=None)):
        sim = kt.Simulation(scene)
        said = "\n".join(sim.explain()["modelled"])
        for name, value in composition_of(sim).features(CommandSupport.of(scene)).items():
            assert name not in EXPLAINED or (EXPLAINED[name] in said) == bool(value), name


def test_a_loop_has_no_hooks_that_it_never_calls():
    """Functions that these call separately were compiled and loaded with every loop."""
    plain = kt.make_scene("grid", bodies=9)
    touching, passing = {"touch", "touch_wall"}, {("*", "*"): "pass"}
    for more, called in (
        ({}, set()),
        ({"gravity": (0.0, -1.0)}, touching),
        ({"responses": passing}, {*touching, "part"}),
        ({"shapes": [kt.box(0.25, 0.25)], "shape": [0] * 9, "radius": None}, set()),
    ):
        parts = compose_phases(plain.replace(**more), "cells", None, None).parts()
        assert ({*CALLED_WITH} & {*parts}) - {"ledge"} == called, more


@pytest.mark.compiled
def test_runs_in_two_threads_have_the_contacts_of_two_in_a_row():
    in_a_row, at_once = ([kt.Simulation(grid(400, seed), "cells") for seed in (1, 2)] for _ in range(2))
    with ThreadPoolExecutor(2) as pool:
        for each, sims in ((pool.map, at_once), (map, in_a_row)):
            list(each(lambda sim: sim.run(until=1.0), sims))
    assert [sim.fingerprint for sim in at_once] == [sim.fingerprint for sim in in_a_row]
    assert at_once[0].fingerprint != at_once[1].fingerprint


def test_a_run_cannot_be_started_from_within_itself():
    sim = kt.Simulation(grid(9), "sap-1d")
    with pytest.raises(RuntimeError, match="this simulation is running"):
        sim.run(until=1.0, progress=lambda progress: sim.run(until=2.0))
    sim.run(until=1.0)
    assert sim.time == 1.0


@pytest.mark.small
def test_a_run_to_the_present_time_says_once_that_it_does_nothing_and_a_duration_goes_on(caplog):
    sim, other = (kt.Simulation(grid(), "cells") for _ in range(2))
    sim.run(until=0.0)  # at the start contacts and passings may begin
    for _ in range(10):
        sim.run(duration=0.0625)
    sim.run(duration=0.0)
    sim.run(until=0.625, max_contacts=5)
    other.run(until=0.625)
    assert (sim.time, sim.fingerprint) == (other.time, other.fingerprint)
    assert caplog.text == ""
    for _ in range(3):
        sim.run(until=0.625)
    (told,) = caplog.records
    assert told.getMessage().startswith("kinetile: until=0.625 is the present time: nothing is left to run")


@pytest.mark.small
def test_a_command_after_the_scenes_own_end_is_told(caplog):
    """It never happened, without a word. A recording, and a run to another end, mean the omitted part."""
    scene = grid(4).replace(commands=[kt.Remove(0, 2.0)], settings=kt.Settings(until=1.0))
    sim = kt.Simulation(scene, "cells")
    sim.run(max_contacts=0)
    sim.run(until=0.5)
    kt.Simulation(sim.recorded(), "cells").run()
    kt.Simulation(scene, "cells").run(until=2.0)
    kt.Simulation(scene.replace(settings=kt.Settings(until=2.0)), "cells").run()
    assert caplog.text == ""
    sim.run()
    (told,) = caplog.records
    assert told.getMessage().startswith(
        "kinetile: this run goes to 1.0, the scene's end, and its command at 2.0 is later"
    )
    assert len(sim.bodies) == 4


def test_slow_bodies_that_are_turned_to_be_fast_are_not_taken_for_jammed():
    slow = grid(9)
    scene = kt.Scene(slow.position, slow.velocity * 1e-12, slow.radius, slow.mass, slow.arena)
    sim = kt.Simulation(scene, "sap-1d")
    sim.run(until=0.0)
    for body, velocity in enumerate(slow.velocity.tolist()):
        sim.set_velocity(body, tuple(velocity))
    sim.run(max_contacts=9000 if not NOTHING_IS_COMPILED else 50)
    assert sim.time > 0.01


def test_the_time_of_the_last_contact_is_now_however_it_is_rounded():
    for seed in range(6):
        sim = kt.Simulation(grid(9, seed=seed), "sap-1d")
        sim.run(max_contacts=7)
        before = sim.time
        sim.run(until=sim.time)
        assert sim.time == before
        assert len(sim.contacts) >= 7
    sim.run(until=30.3 if not NOTHING_IS_COMPILED else 1.3)
    now = sim.time
    sim.run(max_contacts=0)
    assert sim.time == now


def test_the_cpu_time_to_make_it_ready_was_that_of_the_clock_on_the_wall(monkeypatch):
    sim = kt.Simulation(kt.make_scene("two-discs"), "naive")
    monkeypatch.setattr("kinetile.run.engine.engine.make_ready", lambda *arguments: sleep(0.5))
    assert sim.compile() < 0.25
    assert sim.readings.compile_seconds == sim.compile()
