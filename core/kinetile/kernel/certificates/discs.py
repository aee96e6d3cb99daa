"""The exact ticks of contact of two discs, and of parting, for two that pass through each other.

Ticks n >= 0 are counted from the later anchor, tau is the length of one, and Q(n) is |d|^2 - R^2 at tick n,
with d the separation (from an image, if one is given) and R the sum of the radii. Contact
(docs/specification.md, rule 5) is at the first n with Q(n + 1) < min(0, Q(n)): the first tick in which two
discs come deeper into each other. They part at the first n that satisfies this for -Q. If a tick ``since`` is
given, only ticks from it on count.

Let F1(n) be Q(n + 1) - Q(n), and o = ``since``, usually 0. For two discs that have just met, only ticks from
the first rise on count, the first n with F1(n) > 0. But if they *press* on each other, F1(o) <= 0 and
F1(o + 1) < F1(o), all ticks from o on count, as if they had not met. With equal accelerations no two discs
press, and none meet again: Q has degree 2, and is convex.

There are four stages. Each decides, or leaves the decision to the next:

* *A filter* (``filtered``), without accelerations. It refuses, or estimates the root and makes one Newton
  step from there, with q in compensated arithmetic and a bound of the error. If no whole tick is within the
  bound of the root, the root's floor is known. If a tick shortly before the root is known, the step begins
  there (``touch_about``), and serves for equal accelerations, too.
* *Whole ticks* (``at_whole_tick``), without accelerations. Q is convex, so Q(n) >= 0 > Q(n + 1) proves that n
  is the tick, and the estimate gives n. A sign is known beyond the error of Q, or is 0 by the grain of Q
  (``separation``): ties of lattices, and contacts at the anchor.
* *Intervals* (``closely``), with accelerations, or at a corner of a shape. Time is cut into intervals between
  whole ticks, so that n and n + 1 are in one. Bernstein coefficients in doubles show one of these: Q is above
  0 in the interval, or rises: then the next interval is longer; Q falls, and is negative at the end: then the
  contact is in it, and the signs of Q at whole ticks, in sums of two doubles, find the tick; none of these:
  then the interval is made shorter. If all derivatives are positive, no contact follows.
* *Whole numbers* (``discs_exactly``). Without accelerations (``straight_exactly``) they serve all ticks at
  once: one bisection finds the turn of Q. Else they serve the shortest possible interval: a graze, a vertex
  at which discs that overlap cease to move apart, sizes that doubles cannot square.

Accelerations are 0 or from 2^-200 to 2^200 in size, by ``scene.checks``. The bounds of separations, u, LARGE,
SMALL and TINY are in ``separation``.

Refusals
========

``along`` returns d.u. Compared with the exact B = D.U, each axis is off by 3 u m |ux| (low), u m |ux| (w),
and 2 u m |ux| (a product and the sum): 6 u m |ux|. **2^-50 = 8 u** covers it. d x u is ``along`` with (uy,
-ux), so the same bound holds. Hence ``bend > bend_error`` means B > 0, no contact; and ``bend < -bend_error``
means B < 0, an approach.

*They miss.* With k = D x U exact, |k| >= ``clear`` (1 - u). From above, R <= reach (1 + u) and |U|^2 <= (1 +
u)^2 |u|^2; reach^2 |u|^2 is rounded four times on its way to ``span2``, and the comparison has two more
roundings. So clear^2 > span2 (1 + c) implies k^2 >= R^2 |U|^2 if c > 12 u: **2^-48 = 32 u** does. k^2 >= R^2
|U|^2 means that q >= 0 at all times, tangency included: no contact.

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
gap, both_low, gap_low, the three products' errors (``squares``), and ``mixed``; let r = rr, z = xx + yy <= Z:

| rounded | its summands are at most | error, in u^2 |
|---|---|---|
| squares, 2 sums | u z, u r | 2 Z + r |
| mixed, 4 operations on each x_rest (2 x + x_rest), 3 on reach's | 10 u Z, 2 u r | 40 Z + 6 r |
| both_low + gap_low | u z, u (z + r) | 2 Z + r |
| + squares | 3 u z + 2 u r | 3 Z + 2 r |
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
sqrt(s^2 - K q)) / K. The code requires **s' > 8 e_s**: then s >= (7/8) s' > 0. It also requires
**curve < 1/8**, curve being K (|q'| + e) / s'^2: then b = K q / s^2 has |b| <= (8/7)^2 curve < 0.17. So there
are two roots, t is before the middle of them, and the first is

    h = q / 2s · g(b),  g(b) = 2 / (1 + sqrt(1 - b)),  |g(b) - 1| <= 0.28 |b|   for |b| < 0.17

This does not depend on the origin of t: the estimate need not be good, nor near the root. Against the step s0
= q' / 2s':

- |q/2s - s0| <= e / 2s + |s0| e_s / s <= 0.58 e / s' + 1.15 |s0| e_s / s';
- |h - q/2s| <= 0.28 |b| |q/2s| <= 0.37 curve (|s0| (1 + 1/7) + 0.58 e / s') <= 0.43 curve |s0| + 0.03 e / s';
- the computed step has two roundings, 2 u |s0|.

``bound`` is (e / s' + |step| (curve + 2 e_s / s' + **2^-49**)) P + **2^-50**: each of its terms exceeds the
error it stands for, by enough for its own roundings. The last, 8 u, is for the fraction: ``ticks`` less its
whole part is exact; adding the step loses u (1 + |step| P), subtracting the floor u, comparing u.

So the root lies within ``bound`` of base + part, and if no whole tick does, its floor is base + down. The
bend has shown that B < 0 at the anchor. If the floor is negative, the root is before the anchor, and the
anchor between the roots: q < 0 there, so they touch at once, at 0. From 2^62 on there is no contact.

*The tick.* The distance of the roots is more than 1.59 slope / speed^2, so more than a tick if slope >
speed^2 tau, and the vertex is later than 7/8 of that. So after a floor n of the first root Q(n + 1) < 0 <
Q(n), or, if the root is before 0, Q(1) < min(0, Q(0)): rule 5 holds there for the first time.

*From a bound* (``touch_about``) the step begins at a whole tick at or after the anchor, so t is exact: B
rises with time, by K a unit, so a slope that is surely down at t shows that B < 0 at the anchor.

*Parting* (``filtered_parting``) is the first contact if time is reversed: the slope is negated, and so is the
step; no other bound changes. A floor below 0 means that both roots are before the anchor: they do not overlap
and Q rises, so they part at 0.

With the image of a period (1') is 2 u^2 m more than (1): in (2) 24 u^2 M, in the square 48, in q 108 u^2 Z,
and 2^-98 = 256 u^2 is still twice the error bound of q.

Q at a whole tick, and on intervals
===================================

*Q at a tick* (``gap_after``): t + rest is exact. With B = |b|, b/2 t is off by 4 u^2 B t, the sum with u + w
by 12 u^2 S + 3 u^2 (S + B t / 2) more, times t by 8 u^2 (S + B t / 2) t more, and the sum with d + low by 16
u^2 m + 3 u^2 (m + (S + B t / 2) t) more: together less than 2^-101 X, X = m + (S + B t) t. The square of a
place x is off by 2 |x| 2^-101 X + 2^-202 X^2 + 8 u^2 x^2, the sums add 6 u^2 of the squares, and R^2 14 u^2
of itself: so **2^-98** (|x| + 2^-50 X) X for each axis and R^2 is twice as much as needed. Underflow is
negligible, since R is above SMALL and t below 2^10: it is off by less than 2^-1060 in a place, 2^-838 in Q,
and 2^-98 R^2 > 2^-498.

*A step with equal accelerations*. At t the separation is off by 16 u^2 m + 12 u^2 S t, and
``gap_at`` allows 9 u^2 of a ``size``: so it is **2** (m + S t). The slope is off by S 12 u^2 times the place,
half that size, more: 6 u^2 < **2^-102**. speed^2 may be off by 2^-60 of itself where S < **2^40** speed, for
which all bounds of ``newton`` have room.

*Coefficients* of Q by time: products of d, u and b, each known to u of itself and 16 u^2 m, 12 u^2 S or u^2 B
beyond. With 2^-40 m and 2^-40 S added to |d| and |u|, a product of these bounds has the second part in it:
the coefficients are off by 5 u of the bounds m1 to m4, and Q(0) by u of itself and its error, 8 u of m0 with
**2^50** of it. On an interval from lo to hi the terms of a Bernstein coefficient add up to at most M = m0 +
m1 hi + ... + m4 hi^4, since they are the terms of powers of lo + h. Each of them is rounded at most 16 times
on its way: with 8 u, 24 u M. **2^-48** = 32 u covers it. A difference of two has twice this error, a second
one four times. The derivatives at lo, times powers of h, consist of the same terms.

*Rises*, for two that have met: Q is larger at the end of an interval than at its beginning, by more than the
errors. So Q rises in the interval; and if Q is above 0 in it, or is convex, no contact follows in it then.

*Pressing*, for two that have met: with tau the length of a tick, F1(o) / tau is Q' + Q'' tau / 2, both at o,
except for Q''' tau^2 / 6 and later terms, and (F1(o + 1) - F1(o)) / tau^2 is Q'' except for Q''' tau and
later terms. With D1, D2 and D3 the sums of the bounds of the terms of Q', Q'' and Q''' at o + 2, the computed
Q' and Q'' are off by **2^-48** of D1 and D2, as coefficients are; and by TINY, for underflow. So F1(o) / tau
is off by 2^-48 (D1 + D2 tau) + D3 tau^2, the second difference by 2^-48 D2 + 2 D3 tau. F1(o) > 0 is the first
rise. A ``since`` that is no double is rounded down, by less than 1,024 ticks: the interval that begins there
is longer, ends after ``since``, and a property of Q shown in the whole of it holds from ``since`` on; a rise
might lie before ``since``, so two that have met are left to whole numbers.
"""

