"""Studies for tests: small ones, run as a user runs them, in processes that can be killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import installing
from kinetile_bench import Study
from kinetile_bench.study.store.rows import Store

STUDY = """
phases = ["naive", "cells"]
seeds = { from = 1, to = 8 }
until = 0.1

[[scenes]]
recipe = "grid"
parameters = { bodies = [9, 25], density = [0.5, 0.05] }
"""
"""64 tasks, each of which takes some hundredths of a second, interpreted."""


def write(folder: Path, text: str = STUDY) -> Path:
    """Write a study into a folder; return its file."""
    path = folder / "study.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def study(*words: object, folder: Path, paths: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
    """Run ``kinetile study``, interpreted."""
    return installing.run("study", *words, folder=folder, paths=paths)


def begin(
    *words: object, folder: Path, paths: Sequence[str] = (), interpreted: bool = True
) -> subprocess.Popen[str]:
    """Begin ``kinetile study`` in a process that leads its session."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    environment["NUMBA_DISABLE_JIT"] = "1" if interpreted else "0"
    return subprocess.Popen(
        [sys.executable, "-m", "kinetile", "study", *map(str, words)],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def rows_there(results: Path) -> int:
    """Return how many rows a folder has at the moment."""
    table = Store(results).read(["key"])
    return 0 if table is None else int(table.num_rows)


def wait_for_rows(process: subprocess.Popen[str], results: Path, count: int) -> None:
    """Wait until a study that runs has so many rows."""
    until = time.monotonic() + 120
    while rows_there(results) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.01)


def children(pid: int) -> list[int]:
    """Return the processes that a process has started and that are still there."""
    text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(word) for word in text.split()]


def workers_of(pid: int) -> list[int]:
    """Return the worker processes of a study that runs."""
    return [child for child in children(pid) if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def is_alive(pid: int) -> bool:
    """Whether a process is there and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def kill(pid: int) -> None:
    """End one process, as the system does when memory runs out."""
    os.kill(pid, signal.SIGKILL)


def sorted_rows(path: Path, folder: Path, paths: Sequence[str] = ()) -> bytes:
    """Return the rows of a study as the command writes them, but for timings."""
    out = folder / "rows.csv"
    done = study("table", path, "--rows", out, "--no-timings", folder=folder, paths=paths)
    assert done.returncode == 0, done.stderr
    return out.read_bytes()


def all_rows(path: Path) -> dict[str, dict[str, Any]]:
    """Return the rows of a study by their keys."""
    return {row["key"]: row for row in Study(path).rows().to_pylist()}


def said(process: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    """Return what a command has printed as JSON."""
    found: dict[str, Any] = json.loads(process.stdout)
    return found


def run_here(study: Study, **how: Any) -> Study:
    """Run a study in this process, where registered phases are known; return it."""
    with ThreadPoolExecutor(1) as threads:
        study.run(threads, workers=1, **how)
    return study
