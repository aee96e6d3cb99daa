"""A study that is killed goes on where it was, and its table is that of one that was not."""

from __future__ import annotations

import json
import random
import signal
import time

import pytest

import studies
from installing import install
from kinetile.plugin.templates.new_plugin import new_plugin

TASKS = 64

DEADLY = '''"""A broad phase that takes its process with it, or all its memory."""

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
    folder = tmp_path_factory.mktemp("undisturbed")
    path = studies.write(folder)
    done = studies.study("run", path, "--workers", 2, "--json", folder=folder)
    assert done.returncode == 0, done.stderr
    assert studies.said(done)["statuses"] == {"done": TASKS}
    return studies.sorted_rows(path, folder)


def test_killed_three_times_and_begun_again_it_has_the_same_table(tmp_path, undisturbed):
    path = studies.write(tmp_path)
    results = tmp_path / "study.results"
    draw = random.Random(15)
    kept = {}
    for _ in range(3):
        process = studies.begin("run", path, "--workers", 2, folder=tmp_path)
        studies.wait_for_rows(process, results, len(kept) + draw.randrange(1, 16))
        workers = studies.workers_of(process.pid)
        studies.kill(process.pid)
        process.communicate()
        ends = time.monotonic() + 20
        while any(map(studies.is_alive, workers)) and time.monotonic() < ends:
            time.sleep(0.02)
        assert not any(map(studies.is_alive, workers))
        now = studies.all_rows(path)
        assert len(kept) < len(now) < TASKS
        assert {key: now[key] for key in kept} == kept  # nothing ran again, or its CPU time would be another
        kept = now
    done = studies.study("run", path, "--workers", 2, "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert studies.said(done)["ran"] == TASKS - len(kept)
    final = studies.all_rows(path)
    assert {key: final[key] for key in kept} == kept
    assert studies.sorted_rows(path, tmp_path) == undisturbed


def test_a_worker_that_is_killed_costs_no_row(tmp_path, undisturbed):
    path = studies.write(tmp_path)
    process = studies.begin("run", path, "--workers", 2, "--json", folder=tmp_path)
    studies.wait_for_rows(process, tmp_path / "study.results", 5)
    studies.kill(studies.workers_of(process.pid)[0])
    out, error = process.communicate(timeout=240)
    assert process.returncode == 0, (out, error)
    assert studies.sorted_rows(path, tmp_path) == undisturbed


def test_two_processes_share_a_study(tmp_path, undisturbed):
    path = studies.write(tmp_path)
    both = [studies.begin("run", path, "--workers", 1, "--json", folder=tmp_path) for _ in range(2)]
    ended = [process.communicate(timeout=240) for process in both]
    assert [process.returncode for process in both] == [0, 0], ended
    ran = [json.loads(out)["ran"] for out, _ in ended]
    assert sum(ran) == TASKS
    assert studies.sorted_rows(path, tmp_path) == undisturbed


def test_ctrl_c_ends_it_cleanly_with_what_was_done(tmp_path, undisturbed):
    path = studies.write(tmp_path)
    process = studies.begin("run", path, "--workers", 2, "--json", folder=tmp_path)
    studies.wait_for_rows(process, tmp_path / "study.results", 5)
    workers = studies.workers_of(process.pid)
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 130, (out, error)
    assert "interrupted" in error
    assert "Traceback" not in error
    assert not any(map(studies.is_alive, workers))
    assert list((tmp_path / "study.results" / "claims").iterdir()) == []
    done = studies.study("run", path, "--json", folder=tmp_path)
    assert 0 < studies.said(done)["ran"] < TASKS
    assert studies.sorted_rows(path, tmp_path) == undisturbed


@pytest.fixture(scope="module")
def deadly(tmp_path_factory):
    folder = tmp_path_factory.mktemp("deadly")
    package = new_plugin("deadly", folder)
    (package / "kinetile_deadly" / "phase.py").write_text(DEADLY, encoding="utf-8")
    return install(package, folder / "site")


def test_what_kills_its_worker_is_a_row_and_so_is_what_takes_its_memory(tmp_path, deadly):
    text = """
phases = ["naive", "deadly", "deadly:how=memory", "deadly:how=raise"]
seeds = [1, 2]
contacts = 5
scenes = [{ recipe = "grid", parameters = { bodies = 9 } }]
"""
    path = studies.write(tmp_path, text)
    done = studies.study("run", path, "--workers", 2, "--json", folder=tmp_path, paths=deadly)
    assert done.returncode == 1
    assert studies.said(done)["statuses"] == {"done": 2, "lost": 2, "out of memory": 2, "failed": 2}
    again = studies.study("run", path, "--workers", 2, "--json", folder=tmp_path, paths=deadly)
    assert studies.said(again)["ran"] == 0
    table = studies.sorted_rows(path, tmp_path, deadly).decode()
    assert "its worker died, twice" in table
    assert "the worker's memory did not suffice" in table
    assert "I do not feel like it" in table
    lost = studies.study("run", path, "--again", "lost", "--json", folder=tmp_path, paths=deadly)
    assert studies.said(lost)["ran"] == 2


def test_what_does_not_end_is_a_row(tmp_path, deadly):
    text = """
phases = ["deadly:how=endless", "naive"]
limit = 1
contacts = 5
scenes = [{ recipe = "grid", parameters = { bodies = 9 } }]
"""
    path = studies.write(tmp_path, text)
    done = studies.study("run", path, "--workers", 1, "--json", folder=tmp_path, paths=deadly)
    assert studies.said(done)["statuses"] == {"out of time": 1, "done": 1}, done.stderr
    assert (
        "more than 1 CPU seconds, the study's limit" in studies.sorted_rows(path, tmp_path, deadly).decode()
    )
