"""A study in this process: rows, errors, disagreement, versions, scene files, the file of rows, the table."""

import csv
import io
import json
import math
import os
import sqlite3
import sys
from contextlib import closing
from importlib.util import spec_from_file_location
from pathlib import Path

import pytest

import kinetile as kt
import studies
from command_line import kinetile
from kinetile.errors import BadOption, RecordError
from kinetile.scene.scene import Settings
from kinetile_bench import Study
from kinetile_bench.study import task as tasks
from kinetile_bench.study.plan import read_plan
from kinetile_bench.study.rows import RowFile
from kinetile_bench.study.summary import summary_of
from kinetile_bench.study.task import StudyStopped, run_task, tasks_of

TABLES = {
    "phases": ["naive", "cells"],
    "seeds": [1, 2],
    "until": 0.05,
    "scenes": [{"recipe": "grid", "parameters": {"bodies": [9, 16]}}],
}


MINE = 'phases = ["{}"]\ncontacts = 4\nscenes = [{{ file = "mine.toml" }}]\n'
"""A study of a scene file."""


def run(tables, folder, **how):
    study = Study(tables, folder / "rows.sqlite")
    return study, studies.run_here(study, **how)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    study, outcome = run(TABLES, tmp_path_factory.mktemp("done"))
    assert outcome.well
    assert outcome.statuses == {"done": 8}
    return study


def test_rows_are_those_of_simulations_in_the_order_of_the_tasks(done):
    rows = done.rows()
    places = [(row["parameters"]["bodies"], row["parameters"]["seed"], row["phase"]) for row in rows[:3]]
    assert places == [(9, 1, "naive"), (9, 1, "cells"), (9, 2, "naive")]
    for row in rows:
        sim = kt.Simulation(kt.make_scene("grid", **row["parameters"]), row["phase"])
        sim.run(until=0.05)
        assert row["fingerprint"] == sim.fingerprint
        assert row["contacts"] == len(sim.contacts)
        assert row["time"] == 0.05
        assert row["events"] == sim.readings.events
        assert row["environment"]["versions"]["kinetile"] == kt.__version__


def test_what_is_there_is_not_done_again_and_what_is_added_is(tmp_path):
    _, first = run(TABLES, tmp_path)
    _, second = run(TABLES, tmp_path)
    _, third = run({**TABLES, "phases": ["naive", "cells", "cells:side=0.5"]}, tmp_path)
    study, fourth = run({**TABLES, "seeds": [1]}, tmp_path)
    assert [each.ran for each in (first, second, third, fourth)] == [8, 0, 4, 0]
    assert (fourth.total, fourth.others) == (4, 8)
    assert len(study.rows()) == 4


@pytest.mark.small
def test_observables_are_columns_with_their_errors(tmp_path):
    tables = {"phases": ["naive"], "until": 2.0, "scenes": [{"recipe": "grid", "parameters": {"bodies": 4}}]}
    observe = ["rates:every=0.01", "g:bins=2"]
    study, outcome = run({**tables, "observe": observe}, tmp_path)
    assert outcome.well
    (row,) = study.rows()
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    sim.run(2.0, observe=observe)
    for quantity, (mean, error, blocks, *_) in sim.observed[observe[0]].items():
        names = (f"observed.{observe[0]}.{quantity}{end}" for end in ("", ".error", ".blocks"))
        assert [row[name] for name in names] == pytest.approx([mean, error, blocks])
    assert row["observed.g:bins=2.g"]["mean"] == pytest.approx(sim.observed["g:bins=2"]["g"].mean.tolist())


@pytest.mark.small
def test_two_lists_of_contacts_of_one_scene_are_reported_at_once(tmp_path, blind):
    tables = {"phases": ["naive", blind, "cells"], "contacts": 4, "scenes": [{"recipe": "cradle"}]}
    told = []
    study, outcome = run(tables, tmp_path, disagreed=told.append)
    assert not outcome.well
    assert len(told) == 1
    assert "naive and blind have different contacts" in told[0]
    assert outcome.disagreements == (told[0],)
    rows = study.rows()
    assert {row["status"] for row in rows} == {"disagrees"}
    assert all("other contacts than" in row["error"] for row in rows)
    assert run(tables, tmp_path, again=["disagrees"])[1].ran == 3


