"""A signal at every bytecode boundary of every call that changes a simulation: all is done, or nothing."""

import random
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from copy import copy
from pathlib import Path
from typing import Any

import pytest

import kinetile as kt
from inside import engine_of
from kinetile.run import interrupts
from lanes import first

RUN = str(Path(interrupts.__file__).parent)

CALLS: dict[str, Callable[[kt.Simulation, Path], Any]] = {
    "turn": lambda sim, path: sim.set_velocity(3, (0.9, -0.9)),
    "turns": lambda sim, path: sim.set_velocities([1, 2], [[0.5, 0.5], [0.1, -0.7]]),
    "fast turn": lambda sim, path: sim.set_velocity(3, (40.0, -3.0)),
    "insert": lambda sim, path: sim.insert((0.01, 0.01), (0.5, 0.5), 0.005),
    "insert many": lambda sim, path: sim.insert_many(
        [(0.01, 0.01), (0.01, 0.02), (0.02, 0.01)], radius=0.004
    ),
    "remove": lambda sim, path: sim.remove(3),
    "run": lambda sim, path: sim.run(sim.time + 0.05),
    "step": lambda sim, path: sim.step(),
    "steps": lambda sim, path: list(sim.steps(sim.time + 0.02)),
    "observed run": lambda sim, path: sim.run(sim.time + 0.05, observe=["pressure:every=0.02"]),
    "turn in progress": lambda sim, path: sim.run(
        sim.time + 0.02, progress=lambda _: sim.set_velocity(2, (0.3, 0.2))
    ),
    "rebuild": lambda sim, path: sim.rebuild(),
    "restore": lambda sim, path: sim.restore(sim.snapshot()),
    "snapshot": lambda sim, path: sim.snapshot(),
    "save": lambda sim, path: sim.save(path / "saved.kts"),
    "contacts": lambda sim, path: sim.contacts,
    "audit": lambda sim, path: sim.audit(),
    "film": lambda sim, path: [*kt.film(sim, 0.12, seconds=0.1)._pictures(True)],
}


class Tracer:
    """Counts instructions of kinetile.run (and of contextlib), and raises a signal at one of them."""

    def __init__(self, at: int) -> None:
        self.at, self.count = at, 0

    def __call__(self, frame: Any, event: str, argument: Any) -> Any:
        name = frame.f_code.co_filename
        if not (name.startswith(RUN) or "contextlib" in name):
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        return self.local

    def local(self, frame: Any, event: str, argument: Any) -> Any:
        if event == "opcode":
            self.count += 1
            if self.count == self.at:
                sys.settrace(None)
                signal.raise_signal(signal.SIGINT)
        return self.local


@contextmanager
def traced(at: int) -> Iterator[Tracer]:
    before, tracer = sys.gettrace(), Tracer(at)
    sys.settrace(tracer)
    try:
        yield tracer
    finally:
        sys.settrace(before)


def assert_whole(sim: kt.Simulation) -> None:
    assert interrupts._outermost is None
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert sim._lock.acquire(blocking=False)
    sim._lock.release()
    assert not sim._lock._is_owned()  # type: ignore[attr-defined]
    sim.audit()
    again = kt.Simulation(sim.scene, sim.broad_phase, live=sim.broad_phase != "naive")
    again.restore(sim.snapshot())
    replay = kt.Simulation(sim.recorded(), "cells", live=True)
    replay.run()
    assert replay.fingerprint == sim.fingerprint == again.fingerprint
    assert replay.positions().tolist() == sim.positions().tolist() == again.positions().tolist()
    assert replay.velocities().tolist() == sim.velocities().tolist()
    assert len(sim.contacts) == engine_of(sim).contacts


@pytest.mark.parametrize("most", first(1, [1, 50, pytest.param(10**6, marks=pytest.mark.long)]))
@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("phase", first(1, ["cells", "naive"]))
def test_a_signal_anywhere_in_a_call_lost_the_command_from_the_record(phase, name, most, tmp_path):
    scene, call = kt.make_scene("grid", bodies=9, seed=2), CALLS[name]
    start = kt.Simulation(scene, phase, live=phase != "naive")
    start.run(0.1)
    with traced(0) as tracer:
        call(copy(start), tmp_path)
    many = tracer.count
    for at in {1, many, *random.Random(7).sample(range(1, many + 1), min(most, many))}:
        sim = copy(start)
        with suppress(KeyboardInterrupt), traced(at):
            call(sim, tmp_path)
        assert_whole(sim)
        assert not list(tmp_path.glob(".*")), "a temporary file is left"
