"""When two accelerated discs touch or part, and when one reaches a wall: the exact ticks.

Ticks n >= 0 are counted from the later anchor, q is the length of one, and Q(n) is |d|^2 - R^2 at tick n,
with d the separation, of an image where one is meant, and R the sum of the radii; or the gap to a wall.
**Rule W**: the contact is at the first n with Q(n + 1) < min(0, Q(n)), the first tick in which two come to be
deeper in each other. They part where rule W holds of -Q. Where a tick ``since`` is given, only those from it
on count, in all that is said here.

Let F1(n) be Q(n + 1) - Q(n), and s = ``since``, usually 0. Of two that have just met only ticks from the
first rise on count, the first n with F1(n) > 0; unless they *press* on each other, F1(s) <= 0 and F1(s + 1) <
F1(s): then all from s on do, as if they had not met. With equal accelerations none press, and none meet
again.

Q has degree 4, and three stages:

* On *straight* ways (equal accelerations), with a tick known that is shortly before, it is one Newton step of
  ``contact``, whose bounds hold with a wider ``size``. After a first root within ``bound`` of the step rule W
  needs Q(n + 1) < 0, or, where the root is before 0, a vertex after tick 1/2: both roots are farther apart
  than 1.59 slope / speed^2, and the vertex is later than 7/8 of it, so slope > speed^2 q suffices.
* ``bent_closely`` goes through time by *intervals* between whole ticks, so that n and n + 1 are in one. In
  doubles, by Bernstein coefficients, it shows that Q is above 0 in one, or rises: then the next is longer; or
  falls, and is negative at its end: then the contact is there, and the signs of Q at whole ticks, in sums of
  two doubles, find it; or none of these: then it is made shorter. If all derivatives are positive nothing
  comes.
* What doubles leave open is decided by ``bent_integers``, for as short an interval as possible: a tie at a
  tick, a graze, a vertex at which discs that overlap cease to move apart.

Accelerations are 0 or from 2^-200 to 2^200 in size, as ``scene.checks`` has them. Numbers that have no room
in ``bent_integers`` have no contact.

Error bounds
============

u, LARGE, SMALL, TINY and ``plus`` are those of ``contact``, and small terms are left out as there. ``times``
and ``total`` are off by 8 u^2 of the product and by 3 u^2 of the sum of the sizes: each has three roundings
of terms of size 2 u, and ``times`` leaves out one of u^2.

*Ways.* With te the time since the first anchor, g the periods of an image, S = |v| + |v2| + |a| te
(``speed``) and m = |x| + |x2| + |g| + (|v| + |a| te) te (``size``): a te is off by 8 u^2 |a| te, u + w by 3
u^2 (|v| + |v2| + |a| te) more, so by 12 u^2 S; the first body's flight by (3 (|v| + |a| te / 2) + 4 |a| te +
8 (|v| + |a| te / 2)) u^2 te. g is exact, as ``turns`` is whole, below 2^32; x2 - x + g is off by 3 u^2 (|x| +
|x2| + |g|), and d + low, which is that less the flight, by 16 u^2 m; by 19 where a corner is taken off as
well, which is part of m, and ``stepped`` is not asked. b + c is exact, so b is 0 if and only if
the accelerations are equal.

*Q at a tick* (``gap_after``): t + rest is exact. With B = |b|, b/2 t is off by 4 u^2 B t, the sum with u + w
by 12 u^2 S + 3 u^2 (S + B t / 2) more, times t by 8 u^2 (S + B t / 2) t more, and the sum with d + low by 16
u^2 m + 3 u^2 (m + (S + B t / 2) t) more: together less than 2^-101 X, X = m + (S + B t) t. The square of a
place x is off by 2 |x| 2^-101 X + 2^-202 X^2 + 8 u^2 x^2, the sums add 6 u^2 of the squares, and R^2 14 u^2
of itself: so **2^-98** (|x| + 2^-50 X) X for each axis and R^2 is twice as much as needed. Underflow is
negligible, since R is above SMALL and t below 2^10: it is off by less than 2^-1060 in a place, 2^-838 in Q,
and 2^-98 R^2 > 2^-498.

*A step on straight ways* (``stepped``). At t the separation is off by 16 u^2 m + 12 u^2 S t, and ``contact``
allows 9 u^2 of a ``size``: so it is **2** (m + S t). The slope is off by S 12 u^2 times the place, half that
size, more: 6 u^2 < **2^-102**. speed^2 may be off by 2^-60 of itself where S < **2^40** speed, for which all
bounds of ``newton`` have room.

*Coefficients* of Q by time: products of d, u and b, each known to u of itself and 16 u^2 m, 12 u^2 S or u^2 B
beyond. With 2^-40 m and 2^-40 S added to |d| and |u|, a product of these bounds has the second part in it:
the coefficients are off by 5 u of the bounds m1 to m4, and Q(0) by u of itself and its error, 8 u of m0 with
**2^50** of it. On an interval from lo to hi all that makes up a Bernstein coefficient is at most M = m0 + m1
hi + ... + m4 hi^4, since the terms are those of powers of lo + h. Of these each is rounded at most 16 times
on its way: with 8 u, 24 u M. **2^-48** = 32 u covers it. A difference of two has twice that, a second one
four times. The derivatives at lo, times powers of h, consist of the same terms.

*Where it has risen*, of two that have met: Q is larger at the end of an interval than at its beginning, by
more than the errors. So there is a rise in it; and if Q is above 0 in it, or is convex, nothing comes after
that in the interval.

*Whether two press*, that have met: with q the length of a tick, F1(s) / q is Q' + Q'' q / 2, both at s, but
for Q''' q^2 / 6 and later terms, and (F1(s + 1) - F1(s)) / q^2 is Q'' but for Q''' q and later terms. With
D1, D2 and D3 the sums of the bounds of the terms of Q', Q'' and Q''' at s + 2, the computed Q' and Q'' are
off by **2^-48** of D1 and D2, as coefficients are; and by TINY, for underflow. So F1(s) / q is off by 2^-48
(D1 + D2 q) + D3 q^2, the second difference by 2^-48 D2 + 2 D3 q. F1(s) > 0 is the first rise. A ``since``
that is no double is rounded down, by less than 1,024 ticks: the interval that begins there is longer, ends
after it, and what is shown of Q in the whole of it is true from ``since`` on; a rise might lie before, so two
that have met are left to whole numbers.

*Walls.* The gap is a place like one along an axis, its velocity exact, its size |far| + |near| + |radius|:
off by 2^-101 X, and **2^-100** is allowed. In a tick that ends at t it widens by slope + pull (t - q / 2) a
unit of time, with roundings of 5 u of |slope| + |pull| t: **2^-50**. With pull <= 0 rule W holds from its
first tick on, and with pull > 0 the gap falls up to there: so a tick at which it holds, after one at which it
does not, is the first. The discriminant says only that there is no root, with **2^-45** of its terms.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kinetile.kernel.certificates.bent_integers import (
    NONE_YET,
    Window,
    gap_sign_by_integers,
    rises_or_presses,
    touch_by_integers,
    wall_by_integers,
)
from kinetile.kernel.certificates.contact import (
    LARGE,
    OPEN,
    SMALL,
    TINY,
    Separation,
    floor_of,
    gap_at,
    newton,
    plus,
)
from kinetile.kernel.certificates.integers import LIMIT, as_count
from kinetile.kernel.certificates.plans import BentAxis as BentAxis
from kinetile.kernel.certificates.plans import BentPlans as BentPlans
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import apart, hook, larger, smaller, subroutine
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error


class Way(NamedTuple):
    """How two bodies move along an axis from the later anchor on: separation ``d + low``, velocity ``u + w``,
    acceleration ``b + c``, each a rounded number and what rounding took from it; and the sizes of what the
    first two are made of."""

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
    """Return the sum of two sums of two doubles each."""
    s, rest = plus(a, b)
    return plus(s, rest + (low + low2))


@hook
def times(a: float, low: float, b: float, low2: float) -> tuple[float, float]:
    """Return the product of two sums of two doubles each."""
    product = a * b
    return plus(product, product_error(a, b, product) + (a * low2 + low * b))


@hook
def way_of(axis: BentAxis, time: float, rest: float) -> Way:
    """Return how two bodies move along an axis, of which the first has flown for ``time + rest``."""
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
    return Way(d, low, u, w, b, c, size + speed * time, speed + abs(axis.v2))


@hook
def time_of(count: int, tick: float) -> tuple[float, float]:
    """Return how long a number of ticks is: a rounded time, and what rounding took from it."""
    ticks = float(count)
    return ticks * tick, float(count - int(ticks)) * tick


@hook
def ways(plans: BentPlans) -> tuple[Way, Way]:
    """Return how two bodies move along both axes."""
    time, rest = time_of(plans.elapsed, plans.tick)
    return way_of(plans.x, time, rest), way_of(plans.y, time, rest)


@hook
def stepped(x: Way, y: Way, radius: float, radius2: float, ticks: float, plans: BentPlans) -> int:
    """Return when discs on straight ways touch, by one Newton step, or ``OPEN``."""
    reach, reach_low = plus(radius, radius2)
    speed = abs(x.u) + abs(y.u)
    sizes = reach + (x.size + y.size)
    speeds = x.speed + y.speed
    if speed > SMALL and speeds < 2.0**40 * speed and speeds < LARGE and reach > SMALL and sizes < LARGE:
        t = ticks * plans.tick
        along_x = Separation(x.d, x.low, 2.0 * (x.size + x.speed * t), x.u, x.w)
        along_y = Separation(y.d, y.low, 2.0 * (y.size + y.speed * t), y.u, y.w)
        q, q_error, slope, slope_error = gap_at(t, along_x, along_y, reach, reach_low)
        slope_error += 2.0**-102 * (along_x.size * x.speed + along_y.size * y.speed)
        speed2 = x.u * x.u + y.u * y.u
        if slope > 8.0 * slope_error and slope * plans.per_time > speed2:
            step, bound, bent = newton(q, q_error, slope, slope_error, speed2, plans.per_time)
            if bent < 0.125 and bound < 0.5:
                return floor_of(ticks, step, bound)
    return OPEN


@hook
def place_at(way: Way, t: float, rest: float) -> tuple[float, float, float]:
    """Return the separation along an axis at a time ``t + rest``, a sum of two doubles, and the size of what
    it is made of."""
    half, half_low = times(t, rest, 0.5 * way.b, 0.5 * way.c)
    half, half_low = total(half, half_low, way.u, way.w)
    flown, flown_low = times(half, half_low, t, rest)
    place, low = total(way.d, way.low, flown, flown_low)
    return place, low, way.size + (way.speed + abs(way.b) * t) * t


@hook
def gap_after(x: Way, y: Way, reach: float, reach_low: float, count: int, tick: float) -> tuple[float, float]:
    """Return Q after a number of ticks, and how far it can be off."""
    t, rest = time_of(count, tick)
    ex, ex_low, x_size = place_at(x, t, rest)
    ey, ey_low, y_size = place_at(y, t, rest)
    xx, xx_low = times(ex, ex_low, ex, ex_low)
    yy, yy_low = times(ey, ey_low, ey, ey_low)
    rr, rr_low = times(reach, reach_low, reach, reach_low)
    both, both_low = total(xx, xx_low, yy, yy_low)
    q, _ = total(both, both_low, -rr, -rr_low)
    spread = (abs(ex) + 2.0**-50 * x_size) * x_size + (abs(ey) + 2.0**-50 * y_size) * y_size
    return q, 2.0**-98 * (spread + rr)


@subroutine
def gap_sign(plans: BentPlans, radius: float, radius2: float, count: int) -> int:
    """Return the sign of Q after a number of ticks."""
    x, y = ways(plans)
    reach, reach_low = plus(radius, radius2)
    q, error = gap_after(x, y, reach, reach_low, count, plans.tick)
    if abs(q) > error and reach > SMALL and reach + (x.size + y.size) < LARGE:
        return 1 if q > 0.0 else -1
    return gap_sign_by_integers(plans, radius, radius2, count)


STEPS = 120
"""Intervals before whole numbers take over; some three are enough."""


@apart
def bent_closely(
    plans: BentPlans, radius: float, radius2: float, turn: int, met: int, about: int, since: int
) -> int:
    """Return the first tick, from ``since`` on, at which rule W holds of Q, or of -Q where ``turn`` is -1."""
    if since >= LIMIT:
        return NEVER
    x, y = ways(plans)
    reach, reach_low = plus(radius, radius2)
    tick = plans.tick
    way = float(turn)
    low = float(since)
    sizes = reach + (x.size + y.size)
    speeds = (x.speed + y.speed) + (abs(x.b) + abs(y.b))
    steps = STEPS if reach > SMALL and sizes < LARGE and speeds < LARGE else 0
    if int(low) != since:  # rounded: begin before it
        low = float((since >> 10) << 10)
        steps = 0 if met else steps
    q0, q0_error = gap_after(x, y, reach, reach_low, 0, tick)
    q0 *= way
    q1 = 2.0 * way * (x.d * x.u + y.d * y.u)
    q2 = way * ((x.u * x.u + y.u * y.u) + (x.d * x.b + y.d * y.b))
    q3 = way * (x.u * x.b + y.u * y.b)
    q4 = 0.25 * way * (x.b * x.b + y.b * y.b)
    xd = abs(x.d) + 2.0**-40 * x.size
    yd = abs(y.d) + 2.0**-40 * y.size
    xu = abs(x.u) + 2.0**-40 * x.speed
    yu = abs(y.u) + 2.0**-40 * y.speed
    m0 = abs(q0) + 2.0**50 * q0_error
    m1 = 2.0 * (xd * xu + yd * yu)
    m2 = (xu * xu + yu * yu) + (xd * abs(x.b) + yd * abs(y.b))
    m3 = xu * abs(x.b) + yu * abs(y.b)
    m4 = abs(q4)
    straight = (x.b == 0.0) & (y.b == 0.0)
    risen = True
    if met:
        lo = low * tick
        hi = lo + 2.0 * tick
        f2 = 2.0 * ((6.0 * q4 * lo + 3.0 * q3) * lo + q2)
        f1 = (((4.0 * q4 * lo + 3.0 * q3) * lo + 2.0 * q2) * lo + q1) + 0.5 * tick * f2
        m1_at = ((4.0 * m4 * hi + 3.0 * m3) * hi + 2.0 * m2) * hi + m1
        m2_at = 2.0 * ((6.0 * m4 * hi + 3.0 * m3) * hi + m2)
        m3_at = tick * (24.0 * m4 * hi + 6.0 * m3)
        f1_error = 2.0**-48 * (m1_at + tick * m2_at) + tick * m3_at + TINY
        f2_error = 2.0**-48 * m2_at + 2.0 * m3_at + TINY
        risen = f1 > f1_error or f2 < -f2_error
        if not (steps > 0 and (risen or f2 > f2_error)):
            risen = rises_or_presses(plans, radius, radius2, since)
    span = FAR
    about -= since
    rate = abs(q1) + math.sqrt(m0 * m2)
    if about > 0:
        span = float(about)
    elif since > 0:
        lo = low * tick
        rate = abs(((4.0 * q4 * lo + 3.0 * q3) * lo + 2.0 * q2) * lo + q1)
        bend = (6.0 * m4 * lo + 3.0 * m3) * lo + m2
        gap = abs((((q4 * lo + q3) * lo + q2) * lo + q1) * lo + q0)
        span = 2.0**-12 * low
        if bend > 0.0:
            t = 1.5 * gap / (rate + math.sqrt(gap * bend) + TINY) + 0.3 * rate / bend
            span = larger(span, smaller(t, FAR * tick) * plans.per_time)
    elif rate > 0.0:
        span = smaller(1.5 * m0 / rate, FAR * tick) * plans.per_time  # about when, if it comes
    for _ in range(steps):
        span = math.floor(smaller(larger(span, 1.0 + 2.0**-40 * low), FAR))
        high = smaller(low + span, FAR)
        lo = low * tick
        hi = high * tick
        h = hi - lo
        p0 = (((q4 * lo + q3) * lo + q2) * lo + q1) * lo + q0
        p1 = (((4.0 * q4 * lo + 3.0 * q3) * lo + 2.0 * q2) * lo + q1) * h
        p2 = ((6.0 * q4 * lo + 3.0 * q3) * lo + q2) * h * h
        p3 = (4.0 * q4 * lo + q3) * h * h * h
        p4 = q4 * h * h * h * h
        error = 2.0**-48 * ((((m4 * hi + m3) * hi + m2) * hi + m1) * hi + m0)
        if (turn > 0) & (p1 > error) & (p2 > error) & (straight | (p3 > error)):
            return NEVER  # all derivatives are positive
        b1 = p0 + 0.25 * p1
        b2 = p0 + (0.5 * p1 + p2 / 6.0)
        b3 = p0 + (0.75 * p1 + 0.5 * p2 + 0.25 * p3)
        b4 = p0 + (p1 + p2 + p3 + p4)
        slack = 2.0 * error
        g0 = b1 - p0
        g1 = b2 - b1
        g2 = b3 - b2
        g3 = b4 - b3
        falls = (g0 < -slack) & (g1 < -slack) & (g2 < -slack) & (g3 < -slack)
        if falls & (b4 < -error) & risen:  # the contact is here
            before = int(larger(int(low), since))
            if p0 < -error:
                return before
            after = int(high)
            s = p0 / (p0 - b4)
            for _ in range(20):
                s = smaller(larger(s, 0.0), 1.0)
                slope = ((4.0 * p4 * s + 3.0 * p3) * s + 2.0 * p2) * s + p1
                step = ((((p4 * s + p3) * s + p2) * s + p1) * s + p0) / slope
                s -= step
                if abs(step) < 2.0**-25:  # its square is below a rounding
                    break
            count = int(low) + int(smaller(larger(s, 0.0), 1.0) * (high - low))
            per = (high - low) / slope
            for _ in range(8):  # not before ``before``, and Q < 0 at ``after``
                if after - before <= 1:
                    return before
                count = smaller(larger(count, before + 1), after - 1)
                q, q_error = gap_after(x, y, reach, reach_low, count, tick)
                q *= way
                if q > q_error:
                    before = count
                elif q < -q_error:
                    after = count
                else:
                    break
                move = int(math.floor(smaller(larger(-q * per, -span), span)))
                count += move if move != 0 else 1
            return touch_by_integers(plans, radius, radius2, turn, Window(before, after, True, True), count)
        rises = (g0 > slack) & (g1 > slack) & (g2 > slack) & (g3 > slack)
        above = (p0 > error) & (b1 > error) & (b2 > error) & (b3 > error) & (b4 > error)
        climbs = b4 - p0 > slack  # so it rises somewhere
        sags = (g1 - g0 > 2.0 * slack) & (g2 - g1 > 2.0 * slack) & (g3 - g2 > 2.0 * slack)
        quiet = rises | (above & (risen | climbs)) | (not risen and (falls | (sags & climbs)))
        if quiet:
            if high >= FAR:
                return NEVER
            risen = risen | climbs
            low = high
            grow = 8.0
            if g3 < 0.0:  # up to where the tangent is 0, and .6 of that more
                grow = smaller(larger(-0.4 * b4 / g3, 0.1), 8.0) if b4 > 0.0 else 2.0
            span *= grow
            continue
        below = (p0 < -error) & (b1 < -error) & (b2 < -error) & (b3 < -error) & (b4 < -error)
        turns = below & risen & (g0 > slack) & (g3 < -slack)
        if turns | (span < larger(2.0**-22 * high, 4096.0)):
            window = Window(larger(int(low), since), int(high), False, risen)
            found = touch_by_integers(plans, radius, radius2, turn, window, -1)
            if found >= 0 or high >= FAR:
                return found if found >= 0 else NEVER
            risen = found != NONE_YET
            low = high
            span *= 8.0
        else:
            span *= 0.3
    window = Window(larger(int(low), since), LIMIT, False, risen)
    found = touch_by_integers(plans, radius, radius2, turn, window, -1)
    return found if found >= 0 else NEVER


@hook
def bent_touch(plans: BentPlans, radius: float, radius2: float, met: bool, about: int, since: int) -> int:
    """Return how many ticks after the later anchor two discs touch, from ``since`` on, or ``NEVER``.

    ``met``: they have just met. ``about``: a lower bound shortly before, or -1; the answer is the same.
    """
    x, y = ways(plans)
    if x.b == 0.0 and y.b == 0.0:
        if met:
            return NEVER
        if about >= 0:
            found = stepped(x, y, radius, radius2, float(about), plans)
            if found >= since:  # not OPEN
                return found
    return int(bent_closely(plans, radius, radius2, 1, int(met), about, since))


@hook
def bent_parting(plans: BentPlans, radius: float, radius2: float, since: int) -> int:
    """Return how many ticks after the later anchor two discs part, from ``since`` on, or ``NEVER``."""
    return int(bent_closely(plans, radius, radius2, -1, 0, 0, since))


@hook
def has_room(sizes: float, slope: float, pull: float, tick: float) -> bool:
    """Whether the bounds for a gap in doubles hold: no number is too large, or too small and not zero."""
    slow = abs(slope) < SMALL and slope != 0.0
    weak = abs(pull) < SMALL and pull != 0.0
    return bool(sizes + (abs(slope) + abs(pull)) < LARGE and not (slow or weak) and tick > 2.0**-100)


@apart
def bent_wall(
    far: float, near: float, radius: float, slope: float, pull: float, tick: float, per_time: float
) -> int:
    """Return after how many ticks a gap closes, or ``NEVER``: it is ``far - near - radius``, and widens at
    the speed ``slope``, by ``pull`` faster after a unit of time."""
    sizes = abs(far) + abs(near) + abs(radius)
    guess = 0
    if has_room(sizes, slope, pull, tick):
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
        way = Way(d, low, slope, 0.0, pull, 0.0, sizes, abs(slope))
        before = -1
        after = LIMIT
        for _ in range(8):
            guess = smaller(larger(guess, before + 1), after - 1)
            t, rest = time_of(guess + 1, tick)
            value, _, size = place_at(way, t, rest)
            error = 2.0**-100 * size
            rate = slope + pull * (t - 0.5 * tick)
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
    return wall_by_integers(far, near, radius, slope, pull, tick, guess)
