"""The command ``kinetile bench growth``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.json_output import printed
from kinetile.cli.options import Csv, Json, Repeats, Seconds, read_numbers, some_phases
from kinetile.cli.terminal import exit_codes
from kinetile.errors import BadOption
from kinetile_bench.cli.measuring import Results, measured, rows_in

if TYPE_CHECKING:
    from kinetile_bench.growth import Growth

__all__ = ["growth"]


def growth(
    phases: Annotated[
        str, typer.Option("--phases", "--phase", metavar="NAME", help="The broad phase, one.")
    ] = "sweep-tiling",
    bodies: Annotated[
        str, typer.Option(metavar="N,...", help="Numbers of discs; the next square number is taken.")
    ] = "100,1000,10000,100000",
    density: Annotated[float, typer.Option(help="Area fraction.")] = 0.5,
    seconds: Seconds = 2.0,
    repeats: Repeats = 1,
    results: Results = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Measure time and memory of a broad phase against the number of discs."""
    from kinetile_bench.growth import growth_study, read_growth

    with exit_codes():
        sizes = read_numbers(bodies, int, "--bodies")
        if not sizes:
            raise BadOption("--bodies names no number; expected whole numbers, with commas between")
        chosen = some_phases(phases)
        if len(chosen) > 1:
            raise BadOption(f"--phases names {len(chosen)} phases; expected one, whose growth is measured")
        with rows_in(results) as folder:
            study = growth_study(folder, chosen[0], sizes, density, seconds=seconds, repeats=repeats)
            with measured(study):
                found = read_growth(study)
                if found.rows:
                    _print(found, json, csv)


def _print(found: Growth, json: bool, csv: bool) -> None:
    result = found.as_dict()
    if printed(result, result["rows"], json=json, csv=csv):
        return
    from kinetile.cli.tables import show
    from kinetile_bench.cli import bench_tables as tables

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
