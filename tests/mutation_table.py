"""The tables of survivors in docs/mutation.md, printed anew from what ``kinetile mutate --json`` has found.

    kinetile mutate stripes --json > stripes.json
    python tests/mutation_table.py stripes.json

A survivor's explanation is known by its lines as they are changed (of what is dropped, by what that is), or,
where whatever is changed in a line survives for one reason, by that line as it was, or by both with an arrow
between. So it stays where the source moves; one without any is marked, and is to be read. What ``--record``
has left will do as well.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from itertools import groupby
from pathlib import Path
from typing import Any

from mutation_explained import EXPLAINED

NOT_READ = "**not read yet**"


def explanation(phase: str, survivor: dict[str, Any]) -> str:
    """Return why a mutant survives."""
    was, lines = (" ".join(" ".join(survivor[which]).split()) for which in ("before", "after"))
    key = survivor["label"].partition(" ")[2] if lines in ("", "pass") else lines
    known = EXPLAINED.get(phase, {})
    return known.get(f"{was} -> {key}") or known.get(key) or known.get(was) or NOT_READ


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

    def alike(each: dict[str, Any]) -> tuple[list[str], str]:
        return each["before"], explanation(found["broad_phase"], each)

    for (before, why), group in groupby(found["survivors"], alike):
        these = list(group)
        if len(these) == 1:
            label, after = these[0]["label"], code(these[0]["after"])
        else:
            place = these[0]["label"].partition(" ")[0]
            label = f"{place}, {len(these)} changes"
            after = "; ".join(each["label"].partition(" ")[2] for each in these).replace("|", "\\|")
        lines.append(f"| {label} | {code(before)} | {after} | {why} |")
    return lines


def found_in(text: str) -> dict[str, Any]:
    """Return what was found: as the command has printed it, or as it stands in a record, where what a mutant
    has come to last counts."""
    if "\n{" not in text.strip():
        return dict(json.loads(text))
    head, *rows = (json.loads(line) for line in text.splitlines())
    last = {row["number"]: row for row in rows if "number" in row}
    fates = Counter(
        f"killed by {row['check']}" if row["fate"] == "killed" else row["fate"] for row in last.values()
    )
    survivors = [last[number] for number in sorted(last) if last[number]["fate"] == "survived"]
    counts = {"judged": len(last), "counts": dict(fates.most_common()), "survivors": survivors}
    return head | {"mutants": head.get("mutants", len(last))} | counts


def main() -> None:
    for name in sys.argv[1:]:
        print("\n".join(table(found_in(Path(name).read_text(encoding="utf-8")))), end="\n\n")


if __name__ == "__main__":
    main()
