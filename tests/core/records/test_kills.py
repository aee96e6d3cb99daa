"""Processes that record and are killed, or get two signals: their files are true prefixes of the run."""

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
pytestmark = [pytest.mark.compiled, pytest.mark.skipif(os.name == "nt", reason="sends signals to a process")]

RUN = "run grid -s bodies=100 -s seed=7 --broad-phase cells --until 1e6 --json --events"
FIRST = 100_000
"""Bytes: there are more with the first rows, and fewer when the file has been opened."""


def kill(path, seconds: float, warned: float | None) -> None:
    """Kills a run some seconds after it has begun to write rows, or so long after it got SIGTERM."""
    partial = path.with_name(path.name + ".partial")
    arguments = [sys.executable, "-m", "kinetile", *RUN.split(), str(path)]
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            while not partial.exists() or partial.stat().st_size < FIRST:
                assert process.poll() is None
                time.sleep(0.01)
            time.sleep(seconds)
            if warned is not None:
                process.send_signal(signal.SIGTERM)
                time.sleep(warned)
        finally:
            process.kill()


@pytest.mark.parametrize("number", [1, pytest.param(50, marks=pytest.mark.long)])
def test_a_killed_run_lost_everything(tmp_path, number):
    again = kt.Simulation(kt.make_scene("grid", bodies=100, seed=7), "cells")
    again.compile()
    chance, found = random.Random(number), {}
    for each in range(number):
        path = tmp_path / f"{each}.parquet"
        warned = chance.choice([0.0, 0.01, 0.05, 0.2]) * chance.random() if each % 3 == 2 else None
        kill(path, chance.uniform(0.0, 1.5), warned)
        assert warned is not None or not path.exists(), "nobody has told its run to end"
        if not path.exists():
            assert recover(f"{path}.partial").status == "killed" or warned is not None
        rows, metadata = read_events(path)
        assert metadata["status"] in ("killed", "interrupted")
        found[len(rows)] = hashlib.sha256(rows.tobytes()).digest()
    assert max(found) > 1000
    parts: list[np.ndarray] = []
    again.run(max_contacts=max(found), recorder=parts.append)
    whole = np.concatenate(parts)
    for length, digest in found.items():
        assert hashlib.sha256(whole[:length].tobytes()).digest() == digest
