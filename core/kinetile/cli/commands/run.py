"""The command ``kinetile run``: a scene, its phases, a result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.checkpoints import Checkpoint, Every, check_checkpoint, only_writer
from kinetile.cli.json_output import as_json
from kinetile.cli.options import (
    Json,
    MaxContacts,
    NarrowPhases,
    Parameters,
    Plain,
    SceneName,
    Until,
    find_scene,
    narrow_choice,
    until_or_default,
)
from kinetile.cli.running import carry_out, check_files, course_of, finish, leave, narrow_phases
from kinetile.cli.terminal import exit_codes
from kinetile.errors import BadOption, RecordError
from kinetile.plugin.choices import read_assignments, read_phase

if TYPE_CHECKING:
    from kinetile.records.events import EventRecorder
    from kinetile.run.simulation import Simulation
    from kinetile.scene import Scene, Settings

__all__ = ["run"]


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
    checkpoint: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Save the run to a file now and then, for `kinetile resume`."),
    ] = None,
    every: Every = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the files of the options that name one.")
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
    plain: Plain = False,
    json: Json = False,
) -> None:
    """Run a scene and print what happened."""
    with exit_codes(), only_writer(checkpoint):
        from kinetile.run.engine.digest import stoppable

        written = {"--events": events, "--contacts": contacts, "--checkpoint": checkpoint}
        source = Path(scene) if scene.lower().endswith(".toml") else None
        check_files({**written, "--save-scene": save_scene, "the scene": source}, overwrite)
        check_checkpoint(checkpoint, every, overwrite)
        this_scene = find_scene(scene, parameters)
        name, options = (None, {}) if broad_phase is None else read_phase(broad_phase)
        options |= read_assignments(option or (), "--option")
        keep = contacts is not None or (checkpoint is not None and not stoppable())
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
        saves = None
        if checkpoint is not None:
            saves = Checkpoint(simulation, recorder, checkpoint, every, asked)
        course = course_of(simulation, plain, json, audit is not None)
        ending = carry_out(simulation, recorder, end, max_contacts, saves, course)
        ending = finish(simulation, recorder, asked, ending, contacts, json, course)
    leave(ending)


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
        options |= narrow_phases(simulation)
    return Settings(
        simulation.broad_phase if broad else settings.broad_phase,
        simulation.narrow_phases if narrow else settings.narrow_phases,
        {name: given for name, given in options.items() if given},
        settings.until if until is None else until,
    )


def _save(scene: Scene, path: Path, settings: Settings) -> None:
    """Save a scene with other settings."""
    from kinetile.scene import relabelled
    from kinetile.scene.text.files import save_scene

    try:
        save_scene(relabelled(scene, settings=settings), path)
    except OSError as error:
        raise BadOption(f"--save-scene {path}: {error.strerror}") from error


def _explain(simulation: Simulation, json: bool) -> None:
    from kinetile.run.readings.explanation import explanation_lines

    found = simulation.explain()
    typer.echo(as_json(found) if json else "\n".join(explanation_lines(found)))


def _recorder(simulation: Simulation, events: Path, overwrite: bool, asked: dict[str, Any]) -> EventRecorder:
    from kinetile.records.events import EventRecorder

    chosen = {
        "broad_phase": simulation.broad_phase,
        "options": dict(simulation.options),
        "narrow_phases": narrow_phases(simulation),
    }
    try:
        return EventRecorder(events, simulation.scene, chosen | asked, overwrite=overwrite)
    except RecordError as error:
        raise BadOption(f"--events: {error}") from error
