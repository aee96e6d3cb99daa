"""The command ``kinetile run``: a scene, its phases, a result."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Sequence
from contextlib import ExitStack
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from kinetile.cli.terminal import FAULT, FAULTS, Bar, exit_codes, make_ready, notice
from kinetile.cli.values import find_scene
from kinetile.errors import BadOption, KinetileError
from kinetile.plugin.choices import read_assignments, read_phase
from kinetile.run.interrupts import Interrupts

if TYPE_CHECKING:
    from kinetile.records.events import EventRecorder
    from kinetile.run.simulation import Progress, Simulation
    from kinetile.scene import Scene

__all__ = ["Wish", "as_json", "narrow_choice", "run", "scene_summary", "until_or_default"]


class Wish(NamedTuple):
    """What was asked for on the command line of ``kinetile run``."""

    scene: str
    parameters: Sequence[str] = ()
    broad_phase: str | None = None
    options: Sequence[str] = ()
    narrow_phases: Sequence[str] = ()
    until: float | None = None
    max_contacts: int | None = None
    events: Path | None = None
    save_scene: Path | None = None
    json: bool = False
    explain: bool = False
    audit: int | None = None


class _Ending(NamedTuple):
    """How a run ended: in a word, and with which exit code."""

    status: str
    code: int = 0
    message: str = ""


def run(wish: Wish) -> None:
    """Do what was asked for; raises typer.Exit with the exit code unless that is 0."""
    with exit_codes():
        _check_files(wish)
        scene = find_scene(wish.scene, wish.parameters)
        simulation = _compose(scene, wish)
        if wish.save_scene is not None:
            _save(simulation, wish)
        if wish.explain:
            _explain(simulation, wish.json)
            return
        until = until_or_default(scene, wish.until, wish.max_contacts)
        recorder = _recorder(simulation, wish, until)
        ending = _carry_out(simulation, recorder, wish, until)
        _print(simulation, recorder, wish, until, ending.status)
    if ending.code:
        notice(f"kinetile: {ending.message}")
        raise typer.Exit(ending.code)


def until_or_default(scene: Scene, until: float | None, max_contacts: int | None) -> float | None:
    """Return the time to run to: as asked for, or the scene's own, or one unit; None for contacts alone.

    With ``max_contacts`` the scene's own end holds as well: whichever comes first.
    """
    if until is not None:
        if not scene.start <= until < float("inf"):
            raise BadOption(
                f"--until is {until!r}; expected a time from the scene's start on, {scene.start!r}"
            )
        return until
    if scene.settings.until is not None or max_contacts is not None:
        return scene.settings.until  # which ends a run of so many contacts too, as in Simulation.run
    return scene.start + 1.0


def narrow_choice(texts: Sequence[str]) -> dict[str, dict[str, Any]] | None:
    """Return the narrow phases of ``--narrow-phase``, each with its options; None where none is named."""
    return dict(map(read_phase, texts)) or None


def scene_summary(scene: Scene) -> dict[str, Any]:
    """Return where a scene comes from and how large it is, in plain types."""
    return {
        "file": scene.origin.get("file"),
        "recipe": scene.origin.get("recipe"),
        "parameters": dict(scene.origin.get("parameters", {})),
        "bodies": len(scene),
        "arena": scene.arena and list(scene.arena),
        "start": scene.start,
        "turns": len(scene.turns),
    }


def as_json(result: Any) -> str:
    """Return a result as JSON text; JSON has no numbers that are not finite: they become null."""
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(value) if abs(value) < float("inf") else None
    return value if value is None or isinstance(value, str | int) else str(value)


def _check_files(wish: Wish) -> None:
    """Raise BadOption unless the files of the command line are different ones."""
    files = {"--events": wish.events, "--save-scene": wish.save_scene}
    if wish.scene.lower().endswith(".toml"):
        files["the scene"] = Path(wish.scene)
    given = [(what, Path(path)) for what, path in files.items() if path is not None]
    for (one, path), (other, its_path) in combinations(given, 2):
        if "--events" in (one, other) and _same_file(path, its_path):
            raise BadOption(f"{one} and {other} are one file, {path}: expected two, for one would be lost")


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:  # one of them is not there yet
        return os.path.realpath(one) == os.path.realpath(other)


def _save(simulation: Simulation, wish: Wish) -> None:
    """Save the scene with the phases and the end that were asked for: running the file runs this again."""
    from kinetile.scene import Settings, relabelled
    from kinetile.scene.files import save_scene

    scene, settings = simulation.scene, simulation.scene.settings
    options = {name: dict(given) for name, given in settings.options.items()}
    if wish.broad_phase is not None or wish.options:
        options[simulation.broad_phase] = dict(simulation.options)
    if wish.narrow_phases:
        options |= _narrow_phases(simulation)
    chosen = Settings(
        simulation.broad_phase if wish.broad_phase is not None or wish.options else settings.broad_phase,
        simulation.narrow_phases if wish.narrow_phases else settings.narrow_phases,
        {name: given for name, given in options.items() if given},
        settings.until if wish.until is None else wish.until,
    )
    try:
        save_scene(relabelled(scene, settings=chosen), wish.save_scene or "")
    except OSError as error:
        raise BadOption(f"--save-scene {wish.save_scene}: {error.strerror}") from error


def _compose(scene: Scene, wish: Wish) -> Simulation:
    from kinetile.run.simulation import Simulation

    name, options = (None, {}) if wish.broad_phase is None else read_phase(wish.broad_phase)
    options |= read_assignments(wish.options, "--option")
    return Simulation(
        scene,
        name,
        options=options or None,
        narrow_phases=narrow_choice(wish.narrow_phases),
        keep_contacts=False,
        audit=wish.audit,
    )


def _explain(simulation: Simulation, as_data: bool) -> None:
    if as_data:
        typer.echo(as_json(simulation.explain()))
        return
    from kinetile.cli.explanation import explanation_lines

    typer.echo("\n".join(explanation_lines(simulation.explain())))


def _recorder(simulation: Simulation, wish: Wish, until: float | None) -> EventRecorder | None:
    if wish.events is None:
        return None
    from kinetile.records.events import EventRecorder

    return EventRecorder(
        wish.events,
        simulation.scene,
        {
            "broad_phase": simulation.broad_phase,
            "options": dict(simulation.options),
            "narrow_phases": _narrow_phases(simulation),
            "time_unit": simulation.time_unit,
            "until": until,
            "max_contacts": wish.max_contacts,
        },
    )


def _carry_out(
    simulation: Simulation, recorder: EventRecorder | None, wish: Wish, until: float | None
) -> _Ending:
    """Run, and close the events file whatever happens."""
    with ExitStack() as stack:
        if recorder is not None:
            try:
                stack.enter_context(recorder)
            except KinetileError as error:
                raise BadOption(str(error)) from error
        terminated = Interrupts(signal.SIGTERM)
        try:
            with stack, terminated, Bar("running", simulation.scene.start, wish.max_contacts) as bar:

                def progress(state: Progress) -> None:
                    bar(state)
                    terminated.check()

                try:
                    make_ready(simulation)
                    simulation.run(
                        until, max_contacts=wish.max_contacts, progress=progress, recorder=recorder
                    )
                finally:
                    if recorder is not None:
                        recorder.meta |= {"time": simulation.time, "fingerprint": simulation.fingerprint}
        except KeyboardInterrupt:
            number = terminated.received or signal.SIGINT
            return _Ending("interrupted", 128 + number, f"interrupted at time {simulation.time:.10g}")
        except FAULTS as error:
            return _Ending(f"fault: {type(error).__name__}", FAULT, str(error))
    return _Ending("complete")


def _print(
    simulation: Simulation, recorder: EventRecorder | None, wish: Wish, until: float | None, status: str
) -> None:
    from kinetile.records.versions import versions

    result = {
        "versions": versions(),
        "scene": scene_summary(simulation.scene),
        "broad_phase": simulation.broad_phase,
        "options": dict(simulation.options),
        "narrow_phases": _narrow_phases(simulation),
        "run": {
            "until": until,
            "max_contacts": wish.max_contacts,
            "time": simulation.time,
            "time_unit": simulation.time_unit,
            "status": status,
        },
        "readings": simulation.readings.as_dict(),
        "events_file": recorder
        and {"path": str(recorder.path), "rows": recorder.rows, "status": recorder.status},
    }
    if wish.json:
        typer.echo(as_json(result))
        return
    from kinetile.cli.tables import run_table, show

    show(run_table(result))


def _narrow_phases(simulation: Simulation) -> dict[str, dict[str, Any]]:
    return {name: dict(options) for name, options in simulation.composition.narrow_phases.items()}
