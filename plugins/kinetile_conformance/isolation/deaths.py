"""How a child of the kit ended, in a sentence."""

from __future__ import annotations

import signal
from dataclasses import dataclass

from kinetile.kernel.compiled.limits import out_of_time
from kinetile_conformance.court.limits import SCENE_SECONDS, SILENCE
from kinetile_conformance.isolation.child import NO_MEMORY
from kinetile_conformance.isolation.stacks import where

__all__ = ["GIB", "End", "cause"]

GIB = 1 << 30


@dataclass(frozen=True)
class End:
    """How a child ended.

    Attributes:
        code: its exit code, negative for a signal; None where it gave none.
        seen: what had failed in its last check before.
        silent: whether it was ended because nothing was heard of it any more.
    """

    code: int | None
    seen: str | None = None
    silent: bool = False

    @property
    def looping(self) -> bool:
        """Whether it was ended for the time that it took for one scene."""
        return out_of_time(self.code)


def cause(end: End, what: str, words: str, who: str, memory: int) -> str:
    """Say what a child died of.

    Args:
        end: how it ended.
        what: what it was at, such as "check 'same-contacts'".
        words: what it has printed, with the stack that was written when it died.
        who: the broad phase and whose it is.
        memory: the bytes that it was allowed to take.
    """
    place = where(words)
    if end.looping:
        there = f" in {place}" if place else ""
        return f"an endless loop{there}, in {what}: {SCENE_SECONDS:g} CPU s, and no end of one scene ({who})"
    if end.silent:
        there = f", in {place}" if place else ""
        return f"nothing was heard for {SILENCE:g} s in {what}{there}: does it wait for something? ({who})"
    if end.code == NO_MEMORY or "out of memory" in words.lower() or "MemoryError" in words:
        return f"out of memory in {what}: it asked for more than {memory / GIB:.3g} GiB ({who})"
    if end.code is None:
        return f"the process fell silent in {what} ({who})"
    near = f", in {place}" if place else ""
    if end.code < 0:
        return f"the process died of {_signal(-end.code)} in {what}{near} ({who})"
    return f"the process ended itself with status {end.code} in {what}{near} ({who})"


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
