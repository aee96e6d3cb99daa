"""When do two bodies of other shapes than discs meet, and at which feature (rule 5s)?

The answers come from asking where a place is: outside the difference of the cores with its margin, on the
outline, or inside. Ticks are found by halving, roots are never computed. So these answers and the formulas
that they test have the definition in common, and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cmp_to_key
from math import floor, lcm, ldexp, nextafter
from typing import NamedTuple

from .draws import TRIPLES, Draws
from .rules import FAR

__all__ = [
    "FAMILIES",
    "WALL_AS_SEGMENT",
    "Body",
    "Contact",
    "Course",
    "Place",
    "Question",
    "anywhere",
    "dot",
    "meeting",
    "on_lattice",
    "wall_as_segment",
]

Place = tuple[float, float]
Whole = tuple[int, int]
Time = Fraction | int


class Body(NamedTuple):
    """A body: its core and radius, and its plan."""

    core: tuple[Place, ...]
    radius: float
    x: float
    y: float
    vx: float
    vy: float
    anchor: int


class Question(NamedTuple):
    """Two bodies, where the unit is 2^-e."""

    e: int
    one: Body
    two: Body


class Contact(NamedTuple):
    """The tick, "face" or "corner", and its number."""

    tick: int
    kind: str
    number: int


class Face(NamedTuple):
    """A face from a corner on: its way, and its normal."""

    start: Whole
    way: Whole
    normal: Whole


class Course:
    """A place that flies past the difference of two cores, from the later anchor on, in whole numbers of one
    size: lengths, and what is flown in a tick."""

    def __init__(self, one: Body, two: Body, e: int) -> None:
        self.since = max(one.anchor, two.anchor)
        ratios = [Fraction(value) for body in (one, two) for value in (*body[2:4], body.radius)]
        ratios += [Fraction(value) for body in (one, two) for corner in body.core for value in corner]
        paces = [Fraction(value) / (1 << 52 + e) for body in (one, two) for value in body[4:6]]
        self.unit = size = lcm(*(ratio.denominator for ratio in (*ratios, *paces)))

        def whole(value: Fraction | float) -> int:
            return int(Fraction(value) * size)

        ax, ay, bx, by = map(whole, paces)
        self.v = bx - ax, by - ay
        x = whole(two.x) + bx * (self.since - two.anchor) - whole(one.x) - ax * (self.since - one.anchor)
        y = whole(two.y) + by * (self.since - two.anchor) - whole(one.y) - ay * (self.since - one.anchor)
        self.d = x, y
        self.r = whole(Fraction(one.radius) + Fraction(two.radius))
        pairs = [(p, q) for p in one.core for q in two.core]
        self.corners = _hull({(whole(p[0]) - whole(q[0]), whole(p[1]) - whole(q[1])) for p, q in pairs})
        ring = [*self.corners[1:], self.corners[0]]
        ways = [(q[0] - p[0], q[1] - p[1]) for p, q in zip(self.corners, ring, strict=True)]
        faces = [Face(p, (x, y), (y, -x)) for p, (x, y) in zip(self.corners, ways, strict=True)]
        self.faces = sorted(faces, key=cmp_to_key(_before)) if len(faces) > 1 else []

    def at(self, t: Time) -> tuple[Time, Time]:
        """Return the place t ticks later."""
        return self.d[0] + self.v[0] * t, self.d[1] + self.v[1] * t

    def size(self, t: Time) -> Fraction:
        """Return the square of the distance from the difference; inside, that from its outline, negated."""
        rows = [self.over(face, t) for face in self.faces]
        if len(rows) > 2 and all(g <= 0 for g, _, _ in rows):
            return -min(Fraction(g * g) / length for g, _, length in rows)
        squares = [Fraction(g * g) / length for g, u, length in rows if 0 <= u <= length]
        return min([*squares, *(self.square(corner, t) for corner in self.corners)])

    def over(self, face: Face, t: Time) -> tuple[Time, Time, int]:
        """Return g, u and t.t of a face."""
        x, y = self.at(t)
        at = x - face.start[0], y - face.start[1]
        return dot(face.normal, at), dot(face.way, at), dot(face.way, face.way)

    def square(self, corner: Whole, t: Time) -> Fraction:
        """Return the square of the distance from a corner."""
        x, y = self.at(t)
        return Fraction((x - corner[0]) ** 2 + (y - corner[1]) ** 2)

    def crossings(self) -> list[Fraction]:
        """Return the times at which the place is on the line of a face."""
        paces = [(self.over(face, 0)[0], dot(face.normal, self.v)) for face in self.faces]
        return [Fraction(-g, w) for g, w in paces if w]

    def moments(self) -> list[Fraction]:
        """Return times after 0, at one of which the place is inside if it ever is."""
        a = dot(self.v, self.v)
        nearest = [Fraction(-dot((self.d[0] - x, self.d[1] - y), self.v), a) for x, y in self.corners if a]
        later = sorted({t for t in nearest + self.crossings() if t > 0})
        return later + [(one + other) / 2 for one, other in zip([Fraction(0), *later], later, strict=False)]

    def nearest(self) -> tuple[str, int]:
        """Return the feature that the place is nearest to at t = 0."""
        rows = [self.over(face, 0) for face in self.faces]
        if len(rows) > 2 and all(g <= 0 for g, _, _ in rows):
            sizes = [Fraction(g * abs(g), length) for g, _, length in rows]
            return "face", sizes.index(max(sizes))
        over = [k for k, (g, u, length) in enumerate(rows) if g > 0 and 0 <= u <= length]
        squares = [self.square(corner, 0) for corner in self.corners]
        return ("face", over[0]) if over else ("corner", squares.index(min(squares)))


def meeting(asked: Question) -> Contact | None:
    """Return when and where two bodies meet, the first of which is a."""
    course = Course(asked.one, asked.two, asked.e)
    reach = course.r**2
    if course.size(0) <= reach:
        falls = course.size(Fraction(1, 1 << 400)) < course.size(0)
        return Contact(course.since, *course.nearest()) if falls else None
    inside = next((t for t in course.moments() if course.size(t) < reach), None)
    if inside is None:
        return None
    tick = last(lambda t: course.size(t) >= reach, floor(inside))
    if tick >= FAR:
        return None
    if not course.r:
        begin = max(t for t in course.crossings() if t < inside and course.size(t) >= 0)
        on = [course.over(face, begin) for face in course.faces]
        met = [k for k, (g, u, length) in enumerate(on) if g == 0 and 0 <= u <= length]
        return Contact(course.since + tick, "face", met[0])
    met = [k for k, face in enumerate(course.faces) if _enters_over(course, face, tick)]
    if met:
        return Contact(course.since + tick, "face", met[0])
    met = [k for k, corner in enumerate(course.corners) if _enters_disc(course, corner, tick)]
    return Contact(course.since + tick, "corner", met[0])


def last(holds: Callable[[int], bool], end: int) -> int:
    """Return the last whole number up to ``end`` of those that begin with 0 for which something holds."""
    low, high = 0, end + 1
    if holds(end):
        return end
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _enters_disc(course: Course, corner: Whole, tick: int) -> bool:
    """Whether the place comes into the disc around a corner after this tick, and not after the next."""
    x, y = course.d[0] - corner[0], course.d[1] - corner[1]
    closest = Fraction(-dot((x, y), course.v), dot(course.v, course.v))
    reach = course.r**2
    if closest <= 0 or course.square(corner, 0) <= reach or course.square(corner, closest) >= reach:
        return False
    return last(lambda t: course.square(corner, t) >= reach, floor(closest)) == tick


def _enters_over(course: Course, face: Face, tick: int) -> bool:
    """Whether the place comes to within R of the line of a face after this tick, and not after the next, and
    is over the face then."""

    def outside(t: Time) -> bool:
        g, _, length = course.over(face, t)
        return g > 0 and g * g >= course.r**2 * length

    def over(t: Time) -> bool:
        _, u, length = course.over(face, t)
        return 0 <= u <= length

    if dot(face.normal, course.v) >= 0 or not outside(tick) or outside(tick + 1):
        return False
    _, u, length = course.over(face, 0)
    pace = dot(face.way, course.v)
    for end in (0, length) if pace else ():  # it may be over an end of the face just then
        t = Fraction(end - u, pace)
        g = course.over(face, t)[0]
        if g > 0 and g * g == course.r**2 * length:
            return over(t)
    low, high = Fraction(tick), Fraction(tick + 1)
    while True:
        left, right = (course.over(face, t)[1] for t in (low, high))
        if over(low) and over(high):
            return True
        if max(left, right) < 0 or min(left, right) > length:
            return False
        middle = (low + high) / 2
        low, high = (middle, high) if outside(middle) else (low, middle)


def dot(one: tuple[Time, Time], other: tuple[Time, Time]) -> Time:
    return one[0] * other[0] + one[1] * other[1]


def _turn(p: Whole, q: Whole, r: Whole) -> int:
    return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])


def _hull(places: set[Whole]) -> list[Whole]:
    """Return the corners of a hull, anticlockwise from the leftmost, of those the lowest."""
    ordered = sorted(places)
    if len(ordered) == 1:
        return ordered
    chains: list[list[Whole]] = []
    for way in (ordered, ordered[::-1]):
        chain: list[Whole] = []
        for place in way:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], place) <= 0:
                chain.pop()
            chain.append(place)
        chains.append(chain[:-1])
    return chains[0] + chains[1]


def _before(one: Face, other: Face) -> int:
    """Return the order of two faces: below 0 where the first has the smaller number."""

    def upward(face: Face) -> Whole:
        x, y = face.normal
        return (x, y) if y > 0 or (y == 0 and x > 0) else (-x, -y)

    (ax, ay), (bx, by) = upward(one), upward(other)
    return ay * bx - ax * by or (upward(one) != one.normal) - (upward(other) != other.normal)


# What is asked


def hull_of(places: Sequence[Place]) -> tuple[Place, ...]:
    """Return the corners of the hull of some places."""
    size = lcm(*(value.as_integer_ratio()[1] for place in places for value in place))
    corners = _hull({(int(Fraction(x) * size), int(Fraction(y) * size)) for x, y in places})
    return tuple((float(Fraction(x, size)), float(Fraction(y, size))) for x, y in corners)


def box(width: float, height: float) -> tuple[Place, ...]:
    x, y = width / 2, height / 2
    return ((-x, -y), (x, -y), (x, y), (-x, y))


def on_lattice(d: Draws, step: float, size: int) -> tuple[tuple[Place, ...], float]:
    """Return a core with corners on a lattice, and a radius."""
    count = d.pick((1, 1, 2, 3, 3, 4, 5))
    core = hull_of([(d.whole(-size, size) * step, d.whole(-size, size) * step) for _ in range(count)])
    return core, d.whole(1, 5) * step if len(core) < 3 or d.below(3) == 0 else 0.0


def anywhere(d: Draws) -> tuple[tuple[Place, ...], float]:
    """Return a core with any corners, and a radius."""
    count = d.pick((1, 2, 3, 4, 5, 8))
    core = hull_of([(d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)) for _ in range(count)])
    return core, d.uniform(0.01, 1.0) if len(core) < 3 or d.below(3) == 0 else 0.0


def flying(d: Draws, one: Body, two: Body, to: Place, ticks: float) -> Question:
    """Return two bodies, of which the second comes to be ``to`` away from the first after so many ticks, as
    exactly as doubles are; sometimes the first flies, and anchors differ."""
    per_tick = ldexp(1.0, 52) / ticks
    vx, vy = (to[0] - (two.x - one.x)) * per_tick, (to[1] - (two.y - one.y)) * per_tick
    if d.below(3) == 0:
        drift = d.whole(-4, 4) / 4 * per_tick, d.whole(-4, 4) / 4 * per_tick
        one = one._replace(vx=drift[0], vy=drift[1])
        vx, vy = vx + drift[0], vy + drift[1]
    base = d.pick((0, 0, d.whole(-(1 << 60), 1 << 60)))
    return Question(0, one._replace(anchor=base), two._replace(vx=vx, vy=vy, anchor=base))


def resting(of: tuple[tuple[Place, ...], float], x: float, y: float) -> Body:
    return Body(*of, x, y, 0.0, 0.0, 0)


def lattice(d: Draws) -> Question:
    """Short numbers throughout: corners are met, faces slid along, ticks hit; some visits last no tick."""
    step = d.pick((1.0, 0.5, 1 / 16, 2.0**-20))
    size = d.pick((2, 4, 6))
    one = resting(on_lattice(d, step, size), d.whole(-4, 4) * step, d.whole(-4, 4) * step)
    x, y = d.whole(-3 * size, 3 * size), d.whole(-3 * size, 3 * size)
    two = resting(on_lattice(d, step, size), one.x + x * step, one.y + y * step)
    wide = d.pick((size, size + 4))
    to = d.whole(-wide, wide) * step, d.whole(-wide, wide) * step
    if d.below(2):  # along an axis
        to = (to[0], y * step) if d.below(2) else (x * step, to[1])
    return flying(d, one, two, to, d.pick((1, 2, 8, 64, 2.0**40, 2.0**52, 2.0**55)))


def corners(d: Draws) -> Question:
    """A corner of the difference is aimed at: met exactly, or missed by a last bit."""
    step = d.pick((1.0, 1 / 16))
    shapes = [on_lattice(d, step, 4) for _ in range(2)]
    one, two = resting(shapes[0], 0.0, 0.0), resting(shapes[1], d.whole(-9, 9) * step, d.whole(-9, 9) * step)
    (ax, ay), (bx, by) = d.pick(shapes[0][0]), d.pick(shapes[1][0])
    asked = flying(d, one, two, (ax - bx, ay - by), d.pick((4, 2.0**30, 2.0**52)))
    two = asked.two
    if d.below(3) == 0:
        two = two._replace(x=nextafter(two.x, d.sign() * 99.0), y=nextafter(two.y, d.sign() * 99.0))
    return asked._replace(two=two)


def grazes(d: Draws) -> Question:
    """Along a tangent of the margin, exactly, in the directions of triples; or by a little off it."""
    shapes = [on_lattice(d, 1 / 16, 4) for _ in range(2)]
    over, up, c = d.pick(TRIPLES)
    a, b = d.turned(over, up)
    (ax, ay), (bx, by) = d.pick(shapes[0][0]), d.pick(shapes[1][0])
    shapes[0] = shapes[0][0], c * d.whole(1, 4) / 16
    reach = (shapes[0][1] + shapes[1][1]) * d.pick((1.0, 1.0, 1.0 - 2.0**-40, 1.0 + 2.0**-52, 0.5))
    x, y = (ax - bx) + a * reach / c, (ay - by) + b * reach / c
    far = d.whole(1, 40) / 16
    one, two = resting(shapes[0], 0.0, 0.0), resting(shapes[1], x - b * far, y + a * far)
    return flying(d, one, two, (x + b * far, y - a * far), d.pick((2.0**20, 2.0**50, 2.0**53)))


def boxes(d: Draws) -> Question:
    """Upright boxes: at each other's sides and corners, along each other, an exact touch, a last bit less."""
    one = resting((box(d.whole(1, 8) / 8, d.whole(1, 8) / 8), 0.0), d.whole(-8, 8) / 8, d.whole(-8, 8) / 8)
    core = box(d.whole(1, 8) / 8, d.whole(1, 8) / 8)
    wide, high = one.core[2][0] + core[2][0], one.core[2][1] + core[2][1]
    x, y = d.pick((wide, -wide, d.whole(-24, 24) / 16)), d.pick((high, -high, d.whole(-24, 24) / 16))
    far = d.pick((0.0, 0.0, 1.0, 3.0))
    vx, vy = d.whole(-4, 4) / 4, d.whole(-4, 4) / 4
    if d.below(3) == 0:
        vx, vy = d.sign() * d.uniform(0.1, 2.0), d.sign() * d.uniform(0.1, 2.0)
    two = Body(core, 0.0, one.x + x - far * vx, one.y + y - far * vy, vx, vy, 0)
    if d.below(3) == 0:
        two = two._replace(x=nextafter(two.x, d.sign() * 99.0))
    return Question(d.pick((0, 0, 3)), one, two)


