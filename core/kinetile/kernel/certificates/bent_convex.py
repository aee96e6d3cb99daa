"""When two accelerated convex bodies touch or part: the exact ticks.

Seen from the first body, the place d of the second moves on a parabola, and the two touch where it comes to
be within R of the difference M of their cores (``convex``; docs/specification.md, rules 5t to 11t). All is
said of whole ticks n from the later anchor, and all of it are signs of a few *measures* of d(n): how far it
is beyond the line of a face, moved out by R (``GAP``), moved in by the strip (``STRIP``) or as it is
(``LINE``); and how far it is along a face, from its first corner (``ALONG``) and from its last (``BEYOND``).
Each is of degree 2 in n. So it falls on one side of its vertex and rises on the other, and the first tick
from some n on at which it is below 0 is found by bisection, from a guess in doubles (``next_below``). The
first tick at which several are is found by asking one after the other, from what the last has answered, until
none moves it on: each is below 0 in at most two pieces, so that ends soon.

* *Without a margin*, R = 0, a **visit** is a run of ticks at which d is inside M. It counts if d comes deeper
  than the strip, and contact is in the tick that begins it. A visit that is under way at the first tick that
  counts began by a rounding: contact is in the first tick in which d falls towards the face that was nearest.
* *With a margin* the contact is in the first tick in which d comes nearer to the corner or the face that is
  nearest at the tick's end, and is within R of it there: for a corner rule 5a.
* *Parting* is in the first tick at whose end d is farther than R from M.

The sign of a measure is computed in doubles, where their error leaves it open in sums of two of them, and at
last by ``bent_convex_integers``.

Error bounds
============

``place_at`` gives x + rest with an error of 2^-101 X, X being its size (``bent``). Less a corner, times the
vector across or along a face, summed, less the line's distance: each operation on sums of two doubles is off
by 8 u^2 of a product or 3 u^2 of a sum, u = 2^-53, of terms that are at most |v| (X + |x| + |c|): with two
products, four sums and the error of the place that is less than 80 u^2 of them for each axis; **2^-97** is
512 u^2. The distance of a line moved out by R is a sum of two doubles that is right to u^2 of itself. The
strip times the length of the vector is rounded three times: **2^-50** of it. The rate in the middle of a tick
is a velocity, off by 12 u^2 S, and an acceleration times a time, S + |b| t being the sizes: the same bound
holds. ``AWAY`` has d less a corner for the vector, off by 2^-101 X itself: as much again. In doubles alone
(``roughly``) all that is made of two doubles is taken for the first, and each of at most ten operations
rounds off u of a size: **2^-48** is 32 u.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from kinetile.kernel.certificates.bent import (
    Way,
    bent_closely,
    bent_parting,
    bent_touch,
    gap_sign,
    place_at,
    time_of,
    times,
    total,
    ways,
)
from kinetile.kernel.certificates.bent_convex_integers import (
    ALONG,
    AWAY,
    BEND,
    BEYOND,
    GAP,
    LINE,
    RATE,
    STRIP,
    VALUE,
    farther_out,
    sign_exactly,
)
from kinetile.kernel.certificates.contact import LARGE, TINY
from kinetile.kernel.certificates.convex_integers import (
    COUNT,
    CX,
    CX_LOW,
    CY,
    CY_LOW,
    FAR_LOW,
    FAR_OUT,
    FLUSH,
    HEAD,
    NX,
    NY,
    OUT,
    RADIUS,
    RADIUS_LOW,
    RANK,
    SIZE,
    TX,
    TX_LOW,
    TY,
    TY_LOW,
    WIDE,
    next_corner,
)
from kinetile.kernel.certificates.integers import LIMIT, as_count, between, narrowed
from kinetile.kernel.certificates.plans import BentAxis, BentPlans
from kinetile.kernel.compiled import Numbers, apart, hook, larger, smaller, subroutine
from kinetile.kernel.tables import NEVER


class Course(NamedTuple):
    """How the second body moves, seen from the first, and where the row of their difference begins."""

    row: int
    plans: BentPlans
    x: Way
    y: Way


@hook
def course_of(row: int, plans: BentPlans) -> Course:
    """Return what the measures of two bodies are made of."""
    x, y = ways(plans)
    return Course(row, plans, x, y)


@hook
def shifted(axis: BentAxis, corner: float, low: float) -> BentAxis:
    """Return the plans along an axis with the coordinate of a corner taken off the second body's place."""
    return BentAxis(axis.x, axis.v, axis.a, axis.x2, axis.v2, axis.a2, axis.turns, axis.period, corner, low)