import math
from typing import NamedTuple

from kinetile.kernel.certificates.digits import LIMIT, as_count
from kinetile.kernel.certificates.discs_exactly import NO_FALL_YET, Window, rises_or_presses, touch_exactly
from kinetile.kernel.certificates.plans import Plans
from kinetile.kernel.certificates.separation import (
    LARGE,
    SMALL,
    TINY,
    ULP,
    Motion,
    Separation,
    along,
    grain_at,
    grain_of,
    motions,
    place_at,
    plus,
    separation_at,
    separations,
    time_of,
    times,
    total,
)
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import apart, hook, larger, smaller, subroutine
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error

Q_ROUNDING, SLOPE_ROUNDING, COEFFICIENT_ROUNDING = 2.0**-98, 2.0**-49, 2.0**-48
"""Bounds of rounding errors, relative to the sizes of the terms: of Q before its last sum ("q", "Q at a
tick"), of d.u ("The slope"), of Bernstein coefficients and derivatives ("Coefficients", "Pressing").
"""


@hook
def gap_at(
    t: float, along_x: Separation, along_y: Separation, reach: float, reach_low: float
) -> tuple[float, float, float, float]:
    """Returns q, the squared distance less the squared reach, at a time t after the later anchor; the bound
    of its error; minus half its rate, (d.v); and the bound of that error."""
    x, x_rest = separation_at(t, along_x)
    y, y_rest = separation_at(t, along_y)
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
    q_error = Q_ROUNDING * (spread + rr) + ULP * abs(q)
    slope_error = SLOPE_ROUNDING * (x_far * abs(along_x.u) + y_far * abs(along_y.u)) + TINY
    return q, q_error, -(x * along_x.u + y * along_y.u), slope_error


