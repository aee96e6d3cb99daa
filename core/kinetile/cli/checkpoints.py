"""Checkpoints: what a run of the command line saves now and then, and when it is told to end."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.terminal import FirstSignal, notice
from kinetile.errors import BadOption, RecordError

if TYPE_CHECKING:
    from kinetile.records.events import EventRecorder
    from kinetile.run.simulation import Simulation

__all__ = ["Checkpoint", "Every", "check_checkpoint", "only_writer"]

EVERY = 60.0
"""Seconds between two checkpoints, unless somebody says otherwise."""


Every = Annotated[
    float | None,
    typer.Option(min=0.0, metavar="SECONDS", help=f"How often --checkpoint saves; {EVERY:g} s."),
]


@contextmanager
def only_writer(path: Path | None) -> Iterator[None]:
    """Within this context no other process runs on this checkpoint; BadOption where one does already."""
    if path is None or not path.name:
        yield
        return
    from kinetile.records.one_writer import alone

    with ExitStack() as stack:
        try:
            stack.enter_context(alone(path))
        except RecordError as error:
            raise BadOption(f"--checkpoint: {error}") from error
        yield


def check_checkpoint(path: Path | None, every: float | None, overwrite: bool) -> None:
    """Raise BadOption where a new checkpoint is not to be written: it would take an old one's place, or that
    of something else."""
    from kinetile.run.saving.whole_file import check_target

    if path is None:
        if every is not None:
            raise BadOption("--every says how often --checkpoint saves, and there is none: expected its FILE")
        return
    try:
        target = check_target(path)
    except RecordError as error:
        raise BadOption(f"--checkpoint: {error}") from error
    if target.exists() and not overwrite:
        raise BadOption(
            f"--checkpoint: {path} is there already: `kinetile resume {path}` goes on from it; choose "
            "another name, or say --overwrite"
        )


class Checkpoint:
    """Saves a simulation to a file: when a run begins, every so many seconds, and at its end.

    ``note`` is what ``kinetile resume`` has to know besides. A checkpoint that cannot be written is told of,
    and does not end the run: the one before stands.
    """

    def __init__(
        self,
        simulation: Simulation,
        recorder: EventRecorder | None,
        path: Path,
        every: float | None,
        note: Mapping[str, Any],
    ) -> None:
        self.path = path
        self._simulation = simulation
        self._recorder = recorder
        self._every = EVERY if every is None else every
        events = None if recorder is None else os.path.abspath(recorder.path)
        self._note = {**note, "every": self._every, "events": events}
        self._saved = monotonic()
        self._time: float | None = None

    def begin(self) -> None:
        """Save before anything is run or recorded, so that what does not work is told now, by BadOption."""
        try:
            self._save()
        except RecordError as error:
            raise BadOption(f"--checkpoint: {error}") from error

    def save(self) -> None:
        """Save now; first, the rows of the events file are brought to the disk. Raises RecordError."""
        if self._recorder is not None:
            self._recorder.sync()
        self._save()

    def _save(self) -> None:
        self._simulation.save(self.path, self._note)
        self._time = self._simulation.time
        self._saved = monotonic()

    def save_if_due(self) -> None:
        """Save if it is time to; where that does not work, say so and go on."""
        if monotonic() - self._saved < self._every:
            return
        try:
            self.save()
        except RecordError as error:
            self._saved = monotonic()
            notice(f"kinetile: --checkpoint: {error} ({self._stands})")

    def save_after(self, signals: FirstSignal) -> str:
        """Save because a signal has come; another one gives that up. Return what is to be said of it."""
        try:
            with signals.another_ends():
                self.save()
        except RecordError as error:
            return f"; {error} ({self._stands})"
        except KeyboardInterrupt:
            return f"; not saved any more ({self._stands})"
        return f"; `kinetile resume {self.path}` goes on from there"

    @property
    def _stands(self) -> str:
        if self._time is None:
            return "there is no checkpoint of this run"
        return f"{self.path} is of time {self._time:.10g}"
