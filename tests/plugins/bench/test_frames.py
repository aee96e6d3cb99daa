"""What a frame costs: what is played, what is said of it, and what the command prints."""

from __future__ import annotations

import json

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import BadOption, Refused
from kinetile_bench import frames as frames_module
from kinetile_bench.frames import PARTS, FrameBench, FrameRow, Play, bench_frames
from studies import kinetile

SMALL = Play(bodies=25, turned=5, exchanged=2)


def test_all_phases_play_the_same_game():
    *before, found = bench_frames(["cells", "sap-1d", "sweep-tiling"], 30, SMALL)
    assert [len(each.rows) for each in before] == [1, 2]
    assert found.identical
    assert len({row.fingerprint for row in found.rows}) == 1
    for row in found.rows:
        assert row.contacts > 0
        assert set(row.parts) == set(PARTS)
        assert 0.0 < row.median <= row.p99 <= row.worst
        assert row.drift > 0.0
        assert len(row.first) == 3
    assert json.loads(json.dumps(found.as_dict()))["conditions"]["frames"] == 30


def test_a_frame_has_its_turns_its_goings_and_its_comings():
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, density=0.25, seed=1), "cells", live=True)
    spent = frames_module._frames(sim, 20, SMALL, lambda frame: None)
    assert spent.shape == (20, len(PARTS))
    assert (spent > 0.0).all()
    readings = sim.readings
    assert (readings.turns, readings.removed, readings.inserted) == (100, 40, 40)
    assert sim.time == pytest.approx(20 / 60)
    assert len(sim.bodies) == 25


def test_what_is_asked_for_and_cannot_be():
    with pytest.raises(BadOption, match="there are 19 frames; expected at least 20"):
        next(bench_frames(["cells"], 19, SMALL))
    with pytest.raises(BadOption, match="of 4 discs there cannot be 5 that turn and 2 that go"):
        next(bench_frames(["cells"], 20, SMALL._replace(bodies=4)))


def test_a_phase_that_refuses_is_a_row(monkeypatch):
    def refuse(*_):
        raise Refused("not this one")

    monkeypatch.setattr(frames_module, "_row", refuse)
    (row,) = next(bench_frames(["cells"], 20, SMALL)).rows
    assert row == FrameRow("cells", refused="not this one")


def test_frames_are_printed_and_phases_that_differ_are_exit_code_1(monkeypatch):
    arguments = ("bench", "frames", "--frames", "20", "--bodies", "16", "--turned", "3", "--exchanged", "1")
    printed = kinetile(*arguments)
    assert printed.exit_code == 0
    assert "identical: " in printed.stdout
    assert "3 of 16 discs turn in one call, 1 go and 1 come" in printed.stdout
    found = json.loads(kinetile(*arguments, "--phases", "cells", "--json").stdout)
    assert found["rows"][0]["phase"] == "cells"
    parts = dict.fromkeys(PARTS, 0.1)
    rows = [
        FrameRow(name, None, 1.0, 2.0, 3.0, (4.0, 1.0, 1.0), parts, 1.0, 0.0, 7, name * 8)
        for name in ("cells", "naive")
    ]
    differing = FrameBench(
        (*rows, FrameRow("odd", refused="no")), next(bench_frames(["cells"], 20, SMALL)).conditions
    )
    monkeypatch.setattr(frames_module, "bench_frames", lambda *_, **__: [differing])
    printed = kinetile("bench", "frames")
    assert printed.exit_code == 1
    assert "NOT identical" in printed.stdout
    assert "odd refuses: no" in printed.stdout
    assert kinetile("bench", "frames", "--phases", "").exit_code == 2


@pytest.mark.compiled
def test_no_frame_compiles():
    """The first turn, the first who goes and the first who comes find the loop as it was made ready."""
    (row,) = next(bench_frames(["cells"], 20, SMALL)).rows
    assert row.compile_seconds == 0.0
    assert np.isfinite(row.drift)
