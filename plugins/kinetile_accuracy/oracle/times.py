"""Numbers and times of the oracle: rational if possible, else balls that certainly hold them.

The doubles of a scene are rational, and so is the flight of a disc until its first contact at an irrational
time. Sums and products of rational numbers and balls are balls, so one formula serves both, and rational
values are compared exactly. The contact of two discs on rational plans is at p - sqrt(q) with rational p and
q; two such times are compared by squaring. All times count from the scene's start. Needs python-flint.
"""

import math
from typing import NamedTuple

from flint import arb, fmpq

Number = arb | fmpq
Pair = tuple[Number, Number]

ZERO = fmpq(0)


class Root(NamedTuple):
    """The number p - sqrt(q)."""

    p: fmpq
    q: fmpq

    @property
    def rational(self) -> fmpq | None:
        """The number, if it is rational."""
        above, below = self.q.numerator, self.q.denominator
        if not (above.is_square() and below.is_square()):
            return None
        return self.p - fmpq(above.isqrt(), below.isqrt())


class EventTime:
    """A time: as a ball, as bounds in doubles, and exactly if it is rational or a root. Two events are at one
    time if and only if they share the same moment object, as soon as they were compared."""

    __slots__ = ("ball", "high", "low", "number", "root")

    def __init__(self, number: Number, root: Root | None = None) -> None:
        self.number = number
        self.root = Root(number, ZERO) if isinstance(number, fmpq) else root
        self.ball = ball = arb(number)
        middle = float(ball)
        pad = 2.0**-50 * abs(middle) + 1.0000001 * float(ball.rad()) + 2.0**-1060
        known = pad < math.inf
        self.low = middle - pad if known else (1e300 if middle > 0.0 else -math.inf)
        self.high = middle + pad if known else math.inf

    def compare(self, other: "EventTime") -> int | None:
        """Returns -1, 0 or 1 if it is before another time, equal to it, or after it; None: unknown."""
        if self is other:
            return 0
        if self.ball < other.ball or self.ball > other.ball:
            return -1 if self.ball < other.ball else 1
        return 0 if self.root and other.root and same(self.root, other.root) else None


class OraclePlan(NamedTuple):
    """A flight plan: the place at ``anchor``, and the velocity."""

    place: Pair
    velocity: Pair
    anchor: fmpq

    def at(self, time: fmpq) -> Pair:
        """Returns the position at a time."""
        since = time - self.anchor
        return self.place[0] + self.velocity[0] * since, self.place[1] + self.velocity[1] * since

    def mirrored(self, axis: int, place: fmpq) -> "OraclePlan":
        """Returns the plan mirrored at a place on an axis; its anchor stays."""
        mirror = with_axis(self.place, axis, 2 * place - self.place[axis])
        return OraclePlan(mirror, with_axis(self.velocity, axis, -self.velocity[axis]), self.anchor)


def exact(number: float) -> fmpq:
    """Returns a double as a rational number."""
    return fmpq(*number.as_integer_ratio())


def same(one: Root, two: Root) -> bool:
    """Returns True if two roots are one number. With r and r' for sqrt(q) and sqrt(q'), r - r' = p - p' = d
    holds if and only if both sides have one sign and one square: 2 r r' = q + q' - d^2."""
    d, e = one.p - two.p, one.q - two.q
    if (d > 0) != (e > 0) or (d < 0) != (e < 0):
        return False
    rest = (one.q + two.q - d * d) / 2
    return bool(rest >= 0 and rest * rest == one.q * two.q)


def lower_end(ball: arb) -> fmpq:
    """Returns the lower end of a ball."""
    mantissa, exponent = ball.lower().man_exp()
    return fmpq(mantissa) * fmpq(2) ** int(exponent)


def with_axis(pair: Pair, axis: int, number: Number) -> Pair:
    """Returns a pair with another number for one axis."""
    return (number, pair[1]) if axis == 0 else (pair[0], number)
