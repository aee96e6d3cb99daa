"""Runner of ``kinetile run`` and ``kinetile resume``. However a run ends (its end, a fault, a signal, a full
disk), the events file is closed, the checkpoint holds the present moment, and the results are printed."""

from __future__ import annotations

import csv
import io
import os
import signal
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, process_time
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from kinetile.cli.files import file_errors
from kinetile.cli.observed import observed_table, write_observed
from kinetile.cli.output import scene_summary, show, show_labels
from kinetile.cli.terminal import EXIT_ERRORS, EXIT_FAULT, Bar, FirstSignal, make_ready, notice, put
from kinetile.errors import BadOption, RecordError, Refused
from kinetile.plugin.choices import called
from kinetile.targets import write_file

if TYPE_CHECKING:
    from kinetile.records.recorder import EventRecorder
    from kinetile.run.simulation import Progress, Simulation
    from kinetile.scene import Scene
    from kinetile.statistics import Observed

EVERY = 60.0
"""Seconds between two checkpoints without ``--every``."""


_VERBOSE = {"unaccounted energy", "lateness"}
"""Readings that a run prints only with ``--verbose``: in most runs both are 0."""


class RunEnd(NamedTuple):
    """The end of a run: a word, an exit code, and the message of a code other than 0."""

    status: str
    code: int = 0
    message: str = ""


def run_to_end(
    simulation: Simulation,
    requested: Mapping[str, Any],
    max_contacts: int | None,
    *,
    recorder: EventRecorder | None,
    checkpoint: Checkpoint | None,
    prints: Callable[[Any], bool],
    verbose: bool = False,
    contacts: Path | None = None,
    encounters: Path | None = None,
    observe: Sequence[str] | Observed = (),
    observe_to: Path | None = None,
) -> None:
    """Runs; writes the contacts and observed quantities if requested; prints the result, unless ``prints``
    has done so; raises typer.Exit with a code other than 0. ``requested`` is the end, its contacts counted
    from the start of the run; ``max_contacts`` is the number of further contacts."""
    rows = None if encounters is None or recorder is not None else list[Any]()
    ending = _carry_out(simulation, recorder, requested["until"], max_contacts, checkpoint, observe, rows)
    if contacts is not None:
        from kinetile.records.contacts import contact_lines, write_contacts

        what = simulation.contacts, simulation.fingerprint, (simulation.time_unit, simulation.scene.start)
        if contacts == Path("-"):
            for text in contact_lines(*what):
                put(text)
        else:
            try:
                write_contacts(contacts, *what)
            except OSError as error:
                ending = RunEnd(
                    ending.status, EXIT_FAULT, f"--contacts {contacts}: {error.strerror or error}"
                )
    if encounters is not None:
        with file_errors(f"--encounters {encounters}"):
            _write_encounters(encounters, simulation, recorder, rows)
    found = _result(simulation, recorder, requested, ending.status)
    try:
        if not prints(found):
            show_labels(_lines(found, simulation.scene, verbose))
            if observe:
                show(observed_table(simulation.observed))
    finally:  # also if the reader of the result has closed the pipe
        if observe_to is not None:
            write_observed(simulation.observed, observe_to)
    if ending.code:
        notice(f"kinetile: {ending.message}")
        raise typer.Exit(ending.code)


def _carry_out(
    simulation: Simulation,
    recorder: EventRecorder | None,
    until: float | None,
    max_contacts: int | None,
    checkpoint: Checkpoint | None,
    observe: Sequence[str] | Observed,
    rows: list[Any] | None,
) -> RunEnd:
    """Runs, saves if requested, and always closes the events file; ``rows``, if given, gets the events."""
    saved = ""
    if checkpoint is not None:
        checkpoint.begin()
    with FirstSignal() as signals, ExitStack() as stack:
        if recorder is not None:
            with file_errors("--events"):
                stack.enter_context(recorder)
        try:
            with stack, Bar("running", simulation.scene.start, max_contacts) as bar:

                def progress(state: Progress) -> None:
                    bar(state._replace(until=until))
                    signals.check()
                    if checkpoint is not None:
                        checkpoint.save_if_due()

                try:
                    make_ready(simulation)
                    simulation.run(
                        until,
                        max_contacts=max_contacts,
                        progress=progress,
                        recorder=recorder if rows is None else lambda some: rows.append(some.copy()),
                        observe=observe,
                    )
                except KeyboardInterrupt:
                    if checkpoint is not None:
                        saved = checkpoint.save_after(signals)
                    raise
                if checkpoint is not None:
                    checkpoint.save()
        except KeyboardInterrupt:
            number = signals.number or signal.SIGINT
            return RunEnd("interrupted", 128 + number, f"interrupted at time {simulation.time:.10g}{saved}")
        except (*EXIT_ERRORS, Refused) as error:
            if isinstance(error, Refused) and simulation.time == simulation.scene.start:
                raise  # the scene is at fault, not a later command
            return RunEnd(f"fault: {type(error).__name__}", EXIT_FAULT, str(error))
    return RunEnd("complete")


def _write_encounters(
    path: Path, simulation: Simulation, recorder: EventRecorder | None, rows: list[Any] | None
) -> None:
    import numpy as np

    from kinetile.kernel.log import LOG
    from kinetile.records.encounters import ENCOUNTER, encounters
    from kinetile.records.trajectory import Trajectory

    if recorder is not None:
        trajectory = Trajectory.read(recorder.path)
    else:
        seen = np.concatenate([np.zeros(0, LOG), *(rows or ())])
        trajectory = Trajectory(seen, simulation.scene, simulation.time)
    names = {number: name for name, number in simulation.scene.numbers.items()}
    lines = [(names.get(a, a), names.get(b, b), *rest) for a, b, *rest in encounters(trajectory).tolist()]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([ENCOUNTER.names or (), *lines])
    write_file(path, text.getvalue())


