"""Signals wait for the end of a step, all of them, and none is lost."""

import _signal
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext

import numpy as np
import pytest

import kinetile as kt
from kinetile.errors import PhaseError
from kinetile.run.engine import fields
from kinetile.run.interrupts import Unbroken


def press(number: int = signal.SIGINT) -> None:
    signal.raise_signal(number)


@pytest.fixture
def handled():
    before = {}

    def handle(number, handler):
        before[number] = signal.signal(number, handler)

    yield handle
    for number, handler in before.items():
        signal.signal(number, handler)


def press_within():
    with Unbroken():
        press()


def press_and_fail():
    press()
    raise ValueError("first")


@pytest.mark.parametrize(
    ("step", "raised", "done"),
    [
        (lambda: None, None, True),
        (lambda: (press(), press()), KeyboardInterrupt, True),
        (press_within, KeyboardInterrupt, True),
        (lambda: press(signal.SIGTERM), SystemExit, True),
        (press_and_fail, ValueError, False),
    ],
)
def test_a_step_is_done_before_its_signals_raise(handled, step, raised, done):
    """However many come, in an inner step too; a handler of one's own that raises waits; an error goes before
    the keyboard interrupt."""
    handled(signal.SIGTERM, lambda number, frame: sys.exit(number))
    found = []

    def work():
        with Unbroken():
            step()
            found.append(True)

    with pytest.raises(raised) if raised else nullcontext():
        work()
    assert found == [True] * done


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_every_handler_is_called_though_one_or_the_step_raises(handled, error):
    came = []
    handled(signal.SIGTERM, lambda number, frame: came.append((number, frame is not None)))

    def work():
        with Unbroken():
            press(signal.SIGTERM)
            press(signal.SIGTERM)
            if error is ValueError:
                raise error
            press()
            assert came == []

    with pytest.raises(error):
        work()
    assert came == [(signal.SIGTERM, True)]


@pytest.mark.parametrize("at", range(4))
def test_a_signal_while_the_handlers_are_changed_leaves_none_deaf(handled, monkeypatch, at):
    """One that comes after its own handler is back, and before the others are, raises at once."""
    came = []
    handled(signal.SIGTERM, lambda number, frame: came.append(number))
    change, calls = _signal.signal, []

    def interrupted(number, handler):
        before = change(number, handler)
        if number in (signal.SIGINT, signal.SIGTERM):
            calls.append(number)
            if len(calls) == at + 1:
                press()
        return before

    def work():
        with Unbroken():
            monkeypatch.setattr(_signal, "signal", change)
            if at > 1:
                calls[:] = [0, 0]
                monkeypatch.setattr(_signal, "signal", interrupted)

    if at <= 1:
        monkeypatch.setattr(_signal, "signal", interrupted)
    with pytest.raises(KeyboardInterrupt):
        work()
    monkeypatch.undo()
    press(signal.SIGTERM)
    assert came == [signal.SIGTERM]
    with pytest.raises(KeyboardInterrupt):
        press()


def test_what_is_ignored_stays_ignored(handled):
    handled(signal.SIGINT, signal.SIG_IGN)
    with Unbroken():
        press()


def test_another_thread_is_left_alone():
    def handler():
        with Unbroken():
            return signal.getsignal(signal.SIGINT)

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(handler).result() is signal.getsignal(signal.SIGINT)


def test_two_ctrl_c_while_the_recorder_takes_a_chunk_lose_no_row():
    sim = kt.Simulation(kt.make_scene("grid", bodies=9, seed=3), "naive")
    parts: list[np.ndarray] = []

    def interrupted(rows):
        press()
        press()
        parts.append(rows.copy())

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            sim.run(sim.time + 0.5, recorder=interrupted)
        assert len(np.concatenate(parts)) == len(sim.contacts)
        assert np.concatenate(parts)["time"][-1] <= sim.time
    again = kt.Simulation(sim.scene, "naive")
    again.run(max_contacts=len(sim.contacts))
    assert again.fingerprint == sim.fingerprint


def test_ctrl_c_ends_a_run_out_of_its_progress_and_its_audit(monkeypatch):
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, seed=3), "naive", audit=1)
    with pytest.raises(KeyboardInterrupt):
        sim.run(1.0, progress=lambda progress: press())
    done = []
    monkeypatch.setattr("kinetile.run.engine.engine.check_all", lambda *tables: (press(), done.append(1)))
    with pytest.raises(KeyboardInterrupt):
        sim.run(1.0)
    assert done == []


def test_rows_before_the_hook_that_raised_reach_the_recorder(monkeypatch):
    sim = kt.Simulation(kt.make_scene("grid", bodies=25, seed=3), "naive")
    bind, parts = fields.bound, []

    def broken(*tables, **how):
        def run(until, budget, contacts, quota):
            bind(*tables, **how)(until, budget, 7, quota)
            raise ValueError("a hook of an author")

        return run

    monkeypatch.setattr(fields, "bound", broken)
    with pytest.raises(PhaseError, match="a hook of an author"):
        sim.run(1.0, recorder=parts.append)
    assert len(np.concatenate(parts)) == len(sim.contacts) == 7
    assert np.concatenate(parts)["time"][-1] == sim.time
