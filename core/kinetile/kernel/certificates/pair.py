"""When two discs touch: the exact tick, by a filter in double that decides nearly all there is to ask.

The plans' doubles are read as rationals. With s the later anchor, d(T) the separation and v the relative
velocity, R the sum of the radii, q(T) = |d(T)|^2 - R^2 and B(T) = d(T).v::

    B(s) >= 0                 never: they part, or slide
    q(s) <= 0                 s: they touch or overlap, and approach
    q >= 0 at all times       never: they miss, or are tangent
    else                      s + floor(first root of q); never from s + 2^62 on

``first_touch`` takes three steps:

* *refusal*: B(s), or |d x v| against R |v|, is beyond the bound of its rounding;
* *estimate* of the root: (|d|^2 - R^2) / (-d.v + sqrt(R^2 |v|^2 - (d x v)^2)). The textbook's discriminant
  is the same number, but loses (|d| / R)^2 ulps to cancellation where this one loses |d| / R;
* *one Newton step* from there, q in compensated arithmetic. The error of the step has a bound, made of the
  errors of q and of the slope, and of the curvature. Where no whole tick lies within it of the root, the
  floor is known; and a slope that is surely downward, with a curvature that is small against it, shows that
  there is a root, and that it is the first.

What that leaves open goes to ``closer``: ties of lattices, grazes, contacts at the anchor, sizes that
doubles cannot square. docs/exact-ticks.md derives each constant.
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.closer import look_closer
from kinetile.kernel.certificates.paths import along, gap_at, newton, seen_from
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.certificates.sums import LARGE, SMALL, plus
from kinetile.kernel.compiled import hook, larger
from kinetile.kernel.tables import NEVER

__all__ = ["first_touch"]


@hook
def first_touch(
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
    """Return how many ticks after the later anchor two discs touch, rounded down exactly, or ``NEVER``.

    The second disc is at (x2, y2) at the later anchor; the first was at (x, y) ``elapsed`` ticks before, 0 to
    2^62. ``tick`` is the length of one, a power of two, and ``per_time`` its inverse.
    """
    whole = float(elapsed)
    time = whole * tick
    rest = float(elapsed - int(whole)) * tick
    dx, x_low, x_size, ux, wx = seen_from(x, vx, x2, vx2, time, rest)
    dy, y_low, y_size, uy, wy = seen_from(y, vy, y2, vy2, time, rest)
    reach, reach_low = plus(radius, radius2)
    speed = abs(ux) + abs(uy)
    if speed > SMALL and speed < LARGE and reach > SMALL and reach + (x_size + y_size) < LARGE:
        bend, bend_error = along(dx, x_size, ux, dy, y_size, uy)
        if bend > bend_error:
            return NEVER
        cross, cross_error = along(dx, x_size, uy, dy, y_size, -ux)
        clear = abs(cross) - cross_error
        speed2 = ux * ux + uy * uy
        span2 = reach * reach * speed2
        if clear > 0.0 and clear * clear > span2 * (1.0 + 2.0**-48):
            return NEVER
        inside = span2 - cross * cross
        if inside > 0.0 and bend < -bend_error:
            t = larger((dx * dx + dy * dy - reach * reach) / (math.sqrt(inside) - bend), 0.0)
            ticks = t * per_time
            if ticks < FAR:
                q, q_error, slope, slope_error = gap_at(
                    t, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, reach, reach_low
                )
                if slope > 8.0 * slope_error:
                    step, bound, bent = newton(q, q_error, slope, slope_error, speed2, per_time)
                    if bent < 0.125 and bound < 0.5:
                        base = int(ticks)
                        part = (ticks - float(base)) + step
                        down = math.floor(part)
                        over = part - float(down)
                        if over > bound and over < 1.0 - bound:
                            found = base + int(down)
                            if found < 0:
                                return 0
                            return found if found < 1 << 62 else NEVER
    return look_closer(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, per_time)
