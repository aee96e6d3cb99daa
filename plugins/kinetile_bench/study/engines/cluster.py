"""A Dask cluster: one that runs somewhere, by the address of its scheduler, or one made here for a while."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from typing import Any

from kinetile.errors import BadOption
from kinetile_accuracy.parts import needed
from kinetile_bench.study.engines.engine import EngineError
from kinetile_bench.study.engines.worker import THREADS
from kinetile_bench.study.work.identity import check_versions, versions_here

__all__ = ["DaskCluster"]

_PATIENCE = 30.0
"""Seconds to wait for workers to come, and for a scheduler to answer."""


class DaskCluster:
    """Workers of Dask.

    Args:
        address: of a scheduler, such as "tcp://10.0.0.1:8786"; or "local", for workers of this machine that
            are started now.
        workers: how many to start, or to wait for.
        memory: the bytes of each worker that is started now.

    Raises MissingExtra without Dask, and BadOption where there is no scheduler or no worker.
    """

    limit: float | None = None

    def __init__(self, address: str, workers: int | None, memory: int | None) -> None:
        distributed = needed("A study on a cluster", "distributed", "dask")
        self._cluster: Any = None
        self._client: Any = None
        where: Any = address
        try:
            if address == "local":
                self._cluster = where = _local_cluster(distributed, workers, memory)
            self._client = distributed.Client(where, timeout=_PATIENCE, set_as_default=False)
            self._client.wait_for_workers(workers or 1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError) as error:
            self.end(at_once=True)
            raise BadOption(
                f"--dask {address}: {str(error) or type(error).__name__}; expected the address of a "
                "scheduler with workers, such as tcp://127.0.0.1:8786, or local"
            ) from error
        self._hosts = self._find_hosts()
        self.width = sum(self._hosts.values())

    def _find_hosts(self) -> Counter[str]:
        """Return how many tasks each machine does at one time."""
        hosts: Counter[str] = Counter()
        for address, threads in self._client.nthreads().items():
            hosts[address.rpartition(":")[0]] += threads
        return hosts

    def start(self) -> Executor:
        """Return the cluster as an executor. Raises EngineError where there is none any more."""
        if self._client.status != "running":
            raise EngineError("the cluster's scheduler is gone: the study goes on with another one")
        executor: Executor = self._client.get_executor(pure=False)
        return executor

    def check(self, versions: Iterable[Mapping[str, str]]) -> None:
        """Ask every worker for its versions; raise VersionsDiffer for the first that has others."""
        wanted = {name: version for each in versions for name, version in each.items()}
        try:
            answers = self._client.run(versions_here, wanted)
        except Exception as error:  # whatever unpickling raises where kinetile is not, or is another one
            raise EngineError(
                f"the workers cannot say which versions they have ({type(error).__name__}: {error}): "
                "expected kinetile on each of them, with the extra dask"
            ) from error
        for worker, found in answers.items():
            check_versions(wanted, found, f"the worker {worker}")

    def beside(self, under_way: int) -> int:
        """Return how many other tasks ran on one machine at the same time, at most."""
        return min(under_way, max(self._hosts.values())) - 1

    def end(self, *, at_once: bool) -> None:
        """Leave the cluster, and end it where it was made here."""
        for each in (self._client, self._cluster):
            if each is not None:
                with suppress(Exception):  # whatever is gone already
                    each.close(timeout=5.0)
        self._client = self._cluster = None


def _local_cluster(distributed: Any, workers: int | None, memory: int | None) -> Any:
    from kinetile_bench.study.engines.local import processors

    return distributed.LocalCluster(
        n_workers=workers or processors(),
        threads_per_worker=1,
        processes=True,
        memory_limit=memory or 0,
        dashboard_address=None,
        silence_logs=logging.ERROR,
        env=dict.fromkeys(THREADS, "1"),
    )
