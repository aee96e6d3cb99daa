"""Where a file may be written: what a path means, before anything there is replaced."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

__all__ = ["writable_target"]


def writable_target(path: str | os.PathLike[str]) -> Path:
    """Return the file that a path means, links followed, which is to be written or replaced as a whole.

    Raises OSError where something is that is no regular file: a folder, a device, a pipe.
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
