"""A closer look at two discs: what a Newton step has left open.

More steps from the estimate, each at a whole tick K and each with the bounds of ``paths``. Two ways to an
end are new. A root that is surely within a tick of K is settled by the sign of q(K), beyond its error. And
where nothing was rounded off on the way, as on a lattice in small dyadic numbers, the sign is exact however
small: that settles ties. The rest goes to ``integers``.
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.integers import as_count, first_touch_of_integers
from kinetile.kernel.certificates.paths import along, gap_at, seen_from
from kinetile.kernel.certificates.sums import LARGE, SMALL, kept, plus, whole_sum
from kinetile.kernel.compiled import apart, hook, larger, smaller
from kinetile.kernel.tables import NEVER

__all__ = ["look_closer"]

STEPS = 8
FAR = 1 << 62


@hook
def whole_path(x: float, vx: float, x2: float, vx2: float, time: float, rest: float) -> bool:
    """Whether (d, u) of ``seen_from`` are exact."""
    flown = vx * time
    exact = kept(vx, time, flown) and (rest == 0.0 or vx == 0.0)
    return exact and whole_sum(x2, -x) and whole_sum(x2 - x, -flown) and whole_sum(vx2, -vx)


@hook
def about(dx: float, dy: float, ux: float, uy: float, reach: float) -> float:
    """Return about when two discs touch, in the unit of dx / ux."""
    cross = dx * uy - dy * ux
    inside = larger(reach * reach * (ux * ux + uy * uy) - cross * cross, 0.0)
    fall = math.sqrt(inside) - (dx * ux + dy * uy)
    return (dx * dx + dy * dy - reach * reach) / fall if fall > 0.0 else 0.0


@hook
def exponent(a: float, b: float, c: float, d: float, e: float) -> int:
    """Return the power of two above all of these numbers."""
    return int(math.frexp(larger(larger(larger(abs(a), abs(b)), larger(abs(c), abs(d))), abs(e)))[1])


@apart
def look_closer(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    radius: float,
    radius2: float,
    tick: float,
    per_time: float,
) -> int:
    """Return what ``first_touch`` does."""
    if vx == vx2 and vy == vy2:
        return NEVER
    count = float(elapsed)
    time = count * tick
    rest = float(elapsed - int(count)) * tick
    dx, x_low, x_size, ux, wx = seen_from(x, vx, x2, vx2, time, rest)
    dy, y_low, y_size, uy, wy = seen_from(y, vy, y2, vy2, time, rest)
    reach, reach_low = plus(radius, radius2)
    speed = abs(ux) + abs(uy)
    guess = 0
    if speed > SMALL and speed < LARGE and reach > SMALL and reach + (x_size + y_size) < LARGE:
        lossless = whole_path(x, vx, x2, vx2, time, rest) and whole_path(y, vy, y2, vy2, time, rest)
        lossless = lossless and reach_low == 0.0 and kept(reach, reach, reach * reach)
        bend, bend_error = along(dx, x_size, ux, dy, y_size, uy)
        approach = bend < -bend_error
        if not approach and lossless and kept(dx, ux, dx * ux) and kept(dy, uy, dy * uy):
            if bend >= 0.0:
                return NEVER
            approach = True
        speed2 = ux * ux + uy * uy
        guess = as_count(about(dx, dy, ux, uy, reach) * per_time)
        for _ in range(STEPS if approach else 0):
            k = float(guess)
            guess = int(k)
            t = k * tick
            q, q_error, slope, slope_error = gap_at(
                t, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, reach, reach_low
            )
            if lossless:
                px = ux * t
                py = uy * t
                ex = dx + px
                ey = dy + py
                exact = kept(ux, t, px) and kept(uy, t, py) and whole_sum(dx, px) and whole_sum(dy, py)
                exact = exact and kept(ex, ex, ex * ex) and kept(ey, ey, ey * ey)
                if exact and whole_sum(ex * ex, ey * ey):
                    q = (ex * ex + ey * ey) - reach * reach
                    q_error = 0.0
            known = abs(q) > q_error or q_error == 0.0
            if known and q <= 0.0 and guess == 0:
                return 0
            discriminant = slope * slope - speed2 * q
            if not (slope > 8.0 * slope_error and discriminant > 0.0):
                break
            if known and q >= 0.0 and guess >= FAR:
                return NEVER
            step = q / (slope + math.sqrt(discriminant))
            bent = speed2 * (abs(q) + q_error) / (slope * slope)
            loose = bent + 2.0 * slope_error / slope + 2.0**-49
            bound = (q_error / slope + abs(step) * loose) * per_time + 2.0**-50
            part = step * per_time
            if not abs(part) < 2.0**62:
                break
            down = math.floor(part)
            over = part - float(down)
            if bent < 0.125 and bound < 0.25:
                if over > bound and over < 1.0 - bound:
                    found = guess + int(down)
                    return larger(found, 0) if found < FAR else NEVER
                if known and abs(part) < 0.5:
                    return guess if q >= 0.0 else guess - 1
            down = math.floor(part + 0.5)
            if down == 0.0:
                break
            guess = int(smaller(larger(guess + int(down), 0), FAR))
    else:  # a guess is enough, from numbers that are brought to size
        long = exponent(x, y, x2, y2, larger(radius, radius2))
        fast = exponent(vx, vy, vx2, vy2, 0.0)
        power = int(math.frexp(tick)[1]) - 1 + fast - long
        if abs(power) < 900:
            brought = math.ldexp(1.0, power)
            time = count * brought
            ax = math.ldexp(vx, -fast)
            ay = math.ldexp(vy, -fast)
            dx = math.ldexp(x2, -long) - math.ldexp(x, -long) - ax * time
            dy = math.ldexp(y2, -long) - math.ldexp(y, -long) - ay * time
            reach = math.ldexp(radius, -long) + math.ldexp(radius2, -long)
            ux = math.ldexp(vx2, -fast) - ax
            uy = math.ldexp(vy2, -fast) - ay
            guess = as_count(about(dx, dy, ux, uy, reach) / brought)
    return first_touch_of_integers(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, guess)
