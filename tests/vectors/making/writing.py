"""How questions and answers stand in files: JSON, a line a question.

Doubles are written as ``float.hex`` writes them and ticks in decimal digits, both as strings: nothing is lost
in a reader whose numbers are doubles.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from .rules import Plan

__all__ = ["Row", "number", "numbers", "plan", "table"]

Row = Sequence[object]


def number(value: float) -> str:
    """Return a double as a string, ``"inf"`` for an infinite one; there is one zero."""
    return (value + 0.0).hex()


def numbers(*values: float) -> list[str]:
    """Return doubles as strings."""
    return [number(value) for value in values]


def plan(of: Plan) -> list[str]:
    """Return a plan: x, y, vx, vy, radius as doubles, and the anchor."""
    return [*numbers(*of[:5]), str(of.anchor)]


def table(about: str, fields: Sequence[str], families: Mapping[str, Sequence[Row]]) -> str:
    """Return a file of questions and answers: each family's rows, a line a row."""
    lines = [
        "{",
        f' "about": {json.dumps(about)},',
        f' "fields": {json.dumps(list(fields))},',
        ' "families": {',
    ]
    for name, rows in families.items():
        lines.append(f"  {json.dumps(name)}: [")
        lines += [_line(row) + "," for row in rows]
        lines[-1] = lines[-1].removesuffix(",")
        lines.append("  ],")
    lines[-1] = lines[-1].removesuffix(",")
    return "\n".join([*lines, " }", "}", ""])


def _line(row: Row) -> str:
    return json.dumps(list(row), separators=(",", ":"))
