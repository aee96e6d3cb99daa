"""Rows on disk: each is a file of its own when it comes, and hundreds are gathered into a part.

In the folder of the results are ``rows/new`` (a Parquet file a row, named by its key), ``rows/parts`` (files
of many rows) and ``claims``. Everything is written under another name and then renamed, so whoever reads sees
a whole file or none. A part is there before the files that it was gathered from go; a process that is killed
between the two leaves rows twice, which a reader, going by keys, sees once.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from kinetile.bench.study.store.claims import Claims, locked
from kinetile.bench.study.store.columns import arrow, table_of
from kinetile.errors import RecordError
from kinetile.scene.targets import replacing

__all__ = ["Store"]

GATHER = 500
"""So many files of one row are gathered into a part."""

LARGE = 20_000
"""A part of so many rows is not gathered again."""

_FEW = 16
"""So many smaller parts may be there before they are gathered."""


class Store:
    """The rows in a folder.

    Args:
        folder: where they are; made by ``open``.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._new = folder / "rows" / "new"
        self._parts = folder / "rows" / "parts"
        self.claims = Claims(folder / "claims")
        self._known: set[str] = set()
        self._read: set[Path] = set()
        self._fresh = 0

    def open(self) -> None:
        """Make the folders. Raises RecordError where that cannot be done."""
        arrow()
        try:
            for each in (self._new, self._parts, self.folder / "claims"):
                each.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise self._unwritable(error) from error

    def has(self, key: str) -> bool:
        """Whether there is a row of this key, whoever wrote it."""
        if key in self._known or (self._new / f"{key}.parquet").exists():
            return True
        self.look()
        return key in self._known

    def look(self) -> None:
        """Learn which rows have been gathered since the last look."""
        for path in _files(self._parts):
            if path not in self._read:
                with suppress(FileNotFoundError):  # gathered into another part meanwhile, which comes next
                    self._known |= set(_read(path, ["key"])["key"].to_pylist())
                self._read.add(path)

    def put(self, row: dict[str, Any]) -> None:
        """Write a row. Raises RecordError where it cannot be written."""
        try:
            self._write(table_of([row]), self._new / f"{row['key']}.parquet", sync=False)
        except OSError as error:
            raise self._unwritable(error) from error
        self._known.add(row["key"])
        self._fresh += 1
        if self._fresh >= GATHER:
            self.gather()

    def gather(self) -> None:
        """Gather single rows into a part, and small parts into a larger one, unless somebody else is at it.

        Raises RecordError where that cannot be written; all rows are there as before then.
        """
        self._fresh = 0
        try:
            lock = locked(self.folder / "gathering")
            if lock is None:
                return
            try:
                files = _files(self._new)
                small = [path for path in _files(self._parts) if _rows(path) < LARGE]
                self._replace([*files, *(small if len(small) >= _FEW else ())])
            finally:
                os.close(lock)
        except OSError as error:
            raise self._unwritable(error) from error

    def close(self) -> None:
        """Gather what is there, and give up all claims; nothing where the folder could not be made."""
        if self._new.is_dir():
            self.gather()
            self.claims.close()

    def forget(self, keys: Iterable[str]) -> None:
        """Take rows away, so that their tasks are done again. Raises RecordError."""
        gone = set(keys)
        try:
            lock = locked(self.folder / "gathering")
            if lock is None:
                raise RecordError(f"{self.folder}: another process is gathering rows; try again")
            try:
                self._replace([*_files(self._new), *_files(self._parts)], without=gone)
            finally:
                os.close(lock)
        except RecordError:
            raise
        except OSError as error:
            raise self._unwritable(error) from error
        self._known -= gone

    def read(self, columns: Sequence[str] | None = None) -> Any:
        """Return all rows as an Arrow table, each once; None where there are none.

        Of ``columns`` those that are there. Raises RecordError where they cannot be read.
        """
        for _ in range(20):
            try:
                return _once(_joined(self._all(columns)))
            except FileNotFoundError:  # gathered while it was to be read
                continue
            except OSError as error:
                raise RecordError(f"{self.folder} cannot be read: {error.strerror or error}") from error
        raise RecordError(f"{self.folder} cannot be read: its files change all the time")

    def _all(self, columns: Sequence[str] | None) -> list[Any]:
        wanted = None if columns is None else list(dict.fromkeys(["key", *columns]))
        new = _files(self._new)  # first, so that what is gathered meanwhile is read in a part
        found = [each for path in new if (each := _read_single(path, wanted)) is not None]
        return found + [_read(path, wanted) for path in _files(self._parts)]

    def _replace(self, files: Sequence[Path], without: Iterable[str] = ()) -> None:
        """Put the rows of files into one new part, but for some, and take the files away."""
        tables, taken = [], []
        for path in files:
            table = _read_single(path, None) if path.parent == self._new else _read(path, None)
            if table is not None:
                tables.append(table)
            taken.append(path)
        whole = _once(_joined(tables))
        gone = list(without)
        if whole is not None and gone:
            pa = arrow()
            from pyarrow import compute

            whole = whole.filter(compute.invert(compute.is_in(whole["key"], pa.array(gone, pa.string()))))
        if whole is not None and whole.num_rows:
            self._write(whole, self._parts / f"{secrets.token_hex(8)}.parquet", sync=True)
            self._known |= set(whole["key"].to_pylist())
        for path in taken:
            path.unlink(missing_ok=True)

    def _write(self, table: Any, path: Path, *, sync: bool) -> None:
        from pyarrow import parquet

        with replacing(path, sync=sync) as file:
            parquet.write_table(table, file, compression="zstd" if sync else "none")

    def _unwritable(self, error: OSError) -> RecordError:
        return RecordError(
            f"{self.folder} cannot be written: {error.strerror or error}; the rows that were there are there"
        )


