"""Log of an active run: its rows in batches, and each batch is complete or absent.

Parquet has its index at the end, so rows are first written to a file that is readable at every length::

    "kinetile rows 1\\n"                                    16 bytes
    head, batch, batch, ...                                 each: lengths, text, rows, checksum

``lengths`` are the lengths of the text and of the rows in bytes (two unsigned integers of 8 bytes), ``text``
is JSON, ``rows`` are rows (dtype LOG) as in memory, all little-endian. The text of the head has the columns,
the scene, and a number of its own; the text of a batch has the metadata at its time. ``checksum`` (4 bytes)
is the CRC-32 of the whole file up to it, without the other checksums, so old bytes of the disk cannot pass
for a batch. A batch counts if its lengths fit into the file and its checksum is right; after a batch that
does not count, nothing counts. A kill leaves a prefix of the rows; a failed write, on a full disk, is undone.

An Arrow IPC stream has no checksums: 298 of 400 flipped bits gave other rows and no error. With checksums in
its metadata, writing takes a third longer (317 ns a row, here 234).
"""

import hashlib
import json
import os
import secrets
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import RecordError
from kinetile.kernel.log import IN_BLOCK, LOG, TURNED, Fingerprint, digestible
from kinetile.scene.checks import shown

SIGNATURE = b"kinetile rows 1\n"

_ROW = LOG.newbyteorder("<")
_COLUMNS = [[name, _ROW[name].str] for name in _ROW.names or ()]
_LENGTHS = struct.Struct("<QQ")
_CHECKSUM = struct.Struct("<I")


class Beginning(NamedTuple):
    """Rows of a run up to its checkpoint: their number, the fingerprint of their contacts, and the scene."""

    rows: int
    fingerprint: str
    scene: str

    def check(self, rows: int, fingerprint: str, scene: str, name: str) -> None:
        """Raises RecordError unless a file begins with these rows."""
        expected = "expected the events of this very run, or another name for a file from here on"
        if _without_comment(scene) != _without_comment(self.scene):
            raise RecordError(f"{name} holds events of another scene: {expected}")
        if rows < self.rows:
            raise RecordError(
                f"{name} holds {rows:,} events, and there were {self.rows:,} when the run was saved: "
                f"{expected}"
            )
        if fingerprint != self.fingerprint:
            raise RecordError(f"{name} holds events of another run of this scene: {expected}")


def _without_comment(scene: str) -> str:
    """Returns a scene's text without the line of its origin."""
    return scene.partition("\n")[2] if scene.startswith("#") else scene


class LogWriter:
    """Writer of a log, into an empty file; OSError if the disk has no room, with nothing written."""

    def __init__(self, file: "LogFile", checksum: int) -> None:
        self._file = file
        self._checksum = checksum

    @classmethod
    def begin(cls, file: "LogFile", scene: str) -> "LogWriter":
        """Returns the writer of a new log, with a scene in its head."""
        writer = cls(file, zlib.crc32(SIGNATURE))
        head = json.dumps({"columns": _COLUMNS, "scene": scene, "log": secrets.token_hex(8)})
        file.write(SIGNATURE)
        writer.write(head, np.zeros(0, _ROW))
        return writer

    @classmethod
    def behind(cls, file: "LogFile", at: tuple[int, int]) -> "LogWriter":
        """Returns a writer that continues at a place in a log (``LogReader.at``); discards the rest."""
        file.go_to(at[0])
        return cls(file, at[1])

    def write(self, text: str, rows: Array) -> None:
        """Writes a batch, and passes it to the system: it survives the process."""
        content = np.ascontiguousarray(rows, _ROW).view(np.uint8).data
        head = _LENGTHS.pack(len(text.encode()), len(content)) + text.encode()
        checksum = zlib.crc32(content, zlib.crc32(head, self._checksum))
        self._file.write(head, content, _CHECKSUM.pack(checksum))
        self._checksum = checksum


