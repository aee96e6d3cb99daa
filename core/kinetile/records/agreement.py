"""Whether the parts of an event file agree with each other: its rows, its metadata, its scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinetile.kernel.clock import TICKS
from kinetile.kernel.log import INSERTED, REMOVED, TURNED
from kinetile.records.kinds import wrong_runs
from kinetile.scene.responses import PASS

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["disagreement"]

_A, _B = ("ax", "ay", "avx", "avy"), ("bx", "by", "bvx", "bvy")


def disagreement(rows: NDArray[Any], metadata: Mapping[str, Any], scene: Scene) -> str | None:
    """Return the first thing that cannot be true beside the others, in a sentence; None where there is none.

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
    """Yield what may be wrong with rows, each with the rows that it is wrong with."""
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
    """Which rows are the beginning or the end of a passing: two bodies, and no plan of either."""
    planless = np.all([np.isnan(rows[name]) for name in (*_A, *_B)], axis=0)
    may = any(response.name == PASS for row in scene.meets for response in row)
    passing: NDArray[np.bool_] = planless & (rows["b"] >= 0) & (rows["a"] != rows["b"]) & may
    return passing


def _all_finite(rows: NDArray[Any], names: tuple[str, ...]) -> NDArray[np.bool_]:
    finite: NDArray[np.bool_] = np.all([np.isfinite(rows[name]) for name in names], axis=0)
    return finite
