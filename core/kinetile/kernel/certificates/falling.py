"""When a body reaches a wall that is bent in its frame (``kernel.falling``): the exact tick.

The gap is, n ticks after the anchor, exactly::

    Q(n) = far - near - radius + slope t + pull w^2 / 2,     t = n q,  w = (since + n) q

with q the length of a tick. It *falls* at a time where the first of Q', Q'' that is not 0 is negative, and
the body is at the wall at the first time from the anchor on at which Q <= 0 and falls (rule 6g). With pull <
0 all later times are such, too, so its floor is the last whole n at which Q >= 0 or Q' >= 0. With pull > 0 Q
falls up to the vertex alone: there is no such time if Q' >= 0 at the anchor, it is the anchor if Q <= 0
there, none if the discriminant is <= 0, and otherwise its floor is the last n with Q >= 0 and Q' < 0. In both
cases ``before`` says of a whole n whether the floor is n or later, and it never becomes true again.

``falls_at`` computes Q and Q' at whole ticks in doubles, with what each sum and product lost. Their signs are
known where they are beyond a bound, or where nothing was lost at all; a body that is surely not at the wall
by the end of its frame is answered with ``NEVER`` at once, and otherwise the tick is that of an estimate, or
beside it. What that leaves open is decided by bisection in whole numbers (``integers``).

Error bounds
============

u is 2^-53. Every t and w is exact: n and since + n are below 2^53. No product underflows: a factor is 0, or a
speed or an acceleration above SMALL = 2^-200, or a number of ticks above 2^-100. So ``plus`` and
``product_error`` give exactly what sums and products lost, and Q = all + (b + g + l1 + l2 + pull / 2 e + f +
a), exactly, of which the product with e, what the square of w lost, and six sums are rounded: 7 u of the sum
S of the magnitudes; **2^-49 = 16 u** covers it. The last sum, all + low, has the right sign. If S is 0
nothing was rounded: the sign is exact, also when it is 0. In Q' = slope + pull w there are two roundings of
the same kind: **2^-50** of them.

The discriminant Q'^2 - 2 pull Q at the anchor decides nothing but that there is no root, and has a bound of
2^-45 of its terms, and what the bounds of Q and Q' make in it.

Whole numbers
=============

2 Q is a quadratic of n, as ``integers`` have them: with V = slope q and G = pull q^2 its a is G, its b is V +
G since, and its c 2 (far - near - radius) + G since^2, whole numbers times a power of two. With pull >= 0 the
tick is its first root; with pull < 0 the last root of -2 Q, or its vertex. ``scene.checks`` has gravity from
2^-200 to 2^200, and a frame lasts for a tick at least, so G is not beyond the cells: 2^-200 times the square
of a tick of 2^-952, brought to 53 bits, is 2^-2156 and begins in cell 96 - 83 = 13. G times a count takes 78
+ 63 bits, and its square another 63: 8 cells with a sign, and ``room`` has 11 here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kinetile.kernel.certificates.contact import LARGE, SMALL, TINY, plus
from kinetile.kernel.certificates.integers import (
    CELLS,
    CONSTANT,
    COUNT,
    HALF_RATE,
    MEMORY,
    SQUARE,
    SUM,
    add_product,
    as_count,
    carry,
    first_root,
    put,
    put_count,
    room,
    root_of,
)
from kinetile.kernel.compiled import apart, hook, larger, smaller, subroutine, zeros
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error


class Fall(NamedTuple):
    """The gap between a body and a wall along an axis with gravity: ``far - near - radius`` at the anchor in
    its frame, and its rate there, ``slope``; the acceleration of the room's gap, ``pull``; how many ticks
    after the origin of the frame the anchor is, ``since``, and how many after the anchor the frame ends: from
    there on nothing is predicted. A tick is a power of two."""

    far: float
    near: float
    radius: float
    slope: float
    pull: float
    since: int
    end: int
    tick: float


@hook
def state_after(f: Fall, ticks: int) -> tuple[float, float, float, float]:
    """Return Q after a number of ticks and a bound of its error, and the same of Q'."""
    t = float(ticks) * f.tick
    w = float(f.since + ticks) * f.tick
    flown = f.slope * t
    gained = f.pull * w
    square = w * w
    half = 0.5 * f.pull
    fallen = half * square
    between_them, b = plus(f.far, -f.near)
    gap, g = plus(between_them, -f.radius)
    some, s = plus(gap, flown)
    all_of_it, a = plus(some, fallen)
    one = product_error(f.slope, t, flown)
    two = product_error(half, square, fallen)
    three = half * product_error(w, w, square)
    low = (b + g) + ((one + two) + (three + (s + a)))
    size = (abs(b) + abs(g)) + ((abs(one) + abs(two)) + (abs(three) + (abs(s) + abs(a))))
    rate, r = plus(f.slope, gained)
    lost = product_error(f.pull, w, gained)
    return all_of_it + low, 2.0**-49 * size, rate + (r + lost), 2.0**-50 * (abs(r) + abs(lost))


