"""What the kit makes of every mutant, as the tables of docs/conformance.md.

A program: it prints the rows of those mutants whose family or label has one of its arguments in it, or of
all. Each is judged as ``kinetile conform`` does with the default budget, until a check fails.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import mutants
import phase_mutant_table
from kinetile.kernel.compiled import INTERPRETED
from kinetile_conformance import Result
from phase_mutants import Mutant, judge

__all__ = ["ALL", "judged", "row"]

ONE = "--one"
FIRST = ("same-contacts", "same-contacts-with-turns", "writes-only-where-it-may")
"""What kills most, when hooks are interpreted."""

ALL = (*phase_mutant_table.MUTANTS, *mutants.MUTANTS, *mutants.HARMLESS)

HEAD = """| phase | mutant | what it stands for | killed by | bodies |
|---|---|---|---|---|"""


def row(mutant: Mutant, found: Result | None) -> str:
    """Return a mutant's row."""
    if found is None:
        by, bodies = f"nothing: {mutant.fate}", ""
    elif found.unjudged:
        by, bodies = f"nothing: `{found.check}` was not judged", ""
    else:
        by, bodies = f"`{found.check}`", "" if found.bodies is None else str(found.bodies)
    return f"| `{mutant.base}` | {mutant.name} | {mutant.why} | {by} | {bodies} |"


def judged(mutant: Mutant) -> str:
    """Return a mutant's row: first interpreted, by the checks that kill most; then compiled, by all.

    To compile a mutant's loops takes a minute, and most need not be.
    """
    for interpreted in ("1", "0"):
        done = subprocess.run(
            [sys.executable, __file__, ONE, mutant.label],
            env={**os.environ, "NUMBA_DISABLE_JIT": interpreted},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise RuntimeError(f"{mutant.label}: {done.stderr}")
        if interpreted == "0" or "nothing: " not in done.stdout:
            break
    return done.stdout.strip()


def judge_one(label: str) -> str:
    """Return the row of a mutant, as far as this process can judge it."""
    (mutant,) = (mutant for mutant in ALL if mutant.label == label)
    with tempfile.TemporaryDirectory() as folder:
        return row(mutant, judge(mutant, Path(folder), FIRST if INTERPRETED else None))


def main() -> None:
    """Judge mutants and print their rows."""
    if sys.argv[1:2] == [ONE]:
        print(judge_one(sys.argv[2]))
        return
    print(HEAD)
    for mutant in ALL:
        words = f"{mutant.family} {mutant.label}"
        if any(word in words for word in sys.argv[1:] or [""]):
            print(judged(mutant), flush=True)


if __name__ == "__main__":
    main()
