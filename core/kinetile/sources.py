"""Files that are read: regular ones.

A pipe may never have a writer, and a device may never end. So this module opens every file that a user names,
or that another process may have made.
"""

import errno
import os
import stat
from typing import BinaryIO

_FLAGS = os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)


def check_regular(path: str | os.PathLike[str]) -> None:
    """Raises OSError unless a path is a regular file; does not open it."""
    _check(os.stat(path).st_mode, path)


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """Opens a regular file for reading, in binary. Raises OSError, without waiting, for anything else."""
    check_regular(path)  # opening a device can have effects
    file = open(os.open(path, _FLAGS), "rb")  # noqa: SIM115 - the caller closes it
    try:
        _check(os.fstat(file.fileno()).st_mode, path)
    except BaseException:
        file.close()
        raise
    return file


def _check(mode: int, path: str | os.PathLike[str]) -> None:
    check_mode(mode, "it is no regular file, so it is not read", os.fspath(path))


def check_mode(mode: int, wrong: str, *name: str) -> None:
    """Raises OSError with the text ``wrong``, and perhaps the name, unless a mode is a regular file's."""
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), *name)
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, wrong, *name)
