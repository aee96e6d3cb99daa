"""Store of a study's rows: a folder that survives kills of its processes, and that several may share.

A new row is a file of its own in ``rows/new``, named by its key; hundreds are gathered into a part in
``rows/parts``. Everything is written under another name and then renamed, so a reader sees a whole file or
none. A part is there before the files that it was gathered from go; a process that is killed between the two
leaves rows twice, which a reader, going by keys, sees once.

The name of a file ends in a checksum of its content (``KEY.SHA256.parquet``), because Parquet itself reads
most flipped bits as another table. A row whose content does not match its name, as after a power cut, is
moved to ``damaged`` and its task runs again; a part of that kind is an error. A read that fails removes
nothing. Files without a checksum come from earlier versions; they get one when they are gathered.

A task that is under way is claimed by a lock (``flock``), in ``claims``. The lock belongs to the open file
and not to the disk, so a process that is killed holds it no longer, and no claim is ever stale. Where there
are no such locks, every process gets every claim: two processes then run some tasks twice, and a row is
still one row, because it goes by its key.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import secrets
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from kinetile.errors import RecordError
from kinetile.scene.targets import replacing
from kinetile.sources import open_regular
from kinetile_bench.rows import arrow, table_of

try:
    from fcntl import LOCK_EX, LOCK_NB, flock
except ImportError:  # Windows
    flock = None  # type: ignore[assignment]


_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP}


GATHER = 500
"""Files of one row that are gathered into a part."""

LARGE = 20_000
"""Rows of a part that is not gathered again."""

_FEW = 16
"""Smaller parts that may be there before they are gathered."""

_CHECKSUM = re.compile(r"\.([0-9a-f]{32})\.parquet$")


class Store:
    """The rows in a folder.

    Args:
        folder: where they are; made by ``open``.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._new = folder / "rows" / "new"
        self._parts = folder / "rows" / "parts"
        self._damaged = folder / "damaged"
        self.claims = TaskClaims(folder / "claims")
        self._known: set[str] = set()
        self._read: set[Path] = set()
        self._fresh = 0

    def open(self) -> None:
        """Makes the folders. Raises RecordError where that cannot be done."""
        arrow()
        with self._typed("written"):
            for each in (self._new, self._parts, self.folder / "claims"):
                each.mkdir(parents=True, exist_ok=True)

    def has(self, key: str) -> bool:
        """Whether there is a row of this key, of this process or another. Raises RecordError."""
        with self._typed("read"):
            if key in self._known or any(path.name.startswith(f"{key}.") for path in _files(self._new)):
                return True
            for path in _files(self._parts):  # those that have come since the last look
                if path not in self._read:
                    with suppress(FileNotFoundError):  # gathered meanwhile into another part
                        self._known |= set(_read(path, ["key"])["key"].to_pylist())
                    self._read.add(path)
        return key in self._known

    def damaged(self) -> int:
        """Returns how many files have been moved away because they were damaged. Raises RecordError."""
        with self._typed("read"):
            return len(_files(self._damaged))

    def put(self, row: dict[str, Any]) -> None:
        """Writes a row. Raises RecordError where it cannot be written."""
        with self._typed("written"):
            self._write(table_of([row]), self._new, row["key"], sync=False)
        self._known.add(row["key"])
        self._fresh += 1
        if self._fresh >= GATHER:
            self.gather()

    def gather(self) -> None:
        """Gathers single rows into a part, and small parts into a larger one, unless another process does.

        Raises RecordError where that cannot be written; all rows are there as before then.
        """
        self._fresh = 0
        with self._typed("written"), self._alone() as alone:
            if alone:
                small = [path for path in _files(self._parts) if _rows(path) < LARGE]
                self._replace([*_files(self._new), *(small if len(small) >= _FEW else ())])

    def close(self) -> None:
        """Gathers single rows, and gives up all claims; does nothing where the folder could not be made.

        Raises RecordError.
        """
        if self._new.is_dir():
            self.gather()
            with self._typed("written"):
                self.claims.close()

    def forget(self, keys: Iterable[str]) -> None:
        """Removes rows, so that their tasks run again. Raises RecordError."""
        gone = set(keys)
        with self._typed("written"), self._alone() as alone:
            if not alone:
                raise RecordError(f"{self.folder}: another process is gathering rows; try again")
            self._replace([*_files(self._new), *_files(self._parts)], without=gone)
        self._known -= gone

    def read(self, columns: Sequence[str] | None = None) -> Any:
        """Returns all rows as an Arrow table, each once; None where there are none.

        Of ``columns`` those that are there. Raises RecordError where they cannot be read.
        """
        with self._typed("read"):
            for _ in range(20):
                with suppress(FileNotFoundError):  # gathered while it was to be read
                    return _once(_joined(self._all(columns)))
        raise RecordError(f"{self.folder} cannot be read: its files change all the time")

    def _all(self, columns: Sequence[str] | None) -> list[Any]:
        wanted = None if columns is None else list(dict.fromkeys(["key", *columns]))
        new = _files(self._new)  # first: a row that is gathered meanwhile is then read in a part
        found = [each for path in new if (each := self._single(path, wanted)) is not None]
        return found + [_read(path, wanted) for path in _files(self._parts)]

    def _single(self, path: Path, columns: Sequence[str] | None) -> Any:
        """Returns the row of a file; move it away and return None where it is damaged. Raises OSError."""
        try:
            return _read(path, columns)
        except _Damaged:
            with suppress(OSError):  # in a folder that cannot be written the row is left out all the same
                self._damaged.mkdir(exist_ok=True)
                path.replace(self._damaged / path.name)
            return None

    def _replace(self, files: Sequence[Path], without: Iterable[str] = ()) -> None:
        """Writes the rows of files, but for some, into one new part, and removes the files."""
        tables, taken = [], []
        for path in files:
            single = path.parent == self._new
            with suppress(FileNotFoundError):  # moved away by a reader: no other process gathers now
                table = self._single(path, None) if single else _read(path, None)
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
            self._write(whole, self._parts, secrets.token_hex(8), sync=True)
            self._known |= set(whole["key"].to_pylist())
        for path in taken:
            path.unlink(missing_ok=True)

    def _write(self, table: Any, folder: Path, name: str, *, sync: bool) -> None:
        """Writes a table to a file whose name ends in the checksum of its content."""
        from pyarrow import parquet

        buffer = arrow().BufferOutputStream()
        parquet.write_table(table, buffer, compression="zstd" if sync else "none")
        content = buffer.getvalue()
        with replacing(folder / f"{name}.{_checksum(content)}.parquet", sync=sync) as file:
            file.write(content)

    @contextmanager
    def _typed(self, what: str) -> Iterator[None]:
        """Turns any OSError into RecordError, with what cannot be done to the folder."""
        try:
            yield
        except RecordError:
            raise
        except OSError as error:
            where = error.filename if isinstance(error.filename, str) else self.folder
            raise _unusable(where, what, error) from error

    @contextmanager
    def _alone(self) -> Iterator[bool]:
        """Within this context no other process gathers; False where one does already."""
        lock = locked(self.folder / "gathering")
        try:
            yield lock is not None
        finally:
            if lock is not None:
                os.close(lock)


