"""Structural certificates: when they fail, and how a broad phase says so.

A structural certificate says that some quantity, a gap between two bounds, is not negative. Whether it will
fail is decided by the sign of its rate alone, never by comparing times with now: a failure time in the past
is simply the next event (thesis, section 5.2).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import hook, larger
from kinetile.kernel.tables import BAD_CERTIFICATE, NEVER, NOBODY, Kernel, blame
from kinetile.kernel.vectors import (
    LANES,
    Floats,
    Ticks,
    choose,
    floor,
    lane,
    root,
    some,
    spread,
    spread_ticks,
    to_floats,
)

Integers = npt.NDArray[np.int64]
Doubles = npt.NDArray[np.float64]

FAR = 2.0**62
"""Ticks. What lies further than this after its bodies' anchors is not predicted: both are re-anchored before.
"""


@hook
def schedule(k: Kernel, body: int, tick: int) -> None:
    """Set when a body's structural certificate fails; ``NEVER``: it does not. O(1).

    A body has one. A phase that has several for it schedules the first of them to fail. The body is filed in
    the queue when the hook has returned.
    """
    if body < 0 or body >= k.clock[0].bodies:
        blame(k, BAD_CERTIFICATE, body, NOBODY)
        return
    if k.queue[body].own != tick:
        k.queue[body].own = tick
        k.counts[0].updated += 1
        if body != k.clock[0].hand:
            to_be_settled(k, body, NOBODY)


@hook
def to_be_settled(k: Kernel, body: int, newcomer: int) -> None:
    """Leave a body to be settled after the hook, with a newcomer near it, or NOBODY."""
    lists = k.clock[0].lists
    if lists.offered < len(k.offers):
        k.offers[lists.offered].a = body
        k.offers[lists.offered].b = newcomer
    lists.offered += 1


@hook
def falls(k: Kernel, since: int, gap: float, rate: float) -> int:
    """Return the tick at which a linear quantity falls below zero, or ``NEVER``.

    ``gap`` is its value at tick ``since``, ``rate`` its change per unit of time; ``since`` must be the later
    of the anchors of the bodies involved. A quantity that falls through zero before now fails now. One that
    does not fall is left alone, unless at the end of this tick it is still more negative than rounding
    explains (by ``theta``): then it fails now, whatever its rate.
    """
    clock = k.clock[0]
    limits = clock.limits
    if rate < 0.0:
        ticks = gap / -rate * clock.per_time
        if not ticks < FAR:
            return NEVER
        if ticks <= -FAR:
            return int(clock.now)
        tick = since + int(math.floor(ticks))
        if tick < clock.now:
            k.counts[0].late = larger(k.counts[0].late, clock.now - tick)
            return int(clock.now)
        return tick
    if gap < -limits.theta and gap + rate * ((clock.now + 1 - since) * clock.tick) < -limits.theta:
        return int(clock.now)
    return NEVER


@hook
def falls_eight(k: Kernel, since: Ticks, gap: Floats, rate: Floats) -> Ticks:
    """Return what ``falls`` does, to the tick, in each of eight lanes. With no gap and no rate: ``NEVER``."""
    clock = k.clock[0]
    counts = k.counts[0]
    zero = spread(0.0)
    now = spread_ticks(clock.now)
    never = spread_ticks(NEVER)
    theta = spread(-clock.limits.theta)
    falling = rate < zero
    ticks = gap / choose(falling, zero - rate, spread(1.0)) * spread(clock.per_time)
    soon = ticks < spread(FAR)
    long_ago = ticks <= spread(-FAR)
    tick = since + floor(choose(soon, choose(long_ago, zero, ticks), zero))
    late = falling & soon & (tick < now)
    if some(late):
        for i in range(LANES):
            if lane(late, i) and not lane(long_ago, i):
                counts.late = larger(counts.late, clock.now - lane(tick, i))
    tick = choose(late | long_ago, now, tick)
    ahead = to_floats(spread_ticks(clock.now + 1) - since) * spread(clock.tick)
    deep = (gap < theta) & (gap + rate * ahead < theta)
    return choose(falling, choose(soon, tick, never), choose(deep, now, never))


STEPS = 3
"""Steps of ``first_rise``, at most. More of them find later ticks, and cost more."""


@hook
def positive(value: Floats) -> Floats:
    """Return the numbers that are above zero, and zero for the others."""
    return choose(value > spread(0.0), value, spread(0.0))


@hook
def least_root(m: Floats, r1: Floats, r2: Floats) -> Floats:
    """Return where r1 u + r2 u^2 reaches m > 0, for u > 0 and r1, r2 >= 0; at most 2^10."""
    q = r1 + root(r1 * r1 + spread(4.0) * r2 * m) + spread(2.0**-1000)
    u = (m + m) / q
    return choose(u < spread(1024.0), u, spread(1024.0))


@hook
def first_rise(k: Kernel, g0: Floats, g1: Floats, g2: Floats, g3: Floats, g4: Floats) -> Ticks:
    """Return a tick before which g0 + g1 t + g2 t^2 + g3 t^3 + g4 t^4 stays below zero, in each of eight
    lanes; t is the time since now in units of the clock, 2^52 ticks.

    It is now if, and only if, the polynomial is not below zero at the end of this tick. Else it is a lower
    bound of the first root, or ``NEVER``: whoever is told of it computes once more then, whether the
    polynomial has risen. On [t, t + u] a polynomial is at most its value at t and the terms of its
    derivatives there that are positive. Where that sum reaches zero is no root before; it is a polynomial
    that rises and is convex, so a bound of its root from above gives one from below.
    """
    zero = spread(0.0)
    far = spread(FAR * 2.0**-52)
    now = spread_ticks(k.clock[0].now)
    t = spread(2.0**-52)
    at_once = (((g4 * t + g3) * t + g2) * t + g1) * t + g0 >= zero
    for _ in range(STEPS):
        m = zero - ((((g4 * t + g3) * t + g2) * t + g1) * t + g0)
        r1 = positive(((spread(4.0) * g4 * t + spread(3.0) * g3) * t + spread(2.0) * g2) * t + g1)
        r2 = positive((spread(6.0) * g4 * t + spread(3.0) * g3) * t + g2)
        r3 = positive(spread(4.0) * g4 * t + g3)
        r4 = positive(g4)
        below = (m > zero) & (t < far)
        m = choose(below, m, spread(1.0))
        above = least_root(m, r1, r2)
        alone = root(root(m / (r4 + spread(2.0**-1000))))
        above = choose(alone < above, alone, above)
        step = least_root(m, r1, r2 + above * (r3 + above * r4))
        above = least_root(m, r1, r2 + step * (r3 + step * r4))
        step = least_root(m, r1, r2 + above * (r3 + above * r4))
        t = choose(below, t + step * spread(1.0 - 2.0**-40), t)
        if not some(below):
            break
    soon = t < far
    tick = choose(soon, now + floor(choose(soon, t, zero) * spread(2.0**52)), spread_ticks(NEVER))
    return choose(at_once, now, tick)


@hook
def ticks_after(k: Kernel, since: int, delay: float) -> int:
    """Return the tick that lies ``delay`` >= 0 (in the scene's time) after tick ``since``, rounded down, or
    ``NEVER``.

    Rounding down lets a contact be met from outside. A delay that is not a number, or too far to predict, is
    ``NEVER``.
    """
    ticks = delay * k.clock[0].per_time
    if not ticks < FAR:
        return NEVER
    return since + int(math.floor(ticks))


def falls_many(k: Kernel, since: Integers, gap: Doubles, rate: Doubles) -> Integers:
    """Return what ``falls`` does, for many at once: for audits, not for hooks."""
    clock = k.clock[0]
    limits = clock.limits
    with np.errstate(all="ignore"):
        ticks = gap / -rate * clock.per_time
        near = np.clip(np.nan_to_num(np.floor(ticks)), -FAR, FAR).astype(np.int64)
    falling = np.where(ticks <= -FAR, clock.now, np.maximum(since + near, clock.now))
    falling = np.where(ticks < FAR, falling, NEVER)
    deep = (gap < -limits.theta) & (gap + rate * ((clock.now + 1 - since) * clock.tick) < -limits.theta)
    return np.where(rate < 0.0, falling, np.where(deep, clock.now, NEVER))
