"""When two discs touch, and when two that pass through each other part: the exact ticks.

The plans' doubles are read as rationals. With s the later anchor, d(T) the separation and v the relative
velocity, R the sum of the radii, q(T) = |d(T)|^2 - R^2 and B(T) = d(T).v, two discs touch at::

    B(s) >= 0                 never: they part, or slide
    q(s) <= 0                 s: they touch or overlap, and approach
    q >= 0 at all times       never: they miss, or are tangent
    else                      s + floor(first root of q); never from s + 2^62 on

``first_touch`` decides nearly all pairs in double, in three steps:

* *refusal*: B(s), or |d x v| against R |v|, is beyond the bound of its rounding;
* *estimate* of the root: (|d|^2 - R^2) / (-d.v + sqrt(R^2 |v|^2 - (d x v)^2)). The textbook's discriminant
  is the same number, but loses (|d| / R)^2 ulps to cancellation where this one loses |d| / R;
* *one Newton step* from there, q in compensated arithmetic. The error of the step has a bound, made of the
  errors of q and of the slope, and of the curvature. Where no whole tick lies within it of the root, the
  floor is known; and a slope that is surely downward, with a curvature that is small against it, shows that
  there is a root, and that it is the first.

``look_closer`` takes what that leaves open: ties of lattices, grazes, contacts at the anchor, sizes that
doubles cannot square. It takes more steps from the estimate, each at a whole tick K and with the same
bounds. Two ways to an end are new. A root that is surely within a tick of K is settled by the sign of q(K),
beyond its error. And where nothing was rounded off on the way, as on a lattice in small dyadic numbers, the
sign is exact however small: that settles ties. The rest goes to ``integers``.

``last_touch`` is the other root::

    q(s) > 0 and B(s) >= 0    s: they are apart, and do not approach
    q >= 0 at all times       s: they miss each other, or are tangent
    v = 0                     never: they overlap, and keep doing so
    else                      s + floor(last root of q); never from s + 2^62 on

Passing is rare beside contact, and a parting is computed once a plan: so there is no filter in double, only
an estimate from which whole numbers go on.

Along each axis the separation at the later anchor is ``d + low`` and the relative velocity ``u + w``, each
a rounded number and what rounding took from it. ``w`` is exact, ``low`` nearly. ``size`` is the sum of the
magnitudes that ``d`` is made of. docs/exact-ticks.md derives the bounds and each constant.
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.integers import (
    LIMIT,
    as_count,
    first_touch_of_integers,
    last_touch_of_integers,
)
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import apart, hook, larger, smaller
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error

ULP = 2.0**-53

LARGE = 2.0**200
SMALL = 2.0**-200
"""Sizes of lengths and speeds between which no product of four overflows, and none that counts underflows."""

TINY = 2.0**-500
"""More than all underflow in a sum of products of two, and no square of more is subnormal."""


@hook
def plus(a: float, b: float) -> tuple[float, float]:
    """Return the rounded sum of two numbers, and exactly what rounding took from it."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@hook
def kept(a: float, b: float, product: float) -> bool:
    """Whether the rounded product of two numbers is their product."""
    return product_error(a, b, product) == 0.0 and (abs(product) > TINY or a == 0.0 or b == 0.0)


@hook
def whole_sum(a: float, b: float) -> bool:
    """Whether the rounded sum of two numbers is their sum."""
    return plus(a, b)[1] == 0.0


@hook
def seen_from(
    x: float, vx: float, x2: float, vx2: float, time: float, rest: float
) -> tuple[float, float, float, float, float]:
    """Return (d, low, size, u, w) along an axis: of a second body seen from a first, which has flown for
    ``time + rest`` since it was at ``x``."""
    flown = vx * time
    far, far_low = plus(x2, -x)
    d, d_low = plus(far, -flown)
    low = (far_low + d_low) - (product_error(vx, time, flown) + vx * rest)
    u, w = plus(vx2, -vx)
    return d, low, abs(x) + abs(x2) + abs(flown), u, w


@hook
def seen_through(
    x: float, vx: float, x2: float, vx2: float, time: float, rest: float, turns: float, period: float
) -> tuple[float, float, float, float, float]:
    """Return what ``seen_from`` does for the second body's image that is ``turns`` periods further on."""
    flown = vx * time
    moved = turns * period
    far, far_low = plus(x2, -x)
    there, there_low = plus(far, moved)
    d, d_low = plus(there, -flown)
    lost = product_error(vx, time, flown) + vx * rest
    low = ((far_low + there_low) + (d_low + product_error(turns, period, moved))) - lost
    u, w = plus(vx2, -vx)
    return d, low, abs(x) + abs(x2) + (abs(moved) + abs(flown)), u, w


@hook
def along(dx: float, x_size: float, ux: float, dy: float, y_size: float, uy: float) -> tuple[float, float]:
    """Return d.u at the later anchor, and how far it can be off."""
    return dx * ux + dy * uy, 2.0**-50 * (x_size * abs(ux) + y_size * abs(uy)) + TINY


