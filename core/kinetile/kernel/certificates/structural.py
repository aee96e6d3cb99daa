"""Structural certificates: when they fail, and how a broad phase schedules them.

A structural certificate says that some quantity, a gap between two bounds, is not negative. Only the sign of
the gap's rate decides whether it will fail; times are never compared with now. So a failure time in the past
is allowed: it is the next event (thesis, section 5.2).
"""

import math

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import hook, larger, smaller
from kinetile.kernel.tables import BAD_CERTIFICATE, NEVER, NOBODY, Kernel, blame
from kinetile.kernel.vectors import (
    LANES,
    Floats,
    Ticks,
    choose,
    floor,
    lane,
    some,
    spread,
    spread_ticks,
    to_floats,
)

Integers = npt.NDArray[np.int64]
Doubles = npt.NDArray[np.float64]

FAR = 2.0**62
"""Ticks. Nothing further than this after its bodies' anchors is predicted: both are re-anchored before."""


@hook
def schedule(k: Kernel, body: int, tick: int) -> None:
    """Sets the failure tick of a body's structural certificate; ``NEVER``: it does not fail. O(1).

    A body has one certificate. A phase that has several for it schedules the first of them to fail. The body
    is filed in the queue when the hook has returned.
    """
    if body < 0 or body >= k.clock[0].bodies:
        blame(k, BAD_CERTIFICATE, body, NOBODY)
        return
    entry = k.queue[body]
    before = entry.certificate
    if before != tick:
        entry.certificate = tick
        k.counts[0].updated += 1
        # A body that is filed under another event, and earlier than both, stays there.
        if body != k.clock[0].at_work and entry.key >= smaller(before, tick):
            to_be_settled(k, body, NOBODY)


@hook
def to_be_settled(k: Kernel, body: int, newcomer: int) -> None:
    """Leaves a body to be settled after the hook, with a newcomer near it, or NOBODY."""
    lists = k.clock[0].lists
    if lists.offered < len(k.offers):
        k.offers[lists.offered].a = body
        k.offers[lists.offered].b = newcomer
    lists.offered += 1


@hook
def falls(k: Kernel, since: int, gap: float, rate: float) -> int:
    """Returns the tick at which a linear quantity falls below zero, or ``NEVER``.

    ``gap`` is its value at tick ``since``, ``rate`` its change per unit of time; ``since`` must be the later
    of the anchors of the bodies involved. A quantity that fell through zero before now fails now. One that
    does not fall is ignored, unless at the end of this tick it is still more negative than rounding explains
    (by ``theta``): then it fails now, whatever its rate.
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
    if gap < -limits.theta and gap + rate * ((clock.now + 1 - since) * clock.per_tick) < -limits.theta:
        return int(clock.now)
    return NEVER


@hook
def falls_eight(k: Kernel, since: Ticks, gap: Floats, rate: Floats) -> Ticks:
    """Returns the same as ``falls``, to the tick, in each of eight lanes. Without a gap and a rate:
    ``NEVER``."""
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
    ahead = to_floats(spread_ticks(clock.now + 1) - since) * spread(clock.per_tick)
    deep = (gap < theta) & (gap + rate * ahead < theta)
    return choose(falling, choose(soon, tick, never), choose(deep, now, never))


LATEST = 2.0
"""No bound of ``first_rise`` is later than this many times its scale."""

FRACTIONS = (0.5, 0.0625, 0.0)
"""The beginnings of the intervals of ``first_rise``, over its scale, the last one first: each ends at the
beginning of the one before, and the first of them at ``LATEST``."""

NEWTON_STEPS = 3
"""Steps of ``first_rise`` after that. More of them find later ticks, and cost more."""


@hook
def steepest(length: Floats, g1: Floats, g2: Floats, g3: Floats, g4: Floats) -> Floats:
    """Returns a bound of the rise of a polynomial in a length above its first value, if it continued at its
    steepest rate.

    On [0, length] it lies within the hull of its five Bernstein coefficients, at 0, 1/4, ... 1. So it is
    nowhere above the steepest line from the first to one of the others.
    """
    c1 = g1 * length
    c2 = g2 * (length * length)
    c3 = g3 * (length * length) * length
    third = spread(1.0 / 3.0)
    most = c1
    rise = c1 + third * c2
    most = choose(rise > most, rise, most)
    rise = c1 + spread(2.0) * third * c2 + third * c3
    most = choose(rise > most, rise, most)
    rise = c1 + c2 + c3 + g4 * ((length * length) * (length * length))
    return choose(rise > most, rise, most)


@hook
def seen_from(
    t: Floats, g0: Floats, g1: Floats, g2: Floats, g3: Floats, g4: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Returns the depth of a polynomial below zero at a time, almost nothing if it is not below, and its
    terms from there on except the last, which stays the same."""
    tt = t * t
    m = spread(0.0) - ((g0 + g1 * t) + tt * ((g2 + g3 * t) + tt * g4))
    h1 = (g1 + spread(2.0) * g2 * t) + tt * (spread(3.0) * g3 + spread(4.0) * g4 * t)
    h2 = (g2 + spread(3.0) * g3 * t) + tt * (spread(6.0) * g4)
    return choose(m > spread(0.0), m, spread(2.0**-400)), h1, h2, g3 + spread(4.0) * g4 * t


