"""A file that is there as a whole or not at all: written under another name, brought to the disk, then
named."""

from __future__ import annotations

import glob
import os
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from kinetile.errors import RecordError
from kinetile.run.saving.form import SIGNATURE
from kinetile.scene.targets import replacing, writable_target

__all__ = ["check_target", "read_whole", "write_whole"]

_AT_ONCE = 1 << 24


def check_target(path: str | os.PathLike[str]) -> Path:
    """Return the file that a path means, links followed; RecordError where a saved simulation is not to be
    written there, for there is something else."""
    name = os.fspath(path)
    if not Path(name).name:
        raise RecordError(f"{name!r} names no file: expected the path of a file")
    try:
        target = writable_target(path)
        if target.exists():
            with target.open("rb") as file:
                if file.read(len(SIGNATURE)) not in (SIGNATURE, b""):
                    raise RecordError(
                        f"{name} is there and is no saved simulation, so it is not replaced: choose another "
                        "name, or move it away"
                    )
    except RecordError:
        raise
    except OSError as error:
        raise _unwritable(name, error) from error
    return target


def write_whole(path: str | os.PathLike[str], pieces: Iterable[bytes | memoryview]) -> None:
    """Write a file, in the place of a saved simulation that may be there. Whatever ends this on its way, a
    signal, a full disk, a kill, what was there is there.

    Raises RecordError where it cannot be written.
    """
    target = check_target(path)
    try:
        with replacing(target) as file:
            for piece in pieces:
                view = memoryview(piece)
                for at in range(0, len(view), _AT_ONCE):  # a signal can come between two writes
                    file.write(view[at : at + _AT_ONCE])
    except OSError as error:
        raise _unwritable(os.fspath(path), error) from error
    _sync_folder(target.parent)
    _clear_up(target)


def _clear_up(target: Path) -> None:
    """Remove what was left by writers of this file that were killed: what nobody has touched for a minute."""
    for left in target.parent.glob(f".{glob.escape(target.name)}.{'[0-9a-f]' * 8}.part"):
        with suppress(OSError):
            if time.time() - left.stat().st_mtime > 60.0:
                left.unlink()


def read_whole(path: str | os.PathLike[str]) -> bytes:
    """Return what is in a file; RecordError where it cannot be read."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise RecordError(f"{os.fspath(path)} cannot be read: {error.strerror or error}") from error


def _unwritable(name: str, error: OSError) -> RecordError:
    return RecordError(
        f"{name} cannot be written: {error.strerror or error}; what was there under this name is as it was"
    )


def _sync_folder(folder: Path) -> None:
    """Bring a name to the disk, where folders can be."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
