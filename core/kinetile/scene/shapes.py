"""Shapes of bodies, which do not rotate: a convex core of 1 to 8 corners, and a radius around it.

A disc is a core of one corner with a radius, a capsule is a core of two; a box or another polygon has corners
and, if it is not rounded, no radius. Rational arithmetic decides convexity and overlaps. Below are the tables
of shapes in files, obstacles, which nothing moves, and the table of shapes of a scene's bodies.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Flags, Floats, Integers
from kinetile.errors import Mistake, SceneError, answering, key_of
from kinetile.lazy import needed
from kinetile.scene.checks import LARGEST, RANGE, SMALLEST, TOLERANCE, is_finite, shown
from kinetile.scene.differences import Exact, Place, core_difference, cross, exact, is_closer, less
from kinetile.scene.values import SIZE_VALUE, VALUES

MOST_CORNERS = 8
"""The largest number of corners of a core."""


@dataclass(frozen=True)
class Shape:
    """The shape of a body; bodies do not rotate, as if their inertia against turning were infinite.

    ``core`` are its corners, (x, y) from the body's reference point: strictly convex and anticlockwise. Two
    are a line, one is a point. ``radius`` is the width of the rim around the core; 0 for sharp corners.

    Raises SceneError, with every mistake: for 0 or more than 8 corners, three in one line, an order that is
    clockwise, not convex or crosses itself, a point without a radius, and for numbers that are not finite or
    outside the range of scenes (2**-200 to 2**200, for coordinates no lower limit).
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
        """True if it is a disc around the reference point."""
        return self.core == ((0.0, 0.0),)

    @property
    def is_solid(self) -> bool:
        """True if it has an interior, as all shapes except a segment have."""
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
        """The reaches to the left, right, bottom and top from the reference point, by rule 6s."""
        x, y = zip(*self.core, strict=True)
        r = self.radius
        return r - min(x), r + max(x), r - min(y), r + max(y)


def disc(radius: float) -> Shape:
    """Returns a disc around the reference point."""
    return Shape(((0.0, 0.0),), radius)


def box(width: float, height: float) -> Shape:
    """Returns an upright box around the reference point."""
    sides = {"width": width, "height": height}
    wrong = [mistake for name, side in sides.items() for mistake in SIZE_VALUE.mistakes(side, name)]
    if wrong:
        raise SceneError(wrong, "the box")
    return Shape(_corners_of_box(float(width), float(height)))


def capsule(a: Sequence[float], b: Sequence[float], radius: float) -> Shape:
    """Returns the points within ``radius`` of the line from a to b, places from the reference point."""
    wrong = SIZE_VALUE.mistakes(radius, "radius")
    if wrong:
        raise SceneError(wrong, "the capsule")
    return _made((a, b), radius, {"core[0]": "a", "core[1]": "b"})


def segment(a: Sequence[float], b: Sequence[float]) -> Shape:
    """Returns the line from a to b. It has no interior, so bodies cannot have this shape."""
    return _made((a, b), 0.0, {"core[0]": "a", "core[1]": "b"})


@answering
def polygon(corners: Iterable[Sequence[float]], radius: float = 0.0) -> Shape:
    """Returns the convex polygon with these corners, anticlockwise, and with all within ``radius`` of it. A
    ring, which repeats its first corner at the end, may be clockwise, as Shapely's rings are."""
    ring, names = list(corners), {"core": "corners"}
    if _is_ring(ring):
        ring.pop()
        with suppress(SceneError):
            return _made(tuple(ring[::-1]), radius, names)
    return _made(tuple(ring), radius, names)


def _is_ring(points: Sequence[Sequence[float]]) -> bool:
    return len(points) > 3 and np.array_equal(points[0], points[-1])


def _made(core: Any, radius: float, names: Mapping[str, str]) -> Shape:
    """Returns a shape; ``names`` replaces the beginnings of places in its mistakes."""
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
    mistakes = []
    if not isinstance(core, tuple | list) or not 1 <= len(core) <= MOST_CORNERS:
        found = f"{len(core)} corners" if isinstance(core, tuple | list) else shown(core)
        mistakes.append(Mistake("core", found, _CORNERS))
    else:
        for k, corner in enumerate(core):
            mistakes += VALUES["position"].mistakes(corner, f"core[{k}]")
        if len(core) == 1 and is_finite(radius) and radius == 0:
            mistakes.append(Mistake("radius", "0 around a single corner", f"a number {RANGE}"))
    if not is_finite(radius) or radius != 0:
        wrong = SIZE_VALUE.mistakes(radius, "radius")
        mistakes += [each._replace(expected=f"0, or {each.expected}") for each in wrong]
    return mistakes


