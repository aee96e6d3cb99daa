"""The commands that run: ``kinetile run``, ``resume`` (from a checkpoint) and ``recover`` (after a kill)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from kinetile.cli import options as cli
from kinetile.cli import runner
from kinetile.cli.files import PARQUET, check_ending, check_files, file_errors
from kinetile.cli.observed import Observe, ObserveTo, read_observables
from kinetile.cli.output import as_json, printed
from kinetile.cli.terminal import echo, notice
from kinetile.errors import BadOption
from kinetile.plugin.choices import read_phase

if TYPE_CHECKING:
    from kinetile.records.recorder import EventRecorder
    from kinetile.run.simulation import Simulation
    from kinetile.scene import Settings

Every = Annotated[
    float | None, cli.option(f"Seconds between two checkpoints; {runner.EVERY:g}.", "SECONDS", least=0)
]


def run(
    scene: cli.SceneName = "grid",
    parameters: cli.Parameters = None,
    broad_phase: cli.BroadPhase = None,
    option: cli.Options = None,
    narrow_phase: cli.NarrowPhases = None,
    until: cli.Until = None,
    max_contacts: cli.MaxContacts = None,
    events: Annotated[Path | None, cli.option("Write every event to a new file, .parquet.", "FILE")] = None,
    contacts: Annotated[
        Path | None, cli.option("Write the contacts, epoch tick a b, to a new file; -: to stdout.", "FILE|-")
    ] = None,
    encounters: Annotated[
        Path | None,
        cli.option("Write each encounter, its bodies, times and distance, to a new file, .csv.", "FILE"),
    ] = None,
    checkpoint: Annotated[
        Path | None, cli.option("Save the run regularly to a file, for `kinetile resume`.", "FILE")
    ] = None,
    every: Every = None,
    observe: Observe = None,
    observe_to: ObserveTo = None,
    overwrite: Annotated[bool, cli.flag("Replace the files that the options name.", "--overwrite")] = False,
    save_scene: Annotated[
        Path | None, cli.option("Save the scene with these phases and this end as a TOML file.", "FILE")
    ] = None,
    explain: Annotated[
        bool, cli.flag("Print the modelled and the omitted parts; run nothing.", "--explain")
    ] = False,
    audit: Annotated[
        int | None, cli.option("Check all invariants every N contacts (slow).", "N", least=1)
    ] = None,
    compiled: cli.Compiled = None,
    verbose: cli.Verbose = False,
    json: cli.Json = False,
    csv: cli.Csv = False,
    quiet: cli.Quiet = False,
) -> None:
    """Runs a scene and prints the result.

    For example: kinetile run grid -s bodies=100 --until 2
    """
    with runner.only_writer(checkpoint):
        from kinetile.run.simulation import Simulation

        on_stdout = contacts == Path("-")
        if on_stdout and (json or csv or explain):
            raise BadOption("--contacts - prints contacts alone: no --json, --csv, --explain beside it")
        written = {"--events": events, "--contacts": None if on_stdout else contacts}
        written |= {"--checkpoint": checkpoint, "--encounters": encounters}
        if encounters is not None and checkpoint is not None:
            raise BadOption(
                "--encounters is of one whole run, but a checkpoint is continued by another one: expected "
                "--events in its place, and in the end kinetile.encounters(kinetile.Trajectory.read(FILE))"
            )
        source = Path(scene) if scene.lower().endswith(".toml") else None
        check_files({**written, "--save-scene": save_scene, "the scene": source}, overwrite)
        wanted = read_observables(observe, observe_to, overwrite, saved=checkpoint is not None)
        runner.check_checkpoint(checkpoint, every, overwrite)
        this_scene = cli.find_scene(scene, parameters)
        name, options = cli.broad_choice(broad_phase, option)
        simulation = Simulation(
            this_scene,
            name,
            options=options or None,
            narrow_phases=cli.narrow_choice(narrow_phase),
            keep_contacts=contacts is not None,
            audit=audit,
        )
        end = cli.until_or_default(this_scene, until, max_contacts)
        requested = {"until": end, "max_contacts": max_contacts}
        recorder = None
        if events is not None and not explain:
            recorder = _recorder(simulation, events, requested, overwrite=overwrite)
        if save_scene is not None:
            from kinetile.scene import relabelled
            from kinetile.scene.files import save_scene as save

            settings = _settings(simulation, bool(name or options), bool(narrow_phase), until)
            with file_errors(f"--save-scene {save_scene}"):
                save(relabelled(this_scene, settings=settings), save_scene)
        if explain:
            from kinetile.explanation import explanation_lines

            found = simulation.explain()
            if not printed(found, [found], json=json, csv=csv):
                echo("\n".join(explanation_lines(found)))
            return
        chosen = [simulation.broad_phase, *simulation.narrow_phases]
        if idle := [each for each in this_scene.settings.options if each not in chosen]:
            notice(f"kinetile: options of {', '.join(idle)} are not used: the phases are {', '.join(chosen)}")
        saves = None
        if checkpoint is not None:
            note = {**requested, "observe": wanted}
            saves = runner.Checkpoint(simulation, recorder, checkpoint, every, note)
        runner.run_to_end(
            simulation,
            requested,
            max_contacts,
            recorder=recorder,
            checkpoint=saves,
            contacts=contacts,
            encounters=encounters,
            verbose=verbose,
            prints=lambda it: on_stdout or quiet or printed(it, [it], json=json, csv=csv),
            observe=wanted,
            observe_to=observe_to,
        )


def resume(
    file: Annotated[Path, cli.argument("The file of `run --checkpoint FILE`.", "FILE")],
    until: Annotated[
        float | None, cli.option("Run until this time, instead of the original end.", "TIME")
    ] = None,
    max_contacts: Annotated[
        int | None,
        cli.option("Stop after this number of further contacts, instead of the original end.", "N", least=0),
    ] = None,
    broad_phase: Annotated[str | None, cli.option("Continue under this broad phase.", "NAME")] = None,
    events: Annotated[
        Path | None, cli.option("Write every event to this file, instead of the one before.", "FILE")
    ] = None,
    every: Every = None,
    observe: Observe = None,
    observe_to: ObserveTo = None,
    compiled: cli.Compiled = None,
    verbose: cli.Verbose = False,
    json: cli.Json = False,
    csv: cli.Csv = False,
    quiet: cli.Quiet = False,
) -> None:
    """Continues a run from its checkpoint, and saves it there again.

    The run's observables continue; --observe with other observables begins these now, instead.

    For example: kinetile resume run.checkpoint --until 10
    """
    from kinetile.run.saving.files import note as note_of
    from kinetile.run.saving.files import read_whole
    from kinetile.run.simulation import resume as resumed

    with runner.only_writer(file):
        name, options = (None, None) if broad_phase is None else read_phase(broad_phase)
        with file_errors():
            simulation = resumed(file, name, options=options)
            note = note_of(read_whole(file), str(file))
        if events is None and isinstance(note.get("events"), str):
            events = Path(note["events"])
        check_files({"--events": events, "the checkpoint": file}, overwrite=False)
        done = simulation.readings.contacts
        requested = _requested_end(simulation, note, done, until, max_contacts)
        recorder = None if events is None else _resumed_recorder(simulation, events, requested)
        wanted = note.get("observe")
        before = wanted if isinstance(wanted, list) and all(isinstance(x, str) for x in wanted) else []
        begun = read_observables(observe or ",".join(before) or None, observe_to, False, saved=True)
        goes_on = begun == before and bool(before and simulation.observed)
        if not goes_on and (done if begun else simulation.observed):
            what = ", ".join(begun) or "nothing"
            notice(f"kinetile: {what} is observed from time {simulation.time:.10g} on, not before")
        kept = {**requested, "observe": begun}
        saves = runner.Checkpoint(simulation, recorder, file, every or note.get("every"), kept)
        most = requested["max_contacts"]
        further = None if most is None else max(most - done, 0)
        runner.run_to_end(
            simulation,
            requested,
            further,
            recorder=recorder,
            checkpoint=saves,
            verbose=verbose,
            prints=lambda it: quiet or printed(it, [it], json=json, csv=csv),
            observe=simulation.observed if goes_on else begun,
            observe_to=observe_to,
        )


def recover(
    partial: Annotated[Path, cli.argument("The partial file of a run with --events FILE.", "FILE.partial")],
    out: Annotated[
        Path | None, cli.option("The new event file; without it FILE, and FILE.partial is removed.", "FILE")
    ] = None,
    overwrite: Annotated[bool, cli.flag("Replace an event file that exists.", "--overwrite")] = False,
    json: cli.Json = False,
) -> None:
    """Makes an event file from the partial file of a killed run.

    For example: kinetile recover run.parquet.partial
    """
    from kinetile.records.finishing import recover as make

    if out is not None:
        check_ending("--out", out, PARQUET)
    with file_errors():
        made = make(partial, out, overwrite=overwrite)
    if made.left_over:
        notice(
            f"kinetile: the last {made.left_over:,} bytes of {partial} are no whole batch of rows: a write "
            "that was cut off, or damage; they are not in the event file"
        )
    if json:
        echo(as_json(made._asdict()))
        return
    echo(f"{made.path}: {made.rows:,} events, to time {made.time:.10g} ({made.status})")
    if made.kept:
        echo(f"{partial} is still there")


def _settings(simulation: Simulation, broad: bool, narrow: bool, until: float | None) -> Settings:
    from kinetile.run.simulation import composition_of

    settings = simulation.scene.settings
    options = {**settings.options}
    if broad:
        options[simulation.broad_phase] = simulation.options
        settings = replace(settings, broad_phase=simulation.broad_phase)
    if narrow:
        options |= composition_of(simulation).narrow_phases
        settings = replace(settings, narrow_phases=simulation.narrow_phases)
    options = {name: dict(given) for name, given in options.items() if given}
    until = settings.until if until is None else until
    return replace(settings, options=options, until=until, end=None)


def _recorder(
    simulation: Simulation, events: Path, requested: dict[str, Any], **options: Any
) -> EventRecorder:
    from kinetile.records.recorder import EventRecorder

    with file_errors("--events"):
        return EventRecorder(events, simulation.scene, runner.phases_of(simulation) | requested, **options)


def _resumed_recorder(simulation: Simulation, events: Path, requested: dict[str, Any]) -> EventRecorder:
    """Returns a recorder that continues the event file of the run, if that exists."""
    recorder = _recorder(simulation, events, requested, behind=simulation)
    if simulation.rows and not recorder.goes_on:
        notice(
            f"kinetile: nothing of this run is in {events} yet: it will hold the events from time "
            f"{simulation.time:.10g} on, and say that {simulation.rows:,} are missing"
        )
    return recorder


def _requested_end(
    simulation: Simulation, note: dict[str, Any], done: int, until: float | None, max_contacts: int | None
) -> dict[str, Any]:
    """Returns the end of a resumed run: the new one, the one before, or the scene's. ``max_contacts`` is
    counted from the start of the run, with its ``done`` contacts so far."""
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
