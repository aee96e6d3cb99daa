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

Where it is known about when they touch, from a lower bound, the step is made from there instead, and is all:
what makes it sure does not depend on where it begins (``touch_about``).

``look_closer`` takes what that leaves open: ties of lattices, grazes, contacts at the anchor. It takes
more steps from the estimate, each at a whole tick K and with the same bounds. Two ways to an end are new. A
root that is surely within a tick of K is settled by the sign of q(K), beyond its error. And where nothing was
rounded off on the way, as on a lattice in small dyadic numbers, the sign is exact however small: that settles
ties. The rest goes to ``integers``, and so do sizes that doubles cannot square, without an estimate.

``last_touch`` is the other root::

    q(s) > 0 and B(s) >= 0    s: they are apart, and do not approach
    q >= 0 at all times       s: they miss each other, or are tangent
    v = 0                     never: they overlap, and keep doing so
    else                      s + floor(last root of q); never from s + 2^62 on

It is found as the first is, with time turned round: by an estimate and a step (``left``), or ``integers``.

docs/exact-ticks.md derives the bounds and each constant.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kinetile.kernel.certificates.integers import LIMIT, as_count, touch_of_integers
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import apart, hook, larger, python_of, smaller
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error

ULP = 2.0**-53

LARGE = 2.0**200
SMALL = 2.0**-200
"""Sizes of lengths and speeds between which no product of four overflows, and none that counts underflows."""

TINY = 2.0**-500
"""More than all underflow in a sum of products of two, and no square of more is subnormal."""


class Separation(NamedTuple):
    """How far two bodies are apart along an axis at the later anchor, ``d + low``, and how fast they move
    apart, ``u + w``: each a rounded number and what rounding took from it.

    ``w`` is exact, ``low`` nearly. ``size`` is the sum of the magnitudes that ``d`` is made of.
    """

    d: float
    low: float
    size: float
    u: float
    w: float


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
def flown_for(plans: Plans) -> tuple[float, float]:
    """Return for how long the first body has flown at the later anchor: a rounded time, and what rounding
    took from it."""
    count = float(plans.elapsed)
    return count * plans.tick, float(plans.elapsed - int(count)) * plans.tick


@hook
def seen(axis: Axis, time: float, rest: float) -> Separation:
    """Return the separation along an axis of two bodies of which the first has flown for ``time + rest``."""
    flown = axis.v * time
    far, far_low = plus(axis.x2, -axis.x)
    moved = 0.0
    if axis.period > 0.0:
        moved = axis.turns * axis.period
        far, there_low = plus(far, moved)
        far_low += there_low
    d, d_low = plus(far, -flown)
    if axis.period > 0.0:
        d_low += product_error(axis.turns, axis.period, moved)
    low = (far_low + d_low) - (product_error(axis.v, time, flown) + axis.v * rest)
    u, w = plus(axis.v2, -axis.v)
    return Separation(d, low, abs(axis.x) + abs(axis.x2) + (abs(moved) + abs(flown)), u, w)


@hook
def separations(plans: Plans) -> tuple[Separation, Separation]:
    """Return the separations of two bodies along both axes."""
    time, rest = flown_for(plans)
    return seen(plans.x, time, rest), seen(plans.y, time, rest)


@hook
def along(x: Separation, ux: float, y: Separation, uy: float) -> tuple[float, float]:
    """Return d.u at the later anchor, and how far it can be off."""
    return x.d * ux + y.d * uy, 2.0**-50 * (x.size * abs(ux) + y.size * abs(uy)) + TINY


@hook
def after(t: float, s: Separation) -> tuple[float, float]:
    """Return what a separation is a time t after the later anchor: a rounded number, and nearly what rounding
    took from it."""
    flown = s.u * t
    place, rest = plus(s.d, flown)
    return place, rest + (product_error(s.u, t, flown) + (s.low + s.w * t))


@hook
def gap_at(
    t: float, along_x: Separation, along_y: Separation, reach: float, reach_low: float
) -> tuple[float, float, float, float]:
    """Return q, the squared distance less the squared reach, at a time t after the later anchor; how far it
    can be off; minus half its rate, (d.v); and how far that can be off."""
    x, x_rest = after(t, along_x)
    y, y_rest = after(t, along_y)
    xx = x * x
    yy = y * y
    rr = reach * reach
    both, both_low = plus(xx, yy)
    gap, gap_low = plus(both, -rr)
    squares = (product_error(x, x, xx) + product_error(y, y, yy)) - product_error(reach, reach, rr)
    mixed = (x_rest * (x + x + x_rest) + y_rest * (y + y + y_rest)) - reach_low * (reach + reach + reach_low)
    q = gap + (((both_low + gap_low) + squares) + mixed)
    x_far = along_x.size + abs(x)
    y_far = along_y.size + abs(y)
    spread = x_far * (abs(x) + 2.0**-50 * x_far) + y_far * (abs(y) + 2.0**-50 * y_far)
    q_error = 2.0**-98 * (spread + rr) + ULP * abs(q)
    slope_error = 2.0**-49 * (x_far * abs(along_x.u) + y_far * abs(along_y.u)) + TINY
    return q, q_error, -(x * along_x.u + y * along_y.u), slope_error


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