def _not_convex(core: Sequence[Place]) -> list[Mistake]:
    """Returns the mistakes of a core that is not convex or not anticlockwise, decided exactly."""
    count = len(core)
    if count == 1:
        return []
    corners = list(map(exact, core))
    edges = [less(corners[(k + 1) % count], corners[k]) for k in range(count)]
    close = [k for k, edge in enumerate(edges) if max(map(abs, edge)) < SMALLEST]
    if close:
        how = "no 2**-200 from" if any(edges[close[0]]) else "at the place of"
        there = f"{shown(core[close[0]])}, {how} the next corner"
        return [Mistake(f"core[{close[0]}]", there, "corners apart from each other, each once")]
    if count == 2:
        return []
    turns = [cross(edges[k - 1], edges[k]) for k in range(count)]
    flat = [k for k, turn in enumerate(turns) if turn == 0]
    if flat:
        there = f"{shown(core[flat[0]])}, in one line with the corners beside it"
        return [Mistake(f"core[{flat[0]}]", there, "no three corners in one line: leave it out")]
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


_FORMS: dict[str, tuple[Callable[..., Shape], tuple[str, ...]]] = {
    "disc": (disc, ("radius",)),
    "box": (box, ("width", "height")),
    "capsule": (capsule, ("from", "to", "radius")),
    "segment": (segment, ("from", "to")),
    "polygon": (polygon, ("corners", "radius")),
}
"""The kinds of shapes: the function that makes each, and its keys."""


def read_shape(where: str, row: Mapping[str, Any], mistakes: list[Mistake]) -> Shape | None:
    """Returns the shape of a table of a file, or None if it has mistakes, which are appended."""
    kind = row["kind"]
    if kind not in _FORMS:
        mistakes.append(Mistake(f"{where}.kind", shown(kind), key_of(kind, _FORMS)))
        return None
    make, keys = _FORMS[kind]
    has = f"{', '.join(keys)}, which a {kind} has"
    wrong = [
        Mistake(f"{where}.{key}", "a key of other shapes", has)
        for key in row
        if key not in ("kind", *keys) and any(key in others for _, others in _FORMS.values())
    ]
    needed = keys[:1] if kind == "polygon" else keys
    wrong += [Mistake(f"{where}.{key}", "nothing", has) for key in needed if key not in row]
    if not wrong:
        try:
            return make(*(row[key] for key in keys if key in row))
        except SceneError as error:
            ends = {"a": "from", "b": "to"}
            wrong = [each._replace(where=ends.get(each.where, each.where)) for each in error.mistakes]
            wrong = [each._replace(where=f"{where}.{each.where}") for each in wrong]
    mistakes += wrong
    return None


def shape_row(shape: Shape) -> dict[str, Any]:
    """Returns the keys of a shape's table in a file."""
    right, top = shape.core[-2 % len(shape.core)]
    values: dict[str, Any] = {"radius": shape.radius, "width": 2.0 * right, "height": 2.0 * top}
    values |= {"from": shape.core[0], "to": shape.core[-1], "corners": shape.core}
    return {key: values[key] for key in _FORMS[shape.kind][1]}


SEGMENTS = (
    "a segment, which has no interior",
    "a shape with an interior, or mass = inf: segments are for obstacles",
)
"""The two texts of the mistake for a segment of finite mass: found, and expected."""

OBSTACLE = "obstacle"
"""The default kind of obstacles."""


@dataclass(frozen=True)
class Obstacle:
    """A shape at a place, (x, y), of infinite mass; with a velocity it moves on until a turn.

    An obstacle is a body after all others: it has a number, a kind, a place in contacts and event files. With
    shapes, immovable bodies do not meet each other and may overlap: a room is a row of segments.
    """

    shape: Shape
    position: tuple[float, float]
    velocity: tuple[float, float] = (0.0, 0.0)
    kind: str | int = OBSTACLE


def check_obstacle(given: Any, where: str) -> list[Mistake]:
    """Returns the mistakes of an obstacle."""
    if not isinstance(given, Obstacle) or not isinstance(given.shape, Shape):
        right = "kinetile.Obstacle(shape, position), or what kinetile.polyline(...) returns"
        return [Mistake(where, shown(given), right)]
    fields = ("position", "velocity", "kind")
    return [each for key in fields for each in VALUES[key].mistakes(getattr(given, key), f"{where}.{key}")]


