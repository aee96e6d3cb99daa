"""A snapshot as bytes: for a file, or a pickle.

::

    "kinetile saved 1\\n"      17 bytes
    length                    of the text, an unsigned integer of 8 bytes, little-endian
    text                      JSON: what is said in words, and how long each array is
    array, array, ...         as they lie in memory
    checksum                  SHA-256 of all that is before it, 32 bytes

Nothing is made of a byte before the checksum is known to be right. Nothing in a file can be carried out: it
holds numbers, text, and the names of phases, which are those that are installed here.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError, RecordError
from kinetile.kernel.clock import Clock
from kinetile.kernel.log import ANSWER, CONTACT, LOG
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import MET
from kinetile.run.engine import Command
from kinetile.run.engine.digest import StoppableSha256, stoppable
from kinetile.run.engine.ledger import Entries, digestible
from kinetile.run.saving.held import Held
from kinetile.run.saving.plain import Arrays, from_plain, to_plain
from kinetile.run.saving.snapshot import Phases, Snapshot
from kinetile.run.saving.versions import layout, versions_of
from kinetile.scene import Scene, spacious, standing
from kinetile.scene.checks import shown

__all__ = ["SIGNATURE", "no_simulation", "note", "pack", "unpack"]

SIGNATURE = b"kinetile saved 1\n"
_LENGTH = struct.Struct("<Q")
_CHECKSUM = 32
_NOT_SO = (
    *(TypeError, ValueError, LookupError, ArithmeticError),
    *(AttributeError, RecursionError, MemoryError),
)


def pack(snapshot: Snapshot, note: Mapping[str, Any] | None = None) -> list[bytes | memoryview]:
    """Return a snapshot as pieces of bytes, one after the other.

    Raises RecordError where something cannot be written down: an option of a phase that is no number, text or
    list, or the fingerprint of contacts that are not kept, where OpenSSL is not to be had.
    """
    arrays: Arrays = []
    text = {
        "answer": ANSWER,
        "layout": layout(),
        "note": dict(note or {}),
        "said": to_plain(_said(snapshot, arrays), arrays, "the simulation"),
        "arrays": [],
    }
    contents = [_bytes_of(array) for array in arrays]
    text["arrays"] = [len(content) for content in contents]
    try:
        said = json.dumps(text).encode()
    except (TypeError, ValueError) as error:
        raise RecordError(f"this simulation cannot be saved with its note: {error}") from error
    pieces: list[bytes | memoryview] = [SIGNATURE, _LENGTH.pack(len(said)), said, *contents]
    checksum = hashlib.sha256()
    for piece in pieces:
        checksum.update(piece)
    return [*pieces, checksum.digest()]


def _bytes_of(array: npt.NDArray[Any]) -> memoryview:
    return memoryview(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data).cast("B")


def unpack(content: bytes, name: str = "this") -> Snapshot:
    """Return the snapshot that was packed; RecordError, in which it is called ``name``, where that cannot
    be."""
    text, arrays = _opened(content, name)
    if text["answer"] != ANSWER:
        raise RecordError(
            f"{name} was saved under version {text['answer']!r} of the specification, and this kinetile "
            f"follows version {ANSWER}: other rules would make other contacts from here on"
        )
    if text["layout"] != layout():
        raise RecordError(
            f"{name} was saved by another version of kinetile, whose tables are laid out in another way: "
            "only that version can go on from it"
        )
    with no_simulation(name):
        try:
            return _snapshot(from_plain(text["said"], arrays), arrays)
        except RecordError:
            raise
        except KinetileError as error:
            raise RecordError(f"{name} is no simulation that can be gone on from: {error}") from error


@contextmanager
def no_simulation(name: str) -> Iterator[None]:
    """Raise RecordError, within this context, for what Python raises where values of a file are used that no
    simulation has. The checksum tells of damage only: a file may say anything."""
    try:
        yield
    except KinetileError:
        raise
    except _NOT_SO as error:
        said = f"{type(error).__name__}: {error}"
        raise RecordError(f"{name} is no simulation that can be gone on from: {said}") from error


def note(content: bytes, name: str = "this") -> dict[str, Any]:
    """Return the note that was packed along with a snapshot; RecordError as ``unpack``."""
    found = _opened(content, name)[0]["note"]
    return found if isinstance(found, dict) else {}


def _opened(content: bytes, name: str) -> tuple[dict[str, Any], list[npt.NDArray[np.uint8]]]:
    """Return the text and the arrays, after the checksum; RecordError for what is damaged or something
    else."""
    if not content.startswith(SIGNATURE):
        raise RecordError(f"{name} is no saved simulation: expected a file that Simulation.save has written")
    view = memoryview(content)
    if hashlib.sha256(view[:-_CHECKSUM]).digest() != bytes(view[-_CHECKSUM:]):
        raise RecordError(
            f"{name} is damaged, or cut off: its checksum does not fit what is in it; nothing was made of it"
        )
    try:
        at = len(SIGNATURE) + _LENGTH.size
        end = at + _LENGTH.unpack(view[len(SIGNATURE) : at])[0]
        text = json.loads(bytes(view[at:end]))
        arrays = []
        for length in text["arrays"]:
            at, end = end, end + length
            arrays.append(np.frombuffer(view[at:end], np.uint8))
            if length < 0 or len(arrays[-1]) != length:
                raise ValueError("an array is not as long as it is said to be")
        _ = text["answer"], text["layout"], text["note"], text["said"]
    except (*_NOT_SO, struct.error) as error:
        raise RecordError(f"{name} is no saved simulation: {error}") from error
    return text, arrays


def _said(snapshot: Snapshot, arrays: Arrays) -> dict[str, Any]:
    """Return what a snapshot holds, in values that ``to_plain`` can say; append the arrays of tables."""
    versions = versions_of(snapshot.composition) if snapshot.composition is not None else snapshot.versions
    return {
        "scene": _scene(snapshot.scene),
        "phases": [snapshot.phases.broad_phase, snapshot.phases.options, snapshot.phases.narrow_phases],
        "versions": versions,
        "at_start": snapshot.at_start,
        "capacity": snapshot.prepared.capacity,
        "prepared": None if snapshot.at_start else _columns(snapshot.prepared, snapshot.scene),
        "tables": _held(snapshot.tables, arrays),
        "state": _held(snapshot.state, arrays),
        "base": snapshot.base,
        "skin": list(snapshot.skin),
        "commands": snapshot.commands,
        "agenda": list(snapshot.agenda),
        "given": _given(snapshot, arrays),
        "entries": _entries(snapshot.entries, arrays),
        "numbers": snapshot.numbers,
        "seconds": list(snapshot.seconds),
        "more": snapshot.more,
    }


def _snapshot(said: Mapping[str, Any], arrays: Sequence[npt.NDArray[np.uint8]]) -> Snapshot:
    _check_numbers(said)
    scene = Scene(*said["scene"])
    only_commands = all(isinstance(each, Command) for each in said["agenda"])
    if not only_commands or len(said["skin"]) != len(Skin._fields):
        raise TypeError("a command, or the skin, is none")
    prepared = spacious(scene, said["capacity"])
    if not said["at_start"]:
        prepared = standing(scene, said["prepared"], said["capacity"])
    return Snapshot(
        scene=scene,
        phases=Phases(*said["phases"]),
        prepared=prepared,
        at_start=said["at_start"],
        composition=None,
        versions=said["versions"],
        tables=_unheld(said["tables"], arrays),
        state=_unheld(said["state"], arrays),
        base=said["base"],
        skin=tuple(said["skin"]),
        commands=said["commands"],
        agenda=tuple(said["agenda"]),
        given=(arrays[said["given"][0]].tobytes(), tuple((int(a), int(b)) for a, b in said["given"][1])),
        entries=_read_entries(said["entries"], arrays, scene),
        numbers=said["numbers"],
        seconds=tuple(said["seconds"]),
        more=said["more"],
    )


def _check_numbers(said: Mapping[str, Any]) -> None:
    """Raise TypeError for what is none of the numbers that an engine has: it would be found out in a run."""
    more = said["more"]
    kinds: list[tuple[str, Any, Any]] = [
        *((name, said[name], int) for name in ("base", "capacity", "commands")),
        *((f"numbers.{name}", value, bool | int | float | None) for name, value in said["numbers"].items()),
        *(("skin", value, float) for value in said["skin"]),
        *(("seconds", value, int | float) for value in said["seconds"]),
        ("more.audit", more["audit"], int | None),
        ("more.start_energy", more["start_energy"], float),
        ("at_start", said["at_start"], bool),
    ]
    for where, value, kind in kinds:
        if not isinstance(value, kind):
            raise TypeError(f"{where} is {shown(value)}")
    if said["capacity"] < 0:
        raise ValueError(f"capacity is {said['capacity']}")


def _given(snapshot: Snapshot, arrays: Arrays) -> list[Any]:
    rows, bases = snapshot.given
    arrays.append(np.frombuffer(rows, np.uint8))
    return [len(arrays) - 1, [list(base) for base in bases]]


def _scene(scene: Scene) -> list[Any]:
    """Return what a scene is made from. Of its origin, which says where it is from, what can be said."""
    arguments = list(scene.__reduce__()[1])
    return [_sayable(each) if isinstance(each, dict) and each == scene.origin else each for each in arguments]


def _sayable(origin: Mapping[str, Any]) -> dict[str, Any]:
    found = {}
    for name, value in origin.items():
        try:
            to_plain(value, [], "")
        except RecordError:
            continue
        found[name] = value
    return found


def _columns(prepared: Scene, scene: Scene) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays in which a scene in the middle of a run differs from that at the start."""
    there = vars(scene)
    return {
        name: value
        for name, value in vars(prepared).items()
        if isinstance(value, np.ndarray) and value is not there[name]
    }


