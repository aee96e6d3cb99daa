"""The command ``kinetile bench scene``, or ``kinetile bench FILE.toml``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

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
    some_phases,
    until_or_default,
)
from kinetile.cli.terminal import DIFFERENT, Bar, exit_codes, make_ready

if TYPE_CHECKING:
    from kinetile.bench.own.scene import SceneBench

__all__ = ["scene"]


def scene(
    scene: SceneName,
    parameters: Parameters = None,
    phases: Annotated[
        str | None, typer.Option(metavar="A,B,...", help="Broad phases; all that are installed.")
    ] = None,
    narrow_phase: NarrowPhases = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each phase.")] = 3,
    json: Json = False,
) -> None:
    """Measure the broad phases on a scene of your own: `kinetile bench trace.toml` does.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile.bench.own.scene import bench_scene

    with exit_codes(), Bar("measuring") as bar:
        chosen = None if phases is None else some_phases(phases)
        this_scene = find_scene(scene, parameters)
        measured = bench_scene(
            this_scene,
            chosen,
            until_or_default(this_scene, until, max_contacts),
            max_contacts=max_contacts,
            narrow_phases=narrow_choice(narrow_phase),
            repeats=repeats,
            start=lambda label, simulation: make_ready(simulation),
            progress=bar.count,
        )
    _print(measured, scene_summary(this_scene), json)
    if not measured.identical:
        raise typer.Exit(DIFFERENT)


def _print(measured: SceneBench, summary: dict[str, Any], json: bool) -> None:
    if json:
        typer.echo(as_json({"scene": summary} | measured.as_dict()))
        return
    from kinetile.cli.play_tables import scene_notes, scene_table
    from kinetile.cli.tables import show

    show(scene_table(measured), *scene_notes(measured))
