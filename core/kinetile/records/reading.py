"""Reading of event files: the result is exactly the written file, which a digest over the rows, the metadata
and the scene proves, or a RecordError with the reason. The metadata have the kinds of interactively inserted
bodies as runs: [first number, last number, kind] each, ascending."""

import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Array
from kinetile.errors import RecordError, answering
from kinetile.kernel.log import LOG
from kinetile.records.finishing import KEYS, LONGEST_SCENE, PARTIAL, is_log, pyarrow_modules
from kinetile.records.log import Seal
from kinetile.scene import Scene
from kinetile.scene.checks import WALL_KIND, is_finite, shown
from kinetile.scene.files import loads_scene
from kinetile.scene.scene import kind_of_each
from kinetile.scene.values import body_numbers
from kinetile.sources import check_regular
from kinetile.targets import record_errors

_COLUMNS = LOG.names or ()


class EventFile(NamedTuple):
    """Contents of an event file: the rows (dtype LOG) in the order of events, and its metadata."""

    rows: Array
    metadata: dict[str, Any]

    def kinds_of(self, bodies: npt.ArrayLike) -> Array:
        """Returns the first kinds of bodies, by their numbers, such as a column of ``rows``, as an array of
        objects: "wall" for a number below 0, None for a number that no body of the file has."""
        return kinds_in(self.metadata["kinds"], bodies)


@answering
def read_events(path: str | os.PathLike[str]) -> EventFile:
    """Reads an event file. Raises MissingExtra without pyarrow, and RecordError if it is no event file of
    kinetile, if it is damaged or changed, or if it is FILE.partial of an active or killed run.

    The metadata are the recorder's input, and "scene" (the scene as TOML text), "status", "rows", "missing"
    (rows of the run that are not in the file), "start", "time_unit", "places" (the range of places in the
    rows, by periodic axis), "time" (the end of the rows), "kinds" ([first, last, kind] for each run of bodies
    of one kind; ``EventFile.kinds_of`` looks them up), "fingerprint" (of the contacts in the file), "answer"
    (the number of the specification that they follow), "recipe", "parameters", "versions".
    """
    return read_with_scene(path)[0]


def read_with_scene(path: str | os.PathLike[str]) -> tuple[EventFile, Scene]:
    """Reads an event file, and its scene, whose phases need not be installed here. Raises as read_events."""
    path = Path(path)
    rows, (text, scene_text, digest) = _read(path)
    seal = Seal()
    seal.add(rows)
    if seal.digest(text, scene_text) != digest:
        raise RecordError(f"{path} is not what was written: its rows, scene and metadata have another digest")
    try:
        metadata, scene = json.loads(text), loads_scene(scene_text, look_up=False)
        kinds: Runs = []
        _extend(kinds, ((body, scene.kinds[kind]) for body, kind in sorted(kind_of_each(scene).items())))
        kinds += metadata["kinds"]  # of interactively inserted bodies
        kinds_in(kinds, [])  # raises if they are no runs
        if not (is_finite(metadata["missing"]) and is_finite(metadata["time"])):
            raise ValueError("'missing' and 'time' are no numbers")
    except Exception as error:  # with a right digest, the content can still be anything
        raise RecordError(f"{path} has metadata or a scene that no run writes: {error}") from error
    return EventFile(rows, metadata | {"scene": scene_text, "kinds": kinds}), scene


def _read(path: Path) -> tuple[Array, list[str]]:
    pa, pq = pyarrow_modules()
    partial, left = f"{path}{PARTIAL}", ""
    if not os.path.exists(path) and os.path.exists(partial):
        left = f"; `kinetile recover {partial}` makes it from the log of a run"
    with record_errors(f"{path} cannot be read as an event file", left, of=Exception):
        check_regular(path)
        if is_log(path):
            raise RecordError(
                f"{path} is what a run writes while it goes on, and leaves when it is killed: `kinetile "
                f"recover {path}` makes an event file of it"
            )
        with (
            pa.OSFile(os.fsencode(path)) as source,  # text must be UTF-8
            pq.ParquetFile(
                source, thrift_string_size_limit=LONGEST_SCENE, page_checksum_verification=True
            ) as file,
        ):
            found = file.metadata.metadata or {}
            for key in KEYS:
                if key.encode() not in found:
                    what = f"is a Parquet file, but not an event file of kinetile: no {key!r}"
                    raise RecordError(f"{path} {what}")
            _check_columns(pa, path, file.schema_arrow)
            return _read_rows(path, file), [found[key.encode()].decode() for key in KEYS]


