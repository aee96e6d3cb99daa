"""Flight plans and times of the oracle: in balls, and, where they are rational, exactly.

The doubles of a scene are rational, and so is the flight of a disc until its first contact at an irrational
time. Walls and turns keep it rational, and so do contacts in line, whose times are rational, whatever the
response. As long as two discs fly on rational lines their contact is at p - sqrt(q) with rational p and q,
the end of their passing at p + sqrt(q), and two such numbers are compared by squaring. A line is given by its
position at time 0, not at its last change: a mirror then only changes signs, and the numbers do not grow.

All times count from the scene's start. Needs python-flint.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

from flint import arb, fmpq

LONGEST = 4096
"""Bits of the longest numerator or denominator that is worth keeping."""

ZERO = fmpq(0)

Number = TypeVar("Number", arb, fmpq)


class Root(NamedTuple):
    """The number p - sqrt(q), or p + sqrt(-q) where q < 0."""

    p: fmpq
    q: fmpq

    @property
    def rational(self) -> fmpq | None:
        """The number, where it is rational."""
        above, below = abs(self.q.numerator), self.q.denominator
        if not (above.is_square() and below.is_square()):
            return None
        return self.p - _sign(self.q) * fmpq(above.isqrt(), below.isqrt())


class Line(NamedTuple):
    """Flight on a straight line: at time t at place + velocity t, on each axis."""

    place: tuple[fmpq, fmpq]
    velocity: tuple[fmpq, fmpq]

    def turned(self, velocity: tuple[fmpq, fmpq], at: fmpq) -> Line | None:
        """Returns the line that leaves this one at a time with another velocity.

        None where the numbers have become too long to be worth keeping.
        """
        x, y = (p + (v - w) * at for p, v, w in zip(self.place, self.velocity, velocity, strict=True))
        return Line((x, y), velocity) if max(x.height_bits(), y.height_bits()) <= LONGEST else None

    def moved(self, by: tuple[fmpq, fmpq]) -> Line:
        """Returns the same line elsewhere."""
        return Line((self.place[0] + by[0], self.place[1] + by[1]), self.velocity)

    def mirrored(self, axis: int, place: fmpq) -> Line:
        """Returns the line mirrored at a place on an axis."""
        return Line(with_axis(self.place, axis, 2 * place - self.place[axis]), _flipped(self.velocity, axis))


class BallPlan(NamedTuple):
    """A flight plan: balls of the place at ``anchor``, an exact time, and of the velocity.

    ``line`` is the same exactly, where it is rational.
    """

    place: tuple[arb, arb]
    velocity: tuple[arb, arb]
    anchor: arb
    line: Line | None

    @classmethod
    def along(cls, line: Line) -> BallPlan:
        """Returns the plan of a line."""
        (x, y), (vx, vy) = line
        return cls((arb(x), arb(y)), (arb(vx), arb(vy)), arb(0), line)

    def beside(self, other: BallPlan) -> bool:
        """Returns whether two plans certainly have one velocity."""
        if self.line is not None and other.line is not None:
            return self.line.velocity == other.line.velocity
        (vx, vy), (wx, wy) = self.velocity, other.velocity
        return self.velocity is other.velocity or (vx == wx and vy == wy)

    def at(self, time: arb) -> tuple[arb, arb]:
        """Returns the position at a time."""
        since = time - self.anchor
        return self.place[0] + self.velocity[0] * since, self.place[1] + self.velocity[1] * since

    def mirrored(self, axis: int, place: fmpq) -> BallPlan:
        """Returns the plan mirrored at a place on an axis; its anchor stays."""
        mirror = with_axis(self.place, axis, arb(2 * place) - self.place[axis])
        line = None if self.line is None else self.line.mirrored(axis, place)
        return BallPlan(mirror, _flipped(self.velocity, axis), self.anchor, line)

    def turned_back(self, axis: int, time: EventTime) -> BallPlan:
        """Returns the plan that leaves this one at a time with the opposite velocity on an axis."""
        passed = 2 * self.velocity[axis] * (time.ball - self.anchor)
        line, now = self.line, time.rational
        if line is not None:
            line = None if now is None else line.turned(_flipped(line.velocity, axis), now)
        place = with_axis(self.place, axis, self.place[axis] + passed)
        return BallPlan(place, _flipped(self.velocity, axis), self.anchor, line)


class EventTime:
    """A time: as a ball, as bounds in doubles, and, where it has one, as an exact root.

    Two events are at one time if and only if they have the very same moment, as soon as they were compared.
    ``form`` computes the root; it is called when ``root`` is read first.
    """

    __slots__ = ("_form", "_root", "ball", "high", "low")

    def __init__(self, ball: arb, form: Callable[[], Root] | None = None, root: Root | None = None) -> None:
        self.ball = ball
        self._form = form
        self._root = root
        middle = float(ball)
        pad = 2.0**-50 * abs(middle) + 1.0000001 * float(ball.rad()) + 2.0**-1060
        known = pad < math.inf
        self.low = middle - pad if known else (1e300 if middle > 0.0 else -math.inf)
        self.high = middle + pad if known else math.inf

    @classmethod
    def at(cls, time: fmpq) -> EventTime:
        """Returns the moment of a rational time."""
        return cls(arb(time), root=Root(time, ZERO))

    @property
    def root(self) -> Root | None:
        """The exact time, where the discs that make it fly on rational lines."""
        if self._root is None and self._form is not None:
            self._root = self._form()
        return self._root

    @property
    def rational(self) -> fmpq | None:
        """The exact time, where it is rational."""
        return None if self.root is None else self.root.rational


def exact(number: float) -> fmpq:
    """Returns a double as a rational number."""
    return fmpq(*number.as_integer_ratio())


def same(one: Root, two: Root) -> bool:
    """Returns whether two roots are one number.

    With r and r' for sqrt(q) and sqrt(q'), or -sqrt(-q), r - r' = p - p' = d holds if and only if both sides
    have one sign and one square: 2 r r' = |q| + |q'| - d^2.
    """
    d = one.p - two.p
    if _sign(d) != _sign(one.q - two.q):
        return False
    rest = (abs(one.q) + abs(two.q) - d * d) / 2
    return _sign(rest) == _sign(one.q * two.q) and rest * rest == abs(one.q * two.q)


def first_root(one: Line, two: Line, reach: fmpq) -> Root:
    """Returns the first time at which two discs are ``reach`` apart, of two that certainly come so near."""
    a, b, c = quadratic(one, two, reach, ZERO)
    return Root(-b / a, (b * b - a * c) / (a * a))


def last_root(one: Line, two: Line, reach: fmpq) -> Root:
    """Returns the last time at which two discs are ``reach`` apart, of two that certainly come so near."""
    p, q = first_root(one, two, reach)
    return Root(p, -q)


def first_contact(one: Line, two: Line, reach: fmpq, now: fmpq) -> Root | None:
    """Returns when two discs, the sum of whose radii is ``reach``, first meet from ``now`` on.

    Contact means approach, and tangency is none. Discs that touch or overlap, and approach, meet now, and
    only then is the root ``now`` itself.
    """
    a, b, c = quadratic(one, two, reach, now)
    if _sign(b) >= 0 or (_sign(c) > 0 and _sign(b * b - a * c) <= 0):
        return None
    return Root(now, ZERO) if _sign(c) <= 0 else Root(now - b / a, (b * b - a * c) / (a * a))


def exchange(
    one: Line, two: Line, gains: tuple[fmpq, fmpq], at: fmpq, shift: tuple[fmpq, fmpq] = (ZERO, ZERO)
) -> tuple[Line | None, Line | None]:
    """Returns the lines after a contact at a time, with the second body that far from where it is.

    ``gains`` are the parts of the closing speed by which each changes its own. None for a line that is not
    worth keeping.
    """
    (dx, dy), (vx, vy) = _apart(one, two.moved(shift), at)
    share = (dx * vx + dy * vy) / (dx * dx + dy * dy)
    to_one, to_two = share * gains[0], -share * gains[1]
    (ax, ay), (bx, by) = one.velocity, two.velocity
    return (
        one.turned((ax + to_one * dx, ay + to_one * dy), at),
        two.turned((bx + to_two * dx, by + to_two * dy), at),
    )


def quadratic(one: Line, two: Line, reach: fmpq, at: fmpq) -> tuple[fmpq, fmpq, fmpq]:
    """Returns a, b, c: the squared distance less the squared reach is a t^2 + 2 b t + c, a time t later."""
    (dx, dy), (vx, vy) = _apart(one, two, at)
    return vx * vx + vy * vy, dx * vx + dy * vy, dx * dx + dy * dy - reach * reach


def _apart(one: Line, two: Line, at: fmpq) -> tuple[tuple[fmpq, fmpq], tuple[fmpq, fmpq]]:
    """Returns the separation of two lines at a time, and their relative velocity."""
    vx, vy = two.velocity[0] - one.velocity[0], two.velocity[1] - one.velocity[1]
    return (two.place[0] - one.place[0] + vx * at, two.place[1] - one.place[1] + vy * at), (vx, vy)


def with_axis(pair: tuple[Number, Number], axis: int, number: Number) -> tuple[Number, Number]:
    """Returns a pair with another number for one axis."""
    return (number, pair[1]) if axis == 0 else (pair[0], number)


def _flipped(pair: tuple[Number, Number], axis: int) -> tuple[Number, Number]:
    return (-pair[0], pair[1]) if axis == 0 else (pair[0], -pair[1])


def _sign(number: fmpq) -> int:
    return (number > 0) - (number < 0)
