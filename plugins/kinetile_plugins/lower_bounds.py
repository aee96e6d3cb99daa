"""Lower bounds of contacts for eight partners at once, and the two least of many; narrow phases share them.

Why a numbered delay is a bound
===============================

*Numbered delays.* The least of many delays has to identify its partner, so each delay stores its partner's
place, 0 to 63, in its last six bits (``kinetile.kernel.vectors.numbered``). These bits are cleared, 64 units
of the last place are subtracted, and the place is added: a delay decreases by 1 to 127 units, less than 2^-45
of it, and never increases. So a bound stays a bound, and needs no other margin. Delays are first raised to at
least 2^-1000, so that 64 units can be subtracted. That is far below a tick, so the floor is still the present
tick. An infinite delay becomes a number above 2^1023; above 2^1023 a delay means never, far beyond 2^62
ticks. Two delays that differ by less than 127 units may change their order. Then the partner is the other
one, and both bounds hold as before: the first is below the contact with the partner, and the second, the
least of all others, below theirs. More than 64 partners are processed 64 at a time; the two least delays of
each 64 are compared with the two so far.

*The second bound* of discs is not the second delay, which is not needed (``alone``). If no other delay is
within 2^22 ticks (``ROOM``) and 2^-40 of the first delay after it, all others are later than this limit: so
it is a bound. Else the first delay is the bound. The exact tick of the first, computed at the head of the
queue, is nearly always before the second bound; if not, all contacts of the body are computed exactly. For
bodies whose radii are equal and stay so, (R + fat)^2 is the same number for all partners, by the same
operations.
"""

from kinetile.toolbox import Kernel, hook, since_origin, smaller
from kinetile.toolbox.lanes import (
    Floats,
    Truths,
    bits,
    choose,
    lane,
    number_in,
    places,
    root,
    some,
    spread,
    turned,
)
from kinetile.toolbox.ticks import HALVES, nearest_whole

PLACES = 64
"""Partners that six bits can distinguish."""

LEAST = 2.0**-1000
"""The smallest delay before numbering; it stands for no delay."""

NONE = 2.0**1023
"""The upper limit of delays: a numbered infinite delay is above it."""

ROOM = 2.0**22
"""Ticks from a bound that include its contact, except for grazes: more than the effect of ``fat``."""

WIDER = 1.0 + 2.0**-40
"""A factor of a delay that exceeds the rounding of a bound."""


@hook
def sooner_two(
    first: Floats, second: Floats, other_first: Floats, other_second: Floats
) -> tuple[Floats, Floats]:
    """Returns the first and the second of two firsts and two seconds, lane by lane."""
    later = choose(other_first < first, first, other_first)
    rest = choose(other_second < second, other_second, second)
    return choose(other_first < first, other_first, first), choose(later < rest, later, rest)


@hook
def two_least(first: Floats, second: Floats, delay: Floats) -> tuple[Floats, Floats]:
    """Returns the first and the second of a first, a second and one more, lane by lane."""
    later = choose(delay < first, first, delay)
    return choose(delay < first, delay, first), choose(later < second, later, second)


@hook
def merged(
    k: Kernel, begin: int, first: Floats, second: Floats, soon: float, rest: float, who: int, next_: int
) -> tuple[float, float, int, int]:
    """Returns the two least delays, and their partners: of the two so far, and of firsts and seconds whose
    last six bits have the partner's place in ``k.near``, from ``begin`` on."""
    first, second = sooner_two(first, second, turned(first, 4), turned(second, 4))
    first, second = sooner_two(first, second, turned(first, 2), turned(second, 2))
    first, second = sooner_two(first, second, turned(first, 1), turned(second, 1))
    found = lane(first, 0)
    later = lane(second, 0)
    one = int(k.near[begin + number_in(found)])
    if found < soon:
        if soon <= later:
            return found, soon, one, who
        return found, later, one, int(k.near[begin + number_in(later)])
    return (soon, found, who, one) if found < rest else (soon, rest, who, next_)


@hook
def alone(
    k: Kernel, begin: int, first: Floats, second: Floats, soon: float, rest: float, who: int
) -> tuple[float, float, int]:
    """Returns the values of ``merged``, but instead of the second delay a bound: slightly more than the first
    delay if no other is within that, else the first delay itself."""
    least = choose(turned(first, 4) < first, turned(first, 4), first)
    least = choose(turned(least, 2) < least, turned(least, 2), least)
    least = choose(turned(least, 1) < least, turned(least, 1), least)
    found = lane(least, 0)
    after = (found + ROOM * k.clock[0].per_tick) * WIDER
    limit = spread(after)
    close = bits(first <= limit)
    later = found if (close & (close - 1)) != 0 or some(second <= limit) else after
    one = int(k.near[begin + number_in(found)])
    return (found, smaller(later, soon), one) if found < soon else (soon, smaller(found, rest), who)


