"""How long ``kinetile conform`` takes, and what it says: cold and warm, alone and beside busy processes.

``python docs/figures/conform_measured.py [PHASE ...]`` prints a table: for each phase one run with an empty
cache of machine code, then one with each of three seeds: alone, and once more beside four processes that
compute (``--busy 0 4``). Judged are the CPU seconds of the checks, in all are those of the
whole command.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import NamedTuple

import kinetile_plugins

NAMES = tuple(spec.name for spec in kinetile_plugins.kinetile_broad_phases())
SEEDS = (0, 1, 2)


class Judged(NamedTuple):
    """What one command said, and the seconds that it took."""

    said: str
    judged: float
    in_all: float
    wall: float


@contextmanager
def busy(number: int) -> Iterator[None]:
    """Processes that compute, for as long as this context lasts."""
    with ExitStack() as stack:
        for _ in range(number):
            process = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            stack.callback(process.wait)
            stack.callback(process.kill)
        yield


def judge(phase: str, seed: int, cache: str) -> Judged:
    """Run the command in a process of its own."""
    command = [sys.executable, "-m", "kinetile", "conform", phase, "--seed", str(seed), "--json"]
    began = time.monotonic()
    with tempfile.TemporaryFile("w+") as out:
        process = subprocess.Popen(
            command, stdout=out, stderr=subprocess.DEVNULL, env={**os.environ, "NUMBA_CACHE_DIR": cache}
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        report = json.loads(out.readlines()[-1])
    judged = sum(each["seconds"] for each in report["checks"])
    said = {0: "conforms", 1: "does not conform", 4: "not judged in time"}.get(process.returncode, "?")
    return Judged(said, judged, used.ru_utime + used.ru_stime, time.monotonic() - began)


def main() -> None:
    """Judges the phases that are named, and prints a row for each way to run."""
    parser = argparse.ArgumentParser()
    parser.add_argument("phases", nargs="*", default=NAMES)
    parser.add_argument("--busy", type=int, nargs="+", default=(0, 4))
    asked = parser.parse_args()
    print("| phase | | verdict, seeds 0 to 2 | CPU s judged | CPU s in all | wall s |")
    print("|---|---|---|---|---|---|")
    for phase in asked.phases:
        for beside in asked.busy:
            with tempfile.TemporaryDirectory() as cache, busy(beside):
                print_row(phase, f"cold, {beside} busy", [judge(phase, 0, cache)])
                print_row(phase, f"warm, {beside} busy", [judge(phase, seed, cache) for seed in SEEDS])


def print_row(phase: str, how: str, runs: list[Judged]) -> None:
    """Print a line of the table."""
    said = ", ".join(dict.fromkeys(run.said for run in runs))
    numbers = (", ".join(f"{run[k]:.0f}" for run in runs) for k in range(1, 4))
    print(f"| `{phase}` | {how} | {said} | {' | '.join(numbers)} |", flush=True)


if __name__ == "__main__":
    main()
