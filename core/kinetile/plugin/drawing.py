"""Shapes of a broad phase's structure: the return values of the ``draw`` of its parts.

There are four shapes and the entries of a matrix, each with a role. A coordinate is a number, or the sum of a
body centre's coordinate and an offset (``At``), which moves with the body. A phase names bodies by their
slots, as everywhere in hooks; ``Simulation.drawing`` has the numbers of the bodies.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import starmap
from typing import NamedTuple, TypeAlias

Role: TypeAlias = str
"""One of ``ROLES``."""

ROLES = {
    "bound": "a bound of a body: a line where it begins or ends",
    "tile": "a piece of the free space",
    "cell": "a cell of a grid, or a side of a power cell",
    "pair": "two bodies that are near each other",
    "certificate": "something that is watched, and fails at a time",
    "axis": "a line along which things are sorted",
}
"""The roles, with their meanings. The viewer decides the look of a role."""


class At(NamedTuple):
    """A coordinate that moves with a body: x or y of its centre, by its place in a point, and an offset.
    ``body`` is a slot in a phase's ``draw``, and a body's number in the result of ``Simulation.drawing``.

    On a periodic axis it is ``turns`` periods further: from the plan's place in ``draw``, from
    ``Simulation.unwrapped`` in ``Simulation.drawing``. So a shape stays whole if one of its bodies crosses
    the border, and a viewer draws it with all its images. Beside a fixed number on the same axis, a body has
    its place in ``Simulation.positions``.
    """

    body: int
    offset: float = 0.0
    turns: int = 0


Coordinate: TypeAlias = float | At
"""A place on an axis: a fixed number, in the scene's length, or with a body."""

Point: TypeAlias = tuple[Coordinate, Coordinate]
"""(x, y), each fixed or with a body; the two may go with different bodies."""


class _Shape:
    """A shape, or an entry of a matrix: it has one of the roles."""

    __slots__ = ()
    role: Role

    def __post_init__(self) -> None:
        if self.role not in ROLES:
            known = ", ".join(ROLES)
            raise ValueError(f"a {type(self).__name__} has one of the roles {known}; found {self.role!r}")


@dataclass(frozen=True, slots=True)
class Segment(_Shape):
    """A line from a to b.

    Like all shapes it may have the tick at which its certificate fails (``fails``; None or ``NEVER``: it does
    not) and a name (``label``, a few words). The tick is the kernel's in a phase's ``draw``, and counts from
    the scene's start in the result of ``Simulation.drawing``: there ``divmod(fails, 2**52)`` is (epoch,
    tick).
    """

    role: Role
    a: Point
    b: Point
    fails: int | None = None
    label: str = ""


@dataclass(frozen=True, slots=True)
class Box(_Shape):
    """A rectangle along the axes, from its lower left corner to its upper right; else like ``Segment``."""

    role: Role
    low: Point
    high: Point
    fails: int | None = None
    label: str = ""


@dataclass(frozen=True, slots=True)
class Polygon(_Shape):
    """An area, by its corners in their order around it, at least three; else like ``Segment``."""

    role: Role
    corners: tuple[Point, ...]
    fails: int | None = None
    label: str = ""

    def __post_init__(self) -> None:
        _Shape.__post_init__(self)
        if len(self.corners) < 3:
            raise ValueError(f"a polygon has at least three corners; found {len(self.corners)}")


@dataclass(frozen=True, slots=True)
class _OfTwo(_Shape):
    role: Role
    a: int
    b: int
    fails: int | None = None
    label: str = ""


class Link(_OfTwo):
    """A line between the centres of two bodies, by slot or number as in ``At``; else like ``Segment``."""

    __slots__ = ()


class Entry(_OfTwo):
    """An entry in row a, column b of a matrix of all bodies, and in row b, column a; else like ``Link``. It
    has no position in the scene: a page shows the matrix beside it, a picture leaves it out."""

    __slots__ = ()


Item: TypeAlias = Segment | Box | Polygon | Link | Entry
"""One element of a drawing."""


def points_of(item: Item) -> tuple[Point, ...]:
    """Returns the points of a shape, in their order; for a link, the centres of its bodies."""
    if isinstance(item, Segment):
        return item.a, item.b
    if isinstance(item, Box):
        return item.low, item.high
    if isinstance(item, Polygon):
        return item.corners
    return (At(item.a), At(item.a)), (At(item.b), At(item.b))


def with_points(item: Item, points: Sequence[Point], fails: int | None) -> Segment | Box | Polygon:
    """Returns a shape with other points and another tick; for a link, a segment."""
    if isinstance(item, Polygon):
        return Polygon(item.role, tuple(points), fails, item.label)
    shape = Box if isinstance(item, Box) else Segment
    return shape(item.role, points[0], points[1], fails, item.label)


_pair = lru_cache(maxsize=1 << 16)(partial(Link, "pair"))


def pair_links(pairs: Iterable[tuple[int, int]]) -> Iterator[Link]:
    """Returns a link for each pair of bodies, sorted. Most links of the previous event are reused."""
    return starmap(_pair, sorted(pairs))
