"""Reading event files: what comes back is what was written, or a RecordError that says what is wrong."""

from __future__ import annotations

import json
import math
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from kinetile.errors import Mistake, RecordError
from kinetile.kernel.log import LOG
from kinetile.records.agreement import disagreement
from kinetile.records.finishing import (
    DIGEST_KEY,
    KEY,
    LONGEST_SCENE,
    PARTIAL,
    SCENE_KEY,
    is_log,
    pyarrow_modules,
    reason,
)
from kinetile.records.kinds import all_runs, kinds_in
from kinetile.records.seal import Seal
from kinetile.scene.checks import shown

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["EventFile", "read_events", "read_with_scene"]

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
    """What an event file holds: the rows (dtype LOG) in the order of events, and its metadata."""

    rows: NDArray[Any]
    metadata: dict[str, Any]

    def kinds_of(self, bodies: npt.ArrayLike) -> NDArray[Any]:
        """Return the kinds of bodies by their numbers, such as a column of ``rows``, as an array of objects.

        "wall" stands for a number below 0; None for a body whose kind is not in the file, for it came by hand
        and the file is of a version that did not say it.
        """
        return kinds_in(self.metadata["kinds"], bodies)


def read_events(path: str | os.PathLike[str]) -> EventFile:
    """Read an event file.

    The metadata are those the recorder was given, and "scene" (the scene as TOML text), "status", "rows",
    "missing" (rows of the run that are not in the file), "start", "time_unit", "time" (how far the rows go),
    "kinds" ([first, last, kind] for each run of bodies of one kind; ``EventFile.kinds_of`` looks them up),
    "fingerprint" (of the contacts in the file), "answer" (the number of the specification that they follow; 0
    in a file that is older than that), "recipe", "parameters", "versions".

    Raises MissingExtra without pyarrow, and RecordError where there is no event file of kinetile, one that is
    damaged or contradicts itself, or FILE.partial of a run that goes on or was killed.
    """
    return read_with_scene(path)[0]


def read_with_scene(path: str | os.PathLike[str]) -> tuple[EventFile, Scene]:
    """Read an event file, and its scene, whose phases need not be installed here. Raises as read_events."""
    path = Path(path)
    rows, texts = _read(path)
    metadata = _read_metadata(path, texts[KEY])
    scene = _read_scene(path, texts[SCENE_KEY])
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
    if seal.digest(texts[KEY], texts[SCENE_KEY]) != texts[DIGEST_KEY]:
        raise RecordError(f"{path} is not what was written: its rows, scene and metadata have another digest")
    kinds = all_runs(scene, metadata["kinds"])
    return EventFile(rows, metadata | {"scene": texts[SCENE_KEY], "kinds": kinds}), scene


def _read(path: Path) -> tuple[NDArray[Any], dict[str, str]]:
    """Return the rows of a file, and the texts in its footer by their keys."""
    pa, pq = pyarrow_modules()
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise RecordError(f"{path} cannot be read as an event file: it is no regular file")
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
            for key in (KEY, SCENE_KEY, DIGEST_KEY):
                if key.encode() not in found:
                    said = f"is a Parquet file, but not an event file of kinetile: no {key!r}"
                    raise RecordError(f"{path} {said}")
            _check_columns(pa, path, file.schema_arrow)
            texts = {key: found[key.encode()].decode() for key in (KEY, SCENE_KEY, DIGEST_KEY)}
            return _read_rows(path, file), texts
    except RecordError:
        raise
    except FileNotFoundError as error:
        partial = Path(f"{path}{PARTIAL}")
        left = f"; `kinetile recover {partial}` makes it of what a run has left" if partial.exists() else ""
        raise RecordError(f"{path} cannot be read as an event file: {reason(error)}{left}") from error
    except Exception as error:  # of a damaged file pyarrow may say anything, MemoryError included
        raise RecordError(f"{path} cannot be read as an event file: {reason(error)}") from error


def _check_columns(pa: Any, path: Path, schema: Any) -> None:
    """Raise RecordError unless these are the columns of an event file."""
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
    from kinetile.scene.text.files import read_text

    try:
        return read_text(text, None, _AnyPhase())
    except Exception as error:  # TOML that was tampered with can be more than its reader is made for
        raise RecordError(f"{path} has a scene that is none: {error}") from error


class _AnyPhase:
    """Names as an event file may use them (``kinetile.scene.text.files.Names``): any phase, for none is run
    here, and no recipe, for the bodies themselves are in the file."""

    def mistakes(self, where: str, name: str, *kinds: str) -> list[Mistake]:
        """Return the mistake of naming a recipe."""
        return [Mistake(where, shown(name), "the bodies themselves")] if "scene" in kinds else []

    def option_mistakes(self, name: str, options: Mapping[str, Any]) -> list[Mistake]:
        """Return no mistake: whoever runs the phase checks its options."""
        return []

    def parameter_mistakes(self, name: str, parameters: Mapping[str, Any]) -> list[Mistake]:
        """Return no mistake: the recipe is one already."""
        return []

    def make(self, name: str, parameters: Mapping[str, Any]) -> Scene:
        """Make nothing: ``mistakes`` has refused every recipe."""
        raise NotImplementedError
