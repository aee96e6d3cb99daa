"""Rules 3 to 6 and 9 of docs/specification.md, and what rules 9 and 11 say of two bodies, word by word, in
whole numbers.

Nothing here is kinetile's. Lengths and velocities are floats only as names of doubles; what is computed with
them is done in integers (``Scaled``) or by ``Double``.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import floor, inf, isqrt
from typing import NamedTuple

from .doubles import Double, error_of_product, sqrt

__all__ = [
    "FAR",
    "Plan",
    "anchored",
    "are_closer",
    "exchange",
    "exchange_along",
    "first_image",
    "given_back",
    "has_room",
    "meeting",
    "normal",
    "off_wall",
    "overlap_at_insertion",
    "overlap_at_start",
    "parting",
    "tick_of",
    "unit_exponent",
    "wall_contact",
    "wrapped",
]

FAR = 1 << 62
"""Ticks after the anchor from which on nothing is predicted."""

LEFT, RIGHT, BOTTOM, TOP = -1, -2, -3, -4

Arena = tuple[float, float]
Velocity = tuple[float, float]
Periods = tuple[float, float]
Image = tuple[int, int]

WALLED = (0.0, 0.0)
"""The periods of axes that are not periodic."""


class Plan(NamedTuple):
    """A disc and its flight: centre at tick ``anchor``, velocity in the scene's time, radius, and the periods
    that were taken off the centre."""

    x: float
    y: float
    vx: float
    vy: float
    radius: float
    anchor: int
    kx: int = 0
    ky: int = 0


def unit_exponent(
    places: Sequence[tuple[float, float]],
    radii: Sequence[float],
    velocities: Sequence[Velocity],
    turned: Sequence[Velocity],
    arena: Arena | None,
) -> int:
    """Return e, where the unit is 2^-e (rule 3), of a scene that does not say its unit."""
    if not places and arena is None:
        return 0
    squares = [Double(0)] + [
        Double(vx) * Double(vx) + Double(vy) * Double(vy) for vx, vy in (*velocities, *turned)
    ]
    fastest = max(squares, key=lambda square: square.exact)
    if arena is not None:
        length = Double(max(arena))
    else:
        length = Double(max(abs(value) for place in places for value in place)) + Double(max(radii))
    crossings = sqrt(fastest) / length * Double(1 - Fraction(1, 1 << 20))
    return next((e for e in range(901) if crossings.exact < 1 << e), 900)


def tick_of(time: float, start: float, e: int) -> int:
    """Return the tick of a time (rule 3)."""
    return floor((Fraction(time) - Fraction(start)) * (1 << 52 + e))


def _remainder(place: float, period: float) -> tuple[float, int]:
    """Return rem(place, period) of rule 2p, and how many periods that leaves out."""
    if not period:
        return place, 0
    turns = round(Fraction(place) / Fraction(period))  # of two the even one
    return float(Fraction(place) - turns * Fraction(period)), turns


def wrapped(plan: Plan, periods: Periods) -> Plan:
    """Return a plan with its periods taken off (rule 4p)."""
    x, right = _remainder(plan.x, periods[0])
    y, up = _remainder(plan.y, periods[1])
    return plan._replace(x=x, y=y, kx=plan.kx + right, ky=plan.ky + up)


def anchored(plan: Plan, tick: int, e: int, periods: Periods = WALLED) -> Plan:
    """Return a plan anchored at a tick (rules 4 and 4p)."""
    delay = Double(tick - plan.anchor) * Double(Fraction(1, 1 << 52 + e))
    x = Double(plan.x) + Double(plan.vx) * delay
    y = Double(plan.y) + Double(plan.vy) * delay
    return wrapped(plan._replace(x=float(x), y=float(y), anchor=tick), periods)


class Scaled:
    """Doubles as whole numbers of 2^-bits; velocities as what is flown in a tick."""

    def __init__(self, e: int, lengths: Sequence[float], velocities: Sequence[float]) -> None:
        self.tick = 52 + e
        self.bits = max(
            *(_bits(value) for value in lengths), *(_bits(value) + self.tick for value in velocities)
        )

    def length(self, value: float) -> int:
        top, _ = value.as_integer_ratio()
        return top << self.bits - _bits(value)

    def a_tick(self, value: float) -> int:
        top, _ = value.as_integer_ratio()
        return top << self.bits - _bits(value) - self.tick


def _bits(value: float) -> int:
    """Return the number of binary places of a double."""
    return value.as_integer_ratio()[1].bit_length() - 1


class Course(NamedTuple):
    """Two bodies from tick ``since`` on, the later anchor: t ticks later Q is a t^2 + 2 b t + c, and B is
    a t + b, in whole numbers of some unit."""

    since: int
    a: int
    b: int
    c: int


def _course(one: Plan, two: Plan, e: int, periods: Periods = WALLED, image: Image = (0, 0)) -> Course:
    lengths = (one.x, one.y, one.radius, two.x, two.y, two.radius, *periods)
    scaled = Scaled(e, lengths, (one.vx, one.vy, two.vx, two.vy))
    since = max(one.anchor, two.anchor)

    def along(place_1: float, speed_1: float, place_2: float, speed_2: float) -> tuple[int, int]:
        """Return separation at ``since`` and what it changes by in a tick, along one axis."""
        w1, w2 = scaled.a_tick(speed_1), scaled.a_tick(speed_2)
        at_1 = scaled.length(place_1) + w1 * (since - one.anchor)
        at_2 = scaled.length(place_2) + w2 * (since - two.anchor)
        return at_2 - at_1, w2 - w1

    dx, wx = along(one.x, one.vx, two.x, two.vx)
    dy, wy = along(one.y, one.vy, two.y, two.vy)
    dx += (image[0] + two.kx - one.kx) * scaled.length(periods[0])
    dy += (image[1] + two.ky - one.ky) * scaled.length(periods[1])
    reach = scaled.length(one.radius) + scaled.length(two.radius)
    return Course(since, wx * wx + wy * wy, dx * wx + dy * wy, dx * dx + dy * dy - reach * reach)


def meeting(one: Plan, two: Plan, e: int, periods: Periods = WALLED, image: Image = (0, 0)) -> int | None:
    """Return the tick of contact of two bodies, through an image; None: there is none (rules 5 and 5p)."""
    since, a, b, c = _course(one, two, e, periods, image)
    if b >= 0:
        return None
    if c <= 0:
        return since
    discriminant = b * b - a * c
    if discriminant <= 0:
        return None
    # k <= (-b - sqrt(discriminant))/a, that is, -b - a k is at least the root, rounded up
    wait = (-b - (isqrt(discriminant - 1) + 1)) // a
    return None if wait >= FAR else since + wait


def first_image(
    one: Plan, two: Plan, e: int, periods: Periods, barred: Image | None, low: bool = True
) -> tuple[int, Image] | None:
    """Return the tick of contact of two bodies, the elder first, and through which image (rule 5p); None:
    there is none within 2^55 ticks, and no plan is kept for so long. With ``low`` it is the least image of
    that tick, otherwise the greatest.

    Images are asked by how soon they can be reached: of those that cannot be within some time none is met
    in it.
    """
    since, tick = max(one.anchor, two.anchor), Fraction(1, 1 << 52 + e)
    reach = Fraction(one.radius) + Fraction(two.radius)

    def within(axis: int, ticks: int) -> range:
        """Return the images whose separation along an axis is no more than the reach, at some time."""
        if not periods[axis]:
            return range(1)
        period, (k1, k2) = Fraction(periods[axis]), ((one.kx, two.kx), (one.ky, two.ky))[axis]
        speeds = Fraction(one[2 + axis]), Fraction(two[2 + axis])
        here = Fraction(two[axis]) + speeds[1] * (since - two.anchor) * tick + (k2 - k1) * period
        here -= Fraction(one[axis]) + speeds[0] * (since - one.anchor) * tick
        there = here + (speeds[1] - speeds[0]) * ticks * tick
        return range(
            -floor((max(here, there) + reach) / period), floor((reach - min(here, there)) / period) + 1
        )

    for power in range(50, 56):
        found = []
        for image in ((m, n) for m in within(0, (1 << power) + 1) for n in within(1, (1 << power) + 1)):
            met = None if image == barred else meeting(one, two, e, periods, image)
            if met is not None and met <= since + (1 << power):
                found.append((met, image))
        if found:
            first = min(found)[0]
            return (min if low else max)(each for each in found if each[0] == first)
    return None


def parting(one: Plan, two: Plan, e: int) -> int | None:
    """Return the tick of parting of two bodies that pass; None: there is none (rule 11)."""
    since, a, b, c = _course(one, two, e)
    discriminant = b * b - a * c
    if c > 0 and (b >= 0 or discriminant <= 0):
        return since
    if a == 0:
        return None
    wait = (-b + isqrt(discriminant)) // a
    return None if wait >= FAR else since + wait


ROOM = Double(1e-12)


def are_closer(one: Plan, two: Plan, e: int) -> bool:
    """Whether two bodies overlap by more than 1e-12, exactly: another reading of rules 9 and 11."""
    course = _course(one, two, e)
    both = Fraction(one.radius) + Fraction(two.radius)
    scaled = Scaled(e, (one.x, one.y, one.radius, two.x, two.y, two.radius), (one.vx, one.vy, two.vx, two.vy))
    square = Fraction(course.c, 1 << 2 * scaled.bits) + both * both
    return square < (both * (1 - Fraction(1e-12))) ** 2


def overlap_at_start(one: Plan, two: Plan, e: int) -> bool:
    """Whether two bodies that may pass begin to at the start (rule 11)."""
    dx, dy = Double(one.x) - Double(two.x), Double(one.y) - Double(two.y)
    reach = (Double(one.radius) + Double(two.radius)) * (Double(1) - ROOM)
    return sqrt(dx * dx + dy * dy).exact < reach.exact


def overlap_at_insertion(new: Plan, other: Plan, e: int) -> bool:
    """Whether a body that is inserted begins to pass through another (rule 11)."""
    return _overlap(new, other, (Double(other.radius) + Double(new.radius)) * (Double(1) - ROOM), e)


def has_room(
    new: Plan, arena: Arena | None, others: Sequence[Plan], e: int, periods: Periods = WALLED
) -> bool:
    """Whether there is room for a body that is inserted, among these that it does not pass (rules 9, 9p)."""
    radius = Double(new.radius)
    least = radius - ROOM * radius
    if arena is not None:
        for place, side, period in zip((new.x, new.y), arena, periods, strict=True):
            gaps = () if period else (Double(place), Double(side) - Double(place))
            if any(gap.exact < least.exact for gap in gaps):
                return False
    new = wrapped(new, periods)
    for other in others:
        both = radius + Double(other.radius)
        if _overlap(new, other, both - ROOM * both, e, periods):
            return False
    return True


def _overlap(new: Plan, other: Plan, reach: Double, e: int, periods: Periods = WALLED) -> bool:
    there = anchored(other, new.anchor, e, periods)
    dx, dy = Double(there.x) - Double(new.x), Double(there.y) - Double(new.y)
    dx, dy = (Double(_remainder(float(d), P)[0]) for d, P in zip((dx, dy), periods, strict=True))
    return (dx * dx + dy * dy).exact < (reach * reach).exact


def wall_contact(
    plan: Plan,
    arena: Arena,
    e: int,
    periods: Periods = WALLED,
    reaches: tuple[float, float, float, float] | None = None,
) -> tuple[int, int] | None:
    """Return tick and wall of a body's contact with a wall; None: there is none (rules 6, 6p and 6s).
    ``reaches``: of a shape, in the place of the radius for left, right, bottom and top."""
    reaches = reaches or (plan.radius,) * 4
    scaled = Scaled(e, (plan.x, plan.y, *reaches, *arena), (plan.vx, plan.vy))
    first: tuple[int, int] | None = None
    for place, speed, side, period, low, high in (
        (plan.x, plan.vx, arena[0], periods[0], LEFT, RIGHT),
        (plan.y, plan.vy, arena[1], periods[1], BOTTOM, TOP),
    ):
        if speed == 0 or period:
            continue
        wall = low if speed < 0 else high
        ahead = scaled.length(place) if speed < 0 else scaled.length(side) - scaled.length(place)
        gap = ahead - scaled.length(reaches[-1 - wall])
        wait = max(gap, 0) // abs(scaled.a_tick(speed))
        if wait < FAR and (first is None or plan.anchor + wait < first[0]):
            first = (plan.anchor + wait, wall)
    return first


def exchange(
    one: Plan,
    two: Plan,
    masses: tuple[float, float] | None,
    periods: Periods = WALLED,
    image: Image = (0, 0),
    back: float = 1.0,
) -> tuple[Velocity, Velocity]:
    """Return the velocities of bodies a < b after their contact through an image; ``masses``: None, if all
    are equal (rules 9 and 9p). ``back``: the k of restitution."""
    right, up = image[0] + two.kx - one.kx, image[1] + two.ky - one.ky
    dx = (Double(two.x) - Double(one.x)) + Double(right) * Double(periods[0])
    dy = (Double(two.y) - Double(one.y)) + Double(up) * Double(periods[1])
    return exchange_along(normal(dx, dy), (one.vx, one.vy), (two.vx, two.vy), masses, back)


def normal(dx: Double, dy: Double) -> tuple[Double, Double]:
    """Return the unit normal along a line (rule 9)."""
    length = sqrt(dx * dx + dy * dy)
    return dx / length, dy / length


def exchange_along(
    along: tuple[Double, Double],
    one: Velocity,
    two: Velocity,
    masses: tuple[float, float] | None,
    back: float = 1.0,
) -> tuple[Velocity, Velocity]:
    """Return the velocities of two bodies after a contact with this unit normal (rules 9, 9s and 11)."""
    half = Double(Fraction(1, 2))
    nx, ny = along
    vxa, vya, vxb, vyb = (Double(v) for v in (*one, *two))
    ux = vxb - vxa
    uy = vyb - vya
    xx = nx * nx
    yy = ny * ny
    excess = ((xx - half) + (yy - half)) + (error_of_product(nx, nx) + error_of_product(ny, ny))
    px = ux * nx
    py = uy * ny
    total = px + py
    part = total - px
    low = ((px - (total - part)) + (py - part)) + (error_of_product(ux, nx) + error_of_product(uy, ny))
    speed = (half * (Double(1) + Double(back))) * (total + (low - total * excess))
    ga = gb = speed
    if masses is not None:
        ga, gb = _share(*masses, speed), _share(*reversed(masses), speed)
    after_a = (float(vxa + ga * nx), float(vya + ga * ny))
    after_b = (float(vxb - gb * nx), float(vyb - gb * ny))
    return after_a, after_b


def off_wall(plan: Plan, wall: int, back: float) -> Velocity:
    """Return the velocity after a wall that gives back a share (rule 11)."""
    nx, ny = (Double(out) for out in ((-1, 0), (1, 0), (0, -1), (0, 1))[-1 - wall])
    vx, vy = Double(plan.vx), Double(plan.vy)
    w = (Double(1) + Double(back)) * (vx * nx + vy * ny)
    return float(vx - w * nx), float(vy - w * ny)


def given_back(share: float, contact_time: float, ticks: int, e: int, exactly: bool = False) -> float:
    """Return the k of restitution so many ticks after the last contact (rule 11)."""
    q = Fraction(1, 1 << 52 + e)
    since = ticks * q if exactly else (Double(ticks) * Double(q)).exact
    return 1.0 if since <= Fraction(contact_time) else share


def _share(mass: float, other: float, speed: Double) -> Double:
    """Return the part of an exchange that a body of this mass takes from another (rules 9 and 11)."""
    if mass == inf:
        return speed if other == inf else Double(0)
    if other == inf:
        return Double(2) * speed
    m, o = Double(mass), Double(other)
    twice = Double(2) * o
    both = m + o
    part = both - m
    low = (m - (both - part)) + (o - part)
    f = twice / both
    back = f * both
    rest = ((twice - back) - error_of_product(f, both) - low * f) / both
    taken = f * speed
    return taken + (error_of_product(f, speed) + rest * speed)
