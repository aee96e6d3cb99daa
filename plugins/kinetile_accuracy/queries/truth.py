"""The exact truth about two discs, in integers, and about chains of contacts, in 100 digits.

Doubles, and ticks of 2^-52, are integers over a power of two; so is all that is made of them by addition and
multiplication. Whether two discs meet is then the sign of an integer, and the tick in which they do a whole
square root and a whole quotient: rule 5 of docs/specification.md, to the letter. Nothing here is shared with
the kernel.
"""

from __future__ import annotations

from decimal import Context, Decimal, localcontext
from functools import cached_property
from math import isqrt
from typing import NamedTuple

__all__ = [
    "EPSILON",
    "HORIZON",
    "Encounter",
    "Plan",
    "TrueContact",
    "chain_of_three",
    "line_contacts",
]

EPSILON = 2.0**-53
"""Half the distance from 1 to the next double."""

HORIZON = 1 << 62
"""Ticks after the later anchor from which on there is no contact: bodies are anchored anew before."""

_CLOCK = 52

DIGITS = Context(prec=100)


class Plan(NamedTuple):
    """A disc in uniform motion: centre at tick ``anchor``, velocity in a unit of 2^52 ticks, radius."""

    x: float
    y: float
    vx: float
    vy: float
    anchor: int
    radius: float

    def anchored(self, tick: int) -> tuple[float, float]:
        """Return the centre as it is written down when the plan is anchored at a tick: in doubles."""
        time = float(tick - self.anchor) / (1 << _CLOCK)
        return self.x + self.vx * time, self.y + self.vy * time


class Encounter:
    """Two discs from the later of their anchors on.

    Attributes:
        since: the later anchor, in ticks.
        tick: the tick of their contact; None: they do not meet, or only ``HORIZON`` ticks after ``since`` or
            later. Grazing, with no speed towards each other at the touch, is no contact.
    """

    def __init__(self, one: Plan, two: Plan) -> None:
        self._plans = one, two
        self.since = since = max(one.anchor, two.anchor)
        self._fine = fine = max(_bits(value) for value in (one.vx, one.vy, two.vx, two.vy))
        lengths = (one.x, one.y, two.x, two.y, one.radius, two.radius)
        self._bits = bits = max(fine + _CLOCK, *(_bits(value) for value in lengths))

        def at(place: float, speed: float, anchor: int) -> int:
            flown = _whole(speed, fine) * (since - anchor)
            return _whole(place, bits) + (flown << (bits - fine - _CLOCK))

        self._dx = at(two.x, two.vx, two.anchor) - at(one.x, one.vx, one.anchor)
        self._dy = at(two.y, two.vy, two.anchor) - at(one.y, one.vy, one.anchor)
        self._vx = _whole(two.vx, fine) - _whole(one.vx, fine)
        self._vy = _whole(two.vy, fine) - _whole(one.vy, fine)
        self._reach = _whole(one.radius, bits) + _whole(two.radius, bits)

        self._a = self._vx**2 + self._vy**2
        self._b = self._dx * self._vx + self._dy * self._vy
        self._c = self._dx**2 + self._dy**2 - self._reach**2
        self._root = self._b**2 - self._a * self._c
        self.tick = self._tick()

    def _tick(self) -> int | None:
        """Return the floor of (-b - sqrt(b^2 - ac)) / a, in ticks."""
        if self._b >= 0 or (self._c > 0 and self._root <= 0):
            return None
        if self._c <= 0:
            return self.since
        above = isqrt(self._root - 1) + 1  # the square root, rounded up
        wait = (-self._b - above) // (self._a << (self._bits - self._fine - _CLOCK))
        return self.since + wait if wait < HORIZON else None

    @property
    def reach(self) -> float:
        """The sum of the radii, R."""
        return _ratio(self._reach, self._bits)

    @cached_property
    def overlap(self) -> float:
        """By how much the paths bring the discs nearer than R from ``since`` on; negative: the gap at which
        they pass."""
        apart = self._c + self._reach**2
        if self._b >= 0:
            return _difference(self._reach**2, apart, 1, self._bits)
        cross = self._dx * self._vy - self._dy * self._vx
        return _difference(self._reach**2 * self._a, cross**2, self._a, self._bits)

    @property
    def closing(self) -> float:
        """The speed along the line of centres at the contact; only where there is one."""
        push, distance = (
            (self._root, self._reach**2) if self._c > 0 else (self._b**2, self._c + self._reach**2)
        )
        return _root_ratio(push, 2 * (self._bits + self._fine)) / _root_ratio(distance, 2 * self._bits)

    def depth_at(self, tick: int) -> float:
        """How far the discs overlap once both are anchored at a tick; what they overlap at ``since`` is not
        counted; negative: the gap."""
        (x, y), (x2, y2) = (plan.anchored(tick) for plan in self._plans)
        bits = max(self._bits, *(_bits(value) for value in (x, y, x2, y2)))
        dx, dy = (_whole(far, bits) - _whole(near, bits) for far, near in ((x2, x), (y2, y)))
        allowed = min(self._c, 0) + self._reach**2 << 2 * (bits - self._bits)
        return _difference(allowed, dx**2 + dy**2, 1, bits)

    def rho(self, tick: int) -> float:
        """The bound of the rounding of both places anchored at a tick: 16 u X, X the largest coordinate."""
        ends = [
            abs(place) for plan in self._plans for at in (plan.anchor, tick) for place in plan.anchored(at)
        ]
        return 16.0 * EPSILON * max(ends)


