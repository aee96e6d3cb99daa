"""Checks of files and folders before a command writes them: none is replaced unless the user allows it."""

import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import combinations
from pathlib import Path

from kinetile.errors import BadOption, RecordError

PARQUET = (".parquet",)
"""The ending of event files."""

_ENDINGS = {
    **{"--events": PARQUET, "--encounters": (".csv",), "--save-scene": (".toml",)},
    **{"--contacts": (), "--checkpoint": ()},
}
_FORMS = [".parquet", ".toml", ".csv", ".json", ".html", ".svg", ".png", ".pdf", ".gif", ".xyz", ".gsd"]


def check_ending(option: str, path: Path, endings: Sequence[str] = ()) -> str:
    """Returns the ending of a file that an option names, in lower case. Raises BadOption unless the ending is
    one of these; without ``endings``, if it belongs to another form of file."""
    ending = path.suffix.lower()
    if ending in endings or not (endings or ending in _FORMS):
        return ending
    listed = " or ".join(filter(None, ", ".join(endings or _FORMS).rpartition(", ")[::2]))
    how = "in" if endings else "otherwise than in"
    raise BadOption(f"{option} is {str(path)!r}; expected a name that ends {how} {listed}")


def check_files(files: Mapping[str, Path | None], overwrite: bool) -> None:
    """Raises BadOption unless the files of options have the right endings, are different and may be written.
    The files of ``--contacts``, ``--encounters`` and ``--save-scene`` may exist, and are overwritten."""
    given = [(what, path) for what, path in files.items() if path is not None]
    for what, path in given:
        if not path.name:
            raise BadOption(f"{what} names no file: expected the path of a file")
    for (one, path), (other, its_path) in combinations(given, 2):
        of_run = {"--events", "--contacts", "--encounters", "--checkpoint"} & {one, other}
        if of_run and _same_file(path, its_path):
            raise BadOption(f"{one} and {other} are one file, {path}: expected two, for one would be lost")
    for what, path in given:
        if what in _ENDINGS:
            check_ending(what, path, _ENDINGS[what])
        if what in ("--contacts", "--encounters", "--save-scene"):
            check_new(what, path, overwrite)


@contextmanager
def file_errors(what: str = "") -> Iterator[None]:
    """Within this context errors of files become BadOption: ``what``, an option and file, and the reason."""
    try:
        yield
    except OSError as error:
        why = str(error) if isinstance(error, RecordError) else error.strerror or str(error)
        raise BadOption(f"{what}: {why}" if what else why) from error


def check_new(option: str, path: Path, overwrite: bool) -> None:
    """Raises BadOption unless a file can be made, or replaced with ``overwrite``."""
    from kinetile.targets import writable_target

    with file_errors(f"{option} {path}"):
        target = writable_target(path)
    if target.exists() and not overwrite:
        raise BadOption(f"{option}: {path} is there already: choose another name, or say --overwrite")
    if not target.parent.is_dir():
        raise BadOption(f"{option} {path}: there is no folder {str(target.parent)!r}")


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:  # one of them does not exist yet
        return os.path.realpath(one) == os.path.realpath(other)


def try_folder(option: str, folder: Path, *, keep: bool) -> None:
    """Makes a folder and tries to write to it; unless it is to be kept, leaves nothing there. Raises
    BadOption, with the name of the option, if that fails."""
    made: list[Path] = []
    if folder.suffix.lower() in _FORMS and not folder.is_dir():
        raise BadOption(f"{option} is {str(folder)!r}, the name of a file; expected the name of a folder")
    try:
        with file_errors(f"{option} {folder}"):
            made += [each for each in (folder, *folder.parents) if not keep and not each.exists()]
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
    finally:
        for each in made:  # the innermost is first
            with suppress(OSError):
                each.rmdir()
