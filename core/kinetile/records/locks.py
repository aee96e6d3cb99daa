"""Locks: a file that is being written has one writer.

The writer holds a lock (``flock``) on the file that it writes, from before the first byte until FILE has its
name. The lock is the open file's and not a thing on disk: a process that is killed holds it no longer, and
what it has left can be read by whoever comes then. It is not written over unasked where there are rows in it.

Where there is no ``flock`` (Windows, some network file systems), nobody can tell a file that is being written
from one that was left, so a FILE.partial that is there is refused until somebody takes it away. It can be
read, and stays then.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

try:
    from fcntl import LOCK_EX, LOCK_NB, LOCK_SH, flock
except ImportError:  # Windows
    flock = None  # type: ignore[assignment]

from kinetile.errors import RecordError
from kinetile.records.log import SIGNATURE, ReservedFile, holds_nothing

_RECOVER = "`kinetile recover"
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP}
_BINARY = getattr(os, "O_BINARY", 0)
_FLAGS = os.O_RDWR | _BINARY | getattr(os, "O_NOFOLLOW", 0)


def open_alone(partial: Path, overwrite: bool, *, as_it_is: bool = False) -> ReservedFile:
    """Opens FILE.partial, empty and for nobody else; or ``as_it_is``.

    Raises RecordError where somebody else is writing it, or where it holds events of a run that was killed,
    or anything else (unless ``overwrite``); OSError where it cannot be opened.
    """
    while True:
        descriptor, new = _open(partial)
        file = ReservedFile(descriptor)
        try:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise OSError(errno.EINVAL, f"{partial} is there and is no regular file")
            if not _lock(descriptor, partial) and not new:
                raise RecordError(
                    f"{partial} is there: another run is writing it, or one that was killed has left it. "
                    f"There are no locks here to tell the two apart: if no run is writing it, {_RECOVER} "
                    f"{partial}` makes an event file of it; then remove it"
                )
            if file.is_at(partial):  # else it has got its own name since it was opened
                if as_it_is:
                    return file
                if not overwrite:
                    _check_contents(file, partial)
                os.lseek(descriptor, 0, os.SEEK_SET)
                os.ftruncate(descriptor, 0)
                return file
        except BaseException:
            file.close()
            raise
        file.close()


def _check_contents(file: ReservedFile, partial: Path) -> None:
    """Raises RecordError where a file holds what would be lost if it were written over."""
    with file.reader() as content:
        if holds_nothing(content):
            return
        content.seek(0)
        if content.read(len(SIGNATURE)) == SIGNATURE:
            said = f"has been left by a run that was killed: {_RECOVER} {partial}` makes an event file of it;"
        else:
            said = "is there, and is nothing that a run leaves: move it away,"
    raise RecordError(f"{partial} {said} or have it overwritten (overwrite=True, or --overwrite)")


def open_left(partial: Path) -> tuple[BinaryIO, bool]:
    """Opens FILE.partial to read it; returns it, and whether it is certain that nobody is writing it.

    Raises RecordError where somebody is; OSError where it cannot be opened. Others may read it meanwhile, and
    nobody begins to write it.
    """
    if not stat.S_ISREG(partial.stat().st_mode):
        raise OSError(errno.EINVAL, "it is no regular file")
    file = partial.open("rb")
    try:
        return file, _lock(file.fileno(), partial, shared=True)
    except BaseException:
        file.close()
        raise


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Be the only writer, within this context, of a file that is replaced as a whole again and again, and so
    cannot be locked itself: FILE.lock is, and is removed when the context is left.

    Raises RecordError where there is another writer. Where there are no locks, or FILE.lock cannot be made,
    nobody is kept away.
    """
    target = Path(os.path.realpath(path))
    name = target.with_name(target.name + ".lock")
    held = None
    if flock is not None:
        try:
            held = open_alone(name, overwrite=True, as_it_is=True)
        except RecordError:
            raise
        except OSError:  # nor can FILE be written in such a folder, which its writer says
            pass
    try:
        yield
    finally:
        if held is not None:
            with suppress(OSError):
                if name.stat().st_size == 0:  # else it is somebody's file of this name
                    name.unlink()
            held.close()


def _open(partial: Path) -> tuple[int, bool]:
    """Opens a file, or makes it; returns its descriptor and whether it is new."""
    while True:
        with suppress(FileExistsError):
            return os.open(partial, _FLAGS | os.O_CREAT | os.O_EXCL, 0o666), True
        with suppress(FileNotFoundError):
            return os.open(partial, _FLAGS), False


def _lock(descriptor: int, partial: Path, *, shared: bool = False) -> bool:
    """Locks a file; returns whether there are locks. Raises RecordError where another run holds this one."""
    if flock is None:
        return False
    try:
        flock(descriptor, (LOCK_SH if shared else LOCK_EX) | LOCK_NB)
    except BlockingIOError as error:
        raise RecordError(
            f"{partial.with_suffix('')} is being written by another run, which holds {partial}: wait for "
            "its end, or choose another name"
        ) from error
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return False
    return True
