"""A game that goes back for orders that come late has the contacts of one in which all orders are in time."""

from pathlib import Path

import pytest

import kinetile as kt
from installing import loaded

EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "rollback.py"


@pytest.fixture(scope="module")
def rollback():
    with loaded(EXAMPLE) as module:
        module.microseconds.__defaults__ = (3,)  # nothing is judged by how long it takes
        yield module


@pytest.mark.parametrize(
    ("frames", "bodies"), [(16, 9), pytest.param(10_000, 60, marks=(pytest.mark.slow, pytest.mark.compiled))]
)
def test_late_orders_end_in_the_same_bits(rollback, frames, bodies, capsys):
    assert rollback.main(["--frames", str(frames), "--bodies", str(bodies)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["cells", "sap-1d", "sweep-tiling", "one"]
    assert int(lines[0].split()[3]) > frames // 4


def test_a_difference_is_an_exit_code(rollback, monkeypatch, capsys):
    def forgetful(game, frame, orders):
        """Goes back, and forgets the orders that came late."""

    monkeypatch.setattr(rollback.Game, "correct", forgetful)
    assert rollback.main(["--frames", "30", "--bodies", "9", "--phases", "cells"]) == 1
    assert "DIFFERENT" in capsys.readouterr().out


def test_commands_so_far_are_shared_between_snapshots():
    sim = kt.Simulation(kt.make_scene("grid", bodies=16), "naive", live=True)
    before = sim.snapshot()
    for frame in range(40):
        sim.set_velocity(frame % 16, (1.0, 0.5))
        if frame == 20:
            there = sim.snapshot()
    assert sim.snapshot().state.history is sim.snapshot().state.history
    scene = sim.recorded()
    assert len(scene.commands) == 40
    sim.restore(there)
    assert len(sim.recorded().commands) == 21
    sim.set_velocity(3, (0.0, 1.0))
    assert len(sim.recorded().commands) == 22
    sim.restore(before)
    assert not sim.recorded().commands
