"""Recording: everything that happens to a scene, for an event file.

A row is one event that changed a flight plan, with position and velocity of its bodies right after it (the
columns are those of ``kinetile.LOG``). Between two of its rows a body flies straight, so the rows and the
scene, which the file carries in its metadata, are the whole trajectory: ``kinetile.records.trajectory`` gives
any body at any time, exactly.

While a run goes on its rows are in ``FILE.partial``, a log (``kinetile.records.row_log``) that no other run
can write meanwhile (``kinetile.records.one_writer``). Rows wait in memory for a quarter of a second at most,
or until there are 65,536; then they are the system's, and no end of the process can take them back. When the
recorder closes, ``FILE`` is made of the log, in Parquet (``kinetile.records.finishing``), and the log goes.
It closes in every way a run can end: done, Ctrl-C, a fault, a full disk. The metadata's "status" says which
it was: "complete", "interrupted", "fault: ..." or "disk: ...". A process that is killed outright, or that
finds no room for ``FILE``, leaves the log, of which ``kinetile.records.recover`` makes ``FILE``.

A link is followed; what is no regular file is not replaced.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import RecordError
from kinetile.kernel.log import ANSWER, LOG
from kinetile.records.finishing import PARTIAL, event_target, finish, pyarrow_modules, reason
from kinetile.records.one_writer import open_alone
from kinetile.records.reserved_file import ReservedFile
from kinetile.records.row_log import Beginning, LogWriter, holds_nothing
from kinetile.records.seal import Seal
from kinetile.records.versions import versions
from kinetile.run.interrupts import Unbroken

if TYPE_CHECKING:
    from kinetile.run.simulation import Simulation
    from kinetile.scene import Scene

__all__ = ["EventRecorder"]

_ROWS_A_BATCH = 1 << 16
_SECONDS_A_BATCH = 0.25
_FEWEST = 256  # rows worth a batch of their own when the disk is nearly full


class EventRecorder:
    """Writes an event file: ``with EventRecorder(path, scene) as recorder: sim.run(2.0, recorder=recorder)``.

    ``meta`` is any JSON-ready mapping (phases, options, ...) and may be added to, as ``recorder.meta``, until
    the recorder closes; "status", "rows", "missing", "start", "time_unit", "time", "fingerprint" and "answer"
    are the recorder's own. ``rows`` is the number of rows written so far, ``status`` what the file's metadata
    will say (or what has become of a file that could not be finished), ``missing`` how many rows of the
    simulation were not given to this recorder.

    ``behind`` is a simulation that was taken up (``kinetile.resume``): what the run has recorded before it
    was saved is the beginning of this file, if it is there (then ``goes_on``): in FILE.partial where the run
    was killed, in FILE where it ended. Events that came after it was saved come again. Where there is
    nothing, the file is of what comes from here on.

    A file that is there already is refused, unless ``overwrite``: then it is replaced when the recorder
    closes, and not before. So is what a run into the same file has left that was killed. A recorder writes
    one file, inside one ``with``: outside of it, it takes no rows.

    Raises MissingExtra without pyarrow, and RecordError where the file is there, is being written by another
    run or cannot be written; the rows that were written before an error are kept, in FILE, or in FILE.partial
    where the message says so.
    """

    def __init__(
        self,
        path: str | Path,
        scene: Scene,
        meta: Mapping[str, Any] | None = None,
        *,
        overwrite: bool = False,
        behind: Simulation | None = None,
    ) -> None:
        from kinetile.scene.text.files import dumps_scene

        pyarrow_modules()
        self.path = Path(path)
        self._overwrite = overwrite or behind is not None
        self._target = event_target(self.path, self._overwrite)
        self.partial = self._target.with_name(self._target.name + PARTIAL)
        self.scene = dumps_scene(scene)
        self._behind = None if behind is None else Beginning(behind.rows, behind.fingerprint, self.scene)
        self.goes_on = behind is not None and (self.partial.exists() or self._target.exists())
        self.meta: dict[str, Any] = {
            "recipe": scene.origin.get("recipe"),
            "parameters": dict(scene.origin.get("parameters", {})),
            "versions": versions(),
            **(meta or {}),
        }
        self._clock = {"start": scene.start, "time_unit": scene.time_unit}
        self._last = self._reached = scene.start
        self.rows = 0
        self.missing = 0
        self.status = "running"
        self._taken = 0
        self._pending: list[NDArray[Any]] = []
        self._waiting = 0
        self._flushed = monotonic()
        self._full: RecordError | None = None
        self._file: ReservedFile | None = None

    def __enter__(self) -> Self:
        if self._file is not None:
            raise RecordError(f"{self.path}: this recorder has been used; a recorder writes one file, once")
        left = self.goes_on and self.partial.exists()
        try:
            file = open_alone(self.partial, self._overwrite, as_it_is=left)
        except OSError as error:
            raise self._unwritable(error) from error
        try:
            event_target(self.path, self._overwrite)  # what has come there before this recorder was alone
            if left and _is_empty(file):
                left = False
                file.go_to(0)
            if left and self._behind is not None:
                self._log = LogWriter.behind(file, self._behind, str(self.partial))
                self._taken = self.rows = self._behind.rows
            else:
                earlier = self._earlier()
                self._log = LogWriter.begin(file, self.scene)
                self._write(np.zeros(0, LOG))
                for at in range(0, len(earlier), _ROWS_A_BATCH):
                    self._write(earlier[at : at + _ROWS_A_BATCH], more=True)
                self._taken = len(earlier)
        except BaseException as error:
            if not left:
                with suppress(OSError):
                    self.partial.unlink()
            file.close()
            if isinstance(error, OSError):
                raise self._unwritable(error) from error
            raise
        self._file = file
        return self

    def _earlier(self) -> NDArray[Any]:
        """Return the rows of this run that an event file of it holds, to begin with."""
        if self._behind is None or not self._target.exists():
            return np.zeros(0, LOG)
        from kinetile.records.reading import read_events

        found = read_events(self._target)
        rows, seal = found.rows[: self._behind.rows], Seal()
        seal.add(rows)
        self._behind.check(len(rows), seal.fingerprint, found.metadata["scene"], str(self.path))
        return rows

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
            if self._waiting >= _ROWS_A_BATCH or monotonic() - self._flushed >= _SECONDS_A_BATCH:
                self._flush()

    def flush(self) -> None:
        """Write now the rows that wait to be written; raises as a call with rows does."""
        if self._full:
            raise self._full
        self._open_file()
        with Unbroken():
            self._flush()

    def sync(self) -> None:
        """Write now the rows that wait, and bring the log to the disk; raises as ``flush``."""
        self.flush()
        with suppress(OSError):
            self._open_file().sync()

    def begin(self, before: int) -> None:
        """Be told, by a simulation that is about to run, how many rows there were before the next one.

        Rows that this recorder did not get are counted as ``missing``: the others are not the whole motion.
        """
        self.missing += max(before - self.missing - self._taken, 0)

    def reached(self, time: float) -> None:
        """Be told, by a simulation that has run, that it has got to a time: all rows up to it are here."""
        self._reached = time

    def close(self, status: str = "complete") -> None:
        """Write what is pending, and make the file of it.

        Closing twice, or before the file was opened, does nothing. Raises RecordError if rows had to be left
        out, or if the file could not be made.
        """
        if self._file is None or self._file.closed:
            return
        left_out = None
        with Unbroken():
            try:
                self._flush()
            except RecordError as error:
                left_out = error
            self.status = f"disk: {self._full}" if self._full else status
            self._finish(self._file)
        if left_out:
            raise left_out

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
        """Write the pending rows; if the disk is full, as many as there is room for."""
        file = self._open_file()
        if not self._waiting:
            return
        rows = np.concatenate(self._pending)
        self._pending, self._waiting = [], 0
        if file.gone:
            self._full = self._lost()
            raise self._full
        step = _ROWS_A_BATCH
        while len(rows):
            try:
                self._write(rows[:step], more=len(rows) > step)
                rows = rows[step:]
            except OSError as error:
                step = min(step, len(rows)) // 2
                if step < _FEWEST or file.torn:
                    self._full = RecordError(
                        f"{self.path}: {reason(error)}; it holds the first {self.rows} events and no later "
                        "ones"
                    )
                    raise self._full from error

    def _write(self, rows: NDArray[Any], *, more: bool = False) -> None:
        """Write a batch of rows, and how far the run is with them; ``more``: others are to follow at once."""
        last = float(rows["time"][-1]) if len(rows) else self._last
        self._log.write(self._metadata(last, behind=more), rows)
        self.rows += len(rows)
        self._last = last
        self._flushed = monotonic()

    def _metadata(self, last: float, *, behind: bool) -> str:
        """Return the metadata as JSON; ``behind``: there are rows that are not in the log."""
        own = {"status": self.status, "missing": self.missing, **self._clock, "answer": ANSWER}
        own["time"] = last if behind else max(self._reached, last)
        return json.dumps(own | self.meta | own, default=str)

    def _finish(self, file: ReservedFile) -> None:
        """Make the file of the log; RecordError, which says where the events are, where that cannot be."""
        try:
            if file.gone:
                raise self._lost()
            with suppress(OSError):
                self._log.end(self._metadata(self._last, behind=self._full is not None))
            file.trim()
            if not file.is_at(self.partial):
                raise RecordError(
                    f"{self.path} cannot be written: {self.partial} has been moved meanwhile, by itself or "
                    "with its folder; the events are in it, wherever it is, and `kinetile recover` makes an "
                    "event file of it"
                )
            self._make(file)
        except RecordError as error:
            self.status = f"{'lost' if file.gone else 'unfinished'}: {error}"
            raise
        finally:
            file.close()

    def _make(self, file: ReservedFile) -> None:
        with file.reader() as log:
            try:
                finish(log, str(self.partial), self._target, self._overwrite)
            except Exception as error:  # pyarrow may say anything
                with suppress(OSError):
                    file.sync()
                kept = f"the first {self.rows} events" if self._full else "the events"
                raise RecordError(
                    f"{self.path} cannot be written: {reason(error)}; {kept} are in {self.partial}: "
                    f"`kinetile recover {self.partial} --out ANOTHER` makes an event file of them"
                ) from error
        if os.name == "nt":
            file.close()
        with suppress(OSError):
            self.partial.unlink()

    def _lost(self) -> RecordError:
        return RecordError(
            f"{self.path}: {self.partial} has been removed while it was being written, by itself or with its "
            "folder; none of the events is kept"
        )


def _is_empty(file: ReservedFile) -> bool:
    with file.reader() as content:
        return holds_nothing(content)