@hook
def newton(
    q: float, q_error: float, slope: float, slope_error: float, speed2: float, per_time: float
) -> tuple[float, float, float]:
    """Returns one Newton step from the results of ``gap_at``, in ticks; a bound of its distance to the root;
    and the bend of the path: the bound holds if this is below 1/8, and slope > 8 slope_error."""
    inverse = 1.0 / slope
    step = 0.5 * q * inverse
    curve = speed2 * (abs(q) + q_error) * (inverse * inverse)
    loose = curve + 2.0 * slope_error * inverse + 2.0**-49
    return step * per_time, (q_error * inverse + abs(step) * loose) * per_time + 2.0**-50, curve


OPEN = -1
"""The answer of a filter that doubles do not decide."""


@hook
def floor_of(ticks: float, step: float, bound: float) -> int:
    """Returns the floor of ``ticks + step``, 0 if it is less, ``NEVER`` from 2^62 on; ``OPEN`` if a whole
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
def about(x: Separation, y: Separation, reach: float) -> float:
    """Returns an estimate of the contact's time, in the unit of d / u."""
    cross = x.d * y.u - y.d * x.u
    inside = larger(reach * reach * (x.u * x.u + y.u * y.u) - cross * cross, 0.0)
    fall = math.sqrt(inside) - (x.d * x.u + y.d * y.u)
    return (x.d * x.d + y.d * y.d - reach * reach) / fall if fall > 0.0 else 0.0


