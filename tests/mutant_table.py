"""What the kit makes of every mutant, as the tables of docs/conformance.md.

A program: it prints the rows of those mutants whose family or label has one of its arguments in it, or of
all. Each is judged as ``kinetile conform`` does with the default budget, until a check fails.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import mutants
import phase_mutant_table
from kinetile.conformance import Result
from phase_mutants import Mutant, judge

__all__ = ["ALL", "row"]

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


def main() -> None:
    """Judge mutants and print their rows."""
    print(HEAD)
    with tempfile.TemporaryDirectory() as folder:
        for mutant in ALL:
            words = f"{mutant.family} {mutant.label}"
            if any(word in words for word in sys.argv[1:] or [""]):
                print(row(mutant, judge(mutant, Path(folder))), flush=True)


if __name__ == "__main__":
    main()
