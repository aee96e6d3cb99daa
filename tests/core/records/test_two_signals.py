"""Two signals at any moments: each event file that is left behind is true."""

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

pq = pytest.importorskip("pyarrow.parquet")

pytestmark = [
    pytest.mark.compiled,
    pytest.mark.skipif(os.name == "nt", reason="sends signals to a process"),
]

ROUNDS = """
    import signal, sys, typer
    from pathlib import Path
    import kinetile as kt
    from kinetile.cli.commands.run import run

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
    assert metadata["fingerprint"] == hashlib.sha256(contacts.tobytes()).hexdigest()
    again = kt.Simulation(scene, "sap-2d")
    again.run(max_contacts=len(contacts) + 1)
    for name in contacts.dtype.names:
        assert (again.contacts[name][:-1] == contacts[name]).all()
    reached = metadata.get("time")
    last = table["time"].to_numpy()[-1] if len(contacts) else scene.start
    assert last <= reached <= again.contacts["time"][-1]


@pytest.mark.parametrize("how", ["command", "python"])
def test_a_second_ctrl_c_made_event_files_that_were_not_true(rounds, tmp_path, how):
    scene = kt.make_scene("grid", bodies=100, seed=7)
    chance = random.Random(11)
    written = 0
    for number in range(30):
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
                recorder.reached(sim.time)

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
