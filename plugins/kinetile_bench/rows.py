"""Rows of a study: their columns, making a row from a task's result, and whether rows agree.

The same scene to the same end has one list of contacts, under any phase: so a study is a test as well.
Two rows with two fingerprints do not show which of them is wrong. So all rows of a course on which there are
two fingerprints have the status "disagrees", and each names one of the others.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any, NamedTuple

from kinetile.errors import printable
from kinetile.run.observing import Observed
from kinetile.run.readings import Readings
from kinetile_accuracy.sections import needed
from kinetile_bench.task import DISAGREES, DONE, Task

_TYPES = {"int": "int64", "float": "float64", "str": "string", "bool": "bool_"}

_TASK = {
    "key": "string",
    "course": "string",
    "recipe": "string",
    "parameters": "string",
    "scene_sha256": "string",
    "phase": "string",
    "broad_phase": "string",
    "options": "string",
    "until": "float64",
    "contacts_asked": "int64",
    "repeat": "int64",
    "status": "string",
    "error": "string",
    "time": "float64",
}
_READINGS = {field.name: _TYPES[str(field.type)] for field in fields(Readings)}
_MEASURED = {
    "contacts": "int64",
    "pairs_mean": "float64",
    "pairs_most": "int64",
    "pairs_of_one_body": "int64",
    "pair_changes": "int64",
    "construction_updated": "int64",
    "construction_asked": "int64",
    "construction_computed": "int64",
    "certified": "bool_",
    "certified_contacts": "int64",
    "certified_said": "string",
}
_TIMES = {
    "runs": "int64",
    "cpu_seconds_min": "float64",
    "cpu_seconds_max": "float64",
    "cpu_seconds_per_time": "float64",
    "setup_seconds": "float64",
    "peak_bytes": "int64",
    "table_bytes": "int64",
    "stages": "string",
    "rate_cpu_seconds": "float64",
    "rate_events": "int64",
    "rate_contacts": "int64",
    "task_cpu_seconds": "float64",
    "wall_seconds": "float64",
    "beside": "int64",
    "load": "float64",
    "host": "string",
}
_ENVIRONMENT = {
    "versions": "string",
    "kinetile": "string",
    "python": "string",
    "numpy": "string",
    "numba": "string",
    "compiled": "bool_",
    "processor": "string",
}

FIXED = _TASK | _READINGS | _MEASURED | _TIMES | _ENVIRONMENT
"""The columns that every row has, with their Arrow types; beside them stand the scene's parameters."""

TIMINGS = (
    "cpu_seconds",
    "compile_seconds",
    "events_per_cpu_second",
    "contacts_per_cpu_second",
    *_TIMES,
    *("python", "numpy", "numba", "processor"),
)
"""The columns that differ from run to run and from machine to machine; all others are the same on every
machine."""


OBSERVED = "observed."
"""Columns of observables begin so: sums in rounded arithmetic, whose last digits differ from run to run."""


def observed_columns(observed: Observed) -> dict[str, Any]:
    """Returns the columns of estimates: numbers with their errors, and a curve as JSON."""
    row: dict[str, Any] = {}
    for name, quantities in observed.items():
        for quantity, (mean, error, blocks, axis, at) in quantities.items():
            column = f"{OBSERVED}{name}.{quantity}"
            if at is None:
                row |= {column: mean, f"{column}.error": error, f"{column}.blocks": blocks}
            else:
                found = {axis: at, "mean": mean, "error": error}
                lists = {key: [None if x != x else x for x in each.tolist()] for key, each in found.items()}
                row[column] = json.dumps(lists)
    return row


def arrow() -> Any:
    """Returns pyarrow. Raises MissingExtra without it."""
    return needed("A study", "pyarrow", "records")


def parameter_column(name: str) -> str:
    """Returns the column of a scene's parameter: its name, or that with ``scene_`` where a column has it."""
    return f"scene_{name}" if name in FIXED else name


def row_of(task: Task, result: Mapping[str, Any], beside: int) -> dict[str, Any]:
    """Returns the row of a task, of its result and of how many tasks ran beside it."""
    same = ("key", "course", "recipe", "scene_sha256", "phase", "broad_phase", "until", "repeat")
    row = {name: getattr(task, name) for name in same}
    for name in ("parameters", "options", "versions"):
        row[name] = json.dumps(getattr(task, name), sort_keys=True)
    row |= {"contacts_asked": task.contacts, "beside": beside}
    row |= {name: value for name, value in result.items() if name in FIXED or name.startswith(OBSERVED)}
    if row.get("error"):  # which may be a plugin's: a terminal would obey its control characters
        row["error"] = printable(str(row["error"]))
    if "contacts_disc" in result:
        row["contacts"] = result["contacts_disc"] + result["contacts_wall"]
    if result.get("time"):
        row.setdefault("cpu_seconds_per_time", result["cpu_seconds"] / result["time"])
    return row | {parameter_column(name): value for name, value in task.parameters.items()}


