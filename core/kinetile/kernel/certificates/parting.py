"""When two discs that pass through each other part: the exact tick.

The plans' doubles are read as rationals, as in ``pair``, of which this is the other root::

    q(s) > 0 and B(s) >= 0    s: they are apart, and do not approach
    q >= 0 at all times       s: they miss each other, or are tangent
    v = 0                     never: they overlap, and keep doing so
    else                      s + floor(last root of q); never from s + 2^62 on

Passing is rare beside contact, and a parting is asked for once a plan: so there is no filter in double, only
an estimate from which whole numbers go on.
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.closer import exponent
from kinetile.kernel.certificates.integers import as_count, last_touch_of_integers
from kinetile.kernel.compiled import apart, larger

__all__ = ["last_touch"]


@apart
def last_touch(
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
) -> int:
    """Return how many ticks after the later anchor two overlapping discs part, rounded down exactly, or
    ``NEVER``. Arguments as in ``first_touch``."""
    long = exponent(x, y, x2, y2, larger(radius, radius2))
    fast = exponent(vx, vy, vx2, vy2, 0.0)
    power = int(math.frexp(tick)[1]) - 1 + fast - long
    guess = 0
    if abs(power) < 900:  # an estimate is enough, from numbers that are brought to size
        brought = math.ldexp(1.0, power)
        time = float(elapsed) * brought
        ax = math.ldexp(vx, -fast)
        ay = math.ldexp(vy, -fast)
        dx = math.ldexp(x2, -long) - math.ldexp(x, -long) - ax * time
        dy = math.ldexp(y2, -long) - math.ldexp(y, -long) - ay * time
        reach = math.ldexp(radius, -long) + math.ldexp(radius2, -long)
        ux = math.ldexp(vx2, -fast) - ax
        uy = math.ldexp(vy2, -fast) - ay
        cross = dx * uy - dy * ux
        speed2 = ux * ux + uy * uy
        inside = larger(reach * reach * speed2 - cross * cross, 0.0)
        if speed2 > 0.0:
            guess = as_count((math.sqrt(inside) - (dx * ux + dy * uy)) / speed2 / brought)
    return last_touch_of_integers(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, guess)
