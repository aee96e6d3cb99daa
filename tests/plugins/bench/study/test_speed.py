"""What the machinery costs beside the simulation, and how long many rows take to read."""

from __future__ import annotations

import os
import time

import pytest

import kinetile as kt
import studies
from kinetile_bench import Study
from kinetile_bench.study.store.columns import arrow, row_of, table_of

pytestmark = [pytest.mark.slow, pytest.mark.compiled]

TINY = """
phases = ["cells"]
seeds = {{ from = 1, to = {seeds} }}
contacts = 5
scenes = [{{ recipe = "grid", parameters = {{ bodies = 25 }} }}]
"""


def cpu_seconds() -> float:
    return sum(os.times()[:4])


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
    arrow()
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