class TrueContact(NamedTuple):
    """A contact of a chain: its time, the bodies or walls (-1 left, -2 right), and the closing speed."""

    time: Decimal
    a: int
    b: int
    closing: float

    def ticks_off(self, tick: int) -> float:
        """Return how many ticks, and parts of one, lie between the contact and a tick."""
        with localcontext(DIGITS):
            return float(abs(tick - self.time * (1 << _CLOCK)))


def line_contacts(
    x: list[float], v: list[float], radius: list[float], mass: list[float], width: float, most: int
) -> list[TrueContact]:
    """Return the first contacts of discs on a line, from left to right, between walls at 0 and ``width``."""
    with localcontext(DIGITS):
        place, speed = [Decimal(value) for value in x], [Decimal(value) for value in v]
        size, weight, right = [Decimal(r) for r in radius], [Decimal(m) for m in mass], Decimal(width)
        now, last = Decimal(0), len(x) - 1
        found: list[TrueContact] = []
        while len(found) < most:
            meetings = []
            if speed[0] < 0:
                meetings.append(((place[0] - size[0]) / -speed[0], 0, -1, -speed[0]))
            if speed[last] > 0:
                meetings.append(((right - size[last] - place[last]) / speed[last], last, -2, speed[last]))
            for i in range(last):
                closing = speed[i] - speed[i + 1]
                if closing > 0:
                    gap = place[i + 1] - place[i] - size[i] - size[i + 1]
                    meetings.append((gap / closing, i, i + 1, closing))
            if not meetings:
                break
            wait, a, b, closing = min(meetings)
            now += wait
            place = [p + s * wait for p, s in zip(place, speed, strict=True)]
            if b < 0:
                speed[a] = -speed[a]
            else:
                share = 2 * closing / (weight[a] + weight[b])
                speed[a] -= share * weight[b]
                speed[b] += share * weight[a]
            found.append(TrueContact(now, a, b, float(closing)))
        return found


def chain_of_three(plans: tuple[Plan, Plan, Plan], mass: tuple[float, float]) -> TrueContact | None:
    """Return the contact of the second and third disc after the first and second have collided.

    All are anchored at tick 0. None: one of the two meetings does not take place.
    """
    with localcontext(DIGITS):
        place = [(Decimal(plan.x), Decimal(plan.y)) for plan in plans]
        speed = [(Decimal(plan.vx), Decimal(plan.vy)) for plan in plans]
        size = [Decimal(plan.radius) for plan in plans]
        struck, striking = Decimal(mass[1]), Decimal(mass[0])
        first = _meeting(place[0], speed[0], place[1], speed[1], size[0] + size[1])
        if first is None:
            return None
        wait = first[0]
        place = [(p[0] + v[0] * wait, p[1] + v[1] * wait) for p, v in zip(place, speed, strict=True)]
        nx, ny = place[1][0] - place[0][0], place[1][1] - place[0][1]
        along = (speed[1][0] - speed[0][0]) * nx + (speed[1][1] - speed[0][1]) * ny
        push = -2 * striking / (striking + struck) * along / (nx * nx + ny * ny)
        after = (speed[1][0] + push * nx, speed[1][1] + push * ny)
        second = _meeting(place[1], after, place[2], speed[2], size[1] + size[2])
        return None if second is None else TrueContact(wait + second[0], 1, 2, float(second[1]))


Vector = tuple[Decimal, Decimal]


def _meeting(p: Vector, v: Vector, q: Vector, w: Vector, reach: Decimal) -> tuple[Decimal, Decimal] | None:
    """Return after which time two points come within ``reach``, and how fast then; None: they do not."""
    dx, dy, vx, vy = q[0] - p[0], q[1] - p[1], w[0] - v[0], w[1] - v[1]
    a, b = vx * vx + vy * vy, dx * vx + dy * vy
    c = dx * dx + dy * dy - reach * reach
    root = b * b - a * c
    if b >= 0 or root <= 0 or c < 0:
        return None
    return c / (root.sqrt() - b), root.sqrt() / reach


def _bits(value: float) -> int:
    """Return the number of binary places of a double."""
    return value.as_integer_ratio()[1].bit_length() - 1


def _whole(value: float, bits: int) -> int:
    """Return a double times 2^bits, which must be an integer."""
    top, bottom = value.as_integer_ratio()
    return top << (bits - bottom.bit_length() + 1)


def _ratio(value: int, bits: int) -> float:
    """Return an integer over 2^bits, rounded once."""
    return value / (1 << bits)


def _root_ratio(square: int, bits: int) -> float:
    """Return the square root of an integer over 2^bits (an even number)."""
    return isqrt(square << 256) / (1 << (bits // 2 + 128))


def _difference(more: int, less: int, over: int, bits: int) -> float:
    """Return (sqrt(more) - sqrt(less)) / sqrt(over) / 2^bits, without cancellation."""
    if over == 0 or more == less:
        return 0.0
    sum_of_roots = isqrt(more << 256) + isqrt(less << 256)
    return ((more - less) << 256) / (sum_of_roots * isqrt(over << 256) << bits)
