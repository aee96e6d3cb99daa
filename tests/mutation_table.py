"""The tables of survivors in docs/mutation.md, printed anew from what ``kinetile mutate --json`` has found.

    kinetile mutate stripes --json > stripes.json
    python tests/mutation_table.py stripes.json

A survivor's explanation is known by its lines as they are changed (of what is dropped, by what that is), so
it stays where the source moves; one without any is marked, and is to be read.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from mutation_explained import EXPLAINED

NOT_READ = "**not read yet**"


def explanation(phase: str, survivor: dict[str, Any]) -> str:
    """Return why a mutant survives."""
    lines = " ".join(" ".join(survivor["after"]).split())
    key = survivor["label"].partition(" ")[2] if lines == "pass" else lines
    return EXPLAINED.get(phase, {}).get(key, NOT_READ)


def code(lines: list[str]) -> str:
    """Return lines as code in a cell of a table."""
    return f"`{' '.join(' '.join(lines).split())}`".replace("|", "\\|")


def table(found: dict[str, Any]) -> list[str]:
    """Return the counts and the survivors of one phase, as Markdown."""
    counts = ", ".join(f"{fate} {count}" for fate, count in found["counts"].items())
    lines = [
        f"`{found['broad_phase']}`: {found['judged']} of {found['mutants']} mutants judged: {counts}.",
        "",
        "| survivor | was | is | why |",
        "|---|---|---|---|",
    ]
    for each in found["survivors"]:
        why = explanation(found["broad_phase"], each)
        lines.append(f"| {each['label']} | {code(each['before'])} | {code(each['after'])} | {why} |")
    return lines


def main() -> None:
    for name in sys.argv[1:]:
        print("\n".join(table(json.loads(Path(name).read_text(encoding="utf-8")))), end="\n\n")


if __name__ == "__main__":
    main()
