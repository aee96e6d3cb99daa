"""What else is asked: walls, exchanges, places after anchoring, units of time, and ticks of times."""

from __future__ import annotations

from math import ldexp, nextafter, sqrt
from typing import NamedTuple

from .draws import TRIPLES, Draws
from .rules import Arena, Plan, Velocity

__all__ = [
    "Impact",
    "Moment",
    "Moved",
    "Pace",
    "WallQuestion",
    "impacts",
    "moments",
    "moved",
    "paces",
    "walls",
]


class WallQuestion(NamedTuple):
    """When does a body meet a wall of an arena, and which? The unit is 2^-e."""

    e: int
    arena: Arena
    plan: Plan


def _inside(d: Draws) -> tuple[Arena, Plan]:
    arena = d.uniform(0.5, 2.0), d.uniform(0.5, 2.0)
    radius = d.uniform(0.005, 0.1)
    x, y = d.uniform(radius, arena[0] - radius), d.uniform(radius, arena[1] - radius)
    vx, vy = d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)
    if d.below(4) == 0:
        vx, vy = (vx, 0.0) if d.below(2) else (0.0, vy)
    if d.below(20) == 0:
        vx, vy = 0.0, 0.0
    return arena, Plan(x, y, vx, vy, radius, d.whole(-(1 << 61), 1 << 61))


def _at_wall(d: Draws) -> tuple[Arena, Plan]:
    """The gap to one wall is 0, negative, or tiny."""
    arena, plan = _inside(d)
    gap = d.pick((0.0, ldexp(1.0, -60), -ldexp(1.0, -60), 1e-17, -1e-13, 1e-9, -1e-3))
    if d.below(2):
        return arena, plan._replace(x=plan.radius + gap) if d.below(2) else plan._replace(y=plan.radius + gap)
    place = arena[0] - plan.radius - gap, arena[1] - plan.radius - gap
    return arena, plan._replace(x=place[0]) if d.below(2) else plan._replace(y=place[1])


def _corner(d: Draws) -> tuple[Arena, Plan]:
    """Both walls at one tick, or a last bit apart."""
    side = d.whole(1, 4) / 2
    arena = side, side * d.whole(1, 3)
    radius = d.whole(1, 15) / 64
    gap = d.whole(0, 40) / 256
    speed = d.whole(1, 9) / 8
    vx, vy = d.sign() * speed, d.sign() * speed
    x = radius + gap if vx < 0 else arena[0] - radius - gap
    y = radius + gap if vy < 0 else arena[1] - radius - gap
    how = d.below(4)
    if how == 1:
        x = nextafter(x, d.pick((-9.0, 9.0)))
    if how == 2:
        vy = nextafter(vy, d.pick((-9.0, 9.0)))
    return arena, Plan(x, y, vx, vy, radius, d.whole(-64, 64) << 53)


def _far_ahead(d: Draws, e: int) -> tuple[Arena, Plan]:
    """A wall about 2^62 ticks away: gap and speed are short numbers, the radius takes the rest of the gap."""
    speed = d.whole(1, 7) * ldexp(1.0, -d.whole(1, 9))
    off = d.pick((-3.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 1e6, -1e6))
    way = ldexp(speed, 10 - e)
    radius = ldexp(1.0, -20 - e) - off * ldexp(speed, -52 - e)  # exact: 2^-20 is 2^32 ticks of 2^-52
    x = way + ldexp(1.0, -20 - e)
    other = d.pick((0.0, ldexp(1.0, -30 - e)))
    arena = 2.0 * x, 4.0 * x
    side = d.sign()
    plan = Plan(x, x, side * speed, -side * other, radius, 0)
    if d.below(2):
        arena = arena[::-1]
        plan = plan._replace(vx=plan.vy, vy=plan.vx)
    return arena, plan._replace(anchor=d.whole(-(1 << 61), 1 << 61))


def _sized(plan: Plan, arena: Arena, length: int, speed: int) -> tuple[Arena, Plan]:
    x, y, radius = (ldexp(value, length) for value in (plan.x, plan.y, plan.radius))
    vx, vy = ldexp(plan.vx, speed), ldexp(plan.vy, speed)
    return (ldexp(arena[0], length), ldexp(arena[1], length)), Plan(x, y, vx, vy, radius, plan.anchor)


