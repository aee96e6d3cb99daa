"""From the log of a run to an event file: after a kill, on a full disk, and where it cannot be."""

import errno
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kinetile as kt
from command_line import kinetile, printed, refused
from kinetile.errors import RecordError
from kinetile.records import EventRecorder, Trajectory, finishing, read_events, recover
from kinetile.records import recorder as recording
from kinetile.records.log import LogFile, LogReader
from lanes import first
from messages import table

pytest.importorskip("pyarrow")

SCENE = kt.make_scene("grid", bodies=9, density=0.5, seed=3)


@pytest.fixture(scope="module")
def whole() -> np.ndarray:
    parts: list[np.ndarray] = []
    kt.Simulation(SCENE, "naive").run(2.0, recorder=parts.append)
    return np.concatenate(parts)


@pytest.fixture(scope="module")
def left(tmp_path_factory, whole):
    """The files of a killed run: the log of all its rows but the last ten, in batches of 20."""
    path = tmp_path_factory.mktemp("left") / "e.parquet"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "_ROWS_A_BATCH", 20)
        with EventRecorder(path, SCENE, {"note": "as it was"}) as recorder:
            recorder.begin(None, 0)
            for begin in range(0, len(whole) - 10, 20):
                recorder(whole[: len(whole) - 10][begin : begin + 20])
            recorder.flush()
            shutil.copy(recorder.partial, path.with_name("left"))
    return path.with_name("left")


@pytest.fixture
def partial(left, tmp_path):
    return shutil.copy(left, tmp_path / "e.parquet.partial")


def left_alone(partial, *given, **options):
    for name in ("there", "event.partial"):
        Path(name).write_text("precious")
    Path("folder").mkdir()
    before = partial.read_bytes()
    try:
        recover(*given, **options)
    finally:
        assert names(Path()) == ["e.parquet.partial", "event.partial", "folder", "there"]
        assert partial.read_bytes() == before


test_message = table(globals())


def names(folder) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


def full(self, *_):
    raise OSError(errno.ENOSPC, "No space left on device")


class Limited:
    """A file on a disk with room for ``size`` bytes of it."""

    def __init__(self, file, size: int) -> None:
        self.file, self.size = file, size

    def write(self, data) -> int:
        room = self.size - self.file.tell()
        return self.file.write(data[:room]) if room else full(self)

    def __getattr__(self, name: str):
        return getattr(self.file, name)


def test_what_a_killed_run_has_left_becomes_an_event_file(partial, tmp_path, whole):
    made = recover(partial)
    path = tmp_path / "e.parquet"
    assert made == (path, len(whole) - 10, "killed", whole["time"][-11], 0, False)
    assert names(tmp_path) == ["e.parquet"]
    found, metadata = read_events(path)
    assert found.tobytes() == whole[:-10].tobytes()
    assert (metadata["status"], metadata["note"], metadata["time"]) == ("killed", "as it was", made.time)
    again = kt.Simulation(SCENE, "naive")
    again.run(made.time)
    assert (Trajectory.read(path).positions(made.time) == again.positions()).all()


@settings(max_examples=25)
@given(data=st.data())
def test_each_byte_at_which_a_log_is_cut_leaves_a_true_prefix(left, tmp_path, whole, data):
    content = left.read_bytes()
    cut = data.draw(st.integers(_first(left), len(content)))
    partial = tmp_path / "cut.partial"
    partial.write_bytes(content[:cut])
    made = recover(partial, overwrite=True)
    found, metadata = read_events(tmp_path / "cut")
    assert found.tobytes() == whole[: made.rows].tobytes()
    assert made.rows >= (cut - len(content)) // kt.LOG.itemsize + len(whole) - 10 - 20
    assert metadata["time"] == (found["time"][-1] if made.rows else SCENE.start)


def _first(left) -> int:
    with left.open("rb") as file:
        next(iter(LogReader(file, "")))
        return file.tell()


