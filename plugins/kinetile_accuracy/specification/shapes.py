"""The difference of two convex shapes, and rules 6s, 8r and 9s of docs/specification.md.

With the second body at d from the first, two bodies touch if the distance of d from the difference M of their
cores is the sum R of their radii. ``Difference`` is M with R, in integers that count 2^-``bits`` of the
length, so all of it is exact; ``touching`` finds the tick at which a place touches it. ``normal_and_face`` is
the normal of rule 9s, ``room`` its room, and ``wall_tick`` is rule 6s.

Nothing here is shared with the kernel, nor with the checks of a scene.
"""

import copy
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

from kinetile import Shape
from kinetile_accuracy.specification import arithmetic
from kinetile_accuracy.specification.arithmetic import FlightPlan, Frame, Vector, Whole, ratio
from kinetile_accuracy.specification.signs import first_fall


class Face(NamedTuple):
    """A face of a difference: its first corner, anticlockwise, its way, and its outward normal, as long."""

    start: Whole
    way: Whole
    normal: Whole


class Difference:
    """The difference M of the cores of two shapes, the first less the second, and the sum of their radii, R.
    Its ``corners`` are anticlockwise from the one with the smallest x, then y, no three in one line, with
    these ``ways`` between them; its ``faces`` are in the order of their numbers, two for a line, () for a
    point. ``flush`` is the width of the strip, and ``inner`` is R less the strip, rounded."""

    def __init__(self, one: Shape, two: Shape) -> None:
        sizes = (each.radius + max(abs(c) for corner in each.core for c in corner) for each in (one, two))
        cores = [[tuple(map(ratio, corner)) for corner in each.core] for each in (one, two)]
        strip = 2.0**-39 * sum(sizes)
        flush, inner = ratio(strip), ratio((one.radius + two.radius) - strip)
        radii = [ratio(each.radius) for each in (one, two)]
        numbers = [flush, inner, *radii, *(number for core in cores for corner in core for number in corner)]
        self.bits = bits = max(fine for _, fine in numbers)
        whole = [[tuple(n << (bits - fine) for n, fine in corner) for corner in core] for core in cores]
        self.flush, self.inner = (n << (bits - fine) for n, fine in (flush, inner))
        self.radius = sum(n << (bits - fine) for n, fine in radii)
        self._outline({(x - x2, y - y2) for x, y in whole[0] for x2, y2 in whole[1]})

    def _outline(self, places: set[Whole]) -> None:
        first = min(places)
        self.corners = [first]
        while (there := _next(self.corners[-1], places)) != first:
            self.corners.append(there)
        self.ways = [less(q, p) for p, q in zip(self.corners, [*self.corners[1:], first], strict=True)]
        faces = [Face(p, (x, y), (y, -x)) for p, (x, y) in zip(self.corners, self.ways, strict=True)]
        self.faces = sorted(faces, key=lambda face: _direction(face.normal)) if len(faces) > 1 else []

    def finer(self, bits: int) -> "Difference":
        """Returns the same difference, in integers that count 2^-``bits``."""
        if bits == self.bits:
            return self
        made, by = copy.copy(self), 1 << (bits - self.bits)
        made.bits, made.radius = bits, self.radius * by
        made.flush, made.inner = self.flush * by, self.inner * by
        made.corners, made.ways = ([(x * by, y * by) for x, y in each] for each in (self.corners, self.ways))
        made.faces = [Face(*((x * by, y * by) for x, y in face)) for face in self.faces]
        return made


def _next(here: Whole, places: set[Whole]) -> Whole:
    """Returns the corner after another one, anticlockwise: no place is right of the way or beyond it."""
    found = here
    for place in places:
        way, other = less(found, here), less(place, here)
        turn = way[0] * other[1] - way[1] * other[0]
        if turn < 0 or (turn == 0 and dot(other, other) > dot(way, way)):
            found = place
    return found


def _direction(normal: Whole) -> tuple[bool, Fraction, bool]:
    """Returns the key of the order of faces: the angle of the line along the normal, from 0 to less than half
    a turn; for two opposite normals, first the one at that angle."""
    x, y = normal
    downward = y < 0 or (y == 0 and x < 0)
    return y != 0, Fraction(-x, y) if y else Fraction(0), downward


