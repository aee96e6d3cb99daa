"""Compiling meanwhile: another process compiles a loop into the disk cache while a run begins as Python.

The process makes the same engine from the same scene, at a lower priority, and ends by itself, even after the
end of the run, since the next run will need the loop. One process compiles at a time, and compiles nothing
that another one has compiled: the lock is on the folder of the cache, leaves no file, and the system releases
it when a process dies. Ctrl-C in a terminal ends it with the run.
"""

import multiprocessing
import os
import pickle
import sys
import tempfile
from contextlib import suppress
from typing import Any

from kinetile.kernel.compiled.cache import folder, problem
from kinetile.run.compose import CommandSupport, Composition

_PROCESS = os.getpid()


class Meanwhile:
    """The process that compiles a loop."""

    def __init__(self, process: int) -> None:
        self._process = process

    @property
    def runs(self) -> bool:
        """True until it has ended."""
        if self._process:
            with suppress(ChildProcessError):  # the program itself waits for all of its children
                if os.waitpid(self._process, os.WNOHANG) == (0, 0):
                    return True
        self._process = 0
        return False


NO_PROCESS = Meanwhile(0)
"""No process, or an ended one."""


def compile_meanwhile(loop: Any, of: Composition, commands: CommandSupport) -> Meanwhile:
    """Starts the process that compiles the loop of a composition; NO_PROCESS if it could not, or should not:
    there is one processor, this is a worker or a fork, or the loop cannot be kept on disk."""
    worker = multiprocessing.parent_process() is not None or os.getpid() != _PROCESS
    able = hasattr(os, "posix_spawn") and sys.executable and not getattr(sys, "frozen", False)
    if worker or not able or _processors() < 2 or loop.made.stats.cache_path is None or problem():
        return NO_PROCESS
    prepared = type(of.prepared), vars(of.prepared)  # by itself it would be the scene of the start
    wanted = prepared, of.broad_phase, of.narrow_phases, of.options, commands
    with suppress(Exception), tempfile.TemporaryFile() as file:  # pickling a scene may fail
        pickle.dump(wanted, file)
        file.seek(0)
        paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
        actions = [(os.POSIX_SPAWN_DUP2, file.fileno(), 0)]
        quiet = [(os.POSIX_SPAWN_OPEN, each, os.devnull, os.O_WRONLY, 0) for each in (1, 2)]
        command = [sys.executable, "-c", "from kinetile.run.compile_loop import main; main()"]
        environment = {**os.environ, "PYTHONPATH": paths}
        return Meanwhile(os.posix_spawn(command[0], command, environment, file_actions=[*actions, *quiet]))
    return NO_PROCESS


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def is_compiling() -> bool:
    """Returns True if such a process runs."""
    with suppress(ImportError, FileNotFoundError, NotADirectoryError):
        import fcntl

        place = os.open(folder(), os.O_RDONLY)
        try:
            fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(place)
    return False
