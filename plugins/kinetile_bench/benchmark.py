"""Basis of all benchmarks: phases with their options, and results with their conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Choice = str | tuple[str, Mapping[str, Any]]
"""A broad phase by name, or its name and its options."""


def phases_with_options(choices: Sequence[Choice]) -> list[tuple[str, dict[str, Any]]]:
    """Returns (name, options) for each choice of a broad phase."""
    return [(each, {}) if isinstance(each, str) else (each[0], dict(each[1])) for each in choices]


class Measured:
    """Rows of one dataclass, and the conditions under which they were measured."""

    rows: Any
    conditions: Mapping[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Returns everything in plain types, fit for JSON."""
        return {"conditions": dict(self.conditions), "rows": [vars(row) for row in self.rows]}


class PhasesMeasured(Measured):
    """The same of several phases on one scene; each row has a phase and the fingerprint of its contacts."""

    @property
    def identical(self) -> bool:
        """Whether all phases that ran gave the same contacts."""
        return len({row.fingerprint for row in self.rows if row.fingerprint is not None}) <= 1

    def as_dict(self) -> dict[str, Any]:
        """Returns everything in plain types, fit for JSON."""
        return super().as_dict() | {"identical": self.identical}
