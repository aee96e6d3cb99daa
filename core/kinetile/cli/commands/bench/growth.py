"""The command ``kinetile bench growth``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, read_numbers
from kinetile.cli.terminal import Bar, exit_codes, make_ready
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
    json: Json = False,
) -> None:
    """Measure time and memory of a broad phase against the number of discs."""
    from kinetile.bench.growth import bench_growth

    done: list[Growth] = []
    with exit_codes(), Bar("measuring") as bar:
        sizes = read_numbers(bodies, int, "--bodies")
        if not sizes:
            raise BadOption("--bodies names no number; expected whole numbers, with commas between")
        try:
            bench_growth(
                read_phase(phase),
                sizes,
                density,
                seconds=seconds,
                start=lambda label, simulation: make_ready(simulation),
                finish=done.append,
                progress=bar.count,
            )
        finally:
            bar.close()
            if done:
                _print(done[-1], json)


def _print(measured: Growth, json: bool) -> None:
    if json:
        typer.echo(as_json(measured.as_dict()))
        return
    from kinetile.cli import bench_tables as tables
    from kinetile.cli.tables import show

    rows, where = measured.rows, measured.conditions
    lines = [f"{measured.phase} at density {measured.density:g}; {where['processor']}"]
    if measured.exponent is not None:
        lines.append(
            f"CPU time for a unit of simulated time grows as n^{measured.exponent:.2f} "
            f"from {rows[0].bodies:,} to {rows[-1].bodies:,} discs"
        )
    arrays = ", ".join(f"{name} {size:.0f}" for name, size in rows[-1].arrays.items())
    lines.append(f"bytes a disc in tables, {rows[-1].bodies:,} discs: {arrays}")
    show(tables.growth_table(measured), *lines)
