"""The command ``kinetile bench thesis``."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.folder import try_folder
from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, some_phases
from kinetile.cli.terminal import Bar, exit_codes, make_ready, notice
from kinetile.errors import BadOption, MissingExtra

if TYPE_CHECKING:
    from kinetile.bench.thesis import Cell, ThesisBench

__all__ = ["thesis"]


def thesis(
    phases: Annotated[
        str, typer.Option(metavar="A,B,...", help="Broad phases.")
    ] = "naive,sap-1d,sap-2d,sweep-tiling",
    seeds: Annotated[int, typer.Option(min=1, metavar="K", help="Run each scene with the seeds 1 to K.")] = 6,
    until: Annotated[float, typer.Option(metavar="T", help="How much time is simulated.")] = 1.0,
    seconds: Annotated[
        float, typer.Option(min=0.0001, help="CPU seconds of the runs of a phase on a scene, about.")
    ] = 0.05,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write all cells as CSV, and figures 23 and 24, into this folder."),
    ] = None,
    json: Json = False,
) -> None:
    """Do the thesis's benchmark (section 5.3) again, and say which of its statements hold."""
    from kinetile.bench.thesis import ThesisBench, bench_thesis, thesis_conditions

    done: list[Cell] = []
    with exit_codes(), Bar("measuring") as bar:
        if not 0.0 < until < float("inf"):
            raise BadOption(f"--until is {until!r}; expected a time greater than 0")
        chosen = some_phases(phases)
        if out is not None:
            try_folder("--out", out, keep=True)
            _check_figures()
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
                _print(measured, _write(measured, out), json)


def _check_figures() -> None:
    """Say so before anything is measured, if there will be no figures."""
    from kinetile.accuracy.drawing import check_figures

    try:
        check_figures()
    except MissingExtra as error:
        notice(f"kinetile: {error}; everything else is done without it")


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


def _print(measured: ThesisBench, written: Sequence[Path], json: bool) -> None:
    from kinetile.bench.measures import exponents, summaries
    from kinetile.bench.thesis_statements.evidence import QUIET
    from kinetile.bench.thesis_statements.statements import statements

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
        f"{where['processor']}; seeds 1 to {where['seeds']}, {where['until']:g} units of time; "
        f"{where['rounds']} rounds of all phases on each scene, about {where['seconds']:g} CPU s a phase",
        f"slowest over fastest round of the same run: {measured.unrest:.3f}, the median of all; "
        f"a machine is quiet up to {QUIET:g}",
        *(f"written: {path}" for path in written),
    )
