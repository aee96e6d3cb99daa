"""Messages on stderr, progress, signals and exit codes of all commands; stdout is for results."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from io import TextIOWrapper
from types import FrameType
from typing import TYPE_CHECKING, Any, Self, TextIO

import typer

from kinetile.errors import FAULTS as FAULTS_OF_RUNS
from kinetile.errors import KinetileError, RecordError, legible
from kinetile.run.interrupts import comes_later

if TYPE_CHECKING:
    from kinetile.run.simulation import Progress, Simulation

EXIT_FAULT = 1
DIFFERENT = 1
USAGE = 2
INTERRUPTED = 128 + signal.SIGINT
UNREAD = 128 + getattr(signal, "SIGPIPE", 13)
EXIT_ERRORS = (*FAULTS_OF_RUNS, RecordError)
"""Errors of a run after a correct command."""

BAR_DELAY = 2.0
"""Seconds that a run may take before its progress is shown."""


def echo(text: str = "") -> None:
    """Prints a result to stdout, without the control characters of a foreign text."""
    put(legible(text) + "\n")


def put(text: str) -> None:
    """Writes to stdout at once. Click would change the encoding of an ASCII stream."""
    sys.stdout.write(text)
    sys.stdout.flush()


def notice(text: str) -> None:
    """Writes a line to stderr. A closed or full stderr is not an error: the result matters more."""
    if sys.stderr is None:
        return
    try:
        sys.stderr.write(legible(text) + "\n")
        sys.stderr.flush()
    except OSError:
        _give_up(sys.stderr)


@contextmanager
def results_on_stdout() -> Iterator[None]:
    """Within this context results are printed; if they cannot be, an error message and exit code 1 follow. A
    closed stdout is reported before any work is done. If the reader of a pipe has closed it, no message
    follows, and the exit code is SIGPIPE's, as usual. Characters that an encoding lacks are escaped."""
    if sys.stdout is None:
        notice("kinetile: the result cannot be printed: stdout is closed")
        raise SystemExit(EXIT_FAULT)
    for stream, instead in ((sys.stdout, "backslashreplace"), (sys.stdin, "replace")):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=instead)
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except OSError as error:
        _give_up(sys.stdout)
        if isinstance(error, BrokenPipeError):
            raise SystemExit(UNREAD) from error
        what = "the result cannot be printed" if error.filename is None else str(error.filename)
        notice(f"kinetile: {what}: {error.strerror or error}")
        raise SystemExit(EXIT_FAULT) from error


def _give_up(stream: TextIO) -> None:
    """Sends the rest of a stream that cannot be written to the null device: Python flushes it at exit."""
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


@contextmanager
def exit_codes() -> Iterator[None]:
    """Turns kinetile's exceptions and the first signal into one message on stderr and an exit code."""
    with FirstSignal():
        try:
            yield
        except KinetileError as error:
            notice(f"kinetile: {error}")
            raise typer.Exit(EXIT_FAULT if isinstance(error, EXIT_ERRORS) else USAGE) from error
        except KeyboardInterrupt as error:
            notice("kinetile: interrupted")
            number = error.args[0] if error.args else signal.SIGINT
            raise typer.Exit(128 + number) from error
        except BrokenPipeError as error:  # Click would end with 1
            _give_up(sys.stdout)
            raise typer.Exit(UNREAD) from error


def make_ready(simulation: Simulation, label: str = "") -> None:
    """Compiles a simulation's loop, unless it begins as Python; prints a notice if that takes long, once for
    each choice of phases."""
    if not simulation.compiled:
        return
    fresh = simulation.cached is False
    if fresh:
        what = label or ", ".join([simulation.broad_phase, *simulation.narrow_phases])
        notice(f"compiling the loop for {what} (once for this choice of phases; about 10 s) ...")
    seconds = simulation.compile()
    if fresh:
        notice(f"compiled in {seconds:.1f} CPU s")


class FirstSignal:
    """Within this context the first Ctrl-C, SIGTERM or SIGHUP raises KeyboardInterrupt, with its ``number``.
    Later ones are ignored: they could interrupt the closing of a file. Only the main thread handles them."""

    def __init__(self) -> None:
        self.number: int | None = None
        self._another_ends = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        signals = signal.SIGTERM, signal.SIGINT, getattr(signal, "SIGHUP", signal.SIGINT)
        for number in signals if threading.current_thread() is threading.main_thread() else ():
            if number not in self._before and signal.getsignal(number) not in (None, signal.SIG_IGN):
                self._before[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def check(self) -> None:
        """Raises KeyboardInterrupt after a signal: an exception in a callback may have been lost there."""
        if self.number is not None:
            raise KeyboardInterrupt(self.number)

    @contextmanager
    def another_ends(self) -> Iterator[None]:
        """Within this context another signal raises KeyboardInterrupt too: for work that may be abandoned."""
        self._another_ends = True
        try:
            yield
        finally:
            self._another_ends = False

    def _receive(self, number: int, frame: FrameType | None) -> None:
        if (self.number is None or self._another_ends) and not comes_later(number, frame):
            self.number = self.number or number
            raise KeyboardInterrupt(self.number)


class Bar(AbstractContextManager["Bar"]):
    """A progress bar on stderr, on a terminal, after BAR_DELAY seconds; elsewhere, nothing."""

    def __init__(self, what: str, start: float = 0.0, max_contacts: int | None = None) -> None:
        self.what = what
        self.start = start
        self.max_contacts = max_contacts
        self._began: float | None = None
        self._bar: Any = None

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Removes the bar from the terminal, if it is shown."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def __call__(self, progress: Progress) -> None:
        """Shows the position of a run, from the progress that ``Simulation.run`` reports."""
        shares = []
        if progress.until is not None and progress.until > self.start:
            shares.append((progress.time - self.start) / (progress.until - self.start))
        if self.max_contacts:
            shares.append(progress.contacts / self.max_contacts)
        rate = progress.events / progress.cpu_seconds / 1e6 if progress.cpu_seconds else 0.0
        speed = f"{rate:.2f} million events / CPU s" if progress.compiled else "as Python: not compiled yet"
        self.show(
            max(shares, default=None), f"time {progress.time:.6g}, {progress.contacts:,} contacts, {speed}"
        )

    def count(self, done: int, total: int) -> None:
        """Shows the number of finished steps of a total."""
        self.show(done / total, f"{done} of {total} runs")

    def show(self, share: float | None, text: str) -> None:
        """Shows a share of the whole (None: unknown) and a text."""
        total, completed = (None, 0.0) if share is None else (1.0, share)
        if self._bar is not None:
            self._bar.update(0, total=total, completed=completed, text=text)
            return
        if self._began is None:
            self._began = time.monotonic()
        if time.monotonic() - self._began > BAR_DELAY and sys.stderr is not None and sys.stderr.isatty():
            self._bar = _bar()
            self._bar.add_task(self.what, total=total, completed=completed, text=text)
            self._bar.start()


def _bar() -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TimeRemainingColumn

    columns = "{task.description}", BarColumn(), "{task.fields[text]}", TimeRemainingColumn()
    return Progress(*columns, console=Console(stderr=True), transient=True)
