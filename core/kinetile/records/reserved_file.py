"""A file that owns its space before it is told what to write there.

What has to be said at the end of a file must have its room while the rest is written. So the space for a
batch of rows *and* for the last word after it is taken from the disk first, by ``posix_fallocate`` (which
promises that writes inside the range will not fail for want of space) or, where that is missing, by writing
zeros. If the space is not to be had, nothing has been written yet and the last word still fits into what is
owned.
"""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

__all__ = ["ReservedFile"]

_NOT_SUPPORTED = {errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP}
_ZEROS = bytes(1 << 20)


class ReservedFile:
    """An empty file that is open, written from front to back, as a sink for pyarrow (write, flush, tell,
    closed)."""

    def __init__(self, descriptor: int) -> None:
        self._file = open(descriptor, "wb", buffering=0)  # noqa: SIM115 - `close` does
        self._owned = 0
        self.position = 0
        self.torn = False

    @property
    def closed(self) -> bool:
        """Whether the file is closed."""
        return self._file.closed

    def reserve(self, size: int) -> None:
        """Own the next ``size`` bytes; OSError if the disk has not got them, with nothing written."""
        missing = self.position + size - self._owned
        if missing <= 0:
            return
        try:
            self._extend(missing)
        except OSError:
            os.ftruncate(self._file.fileno(), self._owned)
            raise
        self._owned += missing

    def _extend(self, size: int) -> None:
        if hasattr(os, "posix_fallocate"):
            try:
                os.posix_fallocate(self._file.fileno(), self._owned, size)
            except OSError as error:
                if error.errno not in _NOT_SUPPORTED:
                    raise
            else:
                return
        self._file.seek(self._owned)
        while size > 0:
            size -= self._put(_ZEROS[:size])
        self._file.seek(self.position)

    def _put(self, data: bytes | memoryview) -> int:
        written = self._file.write(data)
        if not written:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return written

    def write(self, *parts: bytes | memoryview) -> int:
        """Write all of these bytes and return how many; ``torn`` tells for ever that this has failed."""
        try:
            for part in parts:
                rest = memoryview(part)
                while rest:
                    rest = rest[self._put(rest) :]
        except BaseException:
            self.torn = True
            with suppress(OSError):
                self._file.seek(self.position)
            raise
        size = sum(map(len, parts))
        self.position += size
        return size

    def tell(self) -> int:
        """How many bytes have been written."""
        return self.position

    def flush(self) -> None:
        """Nothing is buffered here, so nothing is done."""

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def go_to(self, position: int) -> None:
        """Go on from a position in what is there; what is behind it is gone."""
        os.ftruncate(self._file.fileno(), position)
        self._file.seek(position)
        self.position = self._owned = position

    def trim(self) -> None:
        """Give back what was reserved and not used."""
        os.ftruncate(self._file.fileno(), self.position)
        self._owned = self.position

    def sync(self) -> None:
        """Bring everything to the disk."""
        os.fsync(self._file.fileno())

    def reader(self) -> BinaryIO:
        """Return the file to be read, from its beginning; nothing can be written before that is closed, and
        closing it leaves the file open."""
        reader = open(self._file.fileno(), "rb", closefd=False)  # noqa: SIM115 - whoever asks closes it
        reader.seek(0)
        return reader

    @property
    def gone(self) -> bool:
        """Whether the file has been deleted while it was open."""
        return os.fstat(self._file.fileno()).st_nlink == 0

    def is_at(self, path: Path) -> bool:
        """Whether a path means this file."""
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), path.stat())
        except OSError:
            return False
