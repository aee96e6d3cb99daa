"""Benchmarks as a notebook shows them: a table with a row for each that was measured, and where it was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kinetile.show.display.tables import grid, paragraph
from kinetile_accuracy.wording import cells

__all__ = ["Displayed"]

_PLAIN = (str, int, float, bool, type(None))


class Displayed:
    """Has rows of one dataclass, and the conditions under which they were measured; it displays itself.

    A column is a field; those that hold more than one value, and those that nobody has filled in, are left
    out.
    """

    rows: Any
    conditions: Mapping[str, Any]

    def displayed_rows(self) -> Sequence[Any]:
        """Return the rows."""
        found: Sequence[Any] = self.rows
        return found

    def _repr_html_(self) -> str:
        rows = [vars(row) for row in self.displayed_rows()]
        columns = {name: [row[name] for row in rows] for name in (rows[0] if rows else {})}
        shown = {
            name: values
            for name, values in columns.items()
            if all(isinstance(value, _PLAIN) for value in values) and any(v is not None for v in values)
        }
        numbers = [not any(isinstance(value, str) for value in values) for values in shown.values()]
        if "fingerprint" in shown:  # its beginning tells two apart
            shown["fingerprint"] = [value and value[:16] for value in shown["fingerprint"]]
        texts = zip(*map(cells, shown.values()), strict=True)
        table = grid(type(self).__name__, [name.replace("_", " ") for name in shown], list(texts), numbers)
        return "\n".join([table, paragraph(f"Measured with {_listed(self.conditions)}.")])


def _listed(conditions: Mapping[str, Any]) -> str:
    said = []
    for name, value in conditions.items():
        if isinstance(value, Mapping):
            said.append(_listed(value))
        elif value is not None:
            said.append(f"{name} {value}")
    return ", ".join(said)
