"""The command ``kinetile bench events``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, phase_choices, read_numbers
from kinetile.cli.terminal import Bar, exit_codes, make_ready

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
    json: Json = False,
) -> None:
    """Measure events a CPU second of each broad phase on the thesis's twelve scenes."""
    from kinetile.bench.events import Bench, BenchRow, bench_events, conditions

    done: list[BenchRow] = []
    with exit_codes(), Bar("measuring") as bar:
        try:
            bench_events(
                None if phases is None else phase_choices(phases),
                read_numbers(bodies, int, "--bodies"),
                read_numbers(densities, float, "--densities"),
                seconds=seconds,
                repeats=repeats,
                start=lambda label, simulation: make_ready(simulation),
                finish=done.append,
                progress=bar.count,
            )
        finally:
            bar.close()
            if done:
                _print(Bench(tuple(done), conditions(seconds, repeats)), json)


def _print(measured: Bench, json: bool) -> None:
    if json:
        typer.echo(as_json(measured.as_dict()))
        return
    from kinetile.cli.bench_tables import rates_table
    from kinetile.cli.tables import show

    where = measured.conditions
    show(
        rates_table(measured),
        f"{where['processor']}; medians of {where['repeats']} runs of about {where['seconds']:g} CPU s each",
    )
