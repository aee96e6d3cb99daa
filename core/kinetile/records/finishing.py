"""Event files made from logs (``kinetile.records.log``): by the recorder when it closes, and by ``recover``
after a kill, in one way, so every run tests it.

Parquet beside the log during the run would need as much disk; and if the disk has no room for the event file,
it can be made on another disk. The price is about a second for 700,000 rows at the end. The log is removed
when the event file is on the disk. An interruption leaves the log unchanged.
"""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import RecordError
from kinetile.kernel.log import LOG
from kinetile.lazy import needed
from kinetile.records.locks import open_left
from kinetile.records.log import SIGNATURE, LogReader, Seal
from kinetile.sources import open_regular
from kinetile.targets import new_target, record_errors, replacing

KEYS = ("kinetile", "kinetile.scene", "kinetile.digest")
"""The keys of a file's metadata: as JSON, the scene as TOML, and the digest."""
LONGEST_SCENE = 2**31 - 1
"""Bytes of TOML: pyarrow would stop at 1e8, about a million discs."""
PARTIAL = ".partial"
"""The suffix of a log, behind the name of its event file."""

_COLUMNS = LOG.names or ()
_FEW_VALUES = ["epoch", "a", "b"]  # dictionaries help here; other columns take forty times as long
_ENCODING = {name: "BYTE_STREAM_SPLIT" for name in _COLUMNS if LOG[name].kind == "f"}
_ENCODING["tick"] = "DELTA_BINARY_PACKED"
_ROWS_A_GROUP = 1 << 17


class Recovered(NamedTuple):
    """An event file made from a log: ``status`` is "killed", or the status that the run still wrote; ``time``
    is its end; ``left_over`` is the number of bytes at the log's end that are no whole batch; ``kept`` is
    True if the log still exists."""

    path: Path
    rows: int
    status: str
    time: float
    left_over: int
    kept: bool


def recover(
    path: str | os.PathLike[str], out: str | os.PathLike[str] | None = None, *, overwrite: bool = False
) -> Recovered:
    """Makes an event file from FILE.partial, the log of a killed run, with the status "killed". If a run
    ended without making its event file, it has all rows and the status of that end. Without ``out`` it
    becomes FILE, and FILE.partial is removed, unless it has unreadable bytes; with ``out`` it stays.

    Raises MissingExtra without pyarrow, and RecordError if the run is still active, if this is no such file
    or holds no batch of rows, and if the event file exists already (unless ``overwrite``) or cannot be
    written: then FILE.partial is unchanged.
    """
    pyarrow_modules()
    partial = Path(path)
    if out is None and (partial.suffix != PARTIAL or partial.stem == ""):
        raise RecordError(
            f"{partial} does not end in {PARTIAL}, so it does not say what its event file is to be called: "
            "expected FILE.partial, or a name for the event file (out=..., or --out)"
        )
    name = partial.with_suffix("") if out is None else Path(out)
    with record_errors(f"{partial} cannot be read"):
        log, alone = open_left(partial)
    with log:
        target = event_target(name, overwrite)
        if target.exists() and os.path.samestat(os.fstat(log.fileno()), target.stat()):
            raise RecordError(f"{name} is the file to recover from: expected another name for the event file")
        with record_errors(f"{name} cannot be written", f"; {partial} is as it was", of=Exception):
            made = finish(log, str(partial), target, overwrite)
        remove = out is None and alone and not made.left_over
        if remove:
            partial.unlink()
    return made._replace(path=name, kept=not remove)


def finish(log: BinaryIO, its_name: str, target: Path, overwrite: bool, last: str = "") -> Recovered:
    """Makes an event file from an open log, and gives it its name; ``last`` is the metadata of its end, if
    known. Raises RecordError if the log has no batch or ``target`` has been made meanwhile, the error of the
    system or of pyarrow if the file cannot be written; then no file has changed."""
    reader = LogReader(log, its_name)
    with replacing(target) as file:
        metadata = _write(reader, its_name, file, last)
        if not overwrite and target.exists():
            raise RecordError(f"{target} has come to be there meanwhile")
    rows, status, time = (metadata[name] for name in ("rows", "status", "time"))
    return Recovered(target, rows, status, time, reader.rest, True)


def _write(reader: LogReader, its_name: str, file: Any, last: str) -> dict[str, Any]:
    pa, pq = pyarrow_modules()
    schema = pa.schema([(name, pa.from_numpy_dtype(LOG[name])) for name in _COLUMNS])
    seal, count = Seal(), 0
    writer = pq.ParquetWriter(
        file,
        schema,
        compression="snappy",
        use_dictionary=_FEW_VALUES,
        column_encoding=_ENCODING,
        write_page_checksum=True,
    )
    try:
        for rows in _groups(reader):
            writer.write_table(pa.table([rows[name] for name in _COLUMNS], schema=schema))
            seal.add(rows)
            count += len(rows)
        if not reader.text:
            raise RecordError(f"{its_name} is of a run that was killed before it began: no event is in it")
        metadata: dict[str, Any] = json.loads(last or reader.text)
        if metadata["status"] == "running":
            metadata["status"] = "killed"
        metadata |= {"rows": count, "fingerprint": seal.fingerprint}
        text = json.dumps(metadata)
        texts = (text, reader.scene, seal.digest(text, reader.scene))
        writer.add_key_value_metadata(dict(zip(KEYS, texts, strict=True)))
        writer.close()
    except BaseException:
        writer.is_open = False  # else the garbage collector would write a footer
        raise
    return metadata


def _groups(reader: LogReader) -> Iterator[Array]:
    """Yields all rows in groups of one size: so the same rows give the same file, whatever the batches."""
    waiting, many = list[Array](), 0
    for rows in reader:
        for piece in np.split(rows, range(_ROWS_A_GROUP - many, len(rows), _ROWS_A_GROUP)):
            waiting.append(piece)
            many += len(piece)
            if many == _ROWS_A_GROUP:
                yield np.concatenate(waiting)
                waiting, many = [], 0
    if many:
        yield np.concatenate(waiting)


def event_target(name: Path, overwrite: bool) -> Path:
    """Returns the event file to write, with links followed; RecordError if it must not be written."""
    if not name.name:
        raise RecordError(f"{str(name)!r} names no file: expected the path of an event file")
    return new_target(name, overwrite, RecordError)


def is_log(path: Path) -> bool:
    """Returns True if a file begins like the log of a run."""
    with open_regular(path) as file:
        return file.read(len(SIGNATURE)) == SIGNATURE


def pyarrow_modules() -> tuple[Any, Any]:
    """Returns pyarrow and pyarrow.parquet; MissingExtra without them."""
    what = "Reading and writing event files", "pyarrow", "records"
    return needed(*what), needed(*what, "pyarrow.parquet")
