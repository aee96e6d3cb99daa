"""Pools: the workers of a study, which are processes of this machine, an executor, or a Dask cluster.

A pool gives an executor of ``concurrent.futures``, and another one when that breaks. This module imports
nothing numerical: a worker process begins here, and libraries read their number of threads when they are
imported.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from kinetile.errors import BadOption, KinetileError
from kinetile_accuracy.sections import needed

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""The environment variables from which libraries take their number of threads."""

_DASK_TIMEOUT = 30.0
"""Seconds to wait for workers to come, and for a scheduler to answer."""


class PoolError(KinetileError, RuntimeError):
    """The pool cannot run any more tasks; all finished rows are on disk."""


class Pool:
    """Base of all pools.

    Attributes:
        width: how many tasks run at one time.
        limit: CPU seconds of a task after which its worker is ended, or None.
    """

    limit: float | None = None

    def __init__(self, width: int) -> None:
        self.width = width

    def start(self) -> Executor:
        """Returns an executor that works: the first, or another one after one broke. Raises PoolError."""
        raise NotImplementedError

    def check(self, versions: Iterable[Mapping[str, str]]) -> None:
        """Raises VersionsDiffer where a worker has other versions than the tasks; each task checks too."""

    def beside(self, under_way: int) -> int:
        """Returns how many others of this many tasks ran at the same time on one machine, at most."""
        return min(under_way, self.width) - 1

    def end(self, *, at_once: bool) -> None:
        """Lets all workers go; ``at_once``: in the middle of their tasks."""


class GivenExecutor(Pool):
    """An executor of the user. It is not shut down, and if it breaks only the user can make another."""

    def __init__(self, executor: Executor, width: int) -> None:
        super().__init__(width)
        self._executor = executor
        self._started = False

    def start(self) -> Executor:
        """Returns the executor, once."""
        if self._started:
            raise PoolError("the executor that was given has broken: bring another one, and go on with that")
        self._started = True
        return self._executor


class LocalPool(Pool):
    """Processes of this machine, started afresh, with one thread each.

    Args:
        workers: how many.
        memory: the bytes that each may take beyond what it has at its beginning; None: no limit.
        limit: the CPU seconds that each may take for a task; None: no limit.
    """

    def __init__(self, workers: int, memory: int | None, limit: float | None = None) -> None:
        super().__init__(workers)
        self.limit = limit
        self._memory = memory
        self._pool: ProcessPoolExecutor | None = None
        self._leash: Connection | None = None

    def start(self) -> Executor:
        """Starts the processes, and waits until one of them works. Raises PoolError where none does."""
        self.end(at_once=True)
        context = multiprocessing.get_context("spawn")
        parent, self._leash = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            self.width, context, initializer=_begin_worker, initargs=(parent, self._memory, self.limit)
        )
        try:
            self._pool.submit(os.getpid).result()
        except BrokenExecutor as error:
            raise PoolError(
                "the worker processes do not start. In a script, what runs a study must stand behind "
                "`if __name__ == '__main__':`, for each worker imports the script"
            ) from error
        return self._pool

    def end(self, *, at_once: bool) -> None:
        """Lets the processes go; closing the pipe ends those that are at a task."""
        pool, leash = self._pool, self._leash
        self._pool = self._leash = None
        if pool is not None and not at_once:
            pool.shutdown(wait=True, cancel_futures=True)
        if leash is not None:
            leash.close()
        if pool is not None and at_once:
            with suppress(BrokenExecutor):
                pool.shutdown(wait=True, cancel_futures=True)


