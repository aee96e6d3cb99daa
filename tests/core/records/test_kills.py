"""Processes that record and are killed, or get two signals: what they leave is a true prefix of the run."""

import hashlib
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import kinetile as kt
from kinetile.records import read_events, recover

pytest.importorskip("pyarrow")
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


@pytest.mark.parametrize("number", [1, pytest.param(50, marks=pytest.mark.long)])
def test_a_killed_run_lost_everything(tmp_path, number):
    kills(tmp_path, number)


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
