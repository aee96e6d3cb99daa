"""Commands of the conformance kit: ``conform``, ``compare`` and ``replay``."""

from __future__ import annotations

import typer

from kinetile_conformance.cli.conform import conform, replay

app = typer.Typer()
for _command in (conform, replay):
    app.command(rich_help_panel="Conformance")(_command)
