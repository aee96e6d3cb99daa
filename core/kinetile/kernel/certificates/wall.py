"""When a body reaches a wall: the exact tick.

What is left of the gap after n ticks, n by a division, is known almost exactly. Its quotient by the speed has
a bound, and where no whole tick lies within it, the floor is known; else whole numbers decide, as of a bent
way (``bent_integers``) without an acceleration.

The gap G = far - near - radius is gap + between_low + gap_low, exactly. After n = time · P ticks, G - speed
time = left + left_low + low - lost, all exact but for low. Four roundings, of low, low - lost, + left_low, +
left, lose at most u (3 |low| + 2 |lost| + |left_low| + |rest|); **2^-50 = 8 u** of their sum covers it, and
TINY what underflows. The quotient by the speed and the fraction are rounded as in ``contact``: 2^-49 of the
step, 2^-50.

The floor is taken, and compared with 2^62, in whole numbers: as doubles, 2^62 - 1 is 2^62.
"""

from __future__ import annotations

from kinetile.kernel.certificates.bent_integers import wall_by_integers
from kinetile.kernel.certificates.contact import LARGE, OPEN, SMALL, TINY, floor_of, plus
from kinetile.kernel.certificates.integers import as_count
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import apart, hook, larger, unchecked
from kinetile.kernel.flight import position_at, velocity_at
from kinetile.kernel.tables import Kernel, Records
from kinetile.kernel.vectors import product_error


@apart
def reaches(far: float, near: float, radius: float, speed: float, tick: float, per_time: float) -> int:
    """Return after how many ticks the gap ``far - near - radius`` closes at a speed > 0, rounded down
    exactly.

    0 where it is closed; ``NEVER`` from 2^62 on. ``tick`` is the length of one, a power of two, and
    ``per_time`` its inverse.
    """
    if far <= near and radius >= 0.0:
        return 0
    between, between_low = plus(far, -near)
    gap, gap_low = plus(between, -radius)
    size = abs(far) + abs(near) + abs(radius)
    guess = 0
    if size < LARGE and speed > SMALL and speed < LARGE:
        time = larger(gap / speed, 0.0)
        ticks = time * per_time
        guess = as_count(ticks)
        if ticks < FAR:
            flown = speed * time
            left, left_low = plus(gap, -flown)
            low = between_low + gap_low
            lost = product_error(speed, time, flown)
            rest = left + (left_low + (low - lost))
            error = 2.0**-50 * (abs(left_low) + abs(low) + abs(lost) + abs(rest)) + TINY
            step = rest / speed * per_time
            bound = 2.0 * (error / speed * per_time) + 2.0**-49 * abs(step) + 2.0**-50
            if bound < 0.5:
                found = floor_of(ticks, step, bound)
                if found != OPEN:
                    return found
    return int(wall_by_integers(far, near, radius, -speed, 0.0, tick, guess))


@unchecked
@hook
def inside_arena(k: Kernel, body: Records, tick: int) -> bool:
    """Return whether a body is within the arena's edges at a tick, by more than its radius and all rounding:
    where the walls are at these edges, it reaches none up to then."""
    limits = k.clock[0].limits
    x, y = position_at(k, body, tick)
    edge = body.radius + limits.fat
    return bool((x > edge) & (y > edge) & (x < limits.width - edge) & (y < limits.height - edge))


@hook
def away_from_walls(place: float, speed: float, pull: float, side: float, edge: float) -> bool:
    """Return whether a body has reached neither wall at the ends of an axis, by its place and velocity. It
    falls to one of them, and so has not been there if it is not now; it has not been
    at the other if it still rises, or if the vertex of its parabola is before that."""
    below = place - edge if pull < 0.0 else side - edge - place
    above = side - edge - place if pull < 0.0 else place - edge
    rises = speed if pull < 0.0 else -speed
    if below <= 0.0 or above <= 0.0:
        return False
    return bool(pull == 0.0 or rises > 0.0 or rises * rises * (1.0 + 2.0**-40) < 2.0 * abs(pull) * above)


@unchecked
@hook
def inside_bent(k: Kernel, body: Records, tick: int) -> bool:
    """Return the same of a body with an acceleration."""
    clock = k.clock[0]
    limits = clock.limits
    x, y = position_at(k, body, tick)
    vx, vy = velocity_at(k, body, tick)
    edge = body.radius + limits.fat
    if clock.torus.x == 0.0 and not away_from_walls(x, vx, body.ax, limits.width, edge):
        return False
    return clock.torus.y != 0.0 or away_from_walls(y, vy, body.ay, limits.height, edge)
