"""Child processes of the kit: started afresh or forked, read with a time limit, and ended for sure.

Tasks go to a child, and messages come from it, as lines of JSON through two pipes. Its output, and the stack
that ``faulthandler`` writes when it dies, go to a file. When the calling process is gone, so is its end of
the pipe of tasks, and the child ends too.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

from kinetile.kernel.compiled import nobody_compiles

CAN_FORK = hasattr(os, "fork")
GRACE = 2.0
"""Seconds that a process has to write its stack, or to end."""

Tell = Callable[[dict[str, Any]], None]
Work = Callable[[Iterator[dict[str, Any]], Tell], None]


class _Handle(Protocol):
    """A process with ``poll``, as subprocess.Popen has it."""

    pid: int

    def poll(self) -> int | None: ...


class _Forked:
    """A forked process."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._ended: int | None = None

    def poll(self) -> int | None:
        """Return its exit code, negative for a signal; None while it runs."""
        if self._ended is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self._ended = os.waitstatus_to_exitcode(status)
        return self._ended


class Child:
    """A running child.

    Args:
        process: the process.
        news: the reading end of the pipe of its messages; taken over.
        tasks: the writing end of the pipe of its tasks; taken over.
    """

    def __init__(self, process: _Handle, news: int, tasks: int) -> None:
        self._process = process
        self._tasks = tasks
        self._lines: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, args=(news,), daemon=True)
        self._reader.start()

    def _read(self, news: int) -> None:
        with open(news, "rb") as lines:
            for line in lines:
                self._lines.put(line)
        self._lines.put(None)

    def ask(self, task: dict[str, Any]) -> None:
        """Send it a task; nothing happens if it is gone."""
        with contextlib.suppress(BrokenPipeError):
            left = json.dumps(task).encode() + b"\n"
            while left:
                left = left[os.write(self._tasks, left) :]

    def hear(self, seconds: float) -> dict[str, Any] | None:
        """Return the next message, or None when there will be none; raise TimeoutError after
        ``seconds``."""
        until = time.monotonic() + seconds
        while True:
            try:
                line = self._lines.get(timeout=max(until - time.monotonic(), 0.0))
            except queue.Empty:
                raise TimeoutError from None
            if line is None:
                return None
            with contextlib.suppress(ValueError):
                message = json.loads(line)
                if isinstance(message, dict):
                    return message

    def ended_already(self) -> bool:
        """Whether the process has ended."""
        return self._process.poll() is not None

    def ended(self) -> int | None:
        """Return the exit code of a process that sends no more messages; None if it still runs."""
        return self._wait(GRACE)

    def end(self, ask_where: bool = False) -> None:
        """End the process and all that it has started; with ``ask_where`` it first writes its stack."""
        if ask_where and hasattr(signal, "SIGABRT"):
            self._send(signal.SIGABRT)
            self._wait(GRACE)
        self._send(getattr(signal, "SIGKILL", signal.SIGTERM))
        self._wait(GRACE)
        if self._tasks >= 0:
            os.close(self._tasks)
            self._tasks = -1
        self._reader.join(GRACE)

    def _send(self, number: int) -> None:
        """Send a signal to the process and, where it leads a session, to whatever it has started."""
        with contextlib.suppress(OSError):
            if self._process.poll() is None:
                os.kill(self._process.pid, number)
            if hasattr(os, "killpg") and number != getattr(signal, "SIGABRT", None):
                os.killpg(self._process.pid, number)

    def _wait(self, seconds: float) -> int | None:
        until = time.monotonic() + seconds
        while (code := self._process.poll()) is None and time.monotonic() < until:
            time.sleep(0.005)
        return code


def afresh(program: str, order: dict[str, Any], words: Path) -> Child:
    """Run a line of Python in a new interpreter; the order is its first task."""
    path = [entry or os.getcwd() for entry in sys.path]
    with words.open("wb") as printed:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=printed,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
            start_new_session=True,
        )
    assert process.stdin is not None
    assert process.stdout is not None
    tasks, news = os.dup(process.stdin.fileno()), os.dup(process.stdout.fileno())
    process.stdin.close()
    process.stdout.close()
    child = Child(process, news, tasks)
    child.ask(order)
    return child


def forked(work: Work, words: Path) -> Child:
    """Run a function in a copy of this process, with all that is registered and imported in it.

    No other thread compiles while the copy is made; other threads are not in it.
    """
    news, to_news = os.pipe()
    from_tasks, tasks = os.pipe()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    with nobody_compiles():
        pid = os.fork()
    if pid == 0:
        code = 70
        try:
            os.setsid()
            os.close(news)
            os.close(tasks)
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            printed = os.open(words, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o600)
            os.dup2(printed, 1)
            os.dup2(printed, 2)
            as_a_child(work, to_news, from_tasks)
            code = 0
        except BaseException:
            os.write(2, traceback.format_exc().encode())
        finally:
            os._exit(code)
    os.close(to_news)
    os.close(from_tasks)
    return Child(_Forked(pid), news, tasks)


def news_apart() -> int:
    """Return a descriptor of what was the standard output, for messages; what is printed from now on, by a
    hook for instance, goes to the standard error and is no message."""
    news = os.dup(1)
    os.dup2(2, 1)
    return news


def as_a_child(work: Work, news: int, tasks: int) -> None:
    """Run the work of a child: send messages through ``news``, take tasks from ``tasks`` and end when that is
    closed, write the stack to standard error when dying."""
    faulthandler.enable(file=2)
    if hasattr(signal, "SIGXCPU"):
        faulthandler.register(signal.SIGXCPU, file=2, chain=True)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with contextlib.suppress(ImportError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(tasks, lines), daemon=True).start()

    def tell(message: dict[str, Any]) -> None:
        left = json.dumps(message).encode() + b"\n"
        while left:
            left = left[os.write(news, left) :]

    def given() -> Iterator[dict[str, Any]]:
        while True:
            yield json.loads(lines.get())

    work(given(), tell)


def _listen(tasks: int, lines: queue.SimpleQueue[bytes]) -> None:
    """Pass on lines from a pipe, and end this process when its other end is closed."""
    with open(tasks, "rb", closefd=False) as given:
        for line in given:
            lines.put(line)
    os._exit(71)
