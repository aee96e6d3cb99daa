"""The command ``kinetile accuracy``."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from kinetile.cli.commands.run import as_json
from kinetile.cli.folder import try_folder
from kinetile.cli.terminal import Bar, exit_codes
from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile.accuracy.parts import Budget, Section

__all__ = ["accuracy"]


def accuracy(quick: bool, full: bool, parts: Sequence[str] | None, out: Path | None, json: bool) -> None:
    """Measure, print each part when it is finished, and write them all; after Ctrl-C, those until then."""
    from kinetile.accuracy.report import PARTS, check_packages, measure_parts

    done: list[Section] = []
    with exit_codes(), Bar("measuring") as bar:

        def finish(section: Section) -> None:
            bar.close()
            done.append(section)
            if not json:
                _print(section)

        if quick and full:
            raise BadOption("--quick and --full cannot both be had")
        for part in parts or ():
            if part not in PARTS:
                raise BadOption(f"--part {part}: the parts are {', '.join(PARTS)}")
        budget: Budget = "quick" if quick else "full" if full else "normal"
        parts = list(dict.fromkeys(parts)) if parts else None
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
    typer.echo(section.title)
    for claim in section.claims:
        typer.echo(f"{'holds' if claim.holds else 'DOES NOT HOLD'}: {claim.says}: {claim.measured}")
    for sentence in section.findings:
        typer.echo(f"- {sentence}")
    for sentence in section.left_out:
        typer.echo(f"- left out: {sentence}")
    typer.echo("")


def _finish(done: Sequence[Section], out: Path, budget: Budget, json: bool) -> None:
    from kinetile.accuracy.report import section_as_dict, write_report
    from kinetile.bench.events import surroundings

    written: list[Path] = []
    try:
        written = write_report(done, out, budget=budget, conditions=surroundings())
    except OSError as error:
        raise BadOption(f"--out {out}: {error.strerror or error}") from error
    finally:
        if json:
            found = {"parts": [section_as_dict(section) for section in done], "files": written}
            typer.echo(as_json(found))
    if json:
        return
    typer.echo(f"written: {written[0]}, and {len(written) - 1} files with its figures and data beside it")