def test_damage_ends_the_event_file_and_keeps_the_log(partial, tmp_path, whole):
    content = bytearray(partial.read_bytes())
    content[len(content) // 2] ^= 4
    partial.write_bytes(content)
    result = kinetile("recover", partial, code=0)
    assert "are no whole batch of rows: a write that was cut off, or damage" in result.stderr
    assert f"{partial} is still there" in result.stdout
    found = read_events(tmp_path / "e.parquet").rows
    assert 0 < len(found) < len(whole) - 10
    assert found.tobytes() == whole[: len(found)].tobytes()


def test_the_command_says_what_it_has_made(partial, tmp_path, whole):
    said = printed("recover --out", tmp_path / "other.parquet", partial)
    assert [said[name] for name in ("rows", "status", "kept")] == [len(whole) - 10, "killed", True]
    result = kinetile("recover", partial)
    assert result.stdout.startswith(f"{tmp_path / 'e.parquet'}: {len(whole) - 10:,} events, to time ")
    assert result.stdout.endswith(" (killed)\n")
    assert "does not end in .partial" in refused("recover", tmp_path / "e.parquet")


def test_a_run_that_was_killed_before_it_began(left, tmp_path):
    with left.open("rb") as file:
        LogReader(file, "")
        head = file.tell()
    partial = tmp_path / "e.partial"
    partial.write_bytes(left.read_bytes()[:head])
    with pytest.raises(RecordError, match="killed before it began: no event is in it"):
        recover(partial)
    assert names(tmp_path) == ["e.partial"]


def test_what_ended_badly_while_it_was_made_an_event_file_is_begun_anew(partial, tmp_path):
    left = tmp_path / ".e.parquet.01234567.part"
    left.write_bytes(b"half of it")
    os.utime(left, (0, 0))
    recover(partial)
    assert names(tmp_path) == ["e.parquet"]


def test_a_disk_without_room_for_the_event_file_keeps_the_log_of_a_whole_run(tmp_path, monkeypatch, whole):
    path = tmp_path / "e.parquet"
    recorder = EventRecorder(path, SCENE).__enter__()
    recorder(whole)
    recorder.end(2.5)
    monkeypatch.setattr(finishing, "_write", full)
    said = r"No space left on device; the events are in .*partial: `kinetile recover .*--out ANOTHER.parquet`"
    with pytest.raises(RecordError, match=said):
        recorder.close()
    with pytest.raises(RecordError, match=r"No space left on device; .*partial is as it was"):
        recover(recorder.partial)
    assert names(tmp_path) == ["e.parquet.partial"]
    monkeypatch.undo()
    recover(recorder.partial)
    found, metadata = read_events(path)
    assert found.tobytes() == whole.tobytes()
    assert (metadata["status"], metadata["time"]) == ("complete", 2.5)


@pytest.mark.parametrize("batches", [0, 1, 3])
@pytest.mark.parametrize("room", [0, 2000])
def test_a_full_disk_keeps_the_batches_before_it_and_says_so(tmp_path, monkeypatch, whole, batches, room):
    """Nothing fits after them, or a part of a batch and the last text."""
    monkeypatch.setattr(recording, "_ROWS_A_BATCH", 20)
    path = tmp_path / "e.parquet"
    recorder = EventRecorder(path, SCENE).__enter__()
    for begin in range(0, batches * 20, 20):
        recorder(whole[begin : begin + 20])
    size = recorder.partial.stat().st_size
    recorder._file._file = Limited(recorder._file._file, size + room)
    recorder.end(2.0)
    with pytest.raises(RecordError, match=f"it holds the first {batches * 20} events and no later ones"):
        recorder(whole[batches * 20 :])
    assert recorder.partial.stat().st_size == size
    monkeypatch.setattr(finishing, "_write", full)
    with pytest.raises(RecordError, match=f"No space left on device; the first {batches * 20} events are in"):
        recorder.close()
    monkeypatch.undo()
    made = recover(recorder.partial)
    assert (made.rows, made.status[:6]) == (batches * 20, "disk: " if room else "killed")
    assert made.time == (whole["time"][batches * 20 - 1] if batches else SCENE.start)


def test_rows_are_written_when_a_quarter_of_a_second_is_over(tmp_path, monkeypatch, whole):
    now = [100.0]
    monkeypatch.setattr(recording, "monotonic", lambda: now[0])
    with EventRecorder(tmp_path / "e.parquet", SCENE) as recorder:
        for number, (after, written) in enumerate(
            [(0.1, 0), (0.1, 0), (0.1, 3), (0.2, 3), (0.05, 5), (9.0, 6)]
        ):
            now[0] += after
            recorder(whole[number : number + 1])
            assert recorder.rows == written
            with recorder.partial.open("rb") as file:
                assert sum(map(len, LogReader(file, ""))) == written


def test_a_batch_of_many_rows_does_not_say_that_those_behind_it_are_there(tmp_path, monkeypatch, whole):
    """A run had got to a time when its rows were still being written, batch by batch."""
    monkeypatch.setattr(recording, "monotonic", lambda: 100.0)  # else a busy machine writes some before
    monkeypatch.setattr(recording, "_ROWS_A_BATCH", 20)
    recorder = EventRecorder(tmp_path / "e.parquet", SCENE).__enter__()
    monkeypatch.setattr(recording, "_ROWS_A_BATCH", 10**6)
    recorder(whole[:50])
    recorder.end(2.0)
    monkeypatch.setattr(recording, "_ROWS_A_BATCH", 20)
    recorder.flush()
    with recorder.partial.open("rb") as file:
        log = LogReader(file, "")
        said = [(json.loads(log.text)["time"], len(rows)) for rows in log]
    last = whole["time"]
    assert said == [(SCENE.start, 0), (last[19], 20), (last[39], 20), (2.0, 10)]
    recorder.close()


def go_on(folder, steps: int) -> None:
    """Continues from a checkpoint, and ends this process at a step."""

    def last(function):
        def call(*arguments):
            nonlocal steps
            steps -= 1
            if steps < 0:
                os._exit(9)
            return function(*arguments)

        return call

    sim = kt.resume(folder / "c.kt")
    for kind, names in (LogFile, ("write", "go_to", "sync", "close")), (Path, ("replace",)):
        for name in names:
            setattr(kind, name, last(getattr(kind, name)))
    with EventRecorder(folder / "e.parquet", sim.scene, behind=sim):
        os._exit(0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
@pytest.mark.parametrize("end", first(1, [".partial", "", "nothing"]))
def test_a_resume_that_was_killed_while_it_copied_had_made_its_run_no_beginning(
    tmp_path, left, whole, end, monkeypatch
):
    """At each possible step: of a copy of FILE, of a log with the checkpoint within a batch, of a
    log that begins."""
    sim = kt.Simulation(SCENE, "naive")
    if not end:
        with EventRecorder(tmp_path / "e.parquet", SCENE) as recorder:
            sim.run(1.0, recorder=recorder)
        assert sim.rows > 120
    elif end == ".partial":
        sim.run(1.0)
        assert sim.rows % 20
        shutil.copy(left, tmp_path / "e.parquet.partial")
    sim.save(tmp_path / "c.kt")
    monkeypatch.setattr(recording, "_ROWS_A_BATCH", 60)
    for steps in range(100):
        folder = shutil.copytree(tmp_path, tmp_path.with_name(f"{tmp_path.name}-{steps}"))
        if (child := os.fork()) == 0:
            try:
                go_on(folder, steps)
            finally:
                os._exit(1)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        again = kt.resume(folder / "c.kt")
        with EventRecorder(folder / "e.parquet", SCENE, behind=again) as recorder:
            again.run(2.0, recorder=recorder)
        found = read_events(folder / "e.parquet")
        assert found.rows.tobytes() == whole.tobytes()
        assert (found.metadata["status"], found.metadata["missing"]) == ("complete", 0)
        assert names(folder) == ["c.kt", "e.parquet"]
        if code == 0:
            break
    assert (code, steps > 4) == (0, True)
