"""Commands of the conformance kit: ``conform``, ``compare``, ``replay`` and ``mutate``."""

from __future__ import annotations

import typer

from kinetile_conformance.cli.conform import conform, replay
from kinetile_conformance.cli.mutate import mutate

app = typer.Typer()
for _command in (conform, replay, mutate):
    app.command(rich_help_panel="Conformance")(_command)
