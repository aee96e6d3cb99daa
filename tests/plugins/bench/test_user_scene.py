"""Benchmarks of a user's scene: every phase on a recording of a program, and which phase is recommended."""

import json

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile_bench.cli.tables import printed_parts
from kinetile_bench.user_scene import (
    CLOSE,
    Candidate,
    Chosen,
    SceneBench,
    SceneRow,
    _recommendation,
    bench_scene,
    choose,
)


@pytest.fixture
def trace(tmp_path):
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


@pytest.mark.small
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


def test_a_short_run_is_repeated_until_it_has_the_requested_seconds(monkeypatch):
    times = iter([0.25, 0.5, 0.5, 2.0, 0.125, 0.25, 0.75])
    monkeypatch.setattr("kinetile_bench.user_scene._timed", lambda *_: (next(times), "ZenoError: jammed"))
    (row,) = bench_scene(kt.make_scene("cradle"), ["naive"], 1.0, repeats=3, seconds=1.0).rows
    assert (row.fastest, row.cpu_seconds, row.slowest) == (0.25, 0.5, 2.0)
    assert row.ended_by == "ZenoError: jammed"
    assert list(times) == []


@pytest.mark.small
def test_a_phase_that_refuses_is_named_and_a_fault_too():
    plane = kt.Scene([[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25)
    strip = kt.Scene(plane.position + 1.0, plane.velocity, 0.25, arena=(4.0, 4.0), periodic="y")
    found = bench_scene(strip, ["sweep-tiling", "cells"], 1.0, repeats=2)
    refused, ran = found.rows
    assert "periodic along y" in refused.ended_by
    assert refused.cpu_seconds is None
    assert (ran.contacts, ran.ended_by) == (1, None)
    assert found.identical
    full = [kt.Insert(0.125, (0.1, 0.0), (0.0, 0.0), 0.25)]
    blocked = kt.Scene(plane.position, plane.velocity, 0.25, commands=full)
    (row,) = bench_scene(blocked, ["cells"], 1.0, repeats=1).rows
    assert row.ended_by.startswith("NoRoom: at time 0.125 there is no room for body 2")


@pytest.mark.small
def test_bench_of_a_file_needs_no_name_of_a_benchmark(trace):
    path, sim = trace
    arguments = (path, "--phases", "cells,sweep-tiling", "--repeats", "1")
    printed = kinetile("bench", "scene", *arguments).stdout
    assert f"identical: {len(sim.contacts):,} contacts, the same under all 2 phases" in printed
    found = json.loads(kinetile("bench", *arguments, "--json").stdout)
    assert found["scene"]["bodies"] == 16
    assert [row["fingerprint"] for row in found["rows"]] == [sim.fingerprint] * 2


def test_phases_that_differ_are_exit_code_1(monkeypatch):
    rows = [SceneRow(name, None, 1.0, 1.0, 1.0, 5.0, 1.0, 0.0, 5, 0, name) for name in ("one", "other")]
    differing = SceneBench(tuple(rows), {"processor": "none", "repeats": 1})
    monkeypatch.setattr("kinetile_bench.user_scene.bench_scene", lambda *_, **__: differing)
    printed = kinetile("bench", "scene", "cradle", code=1)
    assert "NOT identical" in printed.stdout


def candidate(name: str, rate: float | None, hopeless: bool = False) -> Candidate:
    refused = rate is None
    return Candidate(
        name, cpu_seconds=None if refused else 1.0, contacts_per_cpu_second=rate, hopeless=hopeless
    )


REFUSED = candidate("c", None)


@pytest.mark.parametrize(
    ("found", "repeats", "identical", "phase", "reason"),
    [
        (
            [candidate("a", 300.0), candidate("b", 150.0, hopeless=True), REFUSED],
            *(5, True, "a", "a has 2 times the contacts a CPU second of b, which comes next"),
        ),
        (
            [candidate("a", 300.0), candidate("b", 300.0 * (1.0 - CLOSE / 2.0)), candidate("c", 100.0)],
            *(5, True, "a", "a is the fastest, and b within 5% of it"),
        ),
        ([candidate("a", 3.0), REFUSED], 1, True, "a", "a is the only one that can do this scene"),
        ([REFUSED], 5, True, None, "no phase can do this scene"),
        ([candidate("a", 3.0), candidate("b", 1.0)], 1, True, None, "after one run of each: a was the fast"),
        ([candidate("a", 3.0), candidate("b", 1.0)], 5, False, None, "one of them gives wrong contacts"),
    ],
)
def test_the_recommendation_follows_from_the_measurements(found, repeats, identical, phase, reason):
    name, text = _recommendation(found, repeats, identical)
    assert name == phase
    assert reason in text


@pytest.mark.small
def test_a_scene_without_walls_is_left_when_all_have_flown_apart():
    plane = kt.Scene([[0.0, 0.0], [2.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.25)
    found = choose(plane, ["naive", "cells", "sweep-tiling"])
    assert found.identical
    assert found.phase in ("naive", "cells", "sweep-tiling")
    assert [each.contacts for each in found.candidates] == [1, 1, 1]


@pytest.mark.small
@pytest.mark.parametrize("position", [[], [[0.0, 0.0], [4.0, 0.0]]])
def test_where_nothing_collides_any_phase_will_do(position):
    found = choose(kt.Scene(position, [[0.0, 0.0]] * len(position), 0.5), ["naive", "cells"])
    assert found.phase in ("cells", "naive")
    assert "any phase that does the scene will do" in found.reason


def test_a_cost_out_of_proportion_is_told_beside_that_of_cells():
    """The author of a quadtree with 5.7 times the events of cells read that it is slow, and not why."""
    usual = {"cpu_seconds": 1.0, "contacts_per_cpu_second": 1e6, "contacts": 9, "structure_bytes": 1000}
    usual |= {"structural_per_contact": 0.5, "asked_per_contact": 20.0, "computed_per_contact": 0.9}
    rows = Candidate("tree", **usual | {"structural_per_contact": 2.85}), Candidate("cells", **usual)
    conditions = {"processor": "any", "max_contacts": 9, "repeats": 1}
    parts = printed_parts(Chosen("tree", "", rows, True, conditions))
    assert [part for part in parts if "beside" in str(part)] == [
        "tree has, beside cells, 5.7 times the structural events a contact"
    ]


def test_the_command_prints_the_candidates_and_what_to_take():
    printed = kinetile("choose", "grid", "-s", "bodies=16", "--phases", "naive,cells", code=0)
    assert printed.stdout.splitlines()[-1].startswith("take ")
    found = json.loads(kinetile("choose", "grid", "-s", "bodies=16", "--phases", "cells", "--json").stdout)
    assert (found["phase"], found["candidates"][0]["hopeless"]) == ("cells", False)