@hook
def from_corner(f: Numbers, corner: int, plans: BentPlans) -> BentPlans:
    """Return two plans, the place of the second less a corner."""
    x = shifted(plans.x, f[corner + CX], f[corner + CX_LOW])
    y = shifted(plans.y, f[corner + CY], f[corner + CY_LOW])
    return BentPlans(x, y, plans.elapsed, plans.tick, plans.per_time)


@subroutine
def measured(f: Numbers, w: Course, face: int, kind: int, order: int, count: int) -> tuple[float, float]:
    """Return a measure after a number of ticks, or its rate in the tick that begins there, or twice what it
    bends by, as ``order`` says; and how far that can be off."""
    vx = f[face + TX]
    vx_low = f[face + TX_LOW]
    vy = f[face + TY]
    vy_low = f[face + TY_LOW]
    more = 1.0
    if kind <= LINE:
        vx, vx_low, vy, vy_low = vy, vy_low, -vx, -vx_low
    elif kind == AWAY:
        vx, vx_low = total(w.x.d, w.x.low, -f[face + CX], -f[face + CX_LOW])
        vy, vy_low = total(w.y.d, w.y.low, -f[face + CY], -f[face + CY_LOW])
        more = 2.0
    extra = 0.0
    extra_low = 0.0
    unsure = 0.0
    t, rest = time_of(count, w.plans.tick)
    if order == VALUE:
        ax, ax_low, x_size = place_at(w.x, t, rest)
        ay, ay_low, y_size = place_at(w.y, t, rest)
        if kind >= LINE:
            corner = next_corner(f, w.row, face) if kind == BEYOND else face
            ax, ax_low = total(ax, ax_low, -f[corner + CX], -f[corner + CX_LOW])
            ay, ay_low = total(ay, ay_low, -f[corner + CY], -f[corner + CY_LOW])
            x_size += abs(f[corner + CX])
            y_size += abs(f[corner + CY])
        else:
            extra = f[face + FAR_OUT]
            extra_low = f[face + FAR_LOW]
        if kind == STRIP:
            within = f[w.row + FLUSH] * math.sqrt(vx * vx + vy * vy)
            extra, extra_low = total(extra, extra_low, -within, 0.0)
            unsure = 2.0**-50 * within
    elif order == RATE:
        t, rest = total(t, rest, 0.5 * w.plans.tick, 0.0)
        ax, ax_low = times(w.x.b, w.x.c, t, rest)
        ay, ay_low = times(w.y.b, w.y.c, t, rest)
        ax, ax_low = total(ax, ax_low, w.x.u, w.x.w)
        ay, ay_low = total(ay, ay_low, w.y.u, w.y.w)
        x_size = w.x.speed + abs(w.x.b) * t
        y_size = w.y.speed + abs(w.y.b) * t
    else:
        ax, ax_low, ay, ay_low = w.x.b, w.x.c, w.y.b, w.y.c
        x_size = abs(w.x.b)
        y_size = abs(w.y.b)
    across, across_low = times(ax, ax_low, vx, vx_low)
    up, up_low = times(ay, ay_low, vy, vy_low)
    value, low = total(across, across_low, up, up_low)
    value, low = total(value, low, -extra, -extra_low)
    if kind == AWAY:
        size = (w.x.size + abs(f[face + CX])) * x_size + (w.y.size + abs(f[face + CY])) * y_size
    else:
        size = abs(vx) * (x_size + abs(ax)) + abs(vy) * (y_size + abs(ay)) + abs(extra)
    error = more * 2.0**-97 * size + unsure + TINY
    return value, error if size < LARGE and x_size < LARGE and y_size < LARGE else math.inf