@hook
def circles_meet(
    dx: Floats, dy: Floats, vx: Floats, vy: Floats, reach2: Floats, fat2: Floats
) -> tuple[Floats, Truths]:
    """Returns lower bounds, ``LEAST`` or more, of the delays until places are nearer to 0 than a reach, given
    as its square; and True for places that never are."""
    zero = spread(0.0)
    approach = dx * vx + dy * vy
    speed2 = vx * vx + vy * vy
    gap = (dx * dx + dy * dy) * spread(1.0 - 2.0**-46) - reach2
    approach2 = approach * approach
    inside = approach2 - speed2 * gap
    parts = (approach > zero) & (approach2 > fat2 * speed2)
    passes = parts | (inside < zero)
    delay = gap / (root(inside) - approach)
    return choose(delay > spread(LEAST), delay, spread(LEAST)), passes  # NaN: they may touch now


@hook
def nearest_image(k: Kernel, dx: Floats, dy: Floats) -> tuple[Floats, Floats]:
    """Returns the separations of the nearest images."""
    torus = k.clock[0].torus
    halves = spread(HALVES)
    x = ((dx * spread(torus.per_x) + halves) - halves) * spread(torus.x)
    y = ((dy * spread(torus.per_y) + halves) - halves) * spread(torus.y)
    return dx - x, dy - y


@hook
def before_other_images(k: Kernel, delay: Floats, vx: Floats, vy: Floats, reach: Floats) -> Floats:
    """Returns delays, ``LEAST`` or more; or, if sooner, the time until any image except the nearest could
    touch: the flight of half a period along an axis, less the reach."""
    torus = k.clock[0].torus
    zero = spread(0.0)
    x_delay = (spread(torus.half_x) - reach) / choose(vx < zero, zero - vx, vx)
    y_delay = (spread(torus.half_y) - reach) / choose(vy < zero, zero - vy, vy)
    delay = choose(x_delay >= delay, delay, x_delay)
    delay = choose(y_delay >= delay, delay, y_delay)
    return choose(delay > spread(LEAST), delay, spread(LEAST))


@hook
def motion_to(k: Kernel, body: int, other: int, at: int, periodic: bool) -> tuple[float, float, float, float]:
    """Returns the separation from a body to another, or to its nearest image, at a tick, and the velocity."""
    elapsed = since_origin(k, at)
    one = k.places[body]
    two = k.places[other]
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    dx = (two.x - one.x) + vx * elapsed
    dy = (two.y - one.y) + vy * elapsed
    if periodic:
        torus = k.clock[0].torus
        dx -= nearest_whole(dx * torus.per_x) * torus.x
        dy -= nearest_whole(dy * torus.per_y) * torus.y
    return dx, dy, vx, vy


@hook
def motions(k: Kernel, body: int, start: int, at: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Returns the separations at a tick from a body to eight others, from a place in ``k.near`` on, and the
    relative velocities, along x and y."""
    elapsed = spread(since_origin(k, at))
    one = k.places[body]
    x, y, vx, vy = places(k.places, k.near, start)
    vx = vx - spread(one.vx)
    vy = vy - spread(one.vy)
    return (x - spread(one.x)) + vx * elapsed, (y - spread(one.y)) + vy * elapsed, vx, vy


@hook
def accelerated_motions(
    k: Kernel, body: int, start: int, at: int
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]:
    """Returns the motion at a tick of eight accelerated bodies, from a place in ``k.near`` on, relative to a
    body: place, velocity and acceleration along x and y; and the time to the first end of their chords."""
    elapsed = spread(since_origin(k, at))
    half = spread(0.5)
    zero = spread(0.0)
    place = k.places[body]
    pull = k.pulls[body]
    x, y, vx, vy = places(k.places, k.near, start)
    ax, ay, end, _ = places(k.pulls, k.near, start)
    own_end = spread(pull.vx)
    bx = ax - spread(pull.x)
    by = ay - spread(pull.y)
    vx = vx - spread(place.vx)
    vy = vy - spread(place.vy)
    dx = (x - spread(place.x)) + (vx + half * bx * elapsed) * elapsed
    dy = (y - spread(place.y)) + (vy + half * by * elapsed) * elapsed
    span = choose(end < own_end, end, own_end) - elapsed
    return dx, dy, vx + bx * elapsed, vy + by * elapsed, bx, by, choose(span > zero, span, zero)


@hook
def chords(
    vx: Floats, vy: Floats, bx: Floats, by: Floats, span: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Returns for accelerated ways through a span of time: the span, 0 for an infinite one (no acceleration);
    the velocity along the chord; the largest distance of the way from it; |x| + |y| of the acceleration."""
    zero = spread(0.0)
    half = spread(0.5)
    h = choose(span < spread(2.0**200), span, zero)
    pulls = choose(bx < zero, zero - bx, bx) + choose(by < zero, zero - by, by)
    return h, vx + half * bx * h, vy + half * by * h, pulls * h * h * spread(0.125), pulls
