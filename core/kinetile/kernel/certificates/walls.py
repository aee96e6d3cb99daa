"""The exact tick of a body's contact with a wall.

The gap G = far - near - radius widens at a speed ``slope``, and the speed grows by ``pull``. Rule 6: the
contact is at the first tick n with G(n + 1) < min(0, G(n)).

*Without an acceleration* the tick is the floor of G over the speed. The rest of the gap after n ticks, n by a
division, is known almost exactly. Its quotient by the speed has a bound, and if no whole tick lies within it,
the floor is known; else whole numbers decide (``discs_exactly``).

G is gap + between_low + gap_low, exactly. After n = time · P ticks, G - speed time = left + left_low + low -
lost, all exact but for low. Four roundings, of low, low - lost, + left_low, + left, lose at most u (3 |low| +
2 |lost| + |left_low| + |rest|); **2^-50 = 8 u** of their sum covers it, and TINY covers underflow. The
quotient by the speed and the fraction are rounded as in ``discs``: 2^-49 of the step, 2^-50.

The floor is taken, and compared with 2^62, in whole numbers: as doubles, 2^62 - 1 is 2^62.

*With an acceleration* the gap is a place like one along an axis (``separation``), its velocity exact, its
size |far| + |near| + |radius|: off by 2^-101 X, and **2^-100** is allowed. In a tick that ends at t it widens
by slope + pull (t - q / 2) a unit of time, q being a tick's length, with roundings of 5 u of |slope| + |pull|
t: **2^-50**. With pull <= 0 rule 6 holds from its first tick on, and with pull > 0 the gap falls up to it: so
a tick at which it holds, after one at which it does not, is the first. The discriminant only decides that
there is no root, with **2^-45** of its terms.
"""

import math

from kinetile.kernel.certificates.digits import LIMIT, as_count
from kinetile.kernel.certificates.discs import OPEN, floor_of
from kinetile.kernel.certificates.discs_exactly import wall_exactly
from kinetile.kernel.certificates.separation import LARGE, SMALL, TINY, Motion, place_at, plus, time_of, total
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import apart, hook, larger, smaller, unchecked
from kinetile.kernel.flight import position_at, velocity_at
from kinetile.kernel.tables import NEVER, Kernel, Records
from kinetile.kernel.vectors import product_error


@hook
def has_room(sizes: float, slope: float, pull: float, per_tick: float) -> bool:
    """Returns True if the bounds for a gap in doubles hold: no size too large, or too small and not 0."""
    slow = abs(slope) < SMALL and slope != 0.0
    weak = abs(pull) < SMALL and pull != 0.0
    return bool(sizes + (abs(slope) + abs(pull)) < LARGE and not (slow or weak) and per_tick > 2.0**-100)