@hook
def have_room(x: Separation, y: Separation, reach: float) -> bool:
    """Returns True if the bounds of a step hold: no number is too large, or too small."""
    speed = abs(x.u) + abs(y.u)
    return bool(speed > SMALL and speed < LARGE and reach > SMALL and reach + (x.size + y.size) < LARGE)


@hook
def one_step(
    t: float,
    ticks: float,
    x: Separation,
    y: Separation,
    reach: float,
    reach_low: float,
    sense: float,
    loose: float,
    per_time: float,
) -> tuple[int, float]:
    """Returns the tick of two discs' contact, or parting if ``sense`` is -1, by one Newton step from a time
    t, which is ``ticks``, or ``OPEN``; and the step in ticks. ``loose`` is added to the slope's error."""
    q, q_error, slope, slope_error = gap_at(t, x, y, reach, reach_low)
    slope *= sense
    slope_error += loose
    speed2 = x.u * x.u + y.u * y.u
    if slope > 8.0 * slope_error and slope * per_time > speed2:
        step, bound, curve = newton(q, q_error, slope, slope_error, speed2, per_time)
        if curve < 0.125 and bound < 0.5:
            return floor_of(ticks, sense * step, bound), sense * step
    return OPEN, 0.0


@hook
def filtered(x: Separation, y: Separation, radius: float, radius2: float, per_time: float) -> int:
    """Returns the tick of two discs' contact, by a separation and a relative velocity, or ``OPEN``."""
    reach, reach_low = plus(radius, radius2)
    if have_room(x, y, reach):
        bend, bend_error = along(x, x.u, y, y.u)
        if bend > bend_error:
            return NEVER
        cross, cross_error = along(x, y.u, y, -x.u)
        clear = abs(cross) - cross_error
        span2 = reach * reach * (x.u * x.u + y.u * y.u)
        if clear > 0.0 and clear * clear > span2 * (1.0 + 2.0**-48):
            return NEVER
        inside = span2 - cross * cross
        if inside > 0.0 and bend < -bend_error:
            t = larger((x.d * x.d + y.d * y.d - reach * reach) / (math.sqrt(inside) - bend), 0.0)
            if t * per_time < FAR:
                found, _ = one_step(t, t * per_time, x, y, reach, reach_low, 1.0, 0.0, per_time)
                return found
    return OPEN


@hook
def filtered_parting(
    x: Separation, y: Separation, radius: float, radius2: float, per_time: float
) -> tuple[int, float]:
    """Returns the tick of two discs' parting, by a separation and a relative velocity, or ``OPEN``; and an
    estimate of the time, right to a tick unless it is ``OPEN``."""
    reach, reach_low = plus(radius, radius2)
    speed2 = x.u * x.u + y.u * y.u
    t = 0.0
    if have_room(x, y, reach):
        bend = x.d * x.u + y.d * y.u
        cross = x.d * y.u - y.d * x.u
        root = math.sqrt(larger(reach * reach * speed2 - cross * cross, 0.0))
        if bend <= 0.0:
            t = (root - bend) / speed2
        elif root > 0.0:
            t = (reach * reach - (x.d * x.d + y.d * y.d)) / (root + bend)
        if root > 0.0 and abs(t * per_time) < FAR:
            found, step = one_step(t, t * per_time, x, y, reach, reach_low, -1.0, 0.0, per_time)
            return found, t + step / per_time
    return OPEN, t


@hook
def gap_after(
    x: Motion, y: Motion, reach: float, reach_low: float, count: int, per_tick: float
) -> tuple[float, float]:
    """Returns Q after a number of ticks, and a bound of its error."""
    t, rest = time_of(count, per_tick)
    ex, ex_low, x_size = place_at(x, t, rest)
    ey, ey_low, y_size = place_at(y, t, rest)
    xx, xx_low = times(ex, ex_low, ex, ex_low)
    yy, yy_low = times(ey, ey_low, ey, ey_low)
    rr, rr_low = times(reach, reach_low, reach, reach_low)
    both, both_low = total(xx, xx_low, yy, yy_low)
    q, _ = total(both, both_low, -rr, -rr_low)
    spread = (abs(ex) + 2.0**-50 * x_size) * x_size + (abs(ey) + 2.0**-50 * y_size) * y_size
    return q, Q_ROUNDING * (spread + rr)


UNSURE = 2
"""The value of ``sign_at`` if sums of two doubles do not decide."""


