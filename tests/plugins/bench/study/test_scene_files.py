"""Scene files and recordings as scenes of a study: rows are those of the file's content, wherever it runs."""

from __future__ import annotations

import pytest

import kinetile as kt
import studies
from clusters import cluster
from kinetile.errors import StudyError
from kinetile_bench import Study
from kinetile_bench.study.file import read_plan

STUDY = """
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
    return studies.write(tmp_path, STUDY)


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
    def stop(progress):
        if progress.done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        studies.run_here(Study(path), progress=stop)
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
    path.write_text(STUDY.replace("trace.toml", "moved.toml"))
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


def test_stages_of_a_scene_file_are_noted_in_a_process_of_its_own(tmp_path):
    kt.save_scene(kt.make_scene("grid", bodies=9), tmp_path / "trace.toml")
    tables = '\nphases = ["naive"]\ncontacts = 5\nmeasure = ["stages"]\nseconds = 0.001\n'
    path = studies.write(tmp_path, f'{tables}scenes = [{{ file = "trace.toml" }}]\n')
    (row,) = studies.run_here(Study(path)).rows().to_pylist()
    assert row["status"] == "done", row["error"]
    assert row["table_bytes"] > 0


def test_the_content_travels_to_workers_that_cannot_see_the_file(path, tmp_path):
    pytest.importorskip("distributed")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with cluster(elsewhere, [[]]) as (address, _):
        done = studies.study("run", path.name, "--dask", address, "--workers", 1, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    here = studies.run_here(Study(path, tmp_path / "here"))
    assert traced(Study(path))[0]["fingerprint"] == traced(here)[0]["fingerprint"]
