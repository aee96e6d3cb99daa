"""A narrow phase of somebody else for pairs: squares that do not turn, right but for a fault of choice.

A body's radius is that of the circle around its square. So squares touch at the sum of the radii at the
earliest, corner to corner, and mostly come closer than that.

As a module it is a plugin, so that it can be added in a process or installed.
"""

import math

import kinetile as kt
from kinetile.toolbox import (
    NEVER,
    Kernel,
    PairParts,
    closing_speed,
    hook,
    shared,
    since_anchor,
)

SIDE = math.sqrt(0.5)
"""Half a side, for a circle of radius 1."""


@hook
def entered(gap: float, rate: float) -> float:
    """Return when the gap of two intervals, which changes at a rate, closes; before all times if it has."""
    if gap <= 0.0:
        return -math.inf
    return gap / -rate if rate < 0.0 else math.inf


@hook
def first_touch(dx: float, dy: float, dvx: float, dvy: float, sides: float) -> float:
    """Return after which time two squares, half of whose sides add up to ``sides``, touch and approach."""
    x_gap, y_gap = abs(dx) - sides, abs(dy) - sides
    x_rate = dvx if dx > 0.0 else -dvx
    y_rate = dvy if dy > 0.0 else -dvy
    if x_gap <= 0.0 and y_gap <= 0.0:
        return 0.0 if (x_rate if x_gap >= y_gap else y_rate) < 0.0 else math.inf
    soon = max(entered(x_gap, x_rate), entered(y_gap, y_rate))
    x_left = (abs(dx) + sides) / -x_rate if x_rate < 0.0 else (-x_gap / x_rate if x_rate > 0.0 else math.inf)
    y_left = (abs(dy) + sides) / -y_rate if y_rate < 0.0 else (-y_gap / y_rate if y_rate > 0.0 else math.inf)
    return soon if soon < min(x_left, y_left) else math.inf


@hook
def meet_since(k: Kernel, a: int, b: int, since: int) -> int:
    """Return the tick of the first contact of two squares, worked out from their places at a tick."""
    one, two = k.bodies[a], k.bodies[b]
    t, u = since_anchor(k, one, since), since_anchor(k, two, since)
    dx = (two.x + two.vx * u) - (one.x + one.vx * t)
    dy = (two.y + two.vy * u) - (one.y + one.vy * t)
    delay = first_touch(dx, dy, two.vx - one.vx, two.vy - one.vy, SIDE * (one.radius + two.radius))
    ticks = delay * k.clock[0].per_time
    return int(since + int(math.floor(ticks))) if ticks < 2.0**61 else NEVER


@hook
def meet(k: Kernel, a: int, b: int) -> int:
    return int(meet_since(k, a, b, max(k.bodies[a].anchor, k.bodies[b].anchor)))


@hook
def meet_from_now(k: Kernel, a: int, b: int) -> int:
    """Wrong: from where the squares are now."""
    return int(meet_since(k, a, b, k.clock[0].now))


@hook
def meet_from_the_first(k: Kernel, a: int, b: int) -> int:
    """Wrong: from where the squares are, or were, when the first of the two had its plan."""
    tick = int(meet_since(k, a, b, k.bodies[a].anchor))
    return max(tick, k.bodies[a].anchor, k.bodies[b].anchor)


@hook
def meet_for_who_asks(k: Kernel, a: int, b: int) -> int:
    """Wrong: a tick earlier if many were asked about before."""
    tick = int(meet(k, a, b))
    later = tick < NEVER and tick > max(k.bodies[a].anchor, k.bodies[b].anchor)
    return tick - 1 if later and k.counts[0].exact % 3 == 1 else tick


@hook
def meet_and_write(k: Kernel, a: int, b: int) -> int:
    """Wrong: it leaves something behind in a body."""
    k.stamps[a] += 2
    return int(meet(k, a, b))


@hook
def touch(k: Kernel, a: int, b: int) -> tuple[float, float, float]:
    """Return the normal of the side at which two squares touch, and the overlap."""
    one, two = k.bodies[a], k.bodies[b]
    dx, dy = two.x - one.x, two.y - one.y
    sides = SIDE * (one.radius + two.radius)
    if abs(dx) >= abs(dy):
        return (1.0 if dx > 0.0 else -1.0), 0.0, sides - abs(dx)
    return 0.0, (1.0 if dy > 0.0 else -1.0), sides - abs(dy)


@hook
def collide(k: Kernel, a: int, b: int) -> float:
    """Exchange momentum along the normal, elastically; return the overlap."""
    one, two = k.bodies[a], k.bodies[b]
    nx, ny, depth = touch(k, a, b)
    speed = closing_speed(one, two, nx, ny)
    one_share = shared(k.mass[a], k.mass[b], speed)
    two_share = shared(k.mass[b], k.mass[a], speed)
    one.vx += one_share * nx
    one.vy += one_share * ny
    two.vx -= two_share * nx
    two.vy -= two_share * ny
    return float(depth)


MEET = {
    "none": meet,
    "now": meet_from_now,
    "order": meet_from_the_first,
    "asked": meet_for_who_asks,
    "writes": meet_and_write,
}


class Squares:
    """Elastic contact of two squares."""

    def __init__(self, fault: str = "none", touches: bool = False, says: str | None = None) -> None:
        self.meet = MEET[fault]
        self.touch = touch if touches else None
        self.says = {} if says is None else {"contact_distance": says}

    def prepare(self, scene: kt.Scene) -> PairParts:
        return PairParts(meet=self.meet, collide=collide, touch=self.touch, **self.says)


@kt.hookimpl
def kinetile_narrow_phases() -> list[kt.NarrowPhaseSpec]:
    return [kt.NarrowPhaseSpec("squares", f"{__name__}:Squares", "squares that do not turn", role="pair")]
