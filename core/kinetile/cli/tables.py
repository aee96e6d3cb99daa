"""Results as tables for people; ``--json`` has the same numbers, and more, for programs."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

__all__ = [
    "LABEL",
    "columns",
    "comparison_table",
    "empty_table",
    "parameters_table",
    "plugins_table",
    "run_table",
    "scenes_table",
    "show",
]

LABEL = 17
"""Columns of the words in front of what a run did."""

_WIDE = 120


def columns() -> int:
    """Return how wide tables are: as the terminal, or 120 columns where there is none."""
    return Console().width if sys.stdout.isatty() else _WIDE


def show(*parts: Any) -> None:
    """Print tables and lines to stdout: as wide as the terminal, or 120 columns where there is none.

    A table with columns of numbers may be 120 wide on any terminal: a number over three lines is none.
    """
    wide = columns()
    console = Console(highlight=False, markup=False)
    with console.capture() as captured:
        for part in parts:
            numbers = isinstance(part, Table) and any(each.justify == "right" for each in part.columns)
            console.width = max(wide, _WIDE) if numbers else wide
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
    table = empty_table(
        "broad phase", "> contacts", "> time", "> events", "> CPU s", "fingerprint", "ended by"
    )
    for outcome in outcomes:
        table.add_row(
            outcome.phase,
            f"{outcome.contacts:,}",
            f"{outcome.time:.10g}",
            f"{outcome.events:,}",
            f"{outcome.cpu_seconds:.3g}",
            outcome.fingerprint[:16],
            (outcome.fault or "").partition(":")[0],
        )
    return table


def plugins_table(listing: Mapping[str, Sequence[Mapping[str, Any]]]) -> Table:
    """Return every phase and recipe that can be chosen by name, and who brings it."""
    table = empty_table("| kind", "| name", "what it does", "| from")
    last = None
    for row in sorted(listing["provided"], key=lambda row: str(row["kind"]).split()[::-1]):
        if last not in (None, row["kind"]):
            table.add_section()
        notes = [f"also called {', '.join(row['aliases'])}"] if row["aliases"] else []
        notes += [f"features: {', '.join(row['features'])}"] if row["features"] else []
        summary = " ".join([row["summary"], *(f"({note})" for note in notes)])
        source = f"{row['distribution']} {row['version'] or ''}" if row["distribution"] else "this process"
        table.add_row("" if row["kind"] == last else row["kind"], row["name"], summary, source)
        last = row["kind"]
    return table


def scenes_table(recipes: Iterable[Mapping[str, Any]]) -> Table:
    """Return the recipes: name, what it makes, its parameters."""
    table = empty_table("| recipe", "what it makes", "parameters")
    for recipe in recipes:
        parameters = ", ".join(each["name"] for each in recipe["parameters"])
        table.add_row(recipe["name"], recipe["summary"], recipe.get("error", parameters))
    return table


def parameters_table(parameters: Iterable[Mapping[str, Any]]) -> Table:
    """Return the parameters of a recipe: name, type, default."""
    table = empty_table("| parameter", "| type", "default")
    for each in parameters:
        table.add_row(each["name"], each["type"], str(each.get("default", "(none: must be given)")))
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