@answering
def polyline(
    points: Iterable[Sequence[float]], *, closed: bool = False, kind: str | int = OBSTACLE
) -> list[Obstacle]:
    """Returns segments from each point, (x, y), to the next one; ``closed``: also from the last to the first.
    Ends that join are equal up to a rounding, for small dyadic numbers exactly. Raises SceneError, with every
    mistake, for fewer than two points, and for two that are equal or not finite."""
    corners = list(points)
    mistakes = []
    for k, point in enumerate(corners):
        mistakes += VALUES["position"].mistakes(point, f"points[{k}]")
    if len(corners) < 2:
        mistakes.append(Mistake("points", f"{len(corners)} points", "two or more, each [x, y]"))
    if mistakes:
        raise SceneError(mistakes, "the polyline")
    found = []
    nexts = [*corners[1:], corners[0]] if closed and not _is_ring(corners) else corners[1:]
    for k, (p, q) in enumerate(zip(corners, nexts, strict=False)):
        middle = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])
        ends = [(x - middle[0], y - middle[1]) for x, y in (p, q)]
        if ends[0] == ends[1]:
            odd = Mistake(f"points[{k}]", f"{shown(list(p))}, which is the next one too", "another place")
            raise SceneError([odd], "the polyline")
        found.append(Obstacle(segment(*ends), middle, kind=kind))
    return found


@answering
def convex_parts(points: Any, *, kind: str | int = OBSTACLE) -> list[Obstacle]:
    """Returns convex obstacles that fill an outline: points (x, y) in either direction, or a polygon of
    Shapely with its holes. All have one position, so that they join exactly. Raises MissingExtra without
    Shapely (extra ``outlines``), SceneError if the points are no outline."""
    shapely = needed("Cutting an outline into convex parts", "shapely", "outlines")
    if not isinstance(points, shapely.Geometry):
        polyline(points, closed=True)  # raises for an invalid point
        points = shapely.Polygon(points if len(points) > 2 else None)
    if not points.is_valid or not points.area:
        why = "no area" if points.is_valid else shapely.is_valid_reason(points)
        raise SceneError([Mistake("points", why, "an outline that does not meet itself")], "the outline")
    middle, parts = points.envelope.centroid.coords[0], list[Any]()
    placed = shapely.transform(points, lambda corners: corners - middle)
    for one in shapely.constrained_delaunay_triangles(placed).geoms:
        few = ((k, part | one) for k, part in enumerate(parts) if len(part.exterior.coords) <= MOST_CORNERS)
        convex = ((k, hull) for k, whole in few if whole.equals(hull := whole.convex_hull))
        k, part = next(convex, (len(parts), one))
        parts[k : k + 1] = [part]
    return [Obstacle(polygon(each.exterior.coords), middle, kind=kind) for each in parts]


@dataclass(frozen=True)
class ShapeTable:
    """The shapes of a scene's bodies: the table, (n,) the index of each body's, and (n,) True if unknown."""

    shapes: tuple[Shape, ...]
    index: Integers
    unknown: Flags

    @property
    def discs(self) -> bool:
        """True if all shapes are discs, also shapes that no body has yet."""
        return not self.unknown.any() and all(each.is_disc for each in self.shapes)

    @property
    def radius(self) -> Floats:
        """(n,) the reach of each body's shape; NaN if unknown."""
        return np.append([each.reach for each in self.shapes], math.nan)[self._known]

    @property
    def reaches(self) -> Floats:
        """(n, 4) the reaches of each body to the left, right, bottom and top; NaN if unknown."""
        return np.array([*(each.reaches for each in self.shapes), (math.nan,) * 4])[self._known]

    @property
    def hollow(self) -> Flags:
        """(n,) True for shapes without an interior; False if unknown."""
        return np.array([*(not each.is_solid for each in self.shapes), False])[self._known]

    @property
    def _known(self) -> Integers:
        return np.where(self.unknown, len(self.shapes), self.index)


