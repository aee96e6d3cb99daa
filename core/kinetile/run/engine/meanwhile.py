"""Compiling meanwhile: a process of its own compiles a loop into the disk cache while a run begins as Python.

The process makes the same engine from the same scene, at a lower priority, and ends by itself: also where the
run has ended before, since the next one will want the loop. One of them compiles at a time, and what another
has compiled is not compiled again: the lock is on the folder of the cache, leaves no file, and is released by
the system when a process dies. Ctrl-C in a terminal ends it with the run.
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
        """Whether it has not ended yet."""
        if self._process:
            with suppress(ChildProcessError):  # the program waits for all of its children by itself
                if os.waitpid(self._process, os.WNOHANG) == (0, 0):
                    return True
        self._process = 0
        return False


NO_PROCESS = Meanwhile(0)
"""Stands for no process, and for one that has ended."""


def compile_meanwhile(loop: Any, of: Composition, commands: CommandSupport) -> Meanwhile:
    """Starts the process that compiles the loop of a composition; NONE where it could not, or should not:
    there is one processor, this is a worker or a fork, or the loop cannot be kept on disk."""
    worker = multiprocessing.parent_process() is not None or os.getpid() != _PROCESS
    able = hasattr(os, "posix_spawn") and sys.executable and not getattr(sys, "frozen", False)
    if worker or not able or _processors() < 2 or loop.made.stats.cache_path is None or problem():
        return NO_PROCESS
    prepared = type(of.prepared), vars(of.prepared)  # by itself it would be the scene of the start
    wanted = prepared, of.broad_phase, of.narrow_phases, of.options, commands
    with suppress(Exception), tempfile.TemporaryFile() as file:  # a scene may hold what cannot be pickled
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
    """Whether such a process is at work."""
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
