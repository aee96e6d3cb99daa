"""The command ``kinetile study table``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kinetile.cli.json_output import printed
from kinetile.cli.options import Csv, Json
from kinetile.cli.terminal import exit_codes, notice
from kinetile.errors import BadOption
from kinetile_bench.cli.study.options import Results, StudyName, find_study

__all__ = ["study_table"]


def study_table(
    study: StudyName,
    results: Results = None,
    y: Annotated[
        str | None, typer.Option("--y", metavar="COLUMN", help="What is looked at; CPU s a unit of time.")
    ] = None,
    x: Annotated[
        str | None, typer.Option("--x", metavar="PARAMETER", help="Over what exponents are fitted.")
    ] = None,
    rows: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write all rows, in the study's order: .csv or .parquet."),
    ] = None,
    no_timings: Annotated[
        bool, typer.Option("--no-timings", help="In --rows, leave out times, machine and its versions.")
    ] = False,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Print what the rows come to: means over seeds, paired ratios, exponents, crossovers."""
    with exit_codes():
        this = find_study(study, results)
        if rows is not None:
            _write(this, rows, timings=not no_timings)
        found = this.table(y, x)
        if not printed(found, map(_plainly, found["groups"]), json=json, csv=csv):
            _print(found)


def _plainly(group: dict[str, Any]) -> dict[str, Any]:
    """Return a scene under a phase with each end of an interval by itself."""
    ends = {
        name: dict(zip(("low", "high"), group[name] or (None, None), strict=True))
        for name in ("interval", "ratio_interval")
    }
    return group | ends


def _write(study: Any, path: Path, *, timings: bool) -> None:
    """Write the rows to a file, whole or not at all."""
    from kinetile_bench.study.results.writing import write_rows

    try:
        count = write_rows(study.rows(timings=timings), path)
    except OSError as error:
        raise BadOption(f"--rows {path}: {error.strerror or error}") from error
    notice(f"{count:,} rows written: {path}")


def _print(found: dict[str, Any]) -> None:
    from kinetile.cli.tables import show
    from kinetile_bench.cli.study.tables import crossovers_table, exponents_table, groups_table

    parts: list[Any] = []
    if found["groups"]:
        y, base = found["y"], found["base"]
        parts += [
            f"{y}: mean over seeds, 95 % interval; ratio to {base}, paired by seed",
            groups_table(found["groups"], found["parameters"]),
        ]
    if found["exponents"]:
        x = found["x"]
        others = [name for name in found["parameters"] if name != x]
        parts += [f"\nExponents of {found['y']} over {x}", exponents_table(found["exponents"], x, others)]
    for crossed in found["crossovers"]:
        others = [name for name in found["parameters"] if name != crossed["over"]]
        parts += [
            f"\nCrossovers over {crossed['over']}: where {found['y']} is equal",
            crossovers_table(crossed["found"], crossed["over"], others),
        ]
    show(*(parts or ["no rows with this column yet"]))