def test_an_error_in_a_run_is_a_row_and_a_refusal_is_another(tmp_path, monkeypatch):
    def refuse(self, scene, prepared=None):
        raise kt.errors.Refused("not today")

    def fail(self, until=None, **_):
        raise ValueError("no such\x1b[2J luck")

    tables = {**TABLES, "phases": ["naive"]}
    monkeypatch.setattr("kinetile_plugins.naive.Naive.prepare", refuse)
    study, outcome = run(tables, tmp_path / "refused")
    assert (outcome.well, outcome.statuses) == (True, {"refused": 4})
    assert {row["error"].partition(";")[0] for row in study.rows()} == {"not today"}
    monkeypatch.undo()
    monkeypatch.setattr("kinetile.run.simulation.Simulation.run", fail)
    study, outcome = run(tables, tmp_path)
    assert (outcome.well, outcome.statuses) == (False, {"failed": 4})
    assert {row["error"] for row in study.rows()} == {r"ValueError: no such\x1b[2J luck"}
    monkeypatch.undo()
    assert run(tables, tmp_path)[1].ran == 0
    assert run(tables, tmp_path, again=["failed"])[1].statuses == {"done": 4}


def test_a_worker_of_other_versions_stops_the_study(tmp_path, monkeypatch):
    study = Study(TABLES, tmp_path / "rows.sqlite")
    task = next(iter(study.tasks.values()))
    *before, (kind, name, source) = task.sources
    other = (*before, (kind, name, source.replace("kinetile ", "kinetile 9.")))
    with pytest.raises(StudyStopped, match=r"another broad phase naive \(kinetile \S+\) than the study"):
        run_task(task._replace(sources=other))
    monkeypatch.setattr(tasks, "ANSWER", 99)  # as of a newer kinetile, in the process that runs the tasks
    with pytest.raises(StudyStopped, match="install the same there"):
        studies.run_here(study)
    assert study.rows() == []


def test_responses_and_narrow_phases_of_a_scene_file_are_sources(tmp_path):
    """Rows of an older response were taken for rows of today's."""
    settings = Settings(narrow_phases=("wall", "disc"))
    kt.save_scene(
        kt.make_scene("cradle").replace(responses="stop", settings=settings), tmp_path / "mine.toml"
    )
    (task,) = Study(studies.write(tmp_path, MINE.format("naive"))).tasks.values()
    named = [(kind, name) for kind, name, _ in task.sources[1:]]
    assert named[:3] == [("response", "stop"), ("narrow phase", "wall"), ("narrow phase", "disc")]


def test_an_editable_package_that_a_finder_provides_has_a_digest(tmp_path, monkeypatch):
    """Such a package, as tools install one under development, always had the digest "unknown"."""
    (tmp_path / "elsewhere.py").write_text("x = 1\n")

    class Finder:
        @staticmethod
        def find_spec(name, path=None, target=None):
            if name == "made_up_package":
                return spec_from_file_location(name, tmp_path / "elsewhere.py")

    monkeypatch.setattr("sys.meta_path", [*sys.meta_path, Finder])
    one = tasks._digest_of("made_up_package:Phase")
    tasks._digest_of.cache_clear()
    (tmp_path / "elsewhere.py").write_text("x = 2\n")
    assert "unknown" != one != tasks._digest_of("made_up_package:Phase")
    assert tasks._digest_of("no_such_package:Phase") == "unknown"


def test_a_phase_of_this_process_goes_by_its_source(blind):
    tables = {**TABLES, "phases": ["naive", blind]}
    (kinetile, _, naive), (*_, mine) = (task.sources for task in list(tasks_of(read_plan(tables)))[:2])
    assert kinetile == ("framework", "kinetile", f"{kt.__version__}, answer {kt.ANSWER}")
    assert naive == ("broad phase", "naive", f"kinetile {kt.__version__}")
    assert "added in this process" in mine[2]
    assert mine[2].rpartition(" ")[2] != "unknown"


def test_a_second_run_at_the_same_time_did_all_tasks_again(tmp_path):
    refused = []

    def second(done, total):
        with pytest.raises(StudyStopped, match="another process runs this study"):
            run(TABLES, tmp_path, again=["done"])
        refused.append(done)

    study, status = run(TABLES, tmp_path, progress=second)
    assert (status.ran, status.statuses) == (8, {"done": 8})
    assert len(refused) >= 8
    assert list(tmp_path.iterdir()) == [study.results], "the lock leaves nothing"
    assert run(TABLES, tmp_path)[1].ran == 0


