"""Files of saved runs: a snapshot as a NumPy ``.npz`` archive, which holds no pickle, with a JSON head.

::

    kinetile_saved_run.npy    the head: JSON as bytes; values in words, and the meaning of each array
    plans.npy, ...            flight plans, pairs that pass, waiting commands, counts, clock
    contacts.npy, ...         contacts so far, interactive commands, waiting rows, arrays of the head
    the archive's comment     SHA-256 of the file, in hexadecimal, with 64 zero bytes instead of itself

``numpy.load`` reads such a file from any writer. The CRC of each member does not cover names, lengths and the
directory, so the checksum is over all bytes, and nothing is used before it is verified. A file contains
numbers, text and names of phases, and no code.
"""

import copyreg
import hashlib
import json
import os
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import KinetileError, RecordError
from kinetile.kernel.clock import Clock
from kinetile.kernel.log import ANSWER, CONTACT, CONTACT_ROW, LOG, Fingerprint, digestible
from kinetile.kernel.tables import CARRIED_ROWS, COMMAND
from kinetile.run.compose import CommandSupport
from kinetile.run.engine.bounds import NO_SKIN, Bounds
from kinetile.run.engine.commands import History, KindHistory, Planned
from kinetile.run.engine.ledger import Entries
from kinetile.run.engine.state import Contents, RunState, numbers_of
from kinetile.run.saving.snapshot import SavedPhases, Snapshot, check_state
from kinetile.scene import Response, Scene, Settings
from kinetile.scene.checks import shown
from kinetile.scene.commands import OF_CLASS
from kinetile.scene.shapes import Shape
from kinetile.sources import open_regular
from kinetile.targets import reason, record_errors, replacing, writable_target

MAGIC = "kinetile_saved_run"
_FIRST_NAME = slice(30, 30 + len(MAGIC) + 4)
"""The place of the first member's name in an archive: it identifies our files."""
_CHECKSUM = 64
_AT_ONCE = 1 << 24
_AS_IT_WAS = "; what was there under this name is as it was"
_NOT_SO = (TypeError, ValueError, LookupError, ArithmeticError, AttributeError, RecursionError, MemoryError)

Arrays = dict[str, Array]


def pack(snapshot: Snapshot, file: BinaryIO, note: Mapping[str, Any] | None = None) -> None:
    """Writes a snapshot to a seekable binary file. Raises RecordError for a value that cannot be written,
    such as an option of a phase that is no number, text or list."""
    arrays: Arrays = {}
    head = {
        "answer": snapshot.scene.answer,
        "layout": layout(),
        "note": dict(note or {}),
        "content": to_plain(_content(snapshot, arrays), arrays, "the simulation"),
    }
    try:
        text = json.dumps(head).encode()
    except (TypeError, ValueError) as error:
        raise RecordError(f"this simulation cannot be saved with its note: {error}") from error
    hashed = _Hashed(file)
    archive = zipfile.ZipFile(hashed, "w")  # type: ignore[call-overload]  # it only has to write
    try:
        for name, array in {MAGIC: np.frombuffer(text, np.uint8), **arrays}.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
        archive.comment = bytes(_CHECKSUM)
        archive.close()
    except BaseException:
        archive.fp = None  # else deleting it closes it, which fails within a member
        raise
    file.seek(-_CHECKSUM, os.SEEK_END)
    file.write(hashed.sha256.hexdigest().encode())


class _Hashed:
    """A file that can only be written to, and the hash of the written bytes."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.sha256 = hashlib.sha256()

    def write(self, data: Any) -> int:
        """Writes bytes; a signal can come between two writes."""
        view = memoryview(data).cast("B")
        for at in range(0, len(view), _AT_ONCE):
            self._file.write(view[at : at + _AT_ONCE])
        self.sha256.update(view)
        return len(view)

    def flush(self) -> None:
        self._file.flush()


def packed(snapshot: Snapshot) -> bytes:
    """Returns a snapshot as the bytes of an archive."""
    file = BytesIO()
    pack(snapshot, file)
    return file.getvalue()


def unpack(content: bytes, name: str = "this") -> Snapshot:
    """Returns the packed snapshot; RecordError, with the file's ``name``, if that fails."""
    head, arrays = _opened(content, name)
    if head["answer"] != ANSWER:
        raise RecordError(
            f"{name} was saved under version {head['answer']!r} of the specification, and this kinetile "
            f"follows version {ANSWER}: other rules would make other contacts from here on"
        )
    if head["layout"] != layout():
        raise RecordError(
            f"{name} was saved by another version of kinetile, whose files are laid out in another way: "
            "only that version can go on from it"
        )
    with no_simulation(name):
        try:
            return _snapshot(from_plain(head["content"], arrays), arrays)
        except RecordError:
            raise
        except KinetileError as error:
            raise RecordError(f"{name} is no simulation that can be resumed: {error}") from error


