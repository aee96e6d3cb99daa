"""What a row has: the scene's parameters, the phase, how the run ended, readings, measures, surroundings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from kinetile.errors import printable
from kinetile.run.readings import Readings
from kinetile_accuracy.parts import needed
from kinetile_bench.study.file.tasks import Task

__all__ = ["FIXED", "TIMINGS", "arrow", "parameter_column", "row_of", "table_of"]

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
_SURROUNDINGS = {
    "versions": "string",
    "kinetile": "string",
    "python": "string",
    "numpy": "string",
    "numba": "string",
    "compiled": "bool_",
    "processor": "string",
}

FIXED = _TASK | _READINGS | _MEASURED | _TIMES | _SURROUNDINGS
"""The columns that every row has, with their Arrow types; beside them stand the scene's parameters."""

TIMINGS = (
    "cpu_seconds",
    "compile_seconds",
    "events_per_cpu_second",
    "contacts_per_cpu_second",
    *_TIMES,
    *("python", "numpy", "numba", "processor"),
)
"""The columns that differ from run to run and from machine to machine; all others are the same wherever a
task is done."""


def arrow() -> Any:
    """Return pyarrow; MissingExtra without it."""
    return needed("A study", "pyarrow", "records")


def parameter_column(name: str) -> str:
    """Return the column of a scene's parameter: its name, or that with ``scene_`` where a column has it."""
    return f"scene_{name}" if name in FIXED else name


def row_of(task: Task, found: Mapping[str, Any], beside: int) -> dict[str, Any]:
    """Return the row of a task, of what came of it and of how many tasks ran beside it."""
    row = {
        "key": task.key,
        "course": task.course,
        "recipe": task.recipe,
        "parameters": json.dumps(task.parameters, sort_keys=True),
        "scene_sha256": task.scene_sha256,
        "phase": task.phase,
        "broad_phase": task.broad_phase,
        "options": json.dumps(task.options, sort_keys=True),
        "until": task.until,
        "contacts_asked": task.contacts,
        "repeat": task.repeat,
        "versions": json.dumps(task.versions, sort_keys=True),
        "beside": beside,
    }
    row |= {name: value for name, value in found.items() if name in FIXED}
    if row.get("error"):  # which may be a plugin's: a terminal would do what its control characters say
        row["error"] = printable(str(row["error"]))
    if "contacts_disc" in found:
        row["contacts"] = found["contacts_disc"] + found["contacts_wall"]
    if found.get("time"):
        row.setdefault("cpu_seconds_per_time", found["cpu_seconds"] / found["time"])
    return row | {parameter_column(name): value for name, value in task.parameters.items()}


def table_of(rows: list[dict[str, Any]]) -> Any:
    """Return rows as an Arrow table: the parameters first, then the fixed columns."""
    pa = arrow()
    names = dict.fromkeys(name for row in rows for name in row if name not in FIXED)
    columns = {name: pa.array([row.get(name) for row in rows]) for name in names}
    for name, kind in FIXED.items():
        columns[name] = pa.array([row.get(name) for row in rows], getattr(pa, kind)())
    return pa.table(columns)