@hook
def first_rise(k: Kernel, g0: Floats, g1: Floats, g2: Floats, g3: Floats, g4: Floats, scale: Floats) -> Ticks:
    """Returns a tick before which g0 + g1 t + g2 t^2 + g3 t^3 + g4 t^4 stays below zero, in each of eight
    lanes; t is the time since now in units of the clock, 2^52 ticks.

    It is now if, and only if, the polynomial is not below zero at the end of this tick. Else it is a lower
    bound of the first root, or ``NEVER``: at that tick, compute again whether the polynomial has risen.
    ``scale`` is a time in which the numbers that the polynomial was made of change by as much as their sizes.
    No bound is much later than that, because the rounding errors would change.

    First comes the interval of a possible rise: all are evaluated, since divisions do not wait for each other
    there. They are the shorter the earlier, for after a flip a polynomial falls from almost zero. Then there
    are steps, each at most as long as the one before.
    """
    zero = spread(0.0)
    most = spread(1024.0)
    now = spread_ticks(k.clock[0].now)
    end = spread(2.0**-52)
    at_once = (((g4 * end + g3) * end + g2) * end + g1) * end + g0 >= zero
    scale = choose(scale < most, scale, most)
    latest = spread(LATEST) * scale
    until = latest
    t = latest
    length = zero
    depth = spread(1.0)
    rise = depth
    for part in FRACTIONS:
        begin = spread(part) * scale
        m, h1, h2, h3 = seen_from(choose(begin > end, begin, end), g0, g1, g2, g3, g4)
        highest = steepest(until - begin, h1, h2, h3, g4)
        rises = highest > m
        t = choose(rises, begin, t)
        length = choose(rises, until - begin, length)
        depth = choose(rises, m, depth)
        rise = choose(rises, highest, rise)
        until = begin
    length = length * depth / rise
    t = t + length
    for _ in range(NEWTON_STEPS):
        m, h1, h2, h3 = seen_from(t, g0, g1, g2, g3, g4)
        rise = steepest(length, h1, h2, h3, g4)
        length = length * m / choose(rise > m, rise, m)
        t = t + length
    t = t * spread(1.0 - 2.0**-40)
    t = choose(t > end, t, end)
    t = choose(t < latest, t, choose(latest > end, latest, end))
    soon = t < most
    tick = choose(soon, now + floor(choose(soon, t, zero) * spread(2.0**52)), spread_ticks(NEVER))
    return choose(at_once, now, tick)


@hook
def ticks_after(k: Kernel, since: int, delay: float) -> int:
    """Returns the tick that lies ``delay`` >= 0 (in the scene's time) after tick ``since``, rounded down: so
    a contact is met from outside. A delay that is not a number, or too far to predict, is ``NEVER``."""
    ticks = delay * k.clock[0].per_time
    return since + int(math.floor(ticks)) if ticks < FAR else NEVER


def falls_many(k: Kernel, since: Integers, gap: Doubles, rate: Doubles) -> Integers:
    """Returns the same as ``falls``, for many at once: for audits, not for hooks."""
    clock = k.clock[0]
    limits = clock.limits
    with np.errstate(all="ignore"):
        ticks = gap / -rate * clock.per_time
        near = np.clip(np.nan_to_num(np.floor(ticks)), -FAR, FAR).astype(np.int64)
    falling = np.where(ticks <= -FAR, clock.now, np.maximum(since + near, clock.now))
    falling = np.where(ticks < FAR, falling, NEVER)
    deep = (gap < -limits.theta) & (gap + rate * ((clock.now + 1 - since) * clock.per_tick) < -limits.theta)
    return np.where(rate < 0.0, falling, np.where(deep, clock.now, NEVER))
