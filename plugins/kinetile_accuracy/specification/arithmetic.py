"""Rules 1 to 6 and 9 of docs/specification.md: times of contact in integers, plans and exchanges in doubles,
periodic axes and gravity among them.

*Exact.* A double is an integer over a power of two, and so is the length of a tick. So a plan is written once
as integers of one fineness: its coordinates, and how far it flies in a tick, in units of 2^-bits of the
length. Where two bodies are at some tick, and the coefficients of the quadratic for the distance of their
centres, are then integers too, with the time counted in ticks::

    a T^2 + 2 b T + c,   a = |v|^2,  b = d . v,  c = |d|^2 - R^2

The first root is (-b - sqrt(D)) / a with D = b^2 - a c. Its floor is the floor of floor(-b - sqrt(D)) / a,
and floor(-b - sqrt(D)) is -b - r with the integer square root r of D, or one less where D is no square. So
one ``isqrt`` and one division give the tick of contact, and nothing is rounded before.

*Rounded.* Python's float is a double, each of its operations rounds once, to nearest and ties to even, and
nothing is contracted; ``float(n)`` of an integer and the quotient of two integers are rounded correctly as
well. So rules 4 and 9 are the same expressions here, in the order of the rules.

Nothing here is shared with the kernel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from fractions import Fraction

from kinetile import Remove, Scene
from kinetile.instruments import BOTTOM, LEFT, RIGHT, TOP

UNIT_BITS = 52
UNIT_TICKS = 1 << UNIT_BITS

SPAN = 1 << 61
"""Ticks after which the clock anchors bodies that have flown on one plan all the while (rule 8)."""

BEAT = 1 << 53
"""What takes its place where an axis is periodic (rule 8p): no plan is kept for more than two of them."""

HORIZON = 1 << 62
"""A contact this many ticks after the later anchor, or later, is none (rules 5 and 6)."""

Vector = tuple[float, float]
Whole = tuple[int, int]


def unit_bits(scene: Scene) -> int:
    """Returns e of the time unit 2^-e of a scene (rule 3)."""
    if scene.unit is not None:
        return 1 - math.frexp(scene.unit)[1]
    if len(scene) == 0 and scene.arena is None:
        return 0
    commands = [each.velocity for each in scene.commands if not isinstance(each, Remove)]
    velocities = [*scene.velocity.tolist(), *commands]
    largest = max((vx * vx + vy * vy for vx, vy in velocities), default=0.0)
    if scene.arena is not None:
        extent = max(scene.arena)
        gx, gy = scene.gravity
        largest = largest + 2 * (abs(gx) * scene.arena[0] + abs(gy) * scene.arena[1])  # rule 3g
    else:
        farthest = max(abs(place) for row in scene.position.tolist() for place in row)
        extent = farthest + max(scene.radius.tolist())
    crossings = math.sqrt(largest) / extent * (1.0 - 2.0**-20)
    return next((e for e in range(900) if crossings < 2.0**e), 900)


def tick_of(time: float, start: float, bits: int) -> int:
    """Returns the tick of a time (rule 3), where the unit is 2^-bits."""
    return math.floor((Fraction(time) - Fraction(start)) * (1 << (UNIT_BITS + bits)))


class Frame:
    """What all plans of a scene have in common: the arena (width, height) or None, the unit 2^-bits, the
    periods of the axes, 0 for one that is not periodic, and gravity. With gravity that is one of the frames
    of rule 4g after the other, of ``fall`` ticks each."""

    def __init__(
        self,
        arena: tuple[float, float] | None,
        bits: int,
        periods: tuple[float, float] = (0.0, 0.0),
        gravity: Vector = (0.0, 0.0),
    ) -> None:
        self.arena = arena and tuple(map(_ratio, arena))
        self.periods = periods
        self.fine = UNIT_BITS + bits
        self.finest = max((fine for _, fine in self.arena or ()), default=0)
        self.gravity = gravity
        self.fall = 0
        if arena and any(gravity):
            twice, fine = 2 * sum(abs(Fraction(g)) for g in gravity), 1 << self.fine
            fits = (k for k in range(54) if twice * Fraction(1 << k, fine) ** 2 <= min(arena))
            self.fall = 1 << max(fits)

    def fallen(self, tick: int) -> tuple[float, float, float, float]:
        """Returns how far (x, y) and how fast (vx, vy) the frame of a tick has fallen by then: what a place
        and a velocity in the room have more than in the frame; 0 without gravity."""
        (gx, gy), tau = self.gravity, float(tick % self.fall) * 2.0**-self.fine if self.fall else 0.0
        half = 0.5 * (tau * tau)
        return gx * half, gy * half, gx * tau, gy * tau

    def rest(self, tick: int) -> Vector:
        """Returns the velocity of what is at rest in the room (rule 9g); 0 without gravity."""
        _, _, vx, vy = self.fallen(tick)
        return -vx, -vy


class FlightPlan:
    """The flight plan (rule 4) of a disc, as doubles (``x``, ``y``, ``vx``, ``vy``) and as integers, which
    count 2^-``bits`` of the length: ``place`` is x and y, ``step`` the way of a tick along each axis, and
    ``radius``. At the tick ``anchor`` the body is at (x, y), less ``turns``, the periods that were taken off
    (rule 4p)."""

    __slots__ = ("anchor", "bits", "place", "radius", "step", "turns", "vx", "vy", "x", "y")

    def __init__(
        self,
        x: float,
        y: float,
        vx: float,
        vy: float,
        anchor: int,
        radius: float,
        frame: Frame,
        turns: Whole = (0, 0),
    ) -> None:
        right, up = (_turns(place, period) for place, period in zip((x, y), frame.periods, strict=True))
        x, y = _less(x, right, frame.periods[0]), _less(y, up, frame.periods[1])
        self.turns = turns[0] + right, turns[1] + up
        self.x, self.y, self.vx, self.vy, self.anchor = x, y, vx, vy, anchor
        lengths = [_ratio(x), _ratio(y), _ratio(radius)]
        speeds = [(number, fine + frame.fine) for number, fine in (_ratio(vx), _ratio(vy))]
        self.bits = bits = max(frame.finest, *(fine for _, fine in lengths), *(fine for _, fine in speeds))
        px, py, self.radius = (number << (bits - fine) for number, fine in lengths)
        wx, wy = (number << (bits - fine) for number, fine in speeds)
        self.place = px, py
        self.step = wx, wy

    def exact_place(self, tick: int, bits: int) -> tuple[int, int]:
        """Returns where the body is at a tick, exactly, at a fineness of at least its own."""
        (x, y), (wx, wy) = self.place, self.step
        elapsed, finer = tick - self.anchor, bits - self.bits
        return (x + wx * elapsed) << finer, (y + wy * elapsed) << finer

    def rounded_place(self, tick: int, tick_length: float) -> Vector:
        """Returns where the body is once it is anchored at a tick (rule 4), before rule 4p."""
        elapsed = tick - self.anchor
        return anchored(self.x, self.vx, elapsed, tick_length), anchored(
            self.y, self.vy, elapsed, tick_length
        )


class PairQuadratic:
    """The squared distance of two discs less that of their contact: a T^2 + 2 b T + c, in integers.

    T counts ticks from ``since``, the later of the anchors; lengths count 2^-bits. There the second is (dx,
    dy) from the first, and moves by (vx, vy) in a tick; ``reach`` is the sum of the radii, R. ``image`` is
    the periods of the frame by which the second is seen away from its unwrapped place.
    """

    __slots__ = ("a", "b", "bits", "c", "dx", "dy", "reach", "since", "vx", "vy")

    def __init__(
        self, one: FlightPlan, two: FlightPlan, frame: Frame | None = None, image: Whole = (0, 0)
    ) -> None:
        self.since = max(one.anchor, two.anchor)
        self.bits = max(one.bits, two.bits)
        x, y = one.exact_place(self.since, self.bits)
        other_x, other_y = two.exact_place(self.since, self.bits)
        self.dx, self.dy = other_x - x, other_y - y
        if frame is not None:
            self.dx += self._periods(one, two, frame, image, 0)
            self.dy += self._periods(one, two, frame, image, 1)
        finer, other_finer = self.bits - one.bits, self.bits - two.bits
        self.vx = (two.step[0] << other_finer) - (one.step[0] << finer)
        self.vy = (two.step[1] << other_finer) - (one.step[1] << finer)
        self.reach = (one.radius << finer) + (two.radius << other_finer)
        self.a = self.vx * self.vx + self.vy * self.vy
        self.b = self.dx * self.vx + self.dy * self.vy
        self.c = self.dx * self.dx + self.dy * self.dy - self.reach * self.reach

    def _periods(self, one: FlightPlan, two: FlightPlan, frame: Frame, image: Whole, axis: int) -> int:
        """Returns how far an image of the second is from its place, along an axis."""
        number, fine = _ratio(frame.periods[axis])
        return ((image[axis] + two.turns[axis] - one.turns[axis]) * number) << (self.bits - fine)

    def tick(self) -> int | None:
        """Returns the tick of contact (rule 5); None: there is none."""
        if self.b >= 0:
            return None
        if self.c <= 0:
            return self.since
        discriminant = self.b * self.b - self.a * self.c
        if discriminant <= 0:
            return None
        root = math.isqrt(discriminant)
        wait = (-self.b - root - (root * root != discriminant)) // self.a
        return self.since + wait if wait < HORIZON else None


def pair_tick(one: FlightPlan, two: FlightPlan) -> int | None:
    """Returns the tick of contact of two bodies by their plans (rule 5); None: none."""
    return PairQuadratic(one, two).tick()


def image_tick(
    one: FlightPlan,
    two: FlightPlan,
    frame: Frame,
    left_out: Collection[Whole],
    earliest: int,
    tick_through: Callable[[Whole], int | None],
) -> tuple[int, Whole] | None:
    """Returns the tick of contact of two bodies, the elder first, and the image (rule 5p); None: none on
    these plans, or before the ``earliest``, or of some images. ``tick_through`` returns when they meet
    through one. Computes images within reach in some time, and if none is met those of twice that time."""
    own = PairQuadratic(one, two, frame)
    sides = [number << (own.bits - fine) for number, fine in map(_ratio, frame.periods)]
    for power in range(49, 55):
        ticks = 1 << power
        images: list[range] = []
        for place, step, side in zip((own.dx, own.dy), (own.vx, own.vy), sides, strict=True):
            there = place + step * (ticks + 1)
            low, high = min(place, there) - own.reach, max(place, there) + own.reach
            images.append(range(-(high // side), -low // side + 1) if side else range(1))
        found = []
        for image in ((m, n) for m in images[0] for n in images[1]):
            tick = None if image in left_out else tick_through(image)
            if tick is not None and earliest <= tick <= own.since + ticks:
                found.append((tick, image))
        if found:
            return min(found)
    return None


def parting_tick(one: FlightPlan, two: FlightPlan, frame: Frame, image: Whole) -> int | None:
    """Returns the tick at which two discs part that pass through each other (rule 11p); None: none."""
    course = PairQuadratic(one, two, frame, image)
    a, b, c = course.a, course.b, course.c
    under = b * b - a * c
    if c > 0 and (b >= 0 or under <= 0):
        return course.since
    if a == 0:
        return None
    wait = (math.isqrt(under) - b) // a
    return course.since + wait if wait < HORIZON else None


def wall_tick(plan: FlightPlan, frame: Frame) -> tuple[int, int] | None:
    """Returns (tick, wall) of the contact of a body with a wall by its plan (rules 6 and 6g); None: none."""
    found: list[tuple[int, int]] = []  # in the order of walls
    sides = ((LEFT, RIGHT), (BOTTOM, TOP))
    for place, step, (extent, fine), walls, period, g in zip(
        plan.place, plan.step, frame.arena or (), sides, frame.periods, frame.gravity, strict=False
    ):
        gaps = place - plan.radius, (extent << (plan.bits - fine)) - place - plan.radius
        for gap, way, wall in zip(gaps, (1, -1), walls, strict=True):
            speed, bend = way * step, 0
            if g:
                number, fine_bend = _ratio(g)[0] * way, _ratio(g)[1] + 2 * frame.fine + 1
                finer, elapsed = max(fine_bend - plan.bits, 0), plan.anchor % frame.fall
                bend = number << (plan.bits + finer - fine_bend)
                gap = (gap << finer) + bend * elapsed * elapsed
                speed = (speed << finer) + 2 * bend * elapsed
            wait = None if period else _wall_wait(gap, speed, bend)
            if wait is not None and (g or wait < HORIZON):
                found.append((plan.anchor + wait, wall))
    return min(found, key=lambda met: met[0], default=None)


def _wall_wait(gap: int, speed: int, bend: int) -> int | None:
    """Returns the floor of the first z >= 0 at which gap + speed z + bend z^2 is <= 0 and falls; None: there
    is none. Without a ``bend`` that is rule 6, with one rule 6g."""
    if gap <= 0 and (speed or bend) < 0:
        return 0
    if bend == 0:
        return gap // -speed if speed < 0 else None
    under = speed * speed - 4 * bend * gap
    if bend < 0:  # the larger root; or the top, where it is below 0
        return (speed + math.isqrt(max(under, 0))) // (-2 * bend)
    if gap <= 0 or speed >= 0 or under <= 0:
        return None
    root = math.isqrt(under)
    return (-speed - root - (root * root != under)) // (2 * bend)


def anchored(place: float, speed: float, ticks: int, tick: float) -> float:
    """Returns one coordinate after a number of ticks of a length (rule 4)."""
    elapsed = float(ticks) * tick
    return place + speed * elapsed


def product_error(a: float, b: float) -> float:
    """Returns E(a, b) of rule 1: how much the product of two doubles loses by rounding, rounded."""
    (n, d), (m, e), (p, f) = a.as_integer_ratio(), b.as_integer_ratio(), (a * b).as_integer_ratio()
    return (n * m * f - p * d * e) / (d * e * f)


def exchanged_along(
    normal: Vector,
    velocities: tuple[Vector, Vector],
    masses: tuple[float, float] | None,
    times: float = 1.0,
) -> tuple[Vector, Vector]:
    """Returns the velocities of two bodies after their contact (rule 9): ``normal`` is the unit vector to the
    second; ``masses`` is None for one mass; ``times`` is the share of the closing speed (rule 11)."""
    (nx, ny), ((vxa, vya), (vxb, vyb)) = normal, velocities
    ux, uy = vxb - vxa, vyb - vya
    xx, yy = nx * nx, ny * ny
    excess = ((xx - 0.5) + (yy - 0.5)) + (product_error(nx, nx) + product_error(ny, ny))
    px, py = ux * nx, uy * ny
    total = px + py
    part = total - px
    low = ((px - (total - part)) + (py - part)) + (product_error(ux, nx) + product_error(uy, ny))
    speed = times * (total + (low - total * excess))
    ga = gb = speed
    if masses is not None:
        ga, gb = _share(masses[0], masses[1], speed), _share(masses[1], masses[0], speed)
    return (vxa + ga * nx, vya + ga * ny), (vxb - gb * nx, vyb - gb * ny)


def _share(mass: float, other: float, speed: float) -> float:
    """Returns the change of velocity of the body of ``mass``: 2 other / (mass + other) of the speed."""
    if math.isinf(mass) or math.isinf(other):
        return (speed if math.isinf(other) else 0.0) if math.isinf(mass) else 2 * speed
    both = mass + other
    part = both - mass
    low = (mass - (both - part)) + (other - part)
    share = 2 * other / both
    back = share * both
    rest = ((2 * other - back) - product_error(share, both) - low * share) / both
    taken = share * speed
    return taken + (product_error(share, speed) + rest * speed)


def _turns(place: float, period: float) -> int:
    """Returns how many periods rem(place, period) takes off (rule 2p); 0 where there is none."""
    return round(Fraction(place) / Fraction(period)) if abs(place) > 0.5 * period > 0.0 else 0


def _less(place: float, turns: int, period: float) -> float:
    """Returns a place less some periods, exactly."""
    return float(Fraction(place) - turns * Fraction(period)) if turns else place


def _ratio(number: float) -> tuple[int, int]:
    """Returns a double as (n, k), which is n 2^-k."""
    numerator, denominator = number.as_integer_ratio()
    return numerator, denominator.bit_length() - 1
