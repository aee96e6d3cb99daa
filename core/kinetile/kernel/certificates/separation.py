"""The separation of two bodies along an axis, and its rate: as doubles, with bounds of their rounding errors.

A double stands for a rational, and other numbers are nearly sums of two doubles; this module bounds the
remainders. (Filters in front of exact arithmetic: Shewchuk, Discrete & Computational Geometry 18, 1997.)
``tests/core/kernel/certificates/test_claims.py`` compares them with fractions.

Error bounds
============

u is 2^-53, and fl(z) is z rounded: |fl(z) - z| <= u |z|, and also <= u |fl(z)|. Sums never underflow. Terms
of order u times a bound are left out of the bound: they are below 2^-48 of it, and no constant is so tight.
P is ``per_time``, ticks in a unit of time; a tick is a power of two, at most 2^-52, so multiplying by it or
by P is exact. ``plus`` gives the rounded sum and its error, exactly (Knuth, *Seminumerical Algorithms*,
4.2.2); ``product_error`` the error of a product (a fused multiply-add, or Dekker, Numerische Mathematik 18,
1971).

Sizes
=====

The filters work where the sum of the radii and the relative speed are above SMALL = 2^-200, and they and all
lengths below LARGE = 2^200. A prediction reaches 2^62 ticks, at most 2^10 units of time, so |u_x t| < 2^211
and no coordinate is above 2^212. Then nothing overflows: the largest products are slope^2 and speed^2 q,
below 2^850. And R^2 |u|^2 >= 2^-801 is a normal number. A number that is not finite fails every comparison.

*Underflow.* A product that underflows is off by 2^-1075, ``product_error`` by at most 2^-1073; so a place by
less than 2^-1071, and a product of a place with a speed by less than 2^-870. **TINY = 2^-500** is in every
bound of such products: so large that a slope that passes, above 8 TINY, has a normal square. In q the
positions' underflow comes to 2^-1069 |x|, negligible against 2^-98 (x_far |x| + R^2), R^2 being at least
2^-400.

The separation (seen)
=====================

Along an axis the exact separation at the later anchor is D = x2 - x - vx (time + rest), the exact relative
velocity U = vx2 - vx; below ux is the ``u`` of a ``Separation``. ``time`` is the elapsed ticks rounded, so
that |rest| <= u time, and both are exact. Let f = |flown|, m = |x| + |x2| + f (``size``). In exact numbers D
= d + far_low + d_low - (product_error + vx rest), and |far_low| <= u (m - f), |d_low| <= u m, |product_error|
<= u f, |vx rest| <= u f. So

    |low| <= u (2 m + f) <= 3 u m        |d| <= m        U = ux + w,  |w| <= u |ux|,  exactly

and ``low`` is rounded four times: vx rest (u^2 f), its sum with the error (2 u^2 f), far_low + d_low (u^2 (2
m - f)), the difference (u^2 (2 m + f)); together

    |D - d - low| <= u^2 (4 m + 3 f) <= 7 u^2 m                                                          (1)

The separation of an image
==========================

Through an image that is n periods P further on (rule 5p) D = x2 - x + n P - vx (time + rest), n being a
whole number below 2^32. Let moved = fl(n P), g = |moved|, m = |x| + |x2| + f + g. With far = fl(x2 - x),
there = fl(far + moved), d = fl(there - flown) is |far_low| <= u (m - f - g), |there_low| <= u (m - f),
|d_low| <= u m, and n P is off by u g at most: with the 2 u f of the flight |low| <= 3 u m again. ``low`` is
rounded six times: vx rest (u^2 f), its sum with the error (2 u^2 f), far_low + there_low (u^2 (2 m - 2 f -
g)), d_low and the error of n P (u^2 (m + g)), the sum of these two (u^2 (3 m - 2 f)), the difference (3 u^2
m); together

    |D - d - low| <= u^2 (9 m - f) <= 9 u^2 m                                                            (1')

*Sizes*: a period is above the sum of two radii, so above SMALL, and m includes it: below LARGE, no product
overflows, and an error of n P does not underflow.

Accelerations
=============

``times`` and ``total`` are off by 8 u^2 of the product and by 3 u^2 of the sum of the sizes: each has three
roundings of terms of size 2 u, and ``times`` leaves out one of u^2.

*Motions.* With te the time since the first anchor, g the periods of an image, S = |v| + |v2| + |a| te
(``speed``) and m = |x| + |x2| + |g| + (|v| + |a| te) te (``size``): a te is off by 8 u^2 |a| te, u + w by 3
u^2 (|v| + |v2| + |a| te) more, so by 12 u^2 S; the first body's flight by (3 (|v| + |a| te / 2) + 4 |a| te +
8 (|v| + |a| te / 2)) u^2 te. g is exact, as ``turns`` is whole, below 2^32; x2 - x + g is off by 3 u^2 (|x| +
|x2| + |g|), and d + low, which is this less the flight, by 16 u^2 m; by 19 if a corner is subtracted as well,
which is part of m. b + c is exact, so b is 0 if and only if the accelerations are equal.

*Grains* (``grain_at``). At a whole tick n a separation is a multiple of a power of two: the least of the
lowest bits of both places and of the numbers added to them, and of the lowest bits of the velocities times
the ticks' lowest bit, and of the accelerations times its square. If such a multiple is smaller than the power
of two, it is 0: this decides ties, which are everywhere on lattices of small dyadic numbers.
"""

