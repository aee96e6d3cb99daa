"""The command ``kinetile study``: run a table of scenes, phases and seeds, and read its rows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.files import check_ending, file_errors
from kinetile.cli.options import Csv, Json, argument, option
from kinetile.cli.output import as_csv, as_json, printed, show
from kinetile.cli.terminal import EXIT_FAULT, Bar, echo, notice

if TYPE_CHECKING:
    from kinetile_bench.study import Study, StudyStatus

StudyName = Annotated[str, argument("A study's .toml file.", "STUDY")]
Results = Annotated[Path | None, option("The SQLite file of the rows, instead of the study's own.", "FILE")]


def run_study(
    study: StudyName,
    results: Results = None,
    workers: Annotated[int | None, option("Worker processes; as many as processors.", "N", least=1)] = None,
    again: Annotated[
        list[str] | None, option("Forget rows of this status, and run their tasks again.", "STATUS")
    ] = None,
    json: Json = False,
) -> None:
    """Runs all tasks of a study that have no row yet; continues where it was stopped.

    Exit code 1 if a run failed or was lost, or has other contacts than another run of its scene.

    For example: kinetile study run plan.toml --workers 2
    """
    with Bar("running") as bar:
        this = _find_study(study, results)

        def disagreed(sentence: str) -> None:
            notice(f"disagreement: {sentence}")

        try:
            status = this.run(workers=workers, again=again or (), progress=bar.count, disagreed=disagreed)
        except KeyboardInterrupt:
            bar.close()
            notice(f"{this.status().open:,} tasks have no row yet")
            raise
        bar.close()
        if json:
            echo(as_json({**status._asdict(), "results": str(this.results), "well": status.well}))
        else:
            show(*_status_lines(this, status))
        _end(status)


def study_table(
    study: StudyName,
    results: Results = None,
    y: Annotated[str | None, option("The quantity; by default CPU seconds.", "COLUMN", "--y")] = None,
    json: Json = False,
    csv: Csv = False,
) -> None:
    """Prints the progress of a study, and means over seeds with ratios paired by seed.

    Exit code 1 if a run failed or was lost, or has other contacts than another run of its scene.

    For example: kinetile study table plan.toml
    """
    this = _find_study(study, results)
    status, found = this.status(), this.table(y)
    result = {"results": str(this.results), "status": status._asdict() | {"well": status.well}, **found}
    if not printed(result, found["groups"], json=json, csv=csv):
        from kinetile_bench.cli.tables import study_parts

        show(*_status_lines(this, status), *study_parts(found))
    _end(status)


def study_rows(study: StudyName, results: Results = None, json: Json = False) -> None:
    """Prints all rows of a study as CSV, in the study's order.

    For example: kinetile study rows plan.toml
    """
    rows = _find_study(study, results).rows()
    echo(as_json(rows) if json else as_csv(rows).removesuffix("\n"))


def _end(status: StudyStatus) -> None:
    if not status.well:
        raise typer.Exit(EXIT_FAULT)


def _find_study(name: str, results: Path | None) -> Study:
    from kinetile_bench.study import Study

    if results is not None:
        check_ending("--results", results)
    with file_errors(f"the study file {name!r} cannot be read"):
        return Study(name, results)


def _status_lines(study: Study, status: StudyStatus) -> list[str]:
    counts = ", ".join(f"{count:,} {kind}" for kind, count in sorted(status.statuses.items()))
    others = f"; {status.others:,} rows of other versions or tasks" if status.others else ""
    ran = f" ({status.ran:,} in this run)" if status.ran else ""
    return [
        f"{status.total:,} tasks: {counts or 'none done'}, {status.open:,} open{ran}",
        f"rows in {study.results}{others}",
        *(f"disagreement: {sentence}" for sentence in status.disagreements[:10]),
    ]