def walls() -> dict[str, list[WallQuestion]]:
    """Return the questions of each family."""
    asked: dict[str, list[WallQuestion]] = {}
    for name, count in (
        ("inside", 300),
        ("at a wall", 300),
        ("corners", 250),
        ("about 2^62", 200),
        ("units", 200),
        ("extreme", 200),
    ):
        d = Draws("walls, " + name)
        asked[name] = questions = []
        for _ in range(count):
            e = 0
            if name == "inside":
                arena, plan = _inside(d)
            elif name == "at a wall":
                arena, plan = _at_wall(d)
            elif name == "corners":
                arena, plan = _corner(d)
            elif name == "about 2^62":
                e = d.pick((0, 0, 3, 20))
                arena, plan = _far_ahead(d, e)
            else:
                arena, plan = _inside(d) if d.below(2) else _at_wall(d)
                e = d.pick((*range(1, 21), 900)) if name == "units" else d.pick((0, 500, 900))
                length = d.whole(-3, 3) if e <= 20 or name == "units" else d.whole(-900, 890 - e)
                if name == "extreme" and e == 0:
                    length = d.whole(-1060, 880)
                speed = max(min(length + e + d.whole(-9, 1), 899), -1060)
                arena, plan = _sized(plan, arena, length, speed)
            questions.append(WallQuestion(e, arena, plan))
    return asked


class Impact(NamedTuple):
    """What are the velocities after a contact? Masses None: all are equal."""

    masses: tuple[float, float] | None
    one: Plan
    two: Plan


def _impact(d: Draws, name: str) -> tuple[Plan, Plan]:
    """Return two plans that touch or nearly touch, and approach or nearly so, anchored at 0."""
    radius, other = d.uniform(0.005, 0.5), d.uniform(0.005, 0.5)
    reach = radius + other
    nx, ny = d.direction()
    if name == "axis-aligned":
        nx, ny = d.turned(1.0, d.pick((0.0, 0.0, 0.0, ldexp(1.0, -26), ldexp(1.0, -54), ldexp(1.0, -80))))
    if name == "triples":
        a, b, c = d.pick(TRIPLES)
        nx, ny = d.turned(a / 64, b / 64)
        reach, radius = c / 64, c / 128
        other = radius
    if name == "overlapping":
        reach *= 1.0 - ldexp(d.uniform(), -d.whole(1, 50))
    x, y = d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)
    vx, vy = d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)
    across, along = d.uniform(-1.0, 1.0), -d.uniform(0.0, 1.0)
    if name == "grazing":
        along = ldexp(along, -d.whole(8, 53))
    if name in ("triples", "axis-aligned"):
        x, y, vx, vy = d.below(64) / 64, d.below(64) / 64, d.whole(-4, 4) / 4, d.whole(-4, 4) / 4
        wx, wy = d.whole(-4, 4) / 4, d.whole(-4, 4) / 4
    else:
        wx, wy = along * nx - across * ny, along * ny + across * nx
    length = reach if name != "triples" else 1.0
    one = Plan(x, y, vx, vy, radius, 0)
    return one, Plan(x + length * nx, y + length * ny, vx + wx, vy + wy, other, 0)


def impacts() -> dict[str, list[Impact]]:
    """Return the questions of each family."""
    asked: dict[str, list[Impact]] = {}
    for name in ("any angle", "axis-aligned", "triples", "grazing", "overlapping", "scaled", "tiny"):
        d = Draws("exchange, " + name)
        asked[name] = questions = []
        for number in range(300):
            one, two = _impact(d, name)
            masses: tuple[float, float] | None = None
            how = number % 3
            if how == 1:
                masses = d.uniform(0.5, 9.0), d.uniform(0.5, 9.0)
            if how == 2:
                heavy = d.power(0, 39)
                masses = d.pick(((1.0, heavy), (heavy, 1.0), (heavy, nextafter(heavy, 0.0))))
            if name in ("scaled", "tiny"):
                length, speed = d.whole(-190, 190), d.whole(-190, 190)
                if (
                    name == "tiny"
                ):  # products of such velocities, and what they lose, are subnormal or nothing
                    speed = -d.whole(900, 1074)
                one, two = (_sized(plan, (1.0, 1.0), length, speed)[1] for plan in (one, two))
                if masses is not None:
                    weight = d.whole(-150, 150)
                    masses = ldexp(masses[0], weight), ldexp(masses[1], weight)
            questions.append(Impact(masses, one, two))
    return asked


