"""Results for programs: all of a result as JSON, its rows as CSV."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["as_csv", "as_json", "printed", "scene_summary"]


def printed(result: Any, rows: Iterable[Mapping[str, Any]], *, json: bool, csv: bool) -> bool:
    """Print a result as JSON, or its rows as CSV, where one of them is asked for; return whether it was."""
    if json:
        typer.echo(as_json(result))
    elif csv:
        sys.stdout.write(as_csv(rows))
    return json or csv


def scene_summary(scene: Scene) -> dict[str, Any]:
    """Return where a scene comes from and how large it is, in plain types."""
    return {
        "file": scene.origin.get("file"),
        "recipe": scene.origin.get("recipe"),
        "parameters": dict(scene.origin.get("parameters", {})),
        "bodies": len(scene),
        "arena": scene.arena and list(scene.arena),
        "start": scene.start,
        "turns": len(scene.turns),
    }


def as_json(result: Any) -> str:
    """Return a result as JSON text; JSON has no numbers that are not finite: they become null."""
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def as_csv(rows: Iterable[Mapping[str, Any]]) -> str:
    """Return rows as CSV text, with every digit: a column for each entry of a table in a row
    (``outer.inner``), a list as JSON, and nothing for what is not there."""
    flat = [dict(_flat(_plain(dict(row)))) for row in rows]
    names = dict.fromkeys(name for row in flat for name in row)
    kept = [name for name in names if not any(other.startswith(f"{name}.") for other in names)]
    text = io.StringIO()
    writer = csv.DictWriter(text, kept, extrasaction="ignore", lineterminator="\n")
    if kept:
        writer.writeheader()
    writer.writerows(flat)
    return text.getvalue()


def _flat(row: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in row.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, f"{before}{name}.")
        else:
            as_text = isinstance(value, bool | list | dict)
            yield before + name, json.dumps(value) if as_text else value


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(value) if abs(value) < float("inf") else None
    return value if value is None or isinstance(value, str | int) else str(value)
