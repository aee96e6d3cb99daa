"""The rows of a study, in the order of its tasks, each with its status among the others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinetile_bench.study.file import Task
from kinetile_bench.study.store.agreement import DISAGREES, Agreement
from kinetile_bench.study.store.columns import FIXED, TIMINGS, arrow, table_of
from kinetile_bench.study.store.rows import Store

__all__ = ["rows_of"]


def rows_of(store: Store, tasks: Mapping[str, Task], *, timings: bool = True) -> Any:
    """Return the rows of tasks as an Arrow table: parameters by name, then the other columns."""
    pa = arrow()
    table = store.read()
    nothing = table_of([])  # with all columns, which rows of an earlier version may not have
    table = nothing if table is None else pa.concat_tables([nothing, table], promote_options="permissive")
    place = {key: at for at, key in enumerate(tasks)}
    keys = table["key"].to_pylist()
    order = sorted((place[key], at) for at, key in enumerate(keys) if key in place)
    table = table.take(pa.array([at for _, at in order], pa.int64()))
    fixed = [name for name in FIXED if timings or name not in TIMINGS]
    table = table.select([*sorted(set(table.column_names) - set(FIXED)), *fixed])
    return _judged(table)


def _judged(table: Any) -> Any:
    """Return a table in which rows that disagree with others say so."""
    rows = table.select(list(Agreement.columns)).to_pylist()
    agreement = Agreement()
    for row in rows:
        agreement.see(row)
    said = agreement.verdicts(rows)
    if not said:
        return table
    pa = arrow()
    for name, values in (
        ("status", [DISAGREES if row["key"] in said else row["status"] for row in rows]),
        (
            "error",
            [said.get(row["key"], old) for row, old in zip(rows, table["error"].to_pylist(), strict=True)],
        ),
    ):
        table = table.set_column(table.schema.get_field_index(name), name, pa.array(values, pa.string()))
    return table
