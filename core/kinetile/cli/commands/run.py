"""The command ``kinetile run``: a scene, its phases, a result."""

from __future__ import annotations

import os
import signal
from contextlib import ExitStack
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from kinetile.cli.json_output import as_json, scene_summary
from kinetile.cli.options import (
    Json,
    MaxContacts,
    NarrowPhases,
    Parameters,
    SceneName,
    Until,
    find_scene,
    narrow_choice,
    until_or_default,
)
from kinetile.cli.terminal import FAULT, FAULTS, Bar, FirstSignal, exit_codes, make_ready, notice
from kinetile.errors import BadOption, RecordError
from kinetile.plugin.choices import read_assignments, read_phase

if TYPE_CHECKING:
    from kinetile.records.events import EventRecorder
    from kinetile.run.simulation import Progress, Simulation
    from kinetile.scene import Scene, Settings

__all__ = ["run"]


class _Ending(NamedTuple):
    """How a run ended: in a word, and with which exit code."""

    status: str
    code: int = 0
    message: str = ""


def run(
    scene: SceneName = "grid",
    parameters: Parameters = None,
    broad_phase: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="The broad phase, with options if need be: sap-1d:axis=y."),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option("--option", "-o", metavar="KEY=VALUE", help="An option of the broad phase."),
    ] = None,
    narrow_phase: NarrowPhases = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    events: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write every event to a new Parquet file.")
    ] = None,
    contacts: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the contacts to a new text file: epoch tick a b a line."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the files of --events and --contacts.")
    ] = False,
    save_scene: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Save the scene, with what is chosen here, as a TOML file."),
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Say what is modelled and what is left out, and run nothing.")
    ] = False,
    audit: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Check all that must hold, every N contacts (slow)."),
    ] = None,
    json: Json = False,
) -> None:
    """Run a scene and print what happened."""
    with exit_codes():
        _check_files(scene, events, contacts, save_scene, overwrite)
        this_scene = find_scene(scene, parameters)
        name, options = (None, {}) if broad_phase is None else read_phase(broad_phase)
        options |= read_assignments(option or (), "--option")
        keep = contacts is not None
        simulation = _compose(this_scene, name, options, narrow_choice(narrow_phase), audit, keep)
        end = until_or_default(this_scene, until, max_contacts)
        asked = {"until": end, "max_contacts": max_contacts}
        recorder = None if events is None or explain else _recorder(simulation, events, overwrite, asked)
        if save_scene is not None:
            _save(
                this_scene,
                save_scene,
                _settings(simulation, bool(name or options), bool(narrow_phase), until),
            )
        if explain:
            _explain(simulation, json)
            return
        ending = _carry_out(simulation, recorder, end, max_contacts)
        if contacts is not None:
            ending = _write_contacts(simulation, contacts, ending)
        _print(_result(simulation, recorder, asked, ending.status), json)
    if ending.code:
        notice(f"kinetile: {ending.message}")
        raise typer.Exit(ending.code)


def _check_files(
    scene: str, events: Path | None, contacts: Path | None, save_scene: Path | None, overwrite: bool
) -> None:
    """Raise BadOption unless the files of the command line have names, are different and may be written."""
    files = {"--events": events, "--contacts": contacts, "--save-scene": save_scene}
    if scene.lower().endswith(".toml"):
        files["the scene"] = Path(scene)
    given = [(what, Path(path)) for what, path in files.items() if path is not None]
    for what, path in given:
        if not path.name:
            raise BadOption(f"{what} names no file: expected the path of a file")
    for (one, path), (other, its_path) in combinations(given, 2):
        if {"--events", "--contacts"} & {one, other} and _same_file(path, its_path):
            raise BadOption(f"{one} and {other} are one file, {path}: expected two, for one would be lost")
    if contacts is not None:
        _check_contacts(contacts, overwrite)


def _check_contacts(path: Path, overwrite: bool) -> None:
    from kinetile.scene.targets import writable_target

    try:
        target = writable_target(path)
    except OSError as error:
        raise BadOption(f"--contacts {path}: {error.strerror}") from error
    if target.exists() and not overwrite:
        raise BadOption(f"--contacts: {path} is there already: choose another name, or say --overwrite")
    if not target.parent.is_dir():
        raise BadOption(f"--contacts {path}: there is no folder {str(target.parent)!r}")


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:  # one of them is not there yet
        return os.path.realpath(one) == os.path.realpath(other)


