"""Programs that surely end, and fresh interpreters that call functions of the kit. A program receives and
sends bytes: an engine lines, an interpreter of the kit pickles. The interpreter's output, and the stack that
``faulthandler`` writes when it dies, are in a file. If the calling process ends, the pipes close, and the
interpreter ends too and removes its folder."""

import contextlib
import faulthandler
import gc
import os
import pickle
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any, BinaryIO, cast

from kinetile import registry
from kinetile.errors import BadOption, MissingExtra, NotJudged, Refused
from kinetile.instruments import as_python, compiled_by_default, out_of_time
from kinetile_conformance.cases import PhasePlugin, Subject, provided
from kinetile_conformance.deadline import SCENE_SECONDS, TimeIsUp, keep_limits, uncounted

AHEAD = 16
"""The most messages of a program that are read ahead."""

GRACE, PATROL = 2.0, 5.0
"""Seconds until a process has to end; and until the CPU time of a silent child is read."""

IDLE = 300.0
"""Seconds without CPU time and messages of a child until it is given up. Beside any number of busy processes,
a computing one gets some CPU time within them."""

NO_MEMORY = 77
RAISED = (BadOption, NotJudged, Refused)
"""Errors of phases and options, which a call raises in the calling process; any other is the kit's."""

Message = dict[str, Any]
Hear = Callable[[Message], object]
"""Sends a message, or is called with a received one."""


class Died(Exception):
    """A child has ended early, or was given up: ``how`` is the row of ``isolated.ENDINGS``, ``code`` its exit
    code, ``trace`` the traceback of an error of the kit, and ``words`` its output."""

    def __init__(self, how: str, code: int | None = None, trace: str = "", words: str = "") -> None:
        super().__init__(how, code, trace, words)
        self.how, self.code, self.trace, self.words = how, code, trace, words

    def __str__(self) -> str:
        return self.words.strip().rpartition("\n")[2] or "it has printed nothing"


def _ending(code: int | None, words: str) -> str:
    """Returns the kind of a child's end, by its exit code (None: it gave none) and output."""
    if out_of_time(code):
        return "endless"
    if code == NO_MEMORY or "out of memory" in words.lower() or "MemoryError" in words:
        return "memory"
    if code is None:
        return "closed"
    if -code in (getattr(signal, "SIGKILL", 0), signal.SIGTERM):
        return "killed"
    return "signal" if code < 0 else "exit"


