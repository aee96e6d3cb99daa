"""The studies ``events`` and ``growth``: their arithmetic and their counts; no clock is judged here."""

from __future__ import annotations

import json
import statistics
import subprocess

import pytest

import kinetile as kt
from kinetile.errors import Refused
from kinetile_bench import Study, runner
from kinetile_bench import growth as bench_growth
from kinetile_bench.events import COUNTED, Bench, events_study, read_events
from kinetile_bench.growth import Growth, GrowthRow, growth_study, read_growth, square_at_least
from kinetile_bench.thesis import thesis_study
from studies import kinetile, run_here


def study_of(folder, **others) -> Study:
    choices = ["naive", ("sap-1d", {"axis": "y"}), "sap-2d"]
    return run_here(events_study(folder, choices, [4, 9], [0.5, 0.25], seconds=0.001, repeats=2, **others))


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Bench:
    return read_events(study_of(tmp_path_factory.mktemp("rows"), seed=6))


def test_every_phase_on_every_scene(bench):
    assert [(row.density, row.bodies, row.phase) for row in bench.rows] == [
        (density, bodies, phase)
        for density in (0.5, 0.25)
        for bodies in (4, 9)
        for phase in ("naive", "sap-1d:axis=y", "sap-2d")
    ]
    for row in bench.rows:
        assert len(row.cpu_seconds) == 2
        assert row.slowest <= row.events_per_cpu_second <= row.fastest
        assert row.contacts > 0
        assert row.events_per_contact >= 1.0
        assert row.asked_per_contact > row.computed_per_contact > 0.0
    found = json.loads(json.dumps(bench.as_dict()))
    assert found["rows"][0]["phase"] == "naive"
    assert found["conditions"]["repeats"] == 2
    assert found["conditions"]["versions"]["kinetile"] == kt.__version__


@pytest.mark.parametrize("at", range(0, 12, 3))
def test_the_fastest_phase_of_a_scene_is_the_measure_of_the_others(bench, at):
    rows = bench.rows[at : at + 3]
    most = max(row.contacts_per_cpu_second for row in rows)
    assert [row.of_fastest for row in rows] == [row.contacts_per_cpu_second / most for row in rows]
    assert max(row.of_fastest for row in rows) == 1.0


def test_counts_are_those_of_a_fixed_number_of_contacts_on_the_recipes_scene(bench, tmp_path):
    for row in bench.rows:
        sim = kt.Simulation(kt.make_scene("grid", bodies=row.bodies, density=row.density, seed=6), "naive")
        sim.run(max_contacts=COUNTED * row.bodies)
        assert row.counts["fingerprint"] == sim.fingerprint
        assert row.counts["contacts_disc"] + row.counts["contacts_wall"] == COUNTED * row.bodies
        assert (row.counts["structural_events"] == 0) == (row.phase == "naive")
    again = read_events(study_of(tmp_path, seed=6))
    assert [row.counts for row in again.rows] == [row.counts for row in bench.rows]


def test_the_studies_that_ship_are_what_the_commands_measure(tmp_path):
    built_in = ["cells", "naive", "sap-1d", "sap-2d", "sweep-tiling"]
    assert list(Study("events", tmp_path).tasks) == list(events_study(tmp_path, built_in).tasks)
    assert list(Study("thesis", tmp_path).tasks) == list(thesis_study(tmp_path).tasks)
    mine = growth_study(tmp_path, "cells", [100, 1000, 10_000, 100_000])
    whole = Study("growth", tmp_path).tasks
    assert {key for key, task in whole.items() if task.phase == "cells"} == set(mine.tasks)


def growth_row(n: int, cost: float) -> GrowthRow:
    return GrowthRow(
        n, 0.1, cost, 1.1 * cost, 0.9 * cost, 1e6, 2.6, 1.0, 600.0, {"run": 600.0}, 500.0, {"scene": 48}
    )


