"""The command ``kinetile study``: run a table of scenes, phases and seeds, see how it stands, read it, draw
it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.options import Csv, Json
from kinetile.cli.output import as_json, printed
from kinetile.cli.terminal import FAULT, Bar, FirstSignal, echo, exit_codes, notice
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile_bench.study import Study
    from kinetile_bench.study_run import StudyProgress, StudyStatus

StudyName = Annotated[
    str, typer.Argument(metavar="STUDY", help="A study's .toml file, or the name of one that ships.")
]
Results = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="The folder of the rows, instead of the study's own."),
]

_UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}


def run_study(
    study: StudyName,
    results: Results = None,
    workers: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Worker processes; as many as processors.")
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Run on the Dask cluster of this scheduler, or `local`."),
    ] = None,
    memory: Annotated[
        str | None, typer.Option(metavar="SIZE", help="Memory of each worker, such as 4G; a fair share.")
    ] = None,
    quiet_core: Annotated[
        bool, typer.Option("--quiet-core", help="One task at a time, for timings without neighbours.")
    ] = False,
    again: Annotated[
        list[str] | None,
        typer.Option(metavar="STATUS", help="Forget rows of this status, or `changed`, and do them again."),
    ] = None,
    json: Json = False,
) -> None:
    """Do all tasks of a study that have no row yet; go on where it was stopped."""
    with exit_codes():
        this = _find_study(study, results)
        status, number = run_with_bar(
            this,
            workers=workers,
            dask=dask,
            memory=_read_size("--memory", memory),
            quiet_core=quiet_core,
            again=again or (),
        )
        _print_status(this, status, json)
        end(status, number)


def study_status(study: StudyName, results: Results = None, json: Json = False) -> None:
    """Say how many tasks of a study have a row, and how they ended."""
    with exit_codes():
        this = _find_study(study, results)
        status = this.status()
        _print_status(this, status, json)
        end(status, None)


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
        this = _find_study(study, results)
        if rows is not None:
            from kinetile_bench.results import write_rows

            try:
                count = write_rows(this.rows(timings=not no_timings), rows)
            except OSError as error:
                raise BadOption(f"--rows {rows}: {error.strerror or error}") from error
            notice(f"{count:,} rows written: {rows}")
        found = this.table(y, x)
        if not printed(found, map(_without_lists, found["groups"]), json=json, csv=csv):
            from kinetile.cli.output import show
            from kinetile_bench.cli.tables import results_parts

            show(*results_parts(found))


def study_plot(
    study: StudyName,
    results: Results = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="The folder of the figures; `figures` in the results.")
    ] = None,
    json: Json = False,
) -> None:
    """Draw the figures of a study, as SVG and PNG."""
    with exit_codes():
        this = _find_study(study, results)
        try:
            written = this.plot(out)
        except OSError as error:
            raise BadOption(f"--out {out or this.results}: {error.strerror or error}") from error
        echo(as_json({"files": written}) if json else "\n".join(f"written: {path}" for path in written))


def run_with_bar(study: Study, **options: Any) -> tuple[StudyStatus, int | None]:
    """Runs a study, with a progress bar; returns its progress, and the signal that stopped it."""
    compiling = False
    with FirstSignal() as signals, Bar("running") as bar:

        def progress(state: StudyProgress) -> None:
            nonlocal compiling
            signals.check()
            if state.doing and not compiling:
                compiling = True
                bar.show(None, state.doing)
            elif not state.doing:
                failed = f", {state.failed:,} failed" if state.failed else ""
                bar.show(state.done / state.total, f"{state.done:,} of {state.total:,} tasks{failed}")

        try:
            return study.run(
                progress=progress, disagreed=lambda found: notice(f"disagreement: {found}"), **options
            ), None
        except KeyboardInterrupt:
            if signals.number is None:
                raise
            return study.status(), signals.number


def end(status: StudyStatus, number: int | None) -> None:
    """Ends the command with the exit code of a study that stands like this, or that a signal stopped."""
    if number is not None:
        notice(f"kinetile: interrupted; {status.open:,} tasks have no row yet")
        raise typer.Exit(128 + number)
    if not status.well:
        raise typer.Exit(FAULT)


def _print_status(study: Study, status: StudyStatus, json: bool) -> None:
    if json:
        echo(as_json({**status._asdict(), "results": str(study.results), "well": status.well}))
        return
    from kinetile.cli.output import show
    from kinetile_bench.cli.tables import status_parts

    show(*status_parts(study, status))


def _find_study(name: str, results: Path | None) -> Study:
    """Returns a study by its file or name. Raises BadOption for a file that cannot be read."""
    from kinetile_bench.study import Study

    try:
        return Study(name, results)
    except OSError as error:
        raise BadOption(f"the study file {name!r} cannot be read: {error.strerror or error}") from error


def _read_size(option: str, text: str | None) -> int | None:
    """Returns the bytes of ``4G`` or ``500M``; None of None."""
    if text is None:
        return None
    number, unit = (text[:-1], text[-1].upper()) if text[-1:].isalpha() else (text, "")
    try:
        size = int(float(number) * _UNITS[unit])
    except (KeyError, ValueError, OverflowError):
        size = 0
    if size < 1:
        raise BadOption(f"{option} is {text!r}; expected a number of bytes, such as 500M or 4G")
    return size


def _without_lists(group: dict[str, Any]) -> dict[str, Any]:
    """Returns a row of the table with each end of an interval by itself."""
    ends = {
        name: dict(zip(("low", "high"), group[name] or (None, None), strict=True))
        for name in ("interval", "ratio_interval")
    }
    return group | ends