class Moved(NamedTuple):
    """Where is a plan's place after it has been anchored at a tick?"""

    e: int
    plan: Plan
    tick: int


def moved() -> dict[str, list[Moved]]:
    """Return the questions of each family: how long it has flown."""
    asked: dict[str, list[Moved]] = {}
    for name, low, high in (("short", 0, 40), ("usual", 40, 53), ("beyond 2^53 ticks", 53, 62)):
        d = Draws("places, " + name)
        asked[name] = []
        for _ in range(250):
            e = d.pick((0, 0, 0, 1, 9, 20, 100, 400))
            _, plan = _inside(d)
            shift = d.pick((0, 0, 0, 20, -190, 190))
            _, plan = _sized(plan, (1.0, 1.0), shift, shift + e - d.below(9))
            ticks = d.below(1 << d.whole(low + 1, high))
            asked[name].append(Moved(e, plan, plan.anchor + ticks))
    return asked


class Pace(NamedTuple):
    """What is the unit of a scene?"""

    arena: Arena | None
    places: list[tuple[float, float]]
    radii: list[float]
    velocities: list[Velocity]
    turned: list[Velocity]


def paces() -> dict[str, list[Pace]]:
    """Return the questions of each family: a few bodies, and velocities of turns."""
    asked: dict[str, list[Pace]] = {}
    for name, count in (("any", 200), ("edges", 200), ("none", 1), ("beyond", 20)):
        d = Draws("units, " + name)
        asked[name] = []
        for _ in range(count):
            n = 0 if name == "none" else d.whole(1, 3)
            size = d.whole(-190, 190) if d.below(2) else 0
            fast = size + d.whole(-10, 30) if d.below(8) else min(size + 390, 190)
            arena = (d.power(size, size), d.power(size, size)) if d.below(2) else None
            places = [(d.sign() * d.power(size, size), d.power(size - 3, size)) for _ in range(n)]
            radii = [d.power(size - 9, size - 4) for _ in range(n)]
            velocities = [(d.sign() * d.power(fast - 3, fast), d.power(fast - 3, fast)) for _ in range(n)]
            turned = [(d.power(fast, fast), 0.0) for _ in range(d.below(2) if n else 0)]
            if name == "edges":  # c is a power of two exactly, or by a last bit or a few not
                length = ldexp(1.0, size)
                arena = d.pick(((length, length / 2), (length / 4, length), None))
                places = [(length * 0.5, -length * 0.75) for _ in range(n)]
                radii = [length * 0.25] * n
                speed = ldexp(1.0 / (1.0 - ldexp(1.0, -20)), d.whole(-3, 60) + size)
                for _ in range(d.below(4)):
                    speed = nextafter(speed, d.pick((0.0, 1e200)))
                velocities = [(0.0, 0.0)] * (n - 1) + [(speed, 0.0) if d.below(2) else (0.0, -speed)]
                turned = [velocities[-1]] if d.below(2) else []
                if turned:
                    velocities = [(0.0, 0.0)] * n
                elif d.below(4) == 0:
                    velocities[-1] = (speed / sqrt(2.0), speed / sqrt(2.0))
            if name == "beyond":  # too fast, or too small, for any unit; no scene may hold that
                length = ldexp(1.0, -d.whole(430, 460))
                arena, places, radii, turned = (length, length), [(0.0, 0.0)], [length * 0.25], []
                velocities = [(d.power(440, 460), 0.0)]
            asked[name].append(Pace(arena, places, radii, velocities, turned))
    return asked


class Moment(NamedTuple):
    """Which tick is a time?"""

    e: int
    start: float
    time: float


def moments() -> dict[str, list[Moment]]:
    """Return the questions of each family."""
    asked: dict[str, list[Moment]] = {}
    for name in ("from 0", "from any start", "whole ticks"):
        d = Draws("times, " + name)
        asked[name] = []
        for _ in range(150):
            e = d.pick((0, 0, 1, 7, 20, 300))
            late = ldexp(1.0, -e)
            start = 0.0 if name == "from 0" else d.sign() * d.power(-10, 51) * late
            time = start + d.power(-60, 20) * late
            if name == "whole ticks":
                start = d.whole(-99, 99) * late
                time = start + ldexp(d.below(1 << 40), -d.pick((20, 30, 45, 52, 53, 60)) - e)
                if d.below(3) == 0:
                    time = nextafter(time, start)
            asked[name].append(Moment(e, start, max(time, start)))
    return asked
