"""Snapshots, copies, files: what is put back goes on to the same bits."""

from __future__ import annotations

import copy
import pickle

import pytest

import kinetile as kt

PHASES = ("naive", "cells", "sap-1d", "sap-2d", "sweep-tiling")


def lively(name: str) -> kt.Simulation:
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, seed=1), name, live=True)
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


@pytest.mark.parametrize("name", PHASES)
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
        assert each.readings.structural_events == sim.readings.structural_events
        assert each.recorded() == sim.recorded()
    sim.restore(there)
    assert sim.snapshot() == there


def test_any_phase_goes_on_to_the_same_contacts(tmp_path):
    for name in PHASES:
        sim = lively(name)
        sim.save(tmp_path / "s.kt")
        sim.run(0.5)
        for other in PHASES:
            again = kt.resume(tmp_path / "s.kt", other)
            assert again.broad_phase == other
            again.run(0.5)
            assert again.fingerprint == sim.fingerprint
            assert again.positions().tobytes() == sim.positions().tobytes()
            assert again.bodies.tolist() == sim.bodies.tolist()