@apart
def reaches_edge(
    far: float, near: float, radius: float, slope: float, pull: float, per_tick: float, per_time: float
) -> int:
    """Returns the number of ticks until a gap closes, or ``NEVER``: it is ``far - near - radius``, and widens
    at the speed ``slope``, by ``pull`` faster after a unit of time.

    ``per_tick`` is the length of a tick, a power of two, and ``per_time`` its inverse.
    """
    sizes = abs(far) + abs(near) + abs(radius)
    guess = 0
    if pull == 0.0:
        if slope >= 0.0:
            return NEVER
        if far <= near and radius >= 0.0:
            return 0
        between, between_low = plus(far, -near)
        gap, gap_low = plus(between, -radius)
        if sizes < LARGE and -slope > SMALL and -slope < LARGE:
            time = larger(gap / -slope, 0.0)
            ticks = time * per_time
            guess = as_count(ticks)
            if ticks < FAR:
                flown = -slope * time
                left, left_low = plus(gap, -flown)
                low = between_low + gap_low
                lost = product_error(-slope, time, flown)
                rest = left + (left_low + (low - lost))
                error = 2.0**-50 * (abs(left_low) + abs(low) + abs(lost) + abs(rest)) + TINY
                step = rest / -slope * per_time
                bound = 2.0 * (error / -slope * per_time) + 2.0**-49 * abs(step) + 2.0**-50
                if bound < 0.5:
                    found = floor_of(ticks, step, bound)
                    if found != OPEN:
                        return found
    elif has_room(sizes, slope, pull, per_tick):
        if pull >= 0.0 and slope >= 0.0:
            return NEVER
        d, low = plus(far, -near)
        d, low = total(d, low, -radius, 0.0)
        square = slope * slope
        squares = square - 2.0 * pull * d
        if pull > 0.0 and -squares > 2.0**-45 * (square + pull * sizes) + TINY:
            return NEVER
        root = math.sqrt(larger(squares, 0.0))
        if slope > 0.0:
            guess = as_count((slope + root) / -pull * per_time)
        elif root > slope:
            guess = as_count(2.0 * d / (root - slope) * per_time)
        way = Motion(d, low, slope, 0.0, pull, 0.0, sizes, abs(slope))
        before = -1
        after = LIMIT
        for _ in range(8):
            guess = smaller(larger(guess, before + 1), after - 1)
            t, rest = time_of(guess + 1, per_tick)
            value, _, size = place_at(way, t, rest)
            error = 2.0**-100 * size
            rate = slope + pull * (t - 0.5 * per_tick)
            steady = abs(rate) > 2.0**-50 * (abs(slope) + abs(pull) * t)
            falls = steady and rate < 0.0
            if falls and value < -error:
                after = guess
            elif (value > error and (falls or pull <= 0.0)) or (steady and rate > 0.0 and pull <= 0.0):
                before = guess
            else:
                break
            if after - before == 1:
                return after if after < LIMIT else NEVER
            move = 1.0 - value / rate * per_time if falls else 0.0
            if (move >= 1.0 or move < 0.0) and abs(move) < 2.0**53:
                guess += int(math.floor(move))
            else:
                guess += -1 if after == guess else 1
    return wall_exactly(far, near, radius, slope, pull, per_tick, guess)


@unchecked
@hook
def inside_arena(k: Kernel, body: Records, tick: int) -> bool:
    """Returns True if a body is within the arena's edges at a tick, by more than its radius and all rounding:
    if the walls are at these edges, it reaches none of them by then."""
    limits = k.clock[0].limits
    x, y = position_at(k, body, tick)
    edge = body.radius + limits.fat
    return bool((x > edge) & (y > edge) & (x < limits.width - edge) & (y < limits.height - edge))


@hook
def away_from_walls(place: float, speed: float, pull: float, side: float, edge: float) -> bool:
    """Returns True if a body has reached neither wall at the ends of an axis, by its place and velocity. The
    body falls towards one wall: if it is not at this wall now, it has not been there before. It has not been
    at the other wall if it still rises, or if the vertex of its parabola is before that wall."""
    below = place - edge if pull < 0.0 else side - edge - place
    above = side - edge - place if pull < 0.0 else place - edge
    rises = speed if pull < 0.0 else -speed
    if below <= 0.0 or above <= 0.0:
        return False
    return bool(pull == 0.0 or rises > 0.0 or rises * rises * (1.0 + 2.0**-40) < 2.0 * abs(pull) * above)


@unchecked
@hook
def inside_accelerated(k: Kernel, body: Records, tick: int) -> bool:
    """Returns the same for a body with an acceleration."""
    clock = k.clock[0]
    limits = clock.limits
    x, y = position_at(k, body, tick)
    vx, vy = velocity_at(k, body, tick)
    edge = body.radius + limits.fat
    if clock.torus.x == 0.0 and not away_from_walls(x, vx, body.ax, limits.width, edge):
        return False
    return clock.torus.y != 0.0 or away_from_walls(y, vy, body.ay, limits.height, edge)
