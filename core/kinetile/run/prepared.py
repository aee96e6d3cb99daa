"""Prepared scenes: the form of a scene that a run computes before its phases prepare for it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetile.kernel.clock import TICKS
from kinetile.kernel.plan import Plan, positions_after, velocities_after
from kinetile.scene import Scene
from kinetile.scene.shapes import Shape

LEAST_SLOTS = 64
"""The smallest number of slots in a scene with insertions."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Prepared(Scene):
    """A scene as phases prepare for it: the scene of the start, or the present bodies during a run; with room
    for ``capacity`` bodies. ``movable_shapes`` are the movable shapes of the start, and added ones."""

    capacity: int = 0
    _ruled: bool = False  # as for the scene of the start
    movable_shapes: frozenset[int] = frozenset()

    @classmethod
    def of(cls, scene: Scene, capacity: int | None = None) -> "Prepared":
        """Returns a scene with room for ``capacity`` bodies; None: twice the present number, at least
        LEAST_SLOTS."""
        room = max(2 * len(scene), LEAST_SLOTS) if capacity is None else capacity
        copy = object.__new__(cls)
        of_the_start = {"_ruled": scene._ruled, "movable_shapes": scene.movable_shapes}
        copy.__dict__.update(vars(scene) | {"capacity": room} | of_the_start)
        return copy


def widened(scene: Scene, shapes: tuple[Shape, ...] = (), pull: tuple[float, float] | None = None) -> Scene:
    """Returns a scene with more shapes in its table, which bodies of finite mass may have, and, unless
    ``pull`` is None, with accelerations that differ and may be as large as that along x and y."""
    if not shapes and pull is None:
        return scene
    changes: dict[str, Any] = {"shapes": (*scene.shapes, *shapes)}
    if pull is not None:
        changes |= {"pull": tuple(map(max, scene.pull, pull)), "uniform": False}
    copy = object.__new__(Scene)
    copy.__dict__.update(vars(scene) | changes)
    return copy


def _columns(rows: Any, elapsed: Any, form: Any) -> dict[str, Any]:
    return {
        "position": positions_after(Plan.of(rows), elapsed),
        "velocity": velocities_after(Plan.of(rows), elapsed),
        "acceleration": np.stack([rows["ax"], rows["ay"]], axis=-1),
        "radius": rows["radius"],
        "mass": rows["mass"],
        "kind_numbers": rows["kind"].astype(np.int64),
        "shape": form.astype(np.int64),
    }


def present_scene(plans: Any, now: Any, scene: Scene, capacity: int, coming: Any = None) -> Prepared:
    """Returns the scene of a run at the tick ``now`` of its clock: with the bodies of these plans, perhaps
    with bodies that commands insert, and without commands. Nothing is checked."""
    elapsed = (now - plans["anchor"]) * (scene.time_unit / TICKS)
    columns = _columns(plans, elapsed, plans["form"])
    if coming is not None:
        form = coming.form if scene.shapes else np.full(len(coming), -1)
        new = _columns(coming, 0.0, form)
        columns = {name: np.concatenate([column, new[name]]) for name, column in columns.items()}
    columns = {name: np.ascontiguousarray(column) for name, column in columns.items()}
    for column in columns.values():
        column.flags.writeable = False
    copy = Prepared.of(scene, max(capacity, len(columns["radius"])))
    copy.__dict__.update(columns, commands=(), unit=scene.time_unit)
    return copy
