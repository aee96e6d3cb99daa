"""Reading of event files: the result is exactly what was written, or a RecordError with the reason.

The rows, the metadata and the scene of a file are compared with each other: the first contradiction is an
error.

Rows name bodies by number. The kind of a body follows from the scene, unless it was inserted interactively;
for those it is in the metadata, as runs: [first number, last number, kind] each, ascending. Bodies get their
numbers one after the other and are mostly of one kind, so there are few runs even after a long game.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from kinetile.errors import RecordError
from kinetile.kernel.clock import TICKS
from kinetile.kernel.log import INSERTED, LOG, REMOVED, TURNED
from kinetile.records.finishing import KEYS, LONGEST_SCENE, PARTIAL, is_log, pyarrow_modules, reason
from kinetile.records.log import Seal
from kinetile.scene import Insert, Scene
from kinetile.scene.checks import WALL, shown
from kinetile.scene.responses import PASS
from kinetile.sources import check_regular

_COLUMNS = LOG.names or ()
_OWN = {
    "status": str,
    "rows": int,
    "missing": int,
    "start": float,
    "time_unit": float,
    "time": float,
    "kinds": list,
    "fingerprint": str,
    "answer": int,
}


class EventFile(NamedTuple):
    """Contents of an event file: the rows (dtype LOG) in the order of events, and its metadata."""

    rows: NDArray[Any]
    metadata: dict[str, Any]

    def kinds_of(self, bodies: npt.ArrayLike) -> NDArray[Any]:
        """Returns the kinds of bodies by their numbers, such as a column of ``rows``, as an array of objects.

        "wall" stands for a number below 0; None for a body whose kind is not in the file, for it was inserted
        interactively and the file is of a version without its kind.
        """
        return kinds_in(self.metadata["kinds"], bodies)


def read_events(path: str | os.PathLike[str]) -> EventFile:
    """Reads an event file.

    The metadata are those the recorder was given, and "scene" (the scene as TOML text), "status", "rows",
    "missing" (rows of the run that are not in the file), "start", "time_unit", "time" (how far the rows go),
    "kinds" ([first, last, kind] for each run of bodies of one kind; ``EventFile.kinds_of`` looks them up),
    "fingerprint" (of the contacts in the file), "answer" (the number of the specification that they follow; 0
    in a file that is older than that), "recipe", "parameters", "versions".

    Raises MissingExtra without pyarrow, and RecordError if there is no event file of kinetile, if it is
    damaged or contradicts itself, or if it is FILE.partial of an active or killed run.
    """
    return read_with_scene(path)[0]


def read_with_scene(path: str | os.PathLike[str]) -> tuple[EventFile, Scene]:
    """Reads an event file, and its scene, whose phases need not be installed here. Raises as read_events."""
    path = Path(path)
    rows, (text, scene_text, digest) = _read(path)
    metadata = _read_metadata(path, text)
    scene = _read_scene(path, scene_text)
    wrong = disagreement(rows, metadata, scene)
    if wrong:
        raise RecordError(f"{path} contradicts itself: {wrong}")
    seal = Seal()
    seal.add(rows)
    if seal.fingerprint != metadata["fingerprint"]:
        raise RecordError(
            f"{path} contradicts itself: the fingerprint of its contacts is {seal.fingerprint}, and its "
            f"metadata say {shown(metadata['fingerprint'])}"
        )
    if seal.digest(text, scene_text) != digest:
        raise RecordError(f"{path} is not what was written: its rows, scene and metadata have another digest")
    kinds = all_runs(scene, metadata["kinds"])
    return EventFile(rows, metadata | {"scene": scene_text, "kinds": kinds}), scene


def _read(path: Path) -> tuple[NDArray[Any], list[str]]:
    """Returns the rows of a file, and the texts in its footer."""
    pa, pq = pyarrow_modules()
    try:
        check_regular(path)
        if is_log(path):
            raise RecordError(
                f"{path} is what a run writes while it goes on, and leaves when it is killed: `kinetile "
                f"recover {path}` makes an event file of it"
            )
        with (
            pa.OSFile(os.fspath(path)) as source,
            pq.ParquetFile(
                source, thrift_string_size_limit=LONGEST_SCENE, page_checksum_verification=True
            ) as file,
        ):
            found = file.metadata.metadata or {}
            for key in KEYS:
                if key.encode() not in found:
                    said = f"is a Parquet file, but not an event file of kinetile: no {key!r}"
                    raise RecordError(f"{path} {said}")
            _check_columns(pa, path, file.schema_arrow)
            return _read_rows(path, file), [found[key.encode()].decode() for key in KEYS]
    except RecordError:
        raise
    except FileNotFoundError as error:
        partial = Path(f"{path}{PARTIAL}")
        left = f"; `kinetile recover {partial}` makes it of what a run has left" if partial.exists() else ""
        raise RecordError(f"{path} cannot be read as an event file: {reason(error)}{left}") from error
    except Exception as error:  # for a damaged file pyarrow may raise anything, MemoryError included
        raise RecordError(f"{path} cannot be read as an event file: {reason(error)}") from error


def _check_columns(pa: Any, path: Path, schema: Any) -> None:
    """Raises RecordError unless these are the columns of an event file."""
    wanted = [(name, pa.from_numpy_dtype(LOG[name])) for name in _COLUMNS]
    found = [(field.name, field.type) for field in schema]
    if found != wanted:
        odd = [f"{name} ({kind})" for name, kind in found if (name, kind) not in wanted]
        odd += [f"no {name} ({kind})" for name, kind in wanted if (name, kind) not in found]
        raise RecordError(
            f"{path} has not the columns of an event file: found {shown(', '.join(odd) or 'another order')}; "
            f"expected {', '.join(f'{name} ({kind})' for name, kind in wanted)}"
        )


def _read_rows(path: Path, file: Any) -> NDArray[Any]:
    rows = np.empty(file.metadata.num_rows, LOG)
    first = 0
    for index in range(file.num_row_groups):
        table = file.read_row_group(index, use_threads=False)
        empty = [name for name in _COLUMNS if table[name].null_count]
        if empty:
            raise RecordError(f"{path} has rows without a value in column {empty[0]}; expected one in each")
        for name in _COLUMNS:
            rows[name][first : first + table.num_rows] = table[name].to_numpy()
        first += table.num_rows
    if first != len(rows):
        raise RecordError(f"{path} is damaged: its footer says {len(rows)} rows, and {first} are there")
    return rows


def _read_metadata(path: Path, text: str) -> dict[str, Any]:
    try:
        metadata = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RecordError(f"{path} has metadata that are no JSON: {error}") from error
    if not isinstance(metadata, dict):
        raise RecordError(f"{path} has metadata that are {shown(metadata)}; expected a JSON object")
    metadata.setdefault("answer", 0)
    metadata.setdefault("kinds", [])
    for key, kind in _OWN.items():
        if key not in metadata:
            raise RecordError(f"{path} has metadata without {key!r}")
        value = metadata[key]
        if type(value) is not kind or (isinstance(value, float) and not math.isfinite(value)):
            raise RecordError(
                f"{path} has metadata in which {key!r} is {shown(value)}; expected a value of type "
                f"{kind.__name__}"
            )
    return metadata


def _read_scene(path: Path, text: str) -> Scene:
    from kinetile.scene.files import loads_scene

    try:
        return loads_scene(text, look_up=False)  # any phase, for none is run here
    except Exception as error:  # TOML that was tampered with can be more than its reader is made for
        raise RecordError(f"{path} has a scene that is none: {error}") from error


_A, _B = ("ax", "ay", "avx", "avy"), ("bx", "by", "bvx", "bvy")


def disagreement(rows: NDArray[Any], metadata: Mapping[str, Any], scene: Scene) -> str | None:
    """Returns the first contradiction, in a sentence, or None.

    ``rows`` are of dtype LOG; of ``metadata`` the types have been checked.
    """
    return next(_disagreements(rows, metadata, scene), None)


def _disagreements(rows: NDArray[Any], metadata: Mapping[str, Any], scene: Scene) -> Iterator[str]:
    if metadata["rows"] != len(rows):
        yield f"its metadata say {metadata['rows']} rows, and {len(rows)} are there"
    if metadata["missing"] < 0:
        yield f"its metadata say that {metadata['missing']} rows are missing"
    if metadata["status"] == "running":
        yield "its status says that the run goes on, and it has a footer"
    for key, value in (("start", scene.start), ("time_unit", scene.time_unit)):
        if metadata[key] != value:
            yield f"its metadata say that {key} is {metadata[key]!r}, and by its scene it is {value!r}"
    kinds = wrong_runs(metadata["kinds"], scene)
    if kinds is not None:
        yield kinds
    time = metadata["time"]
    if time < scene.start:
        yield f"it ends at {time!r}, before its scene's start, {scene.start!r}"
    for wrong, said in _row_faults(rows, scene):
        if wrong.any():
            at = int(np.argmax(wrong))
            row = ", ".join(f"{name} {rows[name][at]}" for name in ("time", "epoch", "tick", "a", "b"))
            yield f"row {at} ({row}) {said}"
    if len(rows) and rows["time"][-1] > time:
        yield f"it ends at {time!r}, before its last row, at {float(rows['time'][-1])!r}"


def _row_faults(rows: NDArray[Any], scene: Scene) -> Iterator[tuple[NDArray[np.bool_], str]]:
    """Yields the possible errors of rows, each with the rows that have it."""
    epoch, tick, a, b = (rows[name] for name in ("epoch", "tick", "a", "b"))
    n, come = len(scene), np.unique(a[b == INSERTED])
    there = f"its scene has not, with {n} bodies" + (f" and {len(come)} that come" if len(come) else "")
    for body, name in ((a, "a"), (b, "b")):
        known = ((body >= 0) & (body < n)) | np.isin(body, come)
        if name == "b":
            known |= (body < 0) & (body >= REMOVED)
        yield ~known, f"is about a body {name} that {there}"
    passing = _passing(rows, scene)
    yield (b >= 0) & (b <= a) & ~passing, "has bodies that are not in ascending order"
    if scene.arena is None:
        yield (b < 0) & (b > TURNED), "is a contact with a wall, and its scene has none"
    yield (epoch < 0) | (tick < 0) | (tick >= TICKS), "has an epoch or a tick out of range"
    earlier = (epoch[1:] < epoch[:-1]) | ((epoch[1:] == epoch[:-1]) & (tick[1:] < tick[:-1]))
    yield np.append(np.zeros(min(len(rows), 1), np.bool_), earlier), "is earlier than the row before it"
    time = scene.start + (epoch + tick * 2.0**-52) * scene.time_unit
    yield rows["time"] != time, "has a time that is not that of its epoch and tick"
    yield ~_all_finite(rows, _A) & ~passing, "has a position or velocity of a that is not finite"
    yield (b >= 0) & ~_all_finite(rows, _B) & ~passing, "has a position or velocity of b that is not finite"
    nowhere = np.all([np.isnan(rows[name]) for name in _B], axis=0)
    yield (b < 0) & ~nowhere, "has a position or velocity of a second body, and there is none"


def _passing(rows: NDArray[Any], scene: Scene) -> NDArray[np.bool_]:
    """Returns which rows are the beginning or the end of a passing: two bodies, and no plan of either."""
    planless = np.all([np.isnan(rows[name]) for name in (*_A, *_B)], axis=0)
    may = any(response.name == PASS for row in scene.meets for response in row)
    return np.asarray(planless & (rows["b"] >= 0) & (rows["a"] != rows["b"]) & may)


def _all_finite(rows: NDArray[Any], names: tuple[str, ...]) -> NDArray[np.bool_]:
    return np.asarray(np.all([np.isfinite(rows[name]) for name in names], axis=0))


Runs: TypeAlias = list[list[Any]]

_LARGEST = 2**31


class KindsByHand:
    """The kinds of interactively inserted bodies, for a recorder; none if there is only one kind.

    Attributes:
        runs: the kinds of the bodies inserted so far.
        several: whether the scene has more than one kind.
    """

    def __init__(self, scene: Scene) -> None:
        self.several = len(scene.kinds) > 1
        self.runs: Runs = []
        self._next = _numbers(scene)[-1] + 1 if self.several and len(_numbers(scene)) else 0

    def add(self, bodies: npt.NDArray[Any], kinds_of: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> None:
        """Notes the kinds of those of these bodies, in ascending order, that have not been noted."""
        new = bodies[bodies >= self._next]
        if not self.several or not len(new):
            return
        for body, kind in zip(new.tolist(), kinds_of(new).tolist(), strict=True):
            _append(self.runs, body, kind)
        self._next = int(new[-1]) + 1


def _append(runs: Runs, body: int, kind: Any) -> None:
    if runs and runs[-1][1:] == [body - 1, kind]:
        runs[-1][1] = body
    else:
        runs.append([body, body, kind])


def _planned(scene: Scene) -> dict[int, Any]:
    """Returns the kinds of the bodies that a scene's commands insert, by their numbers."""
    coming = (each for each in scene.commands if isinstance(each, Insert))
    return {each.body: scene.kinds[0] if each.kind is None else each.kind for each in coming}


