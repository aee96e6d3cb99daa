"""Child processes of the kit: fresh interpreters, reached through a connection, and ended for sure.

There is one kind: an interpreter that runs one line of Python and has the other end of a connection
(``multiprocessing.connection``). What it prints, and the stack that ``faulthandler`` writes when it dies, go
to a file. When the calling process is gone, so is its end of the connection, and the child ends too.

No limit is one of time by the clock, which would judge the machine. A child that computes is limited in CPU
seconds, and one that uses none for minutes waits for something that does not come.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.machinery import PathFinder
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

from kinetile.errors import MissingExtra, Refused
from kinetile.kernel.compiled import nobody_compiles
from kinetile.plugin.registry import registry
from kinetile_conformance.cases import PhasePlugin, Subject, provided
from kinetile_conformance.deadline import begin_scene

GRACE = 2.0
"""Seconds that a process has to write its stack, or to end."""

PATROL = 5.0
"""Seconds without a message after which a child is looked at."""

IDLE = 300.0
"""Seconds in which a child uses no CPU time and sends nothing, after which it is given up. Beside any number
of busy processes, one that computes gets some CPU time within them."""

Message = dict[str, Any]


class Silent(Exception):
    """A child sends no more messages; ``busy`` says whether it computes, or waits."""

    def __init__(self, busy: bool) -> None:
        super().__init__(busy)
        self.busy = busy


class Child:
    """A running child.

    Args:
        program: the name of a function, ``package.module:function``, that is called in a fresh interpreter
            with the number of its end of the connection.
        words: the file for what it prints.
        environment: variables that it has beside those of this process.
        seconds: CPU seconds, of the child and of all that it starts, that may pass without a message.
    """

    def __init__(
        self, program: str, words: Path, environment: Mapping[str, str], seconds: float = 1_000.0
    ) -> None:
        self._seconds = seconds
        self._link, there = Pipe()
        number = there.fileno()
        how: dict[str, Any] = {"pass_fds": (number,), "start_new_session": True}
        if sys.platform == "win32":
            os.set_handle_inheritable(number, True)
            how = {"close_fds": False}
        module, _, function = program.partition(":")
        path = [entry or os.getcwd() for entry in sys.path]
        with words.open("wb") as printed:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", f"from {module} import {function}; {function}({number})"],
                stdin=subprocess.DEVNULL,
                stdout=printed,
                stderr=printed,
                env={**os.environ, **environment, "PYTHONPATH": os.pathsep.join(path)},
                **how,
            )
        there.close()

    def send(self, pickled: bytes) -> None:
        """Send it something; nothing happens if it is gone."""
        with contextlib.suppress(OSError):
            self._link.send_bytes(pickled)

    def receive(self) -> Message | None:
        """Return the next message; None where the child has ended, and sends no more. Raise Silent."""
        began: float | None = None
        used = since = 0.0
        try:
            while not self._link.poll(PATROL):
                if self.ended and not self._link.poll():
                    return None  # what it has started may hold its end
                now = self._used()  # for each message it would take longer than most scenes
                began = now if began is None else began
                if now > began + self._seconds:
                    raise Silent(busy=True)
                if now > used:
                    used, since = now, time.monotonic()
                elif time.monotonic() > since + IDLE:
                    raise Silent(busy=False)
            message = self._link.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            return None
        return message if isinstance(message, dict) else None

    def _used(self) -> float:
        """Return the CPU seconds of the child and of what it has started, where the system can tell; else
        those of this moment by the clock, as if it computed all the time."""
        if not Path("/proc/self/stat").exists():
            return time.monotonic()
        ticks = 0
        for stat in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError, ValueError):
                fields = stat.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
                if int(fields[3]) == self._process.pid:  # its session
                    ticks += sum(map(int, fields[11:15]))
        return ticks / os.sysconf("SC_CLK_TCK")

    @property
    def ended(self) -> bool:
        """Whether the process has ended."""
        return self._process.poll() is not None

    def exit_code(self) -> int | None:
        """Return the exit code, negative for a signal, of a process that sends no more messages; None if it
        still runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return self._process.wait(GRACE)
        return None

    def end(self, ask_where: bool = False) -> None:
        """End the process and all that it has started; with ``ask_where`` it first writes its stack."""
        if ask_where and hasattr(signal, "SIGABRT"):
            self._process.send_signal(signal.SIGABRT)
            self.exit_code()
        self._process.kill()
        if hasattr(os, "killpg"):
            with contextlib.suppress(OSError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self.exit_code()
        self._link.close()


@dataclass(frozen=True)
class Phases:
    """The phases under test, as they are sent to another process.

    ``added`` are those that were added in this process: the name of the plugin, and the spec.
    """

    subject: Subject
    added: tuple[tuple[str, Any], ...]

    @classmethod
    def of(cls, subject: Subject) -> Phases:
        """Return the phases of a subject."""
        here = [each for each in provided(subject) if each.distribution is None]
        return cls(subject, tuple((each.plugin, each.spec) for each in here))

    def register(self) -> Subject:
        """Add to this process's registry what was added in the other one's; return the subject."""
        for name, spec in self.added:
            plugin = PhasePlugin(spec)
            plugin.__name__ = name
            registry().add(plugin)
        return self.subject

    def pickled(self, more: object) -> bytes:
        """Return the phases and something more as bytes; what another process cannot import goes by value.

        Raises Refused where something of a phase cannot be sent, and MissingExtra.
        """
        if not self.added:
            return pickle.dumps((self, more))
        try:
            import cloudpickle  # type: ignore[import-untyped]
        except ImportError as error:
            raise MissingExtra("the conformance kit", "cloudpickle", "conformance") from error
        targets = [spec.target for _, spec in self.added]
        names = {str(target.__module__) for target in targets if not isinstance(target, str)} - {"__main__"}
        strangers = [
            sys.modules[name] for name in names if name in sys.modules and not _can_be_imported(name)
        ]
        for module in strangers:
            cloudpickle.register_pickle_by_value(module)
        try:
            return bytes(cloudpickle.dumps((self, more)))
        except Exception as error:  # pickling has no error of its own
            said = f"cannot be sent to a process of its own ({type(error).__name__}: {error})"
            raise Refused(f"{self.subject.name} {said}: judge it in this process") from error
        finally:
            for module in strangers:
                cloudpickle.unregister_pickle_by_value(module)


def _can_be_imported(name: str) -> bool:
    """Whether another process with the same path finds a module of this name, in the same file."""
    path: Any = None
    found = None
    parts = name.split(".")
    for end in range(1, len(parts) + 1):
        found = PathFinder.find_spec(".".join(parts[:end]), path)
        if found is None:
            return False
        path = found.submodule_search_locations
    return found is not None and found.origin == getattr(sys.modules[name], "__file__", None)


def in_a_fork(work: Callable[[], Any]) -> Any:
    """Return what a function returns in a worker of ``multiprocessing``, which is a fork with a limit of its
    own for a scene.

    Raises EOFError where that ends without a word.
    """
    here, there = Pipe(duplex=False)

    def serve() -> None:
        begin_scene()
        there.send(work())

    worker = multiprocessing.get_context("fork").Process(target=serve)
    with nobody_compiles():
        worker.start()
    there.close()
    try:
        return here.recv()
    finally:
        worker.join()


# In the child


def sent_through(link: Connection) -> Iterator[Message]:
    """Return what the other process sends; end this one when that has closed its end of the connection."""
    messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(link, messages), daemon=True).start()
    return iter(messages.get, {})


def _listen(link: Connection, messages: queue.SimpleQueue[Message]) -> None:
    with contextlib.suppress(EOFError, OSError):
        while True:
            messages.put(link.recv())
    os._exit(71)
