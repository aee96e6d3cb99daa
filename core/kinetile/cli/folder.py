"""A folder for results, tried before anything is measured or judged."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

from kinetile.errors import BadOption

__all__ = ["try_folder"]


def try_folder(option: str, folder: Path, *, keep: bool) -> None:
    """Make a folder and see that it can be written to; unless it is to be kept, leave nothing there.

    Raises BadOption, with the option that names the folder, where it cannot be made or written to.
    """
    made: list[Path] = []
    try:
        made += [each for each in (folder, *folder.parents) if not keep and not each.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise BadOption(f"{option} {folder}: {error.strerror or error}") from error
    finally:
        for each in made:  # the innermost comes first
            with suppress(OSError):
                each.rmdir()
