"""A study in this process: rows, measures, disagreement, versions, scene files, tables, what a task costs."""

from __future__ import annotations

import csv
import io
import json
import os
import time

import pytest

import kinetile as kt
import studies
from clusters import cluster
from kinetile.errors import BadOption, RecordError, StudyError
from kinetile_bench import Study, runner
from kinetile_bench.plan import read_plan
from kinetile_bench.rows import row_of, table_of
from kinetile_bench.task import VersionsDiffer, source_of

TABLES = {
    "phases": ["naive", "cells"],
    "seeds": [1, 2],
    "until": 0.05,
    "scenes": [{"recipe": "grid", "parameters": {"bodies": [9, 16]}}],
}


def run(tables, folder, **how):
    study = Study(tables, folder)
    return study, studies.status_here(study, **how)


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


@pytest.mark.small
def test_observables_are_columns_with_their_errors(tmp_path):
    """They are columns beside the others, and tasks without observables keep their keys."""
    tables = {
        "phases": ["naive"],
        "until": 2.0,
        "scenes": [{"recipe": "grid", "parameters": {"bodies": 4}}],
    }
    plain, _ = run(tables, tmp_path / "plain")
    study, outcome = run({**tables, "observe": ["rates:every=0.5", "g:bins=2"]}, tmp_path)
    assert outcome.well
    (row,) = study.rows().to_pylist()
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    sim.run(2.0, observe=["rates:every=0.5", "g:bins=2"])
    for quantity, (mean, error, blocks, *_) in sim.observed["rates"].items():
        names = (f"observed.rates.{quantity}{end}" for end in ("", ".error", ".blocks"))
        assert [row[name] for name in names] == pytest.approx([mean, error, blocks])
    g = sim.observed["g"]["g"]
    assert json.loads(row["observed.g.g"])["mean"] == pytest.approx(g.mean.tolist())
    (before,) = plain.rows().to_pylist()
    assert (before["fingerprint"], before["course"]) == (row["fingerprint"], row["course"])
    assert before["key"] != row["key"]


@pytest.mark.small
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
    real = runner.run_task

    def now_and_then(order):
        if order["parameters"]["seed"] == 2:
            monkeypatch.setattr("kinetile.run.simulation.Simulation.compile", _raise)
        return real(order)

    def _raise(self):
        raise ValueError("no such luck")

    monkeypatch.setattr("kinetile_bench.study_run.run_task", now_and_then)
    study, outcome = run({**TABLES, "phases": ["naive"]}, tmp_path)
    assert outcome.statuses["failed"] >= 2
    assert "ValueError: no such luck" in study.rows()["error"].to_pylist()
    monkeypatch.undo()
    tables = {**TABLES, "phases": ["naive"]}
    assert run(tables, tmp_path)[1].ran == 0
    assert run(tables, tmp_path, again=["failed"])[1].statuses == {"done": 4}


def test_a_worker_of_other_versions_is_refused_by_the_task_itself():
    task = next(iter(Study(TABLES, "nowhere").tasks.values()))
    order = task._asdict() | {"versions": {**task.versions, "broad phase naive": "kinetile 9"}}
    with pytest.raises(VersionsDiffer, match=r"broad phase naive is kinetile \S+ there, kinetile 9 here"):
        runner.run_task(order)


def test_a_phase_of_this_process_goes_by_its_source(blind):
    assert source_of("broad phase", "naive") == f"kinetile {kt.__version__}"
    assert source_of("broad phase", blind).startswith("added in this process, sources ")


def test_progress_may_stop_it_and_what_was_done_is_there(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        run(TABLES, tmp_path, progress=studies.stop_after(3))
    outcome = Study(TABLES, tmp_path).status()
    assert 3 <= outcome.statuses["done"] < 8
    assert run(TABLES, tmp_path)[1].ran == outcome.open


def test_a_status_that_there_is_not_is_told(tmp_path):
    with pytest.raises(BadOption, match="did you mean 'lost'"):
        run(TABLES, tmp_path, again=["lots"])


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RecordError, match="cannot be written"):
        run(TABLES, tmp_path / "file")


@pytest.mark.parametrize("results", ["..", "a/../..", "../beside", "link", "link/rows"])
def test_results_of_a_study_were_written_outside_of_its_folder(tmp_path, results):
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "link").symlink_to(tmp_path)
    file = tmp_path / "here" / "study.toml"
    scene = '[[scenes]]\nrecipe = "grid"\n'
    file.write_text(f'results = "{results}"\nphases = ["naive"]\ncontacts = 5\n{scene}')
    with pytest.raises(StudyError, match=r"which is outside of the study's folder; expected .*absolute path"):
        Study(file)
    assert {each.name for each in tmp_path.rglob("*")} == {"here", "link", "study.toml"}
    for inside in ("rows", "a/../rows", str(tmp_path / "beside")):
        file.write_text(f'results = "{inside}"\nphases = ["naive"]\ncontacts = 5\n{scene}')
        assert Study(file).results == tmp_path / "here" / inside


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


