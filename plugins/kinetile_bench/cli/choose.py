"""The command ``kinetile choose``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from kinetile.cli.json_output import printed, scene_summary
from kinetile.cli.options import (
    Csv,
    Json,
    Parameters,
    Phases,
    Repeats,
    SceneName,
    Seconds,
    Until,
    find_scene,
    some_phases,
)
from kinetile.cli.terminal import DIFFERENT, Bar, exit_codes, make_ready

if TYPE_CHECKING:
    from kinetile_bench.own.choose import Chosen

__all__ = ["choose"]


def choose(
    scene: SceneName,
    parameters: Parameters = None,
    phases: Phases = None,
    until: Until = None,
    seconds: Seconds = 0.1,
    repeats: Repeats = 5,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Try the broad phases on a scene for some thousands of contacts each, and recommend one.

    Exit code 1 unless all phases give the same contacts.
    """
    from kinetile_bench.own.choose import choose as tried

    with exit_codes(), Bar("measuring") as bar:
        chosen = None if phases is None else some_phases(phases)
        this_scene = find_scene(scene, parameters)
        found = tried(
            this_scene,
            chosen,
            until=until,
            seconds=seconds,
            repeats=repeats,
            start=lambda label, simulation: make_ready(simulation),
            progress=bar.count,
        )
    _print(found, scene_summary(this_scene), json, csv)
    if not found.identical:
        raise typer.Exit(DIFFERENT)


def _print(found: Chosen, summary: dict[str, Any], json: bool, csv: bool) -> None:
    result = {"scene": summary} | found.as_dict()
    if printed(result, result["candidates"], json=json, csv=csv):
        return
    from kinetile.cli.tables import show
    from kinetile_bench.cli.play_tables import choice_notes, choice_table

    show(choice_table(found), *choice_notes(found))