def general(d: Draws) -> Question:
    """Any doubles, aimed at each other's middle or past it."""
    one = resting(anywhere(d), d.uniform(-4.0, 4.0), d.uniform(-4.0, 4.0))
    x, y = d.direction()
    far, miss = d.uniform(3.0, 9.0), d.uniform(-3.0, 3.0)
    two = resting(anywhere(d), one.x + x * far, one.y + y * far)
    asked = flying(d, one, two, (-miss * y, miss * x), ldexp(d.uniform(1.0, 2.0), d.whole(40, 58)))
    if d.below(2) == 0:
        asked = asked._replace(one=asked.one._replace(anchor=asked.one.anchor - d.below(1 << 50)))
    return asked


def overlapping(d: Draws) -> Question:
    """At a corner or in the middle of a side, by a rounding in it or not, or deep inside."""
    shapes = [d.pick((on_lattice(d, 1 / 16, 6), anywhere(d))) for _ in range(2)]
    (ax, ay), (bx, by) = d.pick(shapes[0][0]), d.pick(shapes[1][0])
    (cx, cy), (ex, ey) = d.pick(shapes[0][0]), d.pick(shapes[1][0])
    part = d.pick((0.0, 0.5, 0.25, 1.0, d.uniform()))
    x = (1.0 - part) * (ax - bx) + part * (cx - ex)
    y = (1.0 - part) * (ay - by) + part * (cy - ey)
    reach = shapes[0][1] + shapes[1][1]
    x, y = x + d.pick((-1.0, 0.0, 1.0)) * reach, y + d.pick((-1.0, 0.0, 0.0, 1.0)) * reach
    one, two = resting(shapes[0], 0.0, 0.0), resting(shapes[1], x, y)
    if d.below(2):
        one = one._replace(x=d.uniform(-1.0, 1.0))
        two = two._replace(x=two.x + one.x)
    to = two.x - one.x + d.whole(-4, 4) / 4, two.y - one.y + d.whole(-4, 4) / 4
    return flying(d, one, two, to, d.pick((1, 2.0**52, 2.0**60)))


