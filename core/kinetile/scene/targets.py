"""Targets of writing: a file that is complete or absent."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from kinetile.errors import BadOption


def writable_target(path: str | os.PathLike[str]) -> Path:
    """Returns the file that a path means, links followed, for writing or replacing it as a whole.

    Raises OSError if there is something that is no regular file: a folder, a device, a pipe.
    """
    target = Path(os.path.realpath(path))
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return target
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is there and is no regular file, so it is not replaced")
    return target


@contextmanager
def writing_new(path: str | os.PathLike[str], overwrite: bool) -> Iterator[BinaryIO]:
    """Yields a file that is at ``path``, complete, when the context is left.

    Raises BadOption where something is there already (unless ``overwrite``), or where it cannot be written.
    """
    try:
        target = writable_target(path)
        if target.exists() and not overwrite:
            raise BadOption(
                f"{path} is there already: choose another name, or have it overwritten (overwrite=True, or "
                "--overwrite)"
            )
        with replacing(target) as file:
            yield file
    except OSError as error:
        raise BadOption(f"{path} cannot be written: {error.strerror or error}") from error


@contextmanager
def replacing(target: Path, *, sync: bool = True) -> Iterator[BinaryIO]:
    """Yields a new file in the folder of ``target``, which it replaces when the context is left: at once,
    and, with ``sync``, with all of its content on the disk.

    If a signal, a full disk or a kill interrupts it, the old file stays. Raises OSError if
    the file cannot be made or written.
    """
    fresh = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with fresh.open("xb") as file:
            yield file
            if sync:
                file.flush()
                os.fsync(file.fileno())
        fresh.replace(target)
    except BaseException:
        with suppress(OSError):
            fresh.unlink(missing_ok=True)
        raise