@pytest.mark.slow
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
        return studies.kinetile("study", *words, "--results", done.results)

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


TRACED = """
phases = ["naive", "cells"]
repeats = 2
until = 0.2

[[scenes]]
file = "trace.toml"

[[scenes]]
recipe = "grid"
parameters = { bodies = [9] }
"""


def record(folder, turn=1):
    """Save a recording with a turn, an insertion and a removal as ``trace.toml``; return its simulation."""
    sim = kt.Simulation(kt.make_scene("grid", bodies=16), "naive", live=True)
    sim.run(until=0.05)
    sim.set_velocities([turn], (0.5, -0.25))
    sim.remove(2)
    sim.run(until=0.2)
    kt.save_scene(sim.recorded(), folder / "trace.toml")
    return sim


@pytest.fixture
def path(tmp_path):
    record(tmp_path)
    return studies.write(tmp_path, TRACED)


def traced(study):
    return [row for row in study.rows().to_pylist() if row["recipe"] == "trace.toml"]


def test_rows_of_a_recording_have_the_fingerprint_of_the_run_that_it_records(path, tmp_path):
    sim = record(tmp_path)
    study = Study(path)
    (tmp_path / "trace.toml").unlink()  # what was read when the study was made is what is run
    studies.run_here(study)
    rows = traced(study)
    assert len(rows) == 4
    assert {row["fingerprint"] for row in rows} == {sim.fingerprint}
    assert {row["status"] for row in rows} == {"done"}
    assert {len(row["scene_sha256"]) for row in rows} == {64}
    groups = study.table(y="events")["groups"]
    assert [each["scene"]["recipe"] for each in groups] == ["trace.toml", "trace.toml", "grid", "grid"]


def test_a_file_that_changed_under_a_half_done_study_is_told_and_its_rows_are_mixed_with_no_others(path):
    with pytest.raises(KeyboardInterrupt):
        studies.run_here(Study(path), progress=studies.stop_after(2))
    record(path.parent, turn=5)
    changed = Study(path)
    (said,) = changed.status().changed
    assert said.startswith("trace.toml has changed: ")
    assert changed.rows().num_rows == 0
    with pytest.raises(StudyError, match=r"trace.toml has changed.*--again changed"):
        studies.run_here(changed)
    outcome = studies.run_here(changed, again=["changed"]).status()
    assert (outcome.statuses, outcome.open, outcome.others, outcome.changed) == ({"done": 8}, 0, 0, ())
    assert len({row["fingerprint"] for row in traced(changed)}) == 1


def test_a_file_by_another_name_keeps_its_rows(path, tmp_path):
    studies.run_here(Study(path))
    (tmp_path / "trace.toml").rename(tmp_path / "moved.toml")
    path.write_text(TRACED.replace("trace.toml", "moved.toml"))
    assert Study(path).status().open == 0


