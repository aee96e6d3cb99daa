"""Runs of a study that are killed, interrupted or shared: every task has one row, the same as undisturbed."""

from __future__ import annotations

import json
import multiprocessing
import os
import random
import signal

import pytest

import studies
from clusters import cluster
from installing import install
from kinetile.plugin.new_plugin import new_plugin
from kinetile_bench import Study
from kinetile_bench.store import Store
from studies import TASKS

DEADLY = '''"""A broad phase that takes its process with it, or all its memory, or never ends."""

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
        while self.how == "endless":
            pass
        return bytearray(1 << 50)
'''


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    path = studies.write(tmp_path_factory.mktemp("undisturbed"))
    assert studies.status_here(Study(path)).statuses == {"done": TASKS}
    return studies.table(path)


@pytest.mark.parametrize(("kills", "workers"), [(1, 1), pytest.param(3, 2, marks=pytest.mark.slow)])
def test_killed_and_begun_again_it_has_the_same_rows(tmp_path, undisturbed, kills, workers):
    path = studies.write(tmp_path)
    results = tmp_path / "study.results"
    draw = random.Random(15)
    kept = {}
    for _ in range(kills):
        process = studies.begin("run", path, "--workers", workers, folder=tmp_path)
        studies.wait_for_rows(process, results, len(kept) + draw.randrange(1, 16))
        children = studies.workers_of(process.pid)
        studies.kill(process.pid)
        process.communicate()
        assert len(children) == workers
        assert studies.all_end(children)
        now = studies.all_rows(path)
        assert len(kept) < len(now) < TASKS
        assert {key: now[key] for key in kept} == kept  # nothing ran again, or its CPU time would be another
        kept = now
    assert studies.status_here(Study(path)).ran == TASKS - len(kept)
    final = studies.all_rows(path)
    assert {key: final[key] for key in kept} == kept
    assert studies.table(path) == undisturbed


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_worker_that_is_killed_costs_no_row(tmp_path, undisturbed, workers):
    path = studies.write(tmp_path)
    killed = []

    def kill_one(state):
        if state.done >= 5 and not killed:
            killed.append(multiprocessing.active_children()[0].pid)
            studies.kill(killed[0])

    assert Study(path).run(workers=workers, progress=kill_one).statuses == {"done": TASKS}
    assert killed
    assert multiprocessing.active_children() == []
    assert studies.table(path) == undisturbed


def test_a_task_that_another_process_has_claimed_is_left_to_it(tmp_path):
    path = studies.write(tmp_path)
    key = next(iter(Study(path).tasks))
    store = Store(tmp_path / "study.results")
    store.open()
    assert store.claims.take(key)
    status = studies.status_here(Study(path))
    assert (status.ran, status.elsewhere, status.open) == (TASKS - 1, 1, 1)
    store.claims.give_back(key)
    assert studies.status_here(Study(path)).ran == 1


@pytest.mark.slow
def test_two_processes_share_a_study(tmp_path, undisturbed):
    path = studies.write(tmp_path)
    other = studies.begin("run", path, "--workers", 1, "--json", folder=tmp_path)
    studies.wait_for_rows(other, tmp_path / "study.results", 1)
    here = studies.status_here(Study(path))
    there = json.loads(studies.ended(other)[0])
    assert here.ran + there["ran"] == TASKS
    assert there["ran"] > 0 < here.ran
    assert studies.table(path) == undisturbed


@pytest.mark.slow
def test_ctrl_c_ends_it_cleanly_with_what_was_done(tmp_path, undisturbed, monkeypatch):
    path = studies.write(tmp_path)
    put = Store.put

    def interrupted(store, row):
        put(store, row)
        if studies.rows_there(store.folder) == 5:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Store, "put", interrupted)
    ended = studies.kinetile("study", "run", path, "--workers", 1)
    monkeypatch.undo()
    assert ended.exit_code == 130
    assert "interrupted; " in ended.stderr
    assert multiprocessing.active_children() == []
    assert list((tmp_path / "study.results" / "claims").iterdir()) == []
    assert 0 < studies.status_here(Study(path)).ran < TASKS
    assert studies.table(path) == undisturbed


@pytest.mark.slow
def test_what_kills_its_worker_takes_its_memory_or_does_not_end_is_a_row(tmp_path):
    package = new_plugin("deadly", tmp_path)
    (package / "kinetile_deadly" / "phase.py").write_text(DEADLY, encoding="utf-8")
    paths = install(package, tmp_path / "site")
    text = """
phases = ["deadly", "naive", "deadly:how=memory", "deadly:how=raise", "deadly:how=endless"]
limit = 1
contacts = 5
scenes = [{ recipe = "grid", parameters = { bodies = 9 } }]
"""
    path = studies.write(tmp_path, text)
    done = studies.study("run", path, "--workers", 1, "--json", folder=tmp_path, paths=paths)
    assert done.returncode == 1
    statuses = {"done": 1, "lost": 1, "out of memory": 1, "failed": 1, "out of time": 1}
    assert studies.said(done)["statuses"] == statuses, done.stderr
    rows = Store(tmp_path / "study.results").read().to_pylist()
    errors = {row["status"]: row["error"] for row in rows}
    assert "its worker died, twice" in errors["lost"]
    assert "the worker's memory did not suffice" in errors["out of memory"]
    assert "I do not feel like it" in errors["failed"]
    assert "more than 1 CPU seconds, the study's limit" in errors["out of time"]


MANY = """
phases = ["naive", "cells", "sap-1d", "sweep-tiling"]
seeds = { from = 1, to = 25 }
contacts = 200
[[scenes]]
recipe = "grid"
parameters = { bodies = [9, 16, 25, 49, 100], density = [0.5, 0.25, 0.125, 0.01] }
"""


@pytest.mark.long
@pytest.mark.compiled
def test_2000_tasks_killed_three_times_or_on_a_cluster_have_the_same_rows(tmp_path):
    pytest.importorskip("distributed")
    tasks = 2000
    here, killed, there = (studies.write(tmp_path / name, MANY) for name in ("here", "killed", "there"))
    compiled = {"folder": tmp_path, "interpreted": False}
    studies.ended(studies.begin("run", here, **compiled))
    table = studies.table(here)
    assert len(table) == tasks
    draw = random.Random(2000)
    kept = {}
    for _ in range(3):
        process = studies.begin("run", killed, **compiled)
        more = draw.randrange(1, tasks // 4)
        studies.wait_for_rows(process, tmp_path / "killed" / "study.results", len(kept) + more)
        studies.kill(process.pid)
        process.communicate()
        now = studies.all_rows(killed)
        assert {key: now[key] for key in kept} == kept
        kept = now
    studies.ended(studies.begin("run", killed, **compiled))
    assert len(kept) < tasks
    final = studies.all_rows(killed)
    assert {key: final[key] for key in kept} == kept
    assert studies.table(killed) == table
    with cluster(tmp_path, [[], [], []], interpreted=False) as (address, workers):
        process = studies.begin("run", there, "--dask", address, "--workers", 3, **compiled)
        studies.wait_for_rows(process, tmp_path / "there" / "study.results", tasks // 3)
        workers[0].kill()
        studies.ended(process)
    assert studies.table(there) == table
