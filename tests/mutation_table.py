"""The tables of survivors in docs/mutation.md, printed anew from what ``kinetile mutate --json`` has found.

    kinetile mutate stripes --json > stripes.json
    python tests/mutation_table.py stripes.json

Explanations are those that stand in the tables of that page: a survivor is known by its lines as they were
and as they are changed, or by either, where all changes of it survive for one reason. So an explanation stays
where the source moves; a survivor without any is marked, and is to be read. What ``--record`` has left will
do as well.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from itertools import groupby
from pathlib import Path
from typing import Any

NOT_READ = "**not read yet**"
PAGE = Path(__file__).parents[1] / "docs" / "mutation.md"
CELLS = re.compile(r"(?<!\\) \| ")


def explained(page: str) -> dict[str, dict[str, str]]:
    """Return the explanations of a page by phase, and within by ``was -> is`` (of a row of several changes
    ``was -> change``), by what is, and by what was, where that has one explanation."""
    found: dict[str, dict[str, set[str]]] = {}
    known: dict[str, set[str]] = {}
    for line in page.splitlines():
        if head := re.match(r"`([\w-]+)`: \d+ of \d+ mutants judged", line):
            known = found.setdefault(head[1], {})
        elif line.startswith("| ") and len(cells := CELLS.split(line[2:-2])) == 4:
            label, was, now, why = cells
            changes = now.split("; ") if label.endswith(" changes") else [now]
            for key in (*(f"{was} -> {change}" for change in changes), now, was):
                known.setdefault(key, set()).add(why)
    return {
        phase: {key: min(whys) for key, whys in keys.items() if len(whys) == 1}
        for phase, keys in found.items()
    }


def explanation(known: dict[str, str], survivor: dict[str, Any]) -> str:
    """Return why a mutant survives."""
    was, now = code(survivor["before"]), code(survivor["after"])
    change = survivor["label"].partition(" ")[2].replace("|", "\\|")
    keys = (f"{was} -> {now}", f"{was} -> {change}", now, was)
    return next((known[key] for key in keys if key in known), NOT_READ)


def code(lines: list[str]) -> str:
    """Return lines as code in a cell of a table."""
    return f"`{' '.join(' '.join(lines).split())}`".replace("|", "\\|")


def table(found: dict[str, Any], known: dict[str, str]) -> list[str]:
    """Return the counts and the survivors of one phase, as Markdown."""
    counts = ", ".join(f"{fate} {count}" for fate, count in found["counts"].items())
    lines = [
        f"`{found['broad_phase']}`: {found['judged']} of {found['mutants']} mutants judged: {counts}.",
        "",
        "| survivor | was | is | why |",
        "|---|---|---|---|",
    ]

    def alike(each: dict[str, Any]) -> tuple[list[str], str]:
        return each["before"], explanation(known, each)

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
    of_phases = explained(PAGE.read_text(encoding="utf-8"))
    for name in sys.argv[1:]:
        found = found_in(Path(name).read_text(encoding="utf-8"))
        print("\n".join(table(found, of_phases.get(found["broad_phase"], {}))), end="\n\n")


if __name__ == "__main__":
    main()
