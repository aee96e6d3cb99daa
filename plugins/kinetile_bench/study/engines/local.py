"""Processes of this machine: started afresh, with one thread each."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterable, Mapping
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import suppress
from multiprocessing.connection import Connection

from kinetile_bench.study.engines.engine import EngineError
from kinetile_bench.study.engines.worker import begin_worker, is_there

__all__ = ["LocalProcesses", "memory_for", "processors"]


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def memory_for(workers: int) -> int | None:
    """Return the bytes that each of so many workers may take: what the machine has, shared out with this
    process; None where it does not tell."""
    try:
        total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None
    return total // (workers + 1)


class LocalProcesses:
    """A pool of worker processes.

    Args:
        workers: how many.
        memory: the bytes that each may take beyond what it has at its beginning; None: no limit.
        limit: the CPU seconds that each may take for a task; None: no limit.
    """

    def __init__(self, workers: int, memory: int | None, limit: float | None = None) -> None:
        self.width = workers
        self.limit = limit
        self._memory = memory
        self._pool: ProcessPoolExecutor | None = None
        self._leash: Connection | None = None

    def start(self) -> Executor:
        """Start the processes, and see that one of them works. Raises EngineError where none does."""
        self.end(at_once=True)
        context = multiprocessing.get_context("spawn")
        parent, self._leash = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            self.width, context, initializer=begin_worker, initargs=(parent, self._memory, self.limit)
        )
        try:
            self._pool.submit(is_there).result()
        except BrokenExecutor as error:
            raise EngineError(
                "the worker processes do not start. In a script, what runs a study must stand behind "
                "`if __name__ == '__main__':`, for each worker imports the script"
            ) from error
        return self._pool

    def check(self, versions: Iterable[Mapping[str, str]]) -> None:
        """Nothing to be done: each task looks, and what is installed here is one installation."""

    def beside(self, under_way: int) -> int:
        """Return how many other tasks ran at the same time, at most."""
        return min(under_way, self.width) - 1

    def end(self, *, at_once: bool) -> None:
        """Let the processes go."""
        pool, leash = self._pool, self._leash
        self._pool = self._leash = None
        if pool is not None and not at_once:
            pool.shutdown(wait=True, cancel_futures=True)
        if leash is not None:
            leash.close()
        if pool is not None and at_once:
            with suppress(BrokenExecutor):
                pool.shutdown(wait=True, cancel_futures=True)
