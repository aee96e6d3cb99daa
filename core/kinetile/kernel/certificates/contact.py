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
* *one Newton step* from there, q in compensated arithmetic, with a bound of its error. Where no whole tick
  lies within that of the root, the floor is known; and a slope that is surely downward, with a curvature that
  is small against it, shows that there is a root, and that it is the first.

``look_closer`` takes what that leaves open: ties of lattices, grazes, contacts at the anchor. The rest goes
to ``integers``, and so do sizes that doubles cannot square, without an estimate.

``last_touch`` is the other root::

    q(s) > 0 and B(s) >= 0    s: they are apart, and do not approach
    q >= 0 at all times       s: they miss each other, or are tangent
    v = 0                     never: they overlap, and keep doing so
    else                      s + floor(last root of q); never from s + 2^62 on

Error bounds
============

u is 2^-53, and fl(z) is z rounded: |fl(z) - z| <= u |z|, and also <= u |fl(z)|. Sums never underflow. Terms
of order u times a bound are left out of the bound: they are below 2^-48 of it, and no constant is that close.
P is ``per_time``, ticks in a unit of time; a tick is a power of two, at most 2^-52, so multiplying by it or
by P is exact. ``plus`` gives the rounded sum and what was lost, exactly (Knuth, *Seminumerical Algorithms*,
4.2.2); ``product_error`` what a product lost (a fused multiply-add, or Dekker, Numerische Mathematik 18,
1971). Filters in front of exact arithmetic: Shewchuk, Discrete & Computational Geometry 18 (1997).
``tests/core/kernel/certificates/test_claims.py`` compares the bounds with fractions.

Sizes
=====

The filters work where the sum of the radii and the relative speed are above SMALL = 2^-200, and they and all
lengths below LARGE = 2^200. A prediction reaches 2^62 ticks, at most 2^10 units of time, so |u_x t| < 2^211
and no coordinate is above 2^212. Then nothing overflows: the largest products are slope^2 and speed^2 q,
below 2^850. And R^2 |u|^2 >= 2^-801 is a normal number. What is not finite fails every comparison.

*Underflow.* A product that underflows is off by 2^-1075, ``product_error`` by at most 2^-1073; so a place by
less than 2^-1071, and a product of a place with a speed by less than 2^-870. **TINY = 2^-500** is in every
bound of such products: so large that a slope that passes, above 8 TINY, has a normal square. In q the
positions' underflow comes to 2^-1069 |x|, negligible against 2^-98 (x_far |x| + R^2), R^2 being at least
2^-400. ``kept`` asks for products above TINY, because below 2^-968 a product's error may be no double.

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

In the place of (1) that is 2 u^2 m more: in (2) 24 u^2 M, in the square 48, in q 108 u^2 Z, and 2^-98 = 256
u^2 is still twice what q can be off by. *Sizes*: a period is above the sum of two radii, so above SMALL, and
m has it: below LARGE, no product overflows, and an error of n P does not underflow.

Refusals
========

``along`` returns d.u. Against the exact D.U each axis is off by 3 u m |ux| (low), u m |ux| (w), and 2 u m
|ux| (a product and the sum): 6 u m |ux|. **2^-50 = 8 u** covers it. d x u is ``along`` with (uy, -ux), so the
same bound holds. Hence ``bend > bend_error`` is B > 0, never; and ``bend < -bend_error`` is B < 0, an
approach.

*They miss.* With k = D x U exact, |k| >= ``clear`` (1 - u). From above, R <= reach (1 + u) and |U|^2 <= (1 +
u)^2 |u|^2; reach^2 |u|^2 is rounded four times on its way to ``span2``, the comparison has two roundings
more. So clear^2 > span2 (1 + c) implies k^2 >= R^2 |U|^2 if c > 12 u: **2^-48 = 32 u** does. k^2 >= R^2 |U|^2
says that q >= 0 at all times, tangency included: never.

q and the slope at a time (gap_at)
==================================

The exact separation at t is X = D + U t; the code has x, the rounded dx + px, and ``x_rest``. Let M = m + |x|
(``x_far``); |px| <= |x| + m. What makes up x_rest is at most u |x| (the sum), u |px| (the product), 3 u m
(low), u |px| (w t): |x_rest| <= u (3 |x| + 5 m) <= 5 u M. Its roundings are u^2 |px| for w t, u^2 (3 m +
|px|) and u^2 (3 m + 2 |px|) for two sums, u^2 (3 m + 2 |px| + |x|) for the last: u^2 (15 m + 7 |x|). With
(1):

    |X - (x + x_rest)| <= 22 u^2 M                                                                       (2)

*q.* By (2), (x + x_rest)^2 is off by 2 (|x| + 5 u M) 22 u^2 M <= 44 u^2 M (|x| + 8 u M), that is 44 u^2 times
the axis's part in ``spread``, Z: this is why ``spread`` has **2^-50 = 8 u** in it. The rest is the sum of
gap, both_low, gap_low, the three products' errors (``squares``), and ``mixed``; let r = rr, s = xx + yy <= Z:

| rounded | its summands are at most | error, in u^2 |
|---|---|---|
| squares, 2 sums | u s, u r | 2 Z + r |
| mixed, 4 operations on each x_rest (2 x + x_rest), 3 on reach's | 10 u Z, 2 u r | 40 Z + 6 r |
| both_low + gap_low | u s, u (s + r) | 2 Z + r |
| + squares | 3 u s + 2 u r | 3 Z + 2 r |
| + mixed | 13 u Z + 4 u r | 13 Z + 4 r |

