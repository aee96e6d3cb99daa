"""What the commands about studies have in common."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kinetile.errors import BadOption

if TYPE_CHECKING:
    from kinetile_bench.study.study import Outcome, Study

__all__ = ["Results", "StudyName", "find_study", "outcome_as_dict", "read_size"]

StudyName = Annotated[
    str, typer.Argument(metavar="STUDY", help="A study's .toml file, or the name of one that ships.")
]
Results = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="The folder of the rows, instead of the study's own."),
]

_UNITS = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}


def find_study(name: str, results: Path | None) -> Study:
    """Return a study by its file or name. Raises BadOption for a file that cannot be read."""
    from kinetile_bench.study.study import Study

    try:
        return Study(name, results)
    except OSError as error:
        raise BadOption(f"the study file {name!r} cannot be read: {error.strerror or error}") from error


def read_size(option: str, text: str | None) -> int | None:
    """Return the bytes of ``4G`` or ``500M``; None of None."""
    if text is None:
        return None
    number, unit = (text[:-1], text[-1].upper()) if text[-1:].isalpha() else (text, "")
    try:
        size = int(float(number) * _UNITS[unit])
    except (KeyError, ValueError, OverflowError):
        size = 0
    if size < 1:
        raise BadOption(f"{option} is {text!r}; expected a number of bytes, such as 500M or 4G")
    return size


def outcome_as_dict(study: Study, outcome: Outcome) -> dict[str, Any]:
    """Return how a study stands, in plain types."""
    return {**outcome._asdict(), "results": str(study.results), "well": outcome.well}
