"""The command ``kinetile bench thesis``."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.json_output import printed
from kinetile.cli.options import Csv, Json, Repeats, Seconds, some_phases
from kinetile.cli.terminal import exit_codes, notice
from kinetile.errors import BadOption, MissingExtra
from kinetile_bench.cli.measuring import measured, rows_in

if TYPE_CHECKING:
    from kinetile_bench.study.study import Study
    from kinetile_bench.thesis import ThesisBench

__all__ = ["thesis"]


def thesis(
    phases: Annotated[
        str, typer.Option(metavar="A,B,...", help="Broad phases.")
    ] = "naive,sap-1d,sap-2d,sweep-tiling",
    seeds: Annotated[int, typer.Option(min=1, metavar="K", help="Run each scene with the seeds 1 to K.")] = 6,
    until: Annotated[float, typer.Option(metavar="T", help="How much time is simulated.")] = 1.0,
    seconds: Seconds = 0.01,
    repeats: Repeats = 5,
    results: Annotated[
        Path | None,
        typer.Option(
            "--results",
            "--out",
            metavar="DIR",
            help="Keep all rows in this folder, and go on with those that are there; write rows.csv and "
            "figures 23 and 24 beside them.",
        ),
    ] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Do the thesis's benchmark (section 5.3) again, and say which of its statements hold."""
    from kinetile_bench.thesis import read_bench, thesis_study

    with exit_codes():
        if not 0.0 < until < float("inf"):
            raise BadOption(f"--until is {until!r}; expected a time greater than 0")
        chosen = some_phases(phases)
        with rows_in(results) as folder:
            if results is not None:
                _check_figures()
            study = thesis_study(folder, chosen, seeds=seeds, until=until, seconds=seconds, repeats=repeats)
            with measured(study):
                found = read_bench(study)
                if found.cells:
                    _print(found, [] if results is None else _write(study, results), json, csv)


def _check_figures() -> None:
    """Say so before anything is measured, if there will be no figures."""
    from kinetile_accuracy.drawing import check_figures

    try:
        check_figures()
    except MissingExtra as error:
        notice(f"kinetile: {error}; everything else is done without it")


def _write(study: Study, out: Path) -> list[Path]:
    """Write the rows and, where that can be done, the figures; return what was written."""
    from kinetile_bench.study.results.writing import write_rows

    try:
        written = [out / "rows.csv"]
        write_rows(study.rows(), written[0])
        with suppress(MissingExtra):  # said before the start
            written += study.plot(out)
    except OSError as error:
        raise BadOption(f"--results {out}: {error.strerror or error}") from error
    return written


def _print(bench: ThesisBench, written: Sequence[Path], json: bool, csv: bool) -> None:
    from kinetile_bench.measures import exponents, summaries
    from kinetile_bench.thesis_statements.evidence import QUIET
    from kinetile_bench.thesis_statements.statements import statements

    rows, fits, found = summaries(bench), exponents(bench), statements(bench)
    where = bench.conditions
    result: dict[str, Any] = {"conditions": dict(where), "scenes": rows, "exponents": fits}
    result["statements"] = [statement.as_dict() for statement in found]
    result |= {"cells": [vars(cell) for cell in bench.cells], "files": written}
    if printed(result, result["cells"], json=json, csv=csv):
        return
    from kinetile.cli.tables import show
    from kinetile_bench.cli import bench_tables as tables

    show(
        "CPU milliseconds for one unit of simulated time: median over seeds, and the extremes; * fastest "
        "(figure 23)",
        tables.time_table(rows),
        "\nEvents in one unit of time (means over seeds, standard error), their shares (figure 24), "
        "longest queue, mean candidate pairs",
        tables.events_table(rows),
        "\nExponents over n, fitted seed by seed: mean and standard error",
        tables.exponents_table(fits),
        f"\nThe measures of a kinetic data structure (section 2.1), {bench.bodies[-1]} discs: measured, "
        "and in theory",
        tables.measures_table(rows),
        *tables.measures_notes(),
        "\nThe thesis's statements",
        tables.statements_table(found),
        f"{where['processor']}; seeds 1 to {where['seeds']}, {where['until']:g} units of time; "
        f"{where['repeats']} rounds of all phases on each scene, about {where['seconds']:g} CPU s each",
        f"slowest over fastest round of the same run: {bench.unrest:.3f}, the median of all; "
        f"a machine is quiet up to {QUIET:g}",
        *(f"written: {path}" for path in written),
    )