def _held(tables: Mapping[str, Held], arrays: Arrays) -> list[Any]:
    found = []
    for name, held in tables.items():
        found.append([name, held.elements, held.shape, len(arrays)])
        arrays.append(held.content)
    return found


def _unheld(said: Sequence[Any], arrays: Sequence[npt.NDArray[np.uint8]]) -> dict[str, Held]:
    return {name: Held(elements, shape, arrays[number]) for name, elements, shape, number in said}


def _entries(entries: Entries, arrays: Arrays) -> dict[str, Any]:
    """Return what stands in the ledger. Kept contacts are their own digest; else its state is needed."""
    found: dict[str, Any] = {"rows": entries.rows, "fingerprint": entries.digest.hexdigest()}
    found["unrecorded"] = [len(arrays) + number for number in range(len(entries.unrecorded))]
    arrays += entries.unrecorded
    if entries.contacts is not None:
        found["contacts"] = len(arrays)
        arrays.append(np.frombuffer(digestible(entries.contacts), np.uint8))
    elif isinstance(entries.digest, StoppableSha256):
        found["digest"] = list(entries.digest.state)
    else:
        raise RecordError(
            "this simulation keeps no contacts, and their fingerprint so far cannot be written down, for the "
            "OpenSSL of this Python cannot be reached: make it with keep_contacts=True"
        )
    return found


def _read_entries(said: Mapping[str, Any], arrays: Sequence[npt.NDArray[np.uint8]], scene: Scene) -> Entries:
    unrecorded = tuple(arrays[number].view(LOG) for number in said["unrecorded"])
    if "contacts" in said:
        met = arrays[said["contacts"]].view(MET)
        contacts = np.zeros(len(met), CONTACT)
        for name in met.dtype.names or ():
            contacts[name] = met[name]
        contacts["time"] = Clock(scene.start, scene.time_unit).rounded(met["epoch"], met["tick"])
        contacts.flags.writeable = False
        digest: Any = hashlib.sha256(arrays[said["contacts"]])
    elif stoppable():
        contacts, digest = None, StoppableSha256.from_state(*said["digest"])
    else:
        raise RecordError(
            "it keeps no contacts, and goes on only where the OpenSSL of this Python can be reached"
        )
    if digest.hexdigest() != said["fingerprint"]:
        raise ValueError("its fingerprint is not that of its contacts")
    return Entries(said["rows"], contacts, digest, unrecorded)