def normal_and_face(m: Difference, d: Vector, v: Whole) -> tuple[Vector, Face | None]:
    """Returns the unit normal of an exchange (rule 9s), from the separation and the way of the next tick, in
    any unit, and its face; None: it is the normal of a corner."""
    closing = [face for face in m.faces if dot(face.normal, v) < 0] if not m.radius else []
    face, away = _rounded(m, closing or m.faces, d)
    if face is not None and away is None:
        return face.normal, face.face
    assert away is not None
    length = math.sqrt(away[0] * away[0] + away[1] * away[1])
    return (away[0] / length, away[1] / length), None


def room(m: Difference, d: Vector) -> float:
    """Returns the gap of two bodies less R (rule 9s, room of the first), as a double."""
    face, away = _rounded(m, m.faces, d)
    if away is None:
        assert face is not None
        return face.gap - m.radius / (1 << m.bits)
    return math.sqrt(away[0] * away[0] + away[1] * away[1]) - m.radius / (1 << m.bits)


def _rounded(m: Difference, faces: list[Face], d: Vector) -> "tuple[_RoundedFace | None, Vector | None]":
    """Returns the face that counts at a place, of some, and the way from the corner that counts instead."""
    if not faces:
        return None, _from(m.corners[0], d, m.bits)
    seen = (_RoundedFace(face, d, m.bits) for face in faces)
    face = max(seen, key=lambda each: each.gap)  # if several tie, the first
    if m.radius and face.before[0] > 0:
        return face, face.before[1]
    return face, face.after[1] if m.radius and face.after[0] < 0 else None


class _RoundedFace:
    """A face with rounded numbers: its normal, its gap, and the distances of a place before its first corner
    and, negated, after its second, each with the way from that corner."""

    def __init__(self, face: Face, d: Vector, bits: int) -> None:
        self.face = face
        tx, ty = (each / (1 << bits) for each in face.way)
        length = math.sqrt(tx * tx + ty * ty)
        nx, ny = self.normal = ty / length, -tx / length
        second = face.start[0] + face.way[0], face.start[1] + face.way[1]
        ways = [_from(corner, d, bits) for corner in (face.start, second)]
        (x, y), (x2, y2) = ways
        self.gap = nx * x + ny * y
        self.before = -(nx * y - ny * x), ways[0]
        self.after = -(nx * y2 - ny * x2), ways[1]


def _from(corner: Whole, d: Vector, bits: int) -> Vector:
    return d[0] - corner[0] / (1 << bits), d[1] - corner[1] / (1 << bits)


def ledge(m: Difference, face: Face, d: Vector, v: Vector, pull: Vector, tick: float) -> int | None:
    """Returns the number of ticks after which a place that moves along a face is beyond one of its ends by
    more than the strip (rule 8r); None: never."""
    seen, flush = _RoundedFace(face, d, m.bits), Fraction(m.flush, 1 << m.bits)
    (nx, ny), q = seen.normal, Fraction(tick)
    speed, bend = Fraction(nx * v[1] - ny * v[0]) * q, Fraction(nx * pull[1] - ny * pull[0]) * q * q / 2
    first = [flush - Fraction(seen.before[0]), speed, bend]
    second = [flush + Fraction(seen.after[0]), -speed, -bend]
    waits = [first_fall(_whole(gap)) for gap in (first, second)]
    return min((each for each in waits if each is not None), default=None)


def wall_tick(shape: Shape, plan: FlightPlan, frame: Frame) -> tuple[int, int] | None:
    """Returns (tick, wall) of the contact of a body with a wall by its plan (rule 6s); None: no contact."""
    r = shape.radius
    reaches = [(r - min(core), r + max(core)) for core in zip(*shape.core, strict=True)]  # as doubles
    return arithmetic.wall_tick(plan, frame, reaches)


def _whole(p: Sequence[Fraction]) -> list[int]:
    """Returns a polynomial times a number that makes it whole."""
    common = math.lcm(*(each.denominator for each in p))
    return [int(each * common) for each in p]


def less(one: Whole, other: Whole) -> Whole:
    """Returns the difference of two vectors."""
    return one[0] - other[0], one[1] - other[1]


def dot(one: Whole, other: Whole) -> int:
    """Returns the scalar product of two vectors."""
    return one[0] * other[0] + one[1] * other[1]