@hook
def sign_at(x: Motion, y: Motion, plans: Plans, radius: float, radius2: float, count: int) -> int:
    """Returns the sign of Q after a number of ticks, or ``UNSURE``."""
    reach, reach_low = plus(radius, radius2)
    q, error = gap_after(x, y, reach, reach_low, count, plans.per_tick)
    if abs(q) > error:
        return 1 if q > 0.0 else -1
    grain = smaller(grain_of(radius), grain_of(radius2))
    for axis in (plans.x, plans.y):
        grain = smaller(grain, grain_at(axis, plans.elapsed, count, plans.per_tick))
    return 0 if abs(q) + error < grain * grain else UNSURE


@subroutine
def at_whole_tick(plans: Plans, radius: float, radius2: float, sense: int, guess: int) -> int:
    """Returns the tick of rule 5 for Q, or for -Q if ``sense`` is -1, if it is near a guess, or ``OPEN``: n
    is the tick if ``sense`` Q(n) >= 0 > ``sense`` Q(n + 1), Q being convex."""
    x, y = motions(plans)
    sizes = radius + radius2 + (x.size + y.size)
    if not (radius + radius2 > SMALL and sizes < LARGE and x.speed + y.speed < LARGE):
        return OPEN
    here = sign_at(x, y, plans, radius, radius2, guess)
    if here == UNSURE or (here * sense < 0 and guess == 0):
        return OPEN
    first = guess - 1 if here * sense < 0 else guess
    other = sign_at(x, y, plans, radius, radius2, first if first < guess else guess + 1)
    fits = other * sense >= 0 if first < guess else other * sense < 0
    if other == UNSURE or not fits:
        return OPEN
    return first if first < LIMIT else NEVER


MOST_INTERVALS = 120
"""Intervals before whole numbers take over; some three are enough."""


class Quartic(NamedTuple):
    """Q, or -Q, after a time, by its coefficients; or bounds of the sizes of their terms."""

    c0: float
    c1: float
    c2: float
    c3: float
    c4: float


@hook
def value_at(q: Quartic, t: float) -> float:
    """Returns a quartic at a time."""
    return (((q.c4 * t + q.c3) * t + q.c2) * t + q.c1) * t + q.c0


@hook
def slope_at(q: Quartic, t: float) -> float:
    """Returns the derivative of a quartic at a time."""
    return ((4.0 * q.c4 * t + 3.0 * q.c3) * t + 2.0 * q.c2) * t + q.c1


@hook
def bend_at(q: Quartic, t: float) -> float:
    """Returns half the second derivative of a quartic at a time."""
    return (6.0 * q.c4 * t + 3.0 * q.c3) * t + q.c2


@hook
def gap_of(
    x: Motion, y: Motion, reach: float, reach_low: float, sense: float, per_tick: float
) -> tuple[Quartic, Quartic]:
    """Returns Q times ``sense``, 1 or -1, and the sizes."""
    q, q_error = gap_after(x, y, reach, reach_low, 0, per_tick)
    c1 = 2.0 * sense * (x.d * x.u + y.d * y.u)
    c2 = sense * ((x.u * x.u + y.u * y.u) + (x.d * x.b + y.d * y.b))
    c4 = 0.25 * sense * (x.b * x.b + y.b * y.b)
    gap = Quartic(sense * q, c1, c2, sense * (x.u * x.b + y.u * y.b), c4)
    xd = abs(x.d) + 2.0**-40 * x.size
    yd = abs(y.d) + 2.0**-40 * y.size
    xu = abs(x.u) + 2.0**-40 * x.speed
    yu = abs(y.u) + 2.0**-40 * y.speed
    m1 = 2.0 * (xd * xu + yd * yu)
    m2 = (xu * xu + yu * yu) + (xd * abs(x.b) + yd * abs(y.b))
    return gap, Quartic(abs(q) + 2.0**50 * q_error, m1, m2, xu * abs(x.b) + yu * abs(y.b), abs(c4))


@hook
def has_risen(q: Quartic, m: Quartic, t: float, per_tick: float) -> tuple[bool, bool]:
    """Returns True if two that have just met rise in the tick from a time on, or press on each other; and
    True if that is sure. (F1 of the head, and F2, the change of F1 in a tick, each by ticks.)"""
    end = t + 2.0 * per_tick
    f2 = 2.0 * bend_at(q, t)
    f1 = slope_at(q, t) + 0.5 * per_tick * f2
    m2 = 2.0 * bend_at(m, end)
    m3 = per_tick * (24.0 * m.c4 * end + 6.0 * m.c3)
    f1_error = COEFFICIENT_ROUNDING * (slope_at(m, end) + per_tick * m2) + per_tick * m3 + TINY
    f2_error = COEFFICIENT_ROUNDING * m2 + 2.0 * m3 + TINY
    risen = f1 > f1_error or f2 < -f2_error
    return risen, risen or f2 > f2_error