def _compose(
    scene: Scene,
    broad_phase: str | None,
    options: dict[str, Any],
    narrow_phases: dict[str, dict[str, Any]] | None,
    audit: int | None,
    keep_contacts: bool,
) -> Simulation:
    from kinetile.run.simulation import Simulation

    return Simulation(
        scene,
        broad_phase,
        options=options or None,
        narrow_phases=narrow_phases,
        keep_contacts=keep_contacts,
        audit=audit,
    )


def _settings(simulation: Simulation, broad: bool, narrow: bool, until: float | None) -> Settings:
    """Return the scene's settings, with the broad phase, narrow phases and end that were chosen instead."""
    from kinetile.scene import Settings

    settings = simulation.scene.settings
    options = {name: dict(given) for name, given in settings.options.items()}
    if broad:
        options[simulation.broad_phase] = dict(simulation.options)
    if narrow:
        options |= _narrow_phases(simulation)
    return Settings(
        simulation.broad_phase if broad else settings.broad_phase,
        simulation.narrow_phases if narrow else settings.narrow_phases,
        {name: given for name, given in options.items() if given},
        settings.until if until is None else until,
    )


def _save(scene: Scene, path: Path, settings: Settings) -> None:
    """Save a scene with other settings."""
    from kinetile.scene import relabelled
    from kinetile.scene.files import save_scene

    try:
        save_scene(relabelled(scene, settings=settings), path)
    except OSError as error:
        raise BadOption(f"--save-scene {path}: {error.strerror}") from error


def _explain(simulation: Simulation, json: bool) -> None:
    from kinetile.run.explanation import explanation_lines

    found = simulation.explain()
    typer.echo(as_json(found) if json else "\n".join(explanation_lines(found)))


def _recorder(simulation: Simulation, events: Path, overwrite: bool, asked: dict[str, Any]) -> EventRecorder:
    from kinetile.records.events import EventRecorder

    chosen = {
        "broad_phase": simulation.broad_phase,
        "options": dict(simulation.options),
        "narrow_phases": _narrow_phases(simulation),
    }
    try:
        return EventRecorder(events, simulation.scene, chosen | asked, overwrite=overwrite)
    except RecordError as error:
        raise BadOption(f"--events: {error}") from error


def _write_contacts(simulation: Simulation, path: Path, ending: _Ending) -> _Ending:
    """Write the contacts as text; return how the run ended, or that they could not be written."""
    from kinetile.records.contacts import write_contacts

    try:
        write_contacts(path, simulation.contacts, simulation.fingerprint)
    except OSError as error:
        return _Ending(ending.status, FAULT, f"--contacts {path}: {error.strerror or error}")
    return ending


def _carry_out(
    simulation: Simulation, recorder: EventRecorder | None, until: float | None, max_contacts: int | None
) -> _Ending:
    """Run, and close the events file whatever happens."""
    with FirstSignal() as signals, ExitStack() as stack:
        if recorder is not None:
            try:
                stack.enter_context(recorder)
            except RecordError as error:
                raise BadOption(f"--events: {error}") from error
        try:
            with stack, Bar("running", simulation.scene.start, max_contacts) as bar:

                def progress(state: Progress) -> None:
                    bar(state)
                    signals.check()

                make_ready(simulation)
                simulation.run(until, max_contacts=max_contacts, progress=progress, recorder=recorder)
        except KeyboardInterrupt:
            number = signals.number or signal.SIGINT
            return _Ending("interrupted", 128 + number, f"interrupted at time {simulation.time:.10g}")
        except FAULTS as error:
            return _Ending(f"fault: {type(error).__name__}", FAULT, str(error))
    return _Ending("complete")


def _result(
    simulation: Simulation, recorder: EventRecorder | None, asked: dict[str, Any], status: str
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
        "narrow_phases": _narrow_phases(simulation),
        "run": asked | reached,
        "readings": simulation.readings.as_dict(),
        "events_file": recorder
        and {"path": str(recorder.path), "rows": recorder.rows, "status": recorder.status},
    }


def _print(result: dict[str, Any], json: bool) -> None:
    if json:
        typer.echo(as_json(result))
        return
    from kinetile.cli.tables import run_table, show

    show(run_table(result))


def _narrow_phases(simulation: Simulation) -> dict[str, dict[str, Any]]:
    return {name: dict(options) for name, options in simulation.composition.narrow_phases.items()}