def test_a_file_that_is_no_study_s_is_refused_and_never_overwritten(tmp_path):
    text, other, folder, one = (tmp_path / name for name in ("notes.txt", "other.sqlite", "folder", "one"))
    text.write_text("what I wrote" * 100)
    one.write_text("1")  # SQLite takes one byte for none
    with sqlite3.connect(other) as file:
        file.execute("CREATE TABLE rows (key TEXT)")
    folder.mkdir()
    before = text.read_bytes(), other.read_bytes(), one.read_bytes()
    for path in (text, other, folder, one, text / "below"):
        study = Study(TABLES, path)
        # Nothing is below a file, so there are no rows.
        for use in (study.run, study.rows if path.exists() else study.run):
            with pytest.raises(RecordError, match="expected a file with rows of a study"):
                use()
    assert (text.read_bytes(), other.read_bytes(), one.read_bytes()) == before
    empty = tmp_path / "empty"
    empty.touch()  # of a study that was killed before its first row
    assert Study(TABLES, empty).rows() == []
    assert run({**TABLES, "seeds": 1}, tmp_path)[1].well


def sealed(content):
    return f"UPDATE rows SET content = {content}, digest = digest(key, course, {content})"


OTHER_DIGEST = "is not what was written: it has another digest"
NO_ROW = "is not a row of a task"
DAMAGES = [
    ("PRAGMA user_version = 1", r"format 1, and this .* format 2: run the study again, with a new file"),
    ("UPDATE rows SET content = substr(content, 9)", OTHER_DIGEST),
    ("UPDATE rows SET content = replace(content, '\"cpu_seconds\": ', '\"cpu_seconds\": 1')", OTHER_DIGEST),
    ("UPDATE rows SET key = 'another' WHERE rowid = 1", OTHER_DIGEST),
    *((f"UPDATE rows SET {name} = NULL", OTHER_DIGEST) for name in ("key", "course", "content", "digest")),
    ("UPDATE rows SET content = x'ff'", OTHER_DIGEST),
    ("UPDATE rows SET content = cast(x'ff' as text)", "Could not decode to UTF-8"),
    ("UPDATE rows SET content = zeroblob(17000000) WHERE rowid = 1", "string or blob too big"),
    *((sealed(each), NO_ROW) for each in ("NULL", "'1'", "'{}'", "'[]'", "'null'", "x'ff00'")),
    (sealed("'" + "[" * 100_000 + "'"), NO_ROW),
    (sealed("json_set(content, '$.deep', json('" + "[" * 9 + "]" * 9 + "'))"), NO_ROW),
    *((sealed(f"json_set(content, '$.{name}', 1)"), NO_ROW) for name in ("key", "status", "fingerprint")),
    ("DROP TABLE rows", "it has other tables, views or indices than a study makes"),
    ("ALTER TABLE rows ADD COLUMN more", "it has other tables"),
    (
        "DROP TABLE rows; CREATE VIEW rows AS SELECT hex(zeroblob(450000000)) AS content",
        "it has other tables",
    ),
]
"""Statements that damage a file of rows, and the messages."""


@pytest.mark.parametrize(("damage", "said"), DAMAGES, ids=range(len(DAMAGES)))
def test_damaged_rows_were_believed_or_tracebacks(done, tmp_path, damage, said):
    path = tmp_path / "rows.sqlite"
    path.write_bytes(done.results.read_bytes())
    with closing(sqlite3.connect(path)) as file:
        file.create_function("digest", 3, lambda *values: tasks.digest(values))
        file.executescript(damage)
    before = path.read_bytes()
    for use in (Study(TABLES, path).run, Study(TABLES, path).status):
        with pytest.raises(RecordError, match=said) as found:
            use()
        assert str(found.value).isprintable()
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_values_that_are_no_numbers_or_too_large_ended_a_table_in_a_traceback():
    plan = read_plan({**TABLES, "seeds": 8, "phases": ["naive"]})
    values = [1, "much", None, [2.0], 10**400, math.nan, 1e308, 1e308]
    kinds = ({"status": "done", "contacts": value, "time": value} for value in [*values, *[1.0] * 8])
    rows = [tasks.row_of(*each) for each in zip(tasks_of(plan), kinds, strict=True)]
    first, second = summary_of(plan, rows, "time")["groups"]
    assert (first["mean"], first["contacts"], second["mean"]) == (None, None, 1.0)