@hook
def first_span(
    q: Quartic, m: Quartic, low: float, since: int, about: int, per_tick: float, per_time: float
) -> float:
    """Returns about the number of ticks after ``low`` until they touch, or fewer: the first interval."""
    if about > since:
        return float(about - since)
    if since > 0:
        t = low * per_tick
        rate = abs(slope_at(q, t))
        bend = bend_at(m, t)
        gap = abs(value_at(q, t))
        span = 2.0**-12 * low
        if bend > 0.0:
            t = 1.5 * gap / (rate + math.sqrt(gap * bend) + TINY) + 0.3 * rate / bend
            span = larger(span, smaller(t, FAR * per_tick) * per_time)
        return float(span)
    rate = abs(q.c1) + math.sqrt(m.c0 * m.c2)
    return float(smaller(1.5 * m.c0 / rate, FAR * per_tick) * per_time) if rate > 0.0 else FAR


class Interval(NamedTuple):
    """Q in an interval, whose length is the unit of time: ``p`` by powers of the time since its begin; and
    its Bernstein coefficients, p0 and ``b``, which Q lies between in the interval (Farouki, Computer Aided
    Geometric Design 29, 2012), with their differences ``g``, the same for its slope. All are right to
    ``error``."""

    p: Quartic
    b1: float
    b2: float
    b3: float
    b4: float
    g0: float
    g1: float
    g2: float
    g3: float
    error: float


@hook
def piece_of(q: Quartic, m: Quartic, lo: float, hi: float) -> Interval:
    """Returns Q from a time to another one."""
    h = hi - lo
    p0 = value_at(q, lo)
    p1 = slope_at(q, lo) * h
    p2 = bend_at(q, lo) * h * h
    p3 = (4.0 * q.c4 * lo + q.c3) * h * h * h
    p4 = q.c4 * h * h * h * h
    b1 = p0 + 0.25 * p1
    b2 = p0 + (0.5 * p1 + p2 / 6.0)
    b3 = p0 + (0.75 * p1 + 0.5 * p2 + 0.25 * p3)
    b4 = p0 + (p1 + p2 + p3 + p4)
    error = COEFFICIENT_ROUNDING * value_at(m, hi)
    return Interval(Quartic(p0, p1, p2, p3, p4), b1, b2, b3, b4, b1 - p0, b2 - b1, b3 - b2, b4 - b3, error)


@hook
def root_of(piece: Interval) -> tuple[float, float]:
    """Returns the place (0 to 1) of the root of Q in an interval where Q falls below 0, and the slope."""
    s = piece.p.c0 / (piece.p.c0 - piece.b4)
    slope = 0.0
    for _ in range(20):
        s = smaller(larger(s, 0.0), 1.0)
        slope = slope_at(piece.p, s)
        step = value_at(piece.p, s) / slope
        s -= step
        if abs(step) < 2.0**-25:  # its square is below a rounding
            break
    return smaller(larger(s, 0.0), 1.0), slope


@subroutine
def tick_in_fall(
    plans: Plans,
    radius: float,
    radius2: float,
    sense: int,
    piece: Interval,
    before: int,
    low: float,
    high: float,
) -> int:
    """Returns the tick of rule 5, Q falling from ``low`` to ``high`` ticks to below 0; by signs at whole
    ticks: Q >= 0 at ``before``, or the caller needs no earlier tick, and Q < 0 at ``after``."""
    x, y = motions(plans)
    reach, reach_low = plus(radius, radius2)
    after = int(high)
    s, slope = root_of(piece)
    count = int(low) + int(s * (high - low))
    per = (high - low) / slope
    for _ in range(8):
        if after - before <= 1:
            return before
        count = smaller(larger(count, before + 1), after - 1)
        q, q_error = gap_after(x, y, reach, reach_low, count, plans.per_tick)
        q *= float(sense)
        if q > q_error:
            before = count
        elif q < -q_error:
            after = count
        else:
            break
        move = int(math.floor(smaller(larger(-q * per, low - high), high - low)))
        count += move if move != 0 else 1
    return int(touch_exactly(plans, radius, radius2, sense, Window(before, after, 0, True), count))


