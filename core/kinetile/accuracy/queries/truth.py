"""The exact truth about two discs, in integers, and about chains of contacts, in 100 digits.

Doubles, and ticks of 2^-52, are integers over a power of two; so is all that is made of them by addition and
multiplication. Whether two discs meet is then the sign of an integer, and the time of contact the root of a
quadratic with integer coefficients: one integer square root, and a division, to as many bits as one likes.
Nothing here is shared with the kernel.
"""

from __future__ import annotations

from decimal import Context, Decimal, localcontext
from functools import cached_property
from math import hypot, isqrt, sqrt
from typing import NamedTuple

__all__ = [
    "DEAD_ZONE",
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

DEAD_ZONE = 2.0**-47
"""Overlaps up to this times (R + separation at the anchor) are neglected, as the narrow phase documents."""

HORIZON = 1 << 62
"""Ticks after the later anchor beyond which the kernel predicts nothing, but anchors bodies anew before."""

_CLOCK = 52
_GUARD = 160
"""Bits of a time of contact behind its tick."""

DIGITS = Context(prec=100)


class Plan(NamedTuple):
    """A disc in uniform motion: centre at tick ``anchor``, velocity in a unit of 2^52 ticks, radius."""

    x: float
    y: float
    vx: float
    vy: float
    anchor: int
    radius: float

    def moving(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return coordinate and velocity along each axis."""
        return (self.x, self.vx), (self.y, self.vy)


class Encounter:
    """Two discs from the later of their anchors on.

    They meet when they touch and approach: at once if they touch or overlap and approach at the anchor,
    otherwise where their paths bring them to the sum of their radii while they approach. Grazing, with no
    speed towards each other at the touch, is no contact.

    Attributes:
        since: the later anchor, in ticks.
        hit: whether they meet.
        separation: distance of the centres at ``since``.
        reach: the sum of the radii, R.
        extent: the largest coordinate of the two centres, at their anchors or at ``since``.
        overlap: by how much the paths bring the discs nearer than they may be, as a length: nearer than R, or
            than the separation where that is less; negative: the gap at which they pass.
        closing: speed along the line of centres at the contact; 0 for a miss.
    """

    def __init__(self, one: Plan, two: Plan) -> None:
        self.since = since = max(one.anchor, two.anchor)
        speeds = (one.vx, one.vy, two.vx, two.vy)
        fine = max(_bits(value) for value in speeds)
        lengths = (one.x, one.y, two.x, two.y, one.radius, two.radius)
        self._fine = fine
        self._bits = bits = max(fine + _CLOCK, *(_bits(value) for value in lengths))

        def at(place: float, speed: float, anchor: int) -> int:
            flown = _whole(speed, fine) * (since - anchor)
            return _whole(place, bits) + (flown << (bits - fine - _CLOCK))

        corners = [at(place, speed, plan.anchor) for plan in (one, two) for place, speed in plan.moving()]
        self._dx = corners[2] - corners[0]
        self._dy = corners[3] - corners[1]
        self._vx = _whole(two.vx, fine) - _whole(one.vx, fine)
        self._vy = _whole(two.vy, fine) - _whole(one.vy, fine)
        self._reach = _whole(one.radius, bits) + _whole(two.radius, bits)

        self._a = self._vx**2 + self._vy**2
        self._b = self._dx * self._vx + self._dy * self._vy
        self._c = self._dx**2 + self._dy**2 - self._reach**2
        self._root = self._b**2 - self._a * self._c
        self.hit = self._b < 0 and (self._c <= 0 or self._root > 0)

        self._corners = [(_ratio(at, bits), speed) for at, speed in zip(corners, speeds, strict=True)]
        self.reach = _ratio(self._reach, bits)
        self.separation = _root_ratio(self._c + self._reach**2, 2 * bits)
        self.extent = max(abs(place) for place in (*lengths[:4], *(at for at, _ in self._corners)))
        self.overlap = self._deepest()
        self.closing = 0.0
        if self.hit:
            push = self._root if self._c > 0 else self._b**2
            self.closing = _root_ratio(push, 2 * (bits + fine)) / min(self.reach, self.separation)

    @property
    def dead_zone(self) -> float:
        """The overlap that the narrow phase may neglect, as it documents, as a length."""
        return DEAD_ZONE * (self.reach + self.separation)

    @property
    def proved(self) -> float:
        """The proved bound of the overlap at a contact that is computed, as a length: eta = 16 u X + 2 V q.

        See docs/one-answer.md. V is the larger of the two speeds, q a tick, X the largest coordinate up to
        the contact, or the separation over sqrt(2) where that is larger: no arena that holds it is smaller.
        """
        wait = self.contact / (1 << (_GUARD + _CLOCK))
        ends = [abs(at + speed * wait) for at, speed in self._corners]
        speeds = [speed for _, speed in self._corners]
        size = max(self.extent, *ends, self.separation / sqrt(2.0))
        return 16.0 * EPSILON * size + 2.0 * max(hypot(*speeds[:2]), hypot(*speeds[2:])) / (1 << _CLOCK)

    @cached_property
    def contact(self) -> int:
        """The time of contact after ``since`` in ticks, times 2^160, rounded down."""
        if self._c <= 0:
            return 0
        guard = 256
        divisor = (-self._b << guard) + isqrt(self._root << 2 * guard)
        return (self._c << (_CLOCK + _GUARD + guard + self._fine)) // (divisor << self._bits)

    @property
    def foreseeable(self) -> bool:
        """Whether they meet, and so soon that the kernel is to predict it."""
        return self.hit and self.contact >> _GUARD < HORIZON

    @property
    def tick(self) -> int:
        """The last tick not after the contact."""
        return self.since + (self.contact >> _GUARD)

    def ticks_late(self, tick: int) -> float:
        """By how many ticks an answer is late; negative: early, as one that is rounded down."""
        return _ratio(((tick - self.since) << _GUARD) - self.contact, _GUARD)

    def depth_by(self, tick: int) -> float:
        """How much nearer than they may be the discs have come by a tick, as a length; negative: the gap.

        They move on unhindered: at a tick after they were nearest it is all their overlap.
        """
        past, shift = tick - self.since, self._fine + _CLOCK
        if self._b < 0 and (self._b << shift) + (self._a * past << self._bits) >= 0:
            return self.overlap
        bits = self._bits + shift
        dx = (self._dx << shift) + (self._vx * past << self._bits)
        dy = (self._dy << shift) + (self._vy * past << self._bits)
        allowed = min(self._c, 0) + self._reach**2 << 2 * shift
        return _difference(allowed, dx**2 + dy**2, 1, bits)

    def _deepest(self) -> float:
        """Return ``overlap``: how much nearer than they may be the discs come from ``since`` on."""
        apart = self._c + self._reach**2
        if self._b >= 0:
            near = min(self._reach**2, apart)
            return _difference(near, apart, 1, self._bits)
        if self._c <= 0:
            return _difference(apart * self._a, apart * self._a - self._b**2, self._a, self._bits)
        cross = self._dx * self._vy - self._dy * self._vx
        return _difference(self._reach**2 * self._a, cross**2, self._a, self._bits)


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
