"""The command ``kinetile study run``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json
from kinetile.cli.terminal import FAULT, Bar, FirstSignal, exit_codes, notice
from kinetile_bench.cli.study.options import Results, StudyName, find_study, outcome_as_dict, read_size

if TYPE_CHECKING:
    from kinetile_bench.study.study import Outcome, Progress, Study

__all__ = ["end", "print_outcome", "run_study", "run_with_bar"]


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
        this = find_study(study, results)
        outcome, number = run_with_bar(
            this,
            workers=workers,
            dask=dask,
            memory=read_size("--memory", memory),
            quiet_core=quiet_core,
            again=again or (),
        )
        print_outcome(this, outcome, json)
        end(outcome, number)


def run_with_bar(study: Study, **how: Any) -> tuple[Outcome, int | None]:
    """Run a study, with a bar; return how it stands, and the signal that stopped it."""
    compiling = False
    with FirstSignal() as signals, Bar("running") as bar:

        def progress(state: Progress) -> None:
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
                progress=progress, disagreed=lambda said: notice(f"disagreement: {said}"), **how
            ), None
        except KeyboardInterrupt:
            if signals.number is None:
                raise
            return study.status(), signals.number


def end(outcome: Outcome, number: int | None) -> None:
    """End the command with the exit code of a study that stands like this, or that a signal stopped."""
    if number is not None:
        notice(f"kinetile: interrupted; {outcome.open:,} tasks have no row yet")
        raise typer.Exit(128 + number)
    if not outcome.well:
        raise typer.Exit(FAULT)


def print_outcome(study: Study, outcome: Outcome, json: bool) -> None:
    """Print how a study stands."""
    if json:
        typer.echo(as_json(outcome_as_dict(study, outcome)))
        return
    from kinetile.cli.tables import show
    from kinetile_bench.cli.study.tables import outcome_table

    show(outcome_table(study, outcome), *(f"disagreement: {said}" for said in outcome.disagreements[:10]))