@hook
def roughly(f: Numbers, w: Course, face: int, kind: int, order: int, count: int) -> tuple[float, float]:
    """Return what ``measured`` does, in doubles."""
    vx = f[face + TX]
    vy = f[face + TY]
    if kind <= LINE:
        vx, vy = vy, -vx
    elif kind == AWAY:
        vx = w.x.d - f[face + CX]
        vy = w.y.d - f[face + CY]
    t = float(count) * w.plans.tick
    ax = w.x.b
    ay = w.y.b
    x_size = abs(ax)
    y_size = abs(ay)
    if order == VALUE:
        corner = next_corner(f, w.row, face) if kind == BEYOND else face
        x_size = w.x.size + (w.x.speed + x_size * t) * t + abs(f[corner + CX])
        y_size = w.y.size + (w.y.speed + y_size * t) * t + abs(f[corner + CY])
        ax = (w.x.d + (w.x.u + 0.5 * ax * t) * t) - f[corner + CX]
        ay = (w.y.d + (w.y.u + 0.5 * ay * t) * t) - f[corner + CY]
    elif order == RATE:
        t += 0.5 * w.plans.tick
        ax = w.x.u + ax * t
        ay = w.y.u + ay * t
        x_size = w.x.speed + x_size * t
        y_size = w.y.speed + y_size * t
    value = ax * vx + ay * vy
    size = x_size * abs(vx) + y_size * abs(vy)
    if kind == AWAY:
        size += (w.x.size + abs(f[face + CX])) * x_size + (w.y.size + abs(f[face + CY])) * y_size
    elif order == VALUE and kind <= STRIP:
        away = (f[w.row + RADIUS] if kind == GAP else -f[w.row + FLUSH]) * math.sqrt(vx * vx + vy * vy)
        value -= away
        size += abs(away)
    error = 2.0**-48 * size + TINY
    return value, error if size < LARGE and x_size < LARGE and y_size < LARGE else math.inf


@subroutine
def sign_of(f: Numbers, w: Course, face: int, kind: int, order: int, count: int) -> int:
    """Return the sign of a measure, of its rate or of its bend, exactly."""
    value, error = roughly(f, w, face, kind, order, count)
    if not abs(value) > error:
        value, error = measured(f, w, face, kind, order, count)
    if not abs(value) > error:
        return int(sign_exactly(f, w.row, face, kind, order, w.plans, count))
    return 1 if value > 0.0 else -1


@subroutine
def guess_of(f: Numbers, w: Course, face: int, kind: int, order: int, way: int) -> int:
    """Return about after how many ticks a measure, times ``way``, falls below 0, or its rate changes sign."""
    first, _ = roughly(f, w, face, kind, VALUE, 0)
    rate, _ = roughly(f, w, face, kind, RATE, 0)
    bend, _ = roughly(f, w, face, kind, BEND, 0)
    first *= float(way)
    rate *= float(way)
    bend *= float(way)
    if order == RATE:
        return as_count(-rate / bend / w.plans.tick) if bend != 0.0 else 0
    root = math.sqrt(larger(rate * rate - 2.0 * bend * first, 0.0))
    if rate < 0.0:
        return as_count(2.0 * first / (root - rate) / w.plans.tick)
    return as_count((rate + root) / -bend / w.plans.tick) if bend < 0.0 else 0


@subroutine
def first_with(
    f: Numbers, w: Course, face: int, kind: int, order: int, way: int, closed: int, low: int, high: int
) -> int:
    """Return the first count after ``low`` at which a measure or its rate, times ``way``, is below 0, or at
    most 0 if ``closed`` is 1: it is at ``high``, not at ``low``, and changes once."""
    stride = 1
    guess = between(low, high, guess_of(f, w, face, kind, order, way))
    while high - low > 1:
        before = way * sign_of(f, w, face, kind, order, guess) >= closed
        low, high, guess, stride = narrowed(low, high, guess, stride, before)
    return int(high)


@subroutine
def next_below(f: Numbers, w: Course, face: int, kind: int, way: int, closed: int, start: int) -> int:
    """Return the first count from ``start`` on at which a measure, times ``way``, is below 0, or at most 0 if
    ``closed`` is 1; ``NEVER`` if there is none up to ``LIMIT``."""
    if start > LIMIT:
        return NEVER
    if way * sign_of(f, w, face, kind, VALUE, start) < closed:
        return start
    falls = next_falling(f, w, face, kind, way, start)
    if falls >= LIMIT:
        return NEVER
    stops = LIMIT
    if way * sign_of(f, w, face, kind, RATE, LIMIT) >= 0:
        stops = first_with(f, w, face, kind, RATE, -way, 1, falls, LIMIT)
    if way * sign_of(f, w, face, kind, VALUE, stops) >= closed:
        return NEVER
    return first_with(f, w, face, kind, VALUE, way, closed, falls, stops)


@subroutine
def next_falling(f: Numbers, w: Course, face: int, kind: int, way: int, start: int) -> int:
    """Return the first count from ``start`` on at which the rate of a measure, times ``way``, is below 0;
    ``NEVER`` if there is none up to ``LIMIT``."""
    if start > LIMIT:
        return NEVER
    if way * sign_of(f, w, face, kind, RATE, start) < 0:
        return start
    if way * sign_of(f, w, face, kind, RATE, LIMIT) >= 0:
        return NEVER
    return first_with(f, w, face, kind, RATE, way, 0, start, LIMIT)


