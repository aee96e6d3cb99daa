"""Rules 1 to 6 and 9 of docs/specification.md: places in integers, plans and exchanges in doubles.

*Exact.* A double is an integer over a power of two, and so is the length of a tick. So a plan is written once
as integers of one fineness, in units of 2^-bits of the length: its coordinates, its way in a tick, and the
effect of its acceleration. The separation of two bodies, n ticks after the later anchor, is then a polynomial
of n in integers, and so are all values that the rules derive from it (``touching``). The rules use their
signs at whole ticks (``signs``), and nothing is rounded before.

*Rounded.* Python's float is a double, each of its operations rounds once, to nearest and ties to even, and
nothing is contracted; ``float(n)`` of an integer and the quotient of two integers are rounded correctly too.
So rules 4 and 9 are the same expressions here, in the order of the rules.

Nothing here is shared with the kernel.
"""

import math
from collections.abc import Callable, Collection, Sequence
from fractions import Fraction

from kinetile import Accelerate, Insert, Scene, Turn
from kinetile.toolbox import BOTTOM, LEFT, RIGHT, TOP
from kinetile_accuracy.specification.signs import HORIZON as HORIZON
from kinetile_accuracy.specification.signs import Polynomial, first_fall

UNIT_BITS = 52
UNIT_TICKS = 1 << UNIT_BITS

SPAN = 1 << 61
"""The clock anchors bodies that have flown on one plan for this number of ticks (rule 8)."""

BEAT = 1 << 53
"""The same with a periodic axis (rule 8p): no plan is kept for more than two of them."""

Vector = tuple[float, float]
Whole = tuple[int, int]


def unit_bits(scene: Scene) -> int:
    """Returns e of the time unit 2^-e of a scene (rule 3)."""
    if scene.unit is not None:
        return 1 - math.frexp(scene.unit)[1]
    if len(scene) == 0 and scene.arena is None:
        return 0
    commands = [each.velocity for each in scene.commands if isinstance(each, Turn | Insert)]
    velocities = [*scene.velocity.tolist(), *commands]
    largest = max((vx * vx + vy * vy for vx, vy in velocities), default=0.0)
    if scene.arena is not None:
        width, height = scene.arena
    else:
        farthest = max(abs(place) for row in scene.position.tolist() for place in row)
        width = height = farthest + max(scene.radius.tolist())
    ax, ay = largest_pull(scene)
    largest = largest + 2 * (ax * width + ay * height)  # rule 3a
    crossings = math.sqrt(largest) / max(width, height) * (1.0 - 2.0**-20)
    return next((e for e in range(900) if crossings < 2.0**e), 900)


def tick_of(time: float, start: float, bits: int) -> int:
    """Returns the tick of a time (rule 3) with the unit 2^-bits."""
    return math.floor((Fraction(time) - Fraction(start)) * Fraction(2) ** (UNIT_BITS + bits))


def pull_of(insertion: Insert, gravity: Vector) -> Vector:
    """Returns the acceleration of an inserted body (rule 2a)."""
    if insertion.acceleration is None:
        return (0.0, 0.0) if math.isinf(insertion.mass) else gravity
    ax, ay = map(float, insertion.acceleration)
    return ax, ay


def largest_pull(scene: Scene) -> Vector:
    """Returns the largest |ax| and |ay| of gravity and of any body (rule 3a); both 0 without any."""
    pulls = [scene.gravity, *scene.acceleration.tolist()]
    pulls += [pull_of(each, scene.gravity) for each in scene.commands if isinstance(each, Insert)]
    pulls += [each.acceleration for each in scene.commands if isinstance(each, Accelerate)]
    ax, ay = (max((abs(pull[axis]) for pull in pulls), default=0.0) for axis in range(2))
    return ax, ay


