"""Results as tables for people; ``--json`` and ``--csv`` have the same numbers, and more, for programs."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table

__all__ = [
    "LABEL",
    "columns",
    "comparison_table",
    "empty_table",
    "parameters_table",
    "plugins_table",
    "rows_table",
    "run_table",
    "scenes_table",
    "show",
]

LABEL = 17
"""Columns of the words in front of what a run did."""

_ENDLESS = 100_000


def columns() -> int:
    """Return how wide tables may be: as the terminal. Without one nothing is broken into lines, because a
    program would have to put it together again."""
    return Console().width if sys.stdout.isatty() else _ENDLESS


def show(*parts: Any) -> None:
    """Print tables and lines to stdout: as wide as the terminal, and unbroken where there is none.

    A table with columns of numbers is unbroken on any terminal: a number over three lines is none.
    """
    wide = columns()
    console = Console(highlight=False, markup=False)
    with console.capture() as captured:
        for part in parts:
            console.width = _ENDLESS
            if not isinstance(part, Table) or all(each.justify != "right" for each in part.columns):
                console.width = wide
            elif wide < _ENDLESS:
                console.width = max(wide, Measurement.get(console, console.options, part).maximum)
            console.print(part, soft_wrap=isinstance(part, str))
    lines = [line.rstrip() for line in captured.get().splitlines()]
    sys.stdout.write("\n".join(lines).strip("\n") + "\n")


def run_table(result: Mapping[str, Any], course: Sequence[str] = ()) -> Table:
    """Return what a run did: the scene, the phases, counts, accuracy and cost, with units; among them lines
    that show how it went over time, where they are given."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for label, text in _run_lines(result, course):
        table.add_row(label, text)
    return table


def _run_lines(result: Mapping[str, Any], course: Sequence[str]) -> Iterable[tuple[str, str]]:
    from kinetile.run.readings.lines import reading_lines

    scene, run = result["scene"], result["run"]
    walls = f"in {scene['arena'][0]:g} x {scene['arena'][1]:g}" if scene["arena"] else "without walls"
    yield "scene", f"{_origin(scene)}: {scene['bodies']:,} discs {walls}"
    yield "phases", f"{_phase(result['broad_phase'], result['options'])}; {_narrow(result['narrow_phases'])}"
    yield "time", f"{scene['start']:g} to {run['time']:.10g}: {run['status']}"
    yield from zip(["over time", *[""] * len(course)], course, strict=False)
    yield from reading_lines(result["readings"])
    if result["events_file"]:
        written = result["events_file"]
        yield (
            "events file",
            f"{written['path']}: {written['rows']:,} events ({written['status'].partition(':')[0]})",
        )


def comparison_table(outcomes: Iterable[Any]) -> Table:
    """Return how each phase did, one row a phase."""
    heads = "broad phase", "> contacts", "> time", "> events", "> CPU s", "fingerprint", "ended by"
    rows = [
        (
            outcome.phase,
            f"{outcome.contacts:,}",
            f"{outcome.time:.10g}",
            f"{outcome.events:,}",
            f"{outcome.cpu_seconds:.3g}",
            outcome.fingerprint[:16],
            (outcome.fault or "").partition(":")[0],
        )
        for outcome in outcomes
    ]
    return rows_table(heads, rows)


def plugins_table(listing: Mapping[str, Sequence[Mapping[str, Any]]]) -> Table:
    """Return every phase and recipe that can be chosen by name, and who brings it."""
    rows = []
    for row in sorted(listing["provided"], key=lambda row: str(row["kind"]).split()[::-1]):
        notes = [f"also called {', '.join(row['aliases'])}"] if row["aliases"] else []
        notes += [f"features: {', '.join(row['features'])}"] if row["features"] else []
        summary = " ".join([row["summary"], *(f"({note})" for note in notes)])
        source = f"{row['distribution']} {row['version'] or ''}" if row["distribution"] else "this process"
        rows.append((row["kind"], row["name"], summary, source))
    return rows_table(("| kind", "| name", "what it does", "| from"), rows, shared=1)


def scenes_table(recipes: Iterable[Mapping[str, Any]]) -> Table:
    """Return the recipes: name, what it makes, its parameters."""
    table = empty_table("| recipe", "what it makes", "parameters")
    for recipe in recipes:
        parameters = ", ".join(each["name"] for each in recipe["parameters"])
        table.add_row(recipe["name"], recipe["summary"], recipe.get("error", parameters))
    return table


def parameters_table(parameters: Iterable[Mapping[str, Any]]) -> Table:
    """Return the parameters of a recipe: name, type, default."""
    none = "(none: must be given)"
    rows = [(each["name"], each["type"], str(each.get("default", none))) for each in parameters]
    return rows_table(("| parameter", "| type", "default"), rows)


def rows_table(heads: Sequence[str], rows: Iterable[Sequence[str]], shared: int = 0) -> Table:
    """Return rows as a table under heads as ``empty_table`` has them.

    Rows that have the same in their first ``shared`` columns show it once, and are parted from others.
    """
    table = empty_table(*heads)
    last: list[str] | None = None
    for row in rows:
        first = list(row[:shared])
        if last not in (None, first):
            table.add_section()
        table.add_row(*([""] * shared if first == last else first), *row[shared:])
        last = first
    return table


def empty_table(*heads: str) -> Table:
    """Return an empty table; ``>`` begins the head of a column of numbers, ``|`` of one that never wraps."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head in heads:
        mark, _, text = head.partition(" ") if head[:2] in ("> ", "| ") else ("", "", head)
        whole = mark == "|"  # what is cut all the same, on a narrow terminal, ends in a mark that says so
        table.add_column(
            text,
            justify="right" if mark == ">" else "left",
            no_wrap=whole,
            overflow="ellipsis" if whole else "fold",
        )
    return table


def _origin(scene: Mapping[str, Any]) -> str:
    if scene["file"]:
        return str(scene["file"])
    if scene["recipe"]:
        return f"{scene['recipe']} ({_options(scene['parameters'])})"
    return "arrays"


def _options(options: Mapping[str, Any]) -> str:
    return ", ".join(f"{key}={value}" for key, value in options.items())


def _phase(name: str, options: Mapping[str, Any]) -> str:
    return f"{name} ({_options(options)})" if options else name


def _narrow(phases: Mapping[str, Mapping[str, Any]]) -> str:
    return ", ".join(_phase(name, options) for name, options in phases.items()) or "no narrow phase"
