"""Growth with the number of discs: its arithmetic, its processes, what the command prints."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

import kinetile as kt
from kinetile.cli import app
from kinetile.errors import Refused
from kinetile_bench import Study
from kinetile_bench import growth as bench_growth
from kinetile_bench.growth import Growth, GrowthRow, growth_study, read_growth, square_at_least
from kinetile_bench.study.work import stages
from studies import run_here


def kinetile(*arguments: object):
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def row(n: int, cost: float) -> GrowthRow:
    return GrowthRow(
        n, 0.1, cost, 1.1 * cost, 0.9 * cost, 1e6, 2.6, 1.0, 600.0, {"run": 600.0}, 500.0, {"scene": 48}
    )


def test_square_numbers():
    assert [square_at_least(n) for n in (1, 2, 100, 1000, 10_000, 100_000)] == [
        1,
        4,
        100,
        1024,
        10_000,
        100_489,
    ]


def test_growth_has_an_exponent():
    growth = Growth("sap-1d", 0.5, tuple(row(n, n**1.6) for n in (100, 1024, 10_000)), {})
    assert growth.exponent == pytest.approx(1.6)
    assert growth.steps == pytest.approx((1.6, 1.6))
    assert Growth("sap-1d", 0.5, (row(100, 1.0),), {}).exponent is None
    assert json.loads(json.dumps(growth.as_dict()))["rows"][2]["peak_bytes_per_body"] == 600.0


def test_growth_is_printed(tmp_path, monkeypatch):
    growth = Growth("sap-1d", 0.5, (row(100, 1.0), row(400, 8.0)), {"processor": "none"})
    few = {"phases": ["naive"], "contacts": 1, "scenes": [{"recipe": "cradle"}]}
    monkeypatch.setattr(bench_growth, "growth_study", lambda *_, **__: run_here(Study(few, tmp_path)))
    monkeypatch.setattr(bench_growth, "read_growth", lambda study: growth)
    result = kinetile("bench", "growth", "--phase", "sap-1d")
    assert "n^1.50 from 100 to 400 discs" in result.stdout
    found = json.loads(kinetile("bench", "growth", "--json").stdout)
    assert found["exponent"] == pytest.approx(1.5)
    assert kinetile("bench", "growth", "--bodies", "x").exit_code == 2
    assert kinetile("bench", "growth", "--bodies", "").exit_code == 2


def test_the_study_that_ships_is_what_the_command_measures(tmp_path):
    whole = Study("growth", tmp_path)
    mine = growth_study(tmp_path, "cells", [100, 1000, 10_000, 100_000])
    assert {key for key, task in whole.tasks.items() if task.phase == "cells"} == set(mine.tasks)


def stretches(row):
    return json.loads(row["stages"])["stretches"]


@pytest.mark.compiled
def test_growth_measures_in_processes_of_their_own(tmp_path):
    study = run_here(growth_study(tmp_path, "sap-1d", [16, 10], seconds=0.01, repeats=2))
    found = read_growth(study)
    assert [each.bodies for each in found.rows] == [16]
    assert found.conditions["repeats"] == 2
    (measured,) = found.rows
    assert measured.fastest <= measured.cpu_seconds_per_time <= measured.slowest
    assert measured.simulated > 0.0
    assert measured.arrays["bodies"] == 64.0
    assert measured.table_bytes_per_body > 300.0
    (row, other) = (row for row in study.rows().to_pylist() if row["bodies"] == 16)
    times = sorted(each["cpu_seconds"] / each["simulated"] for each in stretches(row) + stretches(other))
    assert (times[0], times[5]) == (measured.fastest, measured.slowest)
    assert measured.cpu_seconds_per_time == (times[2] + times[3]) / 2
    assert row["table_bytes"] == 16 * measured.table_bytes_per_body


@pytest.mark.compiled
def test_growth_says_what_a_phase_refuses(tmp_path):
    study = run_here(growth_study(tmp_path, "naive", [4900], seconds=0.01))
    assert read_growth(study).rows == ()
    assert [row["status"] for row in study.rows().to_pylist()] == ["done", "refused"]
    assert "naive asks every body" in study.rows()["error"].to_pylist()[1]


def test_what_no_longer_goes_on_is_not_timed():
    sim = kt.Simulation(kt.Scene([[0, 0], [3, 0]], [[1, 0], [0, 0]], 0.5), "naive")  # they meet once
    with pytest.raises(Refused, match="nobody meets anybody any more"):
        stages._stretch(sim, 10.0)
