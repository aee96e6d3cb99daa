"""Dask clusters for tests: real processes, over TCP on the loopback interface, which can be killed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import installing


@contextmanager
def cluster(
    folder: Path, paths: Sequence[Sequence[str]], *, interpreted: bool = True
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler, and a worker for each of some PYTHONPATHs; yields its address and the workers."""
    environment = dict(os.environ)
    environment["PYTHONPATH"] = os.pathsep.join(installing.OWN)
    environment["NUMBA_DISABLE_JIT"] = "1" if interpreted else "0"
    file = folder / "scheduler.json"
    common = ["--scheduler-file", str(file), "--host", "tcp://127.0.0.1", "--no-dashboard"]
    how: dict[str, Any] = {"cwd": folder, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scratch = ["--local-directory", str(folder)]
    dask = [sys.executable, "-m", "dask"]
    started = [
        subprocess.Popen(
            [*dask, "scheduler", *common, "--port", "0"],
            env=environment,
            **how,
        )
    ]
    try:
        until = time.monotonic() + 60
        while not (file.exists() and file.read_text().strip().endswith("}")):
            assert started[0].poll() is None
            assert time.monotonic() < until
            time.sleep(0.05)
        for path in paths:
            started.append(
                subprocess.Popen(
                    [*dask, "worker", *common, "--nthreads", "1", "--no-nanny", *scratch],
                    env={**environment, "PYTHONPATH": os.pathsep.join([*path, *installing.OWN])},
                    **how,
                )
            )
        yield json.loads(file.read_text())["address"], started[1:]
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