copyreg.pickle(Snapshot, lambda snapshot: (unpack, (packed(snapshot), "this pickle")))


@contextmanager
def no_simulation(name: str) -> Iterator[None]:
    """Within this context, raises RecordError for Python's exceptions about a file's values that no
    simulation has. The checksum detects only damage: a file may contain anything."""
    try:
        yield
    except KinetileError:
        raise
    except _NOT_SO as error:
        text = f"{type(error).__name__}: {error}"
        raise RecordError(f"{name} is no simulation that can be resumed: {text}") from error


def note(content: bytes, name: str = "this") -> dict[str, Any]:
    """Returns the note packed with a snapshot; RecordError as ``unpack``."""
    found = _opened(content, name)[0]["note"]
    return found if isinstance(found, dict) else {}


def _opened(content: bytes, name: str) -> tuple[dict[str, Any], Arrays]:
    _check_begin(content, name)
    sha256 = hashlib.sha256(memoryview(content)[:-_CHECKSUM])
    sha256.update(bytes(_CHECKSUM))
    if sha256.hexdigest().encode() != content[-_CHECKSUM:]:
        raise RecordError(
            f"{name} is damaged, or cut off: its checksum does not fit its content; nothing was read from it"
        )
    try:
        with zipfile.ZipFile(BytesIO(content)) as members:
            sizes = [member.file_size for member in members.infolist()]
            stored = all(member.compress_type == zipfile.ZIP_STORED for member in members.infolist())
            if not stored or sum(sizes) > len(content):
                raise ValueError(
                    "its members are compressed, or overlap; Simulation.save stores them as they are"
                )
        with np.load(BytesIO(content), allow_pickle=False) as archive:
            arrays = {each: archive[each] for each in archive.files}
        head = json.loads(arrays.pop(MAGIC).tobytes())
        _ = head["answer"], head["layout"], head["note"], head["content"]
    except Exception as error:  # zipfile, NumPy, JSON: a hostile archive may raise anything
        raise RecordError(f"{name} is no saved simulation: {error}") from error
    return head, arrays


def _check_begin(content: bytes, name: str) -> None:
    if content[_FIRST_NAME] != f"{MAGIC}.npy".encode():
        raise RecordError(f"{name} is no saved simulation: expected a file that Simulation.save has written")


_OF_STATE: dict[str, Any] = {
    **dict.fromkeys(("base", "audits", "python_events", "python_contacts"), int),
    **dict.fromkeys(("cpu_seconds", "compile_seconds", "python_seconds"), int | float),
    **{"requested": float | int | None, "overlapping": np.ndarray, "shapes": tuple, "pull": tuple | None},
}
"""Fields of a run's state in the head, by their names, with their types."""

_BOUNDS = 4
"""Saved bounds: the extent and the skin, after them, follow from the positions of bodies."""

_OF_RUN: dict[str, Any] = {"audit": int | None, "start_energy": float, "observed": dict | None}
"""Fields of a snapshot, likewise, in their order."""

_KINDS: dict[str, Any] = {**_OF_STATE, **_OF_RUN, "commands": int, "told": KindHistory, "kept": bool}


@cache
def layout() -> str:
    """Returns a digest of the layout of all saved values."""
    content = [f"{name} {elements(dtype)}" for name, dtype in CARRIED_ROWS.items()]
    content += [elements(CONTACT), elements(LOG), *Bounds._fields]
    content += [*(field.name for field in fields(Snapshot)), *(field.name for field in fields(RunState))]
    content += Entries._fields + KindHistory._fields
    return hashlib.sha256("\n".join(content).encode()).hexdigest()


@cache
def elements(dtype: np.dtype[Any]) -> str:
    """Returns an element's type in words: names, kinds, order of bytes, places in the record."""
    return f"{dtype.descr} in {dtype.itemsize}"


def _content(snapshot: Snapshot, arrays: Arrays) -> dict[str, Any]:
    """Returns the contents of a snapshot as values for ``to_plain``; adds the arrays of tables."""
    state = snapshot.state
    rows, bases = state.history.content
    arrays |= state.contents._asdict()
    arrays |= {"history": np.frombuffer(rows, COMMAND), "later": state.later.rows}
    return {
        "scene": _scene(snapshot.scene),
        "phases": [snapshot.phases.broad_phase, snapshot.phases.options, snapshot.phases.narrow_phases],
        **{name: getattr(state, name) for name in _OF_STATE},
        "bounds": list(state.bounds[:_BOUNDS]),
        "commands": int(state.commands),
        "later": list(state.later.ticks),
        "entries": _entries(state.entries, arrays),
        "history": [list(base) for base in bases],
        "told": state.history.told,
        "kept": state.history.kept,
        "names": state.history.names,
        **{name: getattr(snapshot, name) for name in _OF_RUN},
    }


