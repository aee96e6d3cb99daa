"""Files that are written: complete or absent. No other module of kinetile or of its instruments writes a file
by its name, so no full disk, signal or kill destroys an old file (``tests/test_architecture.py``)."""

import glob
import os
import secrets
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from kinetile.errors import BadOption, KinetileError, RecordError
from kinetile.sources import check_mode


def writable_target(path: str | os.PathLike[str]) -> Path:
    """Returns the file that a path means, with links followed, for writing or replacing it as a whole. Raises
    OSError if the path is no regular file: a folder, a device, a pipe."""
    target = Path(os.path.realpath(path))
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return target
    check_mode(mode, "it is there and is no regular file, so it is not replaced")
    return target


def new_target(path: str | os.PathLike[str], overwrite: bool, refused: type[KinetileError]) -> Path:
    """Returns ``writable_target``; raises ``refused`` without one, or if it exists (unless ``overwrite``)."""
    with record_errors(f"{path} cannot be written", raised=refused):
        target = writable_target(path)
    if target.exists() and not overwrite:
        raise refused(
            f"{path} is there already: choose another name, or have it overwritten (overwrite=True, or "
            "--overwrite)"
        )
    return target


MARK = "made by kinetile"
"""The mark in pages and films: a new one of the same name replaces files with it."""


@contextmanager
def writing_new(path: str | os.PathLike[str], overwrite: bool) -> Iterator[BinaryIO]:
    """Yields a file that is at ``path``, complete, when the context is left; BadOption if a file without
    ``MARK`` is there already (unless ``overwrite``), or if it cannot be written."""
    with suppress(OSError):  # it does not exist, or cannot be read
        overwrite = overwrite or MARK.encode() in writable_target(path).read_bytes()
    new_target(path, overwrite, BadOption)
    with record_errors(f"{path} cannot be written", raised=BadOption), replacing(path) as file:
        yield file


@contextmanager
def record_errors(
    what: str, behind: str = "", of: type[Exception] = OSError, raised: type[KinetileError] = RecordError
) -> Iterator[None]:
    """Within this context an error of the system becomes a RecordError, or another one, with the action
    ``what`` that failed, the reason, and the text ``behind`` it. ``of`` is Exception for work of pyarrow,
    which may raise anything; MemoryError, too, for a damaged file."""
    try:
        yield
    except KinetileError:
        raise
    except of as error:
        raise raised(f"{what}: {reason(error)}{behind}") from error


def reason(error: Exception) -> str:
    """Returns the text of an error, in the system's own words if it has any."""
    return (isinstance(error, OSError) and error.strerror) or str(error)


def write_file(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Writes or replaces a file as a whole, text in UTF-8. Raises OSError as ``replacing``."""
    with replacing(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Yields a new file beside ``path``. It replaces ``path`` when the context is left: at once, with all of
    its content on the disk, and with the mode of the old file. The old file stays if a signal, a full disk or
    a kill interrupts it. Raises OSError if the new file cannot be written, or ``path`` is no regular file."""
    target = writable_target(path)
    mode = mode_of(target)

    def opened(name: str, flags: int) -> int:
        return os.open(name, flags, 0o666 if mode is None else mode | stat.S_IWUSR)

    fresh = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with open(fresh, "xb", opener=opened) as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if mode is not None:
            with suppress(OSError):
                fresh.chmod(mode)
        fresh.replace(target)
    except BaseException:
        with suppress(OSError):
            fresh.unlink(missing_ok=True)
        raise
    with suppress(OSError):  # the folder, too, is then on the disk
        descriptor = os.open(target.parent, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    _clear_up(target)


def mode_of(target: Path) -> int | None:
    """Returns the mode of a file; None without a file."""
    try:
        return stat.S_IMODE(target.stat().st_mode)
    except FileNotFoundError:
        return None


def _clear_up(target: Path) -> None:
    """Removes temporary files of killed writers of this file, if unchanged for a minute."""
    for left in target.parent.glob(f".{glob.escape(target.name)}.{'[0-9a-f]' * 8}.part"):
        with suppress(OSError):
            if time.time() - left.stat().st_mtime > 60.0:
                left.unlink()