class LogReader:
    """Reader of a log: yields its rows batch by batch (dtype LOG), from front to back, once. ``scene`` is the
    scene as TOML; ``text`` the metadata after the last yielded rows, "" before the first batch; ``rest``, at
    the end, the number of bytes after the last batch that counts. RecordError, with the file's ``name``, for
    a file that is no log, has no head, or has other columns."""

    def __init__(self, file: BinaryIO, name: str) -> None:
        self._file = file
        self._name = name
        self.text = ""
        self.rest = 0
        file.seek(0)
        if file.read(len(SIGNATURE)) != SIGNATURE:
            raise RecordError(
                f"{name} is nothing that kinetile can make an event file of: expected the FILE.partial of a "
                "run that was killed"
            )
        self._size = os.fstat(file.fileno()).st_size
        self._checksum = zlib.crc32(SIGNATURE)
        head = self._next()
        if head is None:
            raise RecordError(f"{name} is cut off, or damaged, before its first event: there is none in it")
        try:
            fields = json.loads(head[0])
            columns, self.scene = fields["columns"], str(fields["scene"])
            names = ", ".join(str(each) for each, _ in columns)
        except (ValueError, RecursionError, LookupError, TypeError) as error:
            raise RecordError(f"{name} has a head that no run writes: {shown(error)}") from error
        if columns != _COLUMNS:
            raise RecordError(
                f"{name} is of another version of kinetile, with the columns {shown(names)}: only that "
                "version can read it"
            )

    @property
    def at(self) -> tuple[int, int]:
        """The end of the last batch that was yielded, and the checksum up to there."""
        return self._file.tell(), self._checksum

    def find(self, beginning: Beginning) -> tuple[tuple[int, int], Array]:
        """Returns the end of the last whole batch of a beginning's rows, and its rows after that; RecordError
        if the log begins with other rows, or has fewer."""
        seal, have, at, cut = Seal(), 0, self.at, np.zeros(0, LOG)
        for rows in self:
            cut = rows[: beginning.rows - have]
            seal.add(cut)
            if len(cut) < len(rows):
                break
            have, at, cut = have + len(rows), self.at, cut[:0]
        beginning.check(have + len(cut), seal.fingerprint, self.scene, self._name)
        return at, cut

    def __iter__(self) -> Iterator[Array]:
        while (found := self._next()) is not None:
            self.text, content, first = found[0].decode(errors="replace"), found[1], len(found[0])
            yield np.frombuffer(content, _ROW, offset=first).astype(LOG, copy=False)
        self.rest = self._size - self._file.tell()

    def _next(self) -> tuple[bytes, bytes] | None:
        """Returns text, and text and rows, of the next batch if it counts; else None, and stays before it."""
        at = self._file.tell()
        lengths = self._file.read(_LENGTHS.size)
        if len(lengths) == _LENGTHS.size:
            text, rows = _LENGTHS.unpack(lengths)
            if (
                text
                and not rows % _ROW.itemsize
                and text + rows + _CHECKSUM.size <= self._size - self._file.tell()
            ):
                content = self._file.read(text + rows)
                checksum = zlib.crc32(content, zlib.crc32(lengths, self._checksum))
                if self._file.read(_CHECKSUM.size) == _CHECKSUM.pack(checksum):
                    self._checksum = checksum
                    return content[:text], content
        self._file.seek(at)
        return None


def holds_nothing(file: BinaryIO) -> bool:
    """Returns True if a file can be overwritten without loss: it is empty, or a log without rows."""
    if not os.fstat(file.fileno()).st_size:
        return True
    try:
        log = LogReader(file, "")
        return not any(len(rows) for rows in log) and not log.rest
    except RecordError:
        return False


class Seal:
    """Digest of an event file's rows, scene and metadata, in their order: it shows damage, not malice."""

    def __init__(self) -> None:
        self._contacts = Fingerprint()
        self._rows = hashlib.sha256()

    def add(self, rows: Array) -> None:
        """Continues with the next rows (dtype LOG)."""
        for first in range(0, len(rows), IN_BLOCK):  # a copy of all would be as large as they are
            some = rows[first : first + IN_BLOCK]
            self._contacts.update(digestible(some[some["b"] > TURNED]))
            self._rows.update(np.ascontiguousarray(some, _ROW).view(np.uint8).data)

    @property
    def fingerprint(self) -> str:
        """The fingerprint of the contacts, as a simulation has it."""
        return self._contacts.hexdigest()

    def digest(self, *texts: str) -> str:
        """Hex digest of all bits of the rows and of these texts."""
        whole = self._rows.copy()
        for text in texts:
            whole.update(hashlib.sha256(text.encode()).digest())
        return whole.hexdigest()


class LogFile:
    """An empty file, written from front to back; a failed write leaves it unchanged."""

    def __init__(self, descriptor: int) -> None:
        self._file = open(descriptor, "wb", buffering=0)  # noqa: SIM115 - `close` does
        self.position = 0

    @property
    def closed(self) -> bool:
        """True if the file is closed."""
        return self._file.closed

    def write(self, *parts: bytes | memoryview) -> None:
        """Writes all of these bytes."""
        try:
            for part in parts:
                rest = memoryview(part)
                while rest:
                    rest = rest[self._file.write(rest) :]
        except BaseException:
            with suppress(OSError):
                self.go_to(self.position)
            raise
        self.position += sum(map(len, parts))

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def go_to(self, position: int) -> None:
        """Continues from a position in the file; discards the rest."""
        os.ftruncate(self._file.fileno(), position)
        self._file.seek(position)
        self.position = position

    def sync(self) -> None:
        """Brings everything to the disk."""
        os.fsync(self._file.fileno())

    def reader(self) -> BinaryIO:
        """Returns the file for reading from its beginning; nothing can be written until that is closed."""
        reader = open(self._file.fileno(), "rb", closefd=False)  # noqa: SIM115 - the caller closes it
        reader.seek(0)
        return reader

    @property
    def gone(self) -> bool:
        """True if the file has been deleted while it was open."""
        return os.fstat(self._file.fileno()).st_nlink == 0

    def is_at(self, path: Path) -> bool:
        """Returns True if a path means this file."""
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), path.stat())
        except OSError:
            return False
