"""The command ``kinetile new-plugin``: a package with a broad phase, to begin one of your own with."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from kinetile.cli.terminal import exit_codes

__all__ = ["new_plugin"]


def new_plugin(
    name: Annotated[str, typer.Argument(help="What the broad phase is to be called.")],
    into: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write the package into.")] = Path(),
) -> None:
    """Write a package with a broad phase that works, to begin one of your own with."""
    with exit_codes():
        from kinetile.plugin.templates.new_plugin import new_plugin as write_package

        folder = write_package(name, into)
    written = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    typer.echo(f"{folder}: {', '.join(written)}")
    typer.echo("to make its broad phase known here, and judge it:")
    typer.echo(f"  cd {shlex.quote(str(folder))}\n  pip install -e '.[test]'\n  pytest")