def _snapshot(content: Mapping[str, Any], arrays: Arrays) -> Snapshot:
    _check_kinds(content, arrays)
    scene = Scene(*content["scene"])
    bases = tuple((int(first), int(base)) for first, base in content["history"])
    commands = _rows(arrays, "history", COMMAND).tobytes()
    history = History((commands,), bases, content["told"], content["kept"])
    history.names = {str(name): int(body) for name, body in content["names"].items()}
    state = RunState(
        contents=Contents(**{name: _rows(arrays, name, dtype) for name, dtype in CARRIED_ROWS.items()}),
        bounds=Bounds._make([*content["bounds"], 0.0, NO_SKIN]),
        commands=CommandSupport(content["commands"]),
        later=Planned(tuple(content["later"]), _rows(arrays, "later", COMMAND)),
        history=history,
        entries=_read_entries(content["entries"], arrays, scene, numbers_of(scene, history)),
        **{name: content[name] for name in _OF_STATE},
    )
    check_state(state, scene)
    return Snapshot(scene, SavedPhases(*content["phases"]), state, *map(content.__getitem__, _OF_RUN))


def _check_kinds(content: Mapping[str, Any], arrays: Arrays) -> None:
    """Raises TypeError for a value that no engine has: otherwise a run would fail later."""
    for name, kind in _KINDS.items():
        if not isinstance(content[name], kind):
            raise TypeError(f"{name} is {shown(content[name])}")
    for name, value in zip(Bounds._fields[:_BOUNDS], content["bounds"], strict=True):
        if not isinstance(value, float):
            raise TypeError(f"{name} is {shown(value)}")
    ticks = content["later"]
    if len(ticks) != len(arrays["later"]) or not all(type(each) is int for each in ticks):
        raise TypeError("a command has no tick")
    if not all(isinstance(each, Shape) for each in content["shapes"]):
        raise TypeError("a shape is of another type")
    if content["overlapping"].dtype != np.int64 or content["overlapping"].shape[1:] != (2,):
        raise TypeError("overlapping has no pairs of bodies")


def _scene(scene: Scene) -> list[Any]:
    """Returns the inputs of a scene. It keeps the values of its origin that JSON can hold."""
    origin: dict[str, Any] = {}
    for name, value in scene.origin.items():
        with suppress(RecordError):
            to_plain(value, {}, "")
            origin[name] = value
    inputs = scene.__reduce__()[1]
    return [origin if isinstance(each, dict) and each == scene.origin else each for each in inputs]


def _entries(entries: Entries, arrays: Arrays) -> dict[str, Any]:
    arrays |= {f"unrecorded.{number}": rows for number, rows in enumerate(entries.unrecorded)}
    arrays["pending_events"] = np.array(list(entries.pending_events), CONTACT_ROW)
    found: dict[str, Any] = {
        "rows": entries.rows,
        "fingerprint": entries.digest.hexdigest(),
        "unrecorded": len(entries.unrecorded),
    }
    if entries.contacts is None:
        arrays["open"] = np.frombuffer(bytes(entries.digest.rows), CONTACT_ROW)
        return found | {"chain": entries.digest.chain.hex()}
    arrays["contacts"] = np.frombuffer(digestible(entries.contacts), CONTACT_ROW)
    return found


def _read_entries(content: Mapping[str, Any], arrays: Arrays, scene: Scene, numbers: int) -> Entries:
    unrecorded = tuple(_rows(arrays, f"unrecorded.{number}", LOG) for number in range(content["unrecorded"]))
    if "chain" in content:
        contacts = None
        digest = Fingerprint(bytes.fromhex(content["chain"]), _rows(arrays, "open", CONTACT_ROW).tobytes())
    else:
        met = _rows(arrays, "contacts", CONTACT_ROW)
        contacts = np.zeros(len(met), CONTACT)
        for name in met.dtype.names or ():
            contacts[name] = met[name]
        contacts["time"] = Clock(scene.start, scene.time_unit).rounded(met["epoch"], met["tick"])
        contacts.flags.writeable = False
        digest = Fingerprint()
        digest.update(met.tobytes())
    if digest.hexdigest() != content["fingerprint"]:
        raise ValueError("its fingerprint does not fit its contacts")
    pending = _rows(arrays, "pending_events", CONTACT_ROW)
    if not ((pending["a"] >= 0) & (np.maximum(pending["a"], pending["b"]) < numbers)).all():
        raise ValueError("a contact is of a body that has never been there")
    return Entries(content["rows"], contacts, digest, unrecorded, tuple(pending.tolist()))


