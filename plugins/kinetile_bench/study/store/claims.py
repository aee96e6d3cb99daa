"""Who is at which task: a lock for each task that is under way, held by the process that runs the study.

The lock (``flock``) is the open file's and not a thing on disk, so a process that is killed holds it no
longer, and nobody needs to guess whether a claim is stale. Where there are no such locks, everybody gets
every claim: two processes then do some tasks twice, and a row is still one row, for it goes by its key.
"""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path

try:
    from fcntl import LOCK_EX, LOCK_NB, flock
except ImportError:  # Windows
    flock = None  # type: ignore[assignment]

from kinetile.errors import RecordError

__all__ = ["Claims", "locked"]

_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP}


class Claims:
    """The claims of this process, as files in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._held: dict[str, int] = {}

    def take(self, key: str) -> bool:
        """Claim a task; False where another process is at it. Raises RecordError if that cannot be done."""
        if flock is None:
            return True
        try:
            descriptor = locked(self._folder / key)
        except OSError as error:
            said = f"{self._folder} cannot be written: {error.strerror or error}"
            raise RecordError(f"{said}; the rows that were there are there") from error
        if descriptor is None:
            return False
        self._held[key] = descriptor
        return True

    def give_back(self, key: str) -> None:
        """Give up a claim, after the task's row is there, or because it will not be."""
        descriptor = self._held.pop(key, None)
        if descriptor is not None:
            with suppress(OSError):  # while it is locked, so that the file cannot be another's
                (self._folder / key).unlink()
            os.close(descriptor)

    def close(self) -> None:
        """Give up all claims, and take away what processes that were killed have left."""
        for key in list(self._held):
            self.give_back(key)
        for left in self._folder.iterdir():
            if self.take(left.name):
                self.give_back(left.name)


def locked(path: Path) -> int | None:
    """Open a file and lock it; return its descriptor, or None where another process has locked it.

    Where files cannot be locked, it is opened all the same. Raises OSError where it cannot be opened.
    """
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if flock is not None:
                _lock(descriptor)
            if os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor
        except BlockingIOError:
            os.close(descriptor)
            return None
        except FileNotFoundError:  # it was given back between opening and locking
            pass
        os.close(descriptor)


def _lock(descriptor: int) -> None:
    """Lock a file, where files can be locked. Raises BlockingIOError where another process has done so."""
    try:
        flock(descriptor, LOCK_EX | LOCK_NB)
    except BlockingIOError:
        raise
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