@pytest.mark.parametrize("end", ["", "-journal", ".running", ".running-journal"])
@pytest.mark.parametrize("kind", ["folder", "pipe", "device"])
def test_a_folder_a_pipe_or_a_device_in_place_of_a_file_was_a_traceback_or_no_end(done, tmp_path, end, kind):
    study, place = Study(TABLES, tmp_path / "rows.sqlite"), tmp_path / f"rows.sqlite{end}"
    if end:
        study.results.write_bytes(done.results.read_bytes())
    if kind == "pipe":
        getattr(os, "mkfifo", Path.mkdir)(place)
    elif kind == "device":
        place.symlink_to(os.devnull)
    else:
        place.mkdir()
    with pytest.raises(RecordError, match=rf"rows\.sqlite{end} cannot be used|rows\.sqlite{end}: "):
        study.run()
    assert place.is_dir() or not place.is_file()


def test_a_file_in_place_of_the_lock_was_a_traceback_or_was_removed(tmp_path):
    study, lock = Study(TABLES, tmp_path / "rows.sqlite"), tmp_path / "rows.sqlite.running"
    lock.write_text("my notes")
    with pytest.raises(RecordError, match="is there and is no lock of a study: move it away"):
        study.run()
    assert lock.read_text() == "my notes"


@pytest.mark.skipif(sys.platform == "win32", reason="sets a limit of POSIX")
def test_a_disk_that_is_full_keeps_the_rows_that_came(done, tmp_path):
    resource = pytest.importorskip("resource")
    file, row, kept = RowFile(tmp_path / "rows.sqlite"), done.rows()[0], []
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))  # as on a disk with so much space

    def fill():
        for k in range(100):
            file.put(row | {"key": str(k)})
            kept.append(str(k))

    try:
        with pytest.raises(RecordError, match=r"rows\.sqlite cannot be used: .*disk"):
            fill()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert len(kept) > 3
    assert [each["key"] for each in file.read()] == kept
    file.put(row)
    assert len(file.read()) == len(kept) + 1


def test_a_row_that_another_process_has_written_stays(done, tmp_path):
    file = RowFile(tmp_path / "rows.sqlite")
    row = done.rows()[0] | {"lateness": math.inf}
    file.put(row)
    file.put(row | {"status": "failed"})
    (kept,) = file.read()
    assert kept == row | {"lateness": None}  # JSON has no infinity
    with sqlite3.connect(file.path) as any_reader:
        content = "content ->> '$.parameters.bodies', content ->> '$.fingerprint'"
        assert list(any_reader.execute(f"SELECT {content} FROM rows")) == [(9, row["fingerprint"])]


# Scene files

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
    sim = kt.Simulation(kt.make_scene("grid", bodies=16), "naive", live=True)
    sim.run(until=0.05)
    sim.set_velocities([turn], (0.5, -0.25))
    sim.remove(2)
    sim.run(until=0.2)
    kt.save_scene(sim.recorded(), folder / "trace.toml")
    return sim


@pytest.mark.small
def test_rows_of_a_recording_have_the_fingerprint_of_the_run_that_it_records(tmp_path):
    path, sim = studies.write(tmp_path, TRACED), record(tmp_path)
    study = Study(path)
    (tmp_path / "trace.toml").unlink()  # what was read when the study was made is what is run
    assert studies.run_here(study).statuses == {"done": 8}
    rows = [row for row in study.rows() if row["recipe"] == "trace.toml"]
    assert [row["fingerprint"] for row in rows] == [sim.fingerprint] * 4
    assert {each["scene"]["recipe"] for each in study.table("events")["groups"]} == {"trace.toml", "grid"}
    record(tmp_path)  # the same content again, and by another name
    (tmp_path / "trace.toml").rename(tmp_path / "moved.toml")
    path.write_text(TRACED.replace("trace.toml", "moved.toml"))
    assert Study(path).status().open == 0
    record(tmp_path, turn=5)  # another content: its rows are not taken for these
    path.write_text(TRACED)
    status = Study(path).status()
    assert (status.open, status.others) == (4, 4)


@pytest.mark.small
def test_the_end_of_a_scene_file_is_the_end_of_its_runs_where_the_study_has_none(tmp_path):
    record(tmp_path)
    recorded = (tmp_path / "trace.toml").read_text().replace("until", "# until").replace("end", "# end")
    (tmp_path / "trace.toml").write_text(f"until = 0.125\n{recorded}")
    path = studies.write(tmp_path, 'phases = ["naive"]\nscenes = [{ file = "trace.toml" }]\n')
    assert [task.scene.until for task in Study(path).tasks.values()] == [0.125]


