"""The command ``kinetile bench scene``, or ``kinetile bench FILE.toml``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from kinetile.cli.json_output import printed, scene_summary
from kinetile.cli.options import (
    Csv,
    Json,
    MaxContacts,
    NarrowPhases,
    Parameters,
    Phases,
    Repeats,
    SceneName,
    Seconds,
    Until,
    find_scene,
    narrow_choice,
    some_phases,
    until_or_default,
)
from kinetile.cli.terminal import DIFFERENT, Bar, exit_codes, make_ready

if TYPE_CHECKING:
    from kinetile_bench.own.scene import SceneBench

__all__ = ["scene"]


def scene(
    scene: SceneName,
    parameters: Parameters = None,
    phases: Phases = None,
    narrow_phase: NarrowPhases = None,
    until: Until = None,
    max_contacts: MaxContacts = None,
    seconds: Seconds = 0.0,
    repeats: Repeats = 3,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure the broad phases on a scene of your own: `kinetile bench trace.toml` does.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile_bench.own.scene import bench_scene

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
            seconds=seconds,
            start=lambda label, simulation: make_ready(simulation),
            progress=bar.count,
        )
    _print(measured, scene_summary(this_scene), json, csv)
    if not measured.identical:
        raise typer.Exit(DIFFERENT)


def _print(measured: SceneBench, summary: dict[str, Any], json: bool, csv: bool) -> None:
    result = {"scene": summary} | measured.as_dict()
    if printed(result, result["rows"], json=json, csv=csv):
        return
    from kinetile.cli.tables import show
    from kinetile_bench.cli.play_tables import scene_notes, scene_table

    show(scene_table(measured), *scene_notes(measured))