def _files(folder: Path) -> list[Path]:
    """Return the Parquet files of a folder; what is being written has another name."""
    if not folder.is_dir():
        return []
    names = (each.name for each in os.scandir(folder))
    return [folder / name for name in sorted(names) if name.endswith(".parquet") and name[0] != "."]


def _rows(path: Path) -> int:
    from pyarrow import parquet

    try:
        return int(parquet.read_metadata(path).num_rows)
    except FileNotFoundError:
        return LARGE


def _read(path: Path, columns: Sequence[str] | None) -> Any:
    """Return the rows of a file: all columns, or those of some that it has. Raises OSError."""
    from pyarrow import ArrowException, parquet

    try:
        with parquet.ParquetFile(path) as file:
            names = None if columns is None else [n for n in columns if n in file.schema_arrow.names]
            return file.read(names)
    except ArrowException as error:
        raise OSError(f"{path} is damaged: {error}") from error


def _read_single(path: Path, columns: Sequence[str] | None) -> Any:
    """Return the row of a file, or None where the machine stopped before it was on the disk."""
    try:
        return _read(path, columns)
    except FileNotFoundError:
        raise
    except OSError:
        with suppress(OSError):
            path.unlink()
        return None


def _joined(tables: list[Any]) -> Any:
    """Return tables as one; a column that is text in one of them is text in all."""
    if not tables:
        return None
    pa = arrow()
    kinds: dict[str, set[str]] = {}
    for table in tables:
        for field in table.schema:
            kinds.setdefault(field.name, set()).add(str(field.type))
    mixed = {
        name
        for name, found in kinds.items()
        if len(found - {"null"}) > 1 and found - {"null", "int64", "double"}
    }
    for name in mixed:
        tables = [_as_text(table, name) for table in tables]
    return pa.concat_tables(tables, promote_options="permissive")


def _as_text(table: Any, name: str) -> Any:
    if name not in table.schema.names:
        return table
    pa = arrow()
    at = table.schema.get_field_index(name)
    text = pa.array([None if each is None else str(each) for each in table[name].to_pylist()], pa.string())
    return table.set_column(at, name, text)


def _once(table: Any) -> Any:
    """Return a table with each key once."""
    if table is None:
        return None
    keys = table["key"].to_pylist()
    if len(set(keys)) == len(keys):
        return table
    first = {key: at for at, key in reversed(list(enumerate(keys)))}
    return table.take(sorted(first.values()))
