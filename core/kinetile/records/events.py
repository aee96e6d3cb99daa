"""Event files: everything that happened to a scene, in one Parquet file.

A row is one event that changed a flight plan, with position and velocity of its bodies right after it (the
columns are those of ``kinetile.LOG``). Between two of its rows a body flies straight, so the rows and the
scene, which the file carries in its metadata, are the whole trajectory: ``kinetile.records.trajectory`` gives
any body at any time, exactly.

While a run goes on its rows are in ``FILE.partial`` (or ``FILE.partial-2``, ..., where that is taken), which
becomes ``FILE`` when the recorder closes. A link is followed; what is no regular file is not replaced. It
closes in every way a run can end: done, Ctrl-C, a fault, a full disk. The metadata's "status" says which it
was: "complete", "interrupted", "fault: ..." or "disk: ...". A full disk cannot spoil what has been written,
because the space of a row group and of the footer behind it is reserved before the rows are written (see
``kinetile.records.reserved_file``). Only a process that is killed outright leaves FILE.partial behind,
without the footer that a reader needs.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import MissingExtra, RecordError
from kinetile.kernel.log import LOG
from kinetile.records.reserved_file import ReservedFile
from kinetile.records.versions import versions
from kinetile.run.interrupts import Interrupts
from kinetile.scene.targets import writable_target

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["EventFile", "EventRecorder", "read_events"]

_KEY = "kinetile"
_SCENE_KEY = "kinetile.scene"
_COLUMNS = LOG.names or ()
_FEW_VALUES = ["epoch", "a", "b"]  # dictionaries pay for these; the others take forty times as long with them
_ENCODING = {name: "BYTE_STREAM_SPLIT" for name in _COLUMNS if LOG[name].kind == "f"} | {
    "tick": "DELTA_BINARY_PACKED"
}
_ROWS_A_GROUP = 1 << 17
_FOOTER_A_COLUMN = 256  # bytes of footer for one column of one row group: about 120 are used
_SLACK = 1 << 16  # page headers, schema, alignment
_LONGEST_SCENE = 2**31 - 1  # bytes of TOML: pyarrow would stop at 1e8, about a million discs
_FEWEST = 256  # rows worth a row group of their own when the disk is nearly full


class EventFile(NamedTuple):
    """What an event file holds: the rows (dtype LOG) in the order of events, and its metadata."""

    rows: NDArray[Any]
    metadata: dict[str, Any]


class EventRecorder:
    """Writes an event file: ``with EventRecorder(path, scene) as recorder: sim.run(2.0, recorder=recorder)``.

    ``meta`` is any JSON-ready mapping (phases, options, ...) and may be added to, as ``recorder.meta``, until
    the recorder closes; "status", "rows" and "missing" are the recorder's own. An older file of the name is
    replaced at that moment and not before. ``rows`` is the number of rows written so far, ``status`` what the
    file's metadata will say, ``missing`` how many rows of the simulation were not given to this recorder.

    A recorder writes one file, inside one ``with``: outside of it, it takes no rows.

    Raises MissingExtra without pyarrow, and RecordError where the file cannot be written; the rows that were
    written before the error are kept, in a file that can be read.
    """

    def __init__(self, path: str | Path, scene: Scene, meta: Mapping[str, Any] | None = None) -> None:
        from kinetile.scene.files import dumps_scene

        self._pa, self._pq = _pyarrow()
        self.path = Path(path)
        self.partial = self.path.with_name(self.path.name + ".partial")
        self._target = self.path
        self._file: ReservedFile | None = None
        self.scene = dumps_scene(scene)
        self.meta: dict[str, Any] = {
            "start": scene.start,
            "time_unit": scene.time_unit,
            "recipe": scene.origin.get("recipe"),
            "parameters": dict(scene.origin.get("parameters", {})),
            "versions": versions(),
            **(meta or {}),
        }
        self.rows = 0
        self.missing = 0
        self.status = "running"
        self._taken = 0
        self._groups = 0
        self._pending: list[NDArray[Any]] = []
        self._waiting = 0
        self._full: RecordError | None = None
        self._schema = self._pa.schema([(name, self._pa.from_numpy_dtype(LOG[name])) for name in _COLUMNS])

    def __enter__(self) -> Self:
        if self._file is not None:
            raise RecordError(f"{self.path}: this recorder has been used; a recorder writes one file, once")
        try:
            self._target = writable_target(self.path)
            self._file, self.partial = _open_beside(self._target)
        except OSError as error:
            raise RecordError(f"{self.path} cannot be written: {_reason(error)}") from error
        try:
            self._file.reserve(self._footer_bound())
            self._writer = self._pq.ParquetWriter(
                self._file,
                self._schema,
                compression="snappy",
                use_dictionary=_FEW_VALUES,
                column_encoding=_ENCODING,
            )
        except BaseException as error:
            self._file.close()
            self.partial.unlink(missing_ok=True)
            if isinstance(error, OSError):
                raise RecordError(f"{self.path} cannot be written: {_reason(error)}") from error
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        elif isinstance(error, KeyboardInterrupt):
            self.close("interrupted")
        else:
            self.close(f"fault: {type(error).__name__}: {error}")

    def __call__(self, rows: NDArray[Any]) -> None:
        """Take the next rows (dtype LOG), which are copied.

        Raises RecordError when the disk is full, and outside of the ``with`` in which the file is open.
        """
        if self._full:
            raise self._full
        self._open_file()
        with Interrupts(patient=True):
            self._taken += len(rows)
            self._pending.append(np.array(rows, dtype=LOG))
            self._waiting += len(rows)
            if self._waiting >= _ROWS_A_GROUP:
                self._flush()

    def begin(self, before: int) -> None:
        """Be told, by a simulation that is about to run, how many rows there were before the next one.

        Rows that this recorder did not get are counted as ``missing``: the others are not the whole motion.
        """
        self.missing += max(before - self.missing - self._taken, 0)

    def close(self, status: str = "complete") -> None:
        """Write what is pending and the footer, and give the file its name.

        Closing twice, or before the file was opened, does nothing. Raises RecordError if rows had to be left
        out, or if the footer could not be written.
        """
        if self._file is None or self._file.closed:
            return
        left_out = None
        with Interrupts(patient=True):
            if self._waiting:
                try:
                    self._flush()
                except RecordError as error:
                    left_out = error
            self.status = f"disk: {self._full}" if self._full else status
            self._finish()
        if left_out:
            raise left_out

    def _open_file(self) -> ReservedFile:
        """Return the file if it is open; raise RecordError if not."""
        if self._file is None or self._file.closed:
            when = "before its `with` began" if self._file is None else "after it was closed"
            raise RecordError(
                f"{self.path}: rows came to the recorder {when}, where it cannot write them; "
                "expected `with EventRecorder(...) as recorder:` around the run"
            )
        return self._file

    def _flush(self) -> None:
        """Write the pending rows as one row group; if the disk is full, as many as there is room for."""
        file = self._open_file()
        rows = np.concatenate(self._pending)
        self._pending, self._waiting = [], 0
        try:
            self._write(rows)
        except OSError as error:
            step = len(rows) // 2
            while step >= _FEWEST and not file.torn:
                with suppress(OSError):
                    self._write(rows[:step])
                    rows = rows[step:]
                step //= 2
            self._full = RecordError(
                f"{self.path}: {_reason(error)}; it holds the first {self.rows} events and no later ones"
            )
            raise self._full from error

    def _write(self, rows: NDArray[Any]) -> None:
        self._open_file().reserve(rows.nbytes * 7 // 6 + _SLACK + self._footer_bound())
        self._writer.write_table(self._pa.table([rows[name] for name in _COLUMNS], schema=self._schema))
        self.rows += len(rows)
        self._groups += 1

    def _footer_bound(self) -> int:
        text = len(self.scene.encode()) + len(self._metadata().encode())
        return text + _SLACK + (self._groups + 1) * len(_COLUMNS) * _FOOTER_A_COLUMN

    def _metadata(self) -> str:
        own = {"status": self.status, "rows": self.rows, "missing": self.missing}
        return json.dumps(own | self.meta | own, default=str)

    def _finish(self) -> None:
        file = self._open_file()
        try:
            self._writer.add_key_value_metadata({_KEY: self._metadata(), _SCENE_KEY: self.scene})
            self._writer.close()
        except (OSError, self._pa.ArrowException) as error:
            raise RecordError(
                f"{self.path} could not be finished: {_reason(error)}; "
                f"{self.partial} has no footer and cannot be read"
            ) from error
        finally:
            file.close()
        try:
            self.partial.replace(self._target)
        except OSError as error:
            raise RecordError(
                f"{self.path} cannot be written: {_reason(error)}; the events are in {self.partial}"
            ) from error


def read_events(path: str | Path) -> EventFile:
    """Read an event file.

    The metadata are those the recorder was given, and "scene" (the scene as TOML text), "status", "rows",
    "missing" (rows of the run that are not in the file), "start", "time_unit", "recipe", "parameters",
    "versions".

    Raises MissingExtra without pyarrow, and RecordError where there is no event file of kinetile.
    """
    pa, pq = _pyarrow()
    try:
        with pq.ParquetFile(path, thrift_string_size_limit=_LONGEST_SCENE) as file:
            found = file.metadata.metadata or {}
            metadata = {**json.loads(found[_KEY.encode()]), "scene": found[_SCENE_KEY.encode()].decode()}
            rows = np.empty(file.metadata.num_rows, LOG)
            first = 0
            for index in range(file.num_row_groups):
                table = file.read_row_group(index)
                for name in _COLUMNS:
                    rows[name][first : first + table.num_rows] = table[name].to_numpy()
                first += table.num_rows
    except (OSError, pa.ArrowException) as error:
        raise RecordError(f"{path} cannot be read as an event file: {_reason(error)}") from error
    except KeyError as error:
        raise RecordError(
            f"{path} is a Parquet file, but not an event file of kinetile: no {error}"
        ) from error
    return EventFile(rows, metadata)


def _open_beside(target: Path) -> tuple[ReservedFile, Path]:
    """Open a new file beside the target; what another recorder writes, or a killed one left, is not touched.

    Raises OSError.
    """
    for number in count(1):
        partial = target.with_name(f"{target.name}.partial" + (f"-{number}" if number > 1 else ""))
        with suppress(FileExistsError):
            return ReservedFile(partial), partial
    raise AssertionError


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtra("Reading and writing event files", "pyarrow", "records") from error
    return pyarrow, pyarrow.parquet


def _reason(error: Exception) -> str:
    return (isinstance(error, OSError) and error.strerror) or str(error)
