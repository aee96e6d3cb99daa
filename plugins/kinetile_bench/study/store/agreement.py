"""The same scene to the same end has one list of contacts, whatever the phase: so a study is a test as well.

Which of two rows is wrong, two rows cannot say. So all rows of a course on which there are two fingerprints
have the status "disagrees", and each names one of the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from kinetile_bench.study.work.doing import DONE

__all__ = ["DISAGREES", "Agreement", "Disagreement"]

DISAGREES = "disagrees"


class Disagreement(NamedTuple):
    """Two rows that should have one list of contacts, and have two."""

    one: Mapping[str, Any]
    other: Mapping[str, Any]

    def __str__(self) -> str:
        return (
            f"{_scene(self.one)}: {self.one['phase']} and {self.other['phase']} have different contacts "
            f"(fingerprints {self.one['fingerprint'][:16]} and {self.other['fingerprint'][:16]}; "
            f"rows {self.one['key']} and {self.other['key']})"
        )


class Agreement:
    """The fingerprints of all rows that have been seen, course by course.

    ``columns`` are those that it needs.
    """

    columns = ("key", "course", "recipe", "parameters", "scene_sha256", "phase", "status", "fingerprint")

    def __init__(self) -> None:
        self._first: dict[str, Mapping[str, Any]] = {}
        self._split: dict[str, dict[str, Mapping[str, Any]]] = {}
        self._seen: set[str] = set()

    def see(self, row: Mapping[str, Any]) -> Disagreement | None:
        """Take a row in; return the disagreement that it makes."""
        if row["status"] != DONE or row["key"] in self._seen:
            return None
        self._seen.add(row["key"])
        first = self._first.setdefault(row["course"], row)
        if first["fingerprint"] == row["fingerprint"]:
            return None
        split = self._split.setdefault(row["course"], {first["fingerprint"]: first})
        split.setdefault(row["fingerprint"], row)
        return Disagreement(first, row)

    def verdicts(self, rows: Iterable[Mapping[str, Any]]) -> dict[str, str]:
        """Return, by their keys, what is to be said of those rows that disagree with others."""
        said = {}
        for row in rows:
            found = self._split.get(row["course"])
            if found and row["status"] == DONE:
                other = min(
                    (each for fingerprint, each in found.items() if fingerprint != row["fingerprint"]),
                    key=lambda each: str(each["key"]),
                )
                said[str(row["key"])] = f"other contacts than {other['phase']} has (row {other['key']})"
        return said


def _scene(row: Mapping[str, Any]) -> str:
    return f"{row['recipe']} {row['parameters']}"
