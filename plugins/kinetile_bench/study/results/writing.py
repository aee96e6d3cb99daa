"""Rows as a file of their own, for other programs: CSV or Parquet, whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kinetile.errors import BadOption
from kinetile.scene.targets import replacing, writable_target

__all__ = ["write_rows"]


def write_rows(table: Any, path: Path) -> int:
    """Write an Arrow table to a .csv or .parquet file; return how many rows it has.

    Raises BadOption for another ending, and OSError where it cannot be written.
    """
    from pyarrow import csv, parquet

    writers = {".csv": csv.write_csv, ".parquet": parquet.write_table}
    if path.suffix not in writers:
        raise BadOption(f"{path} is neither .csv nor .parquet: expected the name of one or the other")
    target = writable_target(path)
    with replacing(target) as file:
        writers[path.suffix](table, file)
    return int(table.num_rows)
