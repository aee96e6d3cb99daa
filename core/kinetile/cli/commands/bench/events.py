"""The command ``kinetile bench events``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.commands.bench.measuring import Out, measured, rows_in
from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, phase_choices, read_numbers
from kinetile.cli.terminal import exit_codes

if TYPE_CHECKING:
    from kinetile.bench.events import Bench

__all__ = ["events"]


def events(
    phases: Annotated[
        str | None, typer.Option(metavar="A,B,...", help="Broad phases; all that are installed.")
    ] = None,
    bodies: Annotated[str, typer.Option(metavar="N,...", help="Numbers of discs.")] = "25,100,400",
    densities: Annotated[str, typer.Option(metavar="D,...", help="Area fractions.")] = "0.5,0.25,0.125,0.01",
    seconds: Annotated[float, typer.Option(min=0.001, help="CPU seconds of one run, about.")] = 0.5,
    repeats: Annotated[int, typer.Option(min=1, help="Runs of each phase on each scene.")] = 5,
    out: Out = None,
    json: Json = False,
) -> None:
    """Measure events a CPU second of each broad phase on the thesis's twelve scenes."""
    from kinetile.bench.events import events_study, read_events

    with exit_codes():
        chosen = None if phases is None else phase_choices(phases)
        sizes = read_numbers(bodies, int, "--bodies")
        fractions = read_numbers(densities, float, "--densities")
        with rows_in(out) as results:
            study = events_study(results, chosen, sizes, fractions, seconds=seconds, repeats=repeats)
            with measured(study):
                found = read_events(study)
                if found.rows:
                    _print(found, json)


def _print(bench: Bench, json: bool) -> None:
    if json:
        typer.echo(as_json(bench.as_dict()))
        return
    from kinetile.cli.bench_tables import rates_table
    from kinetile.cli.tables import show

    where = bench.conditions
    show(
        rates_table(bench),
        f"{where['processor']}; medians of {where['repeats']} runs of about {where['seconds']:g} CPU s each",
    )
