"""Event files: everything that happened to a scene, in one Parquet file.

A row is one event that changed a flight plan, with position and velocity of its bodies right after it (the
columns are those of ``kinetile.LOG``). Between two of its rows a body flies straight, so the rows and the
scene, which the file carries in its metadata, are the whole trajectory: ``kinetile.records.trajectory`` gives
any body at any time, exactly.

While a run goes on its rows are in ``FILE.partial``, which no other run can write meanwhile
(``kinetile.records.one_writer``) and which becomes ``FILE`` when the recorder closes. A link is followed;
what is no regular file is not replaced. It closes in every way a run can end: done, Ctrl-C, a fault, a full
disk. The metadata's "status" says which it was: "complete", "interrupted", "fault: ..." or "disk: ...". A
full disk cannot spoil what has been written, because the space of a row group and of the footer behind it is
reserved before the rows are written (see ``kinetile.records.reserved_file``). Only a process that is killed
outright leaves FILE.partial behind, without the footer that a reader needs.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import MissingExtra, RecordError
from kinetile.kernel.log import ANSWER, LOG
from kinetile.records.one_writer import open_alone
from kinetile.records.reserved_file import ReservedFile
from kinetile.records.seal import Seal
from kinetile.records.versions import versions
from kinetile.run.interrupts import Unbroken
from kinetile.scene.targets import writable_target

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["DIGEST_KEY", "KEY", "LONGEST_SCENE", "SCENE_KEY", "EventRecorder", "pyarrow_modules", "reason"]

KEY = "kinetile"
SCENE_KEY = "kinetile.scene"
DIGEST_KEY = "kinetile.digest"
LONGEST_SCENE = 2**31 - 1
"""Bytes of TOML: pyarrow would stop at 1e8, about a million discs."""

_COLUMNS = LOG.names or ()
_FEW_VALUES = ["epoch", "a", "b"]  # dictionaries pay for these; the others take forty times as long with them
_ENCODING = {name: "BYTE_STREAM_SPLIT" for name in _COLUMNS if LOG[name].kind == "f"} | {
    "tick": "DELTA_BINARY_PACKED"
}
_ROWS_A_GROUP = 1 << 17
_FOOTER_A_COLUMN = 256  # bytes of footer for one column of one row group: about 120 are used
_SLACK = 1 << 16  # page headers, schema, alignment
_FEWEST = 256  # rows worth a row group of their own when the disk is nearly full


class EventRecorder:
    """Writes an event file: ``with EventRecorder(path, scene) as recorder: sim.run(2.0, recorder=recorder)``.

    ``meta`` is any JSON-ready mapping (phases, options, ...) and may be added to, as ``recorder.meta``, until
    the recorder closes; "status", "rows", "missing", "start", "time_unit", "time", "fingerprint" and "answer"
    are the recorder's own. ``rows`` is the number of rows written so far, ``status`` what the file's metadata
    will say (or what has become of a file that could not be finished), ``missing`` how many rows of the
    simulation were not given to this recorder.

    A file that is there already is refused, unless ``overwrite``: then it is replaced when the recorder
    closes, and not before. A recorder writes one file, inside one ``with``: outside of it, it takes no rows.

    Raises MissingExtra without pyarrow, and RecordError where the file is there, is being written by another
    run or cannot be written; the rows that were written before an error are kept, in a file that can be read.
    """

    def __init__(
        self,
        path: str | Path,
        scene: Scene,
        meta: Mapping[str, Any] | None = None,
        *,
        overwrite: bool = False,
    ) -> None:
        from kinetile.scene.files import dumps_scene

        self._pa, self._pq = pyarrow_modules()
        self.path = Path(path)
        self._overwrite = overwrite
        self._target = self._writable()
        self.partial = self._target.with_name(self._target.name + ".partial")
        self._file: ReservedFile | None = None
        self.scene = dumps_scene(scene)
        self.meta: dict[str, Any] = {
            "recipe": scene.origin.get("recipe"),
            "parameters": dict(scene.origin.get("parameters", {})),
            "versions": versions(),
            **(meta or {}),
        }
        self._clock = {"start": scene.start, "time_unit": scene.time_unit}
        self._last = self._reached = scene.start
        self._seal = Seal()
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
            file = open_alone(self.partial, self._overwrite)
        except OSError as error:
            raise self._unwritable(error) from error
        try:
            self._writable()  # what has come there before this recorder was alone
            self._file = file
            file.reserve(self._footer_bound())
            self._writer = self._pq.ParquetWriter(
                file,
                self._schema,
                compression="snappy",
                use_dictionary=_FEW_VALUES,
                column_encoding=_ENCODING,
                write_page_checksum=True,
            )
        except BaseException as error:
            with suppress(OSError):
                self.partial.unlink()
            file.close()
            if isinstance(error, OSError):
                raise self._unwritable(error) from error
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
        with Unbroken():
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

    def reached(self, time: float) -> None:
        """Be told, by a simulation that has run, that it has got to a time: all rows up to it are here."""
        self._reached = time

    def close(self, status: str = "complete") -> None:
        """Write what is pending and the footer, and give the file its name.

        Closing twice, or before the file was opened, does nothing. Raises RecordError if rows had to be left
        out, or if the footer could not be written.
        """
        if self._file is None or self._file.closed:
            return
        left_out = None
        with Unbroken():
            if self._waiting:
                try:
                    self._flush()
                except RecordError as error:
                    left_out = error
            self.status = f"disk: {self._full}" if self._full else status
            self._finish()
        if left_out:
            raise left_out

    def _writable(self) -> Path:
        """Return the file to write, links followed; RecordError where it is not to be written."""
        if not self.path.name:
            raise RecordError(f"{str(self.path)!r} names no file: expected the path of an event file")
        try:
            target = writable_target(self.path)
        except OSError as error:
            raise self._unwritable(error) from error
        if target.exists() and not self._overwrite:
            raise RecordError(
                f"{self.path} is there already: choose another name, or have it overwritten (overwrite=True, "
                "or --overwrite)"
            )
        return target

    def _unwritable(self, error: OSError) -> RecordError:
        if isinstance(error, RecordError):
            return error
        return RecordError(f"{self.path} cannot be written: {reason(error)}")

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
        if file.gone:
            self._full = self._lost()
            raise self._full
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
                f"{self.path}: {reason(error)}; it holds the first {self.rows} events and no later ones"
            )
            raise self._full from error

    def _write(self, rows: NDArray[Any]) -> None:
        self._open_file().reserve(rows.nbytes * 7 // 6 + _SLACK + self._footer_bound())
        self._writer.write_table(self._pa.table([rows[name] for name in _COLUMNS], schema=self._schema))
        self.rows += len(rows)
        self._last = float(rows["time"][-1])
        self._seal.add(rows)
        self._groups += 1

    def _footer_bound(self) -> int:
        text = len(self.scene.encode()) + len(self._metadata().encode())
        return text + _SLACK + (self._groups + 1) * len(_COLUMNS) * _FOOTER_A_COLUMN

    def _metadata(self) -> str:
        time = self._last if self._full else max(self._reached, self._last)
        own = {"status": self.status, "rows": self.rows, "missing": self.missing, **self._clock}
        own |= {"time": time, "fingerprint": self._seal.fingerprint, "answer": ANSWER}
        return json.dumps(own | self.meta | own, default=str)

    def _finish(self) -> None:
        """Write the footer and give the file its name; RecordError, with what is kept, where it cannot be."""
        file = self._open_file()
        try:
            metadata = self._metadata()
            digest = self._seal.digest(metadata, self.scene)
            self._writer.add_key_value_metadata({KEY: metadata, SCENE_KEY: self.scene, DIGEST_KEY: digest})
            self._writer.close()
            file.seal()
            if file.gone:
                raise self._lost()
            self._name(file)
        except (OSError, self._pa.ArrowException) as error:
            if not isinstance(error, RecordError):
                error = RecordError(
                    f"{self.path} could not be finished: {reason(error)}; "
                    f"{self.partial} has no footer and cannot be read"
                )
            self.status = f"lost: {error}"
            raise error from error.__cause__
        finally:
            file.close()

    def _name(self, file: ReservedFile) -> None:
        """Give the finished file its name, while nobody else can write it."""
        if not file.is_at(self.partial):
            raise RecordError(
                f"{self.path} cannot be written: {self.partial} has been moved meanwhile, by itself or with "
                "its folder; the events are in it, wherever it is"
            )
        where = f"the events are in {self.partial}"
        if not self._overwrite and self._target.exists():
            raise RecordError(f"{self.path} has come to be there meanwhile; {where}")
        if os.name == "nt":
            file.close()
        try:
            self.partial.replace(self._target)
        except OSError as error:
            raise RecordError(f"{self.path} cannot be written: {reason(error)}; {where}") from error

    def _lost(self) -> RecordError:
        return RecordError(
            f"{self.path}: {self.partial} has been removed while it was being written, by itself or with its "
            "folder; none of the events is kept"
        )


def pyarrow_modules() -> tuple[Any, Any]:
    """Return pyarrow and pyarrow.parquet; MissingExtra without them."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtra("Reading and writing event files", "pyarrow", "records") from error
    return pyarrow, pyarrow.parquet


def reason(error: Exception) -> str:
    """Return what went wrong, in the system's own words where it has any."""
    return (isinstance(error, OSError) and error.strerror) or str(error)
