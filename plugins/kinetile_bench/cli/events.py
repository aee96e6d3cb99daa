"""The command ``kinetile bench events``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.json_output import printed
from kinetile.cli.options import Csv, Json, Phases, Repeats, Seconds, phase_choices, read_numbers
from kinetile.cli.terminal import exit_codes
from kinetile_bench.cli.measuring import Results, measured, rows_in

if TYPE_CHECKING:
    from kinetile_bench.events import Bench

__all__ = ["events"]


def events(
    phases: Phases = None,
    bodies: Annotated[str, typer.Option(metavar="N,...", help="Numbers of discs.")] = "25,100,400",
    densities: Annotated[str, typer.Option(metavar="D,...", help="Area fractions.")] = "0.5,0.25,0.125,0.01",
    seconds: Seconds = 0.5,
    repeats: Repeats = 5,
    results: Results = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure events a CPU second of each broad phase on the thesis's twelve scenes."""
    from kinetile_bench.events import events_study, read_events

    with exit_codes():
        chosen = None if phases is None else phase_choices(phases)
        sizes = read_numbers(bodies, int, "--bodies")
        fractions = read_numbers(densities, float, "--densities")
        with rows_in(results) as folder:
            study = events_study(folder, chosen, sizes, fractions, seconds=seconds, repeats=repeats)
            with measured(study):
                found = read_events(study)
                if found.rows:
                    _print(found, json, csv)


def _print(bench: Bench, json: bool, csv: bool) -> None:
    result = bench.as_dict()
    if printed(result, result["rows"], json=json, csv=csv):
        return
    from kinetile.cli.tables import show
    from kinetile_bench.cli.bench_tables import rates_table

    where = bench.conditions
    show(
        rates_table(bench),
        f"{where['processor']}; medians of {where['repeats']} runs of about {where['seconds']:g} CPU s each",
    )
