"""The commands ``bench thesis`` and ``bench growth``."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from kinetile.cli.commands.run import as_json
from kinetile.cli.folder import prepare_folder
from kinetile.cli.terminal import Bar, exit_codes, make_ready
from kinetile.cli.values import read_numbers
from kinetile.errors import BadOption, MissingExtra
from kinetile.plugin.choices import read_phase, read_phases

if TYPE_CHECKING:
    from kinetile.bench.growth import Growth
    from kinetile.bench.thesis import Cell, ThesisBench

__all__ = ["growth", "thesis"]


def thesis(phases: str, seeds: int, until: float, seconds: float, out: Path | None, json: bool) -> None:
    """Measure, print and write; after Ctrl-C, what has been measured until then."""
    from kinetile.bench.thesis import ThesisBench, bench_thesis, thesis_conditions

    done: list[Cell] = []
    with exit_codes(), Bar("measuring") as bar:
        if not 0.0 < until < float("inf"):
            raise BadOption(f"--until is {until!r}; expected a time greater than 0")
        chosen = [read_phase(text) for text in read_phases(phases)]
        if not chosen:
            raise BadOption("--phases names no phase; expected names, with commas between")
        if out is not None:
            prepare_folder(out)
        try:
            bench_thesis(
                chosen,
                seeds=seeds,
                until=until,
                seconds=seconds,
                start=lambda label, simulation: make_ready(simulation),
                finish=done.extend,
                progress=bar.count,
            )
        finally:
            bar.close()
            if done:
                measured = ThesisBench(tuple(done), thesis_conditions(seeds, until, seconds))
                _print_thesis(measured, _write(measured, out), json)


def growth(phase: str, bodies: str, density: float, seconds: float, json: bool) -> None:
    """Measure and print; after Ctrl-C, what has been measured until then."""
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
                _print_growth(done[-1], json)


def _write(measured: ThesisBench, out: Path | None) -> list[Path]:
    """Write the cells and, where that can be done, the figures; return what was written."""
    if out is None:
        return []
    from kinetile.bench.figures import draw_figures, write_cells

    try:
        written = [write_cells(measured, out)]
        with suppress(MissingExtra):  # said before the start
            written += draw_figures(measured, out)
    except OSError as error:
        raise BadOption(f"--out {out}: {error.strerror or error}") from error
    return written


def _print_thesis(measured: ThesisBench, written: Sequence[Path], json: bool) -> None:
    from kinetile.bench.measures import exponents, summaries
    from kinetile.bench.statements import statements

    rows, fits, found = summaries(measured), exponents(measured), statements(measured)
    where = measured.conditions
    if json:
        result: dict[str, Any] = {"conditions": dict(where), "scenes": rows, "exponents": fits}
        result["statements"] = [statement.as_dict() for statement in found]
        result["cells"] = [vars(cell) for cell in measured.cells]
        typer.echo(as_json(result | {"files": written}))
        return
    from kinetile.cli import bench_tables as tables
    from kinetile.cli.tables import show

    show(
        "CPU milliseconds for one unit of simulated time: median over seeds, and the extremes; * fastest "
        "(figure 23)",
        tables.time_table(rows),
        "\nEvents in one unit of time (means over seeds, standard error), their shares (figure 24), "
        "longest queue, mean candidate pairs",
        tables.events_table(rows),
        "\nExponents over n, fitted seed by seed: mean and standard error",
        tables.exponents_table(fits),
        f"\nThe measures of a kinetic data structure (section 2.1), {measured.bodies[-1]} discs: measured, "
        "and in theory",
        tables.measures_table(rows),
        *tables.measures_notes(),
        "\nThe thesis's statements",
        tables.statements_table(found),
        f"{where['processor']}; seeds 1 to {where['seeds']}, {where['until']:g} units of time; at least "
        f"{where['seconds']:g} CPU s for each phase, scene and seed (or {where['most_runs']} runs)",
        *(f"written: {path}" for path in written),
    )


def _print_growth(measured: Growth, json: bool) -> None:
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