@subroutine
def first_inside(f: Numbers, w: Course, kind: int, start: int) -> int:
    """Return the first count from ``start`` on at which a place is inside the lines of all faces."""
    count = int(f[w.row + COUNT])
    here = start
    agreed = 0
    k = 0
    while agreed < count:
        there = next_below(f, w, w.row + HEAD + k * WIDE, kind, 1, 0, here)
        if there == NEVER:
            return NEVER
        agreed = agreed + 1 if there == here else 1
        here = there
        k = (k + 1) % count
    return here


@subroutine
def first_outside(f: Numbers, w: Course, kind: int, closed: int, start: int) -> int:
    """Return the first count from ``start`` on at which a place is outside a line, or on it if ``closed``."""
    found = NEVER
    for k in range(int(f[w.row + COUNT])):
        face = w.row + HEAD + k * WIDE
        found = smaller(found, next_below(f, w, face, kind, -1, closed, start))
    return int(found)


@subroutine
def nearest_face(f: Numbers, w: Course, count: int) -> int:
    """Return the face whose line a place is farthest out of, or least deep in, after a number of ticks; of
    several the one with the smallest number."""
    t, rest = time_of(count, w.plans.tick)
    px, _, x_size = place_at(w.x, t, rest)
    py, _, y_size = place_at(w.y, t, rest)
    doubt = 2.0**-48 * (x_size + y_size + f[w.row + SIZE])
    found = w.row + HEAD
    for face in range(w.row + HEAD + WIDE, w.row + HEAD + int(f[w.row + COUNT]) * WIDE, WIDE):
        gap = (f[face + NX] - f[found + NX]) * px + (f[face + NY] - f[found + NY]) * py
        gap -= f[face + OUT] - f[found + OUT]
        farther = 1 if gap > doubt else -1
        if not abs(gap) > doubt:
            farther = farther_out(f, w.row, face, found, w.plans, count)
        if farther > 0 or (farther == 0 and f[face + RANK] < f[found + RANK]):
            found = face
    return found


@subroutine
def is_over(f: Numbers, w: Course, face: int, count: int) -> bool:
    """Whether a place is over a face, its ends included, on the outer side of its line or on it."""
    if sign_of(f, w, face, LINE, VALUE, count) < 0 or sign_of(f, w, face, ALONG, VALUE, count) < 0:
        return False
    return sign_of(f, w, face, BEYOND, VALUE, count) <= 0


@subroutine
def first_beside(f: Numbers, w: Course, corner: int, start: int) -> int:
    """Return the first count from ``start`` on at which a place is between the two faces at a corner."""
    first = w.row + HEAD
    before = corner - WIDE if corner > first else first + (int(f[w.row + COUNT]) - 1) * WIDE
    here = start
    while True:
        there = next_below(f, w, before, BEYOND, -1, 1, next_below(f, w, corner, ALONG, 1, 1, here))
        if there == NEVER or there == here:  # noqa: SIM109 - no tuple in a hook
            return there
        here = there


@subroutine
def nearer_to_corner(f: Numbers, w: Course, corner: int, start: int) -> int:
    """Return the first tick from ``start`` on at whose end a corner is nearest, and in which rule 5a holds of
    the disc around it."""
    own = from_corner(f, corner, w.plans)
    tick = start
    while True:
        tick = bent_closely(own, f[w.row + RADIUS], f[w.row + RADIUS_LOW], 1, 0, 0, tick)
        if tick == NEVER:
            return NEVER
        there = first_beside(f, w, corner, tick + 1)
        if there == NEVER or there == tick + 1:
            return NEVER if there == NEVER else int(tick)
        tick = there - 1


@subroutine
def nearer_to_face(f: Numbers, w: Course, face: int, start: int) -> int:
    """Return the first tick from ``start`` on at whose end a place is over a face and within R of it, and in
    which it comes nearer."""
    here = start + 1
    while True:
        there = next_below(f, w, face, GAP, 1, 0, here)
        there = next_below(f, w, face, ALONG, -1, 1, there)
        there = next_below(f, w, face, BEYOND, 1, 1, there)
        there = next_below(f, w, face, LINE, -1, 1, there)
        falls = next_falling(f, w, face, LINE, 1, there - 1)
        there = falls + 1 if falls < LIMIT else NEVER
        if there == NEVER or there == here:  # noqa: SIM109 - no tuple in a hook
            return NEVER if there == NEVER else int(there - 1)
        here = there


