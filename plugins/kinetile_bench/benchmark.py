"""Basis of all benchmarks: phases with their options, and results that a notebook can show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kinetile.show.html import grid, paragraph
from kinetile_accuracy.sections import cells

Choice = str | tuple[str, Mapping[str, Any]]
"""A broad phase by name, or its name and its options."""


def phases_with_options(choices: Sequence[Choice]) -> list[tuple[str, dict[str, Any]]]:
    """Returns (name, options) for each choice of a broad phase."""
    return [(each, {}) if isinstance(each, str) else (each[0], dict(each[1])) for each in choices]


_PLAIN = (str, int, float, bool, type(None))


class Measured:
    """Rows of one dataclass, and the conditions under which they were measured; a notebook shows it.

    A column is a field; fields that hold more than one value, and those without any value, are left out.
    """

    rows: Any
    conditions: Mapping[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Returns everything in plain types, fit for JSON."""
        return {"conditions": dict(self.conditions), "rows": [vars(row) for row in self.rows]}

    def _repr_html_(self) -> str:
        rows = [vars(row) for row in self.rows]
        columns = {name: [row[name] for row in rows] for name in (rows[0] if rows else {})}
        shown = {
            name: values
            for name, values in columns.items()
            if all(isinstance(value, _PLAIN) for value in values) and any(v is not None for v in values)
        }
        numbers = [not any(isinstance(value, str) for value in values) for values in shown.values()]
        if "fingerprint" in shown:  # its beginning is enough to compare two
            shown["fingerprint"] = [value and value[:16] for value in shown["fingerprint"]]
        texts = zip(*map(cells, shown.values()), strict=True)
        table = grid(type(self).__name__, [name.replace("_", " ") for name in shown], list(texts), numbers)
        return "\n".join([table, paragraph(f"Measured with {_listed(self.conditions)}.")])


class PhasesMeasured(Measured):
    """The same of several phases on one scene; each row has a phase and the fingerprint of its contacts."""

    @property
    def identical(self) -> bool:
        """Whether all phases that ran gave the same contacts."""
        return len({row.fingerprint for row in self.rows if row.fingerprint is not None}) <= 1

    def as_dict(self) -> dict[str, Any]:
        """Returns everything in plain types, fit for JSON."""
        found = super().as_dict()
        return {"conditions": found["conditions"], "identical": self.identical, "rows": found["rows"]}


def _listed(conditions: Mapping[str, Any]) -> str:
    words = []
    for name, value in conditions.items():
        if isinstance(value, Mapping):
            words.append(_listed(value))
        elif value is not None:
            words.append(f"{name} {value}")
    return ", ".join(words)
