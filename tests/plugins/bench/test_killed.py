"""Studies that are killed, interrupted or broken: every task has one row, the same as undisturbed."""

import json
import multiprocessing
import os
import random
import signal
import subprocess
import sys
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

import pytest

import studies
from command_line import kinetile
from installing import install
from kinetile.plugin.new_plugin import new_plugin
from kinetile_bench import Study
from kinetile_bench.study.rows import RowFile
from kinetile_bench.study.task import StudyStopped
from kinetile_bench.study.workers import rows_of
from studies import TASKS

DEADLY = '''"""A broad phase that takes its process with it, or all its memory, or raises."""

import os

import kinetile as kt
from kinetile.toolbox import BroadPhaseParts


class DeadlyPhase:
    def __init__(self, how: str = "die") -> None:
        self.how = how

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        if self.how == "die":
            os._exit(9)
        if self.how == "raise":
            raise RuntimeError("I do not feel like it")
        return bytearray(1 << 50)
'''


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    study = Study(studies.write(tmp_path_factory.mktemp("undisturbed")))
    assert studies.run_here(study).statuses == {"done": TASKS}
    return studies.lasting(study)


@pytest.mark.parametrize(("kills", "workers"), [(1, 1), pytest.param(3, 2, marks=pytest.mark.slow)])
def test_killed_and_begun_again_it_has_the_same_rows(tmp_path, undisturbed, kills, workers):
    study = Study(studies.write(tmp_path))
    draw = random.Random(15)
    kept = {}
    for _ in range(kills):
        process = studies.begin("run", "study.toml", "--workers", workers, folder=tmp_path)
        studies.wait_for_rows(process, study, len(kept) + draw.randrange(1, 16))
        children = studies.workers_of(process.pid)
        studies.kill(process.pid)
        process.communicate()
        assert len(children) == workers
        assert studies.all_end(children)
        now = studies.by_key(study)
        assert len(kept) < len(now) < TASKS
        assert {key: now[key] for key in kept} == kept  # nothing ran again, or its CPU time would be another
        kept = now
    assert studies.run_here(study).ran == TASKS - len(kept)
    final = studies.by_key(study)
    assert {key: final[key] for key in kept} == kept
    assert studies.lasting(study) == undisturbed


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal")
def test_ctrl_c_loses_the_running_tasks_alone(tmp_path, undisturbed, monkeypatch):
    path = studies.write(tmp_path)
    study, put = Study(path), RowFile.put

    def interrupted(file, row):
        put(file, row)
        if len(study.rows()) == 5:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(RowFile, "put", interrupted)
    ended = kinetile("study", "run", path, "--workers", 1)
    monkeypatch.undo()
    assert ended.exit_code == 130
    assert f"{TASKS - 5} tasks have no row yet\nkinetile: interrupted" in ended.stderr
    assert multiprocessing.active_children() == []
    assert studies.run_here(study).ran == TASKS - 5
    assert studies.lasting(study) == undisturbed


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal to a group of processes")
def test_ctrl_c_while_workers_started_printed_a_traceback_of_each(tmp_path):
    studies.write(tmp_path)
    process = studies.begin("run", "study.toml", "--workers", 2, folder=tmp_path)
    while not studies.workers_of(process.pid):
        assert process.poll() is None, process.communicate()
    os.killpg(process.pid, signal.SIGINT)
    assert "Traceback" not in studies.ended(process, 130)[1]


@pytest.mark.slow
def test_what_kills_its_worker_or_takes_its_memory_is_a_row(tmp_path):
    package = new_plugin("deadly", tmp_path)
    (package / "kinetile_deadly" / "phase.py").write_text(DEADLY, encoding="utf-8")
    paths = install(package, tmp_path / "site")
    text = """
phases = ["deadly", "naive", "deadly:how=memory", "deadly:how=raise"]
contacts = 5
scenes = [{ recipe = "grid", parameters = { bodies = 9 } }]
"""
    studies.write(tmp_path, text)
    words = ("run", "study.toml", "--workers", 2, "--json")
    out, error = studies.ended(studies.begin(*words, folder=tmp_path, paths=paths), 1)
    assert json.loads(out)["statuses"] == {"lost": 1, "done": 1, "failed": 2}, error
    rows = {row["phase"]: row["error"] for row in RowFile(tmp_path / "study.sqlite").read()}
    assert rows["naive"] is None
    assert "its worker died, twice" in rows["deadly"]
    assert "MemoryError" in rows["deadly:how=memory"]
    assert "I do not feel like it" in rows["deadly:how=raise"]


TABLES = {"phases": ["naive"], "contacts": 5, "scenes": [{"recipe": "cradle"}]}


class Broken(Executor):
    def submit(self, *_, **__):
        raise BrokenExecutor("gone")


def test_an_executor_that_breaks_or_was_shut_down_ends_the_run_and_another_one_goes_on(tmp_path):
    shut_down = ThreadPoolExecutor(1)
    shut_down.shutdown()
    study = Study(TABLES, tmp_path / "rows.sqlite")
    for executor in (Broken(), shut_down):
        with pytest.raises(StudyStopped, match="the study goes on with another one"):
            study.run(executor)
    assert studies.run_here(study).statuses == {"done": 1}


class AtOnce(Executor):
    """Has the row of a task at once, which is the task, after some errors."""

    def __init__(self, errors=0):
        self.submitted, self.errors = 0, errors

    def submit(self, run, task):
        self.submitted += 1
        future = Future()
        if self.submitted <= self.errors:
            future.set_exception(ValueError("too many values to unpack (expected 3)"))
        else:
            future.set_result(task)
        return future


def test_a_row_that_its_worker_took_with_it_stopped_the_study():
    """Dask's executor has that error where a worker is killed after a task and before its row is fetched."""
    assert [row for row in rows_of([1, 2], AtOnce(errors=1), None) if row is not None] == [2, 1]
    with pytest.raises(StudyStopped, match="a task cannot run on its worker: ValueError: too many"):
        list(rows_of([1], AtOnce(errors=2), None))


def test_rows_waited_until_all_tasks_had_been_submitted():
    """A kill at that time lost all of them. And each row was waited for at the cost of all open tasks."""
    executor, found = AtOnce(), []
    for row in rows_of(range(100), executor, None):
        assert executor.submitted - len(found) <= 1
        found += [row] if row is not None else []
    assert found == [*range(100)]


@pytest.mark.slow
def test_workers_of_a_local_dask_cluster_give_the_rows_of_this_machine(tmp_path, undisturbed):
    distributed = pytest.importorskip("distributed")
    study = Study(studies.write(tmp_path))
    how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 50}
    with (
        distributed.LocalCluster(local_directory=str(tmp_path), **how) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        assert study.run(client.get_executor(pure=False)).statuses == {"done": TASKS}
    assert len({row["environment"]["host"] for row in study.rows()}) == 1
    assert studies.lasting(study) == undisturbed


@pytest.mark.slow
def test_a_script_without_its_guard_gets_the_line_that_is_missing(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"import kinetile_bench\nkinetile_bench.Study({TABLES!r}, 'here').run(workers=1)\n")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert done.returncode == 1
    assert "must be behind `if __name__ == '__main__':`" in done.stderr