def test_square_numbers():
    sizes = {1: 1, 2: 4, 100: 100, 1000: 1024, 10_000: 10_000, 100_000: 100_489}
    assert {n: square_at_least(n) for n in sizes} == sizes


def test_growth_has_an_exponent():
    growth = Growth("sap-1d", 0.5, tuple(growth_row(n, n**1.6) for n in (100, 1024, 10_000)), {})
    assert growth.exponent == pytest.approx(1.6)
    assert growth.steps == pytest.approx((1.6, 1.6))
    assert Growth("sap-1d", 0.5, (growth_row(100, 1.0),), {}).exponent is None
    assert json.loads(json.dumps(growth.as_dict()))["rows"][2]["peak_bytes_per_body"] == 600.0


def test_growth_is_printed(tmp_path, monkeypatch):
    growth = Growth("sap-1d", 0.5, (growth_row(100, 1.0), growth_row(400, 8.0)), {"processor": "none"})
    few = {"phases": ["naive"], "contacts": 1, "scenes": [{"recipe": "cradle"}]}
    monkeypatch.setattr(bench_growth, "growth_study", lambda *_, **__: run_here(Study(few, tmp_path)))
    monkeypatch.setattr(bench_growth, "read_growth", lambda study: growth)
    result = kinetile("bench", "growth", "--phase", "sap-1d")
    assert "n^1.50 from 100 to 400 discs" in result.stdout
    found = json.loads(kinetile("bench", "growth", "--json").stdout)
    assert found["exponent"] == pytest.approx(1.5)
    assert kinetile("bench", "growth", "--bodies", "x").exit_code == 2
    assert kinetile("bench", "growth", "--bodies", "").exit_code == 2


@pytest.fixture
def in_this_process(monkeypatch):
    """Stages are measured in this process, which costs less than one of their own."""

    def run(command, *, input, **_):
        try:
            found = runner._stages_here(json.loads(input))
        except Refused as error:
            found = {"refused": str(error)}
        return subprocess.CompletedProcess(command, 0, json.dumps(found), "")

    monkeypatch.setattr(runner.subprocess, "run", run)


def test_growth_has_the_stretches_of_all_repeats(tmp_path, in_this_process):
    study = run_here(growth_study(tmp_path, "sap-1d", [16, 10], seconds=0.01, repeats=2))
    found = read_growth(study)
    assert [each.bodies for each in found.rows] == [16]
    assert found.conditions["repeats"] == 2
    (measured,) = found.rows
    assert measured.fastest <= measured.cpu_seconds_per_time <= measured.slowest
    assert measured.simulated > 0.0
    assert measured.arrays["bodies"] == 64.0
    assert measured.table_bytes_per_body > 300.0
    rows = [row for row in study.rows().to_pylist() if row["bodies"] == 16]
    stretches = [each for row in rows for each in json.loads(row["stages"])["stretches"]]
    times = [each["cpu_seconds"] / each["simulated"] for each in stretches]
    assert len(times) == 6
    assert (min(times), max(times)) == (measured.fastest, measured.slowest)
    assert measured.cpu_seconds_per_time == statistics.median(times)
    assert rows[0]["table_bytes"] == 16 * measured.table_bytes_per_body


@pytest.mark.compiled
def test_growth_says_what_a_phase_refuses(tmp_path, in_this_process):
    study = run_here(growth_study(tmp_path, "naive", [4900], seconds=0.01))
    assert read_growth(study).rows == ()
    assert [row["status"] for row in study.rows().to_pylist()] == ["done", "refused"]
    assert "naive asks every body" in study.rows()["error"].to_pylist()[1]


def test_what_no_longer_goes_on_is_not_timed():
    sim = kt.Simulation(kt.Scene([[0, 0], [3, 0]], [[1, 0], [0, 0]], 0.5), "naive")  # they meet once
    with pytest.raises(Refused, match="nobody meets anybody any more"):
        runner._stretch(sim, 10.0)
