"""Rows of a study: one SQLite file, one transaction a row, so a kill loses no written row.

Its table ``rows`` has a row's key, its course, its columns as JSON, and a digest of these three: SQLite finds
damage to its tree of pages, but not to a value. A course has one list of contacts under any phase. If it has
two fingerprints, all its rows have the status "disagrees", and each names one of the others. A running study
holds a lock, an open transaction on an empty file, which ends with the process.
"""

import json
import os
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from kinetile.cli.output import as_json
from kinetile.errors import RecordError, printable
from kinetile.instruments import check_regular, shown
from kinetile_bench.study.task import DISAGREES, DONE, STATUSES, Row, StudyStopped, digest

APPLICATION, FORMAT = int.from_bytes(b"kine", "big"), 2
"""The program that wrote the file and its format, in the fields of SQLite's header for both."""

_TABLE = "CREATE TABLE rows (key TEXT PRIMARY KEY, course TEXT, content TEXT, digest TEXT)"
_SCHEMA = [("table", "rows", _TABLE), ("index", "sqlite_autoindex_rows_1", None)]

_LONGEST = 1 << 24
"""The most bytes of a row: a row of a damaged or foreign file could have a gigabyte."""

_DEEPEST = 8
"""Lists and tables within each other in a row: deeper ones would exhaust the stack of a printer."""

_PATIENCE = 60.0
"""Seconds to wait for another process that writes."""


class RowFile:
    """The rows of a study in a file, which is made with the first row. Every use raises RecordError if the
    file is not a file of a study, which is never written to, or if the disk fails."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Within this context no other run of the study begins. Raises StudyStopped if one is in progress."""
        path, process = self.path.with_name(f"{self.path.name}.running"), os.getpid()
        with closing(_opened(path, 0.0)) as lock:
            try:
                if path.stat().st_size:
                    raise RecordError(f"{path} is there and is no lock of a study: move it away")
                lock.execute("BEGIN EXCLUSIVE")
            except (sqlite3.Error, OSError) as error:
                if getattr(error, "sqlite_errorcode", None) != sqlite3.SQLITE_BUSY:
                    raise _unusable(path, error) from error
                raise StudyStopped(
                    f"another process runs this study and writes its rows to {self.path}: wait for its end, "
                    "or name another file for the rows of this run (results)"
                ) from error
            try:
                yield
            finally:
                if process == os.getpid():  # a forked child leaves it to its parent
                    with suppress(OSError):  # an open file that cannot be removed stays, empty and free
                        path.unlink()

    def read(self) -> list[Row]:
        """Returns all rows, in the order of their arrival, exactly as they were written."""
        if not os.path.exists(self.path) or (self.path.is_file() and self.path.stat().st_size == 0):
            return []
        with self._transaction("BEGIN") as file:
            (state,) = file.execute("PRAGMA integrity_check(1)").fetchone()
            if state != "ok":
                raise ValueError(state)
            return [_checked(*each) for each in file.execute("SELECT * FROM rows ORDER BY rowid")]

    def put(self, row: Row) -> None:
        """Writes a row; an existing one, from another process, stays."""
        values = row["key"], row["course"], as_json(row)
        with self._transaction() as file:
            file.execute("INSERT OR IGNORE INTO rows VALUES (?, ?, ?, ?)", (*values, digest(values)))

    def forget(self, keys: Iterable[str]) -> None:
        """Removes rows."""
        with self._transaction() as file:
            file.executemany("DELETE FROM rows WHERE key = ?", [(key,) for key in keys])

    @contextmanager
    def _transaction(self, begin: str = "BEGIN IMMEDIATE") -> Iterator[sqlite3.Connection]:
        """Yields the file within a transaction; an empty one becomes a file of a study."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self.path.is_file() and self.path.stat().st_size == 1:  # SQLite takes it for an empty file
                raise ValueError("file is not a database")
            with closing(_opened(self.path, _PATIENCE)) as file:
                file.execute(begin)
                ((application,),) = file.execute("PRAGMA application_id")
                ((version,),) = file.execute("PRAGMA user_version")
                schema = file.execute("SELECT type, name, sql FROM sqlite_schema").fetchmany(3)
                if (application, version, schema) == (0, 0, []):
                    file.execute(f"PRAGMA application_id = {APPLICATION}")
                    file.execute(f"PRAGMA user_version = {FORMAT}")
                    file.execute(_TABLE)
                elif application != APPLICATION:
                    raise RecordError(f"{self.path} is the SQLite file of another program: {_EXPECTED}")
                elif version != FORMAT:
                    raise RecordError(
                        f"{self.path} has rows in format {version}, and this version of kinetile reads and "
                        f"writes format {FORMAT}: run the study again, with a new file for its rows (results)"
                    )
                elif schema != _SCHEMA:
                    raise ValueError("it has other tables, views or indices than a study makes")
                yield file
                file.execute("COMMIT")
        except (sqlite3.Error, OSError, ValueError) as error:
            raise _unusable(self.path, error) from error


_EXPECTED = "expected a file with rows of a study, or a name for a new one in a folder that can be written"


def _opened(path: Path, patience: float) -> sqlite3.Connection:
    """Opens a file of SQLite, or makes it; ``patience``: the seconds to wait for another process. Raises
    RecordError if it, or a file that SQLite opens beside it, is not a regular file: a pipe never ends."""
    try:
        for end in ("", "-journal", "-wal", "-shm"):
            with suppress(FileNotFoundError):
                check_regular(f"{path}{end}")
        address = f"{path.absolute().as_uri()}?mode=rwc"
        file = sqlite3.connect(address, uri=True, timeout=patience, isolation_level=None)
    except (sqlite3.Error, OSError) as error:
        raise _unusable(path, error) from error
    file.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST)
    return file


def _unusable(path: Path, error: Exception) -> RecordError:
    """Returns the error of an unusable file: SQLite's error contains lines and texts of the file."""
    if isinstance(error, RecordError):
        return error
    reason = " ".join(str(error).split())
    if isinstance(error, OSError) and error.strerror:
        reason = f"{error.filename}: {error.strerror}"
    return RecordError(f"{path} cannot be used: {printable(reason, 200)}; {_EXPECTED}")


def _checked(key: Any, course: Any, content: Any, digested: Any) -> Row:
    """Returns the row of a line of the table. Raises ValueError for a changed one."""
    if digested != digest((key, course, content)):
        raise ValueError(f"row {shown(key)} is not what was written: it has another digest")
    row = None
    with suppress(TypeError, ValueError, RecursionError):
        row = json.loads(content)
    if not (
        isinstance(row, dict)
        and isinstance(key, str)
        and [row.get("key"), row.get("course")] == [key, course]
        and row.get("status") in STATUSES
        and (row["status"] != DONE or isinstance(row.get("fingerprint"), str))
        and _is_shallow(row)
    ):
        raise ValueError(f"row {shown(key)} is not a row of a task")
    return row


def _is_shallow(value: Any, levels: int = _DEEPEST) -> bool:
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return levels > 0 and all(_is_shallow(each, levels - 1) for each in parts)


class Agreement:
    """Compares the fingerprints of finished rows, course by course, as they arrive; ``disagreements`` has a
    sentence for each row with other contacts than the first row of its course."""

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
        """Returns a row; if it disagrees with others, its status says so, and it names one of them."""
        others = self._courses.get(row["course"], {}) if row["status"] == DONE else {}
        for fingerprint, other in others.items():
            if fingerprint != row["fingerprint"]:
                error = f"other contacts than {other['phase']} has (row {other['key']})"
                return row | {"status": DISAGREES, "error": error}
        return row
