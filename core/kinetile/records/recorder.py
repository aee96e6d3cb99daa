"""Recorder of a run: it writes every event that changes a flight plan into an event file.

A row is one such event, with position and velocity of its bodies right after it (``kinetile.LOG`` lists the
columns). Between two of its rows a body has one plan, so the rows and the scene in the metadata are the whole
trajectory (``kinetile.records.trajectory``).

During a run the rows are in ``FILE.partial``, a log (``kinetile.records.log``) that no other run can write
meanwhile (``kinetile.records.locks``). The log lags by at most a quarter of a second or 65,536 rows. When the
recorder closes, at every end of a run, it makes ``FILE`` from the log, in Parquet
(``kinetile.records.finishing``), and removes the log. "status" in the metadata is "complete", "interrupted",
"fault: ..." or "disk: ...". A process that is killed, or has no room for ``FILE``, leaves the log;
``kinetile.records.recover`` makes ``FILE`` from it. A link is followed; only regular files are replaced.
"""

import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import RecordError, answering
from kinetile.kernel.log import INSERTED, LOG
from kinetile.records.finishing import PARTIAL, event_target, finish, pyarrow_modules
from kinetile.records.locks import open_alone
from kinetile.records.log import Beginning, LogFile, LogReader, LogWriter, Seal, holds_nothing
from kinetile.records.reading import KindsByHand, read_events
from kinetile.run.interrupts import Unbroken
from kinetile.run.moment import Moment
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.targets import mode_of, reason, record_errors
from kinetile.versions import versions

_ROWS_A_BATCH = 1 << 16
_SECONDS_A_BATCH = 0.25
_BYTES_AT_ONCE = 1 << 20
_FEWEST = 256  # rows worth a batch of their own when the disk is nearly full


