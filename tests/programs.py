"""Programs that are not Python: each is found, tried with the least that tests expect of it, then used.

A program that is found may still not run: ``rustc`` is a shim without a chosen toolchain, ``chromium`` only
prints how to install it, ``cc`` has no linker. Tests that need it are skipped then, with its own message.
"""

import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

PATIENCE = 600.0
"""Seconds by the clock within which a trial has to end; it takes one or two."""


class Trial(NamedTuple):
    """The trial of a program.

    Attributes:
        names: its possible names.
        words: its arguments; OUT is a program that it makes, which runs next.
        given: its input.
        answer: must be in the last output.
    """

    names: tuple[str, ...]
    words: tuple[str, ...]
    given: str = ""
    answer: str = "it runs"


OUT = "OUT"
_C = '#include <math.h>\n#include <stdio.h>\nint main(void) { return puts("it runs") < 0; }\n'

TRIALS = {
    "cc": Trial(("cc",), ("-x", "c", "-o", OUT, "-", "-lm"), _C),
    "c++": Trial(("c++",), ("-x", "c++", "-o", OUT, "-", "-lm"), _C),
    "chromium": Trial(("chromium", "chromium-browser", "google-chrome"), ("--version",), answer="Chrom"),
    "node": Trial(("node",), ("-",), "console.log('it runs')"),
    "npm": Trial(("npm",), ("--version",), answer="."),
    "rustc": Trial(("rustc",), ("--edition", "2021", "-o", OUT, "-"), 'fn main() { println!("it runs"); }'),
}


def program(name: str) -> str:
    """Returns the path of a program that runs; skips the test without one."""
    path, reason = found_and_tried(name)
    if not path:
        pytest.skip(reason)
    return path


@cache
def found_and_tried(name: str) -> tuple[str, str]:
    """Returns the path of a program that runs, or "" and the reason."""
    reasons = []
    for path in filter(None, map(shutil.which, TRIALS[name].names)):
        fault = _fault_of(path, TRIALS[name])
        if not fault:
            return path, ""
        reasons.append(f"{path} does not run: {fault}")
    return "", "; ".join(reasons) or f"there is no {name} here"


def _fault_of(path: str, trial: Trial) -> str:
    """Returns the message of a program that does not run, or ""."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        out = str(Path(folder, "out"))
        commands = [[path, *(out if word == OUT else word for word in trial.words)]]
        commands += [[out]] if OUT in trial.words else []
        try:
            for command in commands:
                done = subprocess.run(
                    command, input=trial.given, capture_output=True, text=True, timeout=PATIENCE, cwd=folder
                )
                if done.returncode:
                    said = (done.stderr or done.stdout).strip()[:300] or "nothing"
                    return f"exit code {done.returncode}, and it says: {said}"
        except (OSError, subprocess.TimeoutExpired) as error:
            return str(error)
    return "" if trial.answer in done.stdout else f"its answer is {done.stdout[:80]!r}"
