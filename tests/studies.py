"""Studies for tests: small ones, run in this process, or by commands in processes that can be killed."""

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

from typer.testing import CliRunner

import installing
from kinetile.cli import app
from kinetile_bench import Study
from kinetile_bench.store import Store
from kinetile_bench.study_run import StudyStatus

STUDY = """
phases = ["naive", "cells"]
seeds = { from = 1, to = 8 }
until = 0.1

[[scenes]]
recipe = "grid"
parameters = { bodies = [9, 25], density = [0.5, 0.05] }
"""

TASKS = 64
"""Tasks of STUDY, each of which takes some hundredths of a second, interpreted."""


def kinetile(*arguments: object) -> Any:
    """Run a command in this process; return exit code and output."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def write(folder: Path, text: str = STUDY) -> Path:
    """Write a study into a folder; return its file."""
    path = folder / "study.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def status_here(study: Study, **how: Any) -> StudyStatus:
    """Run a study in this process, where registered phases are known; return how it stands."""
    with ThreadPoolExecutor(1) as threads:
        return study.run(threads, workers=1, **how)


def run_here(study: Study, **how: Any) -> Study:
    """Do the same; return the study."""
    status_here(study, **how)
    return study


def stop_after(rows: int) -> Any:
    """Return a ``progress`` that ends a run when there are so many rows."""

    def progress(state: Any) -> None:
        if state.done >= rows:
            raise KeyboardInterrupt

    return progress


def study(*words: object, folder: Path, paths: Sequence[str] = ()) -> subprocess.CompletedProcess[str]:
    """Run ``kinetile study`` in a process of its own, interpreted."""
    return installing.run("study", *words, folder=folder, paths=paths)


def begin(
    *words: object, folder: Path, paths: Sequence[str] = (), interpreted: bool = True
) -> subprocess.Popen[str]:
    """Begin ``kinetile study`` in a process that leads its session."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*paths, *installing.OWN])}
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


def ended(process: subprocess.Popen[str], code: int = 0) -> tuple[str, str]:
    """Return the output of a study that ends with an exit code."""
    out, error = process.communicate(timeout=1200)
    assert process.returncode == code, (out, error)
    return out, error


def wait_for_rows(process: subprocess.Popen[str], results: Path, count: int) -> None:
    """Wait until a study that runs has so many rows."""
    until = time.monotonic() + 120
    while rows_there(results) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.01)


def rows_there(results: Path) -> int:
    """Return how many rows a folder has at the moment."""
    table = Store(results).read(["key"])
    return 0 if table is None else int(table.num_rows)


def workers_of(pid: int) -> list[int]:
    """Return the worker processes of a study that runs."""
    children = map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())
    return [child for child in children if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def all_end(pids: Sequence[int], seconds: float = 20.0) -> bool:
    """Whether all of some processes end within so many seconds."""
    until = time.monotonic() + seconds
    while any(map(_is_alive, pids)):
        if time.monotonic() > until:
            return False
        time.sleep(0.02)
    return True


def _is_alive(pid: int) -> bool:
    """Whether a process is there and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def kill(pid: int) -> None:
    """End one process, as the system does when memory runs out."""
    os.kill(pid, signal.SIGKILL)


def table(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a study without what depends on times and machine, compiled or not."""
    rows = Study(path).rows(timings=False)
    found: list[dict[str, Any]] = rows.drop_columns(["compiled"]).to_pylist()
    return found


def all_rows(path: Path) -> dict[str, dict[str, Any]]:
    """Return the rows of a study by their keys, with all columns."""
    return {row["key"]: row for row in Study(path).rows().to_pylist()}


def said(process: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    """Return what a command has printed as JSON."""
    found: dict[str, Any] = json.loads(process.stdout)
    return found
