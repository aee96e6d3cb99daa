"""The command ``kinetile recover``: an event file, of what a run has left that was killed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json
from kinetile.cli.terminal import exit_codes, notice
from kinetile.errors import BadOption, RecordError

__all__ = ["recover"]


def recover(
    partial: Annotated[
        Path, typer.Argument(metavar="FILE.partial", help="What a run with --events FILE has left.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The event file to make; without it, FILE, and FILE.partial goes."),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an event file that is there.")
    ] = False,
    json: Json = False,
) -> None:
    """Make an event file of what a run has left that was killed."""
    with exit_codes():
        from kinetile.records.finishing import recover as make

        try:
            made = make(partial, out, overwrite=overwrite)
        except RecordError as error:
            raise BadOption(str(error)) from error
    if made.left_over:
        notice(
            f"kinetile: the last {made.left_over:,} bytes of {partial} are no whole batch of rows: a write "
            "that was cut off, or damage; they are not in the event file"
        )
    if json:
        typer.echo(as_json(made._asdict() | {"path": str(made.path)}))
        return
    typer.echo(f"{made.path}: {made.rows:,} events, to time {made.time:.10g} ({made.status})")
    if made.kept:
        typer.echo(f"{partial} is still there")