def _rows(arrays: Arrays, name: str, dtype: np.dtype[Any]) -> Array:
    rows = arrays[name]
    if elements(rows.dtype) != elements(dtype) or rows.ndim != 1:
        raise TypeError(f"{name} has other rows")
    return rows


# Values in JSON, and back. Floats keep every bit, as Python writes them; arrays are members
# of the archive. Only the classes named here can be created, for any file.

_CLASSES: tuple[Any, ...] = (*OF_CLASS, Settings, Shape, KindHistory)
_NAMED: dict[str, Any] = {each.__name__: each for each in _CLASSES}
_NAMED["Response"] = lambda name, options: Response(name, **options)
_DTYPES = {"<f8", "<i8", "<i4", "|b1", "|u1"}


def to_plain(value: Any, arrays: Arrays, where: str) -> Any:
    """Returns a value for JSON, and adds its arrays; RecordError, naming ``where``, for any other value."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or type(value) in (bool, int, float, str):
        return value
    if type(value) in _CLASSES:
        content = [getattr(value, each.name) for each in fields(value)] if is_dataclass(value) else value
        return {type(value).__name__: [to_plain(each, arrays, where) for each in content]}
    if isinstance(value, Response):
        return {"Response": [value.name, to_plain(dict(value.options), arrays, where)]}
    if type(value) is list:
        return [to_plain(each, arrays, where) for each in value]
    if type(value) is tuple:
        return {"tuple": [to_plain(each, arrays, where) for each in value]}
    if isinstance(value, Mapping):
        return {"table": [to_plain(list(each), arrays, where) for each in value.items()]}
    if isinstance(value, np.ndarray) and value.dtype.str in _DTYPES:
        name = f"array.{len(arrays)}"
        arrays[name] = value
        return {"array": name}
    raise RecordError(
        f"{where} has {shown(value)} in it, which cannot be saved: expected numbers, text, lists, tables or "
        "arrays of numbers"
    )


def from_plain(content: Any, arrays: Arrays) -> Any:
    """Returns the value of a JSON text; TypeError, ValueError or LookupError for an invalid one."""
    if isinstance(content, list):
        return [from_plain(each, arrays) for each in content]
    if not isinstance(content, dict):
        return content
    ((kind, content),) = content.items()
    if kind == "array":
        found = arrays[content]
        if found.dtype.str not in _DTYPES:
            raise ValueError(f"an array of {found.dtype}")
        return found
    parts = [from_plain(each, arrays) for each in content]
    if kind == "tuple":
        return tuple(parts)
    if kind == "table":
        return dict(parts)
    return _NAMED[kind](*parts)


def check_target(path: str | os.PathLike[str]) -> Path:
    """Returns the file that a path means, with links followed; RecordError if it is something else."""
    name = os.fspath(path)
    if not Path(name).name:
        raise RecordError(f"{name!r} names no file: expected the path of a file")
    with record_errors(f"{name} cannot be written", _AS_IT_WAS):
        target = writable_target(path)
        if target.exists():
            with target.open("rb") as file:
                begin = file.read(_FIRST_NAME.stop)
            if begin and begin[_FIRST_NAME] != f"{MAGIC}.npy".encode():
                raise RecordError(
                    f"{name} is there and is no saved simulation, so it is not replaced: choose another "
                    "name, or move it away"
                )
    return target


def write_whole(
    path: str | os.PathLike[str], snapshot: Snapshot, note: Mapping[str, Any] | None = None
) -> None:
    """Writes a snapshot to a file, and replaces a saved simulation. If a signal, a full disk or a kill
    interrupts it, the old file stays. Raises RecordError if it cannot be written."""
    target = check_target(path)
    try:
        with replacing(target) as file:
            pack(snapshot, file, note)
    except OSError as error:  # a RecordError is one
        raise RecordError(f"{os.fspath(path)} cannot be written: {reason(error)}{_AS_IT_WAS}") from error


def read_whole(path: str | os.PathLike[str]) -> bytes:
    """Returns the content of a saved run; RecordError if it cannot be read, or is no saved run."""
    with record_errors(f"{os.fspath(path)} cannot be read"), open_regular(path) as file:
        _check_begin(file.read(_FIRST_NAME.stop), os.fspath(path))
        file.seek(0)
        try:
            return file.read()
        except MemoryError as error:
            raise RecordError(f"{os.fspath(path)} cannot be read: it is larger than the memory") from error
