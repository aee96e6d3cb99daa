"""A study in this process: rows, measures, disagreement, versions, what is told."""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from typer.testing import CliRunner

import kinetile as kt
import studies
from kinetile.cli import app
from kinetile.errors import BadOption, RecordError
from kinetile_bench import Study
from kinetile_bench.study.work import doing
from kinetile_bench.study.work.identity import VersionsDiffer, source_of

TABLES = {
    "phases": ["naive", "cells"],
    "seeds": [1, 2],
    "until": 0.05,
    "scenes": [{"recipe": "grid", "parameters": {"bodies": [9, 16]}}],
}


def run(tables, folder, **how):
    study = Study(tables, folder)
    with ThreadPoolExecutor(1) as threads:
        return study, study.run(threads, workers=1, **how)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    study, outcome = run(TABLES, tmp_path_factory.mktemp("done"))
    assert outcome.well
    assert outcome.statuses == {"done": 8}
    return study


def test_rows_are_those_of_simulations_in_the_order_of_the_tasks(done):
    rows = done.rows().to_pylist()
    assert [(row["bodies"], row["seed"], row["phase"]) for row in rows[:3]] == [
        (9, 1, "naive"),
        (9, 1, "cells"),
        (9, 2, "naive"),
    ]
    for row in rows:
        sim = kt.Simulation(
            kt.make_scene("grid", **{name: row[name] for name in ("bodies", "seed")}), row["phase"]
        )
        sim.run(until=0.05)
        assert row["fingerprint"] == sim.fingerprint
        assert row["contacts"] == len(sim.contacts)
        assert row["time"] == 0.05
        assert row["events"] == sim.readings.events
        assert row["kinetile"] == kt.__version__
        assert row["processor"]


def test_what_is_there_is_not_done_again_and_what_is_added_is(tmp_path):
    _, first = run(TABLES, tmp_path)
    _, second = run(TABLES, tmp_path)
    _, third = run({**TABLES, "phases": ["naive", "cells", "sap-1d"]}, tmp_path)
    study, fourth = run({**TABLES, "seeds": [1]}, tmp_path)
    assert [each.ran for each in (first, second, third, fourth)] == [8, 0, 4, 0]
    assert (fourth.total, fourth.others) == (4, 8)
    assert study.rows().num_rows == 4


def test_measures_fill_their_columns(tmp_path):
    tables = {**TABLES, "measure": ["timings", "pairs", "certified"], "seconds": 1e-6, "seeds": [1]}
    study, outcome = run(tables, tmp_path)
    assert outcome.well
    for row in study.rows().to_pylist():
        assert row["runs"] >= 1
        assert row["cpu_seconds_min"] <= row["cpu_seconds"] <= row["cpu_seconds_max"]
        assert row["pairs_most"] >= row["pairs_mean"] > 0
        assert row["certified"] is True
        assert row["certified_contacts"] == row["contacts"]
    plain = {**TABLES, "seeds": [1]}
    rows = {row["fingerprint"] for row in run(plain, tmp_path / "plain")[0].rows().to_pylist()}
    assert rows == {row["fingerprint"] for row in study.rows().to_pylist()}


def test_two_lists_of_contacts_of_one_scene_are_told_at_once(tmp_path, blind):
    scene = {"recipe": "cradle"}
    tables = {"phases": ["naive", blind, "cells"], "contacts": 4, "scenes": [scene]}
    told = []
    study, outcome = run(tables, tmp_path, disagreed=told.append)
    assert not outcome.well
    assert len(told) == 1
    assert "naive and blind have different contacts" in str(told[0])
    rows = study.rows().to_pylist()
    assert {row["status"] for row in rows} == {"disagrees"}
    assert all("other contacts than" in row["error"] for row in rows)
    assert run(tables, tmp_path, again=["disagrees"])[1].ran == 3


def test_an_error_in_a_run_is_a_row_and_a_refusal_is_another(tmp_path, monkeypatch):
    real = doing.do_task

    def now_and_then(order):
        if order["parameters"]["seed"] == 2:
            monkeypatch.setattr("kinetile.run.simulation.Simulation.compile", _raise)
        return real(order)

    def _raise(self):
        raise ValueError("no such luck")

    monkeypatch.setattr("kinetile_bench.study.engines.driving.do_task", now_and_then)
    study, outcome = run({**TABLES, "phases": ["naive"]}, tmp_path)
    assert outcome.statuses["failed"] >= 2
    assert "ValueError: no such luck" in study.rows()["error"].to_pylist()


def test_a_worker_of_other_versions_is_refused_by_the_task_itself():
    task = next(iter(Study(TABLES, "nowhere").tasks.values()))
    order = task._asdict() | {"versions": {**task.versions, "broad phase naive": "kinetile 9"}}
    with pytest.raises(VersionsDiffer, match=r"broad phase naive is kinetile \S+ there, kinetile 9 here"):
        doing.do_task(order)


