"""What ``run`` and ``resume`` have in common: a simulation is run to its end, and the result is printed."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from kinetile.cli.checkpoints import Checkpoint
from kinetile.cli.json_output import as_json, scene_summary
from kinetile.cli.terminal import FAULT, FAULTS, Bar, FirstSignal, make_ready, notice
from kinetile.errors import BadOption, RecordError

if TYPE_CHECKING:
    from kinetile.cli.sparkline import Course
    from kinetile.records.events import EventRecorder
    from kinetile.run.simulation import Progress, Simulation

__all__ = ["Ending", "carry_out", "check_files", "course_of", "finish", "leave", "narrow_phases"]


class Ending(NamedTuple):
    """How a run ended: in a word, and with which exit code."""

    status: str
    code: int = 0
    message: str = ""


def check_files(files: Mapping[str, Path | None], overwrite: bool) -> None:
    """Raise BadOption unless the files of the command line, by their options, have names, are different and
    may be written. Those of ``--contacts`` and ``--save-scene`` may be there only to be overwritten."""
    given = [(what, path) for what, path in files.items() if path is not None]
    for what, path in given:
        if not path.name:
            raise BadOption(f"{what} names no file: expected the path of a file")
    for (one, path), (other, its_path) in combinations(given, 2):
        if {"--events", "--contacts", "--checkpoint"} & {one, other} and _same_file(path, its_path):
            raise BadOption(f"{one} and {other} are one file, {path}: expected two, for one would be lost")
    for what, path in given:
        if what in ("--contacts", "--save-scene"):
            _check_new(what, path, overwrite)


def _check_new(option: str, path: Path, overwrite: bool) -> None:
    from kinetile.scene.targets import writable_target

    try:
        target = writable_target(path)
    except OSError as error:
        raise BadOption(f"{option} {path}: {error.strerror}") from error
    if target.exists() and not overwrite:
        raise BadOption(f"{option}: {path} is there already: choose another name, or say --overwrite")
    if not target.parent.is_dir():
        raise BadOption(f"{option} {path}: there is no folder {str(target.parent)!r}")


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:  # one of them is not there yet
        return os.path.realpath(one) == os.path.realpath(other)


def carry_out(
    simulation: Simulation,
    recorder: EventRecorder | None,
    until: float | None,
    max_contacts: int | None,
    checkpoint: Checkpoint | None = None,
    course: Course | None = None,
) -> Ending:
    """Run, save where that is asked for, and close the events file whatever happens."""
    said = ""
    if checkpoint is not None:
        checkpoint.begin()
    with FirstSignal() as signals, ExitStack() as stack:
        if recorder is not None:
            try:
                stack.enter_context(recorder)
            except RecordError as error:
                raise BadOption(f"--events: {error}") from error
        try:
            with stack, Bar("running", simulation.scene.start, max_contacts) as bar:

                def progress(state: Progress) -> None:
                    bar(state._replace(until=until))
                    signals.check()
                    if checkpoint is not None:
                        checkpoint.save_if_due()

                def run(until: float | None, most: int | None) -> None:
                    simulation.run(until, max_contacts=most, progress=progress, recorder=recorder)

                try:
                    make_ready(simulation)
                    (run if course is None else partial(course.follow, run))(until, max_contacts)
                except KeyboardInterrupt:
                    if checkpoint is not None:
                        said = checkpoint.save_after(signals)
                    raise
                if checkpoint is not None:
                    checkpoint.save()
        except KeyboardInterrupt:
            number = signals.number or signal.SIGINT
            return Ending("interrupted", 128 + number, f"interrupted at time {simulation.time:.10g}{said}")
        except FAULTS as error:
            return Ending(f"fault: {type(error).__name__}", FAULT, str(error))
    return Ending("complete")


def finish(
    simulation: Simulation,
    recorder: EventRecorder | None,
    asked: Mapping[str, Any],
    ending: Ending,
    contacts: Path | None,
    json: bool,
    course: Course | None = None,
) -> Ending:
    """Write the contacts, if they are asked for, and print the result; return how all of it ended."""
    if contacts is not None:
        ending = _write_contacts(simulation, contacts, ending)
    _print(_result(simulation, recorder, asked, ending.status), json, course)
    return ending


def course_of(simulation: Simulation, plain: bool, json: bool, audited: bool) -> Course | None:
    """Return what follows a run for those who look at a terminal; None for all others, and of audited runs,
    which would look at everything at the end of each slice."""
    if plain or json or audited or sys.stdout is None or not sys.stdout.isatty():
        return None
    from kinetile.cli.sparkline import Course

    return Course(simulation)


def leave(ending: Ending) -> None:
    """Say how it ended, unless that was well, and leave with its exit code."""
    if ending.code:
        notice(f"kinetile: {ending.message}")
        raise typer.Exit(ending.code)


def _write_contacts(simulation: Simulation, path: Path, ending: Ending) -> Ending:
    """Write the contacts as text; return how the run ended, or that they could not be written."""
    from kinetile.records.contacts import write_contacts

    try:
        write_contacts(path, simulation.contacts, simulation.fingerprint)
    except OSError as error:
        return Ending(ending.status, FAULT, f"--contacts {path}: {error.strerror or error}")
    return ending


def _result(
    simulation: Simulation, recorder: EventRecorder | None, asked: Mapping[str, Any], status: str
) -> dict[str, Any]:
    """Return everything that the run came to, in plain types."""
    from kinetile.kernel.log import ANSWER
    from kinetile.records.versions import versions

    reached = {"time": simulation.time, "time_unit": simulation.time_unit, "status": status}
    return {
        "versions": versions(),
        "answer": ANSWER,
        "scene": scene_summary(simulation.scene),
        "broad_phase": simulation.broad_phase,
        "options": dict(simulation.options),
        "narrow_phases": narrow_phases(simulation),
        "run": {**asked, **reached},
        "readings": simulation.readings.as_dict(),
        "events_file": recorder
        and {"path": str(recorder.path), "rows": recorder.rows, "status": recorder.status},
    }


def _print(found: Mapping[str, Any], json: bool, course: Course | None) -> None:
    if json:
        typer.echo(as_json(dict(found)))
        return
    from kinetile.cli.tables import LABEL, columns, run_table, show

    drawn = [] if course is None else course.lines(columns() - LABEL, sys.stdout.encoding)
    show(run_table(found, drawn))


def narrow_phases(simulation: Simulation) -> dict[str, dict[str, Any]]:
    """Return the narrow phases of a simulation with their options."""
    return {name: dict(options) for name, options in simulation.composition.narrow_phases.items()}
