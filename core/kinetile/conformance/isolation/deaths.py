"""How a child of the kit ended, in a sentence."""

from __future__ import annotations

import signal
from dataclasses import dataclass

from kinetile.conformance.isolation.child import NO_MEMORY
from kinetile.conformance.isolation.stacks import COMPILER, where

__all__ = ["GIB", "End", "cause"]

GIB = 1 << 30


@dataclass(frozen=True)
class End:
    """How a child ended.

    Attributes:
        code: its exit code, negative for a signal; None where it gave none.
        seconds: how long its last check took.
        seen: what had failed in that check before.
        late: whether it was ended because its time was up.
    """

    code: int | None
    seconds: float
    seen: str | None
    late: bool = False


def cause(end: End, check: str, words: str, who: str, memory: int, seconds: float) -> str:
    """Say what a child died of.

    Args:
        end: how it ended.
        check: the name of the check that it was at.
        words: what it has printed, with the stack that was written when it died.
        who: the broad phase and whose it is.
        memory: the bytes that it was allowed to take.
        seconds: the time that it was allowed to take.
    """
    place = where(words)
    if end.late:
        guess = f": an endless loop in {place}?" if place else ""
        if place == COMPILER:
            guess = ": it was still being compiled"
        return f"no answer within {seconds:g} s in check {check!r}{guess} ({who})"
    if end.code == NO_MEMORY or "out of memory" in words.lower() or "MemoryError" in words:
        return f"out of memory in check {check!r}: it asked for more than {memory / GIB:.3g} GiB ({who})"
    if end.code is None:
        return f"the process fell silent in check {check!r} ({who})"
    near = f", in {place}" if place else ""
    if end.code < 0:
        return f"the process died of {_signal(-end.code)} in check {check!r}{near} ({who})"
    return f"the process ended itself with status {end.code} in check {check!r}{near} ({who})"


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