@subroutine
def counts_after(f: Numbers, w: Course) -> int:
    """Return from which tick on two that have just met may meet again (rule 7t)."""
    count = int(f[w.row + COUNT])
    outside = f[w.row + RADIUS] == 0.0
    face = -1
    kind = LINE
    if not outside:
        for k in range(count):
            this = w.row + HEAD + k * WIDE
            beyond = sign_of(f, w, this, LINE, VALUE, 0) > 0
            outside = outside or beyond
            if face < 0 and beyond and is_over(f, w, this, 0):
                face = this
        if face < 0 and (outside or count == 2):
            for k in range(count):
                this = w.row + HEAD + k * WIDE
                if face < 0 and first_beside(f, w, this, 0) == 0:
                    face = this
                    kind = AWAY
    if face < 0:
        face = nearest_face(f, w, 0)
    rate = sign_of(f, w, face, kind, RATE, 0)
    if rate > 0 or sign_of(f, w, face, kind, BEND, 0) < 0:
        return 0
    return next_falling(f, w, face, kind, -1, 0)


@subroutine
def first_visit(f: Numbers, w: Course, start: int) -> int:
    """Return the tick of contact where there is no margin, from ``start`` on."""
    here = start
    while True:
        begins = first_inside(f, w, GAP, here)
        if begins == NEVER:
            return NEVER
        ends = first_outside(f, w, GAP, 1, begins)
        if first_inside(f, w, STRIP, begins) < ends:
            if begins > start:
                return int(begins - 1)
            face = nearest_face(f, w, start)
            falls = next_falling(f, w, face, LINE, 1, start)
            if falls < ends - 1:  # it may be NEVER
                return falls
        if ends >= LIMIT:
            return NEVER
        here = ends


@apart
def bent_enters(f: Numbers, row: int, plans: BentPlans, met: int, since: int) -> int:
    """Return how many ticks after the later anchor two convex bodies touch, from ``since`` on, or ``NEVER``;
    ``met`` is 1 if they have just met. ``row`` is as in ``enters``."""
    count = int(f[row + COUNT])
    if count == 1:
        own = from_corner(f, row + HEAD, plans)
        return int(bent_touch(own, f[row + RADIUS], f[row + RADIUS_LOW], met > 0, -1, since))
    w = course_of(row, plans)
    start = since
    if met > 0:
        start = larger(start, counts_after(f, w))
    if start >= LIMIT:
        return NEVER
    if f[row + RADIUS] == 0.0:
        return first_visit(f, w, start) if count > 2 else NEVER
    found = NEVER
    for k in range(count):
        this = row + HEAD + k * WIDE
        found = smaller(found, nearer_to_face(f, w, this, start))
        found = smaller(found, nearer_to_corner(f, w, this, start))
    return int(found)


@apart
def bent_nearer(f: Numbers, row: int, face: int, plans: BentPlans) -> int:
    """Return 1 if a second body comes nearer to a face of a first in the tick after the later anchor."""
    w = course_of(row, plans)
    return 1 if sign_of(f, w, face, LINE, RATE, 0) < 0 else 0


@apart
def bent_leaves(f: Numbers, row: int, plans: BentPlans, since: int) -> int:
    """Return how many ticks after the later anchor two bodies part, from ``since`` on, or ``NEVER``."""
    count = int(f[row + COUNT])
    if count == 1:
        own = from_corner(f, row + HEAD, plans)
        return int(bent_parting(own, f[row + RADIUS], f[row + RADIUS_LOW], since))
    w = course_of(row, plans)
    here = since + 1
    moved = True
    while moved and here <= LIMIT:
        moved = False
        if count > 2:
            there = first_outside(f, w, LINE, 0, here)
            moved = there > here
            here = there
        for k in range(count if f[row + RADIUS] > 0.0 and here <= LIMIT else 0):
            this = row + HEAD + k * WIDE
            if is_over(f, w, this, here):
                there = next_below(f, w, this, GAP, -1, 0, here)
                there = smaller(there, next_below(f, w, this, ALONG, 1, 0, here))
                there = smaller(there, next_below(f, w, this, BEYOND, -1, 0, here))
                there = smaller(there, next_below(f, w, this, LINE, 1, 0, here))
                moved = moved or there > here
                here = there
            own = from_corner(f, this, plans)
            if here <= LIMIT and gap_sign(own, f[row + RADIUS], f[row + RADIUS_LOW], here) <= 0:
                there = bent_closely(own, f[row + RADIUS], f[row + RADIUS_LOW], -1, 0, 0, here)
                here = there + 1 if there < LIMIT else NEVER
                moved = True
    return int(here - 1) if here <= LIMIT else NEVER
