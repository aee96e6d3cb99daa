"""Steps that no signal tears.

Python runs a signal's handler between two of its own instructions, anywhere: after the compiled loop
has moved the bodies and before its log has been read, or inside a write. The state is then
inconsistent. So a step that must happen as a whole is done within ``Unbroken``:
signals that come meanwhile wait for its end. A second Ctrl-C waits as well; a step is a fraction of a second.

A step within a step is part of it: the outer one does the waiting for both. Entering and leaving costs two
microseconds, so that an interactive command, which takes some twenty, can be a step too. It would be ten with
the functions of ``signal``, which convert to enums what those of ``_signal``, the same functions, take and
return unchanged.

Where a step does not end at all, in a hook that loops for ever, say, a signal without a handler in Python
still ends the process: SIGQUIT (Ctrl-\\) or SIGKILL.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]
import signal
import threading
from types import FrameType, TracebackType
from typing import Any, ClassVar, Self

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM", "SIGVTALRM", "SIGUSR1", "SIGUSR2", "SIGXCPU", "SIGBREAK")
_SIGNALS = [int(getattr(signal, name)) for name in _NAMES if hasattr(signal, name)]


class Unbroken:
    """A context whose end the handlers of signals wait for; each is then called once.

    An error that ends the step goes before the KeyboardInterrupt of a Ctrl-C. Off the main thread, where no
    handler runs, there is nothing to wait.
    """

    _outermost: ClassVar[Unbroken | None] = None  # of the main thread: the step that signals wait for now

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._noted: dict[int, FrameType | None] = {}
        self._waiting = False  # until all handlers are in place, and after that, each goes through at once

    def __enter__(self) -> Self:
        if Unbroken._outermost is None and threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                handler = _signal.getsignal(number)
                if callable(handler):
                    self._before[number] = handler
                    _signal.signal(number, self._come)
            self._waiting = True
            Unbroken._outermost = self
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if Unbroken._outermost is not self:
            return
        Unbroken._outermost = None
        self._waiting = False
        try:
            for number, handler in self._before.items():
                _signal.signal(number, handler)
        finally:
            try:
                self._deliver()
            except KeyboardInterrupt:
                if error is None:
                    raise

    def _deliver(self) -> None:
        """Calls the handlers that have waited: all of them, though one raises."""
        if self._noted:
            number = next(iter(self._noted))
            frame = self._noted.pop(number)
            try:
                self._before[number](number, frame)
            finally:
                self._deliver()

    def _come(self, number: int, frame: FrameType | None) -> None:
        if self._waiting:
            self._noted.setdefault(number, frame)
        else:
            self._before[number](number, frame)