OPEN = -1
"""What a filter returns where double does not decide."""


@hook
def floor_of(ticks: float, step: float, bound: float) -> int:
    """Return the floor of ``ticks + step``, 0 if it is less, ``NEVER`` from 2^62 on; ``OPEN`` where a whole
    tick lies within ``bound``."""
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
def is_whole(axis: Axis, time: float, rest: float) -> bool:
    """Whether (d, u) of ``seen`` are exact."""
    flown = axis.v * time
    moved = axis.turns * axis.period
    far = axis.x2 - axis.x
    exact = (
        kept(axis.v, time, flown) and (rest == 0.0 or axis.v == 0.0) and kept(axis.turns, axis.period, moved)
    )
    exact = exact and whole_sum(axis.x2, -axis.x) and whole_sum(far, moved)
    return exact and whole_sum(far + moved, -flown) and whole_sum(axis.v2, -axis.v)


@hook
def are_whole(plans: Plans) -> bool:
    """Whether (d, u) of both ``separations`` are exact."""
    time, rest = flown_for(plans)
    return is_whole(plans.x, time, rest) and is_whole(plans.y, time, rest)


@hook
def about(x: Separation, y: Separation, reach: float) -> float:
    """Return about when two discs touch, in the unit of d / u."""
    cross = x.d * y.u - y.d * x.u
    inside = larger(reach * reach * (x.u * x.u + y.u * y.u) - cross * cross, 0.0)
    fall = math.sqrt(inside) - (x.d * x.u + y.d * y.u)
    return (x.d * x.d + y.d * y.d - reach * reach) / fall if fall > 0.0 else 0.0


@hook
def exact_gap(
    t: float, x: Separation, y: Separation, reach: float, q: float, error: float
) -> tuple[float, float]:
    """Return q at a time and 0 where no operation on the way rounds anything off; else what is given."""
    px = x.u * t
    py = y.u * t
    ex = x.d + px
    ey = y.d + py
    exact = kept(x.u, t, px) and kept(y.u, t, py) and whole_sum(x.d, px) and whole_sum(y.d, py)
    exact = exact and kept(ex, ex, ex * ex) and kept(ey, ey, ey * ey)
    if exact and whole_sum(ex * ex, ey * ey):
        return (ex * ex + ey * ey) - reach * reach, 0.0
    return q, error


STEPS = 8


@apart
def look_closer(plans: Plans, radius: float, radius2: float) -> int:
    """Return what ``first_touch`` does."""
    if plans.x.v == plans.x.v2 and plans.y.v == plans.y.v2:
        return NEVER
    x, y = separations(plans)
    reach, reach_low = plus(radius, radius2)
    speed = abs(x.u) + abs(y.u)
    per_time = plans.per_time
    guess = 0
    if speed > SMALL and speed < LARGE and reach > SMALL and reach + (x.size + y.size) < LARGE:
        lossless = are_whole(plans) and reach_low == 0.0 and kept(reach, reach, reach * reach)
        bend, bend_error = along(x, x.u, y, y.u)
        approach = bend < -bend_error
        if not approach and lossless and kept(x.d, x.u, x.d * x.u) and kept(y.d, y.u, y.d * y.u):
            if bend >= 0.0:
                return NEVER
            approach = True
        speed2 = x.u * x.u + y.u * y.u
        guess = as_count(about(x, y, reach) * per_time)
        for _ in range(STEPS if approach else 0):
            k = float(guess)
            guess = int(k)
            t = k * plans.tick
            q, q_error, slope, slope_error = gap_at(t, x, y, reach, reach_low)
            if lossless:
                q, q_error = exact_gap(t, x, y, reach, q, q_error)
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
            if bent < 0.125 and bound < 0.25:
                found = floor_of(k, part, bound)
                if found != OPEN:
                    return found
                if known and abs(part) < 0.5:
                    return guess if q >= 0.0 else guess - 1
            down = math.floor(part + 0.5)
            if down == 0.0:
                break
            guess = int(smaller(larger(guess + int(down), 0), LIMIT))
    return touch_of_integers(plans, radius, radius2, guess, False)


