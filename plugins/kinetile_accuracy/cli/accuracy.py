"""The command ``kinetile accuracy``."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.cli.folder import try_folder
from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json
from kinetile.cli.terminal import Bar, exit_codes
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile_accuracy.parts import Budget, Section, Table

__all__ = ["accuracy"]


def accuracy(
    quick: Annotated[bool, typer.Option("--quick", help="Measure for about a minute.")] = False,
    full: Annotated[bool, typer.Option("--full", help="Measure for half an hour or so.")] = False,
    part: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Only this part: chart, queries, oracle, answer, drift or rates."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="The folder for the page, its figures and the data; a new accuracy-report.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Report speed against error: a page with its figures, and the data behind them."""
    from kinetile_accuracy.report import PARTS, check_packages, measure_parts

    done: list[Section] = []
    with exit_codes(), Bar("measuring") as bar:

        def finish(section: Section) -> None:
            bar.close()
            done.append(section)
            if not json:
                _print(section)

        if quick and full:
            raise BadOption("--quick and --full cannot both be had")
        for each in part or ():
            if each not in PARTS:
                raise BadOption(f"--part {each}: the parts are {', '.join(PARTS)}")
        budget: Budget = "quick" if quick else "full" if full else "normal"
        parts = list(dict.fromkeys(part)) if part else None
        out = out or _free_folder()
        check_packages(parts)
        try_folder("--out", out, keep=True)
        try:
            measure_parts(
                budget,
                parts,
                progress=lambda what, step, steps: bar.show(step / max(steps, 1), what),
                finish=finish,
            )
        finally:
            bar.close()
            if done:
                _finish(done, out, budget, json)


def _free_folder() -> Path:
    """Return the first of accuracy-report, accuracy-report-2, ... that holds no report."""
    names = ("accuracy-report" if k == 1 else f"accuracy-report-{k}" for k in count(1))
    return next(folder for folder in map(Path, names) if not (folder / "accuracy.html").exists())


def _print(section: Section) -> None:
    from kinetile.cli.tables import show

    typer.echo(section.title)
    for claim in section.claims:
        typer.echo(f"{'holds' if claim.holds else 'DOES NOT HOLD'}: {claim.says}: {claim.measured}")
    for sentence in section.findings:
        typer.echo(f"- {sentence}")
    for sentence in section.left_out:
        typer.echo(f"- left out: {sentence}")
    for table in section.tables:
        if table.printed and table.rows:
            typer.echo(f"\n{table.caption}")
            show(_as_shown(table))
    typer.echo("")


def _as_shown(table: Table) -> Any:
    """Return a table as the terminal shows it."""
    from kinetile.cli.tables import empty_table
    from kinetile_accuracy.wording import cells

    columns = {head: [getattr(row, name) for row in table.rows] for name, head in table.heads.items()}
    shown = empty_table(
        *(f"{'|' if isinstance(each[0], str) else '>'} {head}" for head, each in columns.items())
    )
    for row in zip(*map(cells, columns.values()), strict=True):
        shown.add_row(*row)
    return shown


def _finish(done: Sequence[Section], out: Path, budget: Budget, json: bool) -> None:
    from kinetile_accuracy.environment import environment
    from kinetile_accuracy.report import section_as_dict, write_report

    written: list[Path] = []
    try:
        written = write_report(done, out, budget=budget, conditions=environment())
    except OSError as error:
        raise BadOption(f"--out {out}: {error.strerror or error}") from error
    finally:
        if json:
            found = {"parts": [section_as_dict(section) for section in done], "files": written}
            typer.echo(as_json(found))
    if json:
        return
    typer.echo(f"written: {written[0]}, and {len(written) - 1} files with its figures and data beside it")
