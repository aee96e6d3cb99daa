"""Shapes of bodies, which do not rotate: a convex core of 1 to 8 corners, and a radius around it.

A disc is a core of one corner with a radius, a capsule one of two; a box or another polygon has corners and,
if it is not rounded, no radius. Whether a core is convex, and whether two bodies overlap, is decided in
rationals (``kinetile.scene.differences``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

from kinetile.errors import Mistake, SceneError
from kinetile.scene.checks import LARGEST, RANGE, SMALLEST, check_pair, is_finite, shown
from kinetile.scene.differences import Place, cross, exact, less

MOST_CORNERS = 8
"""The most corners of a core."""


@dataclass(frozen=True)
class Shape:
    """The shape of a body; bodies do not rotate, as if their inertia against turning were infinite.

    ``core`` are its corners, (x, y) from the body's reference point: strictly convex and anticlockwise. Two
    are a line, one is a point. ``radius`` is the width of what is around the core; 0 for sharp corners.

    Raises SceneError, with every mistake: for 0 or more than 8 corners, three in one line, an order that is
    clockwise, not convex or crosses itself, a point without a radius, and for numbers that are not finite
    or beyond what scenes can have (2**-200 to 2**200, for coordinates no lower limit).
    """

    core: tuple[Place, ...]
    radius: float = 0.0

    def __post_init__(self) -> None:
        mistakes = _wrong_numbers(self.core, self.radius)
        if not mistakes:
            core = tuple((float(x) + 0.0, float(y) + 0.0) for x, y in self.core)  # there is one zero
            object.__setattr__(self, "core", core)
            object.__setattr__(self, "radius", float(self.radius) + 0.0)
            mistakes = _not_convex(core)
        if not mistakes and not SMALLEST <= self.reach <= LARGEST:
            mistakes = [Mistake("core", f"corners up to {self.reach:.6g} away", f"a distance {RANGE}")]
        if mistakes:
            raise SceneError(mistakes, "the shape")

    @property
    def kind(self) -> str:
        """Its name in files: "disc", "capsule", "segment", "box" or "polygon"."""
        if len(self.core) < 3:
            line = "capsule" if self.radius else "segment"
            return line if len(self.core) == 2 else "disc" if self.is_disc else "polygon"
        right, top = self.core[-2]
        return "box" if not self.radius and self.core == _corners_of_box(2 * right, 2 * top) else "polygon"

    @property
    def is_disc(self) -> bool:
        """Whether it is a disc around the reference point."""
        return self.core == ((0.0, 0.0),)

    @property
    def is_solid(self) -> bool:
        """Whether it has an interior, as all but a segment have."""
        return len(self.core) > 2 or self.radius > 0.0

    @cached_property
    def reach(self) -> float:
        """The radius of the circle around the reference point that holds it: the smallest such double."""
        radius = Fraction(self.radius)
        farthest = max(x * x + y * y for x, y in map(exact, self.core))

        def holds(of: float) -> bool:
            return Fraction(of) >= radius and (Fraction(of) - radius) ** 2 >= farthest

        found = self.radius + max(math.hypot(*corner) for corner in self.core)
        while not holds(found):
            found = math.nextafter(found, math.inf)
        while holds(lower := math.nextafter(found, 0.0)):
            found = lower
        return found

    @property
    def reaches(self) -> tuple[float, float, float, float]:
        """How far it reaches to the left, right, bottom and top of the reference point, as rule 6s says."""
        x, y = zip(*self.core, strict=True)
        r = self.radius
        return r - min(x), r + max(x), r - min(y), r + max(y)


def disc(radius: float) -> Shape:
    """Returns a disc around the reference point."""
    return Shape(((0.0, 0.0),), radius)


def box(width: float, height: float) -> Shape:
    """Returns an upright box around the reference point."""
    sides = {"width": width, "height": height}
    wrong = [name for name, side in sides.items() if not (is_finite(side) and SMALLEST <= side <= LARGEST)]
    if wrong:
        raise SceneError(
            [Mistake(name, shown(sides[name]), f"a number {RANGE}") for name in wrong], "the box"
        )
    return Shape(_corners_of_box(float(width), float(height)))


def capsule(a: Sequence[float], b: Sequence[float], radius: float) -> Shape:
    """Returns all that is within ``radius`` of the line from a to b, places from the reference point."""
    if not is_finite(radius) or radius <= 0.0:
        raise SceneError([Mistake("radius", shown(radius), f"a number {RANGE}")], "the capsule")
    return _made((a, b), radius, {"core[0]": "a", "core[1]": "b"})


def segment(a: Sequence[float], b: Sequence[float]) -> Shape:
    """Returns the line from a to b. It has no interior, so bodies cannot have this shape."""
    return _made((a, b), 0.0, {"core[0]": "a", "core[1]": "b"})


def polygon(corners: Iterable[Sequence[float]], radius: float = 0.0) -> Shape:
    """Returns the convex polygon with these corners, anticlockwise, and with all within ``radius`` of it."""
    return _made(tuple(corners), radius, {"core": "corners"})


def _made(core: Any, radius: float, names: Mapping[str, str]) -> Shape:
    """Returns a shape; in its mistakes, the beginnings of places have other names."""
    try:
        return Shape(core, radius)
    except SceneError as error:
        found = list(error.mistakes)
        for name, other in names.items():
            found = [each._replace(where=each.where.replace(name, other)) for each in found]
        raise SceneError(found, "the shape") from None


_CORNERS = f"1 to {MOST_CORNERS} corners, each [x, y]"


def _corners_of_box(width: float, height: float) -> tuple[Place, ...]:
    x, y = 0.5 * width, 0.5 * height
    return ((-x, -y), (x, -y), (x, y), (-x, y))


def _wrong_numbers(core: Any, radius: Any) -> list[Mistake]:
    """Returns the mistakes of single numbers."""
    mistakes = []
    if not isinstance(core, tuple | list) or not 1 <= len(core) <= MOST_CORNERS:
        found = f"{len(core)} corners" if isinstance(core, tuple | list) else shown(core)
        mistakes.append(Mistake("core", found, _CORNERS))
    else:
        for k, corner in enumerate(core):
            mistakes += check_pair(corner, f"core[{k}]", "[x, y]")
        if len(core) == 1 and is_finite(radius) and radius == 0:
            mistakes.append(Mistake("radius", "0 around a single corner", f"a number {RANGE}"))
    if not is_finite(radius) or not (radius == 0 or SMALLEST <= radius <= LARGEST):
        mistakes.append(Mistake("radius", shown(radius), f"0, or a number {RANGE}"))
    return mistakes


def _not_convex(core: Sequence[Place]) -> list[Mistake]:
    """Returns why a core is not convex or not anticlockwise, decided exactly."""
    count = len(core)
    if count == 1:
        return []
    corners = list(map(exact, core))
    edges = [less(corners[(k + 1) % count], corners[k]) for k in range(count)]
    close = [k for k, edge in enumerate(edges) if max(map(abs, edge)) < SMALLEST]
    if close:
        there = f"{shown(core[close[0]])}, no 2**-200 from the next corner"
        return [Mistake(f"core[{close[0]}]", there, "corners apart from each other")]
    if count == 2:
        return []
    turns = [cross(edges[k - 1], edges[k]) for k in range(count)]
    straight = [k for k, turn in enumerate(turns) if turn == 0]
    if straight:
        there = f"{shown(core[straight[0]])}, in one line with the corners beside it"
        return [Mistake(f"core[{straight[0]}]", there, "no three corners in one line: leave it out")]
    if all(turn < 0 for turn in turns):
        return [Mistake("core", "corners in clockwise order", "anticlockwise order: reverse them")]
    area = sum(cross(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    odd = next((k for k, turn in enumerate(turns) if (turn > 0) != (area > 0)), None)
    if odd is not None:
        there = f"{shown(core[odd])}, where the outline turns to the other side"
        return [Mistake(f"core[{odd}]", there, "a convex outline, anticlockwise: all turns to the left")]
    up = [y > 0 or (y == 0 and x > 0) for x, y in edges]
    if sum(up[k] and not up[k - 1] for k in range(count)) > 1:
        return [Mistake("core", "an outline that crosses itself", "a convex outline, once around")]
    return []
