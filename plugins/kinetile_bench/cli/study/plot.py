"""The command ``kinetile study plot``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json
from kinetile.cli.terminal import exit_codes
from kinetile.errors import BadOption
from kinetile_bench.cli.study.options import Results, StudyName, find_study

__all__ = ["study_plot"]


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
        this = find_study(study, results)
        try:
            written = this.plot(out)
        except OSError as error:
            raise BadOption(f"--out {out or this.results}: {error.strerror or error}") from error
        typer.echo(as_json({"files": written}) if json else "\n".join(f"written: {path}" for path in written))
