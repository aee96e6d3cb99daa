"""The phases on one's own scene, and on what a program has recorded."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

import kinetile as kt
from kinetile.cli import app
from kinetile_bench.own.scene import SceneBench, SceneRow, bench_scene


def kinetile(*arguments: object):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture
def trace(tmp_path):
    """Return the file of a recording, and the simulation that was recorded."""
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.25, seed=3), "cells", live=True)
    for frame in range(1, 9):
        sim.run(max_contacts=4)  # so that commands come among the contacts of a tick as well
        sim.set_velocities([1, 2, 3], (0.25 * frame, 1.0))
        if frame == 4:
            place = sim.positions()[-1]
            sim.remove(15)
            sim.insert(place, (0.5, 0.5), 0.01, mass=3.0)
    path = tmp_path / "trace.toml"
    kt.save_scene(sim.recorded(), path)
    return path, sim


def test_a_recording_runs_under_all_phases_to_the_contacts_of_the_program(trace):
    path, sim = trace
    found = bench_scene(kt.load_scene(path), ["cells", ("sap-1d", {"axis": "y"})], repeats=2)
    assert found.identical
    for row in found.rows:
        assert row.ended_by is None
        assert row.fingerprint == sim.fingerprint
        assert (row.contacts, row.commands) == (len(sim.contacts), 26)
        assert row.fastest <= row.cpu_seconds <= row.slowest
    assert max(row.of_fastest for row in found.rows) == 1.0


def test_a_short_run_is_done_again_until_it_has_the_seconds_that_are_asked_for(monkeypatch):
    times = iter([0.25, 0.5, 0.5, 2.0, 0.125, 0.25, 0.75])
    monkeypatch.setattr("kinetile_bench.own.scene._timed", lambda *_: (next(times), "ZenoError: jammed"))
    (row,) = bench_scene(kt.make_scene("cradle"), ["naive"], 1.0, repeats=3, seconds=1.0).rows
    assert (row.fastest, row.cpu_seconds, row.slowest) == (0.25, 0.5, 2.0)
    assert row.ended_by == "ZenoError: jammed"
    assert list(times) == []


def test_a_phase_that_refuses_is_named_and_a_fault_too():
    plane = kt.Scene([[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25)
    found = bench_scene(plane, ["sweep-tiling", "cells"], 1.0, repeats=2)
    refused, ran = found.rows
    assert "arena" in refused.ended_by
    assert refused.cpu_seconds is None
    assert (ran.contacts, ran.ended_by) == (1, None)
    assert found.identical
    full = [kt.Insert(0.125, (0.1, 0.0), (0.0, 0.0), 0.25)]
    blocked = kt.Scene(plane.position, plane.velocity, 0.25, commands=full)
    (row,) = bench_scene(blocked, ["cells"], 1.0, repeats=1).rows
    assert row.ended_by.startswith("Refused: at time 0.125 there is no room for body 2")


def test_bench_of_a_file_needs_no_name_of_a_benchmark(trace):
    path, sim = trace
    arguments = (path, "--phases", "cells,sweep-tiling", "--repeats", "1")
    printed = kinetile("bench", *arguments).stdout
    assert f"identical: {len(sim.contacts):,} contacts, the same under all 2 phases" in printed
    found = json.loads(kinetile("bench", *arguments, "--json").stdout)
    assert found["scene"]["bodies"] == 16
    assert [row["fingerprint"] for row in found["rows"]] == [sim.fingerprint] * 2
    assert json.loads(kinetile("bench", "scene", *arguments, "--json").stdout)["identical"] is True
    assert kinetile("bench", "nothing.toml").exit_code == 2
    assert kinetile("bench", "nothing").exit_code == 2
    assert kinetile("bench", path, "--phases", "").exit_code == 2
    compared = kinetile("compare", path, "--broad-phases", "naive,sap-1d,sap-2d")
    assert compared.exit_code == 0
    assert f"identical: {len(sim.contacts):,} contacts" in compared.stdout


def test_phases_that_differ_are_exit_code_1(trace, monkeypatch):
    rows = [SceneRow(name, None, 1.0, 1.0, 1.0, 5.0, 1.0, 0.0, 5, 0, name) for name in ("one", "other")]
    differing = SceneBench(tuple(rows), {"processor": "none", "repeats": 1})
    monkeypatch.setattr("kinetile_bench.own.scene.bench_scene", lambda *_, **__: differing)
    printed = kinetile("bench", trace[0])
    assert printed.exit_code == 1
    assert "NOT identical" in printed.stdout


def test_a_notebook_shows_a_row_for_each_phase_and_the_columns_that_are_filled_in():
    rows = (
        SceneRow("sap-1d:axis=<y>", None, 0.25, contacts=1200),
        SceneRow("cells", None, 0.5, contacts=1200),
    )
    page = SceneBench(rows, {"processor": "a & b", "repeats": 1})._repr_html_()
    assert page.count("<tr>") == 3
    for said in (">sap-1d:axis=&lt;y&gt;<", ">cpu seconds<", ">0.25<", ">1,200<", "processor a &amp; b"):
        assert said in page
    assert "fingerprint" not in page
    assert "<table" in SceneBench((), {})._repr_html_()