@hook
def after(t: float, d: float, low: float, u: float, w: float) -> tuple[float, float]:
    """Return where a separation is along an axis, a time t after the later anchor: a rounded number, and
    nearly what rounding took from it."""
    flown = u * t
    place, rest = plus(d, flown)
    return place, rest + (product_error(u, t, flown) + (low + w * t))


@hook
def gap_at(
    t: float,
    dx: float,
    x_low: float,
    x_size: float,
    ux: float,
    wx: float,
    dy: float,
    y_low: float,
    y_size: float,
    uy: float,
    wy: float,
    reach: float,
    reach_low: float,
) -> tuple[float, float, float, float]:
    """Return q, the squared distance less the squared reach, at a time t after the later anchor; how far it
    can be off; minus half its rate, (d.v); and how far that can be off."""
    x, x_rest = after(t, dx, x_low, ux, wx)
    y, y_rest = after(t, dy, y_low, uy, wy)
    xx = x * x
    yy = y * y
    rr = reach * reach
    both, both_low = plus(xx, yy)
    gap, gap_low = plus(both, -rr)
    squares = (product_error(x, x, xx) + product_error(y, y, yy)) - product_error(reach, reach, rr)
    mixed = (x_rest * (x + x + x_rest) + y_rest * (y + y + y_rest)) - reach_low * (reach + reach + reach_low)
    q = gap + (((both_low + gap_low) + squares) + mixed)
    x_far = x_size + abs(x)
    y_far = y_size + abs(y)
    spread = x_far * (abs(x) + 2.0**-50 * x_far) + y_far * (abs(y) + 2.0**-50 * y_far)
    q_error = 2.0**-98 * (spread + rr) + ULP * abs(q)
    slope_error = 2.0**-49 * (x_far * abs(ux) + y_far * abs(uy)) + TINY
    return q, q_error, -(x * ux + y * uy), slope_error


@hook
def newton(
    q: float, q_error: float, slope: float, slope_error: float, speed2: float, per_time: float
) -> tuple[float, float, float]:
    """Return one Newton step from what ``gap_at`` says, in ticks; how far it can end from the root; and how
    much the path bends: the bound holds where that is below 1/8, and slope > 8 slope_error."""
    inverse = 1.0 / slope
    step = 0.5 * q * inverse
    bent = speed2 * (abs(q) + q_error) * (inverse * inverse)
    loose = bent + 2.0 * slope_error * inverse + 2.0**-49
    return step * per_time, (q_error * inverse + abs(step) * loose) * per_time + 2.0**-50, bent


STEPS = 8


@hook
def whole_path(
    x: float, vx: float, x2: float, vx2: float, time: float, rest: float, turns: float, period: float
) -> bool:
    """Whether (d, u) of ``seen_through`` are exact."""
    flown = vx * time
    moved = turns * period
    far = x2 - x
    exact = kept(vx, time, flown) and (rest == 0.0 or vx == 0.0) and kept(turns, period, moved)
    exact = exact and whole_sum(x2, -x) and whole_sum(far, moved)
    return exact and whole_sum(far + moved, -flown) and whole_sum(vx2, -vx)


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


@hook
def brought_to_size(
    x: float,
    y: float,
    vx: float,
    vy: float,
    count: float,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    radius: float,
    radius2: float,
    tick: float,
    right: float,
    up: float,
) -> tuple[float, float, float, float, float, float]:
    """Return (dx, dy, ux, uy, reach) in units in which doubles can be squared, and the length of a tick in
    them; 0 where there are no such units. Good for an estimate only. The second disc is seen (right, up) of
    where it is: an image."""
    long = larger(exponent(x, y, x2, y2, larger(radius, radius2)), exponent(right, up, 0.0, 0.0, 0.0))
    fast = exponent(vx, vy, vx2, vy2, 0.0)
    power = int(math.frexp(tick)[1]) - 1 + fast - long
    if abs(power) >= 900:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    unit = math.ldexp(1.0, power)
    time = count * unit
    ax = math.ldexp(vx, -fast)
    ay = math.ldexp(vy, -fast)
    dx = math.ldexp(x2, -long) - math.ldexp(x, -long) + math.ldexp(right, -long) - ax * time
    dy = math.ldexp(y2, -long) - math.ldexp(y, -long) + math.ldexp(up, -long) - ay * time
    reach = math.ldexp(radius, -long) + math.ldexp(radius2, -long)
    return dx, dy, math.ldexp(vx2, -fast) - ax, math.ldexp(vy2, -fast) - ay, reach, unit


