"""Shapes of a broad phase's structure: the vocabulary of the ``draw`` of its parts.

Four shapes and the entries of a matrix, each with a role that says what it stands for. A shape hangs on
bodies where it can: a coordinate is a number, or that of a body's centre and an offset (``At``), and moves
with the body. So what is drawn after one event holds until the next, whatever moves in between, and a player
of a run in motion need not draw again. A picture of a moment puts in where the bodies are then.

A phase names bodies by their slots, as everywhere in hooks. ``Simulation.drawing`` has the same shapes with
the numbers of the bodies.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, TypeAlias

from kinetile.kernel.tables import Kernel

Role: TypeAlias = str
"""One of ``ROLES``."""

ROLES = {
    "bound": "a bound of a body: a line that stands for where it begins or ends",
    "tile": "a piece of the free space",
    "cell": "a cell of a grid",
    "pair": "two bodies that are near each other",
    "certificate": "something that is watched, and fails at a time",
    "axis": "a line along which things are sorted",
}
"""The roles, and what each stands for. How a role looks is the business of whoever draws."""


class At(NamedTuple):
    """A coordinate that moves with a body: x or y of its centre, as the place in a point says, and an offset.

    ``body`` is a slot where a phase speaks, and a body's number in what ``Simulation.drawing`` returns.
    """

    body: int
    offset: float = 0.0


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

    Like all shapes it may say when the certificate behind it fails (``fails``; None or ``NEVER``: it does
    not) and what it is (``label``, a few words). ``fails`` is a tick as the kernel counts where a phase
    speaks, and ticks since the scene's start in what ``Simulation.drawing`` returns: ``divmod(fails, 2**52)``
    is (epoch, tick), as contacts have them.
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
class Link(_Shape):
    """A line between the centres of two bodies, by slot or number as in ``At``; else like ``Segment``."""

    role: Role
    a: int
    b: int
    fails: int | None = None
    label: str = ""


@dataclass(frozen=True, slots=True)
class Entry(_Shape):
    """An entry in row a, column b of a matrix of all bodies, and in row b, column a; else like ``Link``.

    It has no place in the scene: a page shows the matrix beside it, a picture leaves it out.
    """

    role: Role
    a: int
    b: int
    fails: int | None = None
    label: str = ""


Item: TypeAlias = Segment | Box | Polygon | Link | Entry
"""One thing that there is to see."""


def pair_links(pairs: Iterable[tuple[int, int]]) -> Iterator[Link]:
    """Yields a link for each pair of bodies, sorted. They are mostly those of the event before, and kept."""
    for a, b in sorted(pairs):
        yield _pair(a, b)


def held_pairs(k: Kernel) -> Iterator[Link]:
    """Yields the pairs of the pair set, sorted, for phases that keep their pairs there."""
    held = k.pairs[k.pairs.a >= 0]
    yield from pair_links(zip(held.a.tolist(), held.b.tolist(), strict=True))


@lru_cache(maxsize=1 << 16)
def _pair(a: int, b: int) -> Link:
    return Link("pair", a, b)