def read_table(
    shape: Any, shapes: Any, bodies: int, mistakes: list[Mistake], unread: Flags | None = None
) -> ShapeTable:
    """Returns the given shapes of bodies; appends mistakes, except of bodies without numbers, (n,)."""
    nothing, everything = np.zeros(bodies, dtype=np.int64), np.ones(bodies, dtype=np.bool_)
    if isinstance(shape, Shape):
        if shapes:
            mistakes.append(Mistake("shape", "a shape beside the table of shapes", "its number in the table"))
        shape, shapes = 0, (shape,)
    table = tuple(shapes) if isinstance(shapes, tuple | list) else ()
    if not all(isinstance(each, Shape) for each in table) or not (table or unread is not None):
        mistakes.append(Mistake("shapes", shown(shapes), "a list of shapes: kt.box(...), kt.disc(...), ..."))
        return ShapeTable((), nothing, everything)
    given = np.asarray(shape)
    if (given.dtype.kind not in "iu" and given.size) or given.shape not in ((), (bodies,)):
        right = f"the number of a shape for each of the {bodies} bodies, or one for all"
        mistakes.append(Mistake("shape", "nothing" if shape is None else shown(shape), right))
        return ShapeTable(table, nothing, everything)
    index = np.array(np.broadcast_to(given, (bodies,)), dtype=np.int64)
    known = everything if unread is None else ~unread
    there = (index >= 0) & (index < len(table))
    right = f"the number of a shape, 0 to {len(table) - 1}" if table else "a table [[shapes]] to count in"
    for i in np.flatnonzero(known & ~there).tolist():
        mistakes.append(Mistake(f"bodies[{i}].shape", str(index[i]), right))
    return ShapeTable(table, index, ~(known & there))


def beside(
    table: ShapeTable | None,
    radius: Floats,
    unread: Flags,
    obstacles: Sequence[Obstacle],
    listed: Iterable[Shape],
) -> ShapeTable:
    """Returns the shapes of bodies and of obstacles after them: listed shapes first, others in the order of
    their first use. ``table`` is None for discs of the radii ``own``, (n,), some of them unread."""
    own: list[Shape | None]
    if table is None:
        fit = ~unread & SIZE_VALUE.holds(radius)
        discs = {each: disc(each) for each in set(radius[fit].tolist())}
        own = [discs.get(each) for each in radius.tolist()]
    else:
        rows = zip(table.index.tolist(), table.unknown.tolist(), strict=True)
        own = [None if unknown else table.shapes[each] for each, unknown in rows]
    numbers = {each: number for number, each in enumerate(dict.fromkeys(listed))}
    every = [*own, *(each.shape for each in obstacles)]
    index = [0 if each is None else numbers.setdefault(each, len(numbers)) for each in every]
    unknown = np.array([each is None for each in every], dtype=np.bool_)
    return ShapeTable(tuple(numbers), np.array(index, dtype=np.int64), unknown)


def are_given(shape: object, shapes: object) -> bool:
    """Returns True if arguments of a scene have shapes; -1 for every body, without a table, means discs."""
    if not isinstance(shapes, tuple | list) or shapes:
        return True
    return shape is not None and not (isinstance(shape, np.ndarray) and bool((shape == -1).all()))


def overlapping_shapes(
    position: Floats,
    table: ShapeTable,
    bodies: npt.NDArray[np.intp],
    pairs: Integers,
    periods: tuple[float, float] = (0.0, 0.0),
) -> Integers:
    """Returns the (k, 2) ``pairs`` of overlapping circles whose shapes, or nearest images, overlap. A gap or
    touch along an axis, beyond rounding, excludes a pair in doubles; the others are decided exactly."""
    reaches, shape = table.reaches[bodies], table.index[bodies]
    a, b = pairs.T
    apart = position[b] - position[a]
    for column, period in zip(apart.T, periods, strict=True):
        if period:
            column -= np.rint(column / period) * period
    deep = np.minimum(reaches[a, 1::2] + reaches[b, ::2] - apart, reaches[a, ::2] + reaches[b, 1::2] + apart)
    size = table.radius[bodies]
    rounding = 2.0**-50 * (np.abs(position[a]) + np.abs(position[b]) + (size[a] + size[b])[:, np.newaxis])
    open_pairs = np.flatnonzero((deep + rounding > TOLERANCE * (size[a] + size[b])[:, None]).all(axis=1))
    kept = []
    for k in open_pairs.tolist():
        here, there = position[pairs[k]].tolist()
        one, other = (table.shapes[each] for each in shape[pairs[k]].tolist())
        x, y = (_between(*axis) for axis in zip(here, there, periods, strict=True))
        if overlap(one, other, (x, y)):
            kept.append(k)
    return pairs[kept]


def _between(here: float, there: float, period: float) -> Fraction:
    """Returns the exact distance along an axis between a place and another one, or its nearest image."""
    apart = Fraction(there) - Fraction(here)
    return apart - round(apart / Fraction(period)) * Fraction(period) if period else apart


def overlap(one: Shape, other: Shape, apart: Exact) -> bool:
    """Returns True if two bodies overlap, ``apart`` from each other, by over 1e-12 of their reaches' sum."""
    allowed = Fraction(TOLERANCE) * (Fraction(one.reach) + Fraction(other.reach))
    radii = Fraction(one.radius) + Fraction(other.radius)
    return is_closer(core_difference(one.core, other.core), apart, radii - allowed)
