"""Rows of a study: one SQLite file, one transaction a row, so that a kill loses no row that is there.

The file is readable with any SQLite: its table ``rows`` has a row's key, its course, and its columns as JSON.
Beside that, whether rows agree: the same scene to the same end has one list of contacts, under any phase, so
a study is a test as well. Two rows with two fingerprints do not show which of them is wrong. So all rows of
such a course have the status "disagrees", and each names one of the others.

While a study runs it holds a lock, so that a second run does not do the same tasks. The lock is an open
transaction on an empty file beside the rows, which the system ends with the process, however that ends.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from kinetile.errors import RecordError
from kinetile_bench.study.task import DISAGREES, DONE, Row, StudyStopped

APPLICATION, FORMAT = int.from_bytes(b"kine", "big"), 1
"""The program that wrote the file and its format, in the header where SQLite has places for both."""

_PATIENCE = 60.0
"""Seconds to wait for another process that writes."""


class RowFile:
    """The rows of a study in a file, which is made when the first one is written.

    Every use raises RecordError where the file is no file of a study, which is never written to, or where
    the disk fails.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Within this context no other run of the study begins. Raises StudyStopped where one goes on."""
        path = self.path.with_name(f"{self.path.name}.running")
        with closing(sqlite3.connect(path, timeout=0.0, isolation_level=None)) as lock:
            try:
                lock.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                raise StudyStopped(
                    f"another process runs this study and writes its rows to {self.path}: wait for its end, "
                    "or name another file for the rows of this run (results)"
                ) from error
            try:
                yield
            finally:
                with suppress(OSError):  # where an open file cannot be removed, it stays, empty and free
                    path.unlink()

    def read(self) -> list[Row]:
        """Returns all rows, in the order in which they came."""
        if not self.path.exists() or (self.path.is_file() and self.path.stat().st_size == 0):
            return []
        with self._transaction("BEGIN") as file:
            return [json.loads(row) for (row,) in file.execute("SELECT content FROM rows ORDER BY rowid")]

    def put(self, row: Row) -> None:
        """Writes a row; one that is there already, from another process, stays."""
        values = row["key"], row["course"], json.dumps(_finite(row), allow_nan=False)
        with self._transaction() as file:
            file.execute("INSERT OR IGNORE INTO rows VALUES (?, ?, ?)", values)

    def forget(self, keys: Iterable[str]) -> None:
        """Removes rows."""
        with self._transaction() as file:
            file.executemany("DELETE FROM rows WHERE key = ?", [(key,) for key in keys])

    @contextmanager
    def _transaction(self, begin: str = "BEGIN IMMEDIATE") -> Iterator[sqlite3.Connection]:
        """Yields the file within a transaction; an empty one becomes a file of a study."""
        address = f"{self.path.absolute().as_uri()}?mode=rwc"
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with closing(sqlite3.connect(address, uri=True, timeout=_PATIENCE, isolation_level=None)) as file:
                file.execute(begin)
                heads = ("PRAGMA application_id", "PRAGMA user_version", "SELECT count(*) FROM sqlite_schema")
                application, version, tables = (file.execute(each).fetchone()[0] for each in heads)
                if (application, version, tables) == (0, 0, 0):
                    file.execute(f"PRAGMA application_id = {APPLICATION}")
                    file.execute(f"PRAGMA user_version = {FORMAT}")
                    file.execute("CREATE TABLE rows (key TEXT PRIMARY KEY, course TEXT, content TEXT)")
                elif application != APPLICATION:
                    raise RecordError(f"{self.path} is the SQLite file of another program: {_EXPECTED}")
                elif version != FORMAT:
                    raise RecordError(
                        f"{self.path} has rows in format {version}, and this version of kinetile reads and "
                        f"writes format {FORMAT}: {_EXPECTED}"
                    )
                yield file
                file.execute("COMMIT")
        except RecordError:
            raise
        except (sqlite3.Error, OSError, ValueError) as error:  # ValueError: a row is no JSON
            raise RecordError(f"{self.path} cannot be used: {error}; {_EXPECTED}") from error


_EXPECTED = "expected a file with rows of a study, or a name for a new one in a folder that can be written"


def _finite(value: Any) -> Any:
    """Returns a value with None for numbers that JSON does not have, and without types of NumPy."""
    if isinstance(value, Mapping):
        return {str(key): _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


class Agreement:
    """Compares the fingerprints of rows that are done, course by course, as they arrive.

    ``disagreements`` has a sentence for each row that has other contacts than the first one of its course.
    """

    def __init__(self, rows: Iterable[Row] = ()) -> None:
        self.disagreements: list[str] = []
        self._courses: dict[str, dict[str, Row]] = {}
        for row in rows:
            self.add(row)

    def add(self, row: Row) -> str | None:
        """Adds a row; returns the sentence of the disagreement that it makes."""
        if row["status"] != DONE:
            return None
        course = self._courses.setdefault(row["course"], {})
        first = next(iter(course.values()), row)
        course.setdefault(row["fingerprint"], row)
        if first["fingerprint"] == row["fingerprint"]:
            return None
        scene = " ".join([row["recipe"], *(f"{key}={value}" for key, value in row["parameters"].items())])
        self.disagreements.append(
            f"{scene}: {first['phase']} and {row['phase']} have different contacts "
            f"(fingerprints {first['fingerprint'][:16]} and {row['fingerprint'][:16]})"
        )
        return self.disagreements[-1]

    def judged(self, row: Row) -> Row:
        """Returns a row; if it disagrees with others, it has that status, and names one of them."""
        others = self._courses.get(row["course"], {}) if row["status"] == DONE else {}
        for fingerprint, other in others.items():
            if fingerprint != row["fingerprint"]:
                error = f"other contacts than {other['phase']} has (row {other['key']})"
                return row | {"status": DISAGREES, "error": error}
        return row