def table_of(rows: list[dict[str, Any]]) -> Any:
    """Returns rows as an Arrow table: the parameters first, then the fixed columns."""
    pa = arrow()
    names = dict.fromkeys(name for row in rows for name in row if name not in FIXED)
    columns = {name: pa.array([row.get(name) for row in rows]) for name in names}
    for name, kind in FIXED.items():
        columns[name] = pa.array([row.get(name) for row in rows], getattr(pa, kind)())
    return pa.table(columns)


def in_order(table: Any, tasks: Mapping[str, Task], *, timings: bool = True) -> Any:
    """Returns the rows of tasks, in the tasks' order, as an Arrow table: parameters by name, then the other
    columns. Rows that disagree with others have that status.

    ``table`` is all rows, or None.
    """
    pa = arrow()
    nothing = table_of([])  # with all columns, which rows of an earlier version may not have
    table = nothing if table is None else pa.concat_tables([nothing, table], promote_options="permissive")
    place = {key: at for at, key in enumerate(tasks)}
    keys = table["key"].to_pylist()
    order = sorted((place[key], at) for at, key in enumerate(keys) if key in place)
    table = table.take(pa.array([at for _, at in order], pa.int64()))
    fixed = [name for name in FIXED if timings or name not in TIMINGS]
    others = sorted(set(table.column_names) - set(FIXED))
    table = table.select([*(name for name in others if timings or not name.startswith(OBSERVED)), *fixed])
    rows = table.select([*Fingerprints.columns, "error"]).to_pylist()
    reasons = Fingerprints(rows).disagreeing(rows)
    if reasons:
        statuses = [DISAGREES if row["key"] in reasons else row["status"] for row in rows]
        errors = [reasons.get(row["key"], row["error"]) for row in rows]
        for name, values in (("status", statuses), ("error", errors)):
            at = table.schema.get_field_index(name)
            table = table.set_column(at, name, pa.array(values, pa.string()))
    return table


class RowDisagreement(NamedTuple):
    """Two rows that should have one list of contacts, and have two."""

    one: Mapping[str, Any]
    other: Mapping[str, Any]

    def __str__(self) -> str:
        return (
            f"{self.one['recipe']} {self.one['parameters']}: {self.one['phase']} and {self.other['phase']} "
            f"have different contacts (fingerprints {self.one['fingerprint'][:16]} and "
            f"{self.other['fingerprint'][:16]}; rows {self.one['key']} and {self.other['key']})"
        )


class Fingerprints:
    """The fingerprints of rows, course by course; ``columns`` are those that are read of a row."""

    columns = ("key", "course", "recipe", "parameters", "scene_sha256", "phase", "status", "fingerprint")

    def __init__(self, rows: Iterable[Mapping[str, Any]] = ()) -> None:
        self._first: dict[str, Mapping[str, Any]] = {}
        self._split: dict[str, dict[str, Mapping[str, Any]]] = {}
        self._added: set[str] = set()
        for row in rows:
            self.add(row)

    def add(self, row: Mapping[str, Any]) -> RowDisagreement | None:
        """Adds a row; returns the disagreement that it makes."""
        if row["status"] != DONE or row["key"] in self._added:
            return None
        self._added.add(row["key"])
        first = self._first.setdefault(row["course"], row)
        if first["fingerprint"] == row["fingerprint"]:
            return None
        split = self._split.setdefault(row["course"], {first["fingerprint"]: first})
        split.setdefault(row["fingerprint"], row)
        return RowDisagreement(first, row)

    def disagreeing(self, rows: Iterable[Mapping[str, Any]]) -> dict[str, str]:
        """Returns those of the rows that disagree with others: a sentence for each, by their keys."""
        found = {}
        for row in rows:
            split = self._split.get(row["course"])
            if split and row["status"] == DONE:
                others = (each for fingerprint, each in split.items() if fingerprint != row["fingerprint"])
                other = min(others, key=lambda each: str(each["key"]))
                found[str(row["key"])] = f"other contacts than {other['phase']} has (row {other['key']})"
        return found