def _begin_worker(parent: Connection, memory: int | None, limit: float | None) -> None:
    """Prepares a worker process: one thread, ``memory`` bytes beyond what it has now, ``limit`` CPU seconds
    a task.

    ``parent`` is a pipe whose one writing end is held by the process that runs the study. When that closes
    it, or is killed, the worker ends too, in any state: so no kill leaves a worker behind.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in _THREADS:
        os.environ[name] = "1"
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    from kinetile.kernel.compiled.limits import limit_memory  # from here on with that number of threads
    from kinetile_bench.runner import limit_tasks

    if memory is not None:
        limit_memory(memory)
    if limit is not None:
        limit_tasks(limit)


def _end_with(parent: Connection) -> None:
    with suppress(EOFError, OSError):
        parent.recv_bytes()
    os._exit(0)


def processors() -> int:
    """Returns how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def memory_for(workers: int) -> int | None:
    """Returns the bytes for each of this many workers, None if the system does not report them: the
    machine's memory in equal shares, one of them for this process."""
    try:
        total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return None
    return total // (workers + 1)


class DaskPool(Pool):
    """Workers of Dask.

    Args:
        address: of a scheduler, such as "tcp://10.0.0.1:8786"; or "local", for workers of this machine that
            are started now.
        workers: how many to start, or to wait for.
        memory: the bytes of each worker that is started now.

    Raises MissingExtra without Dask, and BadOption where there is no scheduler or no worker.
    """

    def __init__(self, address: str, workers: int | None, memory: int | None) -> None:
        distributed = needed("A study on a cluster", "distributed", "dask")
        self._cluster: Any = None
        self._client: Any = None
        where: Any = address
        try:
            if address == "local":
                self._cluster = where = _local_cluster(distributed, workers, memory)
            self._client = distributed.Client(where, timeout=_DASK_TIMEOUT, set_as_default=False)
            self._client.wait_for_workers(workers or 1, timeout=_DASK_TIMEOUT)
        except (OSError, ValueError, TimeoutError) as error:
            self.end(at_once=True)
            raise BadOption(
                f"--dask {address}: {str(error) or type(error).__name__}; expected the address of a "
                "scheduler with workers, such as tcp://127.0.0.1:8786, or local"
            ) from error
        hosts: Counter[str] = Counter()  # how many tasks each machine runs at one time
        for worker, threads in self._client.nthreads().items():
            hosts[worker.rpartition(":")[0]] += threads
        self._most_on_a_host = max(hosts.values())
        super().__init__(sum(hosts.values()))

    def start(self) -> Executor:
        """Returns the cluster as an executor. Raises PoolError where the scheduler is gone."""
        if self._client.status != "running":
            raise PoolError("the cluster's scheduler is gone: the study goes on with another one")
        executor: Executor = self._client.get_executor(pure=False)
        return executor

    def check(self, versions: Iterable[Mapping[str, str]]) -> None:
        """Compares the versions of every worker; raises VersionsDiffer for the first that has others."""
        from kinetile_bench.task import check_versions, versions_here

        wanted = {name: version for each in versions for name, version in each.items()}
        try:
            answers = self._client.run(versions_here, wanted)
        except Exception as error:  # any error of unpickling without kinetile, or with another version
            raise PoolError(
                f"the workers cannot say which versions they have ({type(error).__name__}: {error}): "
                "expected kinetile on each of them, with the extra dask"
            ) from error
        for worker, found in answers.items():
            check_versions(wanted, found, f"the worker {worker}")

    def beside(self, under_way: int) -> int:
        """Returns how many others of this many tasks ran at the same time on one machine, at most."""
        return min(under_way, self._most_on_a_host) - 1

    def end(self, *, at_once: bool) -> None:
        """Leaves the cluster, and ends it where it was made here."""
        for each in (self._client, self._cluster):
            if each is not None:
                with suppress(Exception):  # parts that are gone already
                    each.close(timeout=5.0)
        self._client = self._cluster = None


def _local_cluster(distributed: Any, workers: int | None, memory: int | None) -> Any:
    return distributed.LocalCluster(
        n_workers=workers or processors(),
        threads_per_worker=1,
        processes=True,
        memory_limit=memory or 0,
        dashboard_address=None,
        silence_logs=logging.ERROR,
        env=dict.fromkeys(_THREADS, "1"),
    )
