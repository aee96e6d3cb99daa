"""Commands of the conformance kit: ``conform``, ``judge`` and ``replay``."""

from __future__ import annotations

import typer

from kinetile_conformance.cli.conform import conform, replay
from kinetile_conformance.cli.judge import judge

app = typer.Typer()
for _command in (conform, judge, replay):
    app.command(rich_help_panel="Conformance")(_command)
