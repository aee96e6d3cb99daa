"""The command ``kinetile bench growth``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.commands.bench.measuring import Out, measured, rows_in
from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, read_numbers
from kinetile.cli.terminal import exit_codes
from kinetile.errors import BadOption
from kinetile.plugin.choices import read_phase

if TYPE_CHECKING:
    from kinetile.bench.growth import Growth

__all__ = ["growth"]


def growth(
    phase: Annotated[str, typer.Option(metavar="NAME", help="The broad phase.")] = "sweep-tiling",
    bodies: Annotated[
        str, typer.Option(metavar="N,...", help="Numbers of discs; the next square number is taken.")
    ] = "100,1000,10000,100000",
    density: Annotated[float, typer.Option(help="Area fraction.")] = 0.5,
    seconds: Annotated[float, typer.Option(min=0.001, help="CPU seconds for each, at least.")] = 2.0,
    out: Out = None,
    json: Json = False,
) -> None:
    """Measure time and memory of a broad phase against the number of discs."""
    from kinetile.bench.growth import growth_study, read_growth

    with exit_codes():
        sizes = read_numbers(bodies, int, "--bodies")
        if not sizes:
            raise BadOption("--bodies names no number; expected whole numbers, with commas between")
        with rows_in(out) as results:
            study = growth_study(results, read_phase(phase), sizes, density, seconds=seconds)
            with measured(study):
                found = read_growth(study)
                if found.rows:
                    _print(found, json)


def _print(found: Growth, json: bool) -> None:
    if json:
        typer.echo(as_json(found.as_dict()))
        return
    from kinetile.cli import bench_tables as tables
    from kinetile.cli.tables import show

    rows, where = found.rows, found.conditions
    lines = [f"{found.phase} at density {found.density:g}; {where['processor']}"]
    if found.exponent is not None:
        lines.append(
            f"CPU time for a unit of simulated time grows as n^{found.exponent:.2f} "
            f"from {rows[0].bodies:,} to {rows[-1].bodies:,} discs"
        )
    arrays = ", ".join(f"{name} {size:.0f}" for name, size in rows[-1].arrays.items())
    lines.append(f"bytes a disc in tables, {rows[-1].bodies:,} discs: {arrays}")
    show(tables.growth_table(found), *lines)
