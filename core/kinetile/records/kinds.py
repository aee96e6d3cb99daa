"""The kinds of bodies in an event file, as runs: [first number, last number, kind] each, ascending.

The rows of a file name bodies by number. The kind of a body follows from the scene, unless it was inserted by
hand; for those it stands in the metadata. Bodies get their numbers one after the other and are mostly of one
kind, so there are few runs even after a long game.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.scene import Insert, Scene
from kinetile.scene.checks import WALL

__all__ = ["KindsByHand", "Runs", "all_runs", "kinds_in", "wrong_runs"]

Runs: TypeAlias = list[list[Any]]

_LARGEST = 2**31


class KindsByHand:
    """The kinds of bodies that came by hand, as a recorder hears of them; none where there is but one kind.

    Attributes:
        runs: the kinds of those who have come so far.
        several: whether the scene has more than one kind.
    """

    def __init__(self, scene: Scene) -> None:
        self.several = len(scene.kinds) > 1
        self.runs: Runs = []
        self._next = _numbers(scene)[-1] + 1 if self.several and len(_numbers(scene)) else 0

    def add(self, bodies: npt.NDArray[Any], kinds_of: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> None:
        """Note the kinds of those of these bodies, in ascending order, that have not been noted."""
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
    """Return the kinds of the bodies that a scene's commands insert, by their numbers."""
    coming = (each for each in scene.commands if isinstance(each, Insert))
    return {each.body: scene.kinds[0] if each.kind is None else each.kind for each in coming}


def _numbers(scene: Scene) -> list[int]:
    """Return the numbers of the bodies that a scene names, ascending."""
    return [*range(len(scene)), *sorted(_planned(scene))]


def all_runs(scene: Scene, by_hand: Runs) -> Runs:
    """Return the kinds of all bodies: those of a scene, and those that came by hand."""
    kinds: dict[int, Any] = dict(enumerate(scene.kind)) | _planned(scene)
    runs: Runs = []
    for body in _numbers(scene):
        _append(runs, body, kinds[body])
    return runs + by_hand


def kinds_in(runs: Runs, bodies: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return the kinds of bodies by their numbers, as an array of objects of the same shape: "wall" for a
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
    """Return what cannot be true, beside its scene, of the kinds that a file's metadata say of bodies that
    came by hand; None where nothing is wrong."""
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
