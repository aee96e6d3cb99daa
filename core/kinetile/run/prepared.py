"""Prepared scenes: what a run computes of a scene before its phases prepare for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.scene import Scene

LEAST = 64
"""The least number of slots in a scene with insertions."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Prepared(Scene):
    """A scene as phases prepare for it: that of the start, or the present bodies in the middle of a run.

    Attributes:
        capacity: the number of bodies for which a phase makes room.
        ruled: whether the scene of the start has kinds, or contacts other than elastic ones of movable
            bodies.
    """

    capacity: int = 0
    ruled: bool = False

    @classmethod
    def of(cls, scene: Scene, capacity: int | None = None) -> Prepared:
        """Returns a scene in which phases make room for this many bodies; None: twice the present number, or
        LEAST if that is more."""
        room = max(2 * len(scene), LEAST) if capacity is None else capacity
        copy = object.__new__(cls)
        copy.__dict__.update(vars(scene) | {"capacity": room, "ruled": scene.ruled})
        return copy


def standing(scene: Scene, columns: Mapping[str, npt.NDArray[Any]], capacity: int) -> Prepared:
    """Returns a scene on its clock, with other bodies and no commands: as it stands in the middle of a run.

    ``columns`` are position, velocity, radius, mass and kind of the bodies, and their shape where the scene
    has shapes. Nothing is checked: the values come from a run.
    """
    if not scene.shapes:
        columns = {**columns, "shape": np.full(len(columns["radius"]), -1)}
    for column in columns.values():
        column.flags.writeable = False
    copy = Prepared.of(scene, capacity)
    copy.__dict__.update(columns, commands=(), unit=scene.time_unit)
    return copy
