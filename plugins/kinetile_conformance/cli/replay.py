"""The command ``kinetile replay``: a check on a saved scene, once more."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json, registered_phase
from kinetile.cli.terminal import DIFFERENT, exit_codes

__all__ = ["replay"]


def replay(
    phase: Annotated[str, typer.Argument(metavar="NAME", help="The broad phase.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A scene file, such as `conform` saves.")],
    check: Annotated[
        str | None,
        typer.Option(metavar="CHECK", help="The check; the one that the file names, or same-contacts."),
    ] = None,
    json: Json = False,
) -> None:
    """Run a check on a saved scene again; exit code 1 if it still fails."""
    with exit_codes():
        from kinetile_conformance.replay import replay as judge

        name, options = registered_phase(phase)
        result = judge(name, file, check=check, options=options)
    if json:
        from kinetile.records.versions import versions

        row: dict[str, Any] = {
            "broad_phase": name,
            "options": options,
            "check": result.check,
            "sentence": result.sentence,
            "file": str(file),
            "bodies": result.bodies,
            "fails": not result.ok,
            "said": result.said or None,
            "verdict": result.verdict or None,
            "versions": versions(),
        }
        typer.echo(as_json(row))
    else:
        bodies = f"{result.bodies} {'body' if result.bodies == 1 else 'bodies'}"
        typer.echo(
            f"{'passes' if result.ok else 'still fails'}: {phase}, {result.check}, {file} ({bodies})\n"
            f"  {result.sentence}"
        )
        for line in [*result.said.splitlines(), *([f"verdict: {result.verdict}"] if result.verdict else [])]:
            typer.echo(f"  {line}")
    if not result.ok:
        raise typer.Exit(DIFFERENT)