def test_the_end_of_a_scene_file_is_the_end_of_its_runs_where_the_study_has_none(tmp_path):
    record(tmp_path)
    recorded = (tmp_path / "trace.toml").read_text().replace("until", "# until").replace("end", "# end")
    text = f"until = 0.125\n{recorded}"
    (tmp_path / "trace.toml").write_text(text)
    path = studies.write(tmp_path, 'phases = ["naive"]\nscenes = [{ file = "trace.toml" }]\n')
    assert [task.until for task in Study(path).tasks.values()] == [0.125]


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ({"file": "none.toml"}, "scenes[0].file: found 'none.toml', which cannot be read (No such file"),
        ({"file": "a\0b"}, "scenes[0].file: found 'a\\x00b'; expected the name of a scene file"),
        ({"file": "bad.toml"}, "scenes[0].file: arena: found 3"),
        ({"file": "bad.toml", "recipe": "grid"}, "scenes[0].file: found a file beside a recipe"),
        ({"file": "a.toml", "parameters": {}}, "scenes[0].parameters: found parameters of a file"),
        ({"file": ["a.toml"]}, "scenes[0].file: found ['a.toml']; expected the name of a scene file"),
        ({}, "scenes[0]: found neither recipe nor file; expected one of the two"),
    ],
)
def test_a_scene_file_that_cannot_be_used_is_a_mistake_with_its_place(tmp_path, monkeypatch, scene, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text("arena = 3\nbodies = []\n")
    with pytest.raises(StudyError) as caught:
        read_plan({"phases": ["naive"], "until": 1, "scenes": [scene]})
    assert said in str(caught.value)


@pytest.mark.slow
def test_stages_of_a_scene_file_are_noted_in_a_process_of_its_own(tmp_path):
    kt.save_scene(kt.make_scene("grid", bodies=9), tmp_path / "trace.toml")
    tables = '\nphases = ["naive"]\ncontacts = 5\nmeasure = ["stages"]\nseconds = 0.001\n'
    path = studies.write(tmp_path, f'{tables}scenes = [{{ file = "trace.toml" }}]\n')
    (row,) = studies.run_here(Study(path)).rows().to_pylist()
    assert row["status"] == "done", row["error"]
    assert row["table_bytes"] > 0


@pytest.mark.slow
def test_the_content_travels_to_workers_that_cannot_see_the_file(path, tmp_path):
    pytest.importorskip("distributed")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with cluster(elsewhere, [[]]) as (address, _):
        done = studies.study("run", path.name, "--dask", address, "--workers", 1, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    here = studies.run_here(Study(path, tmp_path / "here"))
    assert traced(Study(path))[0]["fingerprint"] == traced(here)[0]["fingerprint"]


TINY = """
phases = ["cells"]
seeds = {{ from = 1, to = {seeds} }}
contacts = 5
scenes = [{{ recipe = "grid", parameters = {{ bodies = 25 }} }}]
"""


def cpu_seconds() -> float:
    return sum(os.times()[:4])


@pytest.mark.long
@pytest.mark.compiled
def test_a_task_costs_at_most_20_ms_beyond_its_simulation(tmp_path):
    kt.Simulation(kt.make_scene("grid", bodies=25, seed=1), "cells", keep_contacts=False).run(max_contacts=5)
    began = cpu_seconds()
    for seed in range(1, 401):
        sim = kt.Simulation(kt.make_scene("grid", bodies=25, seed=seed), "cells", keep_contacts=False)
        sim.run(max_contacts=5)
    plain = (cpu_seconds() - began) / 400
    spent = {}
    for seeds in (100, 1100):
        study = Study(studies.write(tmp_path / str(seeds), TINY.format(seeds=seeds)))
        began = cpu_seconds()
        assert study.run(workers=1).statuses == {"done": seeds}
        spent[seeds] = cpu_seconds() - began
    each = (spent[1100] - spent[100]) / 1000
    print(f"a task {1e3 * each:.2f} ms, its simulation alone {1e3 * plain:.2f} ms")
    assert each - plain < 0.02


@pytest.mark.long
@pytest.mark.compiled
def test_100_000_rows_are_read_and_drawn_in_less_than_10_s(tmp_path):
    text = """
phases = ["naive", "cells", "sap-1d", "sweep-tiling"]
seeds = { from = 1, to = 500 }
until = 1.0
[[scenes]]
recipe = "grid"
[scenes.parameters]
bodies = [25, 100, 225, 400, 625]
density = { from = 0.001, to = 0.5, count = 10, scale = "log" }
"""
    path = studies.write(tmp_path, text)
    study = Study(path)
    tasks = list(study.tasks.values())
    assert len(tasks) == 100_000
    sim = kt.Simulation(kt.make_scene("grid", bodies=25), "cells")
    sim.run(until=0.1)
    found = sim.readings.as_dict() | {"status": "done", "time": 1.0}
    from pyarrow import parquet

    parts = study.results / "rows" / "parts"
    parts.mkdir(parents=True)
    for at in range(0, len(tasks), 2000):
        rows = []
        for k, task in enumerate(tasks[at : at + 2000]):
            seconds = 1e-6 * task.parameters["bodies"] ** 1.5 * (1 + 0.01 * (k % 7))
            rows.append(row_of(task, found | {"cpu_seconds": seconds, "fingerprint": task.course}, 0))
        parquet.write_table(table_of(rows), parts / f"{at:06}.parquet")
    began = time.perf_counter(), time.process_time()
    study = Study(path)
    exponents = study.table()["exponents"]
    study.plot()
    took = time.perf_counter() - began[0], time.process_time() - began[1]
    print(f"{took[0]:.2f} s, {took[1]:.2f} CPU s")
    assert len(exponents) == 40
    assert exponents[0]["exponent"] == pytest.approx(1.5, abs=0.01)
    assert took[1] < 10.0