class EventRecorder:
    """Writes an event file: ``with EventRecorder(path, scene) as recorder: sim.run(2.0, recorder=recorder)``.

    ``meta`` is any JSON-ready mapping (phases, options, ...) and may be added to, as ``recorder.meta``, until
    the recorder closes; "status", "rows", "missing", "start", "time_unit", "places", "time", "kinds",
    "fingerprint" and "answer" are the recorder's own. ``rows`` is the number of rows written so far,
    ``status`` the status in the file's metadata (or the state of a file that could not be finished),
    ``missing`` the number of rows of the simulation that were not passed to this recorder.

    ``behind`` is a resumed simulation (``kinetile.resume``): the rows before its checkpoint begin this file,
    if they are found (then ``goes_on`` is True): in FILE.partial if the run was killed, in FILE if it ended.
    Later events are recorded again. Without earlier rows the file begins at the checkpoint.

    An existing file, and the rows of a killed run into it, are refused, unless ``overwrite``: then the file
    is replaced when the recorder closes. A recorder writes one file, inside one ``with`` and in one process:
    elsewhere, as in a forked child, it accepts no rows. Raises MissingExtra without pyarrow, and RecordError
    if the file exists, if another run is writing it, or if it cannot be written; rows written before an error
    are kept, in FILE, or in FILE.partial if the message says so.
    """

    @answering
    def __init__(
        self,
        path: str | os.PathLike[str],
        scene: Scene,
        meta: Mapping[str, Any] | None = None,
        *,
        overwrite: bool = False,
        behind: Simulation | None = None,
    ) -> None:
        from kinetile.scene.files import dumps_scene

        pyarrow_modules()
        self.path = Path(path)
        self._overwrite = overwrite or behind is not None
        self._target = event_target(self.path, self._overwrite)
        self.partial = self._target.with_name(self._target.name + PARTIAL)
        self.scene = dumps_scene(scene)
        self._behind = None if behind is None else Beginning(behind.rows, behind.fingerprint, self.scene)
        self.goes_on = behind is not None and any(map(os.path.exists, (self.partial, self._target)))
        self.meta: dict[str, Any] = {
            "recipe": scene.origin.get("recipe"),
            "parameters": dict(scene.origin.get("parameters", {})),
            "versions": versions(),
            **(meta or {}),
        }
        halves = {axis: scene.periods["xy".index(axis)] / 2 for axis in scene.periodic}
        places = {axis: [-half, half] for axis, half in halves.items()}  # rule 4p, not ``positions()``
        self._frame = {"start": scene.start, "time_unit": scene.time_unit, "places": places}
        self._answer = scene.answer
        self._kinds = KindsByHand(scene)
        self._kinds_of: Callable[[Array], Array] | None = None
        self._last = self._reached = scene.start
        self.rows = 0
        self.missing = 0
        self.status = "running"
        self._taken = 0
        self._pending: list[Array] = []
        self._waiting = 0
        self._flushed = monotonic()
        self._full: RecordError | None = None
        self._file: LogFile | None = None

    def __enter__(self) -> Self:
        if self._file is not None:
            raise RecordError(f"{self.path}: this recorder has been used; a recorder writes one file, once")
        left = self.goes_on and self.partial.exists()
        with record_errors(f"{self.path} cannot be written"):
            file = open_alone(self.partial, self._overwrite, as_it_is=left, mode=mode_of(self._target))
            try:
                event_target(self.path, self._overwrite)  # a file made before this recorder held the lock
                if left:
                    with file.reader() as content:
                        left = not holds_nothing(content)
                    if not left:
                        file.go_to(0)
                file = self._begin(file, left)
            except BaseException:
                if not left:
                    with suppress(OSError):
                        self.partial.unlink()
                file.close()
                raise
        self._file, self._process = file, os.getpid()
        return self

    def _begin(self, file: LogFile, left: bool) -> LogFile:
        """Begins the log, in FILE.partial or in its replacement, with the rows that are already recorded:
        under another name until it is complete, so that a kill leaves the old file."""
        at, rows = self._found(file) if left and self._behind is not None else (None, self._earlier())
        unfinished = self.partial.with_name(self.partial.name + ".unfinished")
        apart = (at is None or len(rows) > 0) and os.name != "nt"  # where an open file cannot be replaced
        new = open_alone(unfinished, overwrite=True, mode=mode_of(self.partial)) if apart else file
        try:
            if at is None:
                self._log = LogWriter.begin(new, self.scene)
                self._write(rows[:0])
            else:
                if apart:
                    with file.reader() as content:
                        while new.position < at[0]:
                            new.write(content.read(min(_BYTES_AT_ONCE, at[0] - new.position)))
                self._log = LogWriter.behind(new, at)
            for first in range(0, len(rows), _ROWS_A_BATCH):
                self._write(rows[first : first + _ROWS_A_BATCH], more=True)
            if apart:
                if len(rows):
                    new.sync()
                unfinished.replace(self.partial)
                file.close()
        except BaseException:
            if apart:
                with suppress(OSError):
                    unfinished.unlink()
                new.close()
            raise
        self._taken = self.rows
        return new

    def _found(self, file: LogFile) -> tuple[tuple[int, int], Array]:
        """Returns the end of this run's whole batches in a log, and its rows after that, within a batch."""
        assert self._behind is not None
        with file.reader() as content:
            at, rows = LogReader(content, str(self.partial)).find(self._behind)
        self.rows = self._behind.rows - len(rows)
        return at, rows

    def _earlier(self) -> Array:
        if self._behind is None or not self._target.exists():
            return np.zeros(0, LOG)
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
        elif self._process != os.getpid():
            pass  # a child ends, and its own error is raised
        elif isinstance(error, KeyboardInterrupt):
            self.close("interrupted")
        else:
            self.close(f"fault: {type(error).__name__}: {error}")

    def __call__(self, rows: Array) -> None:
        """Receives the next rows (dtype LOG), and copies them.

        Raises RecordError if the disk is full, and outside of the ``with`` that keeps the file open.
        """
        if self._full:
            raise self._full
        self._open_file()
        with Unbroken():
            if self._kinds_of is not None:
                self._kinds.add(rows["a"][rows["b"] == INSERTED], self._kinds_of)
            self._taken += len(rows)
            self._pending.append(np.array(rows, dtype=LOG))
            self._waiting += len(rows)
            if self._waiting >= _ROWS_A_BATCH or monotonic() - self._flushed >= _SECONDS_A_BATCH:
                self._flush()

    def flush(self) -> None:
        """Writes the waiting rows now; raises like a call with rows."""
        if self._full:
            raise self._full
        self._open_file()
        with Unbroken():
            self._flush()

    def sync(self) -> None:
        """Writes the waiting rows now, and brings the log to the disk; raises like ``flush``."""
        self.flush()
        with suppress(OSError):
            self._open_file().sync()

    def begin(self, moment: Moment, before: int) -> None:
        """Begins a run. Rows not received count as ``missing``: the others are not the whole motion."""
        if self._kinds.several:
            self._kinds_of = moment.kinds_of
            self._kinds.add(np.arange(moment.numbers), moment.kinds_of)
        self.missing += max(before - self.missing - self._taken, 0)

    def end(self, time: float) -> None:
        """Ends a run: all rows up to this time are here."""
        self._reached = time

    def close(self, status: str = "complete") -> None:
        """Writes pending rows, and makes the file; a second call, or one before the opening, does nothing.
        Raises RecordError if rows had to be left out, or if the file could not be made."""
        if self._file is None or self._file.closed:
            return
        self._open_file()
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

    def _open_file(self) -> LogFile:
        if self._file is None or self._file.closed:
            when = "before its `with` began" if self._file is None else "after it was closed"
            raise RecordError(
                f"{self.path}: rows came to the recorder {when}, where it cannot write them; "
                "expected `with EventRecorder(...) as recorder:` around the run"
            )
        if self._process != os.getpid():
            raise RecordError(
                f"{self.path}: this recorder is of process {self._process}, and this is {os.getpid()}, which "
                "was forked from it; expected a recorder of its own, with another file"
            )
        return self._file

    def _flush(self) -> None:
        """Writes the pending rows; if the disk is full, as many as fit."""
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
                if step < _FEWEST:
                    self._full = RecordError(
                        f"{self.path}: {reason(error)}; it holds the first {self.rows} events and no later "
                        "ones"
                    )
                    raise self._full from error

    def _write(self, rows: Array, *, more: bool = False) -> None:
        """Writes a batch of rows, and the run's time; ``more``: others follow at once."""
        last = float(rows["time"][-1]) if len(rows) else self._last
        self._log.write(self._metadata(last, behind=more), rows)
        self.rows += len(rows)
        self._last = last
        self._flushed = monotonic()

    def _metadata(self, last: float, *, behind: bool) -> str:
        """Returns the metadata as JSON; ``behind``: there are rows that are not in the log."""
        own = {"status": self.status, "missing": self.missing, **self._frame, "answer": self._answer}
        own["time"] = last if behind else max(self._reached, last)
        own["kinds"] = self._kinds.runs
        return json.dumps(own | self.meta | own, default=str)

    def _finish(self, file: LogFile) -> None:
        """Makes the file from the log; RecordError, with the place of the events, if that fails."""
        try:
            if file.gone:
                raise self._lost()
            last = self._metadata(self._last, behind=self._full is not None)
            with suppress(OSError):  # a full disk: the event file has it, if there is room for that
                self._log.write(last, np.zeros(0, LOG))
            if not file.is_at(self.partial):
                raise RecordError(
                    f"{self.path} cannot be written: {self.partial} has been moved meanwhile, by itself or "
                    "with its folder; the events are in it, wherever it is, and `kinetile recover` makes an "
                    "event file of it"
                )
            self._make(file, last)
        except RecordError as error:
            self.status = f"{'lost' if file.gone else 'unfinished'}: {error}"
            raise
        finally:
            file.close()

    def _make(self, file: LogFile, last: str) -> None:
        with file.reader() as log:
            try:
                finish(log, str(self.partial), self._target, self._overwrite, last)
            except Exception as error:  # pyarrow may raise anything
                with suppress(OSError):
                    file.sync()
                kept = f"the first {self.rows} events" if self._full else "the events"
                raise RecordError(
                    f"{self.path} cannot be written: {reason(error)}; {kept} are in {self.partial}: "
                    f"`kinetile recover {self.partial} --out ANOTHER.parquet` makes an event file of them"
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