class Frame:
    """The common data of all plans of a scene: the arena (width, height) or None, the unit 2^-bits, and the
    periods of the axes; 0 if an axis is not periodic."""

    def __init__(
        self, arena: tuple[float, float] | None, bits: int, periods: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        self.arena = arena and tuple(map(ratio, arena))
        self.periods = periods
        self.fine = UNIT_BITS + bits
        self.finest = max((fine for _, fine in self.arena or ()), default=0)


class FlightPlan:
    """The flight plan (rules 4 and 4a) of a disc, as doubles (``x``, ``y``, ``vx``, ``vy``, the acceleration
    ``pull``) and as integers, which count 2^-``bits`` of the length: ``place`` is x and y, ``step`` the way
    of a tick along each axis, ``bend`` the factor of the square of a number of ticks, and ``radius``. At the
    tick ``anchor`` the body is at (x, y), less ``turns``, the periods that were taken off (rule 4p)."""

    __slots__ = ("anchor", "bend", "bits", "place", "pull", "radius", "step", "turns", "vx", "vy", "x", "y")

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
        pull: Vector = (0.0, 0.0),
    ) -> None:
        right, up = (_turns(place, period) for place, period in zip((x, y), frame.periods, strict=True))
        x, y = _less(x, right, frame.periods[0]), _less(y, up, frame.periods[1])
        self.turns = turns[0] + right, turns[1] + up
        self.x, self.y, self.vx, self.vy, self.pull, self.anchor = x, y, vx, vy, pull, anchor
        lengths = [ratio(x), ratio(y), ratio(radius)]
        speeds = [(number, fine + frame.fine) for number, fine in (ratio(vx), ratio(vy))]
        bends = [(n, k + 1 + 2 * frame.fine) if n else (0, 0) for n, k in map(ratio, pull)]
        self.bits = bits = max(frame.finest, *(fine for _, fine in (*lengths, *speeds, *bends)))
        px, py, self.radius = (number << (bits - fine) for number, fine in lengths)
        wx, wy = (number << (bits - fine) for number, fine in speeds)
        hx, hy = (number << (bits - fine) for number, fine in bends)
        self.place = px, py
        self.step = wx, wy
        self.bend = hx, hy

    def flown(self, tick: int, bits: int) -> tuple[Polynomial, Polynomial]:
        """Returns the exact position some ticks after a tick, along x and y: polynomials of these ticks, at a
        fineness of at least its own."""
        elapsed, finer = tick - self.anchor, bits - self.bits
        x, y = (
            ((p + w * elapsed + h * elapsed * elapsed) << finer, (w + 2 * h * elapsed) << finer, h << finer)
            for p, w, h in zip(self.place, self.step, self.bend, strict=True)
        )
        return x, y

    def moved(self, tick: int, tick_length: float) -> tuple[Vector, Vector]:
        """Returns place and velocity of the body anchored at a tick (rules 4 and 4a), before rule 4p."""
        elapsed, (ax, ay) = tick - self.anchor, self.pull
        x, vx = anchored(self.x, self.vx, elapsed, tick_length, ax)
        y, vy = anchored(self.y, self.vy, elapsed, tick_length, ay)
        return (x, y), (vx, vy)


class Separation:
    """The separation of the second of two bodies from the first, d(n) of rule 5, in integers that count
    2^-``bits`` of the length: the coefficients (``ways``) of 1, n and n^2; n counts ticks from ``since``, the
    later anchor. ``reach`` is the sum of the radii. ``image`` is the number of the frame's periods from the
    second body's unwrapped place to its image (rule 5p)."""

    __slots__ = ("bits", "reach", "since", "ways")

    def __init__(
        self, one: FlightPlan, two: FlightPlan, frame: Frame | None = None, image: Whole = (0, 0)
    ) -> None:
        self.since = max(one.anchor, two.anchor)
        self.bits = bits = max(one.bits, two.bits)
        paths = zip(one.flown(self.since, bits), two.flown(self.since, bits), strict=True)
        along = [[after - before for before, after in zip(*path, strict=True)] for path in paths]
        for axis, period in enumerate(frame.periods if frame is not None else ()):
            number, fine = ratio(period)
            turns = image[axis] + two.turns[axis] - one.turns[axis]
            along[axis][0] += (turns * number) << (bits - fine)
        self.ways: list[Whole] = list(zip(*along, strict=True))
        self.reach = (one.radius << (bits - one.bits)) + (two.radius << (bits - two.bits))


