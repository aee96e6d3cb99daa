"""The same loop interpreted, as an author runs it to see what a hook does."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import kinetile as kt

RUN = """
import kinetile as kt
sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.4), "naive")
sim.run(until=0.5)
print(sim.fingerprint)
"""


@pytest.mark.compiled
def test_an_interpreted_run_has_the_contacts_of_a_compiled_one_and_warns_of_nothing() -> None:
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-W", "error", "-c", RUN]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    sim = kt.Simulation(kt.make_scene("grid", bodies=16, density=0.4), "naive")
    sim.run(until=0.5)
    assert len(sim.contacts) > 10
    assert done.stdout.strip() == sim.fingerprint
