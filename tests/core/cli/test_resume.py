"""`kinetile run --checkpoint` and `kinetile resume`: ends, files, signals, a full disk."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

import kinetile as kt
from command_line import kinetile, printed, refused
from kinetile.records import locks
from kinetile.run.saving import files

posix = pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals")

OTHERS = (getattr(signal, "SIGHUP", signal.SIGTERM), signal.SIGINT)
RUN = "run grid -s bodies=16 -s seed=2 --broad-phase cells"


def whole(until: float) -> kt.Simulation:
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, seed=2), "cells")
    sim.run(until)
    return sim


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "c.kt"
    printed(RUN, "--until", "0.2", "--checkpoint", path)
    return path


def test_a_run_goes_on_to_another_time(saved):
    said = printed("resume --until 0.5", saved)
    assert said["readings"]["fingerprint"] == whole(0.5).fingerprint
    assert said["readings"]["structural_events"] == whole(0.5).readings.structural_events
    assert said["run"]["until"] == said["run"]["time"] == 0.5
    assert printed("resume", saved)["run"]["time"] == 0.5  # it was saved there again


def test_under_another_phase(saved):
    said = printed("resume --until 0.5 --broad-phase cells", saved)
    assert said["broad_phase"] == "cells"
    assert said["readings"]["fingerprint"] == whole(0.5).fingerprint


def test_contacts_are_counted_from_the_start(tmp_path):
    path = tmp_path / "c.kt"
    printed(RUN, "--max-contacts", "5", "--checkpoint", path)
    assert printed("resume", path)["readings"]["contacts_disc"] <= 5
    said = printed("resume --max-contacts 3", path)
    assert said["readings"]["contacts_disc"] + said["readings"]["contacts_wall"] == 8
    assert said["run"]["max_contacts"] == 8


def test_the_events_file_goes_on(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    monkeypatch.setattr("kinetile.records.finishing._ROWS_A_GROUP", 16)
    path, events = tmp_path / "c.kt", tmp_path / "e.parquet"
    printed(RUN, "--until", "0.2", "--checkpoint", path, "--events", events)
    printed("resume --until 0.5", path)
    whole = tmp_path / "w.parquet"
    printed(RUN, "--until", "0.5", "--events", whole)
    one, two = kt.read_events(events), kt.read_events(whole)
    assert events.read_bytes() == whole.read_bytes()
    assert one.metadata["missing"] == 0
    assert kt.Trajectory.read(events).rows.tobytes() == two.rows.tobytes()


def test_events_from_here_on_say_how_many_are_missing(saved, tmp_path):
    pytest.importorskip("pyarrow")
    events = tmp_path / "e.parquet"
    result = kinetile("resume --until 0.5 --json --events", events, saved)
    assert "from time 0.2 on" in result.stderr
    found = kt.read_events(events)
    assert found.metadata["missing"] == kt.resume(saved).rows - len(found.rows)


def test_the_events_of_another_run_are_no_beginning(saved, tmp_path):
    pytest.importorskip("pyarrow")
    events = tmp_path / "e.parquet"
    for other, said in (("bodies=9", "another scene"), ("bodies=16", "holds 0 events")):
        printed(f"run grid -s {other} -s seed=2 --until 0 --overwrite --events", events)
        before = events.read_bytes()
        assert said in refused("resume --until 0.5 --events", events, saved)
        assert events.read_bytes() == before
        assert not (tmp_path / "e.parquet.partial").exists()


@pytest.mark.parametrize("moment", [0.1, 0.4])
def test_a_full_disk_is_reported_and_the_old_checkpoint_stays(saved, monkeypatch, moment):
    """At the end of a run that was otherwise done, and in its course."""
    write, times = os.fsync, []

    def full(descriptor):
        times.append(1)
        if len(times) > 2:
            raise OSError(28, "No space left on device")
        write(descriptor)

    monkeypatch.setattr(files.os, "fsync", full)
    every = "0" if moment < 0.3 else "1000"
    result = kinetile("resume --until 0.5 --json --every", every, saved, code=1)
    assert "No space left on device" in result.stderr
    assert "is as it was" in result.stderr
    assert kt.resume(saved).time == 0.2
    assert [each.name for each in saved.parent.iterdir()] == ["c.kt"]


@contextmanager
def started(path) -> Iterator[subprocess.Popen[str]]:
    """A run with a checkpoint in a process of its own, which ends with the context at the latest."""
    line = f"{RUN} --until 1e6 --every 0.02 --json --checkpoint {path}"
    command = [sys.executable, "-m", "kinetile", *line.split()]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, **pipes, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def begun(path) -> None:
    seen: set[int] = set()
    for _ in range(60_000):
        if path.exists():
            seen.add(path.stat().st_ino)
        if len(seen) > 2:
            return
        time.sleep(0.01)
    pytest.fail("it was never saved")


@posix
@pytest.mark.compiled
@pytest.mark.parametrize(
    "number", [signal.SIGTERM, *(pytest.param(each, marks=pytest.mark.slow) for each in OTHERS)]
)
@pytest.mark.usefixtures("hanging_up")
def test_a_signal_saves_and_ends(tmp_path, number):
    path = tmp_path / "c.kt"
    with started(path) as process:
        begun(path)
        process.send_signal(number)
        out, said = process.communicate(timeout=600)
    assert process.returncode == 128 + number
    assert f"`kinetile resume {path}` continues from there" in said
    result = json.loads(out)
    taken_up = kt.resume(path)
    assert (result["run"]["status"], result["run"]["time"]) == ("interrupted", taken_up.time)
    assert taken_up.fingerprint == result["readings"]["fingerprint"]
    later = taken_up.time + 0.5  # nor a checkpoint too late; not at .time, which is the exact tick rounded
    taken_up.run(later)
    assert taken_up.fingerprint == whole(later).fingerprint


@posix
def test_two_processes_ran_on_one_checkpoint(saved, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(saved)
    with locks.alone(saved):
        for second in (("resume", link), (f"{RUN} --overwrite --checkpoint", saved)):
            assert f"{saved} is being written by another run, which holds {saved}.lock" in refused(*second)
    assert printed("resume --max-contacts 5", saved)["run"]["status"] == "complete"
    assert {each.name for each in tmp_path.iterdir()} == {"c.kt", "link"}


def test_another_signal_gives_up_the_saving(saved, monkeypatch):
    """It is sent in the middle of the save that the first one causes."""
    replace = os.fsync

    def slow(descriptor):
        if len(calls) == 1:
            os.kill(os.getpid(), signal.SIGINT)
        calls.append(descriptor)
        replace(descriptor)

    calls: list[int] = [0, 0]  # the save at the beginning goes through
    monkeypatch.setattr(files.os, "fsync", slow)

    def interrupt(self, *args, **kwargs):
        calls[:] = [0]
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1)

    monkeypatch.setattr(kt.Simulation, "run", interrupt)
    result = kinetile("resume --until 0.5", saved, code=130)
    assert "not saved any more" in result.stderr
    assert f"{saved} is of time 0.2" in result.stderr
    assert kt.resume(saved).time == 0.2
    assert [each.name for each in saved.parent.iterdir()] == ["c.kt"]