@apart
def closely(plans: Plans, radius: float, radius2: float, sense: int, met: int, about: int, since: int) -> int:
    """Returns the first tick, from ``since`` on, at which rule 5 holds for Q, or for -Q if ``sense`` is -1.

    Before each interval: rule 5 holds at no tick from ``since`` to ``low``; and ``risen`` says whether ticks
    from ``low`` on count: for two that have met, whether Q has risen in a tick, or they press.
    """
    if since >= LIMIT:
        return NEVER
    x, y = motions(plans)
    reach, reach_low = plus(radius, radius2)
    per_tick = plans.per_tick
    low = float(since)
    sizes = reach + (x.size + y.size)
    speeds = (x.speed + y.speed) + (abs(x.b) + abs(y.b))
    steps = MOST_INTERVALS if reach > SMALL and sizes < LARGE and speeds < LARGE else 0
    if int(low) != since:  # rounded: begin before it
        low = float((since >> 10) << 10)
        steps = 0 if met else steps
    q, m = gap_of(x, y, reach, reach_low, float(sense), per_tick)
    even = (x.b == 0.0) & (y.b == 0.0)
    risen = True
    if met:
        risen, sure = has_risen(q, m, low * per_tick, per_tick)
        if not (steps > 0 and sure):
            risen = rises_or_presses(plans, radius, radius2, since)
    span = first_span(q, m, low, since, about, per_tick, plans.per_time)
    for _ in range(steps):
        span = math.floor(smaller(larger(span, 1.0 + 2.0**-40 * low), FAR))
        high = smaller(low + span, FAR)
        a = piece_of(q, m, low * per_tick, high * per_tick)
        e = a.error
        if (sense > 0) & (a.p.c1 > e) & (a.p.c2 > e) & (even | (a.p.c3 > e)):
            return NEVER  # all derivatives are positive
        slack = 2.0 * e
        falls = (a.g0 < -slack) & (a.g1 < -slack) & (a.g2 < -slack) & (a.g3 < -slack)
        if falls & (a.b4 < -e) & risen:  # the contact is here
            before = int(larger(int(low), since))
            if a.p.c0 < -e:
                return before
            return int(tick_in_fall(plans, radius, radius2, sense, a, before, low, high))
        rises = (a.g0 > slack) & (a.g1 > slack) & (a.g2 > slack) & (a.g3 > slack)
        above = (a.p.c0 > e) & (a.b1 > e) & (a.b2 > e) & (a.b3 > e) & (a.b4 > e)
        climbs = a.b4 - a.p.c0 > slack  # so it rises somewhere
        sags = (a.g1 - a.g0 > 2.0 * slack) & (a.g2 - a.g1 > 2.0 * slack) & (a.g3 - a.g2 > 2.0 * slack)
        if rises | (above & (risen | climbs)) | (not risen and (falls | (sags & climbs))):  # nothing is here
            if high >= FAR:
                return NEVER
            risen = risen | climbs
            low = high
            grow = 8.0
            if a.g3 < 0.0:  # up to where the tangent is 0, and .6 of that more
                grow = smaller(larger(-0.4 * a.b4 / a.g3, 0.1), 8.0) if a.b4 > 0.0 else 2.0
            span *= grow
            continue
        below = (a.p.c0 < -e) & (a.b1 < -e) & (a.b2 < -e) & (a.b3 < -e) & (a.b4 < -e)
        turns = below & risen & (a.g0 > slack) & (a.g3 < -slack)
        if not (turns | (span < larger(2.0**-22 * high, 4096.0))):
            span *= 0.3  # a shorter one
            continue
        window = Window(larger(int(low), since), int(high), 3, risen)
        found = touch_exactly(plans, radius, radius2, sense, window, -1)
        if found >= 0 or high >= FAR:
            return found if found >= 0 else NEVER
        risen = found != NO_FALL_YET
        low = high
        span *= 8.0
    window = Window(larger(int(low), since), LIMIT, 3, risen)
    found = touch_exactly(plans, radius, radius2, sense, window, -1)
    return found if found >= 0 else NEVER


@hook
def have_one_velocity(plans: Plans) -> bool:
    """Returns True if two bodies without accelerations do not move as seen from each other."""
    return plans.x.v == plans.x.v2 and plans.y.v == plans.y.v2


@hook
def have_one_acceleration(plans: Plans) -> bool:
    """Returns True if two bodies are accelerated alike, or not at all."""
    return plans.x.a == plans.x.a2 and plans.y.a == plans.y.a2