@contextmanager
def only_writer(path: Path | None) -> Iterator[None]:
    """Within this context no other process runs on this checkpoint; raises BadOption if one does."""
    with ExitStack() as stack:
        if path is not None and path.name:
            from kinetile.records.locks import alone

            with file_errors("--checkpoint"):
                stack.enter_context(alone(path))
        yield


def check_checkpoint(path: Path | None, every: float | None, overwrite: bool) -> None:
    """Raises BadOption if a checkpoint would replace an old one, or another file."""
    from kinetile.run.saving.files import check_target

    if path is None:
        if every is not None:
            raise BadOption("--every is the interval of --checkpoint, which is missing: expected its FILE")
        return
    with file_errors("--checkpoint"):
        target = check_target(path)
    if target.exists() and not overwrite:
        raise BadOption(
            f"--checkpoint: {path} is there already: `kinetile resume {path}` continues it; choose "
            "another name, or say --overwrite"
        )


@dataclass
class Checkpoint:
    """Saves a simulation to a file, with a ``note``: at the start of a run, at intervals of some seconds and
    at its end. A failure to write is reported, and the run continues: the last checkpoint is still valid."""

    simulation: Simulation
    recorder: EventRecorder | None
    path: Path
    every: float | None
    note: Mapping[str, Any]

    def __post_init__(self) -> None:
        self._every = EVERY if self.every is None else self.every
        events = None if self.recorder is None else os.path.abspath(self.recorder.path)
        self._note = {**self.note, "every": self._every, "events": events}
        self._saved = monotonic()
        self._time: float | None = None

    def begin(self) -> None:
        """Saves before the run and its records begin, so that a failure is reported now, by BadOption."""
        with file_errors("--checkpoint"):
            self._save()

    def save(self) -> None:
        """Saves now, after the rows of the events file that it counts. Raises RecordError."""
        if self.recorder is not None:
            self.recorder.sync()
        self._save()

    def _save(self) -> None:
        self.simulation.save(self.path, self._note)
        self._time = self.simulation.time
        self._saved = monotonic()

    def save_if_due(self) -> None:
        """Saves when the interval is over; reports a failure and continues."""
        if monotonic() - self._saved < self._every:
            return
        try:
            self.save()
        except RecordError as error:
            self._saved = monotonic()
            notice(f"kinetile: --checkpoint: {error} ({self._last_state})")

    def save_after(self, signals: FirstSignal) -> str:
        """Saves because of a signal, unless another signal cancels that; returns the end of the message."""
        try:
            with signals.another_ends():
                self.save()
        except RecordError as error:
            return f"; {error} ({self._last_state})"
        except KeyboardInterrupt:
            return f"; not saved any more ({self._last_state})"
        return f"; `kinetile resume {self.path}` continues from there"

    @property
    def _last_state(self) -> str:
        if self._time is None:
            return "there is no checkpoint of this run"
        return f"{self.path} is of time {self._time:.10g}"


def phases_of(simulation: Simulation) -> dict[str, Any]:
    """Returns the phases of a simulation with their options, in plain types."""
    from kinetile.run.simulation import composition_of

    return {
        "broad_phase": simulation.broad_phase,
        "options": dict(simulation.options),
        "narrow_phases": dict(composition_of(simulation).narrow_phases),
    }


def _result(
    simulation: Simulation, recorder: EventRecorder | None, requested: Mapping[str, Any], status: str
) -> dict[str, Any]:
    from kinetile.versions import versions

    reached = {"time": simulation.time, "time_unit": simulation.time_unit, "status": status}
    written = recorder and {"path": str(recorder.path), "rows": recorder.rows, "status": recorder.status}
    return {
        "versions": versions(),
        "answer": simulation.scene.answer,
        "scene": scene_summary(simulation.scene),
        **phases_of(simulation),
        "run": {**requested, **reached},
        "readings": simulation.readings.as_dict(),
        "observed": [row._asdict() for row in simulation.observed.rows()],
        "events_file": written,
    }


def _lines(result: Mapping[str, Any], scene: Scene, verbose: bool) -> Iterable[tuple[str, str]]:
    from kinetile.explanation import reading_lines
    from kinetile.scene.scene import around, in_words, source_of

    run = result["run"]
    narrow = ", ".join(called(*each) for each in result["narrow_phases"].items())
    kinds = ", ".join(f"{kind} ({count:,})" for kind, count in result["scene"]["shapes"].items())
    what = in_words(scene, len(scene)) + (f": {kinds}," if kinds else "")
    yield "scene", f"{source_of(scene) or 'arrays'}: {what} {around(scene)}"
    broad = called(result["broad_phase"], result["options"])
    yield "phases", f"{broad}; {narrow or 'no narrow phase'}"
    yield "time", f"{scene.start:g} to {run['time']:.10g}: {run['status']}"
    whole = f", {process_time():.4g} s of this process"
    lines = ((name, text + whole * (name == "CPU time")) for name, text in reading_lines(result["readings"]))
    yield from (line for line in lines if verbose or line[0] not in _VERBOSE)
    if result["events_file"]:
        path, rows, status = result["events_file"].values()
        yield "events file", f"{path}: {rows:,} events ({status.partition(':')[0]})"
