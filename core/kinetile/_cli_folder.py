"""A folder for results, made and tried before anything is measured."""

from __future__ import annotations

import tempfile
from pathlib import Path

from kinetile._cli_terminal import notice
from kinetile.errors import BadOption, MissingExtra

__all__ = ["prepare_folder"]


def prepare_folder(out: Path) -> None:
    """Make the folder and see that it can be written to; say so if there will be no figures in it.

    Raises BadOption where it cannot be made or written to.
    """
    from kinetile.drawing import check_figures

    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise BadOption(f"--out {out}: {error.strerror}") from error
    try:
        check_figures()
    except MissingExtra as error:
        notice(f"kinetile: {error}; everything else is done without it")
