"""Kill -9 at any moment: what is left is a true prefix of the run, and at most the last second is lost."""

from __future__ import annotations

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
FIRST = 70_000
"""Bytes: there are as many when the file has been opened, and more than twice as many with the first rows."""


def kill_at(path, seconds: float, begun: bool, warned: float | None) -> float | None:
    """Kill a run some seconds after it has opened its file, or after it has ``begun`` to write rows.

    ``warned``: SIGTERM comes first, so many seconds before. Returns the age of what was written last, in
    seconds; None where no row had been written, or the run had been warned.
    """
    partial = path.with_name(path.name + ".partial")
    arguments = [sys.executable, "-m", "kinetile", *RUN.split(), str(path)]
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            while not partial.exists() or partial.stat().st_size < FIRST * (1 + begun):
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
    if warned is not None or partial.stat().st_size < 2 * FIRST:
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
    kills(tmp_path, 3)


@pytest.mark.slow
def test_fifty_kills_at_random_moments(tmp_path):
    kills(tmp_path, 50)
