"""Processes that record and are killed, or get two signals: what they leave is a true prefix of the run."""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest

import kinetile as kt
from kinetile.kernel.log import Fingerprint
from kinetile.records import read_events, recover

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(os.name == "nt", reason="sends signals to a process"),
]

RUN = "run grid -s bodies=100 -s seed=7 --broad-phase sap-2d --until 1e6 --json --events"
FIRST = 100_000
"""Bytes: there are more with the first rows, and fewer when the file has been opened."""


def kill_at(path, seconds: float, begun: bool, warned: float | None) -> float | None:
    """Kill a run some seconds after it has opened its file, or after it has ``begun`` to write rows.

    ``warned``: SIGTERM comes first, so many seconds before. Returns the age of what was written last, in
    seconds; None where no row had been written, or the run had been warned.
    """
    partial = path.with_name(path.name + ".partial")
    arguments = [sys.executable, "-m", "kinetile", *RUN.split(), str(path)]
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            while not partial.exists() or partial.stat().st_size < (FIRST if begun else 1):
                assert process.poll() is None
                time.sleep(0.01)
            time.sleep(seconds)
            if warned is not None:
                process.send_signal(signal.SIGTERM)
                time.sleep(warned)
        finally:
            process.kill()
            now = time.time()
        process.wait()
    if warned is not None or partial.stat().st_size < FIRST:
        return None
    return now - partial.stat().st_mtime


def kills(folder, number: int) -> None:
    scene = kt.make_scene("grid", bodies=100, seed=7)
    again = kt.Simulation(scene, "sap-2d")
    again.compile()
    chance = random.Random(number)
    ages, found = [], {}
    for each in range(number):
        path = folder / f"{each}.parquet"
        warned = chance.choice([0.0, 0.01, 0.05, 0.2]) * chance.random() if each % 3 == 2 else None
        age = kill_at(path, chance.uniform(0.0, 1.5), each % 5 != 1, warned)
        if age is not None:
            ages.append(age)
        if not path.exists():
            assert recover(f"{path}.partial").status == "killed" or warned is not None
        elif warned is None:
            pytest.fail(f"{path} is there, and nobody has told its run to end")
        rows, metadata = read_events(path)
        assert metadata["status"] in ("killed", "interrupted")
        found[len(rows)] = hashlib.sha256(rows.tobytes()).digest()
    assert max(found) > 1000
    parts: list[np.ndarray] = []
    again.run(max_contacts=max(found), recorder=parts.append)
    whole = np.concatenate(parts)
    for length, digest in found.items():
        assert hashlib.sha256(whole[:length].tobytes()).digest() == digest
    assert 0.0 <= max(ages) < 1.0


def test_a_killed_run_lost_everything(tmp_path):
    kills(tmp_path, 1)


@pytest.mark.long
def test_fifty_kills_at_random_moments(tmp_path):
    kills(tmp_path, 50)


pq = pytest.importorskip("pyarrow.parquet")

ROUNDS = """
    import signal, sys, typer
    from pathlib import Path
    import kinetile as kt
    from kinetile.cli.run import run

    def by_command(path):
        run("grid", ["bodies=100", "seed=7"], "sap-2d", until=1e6, events=path, json=True)

    def in_python(path):
        scene = kt.make_scene("grid", bodies=100, seed=7)
        sim = kt.Simulation(scene, "sap-2d", keep_contacts=False)
        with kt.EventRecorder(path, scene) as recorder:
            sim.run(1e6, recorder=recorder)

    kt.Simulation(kt.make_scene("grid", bodies=100, seed=7), "sap-2d").run(1.0)
    def ignore():
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        except KeyboardInterrupt:
            ignore()

    for line in sys.stdin:
        how, path = line.split()
        try:
            try:
                signal.signal(signal.SIGINT, signal.default_int_handler)
                print("go", flush=True)
                by_command(Path(path)) if how == "command" else in_python(path)
            except (KeyboardInterrupt, typer.Exit):
                pass
            ignore()
        except KeyboardInterrupt:
            ignore()
        print("ended", flush=True)
"""


@pytest.fixture
def rounds(tmp_path):
    """A process that runs until it is interrupted, as often as it is told a file to write."""
    script = textwrap.dedent(ROUNDS)
    with subprocess.Popen(
        [sys.executable, "-c", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        yield process
        process.kill()


def is_true(path, scene) -> None:
    """Assert that a file's parts agree with each other and with the run, read without kinetile's reader."""
    table = pq.read_table(path)
    metadata = json.loads(pq.read_metadata(path).metadata[b"kinetile"])
    assert metadata["status"] == "interrupted"
    assert metadata["rows"] == table.num_rows
    contacts = np.zeros(table.num_rows, [("epoch", "<i8"), ("tick", "<i8"), ("a", "<i4"), ("b", "<i4")])
    for name in contacts.dtype.names:
        contacts[name] = table[name].to_numpy()
    fingerprint = Fingerprint()
    fingerprint.update(contacts.tobytes())
    assert metadata["fingerprint"] == fingerprint.hexdigest()
    again = kt.Simulation(scene, "sap-2d")
    again.run(max_contacts=len(contacts) + 1)
    for name in contacts.dtype.names:
        assert (again.contacts[name][:-1] == contacts[name]).all()
    reached = metadata.get("time")
    last = table["time"].to_numpy()[-1] if len(contacts) else scene.start
    assert last <= reached <= again.contacts["time"][-1]


@pytest.mark.slow
@pytest.mark.parametrize("how", ["command", pytest.param("python", marks=pytest.mark.slow)])
def test_a_second_ctrl_c_made_event_files_that_were_not_true(rounds, tmp_path, how):
    scene = kt.make_scene("grid", bodies=100, seed=7)
    chance = random.Random(11)
    written = 0
    for number in range(6 if how == "command" else 30):
        path = tmp_path / f"{number}.parquet"
        rounds.stdin.write(f"{how} {path}\n")
        rounds.stdin.flush()
        while rounds.stdout.readline() != "go\n":
            assert rounds.poll() is None
        time.sleep(chance.uniform(0.02, 0.25))
        rounds.send_signal(signal.SIGINT)
        time.sleep(chance.choice([0.0, 0.001, 0.005, 0.02]) * chance.random())
        rounds.send_signal(signal.SIGINT)
        while rounds.stdout.readline() != "ended\n":
            assert rounds.poll() is None
        if path.exists():
            is_true(path, scene)
            assert not path.with_name(path.name + ".partial").exists()
            written += 1
    assert written  # others were interrupted before there was anything to write: on a busy machine, many


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_handler_that_raises_tore_the_step_in_which_its_signal_came(tmp_path, number):
    """It comes where it hurts most: the rows have been taken over and are not yet given on."""
    scene = kt.make_scene("grid", bodies=100, seed=7)
    sim = kt.Simulation(scene, "sap-2d")
    path = tmp_path / "e.parquet"

    def leave(number, frame):
        raise SystemExit

    def run():
        with kt.EventRecorder(path, scene) as recorder:

            def interrupted(rows):
                os.kill(os.getpid(), number)
                recorder(rows)

            try:
                sim.run(1e3, recorder=interrupted)
            finally:
                recorder.end(sim.time)

    before = signal.signal(number, leave)
    try:
        with pytest.raises(SystemExit):
            run()
    finally:
        signal.signal(number, before)
    found = kt.read_events(path)
    assert len(found.rows) == len(sim.contacts) > 0
    assert found.metadata["fingerprint"] == sim.fingerprint
    assert found.metadata["time"] == sim.time
