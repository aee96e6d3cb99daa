"""One writer a file: while somebody writes FILE.partial, nobody else begins to.

The writer holds a lock (``flock``) on the file that it writes, from before the first byte until the file has
its own name. The lock is the open file's and not a thing on disk: a process that is killed holds it no
longer, and what it has left, which has no footer and cannot be read, is written over by the next.

Where there is no ``flock`` (Windows, some network file systems), nobody can tell a file that is being written
from one that was left, so a FILE.partial that is there is refused until somebody takes it away.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path

try:
    from fcntl import LOCK_EX, LOCK_NB, flock
except ImportError:  # Windows
    flock = None  # type: ignore[assignment]

from kinetile.errors import RecordError
from kinetile.records.reserved_file import ReservedFile

__all__ = ["open_alone"]

_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP}
_FLAGS = os.O_RDWR | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0)
_FOOTER = b"PAR1"


def open_alone(partial: Path, overwrite: bool) -> ReservedFile:
    """Open FILE.partial, empty and for nobody else.

    Raises RecordError where somebody else is writing it, or where it holds all events of a run that could not
    give it its name (unless ``overwrite``); OSError where it cannot be opened.
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
                    "There are no locks here to tell the two apart: remove it if no run is writing it"
                )
            if file.is_at(partial):  # else it has got its own name since it was opened
                if not overwrite and _is_whole(descriptor):
                    raise RecordError(
                        f"{partial} holds the events of an earlier run, which could not get the name it was "
                        "to have: move it away, or have it overwritten (overwrite=True, or --overwrite)"
                    )
                os.ftruncate(descriptor, 0)
                return file
        except BaseException:
            file.close()
            raise
        file.close()


def _open(partial: Path) -> tuple[int, bool]:
    """Open a file, or make it; return its descriptor and whether it is new."""
    while True:
        with suppress(FileExistsError):
            return os.open(partial, _FLAGS | os.O_CREAT | os.O_EXCL, 0o666), True
        with suppress(FileNotFoundError):
            return os.open(partial, _FLAGS), False


def _lock(descriptor: int, partial: Path) -> bool:
    """Lock a file; return whether there are locks. Raises RecordError where somebody else holds this one."""
    if flock is None:
        return False
    try:
        flock(descriptor, LOCK_EX | LOCK_NB)
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


def _is_whole(descriptor: int) -> bool:
    """Whether a file has a footer, so that it can be read."""
    size = os.fstat(descriptor).st_size
    os.lseek(descriptor, max(size - len(_FOOTER), 0), os.SEEK_SET)
    tail = os.read(descriptor, len(_FOOTER))
    os.lseek(descriptor, 0, os.SEEK_SET)
    return tail == _FOOTER