class Program:
    """A running program; ``read`` reads one message from a stream, false at its end. Its own child processes
    may outlive it and hold the pipes, so threads read and write, and its process group ends with it."""

    def __init__(self, words: Sequence[str], read: Callable[[BinaryIO], Any], **how: Any) -> None:
        how |= {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "start_new_session": True}
        self._process: Any = subprocess.Popen(words, **how)
        self._sent: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self.came: queue.Queue[Any] = queue.Queue(AHEAD)
        for thread in (self._write, partial(self._read, read)):
            threading.Thread(target=thread, daemon=True).start()

    def _write(self) -> None:
        """Writes sent messages; if the program has ended, its output says so."""
        with contextlib.suppress(OSError), self._process.stdin as stream:
            while (sent := self._sent.get()) is not None:
                stream.write(sent)
                stream.flush()

    def _read(self, read: Callable[[BinaryIO], Any]) -> None:
        """Keeps the read messages, and None at their end."""
        with contextlib.suppress(Exception), self._process.stdout as stream:
            while came := read(stream):
                self.came.put(came)
        self.came.put(None)

    def send(self, sent: bytes) -> None:
        """Sends a message; has no effect if the program has ended."""
        self._sent.put(sent)

    def exit_code(self, seconds: float = GRACE) -> int | None:
        """Returns the exit code, negative for a signal; None if it still runs after ``seconds``."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)
        return cast(int | None, self._process.returncode)

    def cpu_seconds(self) -> float | None:
        """Returns the CPU seconds of the program alone; None if the system does not report them."""
        with contextlib.suppress(OSError, OverflowError, AttributeError):
            return time.clock_gettime(~self._process.pid << 3 | 2)  # Linux: the clock of another process
        return None

    def peak_bytes(self) -> int | None:
        """Returns the largest memory of the program; None if the system does not report it."""
        with contextlib.suppress(OSError, ValueError, StopIteration):
            lines = Path(f"/proc/{self._process.pid}/status").read_text(encoding="utf-8").splitlines()
            return 1024 * int(next(line for line in lines if line.startswith("VmHWM:")).split()[1])
        return None

    def end(self) -> None:
        """Ends the program and all processes that it started."""
        self._process.kill()
        with contextlib.suppress(OSError, AttributeError):  # Windows has no groups
            os.killpg(self._process.pid, signal.SIGKILL)
        self.exit_code()
        self._sent.put(None)


class Child(Program):
    """A running interpreter. It calls ``make`` with the phases under test and a function that sends messages;
    the result is the first argument of all calls. Raises Refused if an object cannot be sent to another
    process, MissingExtra if that needs cloudpickle."""

    def __init__(
        self,
        subject: Subject,
        make: Callable[[Subject, Hear], Any],
        environment: Mapping[str, str] | None = None,
    ) -> None:
        begin = pickled(subject, make)
        self._folder = tempfile.TemporaryDirectory(prefix="kinetile-child-", ignore_cleanup_errors=True)
        self._file, self.words = Path(self._folder.name) / "words", ""
        own = {
            "PYTHONPATH": os.pathsep.join(entry or os.getcwd() for entry in sys.path),
            "HYPOTHESIS_STORAGE_DIRECTORY": self._folder.name,  # not the working folder of the caller
        }
        command = [sys.executable, "-P", "-c", f"from {__name__} import main; main()", self._folder.name]
        env = {**os.environ, **own, **(environment or {})}
        with self._file.open("wb") as printed, uncounted():
            super().__init__(command, pickle.load, stderr=printed, env=env)
        self.send(begin)

    def call(self, function: Callable[..., Any], *arguments: Any, hear: Hear = lambda _: None) -> Any:
        """Returns the value of a function there, called with the result of ``make``, and arguments, as Python
        if hooks run as Python here; calls ``hear`` with each message. Raises Died if the process ends, or is
        ended after a long silence, and BadOption, NotJudged or Refused as the function does."""
        self.send(pickle.dumps((not as_python(), function, arguments)))
        trace = ""
        while (message := self.receive()) is not None:
            if "returned" in message:
                return message["returned"]
            if "raised" in message:
                raise message["raised"]
            trace = message.get("trace", "")
            hear(message)
        code = self.exit_code()
        self.end()
        raise Died("error" if trace else _ending(code, self.words), code, trace, self.words)

    def receive(self) -> Message | None:
        """Returns the next message; None if the child has ended. Raises Died after a long silence."""
        used, since = 0.0, time.monotonic()
        while True:
            ended = self._process.poll() is not None
            with contextlib.suppress(queue.Empty):
                return cast(Message | None, self.came.get(timeout=PATROL))
            if ended:
                return None  # a process that it started may hold its end
            now = self.cpu_seconds()
            if now is None or now > used:
                used, since = now or 0.0, time.monotonic()
            elif time.monotonic() > since + IDLE:
                self._process.send_signal(signal.SIGABRT)  # it writes its stack
                self.exit_code()
                self.end()
                raise Died("idle", words=self.words)

    def end(self) -> None:
        """Ends the process and all that it started; ``words`` is its output."""
        super().end()
        with contextlib.suppress(OSError):
            self.words = self._file.read_text(encoding="utf-8", errors="replace")
        self._folder.cleanup()


def pickled(subject: Subject, *more: object) -> bytes:
    """Returns phases, and more, as bytes for another process: phases added in this process with the names of
    their plugins, and objects that cannot be imported there by value. Raises Refused, and MissingExtra."""
    added = [(each.plugin, each.spec) for each in provided(subject) if each.distribution is None]
    if not added:
        return pickle.dumps((subject, added, *more))
    try:
        import cloudpickle  # type: ignore[import-untyped]
    except ImportError as error:
        raise MissingExtra("the conformance kit", "cloudpickle", "conformance") from error
    targets = [spec.target for _, spec in added]
    names = {str(target.__module__) for target in targets if not isinstance(target, str)} - {"__main__"}
    by_value = [sys.modules[name] for name in names if name in sys.modules and not _can_be_imported(name)]
    for module in by_value:
        cloudpickle.register_pickle_by_value(module)
    try:
        return bytes(cloudpickle.dumps((subject, added, *more)))
    except Exception as error:  # pickling has no error of its own
        text = f"cannot be sent to a process of its own ({type(error).__name__}: {error})"
        raise Refused(f"{subject.name} {text}: judge it in this process") from error
    finally:
        for module in by_value:
            cloudpickle.unregister_pickle_by_value(module)


def _can_be_imported(name: str) -> bool:
    """Returns True if another process with the same path finds a module of this name, in the same file."""
    parent = sys.modules.get(name.rpartition(".")[0])
    found = PathFinder.find_spec(name, getattr(parent, "__path__", None))
    return found is not None and found.origin == getattr(sys.modules[name], "__file__", None)


def in_a_child(
    function: Callable[..., Any],
    subject: Subject,
    *arguments: Any,
    environment: Mapping[str, str] | None = None,
) -> Any:
    """Returns the value of a function in a child, called with the phases under test, and arguments. Raises
    Died, TimeIsUp if a simulation takes longer than SCENE_SECONDS or waits, and BadOption, NotJudged or
    Refused from the function, or if phases cannot be sent."""
    child = Child(subject, _themselves, environment)
    try:
        return child.call(function, *arguments)
    except Died as died:
        if died.how in ("endless", "idle"):
            raise TimeIsUp from None
        raise
    finally:
        child.end()


def _themselves(subject: Subject, _: Hear) -> Subject:
    keep_limits(SCENE_SECONDS)
    return subject


def main() -> None:
    """Serves in a process of its own, through the pipes that are its input and output at first."""
    folder = sys.argv.pop()
    faulthandler.enable(file=2)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(ImportError, ValueError):  # Windows has neither
        import resource

        faulthandler.register(signal.SIGXCPU, file=2, chain=True)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    link, back = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)

    def send(message: Message) -> None:
        pickle.dump(message, back)
        back.flush()

    try:
        subject, added, make = pickle.load(link)
    except Exception as error:  # any error of unpickling a foreign phase
        text = f"the phase cannot be loaded in a process of its own ({error}): judge it in this process"
        send({"raised": Refused(text)})
        return
    try:
        for name, spec in added:
            plugin = PhasePlugin(spec)
            plugin.__name__ = name
            registry().add(plugin)
        server = make(subject, send)
        gc.freeze()  # present objects stay: a collection over them takes a tenth of a second each time
        calls: queue.SimpleQueue[tuple[bool, Callable[..., Any], tuple[Any, ...]]] = queue.SimpleQueue()
        threading.Thread(target=_listen, args=(link, calls, folder), daemon=True).start()
        while True:
            compiled, function, arguments = calls.get()
            try:
                with compiled_by_default(compiled):
                    found = {"returned": function(server, *arguments)}
            except RAISED as error:
                leave_without_memory(error)
                found = {"raised": next(kind for kind in RAISED if isinstance(error, kind))(str(error))}
            send(found)
    except Exception as error:  # an error of a phase is a result: this is an error of the kit
        leave_without_memory(error)
        send({"trace": traceback.format_exc()})
        raise


def _listen(link: BinaryIO, calls: queue.SimpleQueue[Any], folder: str) -> None:
    """Passes on the calls of the other process; when that has closed its end, ends this one and removes its
    folder: a killed process, or a worker of pytest-xdist, removes nothing at its exit."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            calls.put(pickle.load(link))
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(71)


def leave_without_memory(error: BaseException | None) -> None:
    """Ends this process if an error, or a cause of it, is a lack of memory."""
    while error is not None:
        if isinstance(error, MemoryError):
            os._exit(NO_MEMORY)
        error = error.__cause__ or error.__context__
