"""How a worker process of this machine begins: with one thread and a limit for its memory; how it ends.

It imports nothing that computes, so that the number of threads can still be said. The pipe that it watches
has one writing end, which the process that runs the study holds: when that closes it, or is killed, the
worker goes too, whatever it is at.
"""

from __future__ import annotations

import os
import signal
import threading
from contextlib import suppress
from multiprocessing.connection import Connection

__all__ = ["THREADS", "begin_worker", "is_there"]

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""The environment variables by which libraries are told how many threads to take."""


def begin_worker(parent: Connection, memory: int | None, limit: float | None) -> None:
    """Prepare this process.

    ``memory`` is the bytes it may take beyond what it has now, ``limit`` the CPU seconds for each task.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in THREADS:
        os.environ[name] = "1"
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    from kinetile.kernel.compiled.limits import limit_memory
    from kinetile_bench.study.work.limit import limit_tasks  # what computes is imported from here on

    if memory is not None:
        limit_memory(memory)
    if limit is not None:
        limit_tasks(limit)


def is_there() -> int:
    """Return the number of this process: said by a worker that has begun."""
    return os.getpid()


def _watch(parent: Connection) -> None:
    with suppress(EOFError, OSError):
        parent.recv_bytes()
    os._exit(0)
