"""Rows on disk: each once, whatever is gathered, killed, damaged or full on the way."""

from __future__ import annotations

import errno
import hashlib
import os
import subprocess
import sys

import pytest

from kinetile.errors import RecordError
from kinetile_bench import store as storing
from kinetile_bench.plan import read_plan
from kinetile_bench.rows import FIXED, TIMINGS, row_of
from kinetile_bench.store import Store, TaskClaims
from kinetile_bench.task import tasks_of

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


def failing(number):
    """Return a function that fails as a disk does."""

    def fails(*_, **__):
        raise OSError(number, os.strerror(number))

    return fails


def put(store, *numbers):
    for k in numbers:
        store.put(row(k))


def keys_of(*numbers):
    return sorted(TASKS[k].key for k in numbers)


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
    put(store, *range(3))
    assert files(store) == [3, 0]
    before = store.read().sort_by("key")
    store.gather()
    assert files(store) == [0, 1]
    assert store.read().sort_by("key").to_pylist() == before.to_pylist()
    assert set(before.column_names) == set(FIXED) | {"bodies", "density", "seed", "speed", "temperature"}
    assert set(TIMINGS) < set(FIXED)
    assert sorted(before["seed"].to_pylist()) == [1, 2, 3]


def test_small_parts_are_gathered_into_one(store, monkeypatch):
    monkeypatch.setattr(storing, "GATHER", 2)
    put(store, *range(40))
    assert files(store)[1] < 20
    assert keys(store) == keys_of(*range(40))


def test_killed_between_a_part_and_the_files_it_was_gathered_from_a_row_is_still_one(store, monkeypatch):
    put(store, *range(5))
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


def test_rows_can_be_forgotten(store):
    put(store, *range(4))
    store.gather()
    store.put(row(4))
    store.forget([TASKS[1].key, TASKS[4].key])
    assert keys(store) == keys_of(0, 2, 3)
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


def test_control_characters_in_an_error_are_escaped_in_its_row(store):
    store.put(row(0, status="failed", error="ValueError: \x1b[2Jgone\0\n"))
    assert store.read()["error"].to_pylist() == [r"ValueError: \x1b[2Jgone\x00\n"]


def test_a_full_disk_is_told_and_costs_no_row_that_was_there(store, monkeypatch):
    store.put(row(0))
    with monkeypatch.context() as disk:
        disk.setattr(storing, "replacing", failing(errno.ENOSPC))
        with pytest.raises(RecordError, match="No space left"):
            store.put(row(1))
        with pytest.raises(RecordError, match="No space left"):
            store.gather()
    assert keys(store) == keys_of(0)
    (left,) = (store.folder / "rows" / "new").iterdir()
    assert left.name.startswith(f"{TASKS[0].key}.")


def test_a_claim_is_one_processs_and_goes_with_it(tmp_path):
    claims = TaskClaims(tmp_path)
    assert claims.take("a")
    program = (
        "import sys, pathlib; from kinetile_bench.store import TaskClaims; "
        "c = TaskClaims(pathlib.Path(sys.argv[1])); print(c.take('a'), c.take('b'), flush=True); "
        "sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        try:
            assert other.stdout.readline().split() == ["False", "True"]
            assert not claims.take("b")
        finally:
            other.kill()
    assert claims.take("b")
    claims.give_back("a")
    (tmp_path / "left").touch()
    claims.close()
    assert list(tmp_path.iterdir()) == []


def test_a_flipped_bit_in_a_part_is_never_read_as_another_table(store):
    put(store, *range(3))
    store.gather()
    (part,) = (store.folder / "rows" / "parts").iterdir()
    whole = part.read_bytes()
    for bit in range(0, 8 * len(whole), 8 * len(whole) // 200):
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        part.write_bytes(damaged)
        with pytest.raises(RecordError, match=f"{part.name} is damaged"):
            Store(store.folder).read()
    part.write_bytes(whole)
    assert keys(store) == keys_of(*range(3))


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" * 20], ids=len)
@pytest.mark.parametrize("name", ["old.parquet", "part.0123456789abcdef0123456789abcdef.parquet"])
def test_a_part_that_is_none_is_a_typed_error_wherever_it_is_met(store, name, content):
    store.put(row(0))
    (store.folder / "rows" / "parts" / name).write_bytes(content)
    for use in (store.read, lambda: Store(store.folder).has("k"), lambda: store.forget(["k"])):
        with pytest.raises(RecordError, match="is damaged"):
            use()
    store.gather()  # leaves what it cannot read where it is
    assert (store.folder / "rows" / "parts" / name).read_bytes() == content


def test_a_read_that_fails_takes_no_row_away(store, monkeypatch):
    put(store, *range(20))
    fails = failing(errno.EIO)

    with monkeypatch.context() as disk:
        disk.setattr(storing.Path, "read_bytes", fails)
        disk.setattr("pyarrow.parquet.ParquetFile", fails)
        for use in (store.read, store.gather, lambda: store.forget(["k"])):
            with pytest.raises(RecordError, match="Input/output error"):
                use()
    assert keys(Store(store.folder)) == keys_of(*range(20))
    store.gather()
    assert keys(Store(store.folder)) == keys_of(*range(20))


def test_a_damaged_row_is_set_aside_counted_and_done_again(store):
    put(store, 0, 1)
    (path,) = (store.folder / "rows" / "new").glob(f"{TASKS[1].key}*")
    path.write_bytes(path.read_bytes()[:-9])
    damaged = path.read_bytes()
    other = Store(store.folder)
    assert keys(other) == keys_of(0)
    assert not other.has(TASKS[1].key)
    assert other.damaged() == 1
    assert (store.folder / "damaged" / path.name).read_bytes() == damaged
    other.put(row(1))
    assert keys(other) == keys_of(*range(2))


def test_rows_without_a_checksum_are_read_and_have_one_when_they_are_gathered(store):
    store.put(row(0))
    (path,) = (store.folder / "rows" / "new").iterdir()
    path.rename(path.with_name(f"{TASKS[0].key}.parquet"))
    old = Store(store.folder)
    assert old.has(TASKS[0].key)
    assert keys(old) == keys_of(0)
    old.gather()
    assert keys(old) == keys_of(0)
    (part,) = (store.folder / "rows" / "parts").iterdir()
    assert hashlib.sha256(part.read_bytes()).hexdigest().startswith(part.name.split(".")[1])


def test_a_disk_that_fails_is_a_typed_error_at_every_use_of_a_store(store, monkeypatch):
    store.put(row(0))
    fails = failing(errno.EIO)

    uses = (
        lambda: store.has(TASKS[1].key),
        store.read,
        store.gather,
        lambda: store.claims.take("a"),
        store.close,
    )
    with monkeypatch.context() as disk:
        disk.setattr("kinetile_bench.store.os.open", fails)
        disk.setattr(storing.os, "scandir", fails)
        disk.setattr(storing.Path, "iterdir", fails)
        for use in uses:
            with pytest.raises(RecordError, match="Input/output error"):
                use()
    assert keys(store) == keys_of(0)