@hook
def is_accelerated(plans: Plans) -> bool:
    """Returns True if one of two bodies is accelerated."""
    x = plans.x
    y = plans.y
    return x.a != 0.0 or x.a2 != 0.0 or y.a != 0.0 or y.a2 != 0.0


@subroutine
def straight_exactly(plans: Plans, radius: float, radius2: float, sense: int, guess: int, since: int) -> int:
    """Returns the same as ``closely``, without accelerations."""
    if since >= LIMIT:
        return NEVER
    found = touch_exactly(plans, radius, radius2, sense, Window(since, LIMIT, 1, True), guess)
    return found if found >= 0 else NEVER


@apart
def straight_touch(plans: Plans, radius: float, radius2: float, since: int) -> int:
    """Returns the same as ``touch`` for two that have not just met, without accelerations."""
    if have_one_velocity(plans):
        return NEVER
    x, y = separations(plans)
    found = filtered(x, y, radius, radius2, plans.per_time)
    guess = -1
    if found == OPEN:
        guess = as_count(about(x, y, radius + radius2) * plans.per_time + 0.5)
        found = at_whole_tick(plans, radius, radius2, 1, guess)
    return found if found >= since else straight_exactly(plans, radius, radius2, 1, guess, since)


@apart
def touch(plans: Plans, radius: float, radius2: float, met: int, about_then: int, since: int) -> int:
    """Returns the ticks after the later anchor until two discs touch, from ``since`` on, or ``NEVER``.

    ``met`` is 1 if they have just met. ``about_then``: a lower bound shortly before, or -1; the answer is the
    same.
    """
    if met > 0 and have_one_acceleration(plans):
        return NEVER
    if not is_accelerated(plans):
        return int(straight_touch(plans, radius, radius2, since))
    return int(closely(plans, radius, radius2, 1, met, about_then, since))


@apart
def parting(plans: Plans, radius: float, radius2: float, since: int) -> int:
    """Returns the ticks after the later anchor until two discs part, from ``since`` on, or ``NEVER``."""
    if not is_accelerated(plans):
        if have_one_velocity(plans):
            return NEVER
        x, y = separations(plans)
        found, t = filtered_parting(x, y, radius, radius2, plans.per_time)
        guess = as_count(t * plans.per_time + 0.5)
        if found == OPEN:
            found = at_whole_tick(plans, radius, radius2, -1, guess)
        return found if found >= since else straight_exactly(plans, radius, radius2, -1, guess, since)
    return int(closely(plans, radius, radius2, -1, 0, 0, since))


@hook
def touch_about(plans: Plans, radius: float, radius2: float, guess: int) -> int:
    """Returns the same as ``touch``, without accelerations, for two that have not just met: by one step from
    a guess, in ticks after the later anchor. A guess below 0 means no guess: then, or if the step does not
    decide, ``touch`` is called."""
    x, y = separations(plans)
    reach, reach_low = plus(radius, radius2)
    if guess >= 0 and have_room(x, y, reach):
        ticks = float(guess)
        found, _ = one_step(ticks * plans.per_tick, ticks, x, y, reach, reach_low, 1.0, 0.0, plans.per_time)
        if found != OPEN:
            return found
    return int(straight_touch(plans, radius, radius2, 0))


@hook
def accelerated_touch_about(
    plans: Plans, radius: float, radius2: float, met: int, guess: int, since: int
) -> int:
    """Returns the same as ``touch``: at once for two with equal accelerations that have just met, and with a
    guess, if they do not touch before ``since`` by it, by one step."""
    x, y = motions(plans)
    if x.b == 0.0 and y.b == 0.0:
        if met > 0:
            return NEVER
        if guess >= 0:
            ticks = float(guess)
            t = ticks * plans.per_tick
            along_x = Separation(x.d, x.low, 2.0 * (x.size + x.speed * t), x.u, x.w)
            along_y = Separation(y.d, y.low, 2.0 * (y.size + y.speed * t), y.u, y.w)
            reach, reach_low = plus(radius, radius2)
            speeds = x.speed + y.speed
            if speeds < 2.0**40 * (abs(x.u) + abs(y.u)) and have_room(along_x, along_y, reach):
                loose = 2.0**-102 * (along_x.size * x.speed + along_y.size * y.speed)
                found, _ = one_step(t, ticks, along_x, along_y, reach, reach_low, 1.0, loose, plans.per_time)
                if found >= since:  # not OPEN
                    return found
    return int(closely(plans, radius, radius2, 1, met, guess, since))
