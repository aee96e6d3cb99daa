"""Locks: a file that is being written has one writer.

The writer holds a lock (``flock``) on the open file from before the first byte until FILE has its name; a
killed process no longer holds it. Without ``flock`` (Windows, some network file systems) nobody can
distinguish a file that is being written from an abandoned one, so an existing FILE.partial is refused until
it is removed; it can be read, and stays.
"""

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
from kinetile.records.log import SIGNATURE, LogFile, holds_nothing
from kinetile.sources import open_regular

_RECOVER = "`kinetile recover"
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP}
_BINARY = getattr(os, "O_BINARY", 0)
_FLAGS = os.O_RDWR | _BINARY | getattr(os, "O_NOFOLLOW", 0)


def open_alone(partial: Path, overwrite: bool, *, as_it_is: bool = False, mode: int | None = None) -> LogFile:
    """Opens FILE.partial, empty and exclusively; or ``as_it_is``. A new one has a mode, or the umask's.
    RecordError if another process is writing it, or it holds anything (unless ``overwrite``)."""
    while True:
        descriptor, new = _open(partial, 0o666 if mode is None else mode | 0o600)
        file = LogFile(descriptor)
        try:
            _check_kind(os.fstat(descriptor), partial)
            if not _lock(descriptor, partial) and not new:
                raise RecordError(
                    f"{partial} is there: another run is writing it, or one that was killed has left it. "
                    f"There are no locks here to tell the two apart: if no run is writing it, {_RECOVER} "
                    f"{partial}` makes an event file of it; then remove it"
                )
            if file.is_at(partial):  # else it has been renamed since it was opened
                if not as_it_is:
                    if not overwrite:
                        _check_contents(file, partial)
                    os.lseek(descriptor, 0, os.SEEK_SET)
                    os.ftruncate(descriptor, 0)
                return file
        except BaseException:
            file.close()
            raise
        file.close()


def _check_contents(file: LogFile, partial: Path) -> None:
    with file.reader() as content:
        if holds_nothing(content):
            return
        content.seek(0)
        found = "is there, and is nothing that a run leaves: move it away,"
        if content.read(len(SIGNATURE)) == SIGNATURE:
            found = (
                f"has been left by a run that was killed: {_RECOVER} {partial}` makes an event file of it;"
            )
    raise RecordError(f"{partial} {found} or have it overwritten (overwrite=True, or --overwrite)")


def open_left(partial: Path) -> tuple[BinaryIO, bool]:
    """Opens FILE.partial to read it; returns it, and True if it certainly has no writer and cannot get one
    meanwhile. RecordError if it has a writer, OSError if it cannot be opened."""
    file = open_regular(partial)
    try:
        return file, _lock(file.fileno(), partial, shared=True)
    except BaseException:
        file.close()
        raise


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Excludes other writers, within this context, of a file that is replaced repeatedly, by a lock on
    FILE.lock, which is then removed; RecordError if there is another writer. Without locks, or if FILE.lock
    cannot be made, it excludes nobody."""
    target = Path(os.path.realpath(path))
    name = target.with_name(target.name + ".lock")
    held, process = None, os.getpid()
    try:
        held = open_alone(name, overwrite=True, as_it_is=True) if flock is not None else None
    except RecordError:
        raise
    except OSError:  # FILE cannot be written in such a folder either, and its writer reports it
        pass
    try:
        yield
    finally:
        if held is not None:
            with suppress(OSError):
                if process == os.getpid() and name.stat().st_size == 0:  # else its parent's, or another file
                    name.unlink()
            held.close()


def _open(partial: Path, mode: int) -> tuple[int, bool]:
    while True:
        with suppress(FileExistsError):
            return os.open(partial, _FLAGS | os.O_CREAT | os.O_EXCL, mode), True
        with suppress(FileNotFoundError):
            _check_kind(os.lstat(partial), partial)
            return os.open(partial, _FLAGS), False


def _check_kind(found: os.stat_result, partial: Path) -> None:
    """Raises RecordError for a folder, a link, a pipe or a device: it is left unchanged."""
    if not stat.S_ISREG(found.st_mode):
        raise RecordError(f"{partial} is there and is no regular file: move it away")


def _lock(descriptor: int, partial: Path, *, shared: bool = False) -> bool:
    """Locks a file; returns False without locks. Raises RecordError if another run holds this one."""
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
