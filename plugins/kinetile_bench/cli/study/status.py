"""The command ``kinetile study status``."""

from __future__ import annotations

import typer

from kinetile.cli.options import Json
from kinetile.cli.terminal import FAULT, exit_codes
from kinetile_bench.cli.study.options import Results, StudyName, find_study
from kinetile_bench.cli.study.run import print_outcome

__all__ = ["study_status"]


def study_status(study: StudyName, results: Results = None, json: Json = False) -> None:
    """Say how many tasks of a study have a row, and how they ended."""
    with exit_codes():
        this = find_study(study, results)
        outcome = this.status()
        print_outcome(this, outcome, json)
        if not outcome.well:
            raise typer.Exit(FAULT)