def test_means_are_over_seeds_and_ratios_are_paired_by_seed():
    plan = read_plan({**TABLES, "seeds": 3, "repeats": 2})
    rows = []
    for task in tasks_of(plan):
        seed, cells = task.scene.parameters["seed"], task.phase == "cells"
        value = seed * task.scene.parameters["bodies"] * (2.0 if cells else 1.0) + (
            0.5 if task.repeat == 2 else -0.5
        )
        status = "failed" if (seed, task.phase) == (3, "naive") else "done"
        row = {
            "status": status,
            "time": None if status == "failed" else value,
            "contacts": 7,
            "cpu_seconds": 1.0,
        }
        rows.append(tasks.row_of(task, row))
    found = summary_of(plan, rows, "time")
    assert (found["base"], found["varied"]) == ("naive", ["bodies"])
    naive, cells = found["groups"][:2]
    assert (naive["phase"], naive["rows"], naive["odd"], naive["ratio"]) == ("naive", 6, "2 failed", None)
    assert (naive["mean"], naive["error"]) == (13.5, 4.5)
    assert (cells["mean"], cells["error"]) == (36.0, pytest.approx(18.0 / math.sqrt(3)))
    assert (cells["ratio"], cells["ratio_error"]) == (pytest.approx(2.0), pytest.approx(0.0))
    with pytest.raises(BadOption, match="did you mean 'time'"):
        summary_of(plan, rows, "tim")
    assert summary_of(plan, [], "time")["groups"] == []


def test_runs_of_one_scene_to_two_ends_were_averaged():
    scenes = [{"recipe": "cradle", "until": 1.0}, {"recipe": "cradle", "until": 2.0, "contacts": 9}]
    plan = read_plan({"phases": ["naive"], "scenes": scenes})
    rows = [
        tasks.row_of(task, {"status": "done", "contacts": 7, "time": float(k)})
        for k, task in enumerate(tasks_of(plan))
    ]
    found = summary_of(plan, rows, "time")
    assert found["varied"] == ["until", "contacts_asked"]
    assert [(each["scene"]["until"], each["mean"]) for each in found["groups"]] == [(1.0, 0.0), (2.0, 1.0)]


@pytest.mark.small
def test_rows_have_the_names_that_the_study_has_today(tmp_path):
    """A phase whose options had been written in another way was a KeyError of ``table``."""
    once = {**TABLES, "phases": ["sap-1d: axis=y"], "seeds": 1, "contacts": 3}
    assert run(once, tmp_path)[1].well
    study = Study({**once, "phases": ["sap-1d:axis=y"]}, tmp_path / "rows.sqlite")
    assert study.status().open == 0
    assert {row["phase"] for row in study.rows()} == {"sap-1d:axis=y"}
    assert {each["rows"] for each in study.table()["groups"]} == {1}


def test_the_commands_say_how_it_stands_in_text_json_and_csv(tmp_path, done):
    path = studies.write(
        tmp_path,
        'phases = ["naive", "cells"]\nseeds = [1, 2]\nuntil = 0.05\n'
        'scenes = [{ recipe = "grid", parameters = { bodies = [9, 16] } }]\n',
    )

    def command(*words):
        return kinetile("study", *words, "--results", done.results)

    table = command("table", path, "--y", "events")
    assert table.exit_code == 0
    assert "8 tasks: 8 done, 0 open" in table.stdout
    assert "events: mean over seeds, ratio to naive paired by seed" in table.stdout
    assert json.loads(command("table", path, "--json").stdout)["status"]["statuses"] == {"done": 8}
    rows = list(csv.DictReader(io.StringIO(command("table", path, "--y", "events", "--csv").stdout)))
    assert [(row["scene.bodies"], row["phase"]) for row in rows[:3]] == [
        ("9", "naive"),
        ("9", "cells"),
        ("16", "naive"),
    ]
    assert [float(row["mean"]) for row in rows] == [each["mean"] for each in done.table("events")["groups"]]
    every = list(csv.DictReader(io.StringIO(command("rows", path).stdout)))
    assert [row["fingerprint"] for row in every] == [row["fingerprint"] for row in done.rows()]
    assert json.loads(command("rows", path, "--json").stdout) == done.rows()
    assert json.loads(command("run", path, "--workers", 1, "--json").stdout)["ran"] == 0
    assert command("table", path, "--y", "event").exit_code == 2
    assert "cannot be read: No such file" in command("run", tmp_path / "none.toml").stderr
