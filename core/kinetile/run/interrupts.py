"""Steps that no signal interrupts.

Python runs a signal's handler between any two of its instructions: after the compiled loop has moved the
bodies and before its log has been read, say. So a step that must not be divided runs within ``Unbroken``:
signals that arrive meanwhile wait for its end. A step within a step is part of it. Every public call that
changes a simulation is one step, and a long one has places that let signals through (``Interruptible``):
between two chunks of a run, in a user's ``progress``, in the compiler. Entering and leaving a step costs two
microseconds; it would be ten with ``signal``, which makes enums for ``_signal``.

If a step never ends, because a hook loops for ever, say, a signal without a handler in Python still ends the
process: SIGQUIT (Ctrl-\\) or SIGKILL.
"""

import _signal  # type: ignore[import-not-found]
import _thread
import signal
import sys
import threading
from types import FrameType, TracebackType
from typing import Any, Self

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM", "SIGVTALRM", "SIGUSR1", "SIGUSR2", "SIGXCPU", "SIGBREAK")
_SIGNALS = [int(getattr(signal, name)) for name in _NAMES if hasattr(signal, name)]


_LOADING = ("importlib._bootstrap", "llvmlite.")


def comes_later(number: int, frame: FrameType | None) -> bool:
    """Returns True if a signal's handler must not raise now, because modules are imported or machine code is
    loaded: there an error may become another one, or be lost. The signal is then sent again in a moment."""
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith(_LOADING):
            again = threading.Timer(0.02, _signal_main_thread, [number])
            again.daemon = True
            again.start()
            return True
        frame = frame.f_back
    return False


def _signal_main_thread(number: int) -> None:
    """Sends a signal again: one that only sets a flag, as ``interrupt_main`` does, ends no system call."""
    if sys.platform == "win32":
        _thread.interrupt_main(number)
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, number)


class Unbroken:
    """A context that delays the handlers of signals until its end; each is then called once. An error that
    ends the step precedes the KeyboardInterrupt of a Ctrl-C. Off the main thread it delays nothing."""

    _before: dict[int, Any]
    _noted: dict[int, FrameType | None]
    _waiting = False  # until all handlers are in place, and after that, each goes through at once
    _depth = 0  # steps within this one, which cannot be interrupted
    _within: "tuple[Unbroken, bool, int] | None" = None  # the outermost step, with its previous state

    def __enter__(self) -> Self:
        global _outermost
        if threading.current_thread() is not threading.main_thread():
            return self
        outer = _outermost
        if outer is None:
            self._before, self._noted = {}, {}
            try:
                self._take_handlers()
                self._waiting = True
                _outermost = self
            except BaseException:  # a signal meanwhile
                self._put_back()
                raise
        else:
            self._within = outer, outer._waiting, outer._depth
            outer._depth = outer._depth + 1 if outer._waiting else 0  # a step of user code begins a new count
            outer._waiting = True
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self._within is not None:
                outer, waited, depth = self._within
                outer._depth = depth
                if not waited:
                    outer._let_through()
            elif _outermost is self:
                self._give_back()
        except KeyboardInterrupt:
            if error is None:
                raise

    def _take_handlers(self) -> None:
        get, default, come = _signal.getsignal, _signal.SIG_DFL, self._come
        for number in _SIGNALS:
            handler = get(number)
            if handler is not default and callable(handler) and handler != come:
                self._before[number] = handler
                _signal.signal(number, come)

    def _give_back(self) -> None:
        global _outermost
        try:
            _outermost = None
            self._waiting = False
            self._put_back()
        except BaseException:  # a signal whose handler is back
            self._put_back()
            raise
        finally:
            self._deliver()

    def _put_back(self) -> None:
        for number, handler in self._before.items():
            if _signal.getsignal(number) == self._come:  # else user code has replaced it
                _signal.signal(number, handler)

    def _let_through(self) -> None:
        """Calls the delayed handlers, and delays no more. If one raises, signals wait again: nothing
        interrupts the code that the error passes."""
        self._deliver()
        self._waiting = False
        while self._noted:
            self._waiting = True
            self._deliver()
            self._waiting = False

    def _deliver(self) -> None:
        """Calls all delayed handlers, even if one raises."""
        if self._noted:
            number = next(iter(self._noted))
            frame = self._noted.pop(number)
            try:
                self._before[number](number, frame)
            finally:
                self._deliver()

    def _come(self, number: int, frame: FrameType | None) -> None:
        waits, self._waiting = self._waiting, _outermost is self
        self._noted.setdefault(number, frame)
        if not self._waiting:
            self._deliver()
        elif not waits:
            self._let_through()


_outermost: Unbroken | None = None
"""The step of the main thread that signals wait for now."""


class Interruptible:
    """A context in a step that lets signals through: for work that may take long and can be abandoned.
    Delayed signals arrive when it is entered. Outside of a step, in a step within a step, and off the main
    thread it does nothing."""

    _step: Unbroken | None = None

    def __enter__(self) -> Self:
        step = _outermost
        main = threading.current_thread() is threading.main_thread()
        if main and step is not None and step._waiting and step._depth == 0:
            self._step = step
            step._let_through()
        return self

    def __exit__(self, *error: object) -> None:
        if self._step is not None:
            self._step._waiting = True
            self._step._take_handlers()


def let_signals_through() -> None:
    """Handles the delayed signals, as an empty ``Interruptible`` does; cheap without any."""
    if _outermost is not None and _outermost._noted:
        with Interruptible():
            pass
