"""Ctrl-C, taken at a moment that suits.

Python delivers a signal between two of its own instructions, wherever that is: after the compiled loop has
moved the bodies and before anybody has read its log, or inside a write. Here the signal is only noted, and
whoever asked for the delay raises it at the next safe place. A second signal is not delayed: the user means
it.
"""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

__all__ = ["Interrupts"]


class Interrupts:
    """A context in which the given signals (Ctrl-C if none is given) are noted instead of raised.

    ``received`` is the number of the first signal that came, or None. With ``patient`` even a second one
    waits: for short work that must not be torn, such as a write. Off the main thread, where no signal
    arrives, it does nothing.
    """

    def __init__(self, *numbers: int, patient: bool = False) -> None:
        self.received: int | None = None
        self._numbers = numbers or (signal.SIGINT,)
        self._patient = patient
        self._due = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in self._numbers:
                if signal.getsignal(number) not in (None, signal.SIG_IGN):
                    self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if error is None:
            self.check()

    def check(self) -> None:
        """Deliver a signal that was noted: to the handler it was kept from, or as KeyboardInterrupt."""
        if not self._due or self.received is None:
            return
        self._due = False
        handler = self._before[self.received]
        if not callable(handler):
            raise KeyboardInterrupt
        handler(self.received, None)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._due and not self._patient:
            self._due = False
            raise KeyboardInterrupt
        self.received, self._due = self.received or number, True
