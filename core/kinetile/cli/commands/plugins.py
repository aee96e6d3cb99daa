"""The command ``kinetile plugins``: what can be chosen by name."""

from __future__ import annotations

from kinetile.cli.json_output import printed
from kinetile.cli.options import Csv, Json
from kinetile.cli.terminal import exit_codes

__all__ = ["plugins"]


def plugins(json: Json = False, csv: Csv = False) -> None:
    """List the phases and recipes that are installed, and the plugins that failed to load."""
    from kinetile.plugin.registry import registry

    with exit_codes():
        listing = registry().as_dicts()
        failures = [str(failure) for failure in registry().failures]
    if printed(listing, listing["provided"], json=json, csv=csv):
        return
    from kinetile.cli.tables import plugins_table, show

    show(plugins_table(listing), *(f"not loaded: {failure}" for failure in failures))