def _check_columns(pa: Any, path: Path, schema: Any) -> None:
    wanted = [(name, pa.from_numpy_dtype(LOG[name])) for name in _COLUMNS]
    found = [(field.name, field.type) for field in schema]
    if found != wanted:
        odd = [f"{name} ({kind})" for name, kind in found if (name, kind) not in wanted]
        odd += [f"no {name} ({kind})" for name, kind in wanted if (name, kind) not in found]
        raise RecordError(
            f"{path} has not the columns of an event file: found {shown(', '.join(odd) or 'another order')}; "
            f"expected {', '.join(f'{name} ({kind})' for name, kind in wanted)}"
        )


def _read_rows(path: Path, file: Any) -> Array:
    count, size = file.metadata.num_rows, os.stat(path).st_size
    if count > size:  # Snappy expands a byte to at most 21: the 72 of a row's floats take more than three
        raise RecordError(f"{path} is damaged: {count:,} rows cannot be in {size:,} bytes")
    rows = np.empty(count, LOG)
    first = 0
    for index in range(file.num_row_groups):
        table = file.read_row_group(index, use_threads=False)
        for name in _COLUMNS:
            if table[name].null_count:
                raise RecordError(f"{path} has rows without a value in column {name}; expected one in each")
            rows[name][first : first + table.num_rows] = table[name].to_numpy()
        first += table.num_rows
    if first != len(rows):
        raise RecordError(f"{path} is damaged: its footer says {len(rows)} rows, and {first} are there")
    return rows


Runs: TypeAlias = list[list[Any]]

_LARGEST = 2**31


class KindsByHand:
    """The kinds of bodies inserted by hand so far, as ``runs``, for a recorder, if there are ``several``."""

    def __init__(self, scene: Scene) -> None:
        self.several = len(scene.kinds) > 1
        self.runs: Runs = []
        self._next = max(kind_of_each(scene), default=-1) + 1 if self.several else 0

    def add(self, bodies: Array, kinds_of: Callable[[Array], Array]) -> None:
        """Notes the kinds of these bodies, in ascending order, unless they have been noted."""
        new = bodies[bodies >= self._next]
        if self.several and len(new):
            _extend(self.runs, zip(new.tolist(), kinds_of(new).tolist(), strict=True))
            self._next = int(new[-1]) + 1


def _extend(runs: Runs, kinds: Iterable[tuple[int, Any]]) -> None:
    for body, kind in kinds:
        if runs and runs[-1][1:] == [body - 1, kind]:
            runs[-1][1] = body
        else:
            runs.append([body, body, kind])


def kinds_in(runs: Runs, bodies: npt.ArrayLike) -> Array:
    """Returns the kinds of bodies by their numbers, as an array of objects of the same shape: "wall" for a
    number below 0, None for a body that is not in the runs. TypeError for other values."""
    numbers = body_numbers(bodies)
    first = np.array([run[0] for run in runs] or [_LARGEST], dtype=np.int64)
    last = np.array([run[1] for run in runs] or [_LARGEST], dtype=np.int64)
    kinds = np.array([*(run[2] for run in runs), None, WALL_KIND], dtype=object)
    at = np.maximum(np.searchsorted(first, numbers, side="right") - 1, 0)
    at = np.where((numbers < first[at]) | (numbers > last[at]), len(kinds) - 2, at)
    return kinds[np.where(numbers < 0, len(kinds) - 1, at)]
