"""Rules 5s, 6s, 9s and 11s of docs/specification.md, for convex shapes that do not rotate, in rationals.

Where the second body is d from the first, two bodies touch if d is as far from the difference M of their
cores as the sum R of their radii. So the questions are about a place d + v t, with t in ticks from the later
anchor, and a polygon with a margin. ``Difference`` is M, ``entry`` is rule 5s, ``exit_`` the parting of rule
11s, ``normal`` that of rule 9s, and ``wall_tick`` is rule 6s.

Nothing here is shared with the kernel, nor with the checks of a scene.

Ticks by whole numbers
======================

A division of whole numbers gives the tick where R = 0: with w = q·(n·v), T₁ is s + the largest g(s)/(−w) of
the faces with w < 0, if that is not less than 0, is less than the smallest g(s)/(−w) of those with w > 0, and
no face has w = 0 and g(s) ≥ 0. Where R > 0, M with its margin is a union: M, a disc around each corner, and a
rectangle on each face, whose sides lie in the discs. Entering a union from outside is the first entry into a
member. That of a rectangle is the first root of (g + w·T)² − R²·n·n, so |n| need not be known; and whether u,
which has the sign of its slope after its zero z, is at least 0 at that root, is decided at z, a rational: the
root is before z unless g(z) > 0 and g(z)² ≥ R²·n·n.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from kinetile import Shape
from kinetile_accuracy.specification import arithmetic
from kinetile_accuracy.specification.arithmetic import HORIZON, FlightPlan, Frame, PairQuadratic, Vector
from kinetile_accuracy.specification.bent import first_fall

Exact = tuple[Fraction, Fraction]


class Face(NamedTuple):
    """A face of a difference: its first corner, anticlockwise, its way, and its outward normal, as long."""

    start: Exact
    way: Exact
    normal: Exact


class Feature(NamedTuple):
    """Where two bodies meet: at a face or a corner of their difference, by its number."""

    kind: str
    number: int


class Contact(NamedTuple):
    """A contact of two bodies by rule 5s: the tick, and the feature."""

    tick: int
    feature: Feature


class Difference:
    """The difference M of the cores of two shapes, the first less the second, and the sum of their radii, R.
    Its ``corners`` go anticlockwise from the one with the smallest x, then y, no three in one line, by these
    ``ways``; its ``faces`` are in the order of their numbers, two for a line, none for a point. ``flush`` is
    the width of the strip that counts for nothing."""

    def __init__(self, one: Shape, two: Shape) -> None:
        self.radius = Fraction(one.radius) + Fraction(two.radius)
        self.flush = Fraction(0)
        places = {less(_exact(a), _exact(b)) for a in one.core for b in two.core}
        first = min(places)
        self.corners = [first]
        while (there := _next(self.corners[-1], places)) != first:
            self.corners.append(there)
        self.ways = [less(q, p) for p, q in zip(self.corners, [*self.corners[1:], first], strict=True)]
        faces = [Face(p, (x, y), (y, -x)) for p, (x, y) in zip(self.corners, self.ways, strict=True)]
        self.faces = sorted(faces, key=lambda face: _direction(face.normal)) if len(faces) > 1 else []
        if self.faces:
            sizes = (each.radius + max(abs(c) for corner in each.core for c in corner) for each in (one, two))
            self.flush = Fraction(2.0**-39 * sum(sizes))


def _next(here: Exact, places: set[Exact]) -> Exact:
    """Returns the corner after another one, anticlockwise: no place is right of the way, none beyond it."""
    found = here
    for place in places:
        way, other = less(found, here), less(place, here)
        turn = cross(way, other)
        if turn < 0 or (turn == 0 and dot(other, other) > dot(way, way)):
            found = place
    return found


def _direction(normal: Exact) -> tuple[bool, Fraction, bool]:
    """Returns the key of the order of faces: the angle of the line along the normal, from 0 to less than half
    a turn; of two opposite normals first the one at that angle."""
    x, y = normal
    downward = y < 0 or (y == 0 and x < 0)
    return y != 0, Fraction(0) if y == 0 else -x / y, downward


def contact(m: Difference, course: PairQuadratic) -> Contact | None:
    """Returns the contact of two bodies by their difference and plans (rule 5s)."""
    found = entry(m, *course.exact()[:2])
    return found and found._replace(tick=course.since + found.tick)


def parting(m: Difference, course: PairQuadratic) -> int | None:
    """Returns the tick at which two bodies part that pass through each other (rule 11s); None: none."""
    wait = exit_(m, *course.exact()[:2])
    return None if wait is None else course.since + wait


def entry(m: Difference, d: Exact, v: Exact) -> Contact | None:
    """Returns the contact of the place d + v t with a difference, from t = 0 on (rule 5s); None: none."""
    return _entry(m, d, v) if all(_is_beside(m, d, v, side) for side in (1, -1)) else None


def _is_beside(m: Difference, d: Exact, v: Exact, side: int) -> bool:
    """Whether M with its margin has points on a side of the line of d + v t, farther than what is flush."""
    beyond = m.flush - m.radius  # so far a corner has to be on that side
    least = beyond * abs(beyond) * dot(v, v)
    aways = (side * cross(v, less(corner, d)) for corner in m.corners)
    return any(away * abs(away) > least for away in aways)


def _entry(m: Difference, d: Exact, v: Exact, most: float = HORIZON) -> Contact | None:
    """Returns what ``entry`` does where nothing is flush, before some tick."""
    near = nearest(m, d)
    if near is not None:
        faces = (dot(m.faces[each.number].normal, v) for each in near if each.kind == "face")
        corners = (dot(less(d, m.corners[each.number]), v) for each in near if each.kind == "corner")
        return Contact(0, near[0]) if all(w < 0 for w in (*faces, *corners)) else None
    found = _entries(m, d, v) if m.radius else _crossings(m, d, v)
    first = min(
        found, default=None, key=lambda met: (met.tick, met.feature.kind == "corner", met.feature.number)
    )
    return first if first is not None and first.tick < most else None


def nearest(m: Difference, d: Exact) -> list[Feature] | None:
    """Returns the features of M to which d is nearest, None if it is farther than R: outside M a face or a
    corner; else, its outline included, the faces with the largest signed distance g/|n|."""
    square, features = _nearest(m, d)
    return features if square <= m.radius**2 else None


def _nearest(m: Difference, d: Exact) -> tuple[Fraction, list[Feature]]:
    """Returns the square of the distance of d from M, negative inside, and the features nearest to d."""
    gaps = [dot(face.normal, less(d, face.start)) for face in m.faces]
    alongs = [dot(face.way, less(d, face.start)) for face in m.faces]
    lengths = [dot(face.way, face.way) for face in m.faces]
    squares = [gap * abs(gap) / length for gap, length in zip(gaps, lengths, strict=True)]
    if m.faces and max(gaps) <= 0 and (len(m.faces) > 2 or 0 <= alongs[0] <= lengths[0]):
        most = max(squares)
        return most, [Feature("face", k) for k, square in enumerate(squares) if square == most]
    for k, (square, along, length) in enumerate(zip(squares, alongs, lengths, strict=True)):
        if square > 0 and 0 <= along <= length:
            return square, [Feature("face", k)]
    corners = [dot(less(d, corner), less(d, corner)) for corner in m.corners]
    closest = min(corners)
    return closest, [Feature("corner", corners.index(closest))]


def _crossings(m: Difference, d: Exact, v: Exact) -> Iterator[Contact]:
    """Yields the contact of a place outside a difference without a margin."""
    if len(m.faces) < 3:
        return  # a line or a point has no interior
    rows = [(dot(face.normal, less(d, face.start)), dot(face.normal, v)) for face in m.faces]
    if any(w == 0 and g >= 0 for g, w in rows):
        return
    into = {k: g / -w for k, (g, w) in enumerate(rows) if w < 0}
    if into and 0 <= max(into.values()) < min(g / -w for g, w in rows if w > 0):
        first = max(into, key=lambda k: into[k])  # of equal ones the one with the smallest number
        yield Contact(math.floor(into[first]), Feature("face", first))


def _entries(m: Difference, d: Exact, v: Exact) -> Iterator[Contact]:
    """Yields the entries into a difference with a margin: into discs around corners, and over faces."""
    a = dot(v, v)
    for k, corner in enumerate(m.corners):
        away = less(d, corner)
        b, c = dot(away, v), dot(away, away) - m.radius**2
        if b < 0 and b * b > a * c:
            yield Contact(_floor(-b / a, -1, (b * b - a * c) / (a * a)), Feature("corner", k))
    for k, face in enumerate(m.faces):
        g, w = dot(face.normal, less(d, face.start)), dot(face.normal, v)
        square = m.radius**2 * dot(face.normal, face.normal)
        if w < 0 < g and g * g >= square and _is_over(face, square, d, v):
            yield Contact(_floor(-g / w, -1, square / (w * w)), Feature("face", k))


def _is_over(face: Face, square: Fraction, d: Exact, v: Exact) -> bool:
    """Whether a place that comes nearer to a face is over it, ends included, when (g + w t)^2 is a square."""
    g, w = dot(face.normal, less(d, face.start)), dot(face.normal, v)
    along, change, length = dot(face.way, less(d, face.start)), dot(face.way, v), dot(face.way, face.way)
    for value, rate in ((along, change), (length - along, -change)):  # both at least 0 then
        if rate == 0:
            if value < 0:
                return False
            continue
        gap = g - w * value / rate  # when this one is 0
        if rate > 0 and (gap < 0 or gap * gap < square):
            return False  # it is still below 0
        if rate < 0 and gap > 0 and gap * gap > square:
            return False  # it is so already
    return True


def exit_(m: Difference, d: Exact, v: Exact) -> int | None:
    """Returns the tick at which a place d + v t leaves a difference with its margin for good (rule 11s); 0 if
    it is outside and does not come in; None: it stays, or leaves after 2^62 ticks."""
    if (len(m.faces) < 3 and not m.radius) or (nearest(m, d) is None and _entry(m, d, v, math.inf) is None):
        return 0
    a = dot(v, v)
    if a == 0:
        return None
    last = []
    for face in m.faces:
        g, w = dot(face.normal, less(d, face.start)), dot(face.normal, v)
        square = m.radius**2 * dot(face.normal, face.normal)
        if w > 0 and _is_over(face, square, d, (-v[0], -v[1])):
            last.append(_floor(-g / w, 1, square / (w * w)))
    for corner in m.corners if m.radius else ():
        away = less(d, corner)
        b, c = dot(away, v), dot(away, away) - m.radius**2
        if b * b >= a * c:
            last.append(_floor(-b / a, 1, (b * b - a * c) / (a * a)))
    return max(last) if max(last) < HORIZON else None


def _floor(middle: Fraction, sign: int, square: Fraction) -> int:
    """Returns the floor of a rational more or less the root of another."""
    common = math.lcm(middle.denominator, square.denominator)
    top, under = int(middle * common), int(square * common * common)
    root = math.isqrt(under)
    return (top + root if sign > 0 else top - root - (root * root != under)) // common


def normal_and_face(m: Difference, d: Vector, v: Exact) -> tuple[Vector, Face | None]:
    """Returns the unit normal of an exchange (rule 9s), from the separation and the relative velocity, and
    its face; None: it is the normal of a corner."""
    closing = [face for face in m.faces if dot(face.normal, v) < 0] if not m.radius else []
    face, away = _rounded(m, closing or m.faces, d)
    if face is not None and away is None:
        return face.normal, face.face
    assert away is not None
    length = math.sqrt(away[0] * away[0] + away[1] * away[1])
    return (away[0] / length, away[1] / length), None


def room(m: Difference, d: Vector) -> float:
    """Returns how far apart two bodies are (rule 9s, room of the first), as a double: the gap less R."""
    face, away = _rounded(m, m.faces, d)
    if away is None:
        assert face is not None
        return face.gap - float(m.radius)
    return math.sqrt(away[0] * away[0] + away[1] * away[1]) - float(m.radius)


def _rounded(m: Difference, faces: list[Face], d: Vector) -> tuple[_RoundedFace | None, Vector | None]:
    """Returns the one of some faces that counts at a place, and the way from the corner that does instead."""
    if not faces:
        x, y = map(float, m.corners[0])
        return None, (d[0] - x, d[1] - y)
    face = max((_RoundedFace(face, d) for face in faces), key=lambda each: each.gap)  # of several the first
    if m.radius and face.before[0] > 0:
        return face, face.before[1]
    return face, face.after[1] if m.radius and face.after[0] < 0 else None


class _RoundedFace:
    """A face with rounded numbers: its normal, its gap, and how far a place is before its first corner and,
    negated, after its second, each with the way from that corner."""

    def __init__(self, face: Face, d: Vector) -> None:
        self.face = face
        tx, ty = map(float, face.way)
        length = math.sqrt(tx * tx + ty * ty)
        nx, ny = self.normal = ty / length, -tx / length
        second = face.start[0] + face.way[0], face.start[1] + face.way[1]
        ways = [(d[0] - float(x), d[1] - float(y)) for x, y in (face.start, second)]
        (x, y), (x2, y2) = ways
        self.gap = nx * x + ny * y
        self.before = -(nx * y - ny * x), ways[0]
        self.after = -(nx * y2 - ny * x2), ways[1]


def ledge(m: Difference, face: Face, d: Vector, v: Vector, pull: Vector, tick: float) -> int | None:
    """Returns in how many ticks a place that moves along a face is beyond one of its ends, by more than the
    strip (rule 8r); None: never."""
    seen = _RoundedFace(face, d)
    (nx, ny), q = seen.normal, Fraction(tick)
    speed, bend = Fraction(nx * v[1] - ny * v[0]) * q, Fraction(nx * pull[1] - ny * pull[0]) * q * q / 2
    first = [m.flush - Fraction(seen.before[0]), speed, bend]
    second = [m.flush + Fraction(seen.after[0]), -speed, -bend]
    waits = [first_fall(whole(gap)) for gap in (first, second)]
    return min((each for each in waits if each is not None), default=None)


def wall_tick(shape: Shape, plan: FlightPlan, frame: Frame) -> tuple[int, int] | None:
    """Returns (tick, wall) of the contact of a body with a wall by its plan (rule 6s); None: none."""
    r = shape.radius
    reaches = [(r - min(core), r + max(core)) for core in zip(*shape.core, strict=True)]  # as doubles
    return arithmetic.wall_tick(plan, frame, reaches)


def whole(p: Sequence[Fraction]) -> list[int]:
    """Returns a polynomial times a number that makes it whole."""
    common = math.lcm(*(each.denominator for each in p))
    return [int(each * common) for each in p]


def _exact(place: Vector) -> Exact:
    return Fraction(place[0]), Fraction(place[1])


def less(one: Exact, other: Exact) -> Exact:
    """Returns the difference of two vectors."""
    return one[0] - other[0], one[1] - other[1]


def cross(one: Exact, other: Exact) -> Fraction:
    """Returns the cross product of two vectors."""
    return one[0] * other[1] - one[1] * other[0]


def dot(one: Exact, other: Exact) -> Fraction:
    """Returns the scalar product of two vectors."""
    return one[0] * other[0] + one[1] * other[1]
