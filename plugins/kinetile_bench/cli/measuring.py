"""What the benchmarks that are studies have in common: where their rows are, how they run, how they end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from kinetile.cli.folder import try_folder
from kinetile.cli.terminal import notice
from kinetile_bench.cli.study.run import end, run_with_bar

if TYPE_CHECKING:
    from kinetile_bench.study.study import Study

__all__ = ["Results", "measured", "rows_in"]

Results = Annotated[
    Path | None,
    typer.Option(
        "--results",
        "--out",
        metavar="DIR",
        help="Keep all rows in this folder, and go on with those that are there.",
    ),
]


@contextmanager
def rows_in(out: Path | None) -> Iterator[Path]:
    """Yield the folder of a benchmark's rows: ``out``, tried first, or one for as long as it runs."""
    if out is not None:
        try_folder("--results", out, keep=True)
        yield out
        return
    with TemporaryDirectory() as folder:
        yield Path(folder)


@contextmanager
def measured(study: Study) -> Iterator[None]:
    """Run a study, one task at a time; what is done within this context comes before its end is told.

    Ends the command where a signal has stopped it, or where a row is not done, nor refused.
    """
    outcome, number = run_with_bar(study, quiet_core=True)
    yield
    rows = study.rows().select(["phase", "status", "error"]).to_pylist()
    for phase, status, error in dict.fromkeys(tuple(row.values()) for row in rows if row["status"] != "done"):
        notice(f"kinetile: {phase}: {status}: {error}")
    end(outcome, number)
