"""One writer a file, nothing overwritten unasked, and the truth about files that are lost meanwhile."""

import errno
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import RecordError
from kinetile.records import EventRecorder, locks, read_events, recover

pytest.importorskip("pyarrow")

needs_locks = pytest.mark.skipif(locks.flock is None, reason="there are no locks here")
SCENE = kt.Scene([[1.0, 1.0], [3.0, 1.0]], [[1.0, 0.0], [-1.0, 0.0]], 0.5)


def rows(count: int) -> np.ndarray:
    made = np.zeros(count, kt.LOG)
    made["tick"] = np.arange(count)
    made["time"] = made["tick"] * 2.0**-52
    made["b"] = 1
    return made


def record(path, meanwhile) -> EventRecorder:
    recorder = EventRecorder(path, SCENE)
    with recorder:
        recorder(rows(5))
        meanwhile()
    return recorder


def refused(said: str, path, **how) -> None:
    with pytest.raises(RecordError, match=said), EventRecorder(path, SCENE, **how):
        pass


def names(folder) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


def test_a_file_that_was_there_was_overwritten_unasked(tmp_path):
    path = tmp_path / "e.parquet"
    recorder = EventRecorder(path, SCENE)
    path.write_text("precious")  # between making and opening it
    said = r"is there already: choose another name, or .*overwrite=True"
    with pytest.raises(RecordError, match=said), recorder:
        pass
    assert path.read_text() == "precious"
    with EventRecorder(path, SCENE, overwrite=True):
        assert path.read_text() == "precious"
    assert len(read_events(path).rows) == 0


def test_a_file_that_comes_during_the_run_is_not_overwritten(tmp_path):
    path = tmp_path / "e.parquet"
    with pytest.raises(RecordError, match=r"has come to be there meanwhile; the events are in .*\.partial"):
        record(path, lambda: path.write_text("precious"))
    assert path.read_text() == "precious"
    assert names(tmp_path) == ["e.parquet", "e.parquet.partial"]
    recover(tmp_path / "e.parquet.partial", overwrite=True)
    assert read_events(path).metadata["status"] == "complete"
    assert names(tmp_path) == ["e.parquet"]


@pytest.mark.parametrize("path", ["", ".", "/"])
def test_a_name_that_is_none(path):
    refused("names no file", path)


@needs_locks
def test_two_runs_wrote_one_file_and_the_second_was_not_told(tmp_path):
    path = tmp_path / "e.parquet"
    link = tmp_path / "link"
    link.symlink_to(path)
    with EventRecorder(path, SCENE) as one:
        one(rows(5))
        for second in (path, link):
            for overwrite in (False, True):
                refused(r"e\.parquet is being written by another run", second, overwrite=overwrite)
    assert read_events(path).rows.tobytes() == rows(5).tobytes()
    assert names(tmp_path) == ["e.parquet", "link"]


WRITE = """
    import sys, time
    sys.path.insert(0, {tests!r})
    import test_locks as made
    from kinetile.records import EventRecorder
    from kinetile.records import recorder as recording

    recording._ROWS_A_BATCH = {batch}
    with EventRecorder({path!r}, made.SCENE) as recorder:
        recorder(made.rows(3))
        print("writes", flush=True)
        time.sleep(600)
"""


def kill_a_run(path, batch: int) -> None:
    tests = os.path.dirname(os.path.abspath(__file__))
    script = textwrap.dedent(WRITE.format(tests=tests, path=str(path), batch=batch))
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "writes\n"
            said = "is being written by another run"
            refused(said, path)
            with pytest.raises(RecordError, match=said):
                recover(f"{path}.partial")
        finally:
            process.kill()


@needs_locks
def test_what_a_killed_run_has_left_was_written_over_unasked(tmp_path):
    path = tmp_path / "e.parquet"
    kill_a_run(path, batch=1)
    assert names(tmp_path) == ["e.parquet.partial"]
    left = path.with_name("e.parquet.partial").read_bytes()
    refused(r"left by a run that was killed: `kinetile recover .*e\.parquet\.partial`", path)
    assert path.with_name("e.parquet.partial").read_bytes() == left
    with EventRecorder(path, SCENE, overwrite=True) as recorder:
        recorder(rows(5))
    assert read_events(path).rows.tobytes() == rows(5).tobytes()
    assert names(tmp_path) == ["e.parquet"]


@needs_locks
def test_a_killed_run_that_has_written_no_row_is_not_in_the_way(tmp_path):
    path = tmp_path / "e.parquet"
    kill_a_run(path, batch=1000)
    with EventRecorder(path, SCENE):
        pass
    assert names(tmp_path) == ["e.parquet"]


@needs_locks
@pytest.mark.parametrize("kind", [Path.mkdir, os.mkfifo, lambda path: path.symlink_to("nothing")])
def test_what_stood_in_place_of_a_lock_was_no_lock_or_was_not_named(tmp_path, kind):
    """Two writers of one checkpoint went on side by side; an event file was said to be a directory."""
    path = tmp_path / "e.parquet"
    for end, use in ((".lock", locks.alone(path)), (".partial", EventRecorder(path, SCENE))):
        kind(tmp_path / f"e.parquet{end}")
        with pytest.raises(RecordError, match=rf"parquet{end} is there and is no regular file: move it"), use:
            pass
    assert names(tmp_path) == ["e.parquet.lock", "e.parquet.partial"]