import math
from typing import NamedTuple

from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.compiled import hook, smaller
from kinetile.kernel.vectors import product_error

ULP = 2.0**-53

LARGE = 2.0**200

SMALL = 2.0**-200
"""Sizes of lengths and speeds between which no product of four overflows, and none that counts underflows."""

TINY = 2.0**-500
"""More than all underflow in a sum of products of two, and no square of more is subnormal."""


class Separation(NamedTuple):
    """The separation of two bodies along an axis at the later anchor, ``d + low``, and its rate, ``u + w``:
    each a rounded number and its rounding error.

    ``w`` is exact, ``low`` nearly. ``size`` is the sum of the magnitudes that ``d`` is made of.
    """

    d: float
    low: float
    size: float
    u: float
    w: float


@hook
def plus(a: float, b: float) -> tuple[float, float]:
    """Returns the rounded sum of two numbers, and exactly its rounding error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@hook
def less_corner(s: Separation, c: float, c_low: float) -> Separation:
    """Returns a separation less the coordinate of a corner."""
    d, low = plus(s.d, -c)
    return Separation(d, low + (s.low - c_low), s.size + abs(c), s.u, s.w)


@hook
def seen(axis: Axis, time: float, rest: float) -> Separation:
    """Returns the separation along an axis of two bodies; the first has flown for ``time + rest``."""
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
    found = Separation(d, low, abs(axis.x) + abs(axis.x2) + (abs(moved) + abs(flown)), u, w)
    return found if axis.corner == 0.0 else less_corner(found, axis.corner, axis.corner_low)


@hook
def separations(plans: Plans) -> tuple[Separation, Separation]:
    """Returns the separations of two bodies along both axes."""
    time, rest = time_of(plans.elapsed, plans.per_tick)
    return seen(plans.x, time, rest), seen(plans.y, time, rest)


@hook
def along(x: Separation, ux: float, y: Separation, uy: float) -> tuple[float, float]:
    """Returns d.u at the later anchor, and a bound of its error."""
    return x.d * ux + y.d * uy, 2.0**-50 * (x.size * abs(ux) + y.size * abs(uy)) + TINY


@hook
def separation_at(t: float, s: Separation) -> tuple[float, float]:
    """Returns a separation a time t after the later anchor, rounded, and nearly its rounding error."""
    flown = s.u * t
    place, rest = plus(s.d, flown)
    return place, rest + (product_error(s.u, t, flown) + (s.low + s.w * t))


class Motion(NamedTuple):
    """The relative motion of two bodies along an axis from the later anchor on: separation ``d + low``,
    velocity ``u + w``, acceleration ``b + c``, each a rounded number and its rounding error; and the sizes of
    the terms of the first two."""

    d: float
    low: float
    u: float
    w: float
    b: float
    c: float
    size: float
    speed: float


@hook
def total(a: float, low: float, b: float, low2: float) -> tuple[float, float]:
    """Returns the sum of two sums of two doubles each."""
    s, rest = plus(a, b)
    return plus(s, rest + (low + low2))


@hook
def times(a: float, low: float, b: float, low2: float) -> tuple[float, float]:
    """Returns the product of two sums of two doubles each."""
    product = a * b
    return plus(product, product_error(a, b, product) + (a * low2 + low * b))


@hook
def motion_of(axis: Axis, time: float, rest: float) -> Motion:
    """Returns the relative motion of two bodies along an axis; the first has flown for ``time + rest``."""
    gained, gained_low = times(time, rest, axis.a, 0.0)
    u, w = plus(axis.v2, -axis.v)
    u, w = total(u, w, -gained, -gained_low)
    flown, flown_low = total(axis.v, 0.0, 0.5 * gained, 0.5 * gained_low)
    flown, flown_low = times(flown, flown_low, time, rest)
    d, low = plus(axis.x2, -axis.x)
    size = abs(axis.x) + abs(axis.x2) + abs(axis.corner)
    if axis.period > 0.0:
        moved = axis.turns * axis.period
        d, low = total(d, low, moved, product_error(axis.turns, axis.period, moved))
        size += abs(moved)
    d, low = total(d, low, -axis.corner, -axis.corner_low)
    d, low = total(d, low, -flown, -flown_low)
    b, c = plus(axis.a2, -axis.a)
    speed = abs(axis.v) + abs(gained)
    return Motion(d, low, u, w, b, c, size + speed * time, speed + abs(axis.v2))


@hook
def time_of(count: int, per_tick: float) -> tuple[float, float]:
    """Returns the length of a number of ticks: a rounded time, and its rounding error."""
    ticks = float(count)
    return ticks * per_tick, float(count - int(ticks)) * per_tick


@hook
def motions(plans: Plans) -> tuple[Motion, Motion]:
    """Returns the relative motion of two bodies along both axes."""
    time, rest = time_of(plans.elapsed, plans.per_tick)
    return motion_of(plans.x, time, rest), motion_of(plans.y, time, rest)


@hook
def place_at(motion: Motion, t: float, rest: float) -> tuple[float, float, float]:
    """Returns the separation along an axis at a time ``t + rest``, a sum of two doubles, and the size of its
    terms."""
    half, half_low = times(t, rest, 0.5 * motion.b, 0.5 * motion.c)
    half, half_low = total(half, half_low, motion.u, motion.w)
    flown, flown_low = times(half, half_low, t, rest)
    place, low = total(motion.d, motion.low, flown, flown_low)
    return place, low, motion.size + (motion.speed + abs(motion.b) * t) * t


@hook
def grain_of(value: float) -> float:
    """Returns the greatest power of two that divides a number: infinity for 0."""
    if value == 0.0:
        return math.inf
    part, exponent = math.frexp(value)
    digits = int(abs(part) * 2.0**53)
    return float(math.ldexp(float(digits & -digits), exponent - 53))


@hook
def grain_at(axis: Axis, elapsed: int, count: int, per_tick: float) -> float:
    """Returns a power of two that divides a separation along an axis after a number of ticks; the first body
    has flown for ``elapsed`` more."""
    grain = smaller(grain_of(axis.x), grain_of(axis.x2))
    grain = smaller(grain, smaller(grain_of(axis.corner), grain_of(axis.corner_low)))
    if axis.turns != 0.0:
        grain = smaller(grain, grain_of(axis.period))
    if elapsed | count != 0:
        flown = float((elapsed | count) & -(elapsed | count)) * per_tick
        grain = smaller(grain, smaller(grain_of(axis.v), 0.5 * flown * grain_of(axis.a)) * flown)
    if count != 0:
        flown = float(count & -count) * per_tick
        grain = smaller(grain, smaller(grain_of(axis.v2), 0.5 * flown * grain_of(axis.a2)) * flown)
    return float(grain)