@hook
def exact_gap(
    t: float, dx: float, ux: float, dy: float, uy: float, reach: float, q: float, error: float
) -> tuple[float, float]:
    """Return q at a time and 0 where no operation on the way rounds anything off; else what is given."""
    px = ux * t
    py = uy * t
    ex = dx + px
    ey = dy + py
    exact = kept(ux, t, px) and kept(uy, t, py) and whole_sum(dx, px) and whole_sum(dy, py)
    exact = exact and kept(ex, ex, ex * ex) and kept(ey, ey, ey * ey)
    if exact and whole_sum(ex * ex, ey * ey):
        return (ex * ex + ey * ey) - reach * reach, 0.0
    return q, error


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
    m: float,
    n: float,
    width: float,
    height: float,
) -> int:
    """Return what ``touch_through`` does."""
    if vx == vx2 and vy == vy2:
        return NEVER
    count = float(elapsed)
    time = count * tick
    rest = float(elapsed - int(count)) * tick
    dx, x_low, x_size, ux, wx = seen_through(x, vx, x2, vx2, time, rest, m, width)
    dy, y_low, y_size, uy, wy = seen_through(y, vy, y2, vy2, time, rest, n, height)
    reach, reach_low = plus(radius, radius2)
    speed = abs(ux) + abs(uy)
    guess = 0
    if speed > SMALL and speed < LARGE and reach > SMALL and reach + (x_size + y_size) < LARGE:
        lossless = whole_path(x, vx, x2, vx2, time, rest, m, width)
        lossless = lossless and whole_path(y, vy, y2, vy2, time, rest, n, height)
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
                q, q_error = exact_gap(t, dx, ux, dy, uy, reach, q, q_error)
            known = abs(q) > q_error or q_error == 0.0
            if known and q <= 0.0 and guess == 0:
                return 0
            discriminant = slope * slope - speed2 * q
            if not (slope > 8.0 * slope_error and discriminant > 0.0):
                break
            if known and q >= 0.0 and guess >= LIMIT:
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
                    return larger(found, 0) if found < LIMIT else NEVER
                if known and abs(part) < 0.5:
                    return guess if q >= 0.0 else guess - 1
            down = math.floor(part + 0.5)
            if down == 0.0:
                break
            guess = int(smaller(larger(guess + int(down), 0), LIMIT))
    else:  # a guess is enough
        dx, dy, ux, uy, reach, unit = brought_to_size(
            x, y, vx, vy, count, x2, y2, vx2, vy2, radius, radius2, tick, m * width, n * height
        )
        if unit > 0.0:
            guess = as_count(about(dx, dy, ux, uy, reach) / unit)
    return first_touch_of_integers(
        x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, m, n, width, height, guess
    )


OPEN = -1
"""What ``filtered`` returns where double does not decide."""


@hook
def filtered(
    dx: float,
    x_low: float,
    x_size: float,
    ux: float,
    wx: float,
    dy: float,
    y_low: float,
    y_size: float,
    uy: float,
    wy: float,
    radius: float,
    radius2: float,
    tick: float,
    per_time: float,
) -> int:
    """Return what ``first_touch`` does for a separation and a relative velocity, or ``OPEN``."""
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
                            return found if found < LIMIT else NEVER
    return OPEN


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
    found = filtered(dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, radius, radius2, tick, per_time)
    if found != OPEN:
        return found
    return look_closer(
        x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, per_time, 0.0, 0.0, 0.0, 0.0
    )


@apart
def touch_through(
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
    m: float,
    n: float,
    width: float,
    height: float,
) -> int:
    """Return what ``first_touch`` does for the second disc's image that is m periods ``width`` to the right
    and n periods ``height`` up; m and n are whole, below 2^32 in size."""
    whole = float(elapsed)
    time = whole * tick
    rest = float(elapsed - int(whole)) * tick
    dx, x_low, x_size, ux, wx = seen_through(x, vx, x2, vx2, time, rest, m, width)
    dy, y_low, y_size, uy, wy = seen_through(y, vy, y2, vy2, time, rest, n, height)
    found = filtered(dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, radius, radius2, tick, per_time)
    if found != OPEN:
        return found
    return look_closer(
        x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, per_time, m, n, width, height
    )


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
    m: float,
    n: float,
    width: float,
    height: float,
) -> int:
    """Return how many ticks after the later anchor two overlapping discs part, rounded down exactly, or
    ``NEVER``. Arguments as in ``touch_through``."""
    guess = 0
    dx, dy, ux, uy, reach, unit = brought_to_size(
        x, y, vx, vy, float(elapsed), x2, y2, vx2, vy2, radius, radius2, tick, m * width, n * height
    )
    if unit > 0.0:
        cross = dx * uy - dy * ux
        speed2 = ux * ux + uy * uy
        inside = larger(reach * reach * speed2 - cross * cross, 0.0)
        if speed2 > 0.0:
            guess = as_count((math.sqrt(inside) - (dx * ux + dy * uy)) / speed2 / unit)
    return last_touch_of_integers(
        x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, m, n, width, height, guess
    )
