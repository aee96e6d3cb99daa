"""Kill -9 at any moment, then `kinetile resume`: fingerprint and events of a run that was never killed."""

import json
import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

import kinetile as kt

pytest.importorskip("pyarrow")

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(os.name == "nt", reason="sends signals to a process"),
]

UNTIL = 120.0
RUN = f"run grid -s bodies=64 -s seed=3 --until {UNTIL} --every 0.05 --json"
ALIVE = 1.5
"""Seconds: about as long as such a run takes, when it has begun."""


@contextmanager
def started(arguments: list[str]) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-m", "kinetile", *arguments], stdout=subprocess.PIPE, stderr=None, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def killed(arguments: list[str], checkpoint, seconds: float) -> bool:
    """Kill a run some seconds after its checkpoint has been written again; return whether it still ran."""
    before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
    with started(arguments) as process:
        while not checkpoint.exists() or checkpoint.stat().st_mtime_ns == before:
            assert process.poll() is None
            time.sleep(0.005)
        time.sleep(seconds)
        process.kill()
        process.communicate()
        return process.returncode != 0


def kills(folder, numbers) -> int:
    """Kill a run for each number, some of them again when they are resumed (of each four the second), some
    resumed under another phase (the fourth); return how many were still running."""
    parts: list[np.ndarray] = []
    whole = kt.Simulation(kt.make_scene("grid", bodies=64, seed=3), "cells")
    whole.run(UNTIL, recorder=parts.append)
    rows = np.concatenate(parts)
    chance = random.Random(len(numbers))
    found = 0
    for each in numbers:
        checkpoint, events = folder / f"{each}.kt", folder / f"{each}.parquet"
        files = ["--checkpoint", str(checkpoint), "--events", str(events)]
        found += killed([*RUN.split(), *files], checkpoint, chance.uniform(0.0, ALIVE))
        resume = ["resume", str(checkpoint), "--json"]
        if each % 4 == 1:
            found += killed(resume, checkpoint, chance.uniform(0.0, ALIVE))
        if each % 4 == 3:
            resume += ["--broad-phase", "sap-1d"]
        with started(resume) as process:
            said = json.loads(process.communicate()[0])
        assert process.returncode == 0
        assert said["readings"]["fingerprint"] == whole.fingerprint
        recorded = kt.read_events(events)
        assert recorded.rows.tobytes() == rows.tobytes()
        assert (recorded.metadata["status"], recorded.metadata["missing"]) == ("complete", 0)
        assert not [left for left in folder.iterdir() if left.name.endswith((".partial", ".unfinished"))]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("numbers", [range(1, 2), pytest.param(range(50), marks=pytest.mark.long)], ids=len)
def test_a_killed_run_goes_on_from_its_checkpoint(tmp_path, numbers):
    assert kills(tmp_path, numbers) > 0.8 * len(numbers)
