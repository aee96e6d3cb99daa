"""Commands that measure errors: ``accuracy``, ``oracle`` and ``certify-log``."""

from __future__ import annotations

import typer

from kinetile_accuracy.cli.accuracy import accuracy
from kinetile_accuracy.cli.certify_log import certify_log
from kinetile_accuracy.cli.oracle import oracle

__all__ = ["app"]

app = typer.Typer()
for _command in (oracle, certify_log, accuracy):
    app.command(rich_help_panel="Accuracy")(_command)