@needs_locks
def test_whatever_else_is_called_so_is_not_written_over(tmp_path):
    path, partial = tmp_path / "e.parquet", tmp_path / "e.parquet.partial"
    partial.write_text("precious")
    refused("partial is there, and is nothing that a run leaves: move it away", path)
    assert partial.read_text() == "precious"
    with EventRecorder(path, SCENE, overwrite=True):
        pass
    assert names(tmp_path) == ["e.parquet"]


def _no_lock_here(descriptor, operation):
    raise OSError(errno.ENOLCK, "No locks available")


@pytest.mark.parametrize("flock", [None, _no_lock_here])
def test_without_locks_a_partial_file_is_refused_until_it_is_taken_away(tmp_path, monkeypatch, flock):
    from kinetile.records import recorder as recording

    monkeypatch.setattr(locks, "flock", flock)
    path = tmp_path / "e.parquet"
    monkeypatch.setattr(recording, "_ROWS_A_BATCH", 5)
    with EventRecorder(path, SCENE) as one:
        one(rows(5))
        refused("another run is writing it, or one that was killed has left it", path, overwrite=True)
        assert recover(f"{path}.partial", tmp_path / "copy.parquet").kept
        assert recover(f"{path}.partial").kept
        assert read_events(path).metadata["status"] == "killed"
        path.unlink()
    assert len(read_events(path).rows) == 5
    assert names(tmp_path) == ["copy.parquet", "e.parquet"]


@needs_locks
def test_a_file_that_gets_its_name_while_another_run_opens_it_is_left_alone(tmp_path, monkeypatch):
    path = tmp_path / "e.parquet"
    opened = locks._open
    one = EventRecorder(path, SCENE).__enter__()
    one(rows(5))

    def open_late(partial, *more):
        found = opened(partial, *more)
        monkeypatch.undo()
        one.close()
        return found

    monkeypatch.setattr(locks, "_open", open_late)
    refused("is there already", path)
    assert read_events(path).rows.tobytes() == rows(5).tobytes()
    assert names(tmp_path) == ["e.parquet"]


@pytest.mark.skipif(os.name == "nt", reason="an open file cannot be removed there")
def test_a_folder_that_was_removed_was_said_to_hold_the_events(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    with pytest.raises(RecordError, match=r"removed while .*; none of the events is kept"):
        record(folder / "e.parquet", lambda: shutil.rmtree(folder))
    assert names(tmp_path) == []


@pytest.mark.skipif(os.name == "nt", reason="an open file cannot be removed there")
def test_a_run_whose_file_was_removed_ends_with_the_next_write(tmp_path, monkeypatch):
    from kinetile.records import recorder as recording

    monkeypatch.setattr(recording, "_ROWS_A_BATCH", 5)
    recorder = EventRecorder(tmp_path / "e.parquet", SCENE).__enter__()
    recorder(rows(5))
    recorder.partial.unlink()
    for end in (lambda: recorder(rows(5)), recorder.close):
        with pytest.raises(RecordError, match="none of the events is kept"):
            end()
    assert recorder.status.startswith("lost: ")
    assert names(tmp_path) == []


@pytest.mark.skipif(os.name == "nt", reason="an open file cannot be moved there")
def test_a_folder_that_was_moved_keeps_the_events(tmp_path):
    folder, moved = tmp_path / "out", tmp_path / "moved"
    folder.mkdir()

    def move():
        folder.rename(moved)
        folder.mkdir()
        (folder / "e.parquet.partial").write_text("somebody else's")

    with pytest.raises(RecordError, match=r"partial has been moved meanwhile.* the events are in it"):
        record(folder / "e.parquet", move)
    recover(moved / "e.parquet.partial")
    assert len(read_events(moved / "e.parquet").rows) == 5
    assert (folder / "e.parquet.partial").read_text() == "somebody else's"


def in_child(work) -> str:
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(write, str(work()).encode())
        finally:
            os._exit(0)
    os.close(write)
    os.waitpid(child, 0)
    with open(read, encoding="utf-8") as said:
        return said.read()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_recorder_that_a_forked_child_used_too_left_a_file_without_a_third_of_its_rows(tmp_path):
    """Parent and child wrote to one log, and the child's end made the file of it and removed it."""
    path, uses = tmp_path / "e.parquet", ("__call__", "flush", "sync", "close")

    def use():
        refused = 0
        for name in uses:
            try:
                getattr(recorder, name)(*[rows(5)] * (name == "__call__"))
            except RecordError as error:
                refused += f"this recorder is of process {os.getppid()}" in str(error)
        recorder.__exit__(ValueError, ValueError(), None)  # the child ends in an error of its own
        return refused

    with EventRecorder(path, SCENE) as recorder:
        recorder(rows(5))
        assert in_child(use) == str(len(uses))
        recorder(rows(5))
    found, metadata = read_events(path)
    assert (len(found), metadata["status"]) == (10, "complete")


@needs_locks
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_child_that_left_a_lock_had_the_writer_not_be_alone_any_more(tmp_path):
    path = tmp_path / "c.kt"
    lock = locks.alone(path)
    with lock:
        in_child(lambda: lock.__exit__(None, None, None))
        with pytest.raises(RecordError, match="is being written by another run"), locks.alone(path):
            pass
    assert names(tmp_path) == []