def _numbers(scene: Scene) -> list[int]:
    """Returns the numbers of the bodies that a scene names, ascending."""
    return [*range(len(scene)), *sorted(_planned(scene))]


def all_runs(scene: Scene, by_hand: Runs) -> Runs:
    """Returns the kinds of all bodies: those of a scene, and interactively inserted ones."""
    kinds: dict[int, Any] = dict(enumerate(scene.kind)) | _planned(scene)
    runs: Runs = []
    for body in _numbers(scene):
        _append(runs, body, kinds[body])
    return runs + by_hand


def kinds_in(runs: Runs, bodies: npt.ArrayLike) -> npt.NDArray[Any]:
    """Returns the kinds of bodies by their numbers, as an array of objects of the same shape: "wall" for a
    number below 0, None for a body of which the runs do not say it."""
    numbers = np.asarray(bodies, dtype=np.int64)
    first = np.array([run[0] for run in runs] or [_LARGEST], dtype=np.int64)
    last = np.array([run[1] for run in runs] or [_LARGEST], dtype=np.int64)
    kinds = np.array([*(run[2] for run in runs), None, WALL], dtype=object)
    at = np.maximum(np.searchsorted(first, numbers, side="right") - 1, 0)
    at[(numbers < first[at]) | (numbers > last[at])] = len(kinds) - 2
    at[numbers < 0] = len(kinds) - 1
    found: npt.NDArray[Any] = kinds[at]
    return found


def wrong_runs(by_hand: Runs, scene: Scene) -> str | None:
    """Returns the first contradiction between a scene and the kinds of interactively inserted bodies in a
    file's metadata, or None."""
    last = (_numbers(scene) or [-1])[-1]
    for run in by_hand:
        if not isinstance(run, list) or len(run) != 3 or [type(each) for each in run[:2]] != [int, int]:
            return (
                f"its metadata have the kinds {run!r}; expected the first and the last body, and their kind"
            )
        if not last < run[0] <= run[1] < _LARGEST:
            return f"its metadata have the kinds {run!r}, of bodies that are of other kinds already"
        if not any(type(kind) is type(run[2]) and kind == run[2] for kind in scene.kinds):
            return f"its metadata have the kinds {run!r}, and its scene has no such kind"
        last = run[1]
    return None