def parallel(d: Draws) -> Question:
    """Along faces of the difference, which are slid along, or approached by a pace of last bits."""
    shapes = [on_lattice(d, 1 / 16, 6) for _ in range(2)]
    core = shapes[d.below(2)][0]
    k = d.below(len(core))
    (px, py), (qx, qy) = core[k], core[(k + 1) % len(core)]
    tx, ty = (qx - px, qy - py) if len(core) > 1 else (1.0, 0.0)
    (ax, ay), (bx, by) = d.pick(shapes[0][0]), d.pick(shapes[1][0])
    reach = shapes[0][1] + shapes[1][1]
    x, y = ax - bx - tx, ay - by - ty
    x, y = (x, y + d.sign() * reach) if d.below(2) else (x + d.sign() * reach, y)
    one, two = resting(shapes[0], 0.0, 0.0), resting(shapes[1], x, y)
    tilt = d.pick((0.0, 0.0, 2.0**-40, -(2.0**-40), 1 / 16))
    return flying(
        d, one, two, (x + 4 * tx - tilt * ty, y + 4 * ty + tilt * tx), d.pick((16, 2.0**52, 2.0**58))
    )


WALL_AS_SEGMENT = "a segment for a wall"


def wall_as_segment(d: Draws) -> Question:
    """A segment that nothing moves, along the left side of an arena 6 high, and a body that flies to it."""
    core, radius = anywhere(d)
    segment = resting((((0.0, 0.0), (0.0, 6.0)), 0.0), 0.0, 0.0)
    speed = ldexp(d.uniform(-2.0, -1.0), -d.below(9))
    return Question(0, segment, Body(core, radius, d.uniform(2.5, 3.0), 3.0, speed, 0.0, 0))


FAMILIES: dict[str, tuple[Callable[[Draws], Question], int]] = {
    "lattice": (lattice, 1200),
    "corners": (corners, 500),
    "grazes": (grazes, 500),
    "boxes": (boxes, 600),
    "any": (general, 700),
    "overlapping": (overlapping, 500),
    "along faces": (parallel, 500),
    WALL_AS_SEGMENT: (wall_as_segment, 60),
}
"""Family, how it is drawn, and how many."""