def test_a_phase_of_this_process_goes_by_its_source(blind):
    assert source_of("broad phase", "naive") == f"kinetile {kt.__version__}"
    assert source_of("broad phase", blind).startswith("added in this process, sources ")


def test_progress_may_stop_it_and_what_was_done_is_there(tmp_path):
    def stop(progress):
        if progress.done >= 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(TABLES, tmp_path, progress=stop)
    outcome = Study(TABLES, tmp_path).status()
    assert 3 <= outcome.statuses["done"] < 8
    assert run(TABLES, tmp_path)[1].ran == outcome.open


@pytest.mark.parametrize(
    "how", [{"dask": "local"}, {"quiet_core": True}, {"workers": 0}], ids=lambda how: next(iter(how))
)
def test_two_engines_at_once_are_refused(tmp_path, how):
    with ThreadPoolExecutor(1) as threads, pytest.raises(BadOption, match="expected"):
        Study(TABLES, tmp_path).run(threads, **how)


def test_a_status_that_there_is_not_is_told(tmp_path):
    with pytest.raises(BadOption, match="did you mean 'lost'"):
        run(TABLES, tmp_path, again=["lots"])


def test_a_script_without_its_guard_is_told_what_is_missing(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"import kinetile as kt\nkt.Study({TABLES!r}, 'here').run(workers=1)\n")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert "must stand behind `if __name__ == '__main__':`" in done.stderr


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match="cannot be written"):
        run(TABLES, tmp_path / "file")


def test_the_table_has_means_ratios_exponents(done):
    found = done.table(y="events")
    assert (found["y"], found["x"], found["base"]) == ("events", "bodies", "naive")
    assert len(found["groups"]) == 4
    first, second = found["groups"][:2]
    assert first["scene"] == {"bodies": 9}
    assert first["ratio"] is None
    assert second["ratio"] >= 1.0  # cells has structural events besides
    assert second["interval"][0] < second["mean"] < second["interval"][1]
    assert [each["range"] for each in found["exponents"]] == [[9.0, 16.0]] * 2
    with pytest.raises(BadOption, match="expected one of"):
        done.table(y="event")
    with pytest.raises(BadOption, match="expected bodies"):
        done.table(x="density")


def test_figures_are_drawn_as_svg_and_png(tmp_path):
    pytest.importorskip("matplotlib")
    shares = {"name": "shares", "kind": "shares", "title": "What happens"}
    study, _ = run({**TABLES, "figures": [shares, {"name": "lines", "y": "events"}]}, tmp_path)
    written = [path.relative_to(tmp_path).as_posix() for path in study.plot()]
    assert written == ["figures/shares.svg", "figures/shares.png", "figures/lines.svg", "figures/lines.png"]
    assert (tmp_path / "figures" / "lines.svg").read_bytes() == study.plot(tmp_path / "more")[2].read_bytes()
    with pytest.raises(BadOption, match="no rows"):
        Study(TABLES, tmp_path / "none").plot()


def test_the_command_says_how_it_stands_in_text_and_json(tmp_path, done):
    path = studies.write(
        tmp_path,
        'phases = ["naive", "cells"]\nseeds = [1, 2]\nuntil = 0.05\n'
        'scenes = [{ recipe = "grid", parameters = { bodies = [9, 16] } }]\n',
    )

    def command(*words):
        return CliRunner().invoke(app, ["study", *map(str, words), "--results", str(done.results)])

    status = command("status", path, "--json")
    assert json.loads(status.stdout)["statuses"] == {"done": 8}
    assert status.exit_code == 0
    assert "8: 8 done, 0 open" in command("status", path).stdout
    table = command("table", path, "--y", "events")
    assert "Exponents of events over bodies" in table.stdout
    assert json.loads(command("table", path, "--json").stdout)["y"] == "cpu_seconds_per_time"
    rows = list(csv.DictReader(io.StringIO(command("table", path, "--y", "events", "--csv").stdout)))
    assert [(row["scene.bodies"], row["phase"]) for row in rows] == [
        ("9", "naive"),
        ("9", "cells"),
        ("16", "naive"),
        ("16", "cells"),
    ]
    assert [float(row["mean"]) for row in rows] == [each["mean"] for each in done.table(y="events")["groups"]]
    assert float(rows[0]["interval.low"]) < float(rows[0]["mean"]) < float(rows[0]["interval.high"])
    out = tmp_path / "rows.parquet"
    assert command("table", path, "--rows", out, "--json").exit_code == 0
    assert out.stat().st_size > 1000
    wrong = command("table", path, "--rows", tmp_path / "rows.txt")
    assert wrong.exit_code == 2
    assert "neither .csv nor .parquet" in wrong.stderr
    assert command("run", path, "--memory", "much").exit_code == 2
