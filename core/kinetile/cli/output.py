"""Results on stdout. One set of rows has three forms: tables for people, as wide as the terminal; JSON and
CSV, with every digit, for programs. Rich is imported when a table is drawn."""

from __future__ import annotations

import csv as csv_format
import dataclasses
import io
import json as json_format
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import typer

from kinetile.cli.terminal import echo, put
from kinetile.errors import legible

if TYPE_CHECKING:
    from rich.table import Table

    from kinetile.scene import Scene

_ENDLESS = 100_000
_WITHIN = "\0"
"""Stands before the name of an entry until it is printed: names may contain dots (``P.error``)."""


def printed(result: Any, rows: Iterable[Any], *, json: bool, csv: bool) -> bool:
    """Prints a result as JSON, or its rows as CSV, if one of them is chosen; returns True then."""
    if json:
        echo(as_json(result))
    elif csv:
        put(legible(as_csv(rows)))
    return json or csv


def as_json(result: Any) -> str:
    """Returns a result as JSON text; numbers that are not finite, which JSON lacks, become null."""
    return json_format.dumps(_plain(result), indent=2, allow_nan=False)


def as_csv(rows: Iterable[Any]) -> str:
    """Returns rows (mappings, dataclasses or named tuples) as CSV text, with every digit: a column for each
    entry of a table (``outer.inner``), lists as JSON, an empty field for a missing entry."""
    flat = [dict(_flat(_plain(_fields(row)))) for row in rows]
    names = dict.fromkeys(name for row in flat for name in row)
    kept = [name for name in names if not any(other.startswith(name + _WITHIN) for other in names)]
    text = io.StringIO()
    writer = csv_format.DictWriter(text, kept, extrasaction="ignore", lineterminator="\n")
    if kept:
        writer.writerow({name: name.replace(_WITHIN, ".") for name in kept})
    writer.writerows(flat)
    return text.getvalue()


def _flat(row: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in row.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, before + name + _WITHIN)
        else:
            as_text = isinstance(value, bool | list | dict)
            yield before + name, json_format.dumps(value) if as_text else value


def _fields(row: Any) -> dict[str, Any]:
    if dataclasses.is_dataclass(row):
        return {field.name: getattr(row, field.name) for field in dataclasses.fields(row)}
    return dict(row._asdict() if hasattr(row, "_asdict") else row)


def _plain(value: Any) -> Any:
    """Returns a value in the types of JSON; a dataclass becomes a table, any other object its text."""
    if dataclasses.is_dataclass(value):
        value = _fields(value)
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(value) if abs(value) < float("inf") else None
    return value if value is None or isinstance(value, str | int) else str(value)


def scene_summary(scene: Scene) -> dict[str, Any]:
    """Returns the source and the size of a scene, in plain types."""
    return {
        "file": scene.origin.get("file"),
        "recipe": scene.origin.get("recipe"),
        "parameters": dict(scene.origin.get("parameters", {})),
        "bodies": len(scene),
        "shapes": Counter(scene.shapes[each].kind for each in scene.shape.tolist() if each >= 0),
        "arena": scene.arena and list(scene.arena),
        "periodic": scene.periodic,
        "gravity": list(scene.gravity),
        "start": scene.start,
        "turns": len(scene.turns),
    }


def show(*parts: Any) -> None:
    """Prints tables and lines to stdout: as wide as the terminal, and unbroken elsewhere, for programs. A
    table with columns of numbers is never broken."""
    from rich.console import Console
    from rich.measure import Measurement
    from rich.table import Table

    wide = Console().width if sys.stdout.isatty() else _ENDLESS
    console = Console(highlight=False, markup=False)
    with console.capture() as captured:
        for part in parts:
            console.width = _ENDLESS
            if not isinstance(part, Table) or all(each.justify != "right" for each in part.columns):
                console.width = wide
            elif wide < _ENDLESS:
                console.width = max(wide, Measurement.get(console, console.options, part).maximum)
            text = isinstance(part, str)
            console.print(legible(part) if text else part, soft_wrap=text)
    lines = [line.rstrip() for line in captured.get().splitlines()]
    put("\n".join(lines).strip("\n") + "\n" if parts else "")


def table_of(rows: Iterable[Any], columns: Mapping[str, Callable[[Any], str]], shared: int = 0) -> Table:
    """Returns rows as a table: ``columns`` maps each column's head to a function from a row to its text."""
    return rows_table(list(columns), [[text(row) for text in columns.values()] for row in rows], shared)


def rows_table(heads: Sequence[str], rows: Iterable[Sequence[str]], shared: int = 0) -> Table:
    """Returns rows of texts as a table, with heads as in ``empty_table``. The same text in the first
    ``shared`` columns is shown once, with a line before another text."""
    table = empty_table(*heads)
    last: list[str] | None = None
    for row in rows:
        first = list(row[:shared])
        if last not in (None, first):
            table.add_section()
        table.add_row(*([""] * shared if first == last else map(legible, first)), *map(legible, row[shared:]))
        last = first
    return table


def empty_table(*heads: str) -> Table:
    """Returns an empty table; ``>`` begins the head of a column of numbers, ``|`` if it never wraps."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for head in heads:
        mark, _, text = head.partition(" ") if head[:2] in ("> ", "| ") else ("", "", head)
        whole = mark == "|"  # a narrow terminal cuts such a text, and marks the cut
        table.add_column(
            text,
            justify="right" if mark == ">" else "left",
            no_wrap=whole,
            overflow="ellipsis" if whole else "fold",
        )
    return table


def show_labels(lines: Iterable[tuple[str, str]]) -> None:
    """Prints labels and texts as two columns, like ``show``, but without Rich: a twentieth of a short run."""
    labels, texts = ([*map(legible, each)] for each in zip(*lines, strict=True))
    width = max(map(len, labels)) + 2
    wide = get_terminal_size().columns - width if sys.stdout.isatty() else _ENDLESS
    for label, text in zip(labels, texts, strict=True):
        first, *more = wrap(text, max(wide, 1)) or [""]
        head = f"{label:{width}}"
        put((typer.style(head, bold=True) if sys.stdout.isatty() else head) + first + "\n")
        for each in more:
            put(" " * width + each + "\n")
