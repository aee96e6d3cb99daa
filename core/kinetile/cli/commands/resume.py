"""The command ``kinetile resume``: a run goes on from its checkpoint."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.checkpoints import Checkpoint, Every, only_writer
from kinetile.cli.options import Json, Plain
from kinetile.cli.running import carry_out, check_files, course_of, finish, leave, narrow_phases
from kinetile.cli.terminal import exit_codes, notice
from kinetile.errors import BadOption, RecordError
from kinetile.plugin.choices import read_phase

if TYPE_CHECKING:
    from kinetile.records.events import EventRecorder
    from kinetile.run.simulation import Simulation

__all__ = ["resume"]


def resume(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What `run --checkpoint FILE` has saved.")],
    until: Annotated[float | None, typer.Option(help="Run until this time, instead of as was asked.")] = None,
    max_contacts: Annotated[
        int | None, typer.Option(min=0, help="Stop after so many more contacts, instead of as was asked.")
    ] = None,
    broad_phase: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Go on under this broad phase, with a structure built anew."),
    ] = None,
    events: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Write every event to this file; as was asked, where nothing is said."
        ),
    ] = None,
    contacts: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write all contacts to a new text file, if the run kept them."),
    ] = None,
    checkpoint: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Save to another file from here on.")
    ] = None,
    every: Every = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file of --contacts.")] = False,
    plain: Plain = False,
    json: Json = False,
) -> None:
    """Go on with a run from its checkpoint, and go on saving it there."""
    with exit_codes(), only_writer(checkpoint or file):
        try:
            simulation, note = _take_up(file, broad_phase)
        except RecordError as error:
            raise BadOption(str(error)) from error
        if contacts is not None and not simulation.keeps_contacts:
            raise BadOption(
                "--contacts: this run keeps no contacts: expected `kinetile run --contacts` before"
            )
        events = events or _path(note.get("events"))
        check_files(
            {"--events": events, "--contacts": contacts, "--checkpoint": checkpoint or file}, overwrite
        )
        asked = _asked(simulation, note, until, max_contacts)
        recorder = None if events is None else _recorder(simulation, events, asked)
        saves = Checkpoint(simulation, recorder, checkpoint or file, every or note.get("every"), asked)
        read = simulation.readings
        more = asked["max_contacts"]
        if more is not None:
            more = max(more - read.contacts_disc - read.contacts_wall, 0)
        course = course_of(simulation, plain, json, read.audits > 0)
        ending = carry_out(simulation, recorder, asked["until"], more, saves, course)
        ending = finish(simulation, recorder, asked, ending, contacts, json, course)
    leave(ending)


def _take_up(file: Path, broad_phase: str | None) -> tuple[Simulation, dict[str, Any]]:
    from kinetile.run.saving.form import note
    from kinetile.run.saving.resuming import resume
    from kinetile.run.saving.whole_file import read_whole

    name, options = (None, None) if broad_phase is None else read_phase(broad_phase)
    return resume(file, name, options=options), note(read_whole(file), str(file))


def _path(said: Any) -> Path | None:
    return Path(said) if isinstance(said, str) else None


def _asked(
    simulation: Simulation, note: dict[str, Any], until: float | None, max_contacts: int | None
) -> dict[str, Any]:
    """Return the end of the run, ``max_contacts`` counted from the start: as is asked now, else as it was."""
    read = simulation.readings
    done = read.contacts_disc + read.contacts_wall
    if until is not None and until < simulation.time:
        raise BadOption(f"--until is {until!r}, and the checkpoint is of time {simulation.time!r}")
    if until is not None or max_contacts is not None:
        return {"until": until, "max_contacts": None if max_contacts is None else done + max_contacts}
    end = {"until": note.get("until"), "max_contacts": note.get("max_contacts")}
    if end == {"until": None, "max_contacts": None}:
        end["until"] = simulation.scene.settings.until
    if end == {"until": None, "max_contacts": None}:
        raise BadOption(
            "this checkpoint does not say how far the run is to go: expected --until, or --max-contacts"
        )
    return end


def _recorder(simulation: Simulation, events: Path, asked: dict[str, Any]) -> EventRecorder:
    """Return a recorder that goes on with what the run has recorded so far, where that is there."""
    from kinetile.records.events import EventRecorder

    chosen = {
        "broad_phase": simulation.broad_phase,
        "options": dict(simulation.options),
        "narrow_phases": narrow_phases(simulation),
    }
    try:
        recorder = EventRecorder(events, simulation.scene, chosen | asked, behind=simulation)
    except RecordError as error:
        raise BadOption(f"--events: {error}") from error
    if simulation.rows and not recorder.goes_on:
        notice(
            f"kinetile: nothing of this run is in {events} yet: it will hold the events from time "
            f"{simulation.time:.10g} on, and say that {simulation.rows:,} are missing"
        )
    return recorder