@hook
def sign_beyond(value: float, error: float) -> int:
    """Return 1 where a number is surely >= 0, -1 where it is surely below, 0 where that is open."""
    if value > error or (value == 0.0 and error == 0.0):
        return 1
    return -1 if value < -error else 0


@hook
def side_of(f: Fall, ticks: int) -> int:
    """Return 1 if the contact is surely at or after a whole tick, which it is not with pull > 0 unless there
    is one; -1 if it is surely before it; 0 where that is open."""
    value, error, slope, slope_error = state_after(f, ticks)
    gap = sign_beyond(value, error)
    rate = sign_beyond(slope, slope_error)
    if f.pull < 0.0:
        return int(larger(gap, rate))
    if gap < 0:
        return -1
    return 1 if gap > 0 and rate < 0 else 0


@apart
def falls_at(f: Fall) -> int:
    """Return after how many ticks a body is at a bent wall, rounded down exactly; ``NEVER`` from the end of
    its frame on."""
    last = smaller(f.end, (1 << 53) - f.since - 2)
    size = abs(f.far) + abs(f.near) + abs(f.radius) + abs(f.slope)
    slow = abs(f.slope) < SMALL and f.slope != 0.0
    guess = 0.0
    if last > 0 and size < LARGE and not slow and abs(f.pull) > SMALL and f.tick > 2.0**-100:
        gap, gap_error, rate, rate_error = state_after(f, 0)
        squares = rate * rate - 2.0 * f.pull * gap
        bound = 2.0**-45 * (rate * rate + 2.0 * abs(f.pull * gap)) + TINY
        bound += 2.0 * (abs(rate) * rate_error + abs(f.pull) * gap_error)
        if f.pull > 0.0 and (squares < -bound or sign_beyond(rate, rate_error) > 0):
            return NEVER
        if last == f.end and side_of(f, last) > 0:
            return NEVER
        if f.pull < 0.0 and side_of(f, 0) < 0:
            return 0
        root = math.sqrt(squares) if squares > 0.0 else 0.0
        if f.pull < 0.0 and rate >= 0.0:
            guess = (rate + root) / -f.pull / f.tick
        elif root > rate:
            guess = 2.0 * gap / (root - rate) / f.tick
        about = smaller(as_count(guess), last - 1)
        for ticks in range(larger(about - 2, 0), smaller(about + 3, last)):
            if side_of(f, ticks) > 0 and side_of(f, ticks + 1) < 0:
                return int(ticks)
    found = int(falls_at_by_integers(f, as_count(guess)))
    return int(found if found < f.end else NEVER)


@subroutine
def falls_at_by_integers(f: Fall, guess: int) -> int:
    """Return after how many ticks a body is at a wall, bent or not, for finite numbers; ``NEVER`` from 2^62
    on, and for others."""
    power = int(math.frexp(f.tick)[1]) - 1
    first, end = room(CELLS, 0, f.far, 1)
    first, end = room(first, end, f.near, 1)
    first, end = room(first, end, f.radius, 1)
    first, end = room(first, end, f.slope, power)
    first, end = room(first, end, f.pull, 2 * power)
    end += 3
    if end > CELLS:
        return NEVER
    m = zeros(MEMORY)
    way = -1 if f.pull < 0.0 else 1
    put(m, CONSTANT, f.far, 1, way)
    put(m, CONSTANT, f.near, 1, -way)
    put(m, CONSTANT, f.radius, 1, -way)
    put(m, HALF_RATE, f.slope, power, way)
    put(m, SQUARE, f.pull, 2 * power, way)
    put_count(m, COUNT, f.since)
    add_product(m, SUM, SQUARE, first, end - 3, COUNT, 0, 3)
    carry(m, SUM, first, end, 1)
    add_product(m, HALF_RATE, SQUARE, first, end - 3, COUNT, 0, 3)
    add_product(m, CONSTANT, SUM, first, end - 3, COUNT, 0, 3)
    for row in (CONSTANT, HALF_RATE, SQUARE):
        carry(m, row, first, end, 1)
    return first_root(m, first, end, guess) if way > 0 else root_of(m, first, end, guess, True)
