"""Rows on disk: each once, whatever is gathered, killed, damaged or full on the way."""

from __future__ import annotations

import errno
import os
import subprocess
import sys

import pytest

from kinetile.bench.study.file import read_plan, tasks_of
from kinetile.bench.study.store import rows as storing
from kinetile.bench.study.store.claims import Claims
from kinetile.bench.study.store.columns import FIXED, TIMINGS, row_of
from kinetile.bench.study.store.rows import Store
from kinetile.errors import RecordError

TASKS = list(
    tasks_of(
        read_plan(
            {
                "phases": ["naive"],
                "contacts": 5,
                "seeds": {"from": 1, "to": 60},
                "scenes": [{"recipe": "grid", "parameters": {"bodies": 9}}],
            }
        )
    )
)


def row(k, **more):
    return row_of(TASKS[k], {"status": "done", "fingerprint": "f", "cpu_seconds": float(k), **more}, 1)


@pytest.fixture
def store(tmp_path):
    found = Store(tmp_path / "results")
    found.open()
    return found


def files(store):
    return [
        len([each for each in (store.folder / "rows" / name).iterdir() if each.suffix == ".parquet"])
        for name in ("new", "parts")
    ]


def keys(store):
    return sorted(store.read(["key"])["key"].to_pylist())


def test_rows_are_read_with_all_columns_whether_gathered_or_not(store):
    for k in range(3):
        store.put(row(k))
    assert files(store) == [3, 0]
    before = store.read().sort_by("key")
    store.gather()
    assert files(store) == [0, 1]
    assert store.read().sort_by("key").to_pylist() == before.to_pylist()
    assert set(before.column_names) == set(FIXED) | {"bodies", "density", "seed", "speed"}
    assert set(TIMINGS) < set(FIXED)
    assert sorted(before["seed"].to_pylist()) == [1, 2, 3]


def test_small_parts_are_gathered_into_one(store, monkeypatch):
    monkeypatch.setattr(storing, "GATHER", 2)
    for k in range(40):
        store.put(row(k))
    assert files(store)[1] < 20
    assert keys(store) == sorted(task.key for task in TASKS[:40])


def test_killed_between_a_part_and_the_files_it_was_gathered_from_a_row_is_still_one(store, monkeypatch):
    for k in range(5):
        store.put(row(k))
    with monkeypatch.context() as killed:
        killed.setattr(storing.Path, "unlink", lambda *_, **__: None)
        store.gather()
    assert files(store) == [5, 1]
    assert len(keys(store)) == 5
    again = Store(store.folder)
    again.gather()
    assert files(store) == [0, 2]
    assert len(keys(store)) == 5


def test_another_process_sees_a_row_wherever_it_is(store):
    other = Store(store.folder)
    assert not other.has(TASKS[0].key)
    store.put(row(0))
    assert other.has(TASKS[0].key)
    store.gather()
    third = Store(store.folder)
    assert third.has(TASKS[0].key)
    assert not third.has(TASKS[1].key)


def test_a_row_that_never_reached_the_disk_is_done_again(store):
    store.put(row(0))
    store.put(row(1))
    (store.folder / "rows" / "new" / f"{TASKS[1].key}.parquet").write_bytes(b"PAR1")
    assert keys(Store(store.folder)) == [TASKS[0].key]
    assert not Store(store.folder).has(TASKS[1].key)


def test_rows_can_be_forgotten(store):
    for k in range(4):
        store.put(row(k))
    store.gather()
    store.put(row(4))
    store.forget([TASKS[1].key, TASKS[4].key])
    assert keys(store) == sorted(TASKS[k].key for k in (0, 2, 3))
    assert not store.has(TASKS[1].key)


def test_a_parameter_that_is_text_in_one_recipe_and_a_number_in_another_is_text(store):
    task = TASKS[0]
    store.put(row_of(task._replace(key="a", parameters={"kind": "hex"}), {"status": "done"}, 0))
    store.put(row_of(task._replace(key="b", parameters={"kind": 3}), {"status": "done"}, 0))
    assert sorted(store.read()["kind"].to_pylist()) == ["3", "hex"]


def test_a_parameter_with_the_name_of_a_column_has_another(store):
    store.put(
        row_of(
            TASKS[0]._replace(parameters={"time": 3}), {"status": "done", "time": 1.0, "cpu_seconds": 2.0}, 0
        )
    )
    (found,) = store.read().to_pylist()
    assert (found["time"], found["scene_time"], found["cpu_seconds_per_time"]) == (1.0, 3, 2.0)


def test_a_full_disk_is_told_and_costs_no_row_that_was_there(store, monkeypatch):
    store.put(row(0))

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as disk:
        disk.setattr("pyarrow.parquet.write_table", full)
        with pytest.raises(RecordError, match="No space left"):
            store.put(row(1))
        with pytest.raises(RecordError, match="No space left"):
            store.gather()
    assert keys(store) == [TASKS[0].key]
    assert [each.name for each in (store.folder / "rows" / "new").iterdir()] == [f"{TASKS[0].key}.parquet"]


def test_a_claim_is_one_processs_and_goes_with_it(tmp_path):
    claims = Claims(tmp_path)
    assert claims.take("a")
    program = (
        "import sys, pathlib; from kinetile.bench.study.store.claims import Claims; "
        "c = Claims(pathlib.Path(sys.argv[1])); print(c.take('a'), c.take('b'), flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", program, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert other.stdout.readline().split() == ["False", "True"]
    assert not claims.take("b")
    other.kill()
    other.wait()
    assert claims.take("b")
    claims.give_back("a")
    (tmp_path / "left").touch()
    claims.close()
    assert list(tmp_path.iterdir()) == []
