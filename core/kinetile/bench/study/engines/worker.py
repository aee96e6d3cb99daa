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
from pathlib import Path

__all__ = ["THREADS", "begin_worker", "is_there"]

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""The environment variables by which libraries are told how many threads to take."""


def begin_worker(parent: Connection, memory: int | None) -> None:
    """Prepare this process: ``memory`` is the bytes it may take beyond what it has now."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in THREADS:
        os.environ[name] = "1"
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    if memory is not None:
        _limit_memory(memory)


def is_there() -> int:
    """Return the number of this process: said by a worker that has begun."""
    return os.getpid()


def _watch(parent: Connection) -> None:
    with suppress(EOFError, OSError):
        parent.recv_bytes()
    os._exit(0)


def _limit_memory(more: int) -> None:
    """Let this process have so many bytes more than it has now, where the system can do that."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + more
        _, most = resource.getrlimit(resource.RLIMIT_AS)
        if most != resource.RLIM_INFINITY:
            limit = min(limit, most)
        resource.setrlimit(resource.RLIMIT_AS, (limit, most))
