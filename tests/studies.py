"""Studies for tests: small ones, run in this process, or by commands in processes that can be killed."""

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
from kinetile_bench.study import StudyStatus

STUDY = """
phases = ["naive", "cells"]
seeds = 8
until = 0.1

[[scenes]]
recipe = "grid"
parameters = { bodies = [9, 25], density = [0.5, 0.05] }
"""

TASKS = 64
"""Tasks of STUDY; each takes some hundredths of a second, interpreted."""

RUN_TO_RUN = ("seconds", "environment", "compiled", "compile_seconds", "python_seconds")
"""Columns that differ from run to run, besides the columns of CPU time."""


def write(folder: Path, text: str = STUDY) -> Path:
    path = folder / "study.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def run_here(study: Study, **how: Any) -> StudyStatus:
    with ThreadPoolExecutor(1) as threads:
        return study.run(threads, workers=1, **how)


def begin(*words: object, folder: Path, paths: Sequence[str] = ()) -> subprocess.Popen[str]:
    """Begins ``kinetile study``, interpreted, in a process that leads its session."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*paths, *installing.OWN])}
    return subprocess.Popen(
        [sys.executable, "-m", "kinetile", "study", *map(str, words)],
        cwd=folder,
        env=environment | {"NUMBA_DISABLE_JIT": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def ended(process: subprocess.Popen[str], code: int = 0) -> tuple[str, str]:
    out, error = process.communicate(timeout=1200)
    assert process.returncode == code, (out, error)
    return out, error


def wait_for_rows(process: subprocess.Popen[str], study: Study, count: int) -> None:
    """Waits until a running study has a number of rows."""
    until = time.monotonic() + 120
    while len(study.rows()) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.01)


def workers_of(pid: int) -> list[int]:
    """Returns the worker processes of a running study."""
    children = map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())
    return [child for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def all_end(pids: Sequence[int], seconds: float = 20.0) -> bool:
    """Returns True if all of some processes end within ``seconds``."""
    until = time.monotonic() + seconds
    while any(map(_is_alive, pids)):
        if time.monotonic() > until:
            return False
        time.sleep(0.02)
    return True


def _is_alive(pid: int) -> bool:
    """Returns True if a process is there and is not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def kill(pid: int) -> None:
    """Ends one process, as the system does when memory runs out."""
    os.kill(pid, signal.SIGKILL)


def by_key(study: Study) -> dict[str, dict[str, Any]]:
    return {row["key"]: row for row in study.rows()}


def lasting(study: Study) -> list[dict[str, Any]]:
    """Returns the rows of a study without columns that depend on times and machine."""
    return [
        {name: value for name, value in row.items() if name not in RUN_TO_RUN and "cpu_second" not in name}
        for row in study.rows()
    ]
