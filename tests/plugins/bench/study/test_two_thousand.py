"""The study of 2,000 tasks: killed three times, on three Dask workers of which one is killed, one table."""

from __future__ import annotations

import random

import pytest

import studies
from clusters import cluster

pytestmark = [pytest.mark.slow, pytest.mark.compiled]

TEXT = """
phases = ["naive", "cells", "sap-1d", "sweep-tiling"]
seeds = { from = 1, to = 25 }
contacts = 200
[[scenes]]
recipe = "grid"
parameters = { bodies = [9, 16, 25, 49, 100], density = [0.5, 0.25, 0.125, 0.01] }
"""
TASKS = 2000


def ended(process):
    out, error = process.communicate(timeout=1200)
    assert process.returncode == 0, (out, error)


def test_killed_on_one_machine_or_run_on_a_cluster_the_table_is_one(tmp_path):
    here, killed, there = (studies.write(tmp_path / name, TEXT) for name in ("here", "killed", "there"))
    ended(studies.begin("run", here, folder=tmp_path, interpreted=False))
    table = studies.sorted_rows(here, tmp_path)
    assert table.count(b"\n") == TASKS + 1
    draw = random.Random(2000)
    kept = {}
    for _ in range(3):
        process = studies.begin("run", killed, folder=tmp_path, interpreted=False)
        more = draw.randrange(1, TASKS // 4)
        studies.wait_for_rows(process, tmp_path / "killed" / "study.results", len(kept) + more)
        studies.kill(process.pid)
        process.communicate()
        now = studies.all_rows(killed)
        assert {key: now[key] for key in kept} == kept
        kept = now
    ended(studies.begin("run", killed, folder=tmp_path, interpreted=False))
    assert len(kept) < TASKS
    final = studies.all_rows(killed)
    assert {key: final[key] for key in kept} == kept
    assert studies.sorted_rows(killed, tmp_path) == table
    with cluster(tmp_path, [[], [], []], interpreted=False) as (address, workers):
        process = studies.begin(
            "run", there, "--dask", address, "--workers", 3, folder=tmp_path, interpreted=False
        )
        studies.wait_for_rows(process, tmp_path / "there" / "study.results", TASKS // 3)
        workers[0].kill()
        ended(process)
    assert studies.sorted_rows(there, tmp_path) == table
