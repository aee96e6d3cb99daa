"""Snapshots, copies, files: a run goes on to the same bits, under its own phase and under another."""

from __future__ import annotations

import copy
import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded

import kinetile as kt
import saved_runs
from kinetile.errors import Refused
from kinetile.kernel.compiled import INTERPRETED
from lanes import BUILT_IN


def lively(name: str) -> kt.Simulation:
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=1), name, live=True)
    sim.run(0.2)
    sim.remove(3)
    sim.set_velocity(4, (1.0, 0.5))
    sim.run(max_contacts=1)
    return sim


def ways(sim, path):
    """Every way in which a simulation can be saved and taken up."""
    sim.save(path)
    other = kt.Simulation(sim.scene, sim.broad_phase)
    other.restore(sim.snapshot())
    return [copy.copy(sim), copy.deepcopy(sim), pickle.loads(pickle.dumps(sim)), kt.resume(path), other]


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_way_goes_on_to_the_same_bits(tmp_path, name):
    sim = lively(name)
    there = sim.snapshot()
    taken_up = ways(sim, tmp_path / "s.kt")
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


def test_another_phase_goes_on_to_the_same_contacts(tmp_path):
    """Each phase hands over to the next: to itself and to one of another structure."""
    hand_over(tmp_path, lambda at: (BUILT_IN[at], BUILT_IN[(at + 1) % len(BUILT_IN)]))


@pytest.mark.slow
def test_every_phase_goes_on_from_every_other(tmp_path):
    hand_over(tmp_path, lambda at: BUILT_IN)


def hand_over(folder: Path, others) -> None:
    for at, name in enumerate(BUILT_IN):
        sim = lively(name)
        sim.save(folder / "s.kt")
        sim.run(0.5)
        for other in others(at):
            again = kt.resume(folder / "s.kt", other)
            assert again.broad_phase == other
            again.run(0.5)
            assert again.fingerprint == sim.fingerprint
            assert again.positions().tobytes() == sim.positions().tobytes()
            assert again.bodies.tolist() == sim.bodies.tolist()


def prepared(case, folder: Path, number: int) -> tuple[list[dict], dict] | None:
    """Run a case up to where it is saved, and on to its end; return what another process is to run, once
    under its own phase and once under another, and the outcome. None where there is nothing to be saved."""
    try:
        sim = kt.Simulation(case["scene"], case["phase"], live=case["live"], keep_contacts=case["keep"])
        other = kt.Simulation(case["scene"], case["other"])
    except Refused:
        return None
    if saved_runs.carry_out(sim, case["before"], None):
        return None
    path = str(folder / f"{number}.kt")
    sim.save(path)
    snapshot = sim.snapshot()
    whole = saved_runs.outcome(sim, case["after"])
    sim.restore(snapshot)
    assert sim.snapshot() == snapshot
    assert saved_runs.outcome(sim, case["after"]) == whole
    asked = [{"file": path, "broad_phase": name, "plan": case["after"]} for name in (None, other.broad_phase)]
    return asked, whole


def in_another_process(asked: list[dict]) -> list[dict]:
    tests = str(Path(saved_runs.__file__).parent)
    paths = os.pathsep.join([tests, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, saved_runs.__file__],
        input="".join(json.dumps(each) + "\n" for each in asked),
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert done.returncode == 0, done.stderr[-4000:]
    return [json.loads(line) for line in done.stdout.splitlines()]


def stopped(folder: Path, number: int, seed: int) -> None:
    """Draw so many cases, save them, and have one other process go on with all of them."""
    drawn = []

    @seeded(seed)
    @settings(
        max_examples=2 * number,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(saved_runs.cases())
    def draw(case):
        if len(drawn) < number:
            found = prepared(case, folder, len(drawn))
            if found is not None:
                drawn.append((case, *found))

    draw()
    assert len(drawn) == number
    said = in_another_process([each for _, asked, _ in drawn for each in asked])
    for at, (case, _, expected) in enumerate(drawn):
        assert said[2 * at : 2 * at + 2] == [expected, expected], case


def test_what_is_stopped_and_saved_goes_on(tmp_path):
    stopped(tmp_path, 2 if INTERPRETED else 8, 1)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(5))
def test_five_hundred_that_were_stopped(tmp_path, seed):
    stopped(tmp_path, 100, 100 + seed)


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