@hook
def filtered(x: Separation, y: Separation, radius: float, radius2: float, per_time: float) -> int:
    """Return what ``first_touch`` does for a separation and a relative velocity, or ``OPEN``."""
    reach, reach_low = plus(radius, radius2)
    speed = abs(x.u) + abs(y.u)
    if speed > SMALL and speed < LARGE and reach > SMALL and reach + (x.size + y.size) < LARGE:
        bend, bend_error = along(x, x.u, y, y.u)
        if bend > bend_error:
            return NEVER
        cross, cross_error = along(x, y.u, y, -x.u)
        clear = abs(cross) - cross_error
        speed2 = x.u * x.u + y.u * y.u
        span2 = reach * reach * speed2
        if clear > 0.0 and clear * clear > span2 * (1.0 + 2.0**-48):
            return NEVER
        inside = span2 - cross * cross
        if inside > 0.0 and bend < -bend_error:
            t = larger((x.d * x.d + y.d * y.d - reach * reach) / (math.sqrt(inside) - bend), 0.0)
            ticks = t * per_time
            if ticks < FAR:
                q, q_error, slope, slope_error = gap_at(t, x, y, reach, reach_low)
                if slope > 8.0 * slope_error:
                    step, bound, bent = newton(q, q_error, slope, slope_error, speed2, per_time)
                    if bent < 0.125 and bound < 0.5:
                        return floor_of(ticks, step, bound)
    return OPEN


@hook
def first_touch(plans: Plans, radius: float, radius2: float) -> int:
    """Return how many ticks after the later anchor two discs touch, rounded down exactly, or ``NEVER``."""
    x, y = separations(plans)
    found = filtered(x, y, radius, radius2, plans.per_time)
    if found != OPEN:
        return found
    return look_closer(plans, radius, radius2)


first_touch_apart = apart(python_of(first_touch))
"""The same, compiled for all loops at once: for a search among images, which has no room for it."""


@hook
def touch_about(plans: Plans, radius: float, radius2: float, guess: int) -> int:
    """Return what ``first_touch`` does, by one step from a guess: about how many ticks after the later anchor
    they touch. Below 0 it is none: then, or if the step does not decide, ``first_touch`` is called."""
    x, y = separations(plans)
    reach, reach_low = plus(radius, radius2)
    speed = abs(x.u) + abs(y.u)
    small = speed > SMALL and speed < LARGE and reach > SMALL and reach + (x.size + y.size) < LARGE
    if small and guess >= 0:
        ticks = float(guess)
        q, q_error, slope, slope_error = gap_at(ticks * plans.tick, x, y, reach, reach_low)
        if slope > 8.0 * slope_error:
            speed2 = x.u * x.u + y.u * y.u
            step, bound, bent = newton(q, q_error, slope, slope_error, speed2, plans.per_time)
            if bent < 0.125 and bound < 0.5:
                found = floor_of(ticks, step, bound)
                if found != OPEN:
                    return found
    return int(first_touch_apart(plans, radius, radius2))


@hook
def left(x: Separation, y: Separation, radius: float, radius2: float, per_time: float) -> tuple[int, float]:
    """Return what ``last_touch`` does for a separation and a relative velocity, or ``OPEN``; and when,
    to a tick unless it is ``OPEN``."""
    reach, reach_low = plus(radius, radius2)
    speed = abs(x.u) + abs(y.u)
    speed2 = x.u * x.u + y.u * y.u
    t = 0.0
    if speed > SMALL and speed < LARGE and reach > SMALL and reach + (x.size + y.size) < LARGE:
        bend = x.d * x.u + y.d * y.u
        cross = x.d * y.u - y.d * x.u
        root = math.sqrt(larger(reach * reach * speed2 - cross * cross, 0.0))
        if bend <= 0.0:
            t = (root - bend) / speed2
        elif root > 0.0:
            t = (reach * reach - (x.d * x.d + y.d * y.d)) / (root + bend)
        ticks = t * per_time
        if root > 0.0 and abs(ticks) < FAR:
            q, q_error, slope, slope_error = gap_at(t, x, y, reach, reach_low)
            if -slope > 8.0 * slope_error:
                step, bound, bent = newton(q, q_error, -slope, slope_error, speed2, per_time)
                if bent < 0.125 and bound < 0.5:
                    return floor_of(ticks, -step, bound), t - step / per_time
    return OPEN, t


@apart
def last_touch(plans: Plans, radius: float, radius2: float) -> int:
    """Return how many ticks after the later anchor two overlapping discs part, rounded down exactly, or
    ``NEVER``."""
    x, y = separations(plans)
    found, t = left(x, y, radius, radius2, plans.per_time)
    if found != OPEN:
        return found
    return touch_of_integers(plans, radius, radius2, as_count(t * plans.per_time), True)
