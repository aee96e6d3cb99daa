"""The command ``kinetile plugins``: what can be chosen by name."""

from __future__ import annotations

import typer

from kinetile.cli.json_output import as_json
from kinetile.cli.options import Json
from kinetile.cli.terminal import exit_codes

__all__ = ["plugins"]


def plugins(json: Json = False) -> None:
    """List the phases and recipes that are installed, and the plugins that failed to load."""
    from kinetile.plugin.registry import registry

    with exit_codes():
        listing = registry().as_dicts()
        failures = [str(failure) for failure in registry().failures]
    if json:
        typer.echo(as_json(listing))
        return
    from kinetile.cli.tables import plugins_table, show

    show(plugins_table(listing), *(f"not loaded: {failure}" for failure in failures))