def image_tick(
    one: FlightPlan,
    two: FlightPlan,
    frame: Frame,
    left_out: Collection[Whole],
    earliest: int,
    tick_through: Callable[[Whole], int | None],
) -> tuple[int, Whole] | None:
    """Returns the tick of contact of two bodies, the elder first, and the image (rule 5p); None: no contact
    on these plans, or before the ``earliest``, or in ``left_out``. ``tick_through`` returns the tick of
    contact through one image. Computes images within reach in some time; without a contact, in twice that."""
    own = Separation(one, two, frame)
    sides = [number << (own.bits - fine) for number, fine in map(ratio, frame.periods)]
    for power in range(49, 55):
        ticks = 1 << power
        images: list[range] = []
        for place, step, side in zip(*own.ways[:2], sides, strict=True):
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


def wall_tick(
    plan: FlightPlan, frame: Frame, reaches: Sequence[tuple[float, float]] | None = None
) -> tuple[int, int] | None:
    """Returns (tick, wall) of the contact of a body with a wall by its plan (rule 6); None: no contact.
    ``reaches`` are the extents of a shape down and up each axis (rule 6s); None: the radius."""
    found: list[tuple[int, int]] = []  # in the order of walls
    size, walls = 1 << plan.bits, ((LEFT, RIGHT), (BOTTOM, TOP))
    for axis, (extent, fine) in enumerate(frame.arena or ()):
        place, step, bend = plan.place[axis], plan.step[axis], plan.bend[axis]
        own: tuple[int | Fraction, ...] = (plan.radius, plan.radius)
        if reaches is not None:
            own = tuple(Fraction(each) * size for each in reaches[axis])
        gaps = place - own[0], (extent << (plan.bits - fine)) - place - own[1]
        for gap, way, wall in zip(gaps, (1, -1), walls[axis], strict=True):
            whole = gap.denominator
            path = int(gap * whole), way * step * whole, way * bend * whole
            wait = None if frame.periods[axis] else first_fall(path)
            if wait is not None:
                found.append((plan.anchor + wait, wall))
    return min(found, key=lambda met: met[0], default=None)


def anchored(place: float, speed: float, ticks: int, tick: float, pull: float = 0.0) -> tuple[float, float]:
    """Returns one coordinate and its velocity after a number of ticks of a length (rules 4 and 4a)."""
    elapsed = float(ticks) * tick
    return place + (speed * elapsed + (0.5 * pull) * (elapsed * elapsed)), speed + pull * elapsed


def product_error(a: float, b: float) -> float:
    """Returns E(a, b) of rule 1: the loss of the product of two doubles by rounding, rounded."""
    (n, d), (m, e), (p, f) = a.as_integer_ratio(), b.as_integer_ratio(), (a * b).as_integer_ratio()
    return (n * m * f - p * d * e) / (d * e * f)


def speed_along(normal: Vector, velocities: tuple[Vector, Vector]) -> float:
    """Returns the speed of rule 9 at which the second of two bodies moves off along a unit vector to it."""
    (nx, ny), ((vxa, vya), (vxb, vyb)) = normal, velocities
    ux, uy = vxb - vxa, vyb - vya
    xx, yy = nx * nx, ny * ny
    excess = ((xx - 0.5) + (yy - 0.5)) + (product_error(nx, nx) + product_error(ny, ny))
    px, py = ux * nx, uy * ny
    total = px + py
    part = total - px
    low = ((px - (total - part)) + (py - part)) + (product_error(ux, nx) + product_error(uy, ny))
    return total + (low - total * excess)


def exchanged_along(
    normal: Vector,
    velocities: tuple[Vector, Vector],
    masses: tuple[float, float] | None,
    speed: float | None = None,
) -> tuple[Vector, Vector]:
    """Returns the velocities of two bodies after their contact (rule 9): ``normal`` is the unit vector to the
    second; ``masses`` is None for one mass; ``speed`` replaces the speed of rule 9."""
    (nx, ny), ((vxa, vya), (vxb, vyb)) = normal, velocities
    if speed is None:
        speed = speed_along(normal, velocities)
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
    """Returns the number of periods that rem(place, period) takes off (rule 2p); 0 without a period."""
    return round(Fraction(place) / Fraction(period)) if abs(place) > 0.5 * period > 0.0 else 0


def _less(place: float, turns: int, period: float) -> float:
    return float(Fraction(place) - turns * Fraction(period)) if turns else place


def ratio(number: float) -> tuple[int, int]:
    """Returns a double as (n, k), which is n 2^-k."""
    numerator, denominator = number.as_integer_ratio()
    return numerator, denominator.bit_length() - 1