Together with 44 Z: 104 u^2 Z + 14 u^2 r. The last sum is q, and loses u |q|. So |error of q| <= 128 u^2 (Z +
r) + u |q|, and the code takes **2^-98**, twice that.

*The slope*, -X.U, is computed as -(x ux + y uy). An axis leaves out x_rest, 5 u m |ux| + 3 u |x| |ux|, and w,
u |x| |ux|; two roundings are 2 u |x| |ux|: together at most 6 u M |ux|. ``slope_error`` has **2^-49 = 16 u**,
and TINY.

One Newton step (newton)
========================

At any t let q, s be the exact squared gap and slope, q', s' the computed ones, e and e_s their bounds, K =
|U|^2. As a function of h, the time after t, the squared gap is q - 2 s h + K h^2, with the roots (s -+
sqrt(s^2 - K q)) / K. The code asks for **s' > 8 e_s**: then s >= (7/8) s' > 0. And for **bent < 1/8**, bent
being K (|q'| + e) / s'^2: then b = K q / s^2 has |b| <= (8/7)^2 bent < 0.17. So there are two roots, t is
before the middle of them, and the first is

    h = q / 2s · g(b),  g(b) = 2 / (1 + sqrt(1 - b)),  |g(b) - 1| <= 0.28 |b|   for |b| < 0.17

This does not depend on the origin of t: the estimate need not be good, nor near the root. Against the step s0
= q' / 2s':

- |q/2s - s0| <= e / 2s + |s0| e_s / s <= 0.58 e / s' + 1.15 |s0| e_s / s';
- |h - q/2s| <= 0.28 |b| |q/2s| <= 0.37 bent (|s0| (1 + 1/7) + 0.58 e / s') <= 0.43 bent |s0| + 0.03 e / s';
- the computed step has two roundings, 2 u |s0|.

``bound`` is (e / s' + |step| (bent + 2 e_s / s' + **2^-49**)) P + **2^-50**: each of its terms is more than
what it stands for, by enough for its own roundings. The last, 8 u, is for the fraction: ``ticks`` less its
whole part is exact; adding the step loses u (1 + |step| P), taking the floor away u, comparing u.

So the root lies within ``bound`` of base + part, and if no whole tick does, its floor is base + down. The
bend has shown that B < 0 at the anchor. If the floor is negative, the root is before the anchor, and the
anchor between the roots: q < 0 there, they touch at once, 0. From 2^62 on it is never.

*From a bound* (``touch_about``) the step begins at a whole tick at or after the anchor, so t is exact: B
rises with time, by K a unit, so a slope surely down at t says that B < 0 at the anchor.

*The last root* (``left``) is the first if time is turned round: the slope is negated, and so is the step; no
other bound changes. A floor below 0 says that both roots are before the anchor: they are apart, 0.

A closer look
=============

More steps follow from the estimate, each at a whole tick K, so t is exact. With ``known``, the sign of q is
beyond its error, or exact. Approach has been shown, by ``along`` or exactly.

- q(0) <= 0: 0. And q(K) >= 0 with a slope surely down at K = 2^62: the first root is there or later, or
  nowhere: never.
- The step is now q' / (s' + sqrt(s'^2 - K q')), the root itself. Its derivatives by q, s, K are 1, -2h, h^2,
  over 2 sqrt(s^2 - K q), which is at least 1.6 s' where bent < 1/8 and s' > 8 e_s. So it is off by 0.63 e /
  s', by 1.5 |step| e_s / s' + 0.11 e / s', by u |step| for K, and has 4 u |step| of rounding: ``bound``, the
  same, covers all of that; ``bent`` in it is not needed. The fraction is as above.
- With a bound below 1/4, and |part| < 1/2, the root is within 3/4 tick of K: q(K) >= 0 says that its floor is
  K, q(K) < 0 that it is K - 1.
- *Exact.* If every sum and product from the plans to d and u lost nothing (``is_whole``), and those from d,
  u, t to the squares too, as on a lattice in small dyadic numbers, then the last difference is rounded, but
  its sign is right, also when it is 0: that settles ties. Its rounding, u |q|, is in 2^-49.

A step that decides nothing moves K; after eight of them, or if the sign of a slope is not certain, integers
decide, from the last K.
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
    """Return how long the first body has flown at the later anchor, rounded, and what rounding took off."""
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
    """Return a separation a time t after the later anchor, rounded, and nearly what rounding took off."""
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
    exact = kept(axis.v, time, flown) and (rest == 0.0 or axis.v == 0.0)
    exact = exact and kept(axis.turns, axis.period, moved) and whole_sum(axis.x2, -axis.x)
    return exact and whole_sum(far, moved) and whole_sum(far + moved, -flown) and whole_sum(axis.v2, -axis.v)


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
        time, rest = flown_for(plans)
        lossless = is_whole(plans.x, time, rest) and is_whole(plans.y, time, rest)
        lossless = lossless and reach_low == 0.0 and kept(reach, reach, reach * reach)
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
    return found if found != OPEN else look_closer(plans, radius, radius2)


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
    """Return how many whole ticks after the later anchor overlapping discs part, exactly, or ``NEVER``."""
    x, y = separations(plans)
    found, t = left(x, y, radius, radius2, plans.per_time)
    if found != OPEN:
        return found
    return touch_of_integers(plans, radius, radius2, as_count(t * plans.per_time), True)
