"""Signals wait for a safe place, and only as long as they should."""

from __future__ import annotations

import signal
import threading

import pytest

from kinetile.run.interrupts import Interrupts


def press():
    signal.raise_signal(signal.SIGINT)


def test_the_first_waits_until_it_is_asked_for():
    with Interrupts() as interrupts:
        interrupts.check()
        press()
        assert interrupts.received == signal.SIGINT
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
        interrupts.check()


def test_at_the_latest_it_comes_at_the_end():
    done = []

    def work():
        with Interrupts():
            press()
            done.append(1)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == [1]


def test_a_second_is_meant():
    with Interrupts():
        press()
        with pytest.raises(KeyboardInterrupt):
            press()


def test_patient_work_is_not_torn_by_a_second():
    done = []

    def work():
        with Interrupts(patient=True):
            press()
            press()
            done.append(1)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == [1]


def test_an_inner_one_hands_on_to_the_outer():
    with Interrupts() as outer:
        with Interrupts(patient=True) as inner:
            press()
        assert inner.received == outer.received == signal.SIGINT
        with pytest.raises(KeyboardInterrupt):
            outer.check()


def test_an_error_goes_before_the_signal():
    def work():
        with Interrupts():
            press()
            raise ValueError("first")

    with pytest.raises(ValueError, match="first"):
        work()


def test_the_handler_from_before_is_put_back():
    before = signal.getsignal(signal.SIGINT)
    with Interrupts():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Interrupts() as interrupts:
            press()
        assert interrupts.received is None
    finally:
        signal.signal(signal.SIGINT, before)


def test_another_thread_is_left_alone():
    found = []

    def work():
        with Interrupts() as interrupts:
            interrupts.check()
            found.append(interrupts.received)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [None]
