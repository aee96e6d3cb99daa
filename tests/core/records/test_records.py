"""Event files: every bit comes back, and however a run ends there is a file that can be read."""

import json
import os
import signal

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import RecordError
from kinetile.records import EventRecorder, read_events
from kinetile.records import recorder as records
from kinetile.scene.files import loads_scene

pq = pytest.importorskip("pyarrow.parquet")


def scene() -> kt.Scene:
    return kt.Scene(
        [[1.0, 1.0], [3.0, 1.0], [2.0, 3.0]],
        [[0.1, -0.0], [0.0, 0.3], [-0.2, 0.1]],
        0.25,
        arena=(4, 4),
        start=2.5,
    )


def full(self, *parts):
    raise OSError(28, "No space left on device")


def rows(count: int, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    made = np.zeros(count, kt.LOG)
    made["tick"] = np.sort(random.integers(0, 2**52, count)) + seed
    made["epoch"] = seed
    made["time"] = 2.5 + (made["epoch"] + made["tick"] * 2.0**-52)
    made["b"] = random.choice([-6, -4, -1, 1, 2], count)
    for name in kt.LOG.names[5:]:
        made[name] = random.normal(size=count)
        if name.startswith("b"):
            made[name][made["b"] < 0] = np.nan
    made["avx"][:1] = -0.0
    return made


def test_every_bit_comes_back(tmp_path):
    path = tmp_path / "events.parquet"
    parts = [rows(10, 0), rows(0), rows(150_000, 1), rows(7, 2)]
    with EventRecorder(path, scene(), {"broad_phase": "naive", "seed": 3}) as recorder:
        for part in parts:
            recorder(part)
        recorder.meta["note"] = "abc"
    found, metadata = read_events(path)
    assert found.dtype == kt.LOG
    assert found.tobytes() == np.concatenate(parts).tobytes()
    assert loads_scene(metadata["scene"]) == scene()
    assert metadata["status"] == "complete"
    assert (metadata["rows"], metadata["start"], metadata["time_unit"]) == (150_017, 2.5, 1.0)
    assert (metadata["broad_phase"], metadata["seed"], metadata["note"]) == ("naive", 3, "abc")
    assert set(metadata["versions"]) == {"python", "kinetile", "numpy", "numba"}


def test_any_parquet_reader_finds_plain_columns(tmp_path):
    path = tmp_path / "e.parquet"
    with EventRecorder(path, scene()) as recorder:
        recorder(rows(100))
    assert tuple(pq.read_table(path).column_names) == kt.LOG.names
    metadata = pq.read_metadata(path).metadata
    assert json.loads(metadata[b"kinetile"])["rows"] == 100
    assert loads_scene(metadata[b"kinetile.scene"].decode()) == scene()


def test_rows_are_copied_when_they_are_taken(tmp_path):
    part = rows(5)
    before = part.tobytes()
    with EventRecorder(tmp_path / "e.parquet", scene()) as recorder:
        recorder(part)
        part["ax"] = 0.0
    assert read_events(tmp_path / "e.parquet").rows.tobytes() == before


@pytest.mark.parametrize(
    ("error", "status"),
    [(KeyboardInterrupt(), "interrupted"), (RuntimeError("jammed"), "fault: RuntimeError: jammed")],
)
def test_a_run_that_is_cut_short_leaves_what_was_done(tmp_path, error, status):
    recorder = EventRecorder(tmp_path / "e.parquet", scene())

    def run():
        with recorder:
            recorder(rows(1000))
            raise error

    with pytest.raises(type(error)):
        run()
    found, metadata = read_events(tmp_path / "e.parquet")
    assert found.tobytes() == rows(1000).tobytes()
    assert metadata["status"] == recorder.status == status


def test_ctrl_c_within_a_write_waits_until_the_write_is_done(tmp_path, monkeypatch):
    write = records.LogFile.write

    def interrupted_write(self, *parts):
        signal.raise_signal(signal.SIGINT)
        return write(self, *parts)

    monkeypatch.setattr(records, "_ROWS_A_BATCH", 10)
    path = tmp_path / "e.parquet"
    recorder = EventRecorder(path, scene()).__enter__()
    monkeypatch.setattr(records.LogFile, "write", interrupted_write)
    for step in (lambda: recorder(rows(50)), lambda: recorder.close("interrupted")):
        with pytest.raises(KeyboardInterrupt):
            step()
    monkeypatch.undo()
    found, metadata = read_events(path)
    assert (len(found), metadata["status"]) == (50, "interrupted")


def test_a_disk_that_fills_at_the_very_end_is_told_by_close(tmp_path, monkeypatch):
    with EventRecorder(tmp_path / "e.parquet", scene()) as recorder:
        recorder(rows(10))
        monkeypatch.setattr(recorder._log, "write", full)
        with pytest.raises(RecordError, match="holds the first 0 events"):
            recorder.close()
    assert read_events(tmp_path / "e.parquet").metadata["status"].startswith("disk: ")


def refused(text: str, path) -> None:
    with pytest.raises(RecordError, match=text), EventRecorder(path, scene()):
        pass


@pytest.mark.parametrize(("name", "text"), [("missing/e.parquet", "No such file"), (".", "Is a directory")])
def test_a_path_that_cannot_be_written_is_told_before_anything_runs(tmp_path, name, text):
    refused(text, tmp_path / name)


def test_no_room_for_even_an_empty_file_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(records.LogFile, "write", full)
    refused("cannot be written: No space left", tmp_path / "e")
    assert list(tmp_path.iterdir()) == []


def test_a_recorder_outside_of_its_with_takes_no_rows_silently(tmp_path):
    recorder = EventRecorder(tmp_path / "e.parquet", scene())
    recorder.close()
    with pytest.raises(RecordError, match="before its `with` began"):
        recorder(rows(3))
    with recorder:
        recorder(rows(3))
    with pytest.raises(RecordError, match="after it was closed"):
        recorder(rows(3))
    with pytest.raises(RecordError, match="a recorder writes one file, once"), recorder:
        pass
    assert len(read_events(tmp_path / "e.parquet").rows) == 3


def test_meta_does_not_go_over_what_the_recorder_says(tmp_path):
    path = tmp_path / "e.parquet"
    with EventRecorder(path, scene(), {"status": "fine", "rows": -1, "missing": 9}) as recorder:
        recorder(rows(3))
        recorder.meta["status"] = "splendid"
    found = read_events(path).metadata
    assert (found["status"], found["rows"], found["missing"]) == ("complete", 3, 0)


def test_rows_that_came_before_or_between_are_counted_as_missing(tmp_path):
    path = tmp_path / "e.parquet"
    with EventRecorder(path, scene()) as recorder:
        recorder.begin(None, 5)
        recorder(rows(3))
        recorder.begin(None, 8)
        recorder(rows(2, 1))
        recorder.begin(None, 11)
    assert read_events(path).metadata["missing"] == 6


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
def test_a_special_file_is_not_replaced_and_a_link_is_followed(tmp_path):
    pipe, link, real = tmp_path / "pipe", tmp_path / "link", tmp_path / "real"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        refused("is no regular file, so it is not replaced", path)
    link.unlink()
    link.symlink_to(real)
    with EventRecorder(link, scene()) as recorder:
        recorder(rows(3))
    assert link.is_symlink()
    assert not real.is_symlink()
    assert len(read_events(real).rows) == 3
    assert sorted(tmp_path.iterdir()) == [link, pipe, real]


def test_a_file_did_not_say_in_which_period_its_places_are(tmp_path):
    torus = kt.make_scene("grid", bodies=9, density=0.3, seed=3, periodic="x")
    sim, path = kt.Simulation(torus, "naive"), tmp_path / "e.parquet"
    with EventRecorder(path, torus) as recorder:
        sim.run(1.0, recorder=recorder)
    rows, metadata = read_events(path)
    width, (low, high) = torus.arena[0], metadata["places"]["x"]
    assert (low, high, list(metadata["places"])) == (-width / 2, width / 2, ["x"])
    assert low <= rows["ax"].min() < 0.0 < rows["ax"].max() <= high
    again = kt.Simulation(torus, "naive")
    for row in rows[-9:]:
        again.run(float(row["time"]))
        assert np.mod(row["ax"], width) == pytest.approx(again.positions()[row["a"], 0], abs=1e-9)


def test_files_of_the_same_rows_were_as_different_as_the_moments_of_their_batches(tmp_path, monkeypatch):
    monkeypatch.setattr("kinetile.records.finishing._ROWS_A_GROUP", 32)
    made, found = rows(128), set()
    for pieces in (1, 3, 40):
        path = tmp_path / f"{pieces}.parquet"
        with EventRecorder(path, scene()) as recorder:
            for piece in np.array_split(made, pieces):
                recorder(piece)
                recorder.flush()
        assert pq.ParquetFile(path).num_row_groups == 4
        found.add(path.read_bytes())
    assert len(found) == 1