def _unusable(where: str | Path, what: str, error: OSError) -> RecordError:
    reason = error.strerror or error
    return RecordError(f"{where} cannot be {what}: {reason}; the rows that were there are there")


class TaskClaims:
    """The claims of this process: locked files in a folder, named by the keys of the tasks."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._held: dict[str, int] = {}

    def take(self, key: str) -> bool:
        """Claims a task; False where another process has. Raises RecordError where that is impossible."""
        if flock is None:
            return True
        try:
            descriptor = locked(self._folder / key)
        except OSError as error:
            raise _unusable(self._folder, "written", error) from error
        if descriptor is None:
            return False
        self._held[key] = descriptor
        return True

    def give_back(self, key: str) -> None:
        """Gives up a claim: the task's row is there, or will not be."""
        descriptor = self._held.pop(key, None)
        if descriptor is not None:
            with suppress(OSError):  # still locked, so the file cannot be another process's
                (self._folder / key).unlink()
            os.close(descriptor)

    def close(self) -> None:
        """Gives up all claims, and removes what processes that were killed have left."""
        for key in list(self._held):
            self.give_back(key)
        for left in self._folder.iterdir():
            if self.take(left.name):
                self.give_back(left.name)


def locked(path: Path) -> int | None:
    """Opens a file and locks it; returns its descriptor, or None where another process has locked it.

    Where files cannot be locked, it is opened all the same. Raises OSError where it cannot be opened.
    """
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if flock is not None:
                _lock(descriptor)
            if os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor
        except BlockingIOError:
            os.close(descriptor)
            return None
        except FileNotFoundError:  # it was given back between opening and locking
            pass
        os.close(descriptor)


def _lock(descriptor: int) -> None:
    """Locks a file, where files can be locked. Raises BlockingIOError where another process has done so."""
    try:
        flock(descriptor, LOCK_EX | LOCK_NB)
    except BlockingIOError:
        raise
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise


class _Damaged(RecordError):
    """The content of a file is not what was written."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(
            f"{path} is damaged: {reason}. Move it away, and `kinetile study run` does its tasks again"
        )


def _checksum(content: Any) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def _files(folder: Path) -> list[Path]:
    """Returns the Parquet files of a folder; an unfinished file has another name."""
    if not folder.is_dir():
        return []
    names = (each.name for each in os.scandir(folder))
    return [folder / name for name in sorted(names) if name.endswith(".parquet") and name[0] != "."]


def _rows(path: Path) -> int:
    from pyarrow import ArrowException, parquet

    try:
        return int(parquet.read_metadata(path).num_rows)
    except (ArrowException, OSError):  # gone, or damaged: left alone here, and an error where it is read
        return LARGE


def _read(path: Path, columns: Sequence[str] | None) -> Any:
    """Returns the rows of a file: all columns, or those of some that it has.

    Raises _Damaged, and OSError where the file cannot be read.
    """
    from pyarrow import ArrowException, BufferReader, parquet

    with open_regular(path) as file:
        content = file.read()
    checksum = _CHECKSUM.search(path.name)
    if checksum and checksum[1] != _checksum(content):
        raise _Damaged(path, "its content has another checksum than its name")
    try:
        with parquet.ParquetFile(BufferReader(content)) as file:
            names = None if columns is None else [n for n in columns if n in file.schema_arrow.names]
            # Without Arrow's threads: one of them that still held Python's bytes while the interpreter ended
            # made it abort after all was done (Arrow's issues 34314 and 50482).
            return file.read(names, use_threads=False)
    except (ArrowException, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:  # the machine's, and not Arrow's
            raise
        raise _Damaged(path, f"it is no Parquet file ({error})") from error


def _joined(tables: list[Any]) -> Any:
    """Returns tables as one; a column that is text in one of them is text in all."""
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
    """Returns a table with each key once."""
    if table is None:
        return None
    keys = table["key"].to_pylist()
    if len(set(keys)) == len(keys):
        return table
    first = {key: at for at, key in reversed(list(enumerate(keys)))}
    return table.take(sorted(first.values()))
