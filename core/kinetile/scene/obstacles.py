"""Obstacles: what stands in a scene and nothing moves, as rows of segments or as shapes.

An obstacle is a body of infinite mass, after all others: it has a number, a kind, a place in contacts and
event files, and may be given a velocity, as a paddle is. With shapes immovable bodies do not meet each other
and may overlap, so a room of any outline is a row of segments.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kinetile.errors import Mistake, SceneError
from kinetile.scene.checks import check_pair, shown
from kinetile.scene.responses import Kind
from kinetile.scene.scene import Scene
from kinetile.scene.shapes import Shape, disc, segment

OBSTACLE = "obstacle"
"""The kind of obstacles that are given none."""


@dataclass(frozen=True)
class Obstacle:
    """A shape at a place, (x, y); with a velocity it moves on, whatever it meets, until a turn."""

    shape: Shape
    position: tuple[float, float]
    velocity: tuple[float, float] = (0.0, 0.0)
    kind: Kind = OBSTACLE


def polyline(
    points: Iterable[Sequence[float]], *, closed: bool = False, kind: Kind = OBSTACLE
) -> list[Obstacle]:
    """Returns segments from each point, (x, y), to the next one; ``closed``: also from the last to the first.

    Where two of them join their ends are the same up to a rounding, exactly if coordinates are small dyadic
    numbers. Raises SceneError, with every mistake, for fewer than two points, and for two that are one place
    or no two finite numbers.
    """
    corners = list(points)
    mistakes = []
    for k, point in enumerate(corners):
        mistakes += check_pair(point, f"points[{k}]", "[x, y]")
    if len(corners) < 2:
        mistakes.append(Mistake("points", f"{len(corners)} points", "two or more, each [x, y]"))
    if mistakes:
        raise SceneError(mistakes, "the polyline")
    found = []
    nexts = [*corners[1:], corners[0]] if closed else corners[1:]
    for k, (p, q) in enumerate(zip(corners, nexts, strict=False)):
        middle = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])
        ends = [(x - middle[0], y - middle[1]) for x, y in (p, q)]
        if ends[0] == ends[1]:
            odd = Mistake(f"points[{k}]", f"{shown(list(p))}, which is the next one too", "another place")
            raise SceneError([odd], "the polyline")
        found.append(Obstacle(segment(*ends), middle, kind=kind))
    return found


def with_obstacles(scene: Scene, obstacles: Iterable[Obstacle]) -> Scene:
    """Returns a scene with obstacles after its bodies, in their order: numbers 0 to n - 1 stay, and theirs
    follow. Raises SceneError if they do not fit."""
    added = list(obstacles)
    if not added:
        return scene
    shapes: dict[Shape, int] = {}

    def numbered(shape: Shape) -> int:
        return shapes.setdefault(shape, len(shapes))

    own: list[Any] = [scene.shapes[each] for each in scene.shape.tolist()] if scene.shapes else []
    if not own:
        discs = {radius: disc(radius) for radius in set(scene.radius.tolist())}
        own = [discs[radius] for radius in scene.radius.tolist()]
    index = [numbered(shape) for shape in (*own, *(each.shape for each in added))]
    kinds = dict.fromkeys((*scene.kinds, *(each.kind for each in added)))
    made = scene.replace(
        position=np.concatenate([scene.position, [each.position for each in added]]),
        velocity=np.concatenate([scene.velocity, [each.velocity for each in added]]),
        mass=np.append(scene.mass, np.full(len(added), math.inf)),
        shape=index,
        shapes=tuple(shapes),
        kind=[*scene.kind, *(each.kind for each in added)],
        kinds=tuple(kinds) if scene.declares_kinds else None,
    )
    made.__dict__["origin"] = dict(scene.origin)
    return made
