"""The exact ticks of contact and of parting of two convex bodies that do not rotate.

Seen from the first body, the place d of the second moves on a line, or with accelerations on a parabola. The
two touch where d comes within the sum R of their radii of the difference M of their cores
(docs/specification.md, rules 5s, 7s and 11s). There are three stages; each decides, or leaves the decision to
the next.

*A filter*, without accelerations (``enters_surely``, ``leaves_surely``): the place comes within the lines of
all faces, moved out by R, at the last crossing inwards, unless it has crossed one outwards before. Then one
step in compensated arithmetic finds the tick in which the gap to this face closes (``tick_at_face``). Without
a margin, a place may only graze M on entering, no deeper than the strip: a visit counts if the place surely
is deeper at one whole tick, half way through (``is_deep``).

*Measures* of d(n) at whole ticks n, for all plans: the distance of d beyond the line of a face, moved out by
R (``GAP``), by R less the strip (``STRIP``) or not moved (``LINE``); and the place along a face, from its
first corner (``ALONG``) and from its last (``BEYOND``). Each is of degree 2 in n. So it falls on one side of
its vertex and rises on the other, and bisection finds the first tick from some n on at which it is below 0,
from a guess in doubles (``next_below``). To find the first tick at which several are below 0, each in turn
starts from the tick of the last one, until none moves the tick on: each is below 0 in at most two pieces, so
this ends soon.

* *Without a margin*, R = 0, a **visit** is a run of ticks at which d is inside M. It counts if d comes deeper
  than the strip, and contact is in the tick that begins it. A visit that is under way at the first tick that
  counts began by a rounding: contact is in the first tick in which d falls towards the faces that were
  nearest.
* *With a margin* the contact is in the first tick in which d comes nearer to the corner or the face that is
  nearest at the tick's end, and is within R of it there: for a corner rule 5. Or d comes into M at once. The
  contact counts if d comes nearer than R less the strip in the same way, before it parts.
* *Parting* is the same with the sense reversed: the first tick in which d comes beyond a face, or farther
  than R from the nearest one.

*The sign* of a measure is computed in doubles; if their error leaves it open, in sums of two doubles; and at
last in whole numbers (``shapes_exactly``).

Error bounds of the filter
==========================

u is 2^-53, size the sum of the magnitudes of all terms of d and the corners.

- *In double.* The gap to the line of each face, moved out by R, n.d - h with n of length 1, is off by less
  than eight roundings of size: 2^-48 size covers it. Its rate n.v is off by less than 2^-50 of |vx| + |vy|.
  So each crossing has an interval, and the classification uses intervals: which face is crossed inwards
  last, whether any is crossed outwards before, and, at that time, whether the place is over the face or
  beyond one of its corners. Rates within their error, ties of two faces and starts on a line are left open.
- *Deeper by the strip.* From the line of a face that takes speed / rate times the strip; from the disc around
  a corner at most R w |v| / root, w being the strip and root^2 = (R - w)^2 |v|^2 - (d x v)^2, since roots of
  A and B differ by at most (A - B) / (2 root of B). On that way the place must still be over the face, or
  beside the corner.
- *Room for a tick.* A condition at a crossing must hold at the tick's end as well: the way of a tick is added
  to the distances required over or beside a face, and a margin must be wider than four such ways.
- *A corner.* From a tip, outside the margin but inside the lines of two faces, only the disc around their
  corner can be entered, or the lines be left: the case of two discs (``discs``), the corner subtracted from
  d and from its rounding.
- *A face.* With x + rest, x a double, along each axis, and the vector along the face a sum of two doubles,
  n.d - h is computed with every rounding of a product or a sum caught except in products of two roundings:
  2^-97 of the sum of the magnitudes, and 2^-52 of the result. One step from the estimate, as for discs.
- *Parting.* A line that leaves a convex set at a point of its outline, inwards before, does not come back. So
  it is enough to find one such point: where the line of a face, moved out by R, is crossed outwards, the
  place being surely between the face's ends; or where the disc around a corner is left, the place being
  surely beyond the faces on both sides. Without a margin it is the first crossing outwards of any face.

Error bounds of the measures
============================

*Ties.* On lattices a measure often is 0 at whole ticks. The gap to a face is n.(d - c), c being a corner of
it, so it is a multiple of the lowest bit of n times the lesser of the grain of d (``separation``) and the
lowest bit of c. If the computed value and its bound together are less than that, it is 0.

``place_at`` gives x + rest with an error of 2^-101 X, X being its size (``separation``). Less a corner, times
the vector across or along a face, summed, less the line's distance: each operation on sums of two doubles is
off by 8 u^2 of a product or 3 u^2 of a sum, u = 2^-53, of terms that are at most |v| (X + |x| + |c|): with
two products, four sums and the error of the place that is less than 80 u^2 of them for each axis; **2^-97**
is 512 u^2. The distance of a line moved out by R is a sum of two doubles that is right to u^2 of itself. The
strip times the length of the vector is rounded three times: **2^-50** of it. The rate in the middle of a tick
is a velocity, off by 12 u^2 S, and an acceleration times a time, S + |b| t being the sizes: the same bound
holds. ``AWAY`` has d less a corner for the vector, off by 2^-101 X itself: as much again. In doubles alone
(``roughly``) all sums of two doubles are replaced by the first double, and each of at most ten operations
rounds off u of a size: **2^-48** is 32 u.
"""

import math
from typing import NamedTuple

from kinetile.kernel.certificates.digits import LIMIT, as_count, between, narrowed
from kinetile.kernel.certificates.discs import (
    OPEN,
    closely,
    filtered,
    filtered_parting,
    floor_of,
    have_one_acceleration,
    have_one_velocity,
    is_accelerated,
    parting,
    touch,
)
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.certificates.separation import (
    LARGE,
    SMALL,
    TINY,
    Motion,
    Separation,
    grain_at,
    grain_of,
    less_corner,
    motions,
    place_at,
    plus,
    separation_at,
    separations,
    time_of,
    times,
    total,
)
from kinetile.kernel.certificates.shapes_exactly import (
    ALL_SIZES,
    ALONG,
    AWAY,
    BEND,
    BEYOND,
    CORNERS,
    CX,
    CX_LOW,
    CY,
    CY_LOW,
    FAR_LOW,
    FAR_OUT,
    FIRST_CORNER,
    FLUSH,
    GAP,
    ITSELF,
    LINE,
    NX,
    NY,
    OUT,
    RADIUS,
    RADIUS_LOW,
    RATE,
    STRIP,
    TX,
    TX_LOW,
    TY,
    TY_LOW,
    WIDE,
    farther_out,
    margin_of,
    next_corner,
    sign_exactly,
)
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import Numbers, apart, hook, larger, smaller, subroutine
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error


@hook
def gap_to_face(
    f: Numbers, face: int, t: float, along_x: Separation, along_y: Separation
) -> tuple[float, float]:
    """Returns the distance of a place outside the line of a face, moved out by R, at a time t after the later
    anchor, in units of the length of the vector along the face; and a bound of its error."""
    nx = f[face + TY]
    ny = -f[face + TX]
    x, x_rest = separation_at(t, along_x)
    y, y_rest = separation_at(t, along_y)
    across = nx * x
    up = ny * y
    both, both_low = plus(across, up)
    gap, gap_low = plus(both, -f[face + FAR_OUT])
    mixed = (nx * x_rest + f[face + TY_LOW] * x) + (ny * y_rest - f[face + TX_LOW] * y)
    lost = product_error(nx, x, across) + product_error(ny, y, up)
    size = abs(nx) * (along_x.size + abs(x)) + abs(ny) * (along_y.size + abs(y)) + abs(f[face + FAR_OUT])
    outside = gap + (((both_low + gap_low) + lost) + (mixed - f[face + FAR_LOW]))
    return outside, 2.0**-97 * size + 2.0**-52 * abs(outside) + TINY


@hook
def is_still(nx: float, ny: float, x: Separation, y: Separation) -> bool:
    """Returns True if a place does not move across a line at all."""
    return (nx == 0.0 or (x.u == 0.0 and x.w == 0.0)) and (ny == 0.0 or (y.u == 0.0 and y.w == 0.0))


@hook
def tick_at_face(f: Numbers, face: int, t: float, x: Separation, y: Separation, per_time: float) -> int:
    """Returns the tick after the later anchor of a place's crossing of the line of a face, moved out by R,
    given an estimate t > 0 of the time; ``OPEN`` if that is not sure."""
    outside, error = gap_to_face(f, face, t, x, y)
    rate = f[face + TX] * y.u - f[face + TY] * x.u
    unsure = 2.0**-50 * (abs(f[face + TX] * y.u) + abs(f[face + TY] * x.u))
    ticks = t * per_time
    if abs(rate) > 2.0 * unsure and ticks < FAR:
        step = outside / rate
        bound = (error + abs(step) * unsure) / (abs(rate) - unsure) * per_time * (1.0 + 2.0**-20)
        step *= per_time
        bound += 2.0**-49 * abs(step) + 2.0**-50
        if bound < 0.5:
            return floor_of(ticks, step, bound)
    return OPEN


@hook
def along_face(
    f: Numbers, row: int, face: int, x: Separation, y: Separation, t: float
) -> tuple[float, float]:
    """Returns the distances of a place beyond a face's first and last corner at a time, along its way."""
    end = next_corner(f, row, face)
    nx = f[face + NX]
    ny = f[face + NY]
    px = x.d + x.u * t
    py = y.d + y.u * t
    first = nx * (py - f[face + CY]) - ny * (px - f[face + CX])
    return first, nx * (py - f[end + CY]) - ny * (px - f[end + CX])


@hook
def is_deep(f: Numbers, row: int, x: Separation, y: Separation, t: float, around: float) -> bool:
    """Returns True if a place surely is deeper in M than the strip at the whole tick nearest to a time."""
    deep = True
    for face in range(row + FIRST_CORNER, row + FIRST_CORNER + int(f[row + CORNERS]) * WIDE, WIDE):
        nx = f[face + NX]
        ny = f[face + NY]
        gap = (nx * x.d + ny * y.d) - f[face + OUT]
        deep = deep and gap + (nx * x.u + ny * y.u) * t < -(f[row + FLUSH] + around)
    return deep


@hook
def is_beside(
    f: Numbers, row: int, corner: int, x: Separation, y: Separation, t: float, around: float
) -> bool:
    """Returns True if a place surely is beyond the faces on both sides of a corner at a time."""
    first = row + FIRST_CORNER
    before = corner - WIDE if corner > first else first + (int(f[row + CORNERS]) - 1) * WIDE
    here, _ = along_face(f, row, corner, x, y, t)
    _, there = along_face(f, row, before, x, y, t)
    return here < -around and there > around


@hook
def last_corner(f: Numbers, row: int, x: Separation, y: Separation) -> int:
    """Returns the corner whose disc a place leaves last, or the corner that it passes nearest."""
    reach = f[row + RADIUS]
    speed2 = x.u * x.u + y.u * y.u
    found = row + FIRST_CORNER
    latest = -math.inf
    for corner in range(row + FIRST_CORNER, row + FIRST_CORNER + int(f[row + CORNERS]) * WIDE, WIDE):
        px = x.d - f[corner + CX]
        py = y.d - f[corner + CY]
        across = px * y.u - py * x.u
        root = math.sqrt(larger(reach * reach * speed2 - across * across, 0.0))
        last = root - (px * x.u + py * y.u)
        if root > 0.0 and last > latest:
            latest = last
            found = corner
    return found


@apart
def leaves_surely(f: Numbers, row: int, plans: Plans) -> int:
    """Returns the number of ticks until two convex bodies without accelerations part, or ``OPEN``."""
    x, y = separations(plans)
    per_time = plans.per_time
    count = int(f[row + CORNERS])
    reach = f[row + RADIUS]
    size = (x.size + y.size) + f[row + ALL_SIZES]
    speed = abs(x.u) + abs(y.u)
    if not (speed > SMALL and speed < LARGE and size < LARGE):
        return OPEN
    doubt = 2.0**-48 * size
    slack = 2.0**-50 * speed
    moved = speed * plans.per_tick
    out = math.inf
    rate = 0.0
    face = -1
    for this in range(row + FIRST_CORNER, row + FIRST_CORNER + count * WIDE, WIDE):
        rises = f[this + NX] * x.u + f[this + NY] * y.u
        if rises > slack:
            t = (f[this + OUT] - (f[this + NX] * x.d + f[this + NY] * y.d)) / rises
            if t < out:
                out = t
                rate = rises
                face = this
    if face < 0 or not out * speed < 2.0**20 * size:
        return OPEN
    error = (doubt + slack * abs(out)) / (rate - slack)
    first, last = along_face(f, row, face, x, y, out)
    around = doubt + speed * error + moved
    if first > around and last < -around:
        return tick_at_face(f, face, out, x, y, per_time) if out > error else OPEN
    if reach > 4.0 * moved + doubt:
        corner = last_corner(f, row, x, y)
        around_x = less_corner(x, f[corner + CX], f[corner + CX_LOW])
        around_y = less_corner(y, f[corner + CY], f[corner + CY_LOW])
        found, t = filtered_parting(around_x, around_y, reach, f[row + RADIUS_LOW], per_time)
        if (
            found != OPEN
            and t > 0.0
            and is_beside(f, row, corner, x, y, t, 2.0 * (doubt + moved + slack * t))
        ):
            return found
    return OPEN


class Approach(NamedTuple):
    """The motion of the second body seen from the first, and the row of their difference."""

    row: int
    plans: Plans
    x: Motion
    y: Motion


@hook
def approach_of(row: int, plans: Plans) -> Approach:
    """Returns the data for the measures of two bodies."""
    x, y = motions(plans)
    return Approach(row, plans, x, y)


@hook
def shifted(axis: Axis, corner: float, low: float) -> Axis:
    """Returns the plans along an axis, a corner's coordinate subtracted from the second body's place."""
    return Axis(axis.x, axis.v, axis.a, axis.x2, axis.v2, axis.a2, axis.turns, axis.period, corner, low)


@hook
def from_corner(f: Numbers, corner: int, plans: Plans) -> Plans:
    """Returns two plans, the place of the second less a corner."""
    x = shifted(plans.x, f[corner + CX], f[corner + CX_LOW])
    y = shifted(plans.y, f[corner + CY], f[corner + CY_LOW])
    return Plans(x, y, plans.elapsed, plans.per_tick, plans.per_time)


@subroutine
def measured(f: Numbers, w: Approach, face: int, kind: int, order: int, count: int) -> tuple[float, float]:
    """Returns a measure after a number of ticks, or its rate in the tick that begins there, or twice its
    bend, by ``order``; and a bound of its error."""
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
    t, rest = time_of(count, w.plans.per_tick)
    if order == ITSELF:
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
            width, _ = margin_of(f, w.row, STRIP)
            within = (f[w.row + RADIUS] - width) + f[w.row + RADIUS_LOW]
            within *= math.sqrt(vx * vx + vy * vy)
            extra, extra_low = total(extra, extra_low, -within, 0.0)
            unsure = 2.0**-50 * abs(within)
    elif order == RATE:
        t, rest = total(t, rest, 0.5 * w.plans.per_tick, 0.0)
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
def roughly(f: Numbers, w: Approach, face: int, kind: int, order: int, count: int) -> tuple[float, float]:
    """Returns the same as ``measured``, in doubles."""
    vx = f[face + TX]
    vy = f[face + TY]
    if kind <= LINE:
        vx, vy = vy, -vx
    elif kind == AWAY:
        vx = w.x.d - f[face + CX]
        vy = w.y.d - f[face + CY]
    t = float(count) * w.plans.per_tick
    ax = w.x.b
    ay = w.y.b
    x_size = abs(ax)
    y_size = abs(ay)
    if order == ITSELF:
        corner = next_corner(f, w.row, face) if kind == BEYOND else face
        x_size = w.x.size + (w.x.speed + x_size * t) * t + abs(f[corner + CX])
        y_size = w.y.size + (w.y.speed + y_size * t) * t + abs(f[corner + CY])
        ax = (w.x.d + (w.x.u + 0.5 * ax * t) * t) - f[corner + CX]
        ay = (w.y.d + (w.y.u + 0.5 * ay * t) * t) - f[corner + CY]
    elif order == RATE:
        t += 0.5 * w.plans.per_tick
        ax = w.x.u + ax * t
        ay = w.y.u + ay * t
        x_size = w.x.speed + x_size * t
        y_size = w.y.speed + y_size * t
    value = ax * vx + ay * vy
    size = x_size * abs(vx) + y_size * abs(vy)
    if kind == AWAY:
        size += (w.x.size + abs(f[face + CX])) * x_size + (w.y.size + abs(f[face + CY])) * y_size
    elif order == ITSELF and kind <= STRIP:
        width, _ = margin_of(f, w.row, kind)
        away = width * math.sqrt(vx * vx + vy * vy)
        value -= away
        size += abs(away)
    error = 2.0**-48 * size + TINY
    return value, error if size < LARGE and x_size < LARGE and y_size < LARGE else math.inf


@subroutine
def grain_of_measure(f: Numbers, w: Approach, face: int, kind: int, order: int, count: int) -> float:
    """Returns a power of two that divides a measure after a number of ticks, or its rate without
    accelerations; or 0."""
    wide = kind == GAP and f[w.row + RADIUS] > 0.0
    if wide or kind == STRIP or kind == AWAY:  # noqa: SIM109 - no tuple in a hook
        return 0.0
    grain = math.inf
    for at in (TX, TX_LOW, TY, TY_LOW):
        grain = smaller(grain, grain_of(f[face + at]))
    place = math.inf
    corner = next_corner(f, w.row, face) if kind == BEYOND else face
    for axis in (w.plans.x, w.plans.y):
        if order != ITSELF:
            place = smaller(place, smaller(grain_of(axis.v), grain_of(axis.v2)))
        else:
            place = smaller(place, grain_at(axis, w.plans.elapsed, count, w.plans.per_tick))
    if order == ITSELF:
        for at in (CX, CX_LOW, CY, CY_LOW):
            place = smaller(place, grain_of(f[corner + at]))
    return 0.0 if order != ITSELF and is_accelerated(w.plans) else float(grain * place)


@subroutine
def sign_of(f: Numbers, w: Approach, face: int, kind: int, order: int, count: int) -> int:
    """Returns the sign of a measure, of its rate or of its bend, exactly."""
    value, error = roughly(f, w, face, kind, order, count)
    if not abs(value) > error:
        value, error = measured(f, w, face, kind, order, count)
    if not abs(value) > error:
        if abs(value) + error < grain_of_measure(f, w, face, kind, order, count):
            return 0
        return int(sign_exactly(f, w.row, face, kind, order, w.plans, count))
    return 1 if value > 0.0 else -1


@subroutine
def guess_of(f: Numbers, w: Approach, face: int, kind: int, order: int, sense: int) -> int:
    """Returns about the number of ticks until a measure, times ``sense``, falls below 0, or its rate changes
    sign."""
    first, _ = roughly(f, w, face, kind, ITSELF, 0)
    rate, _ = roughly(f, w, face, kind, RATE, 0)
    bend, _ = roughly(f, w, face, kind, BEND, 0)
    first *= float(sense)
    rate *= float(sense)
    bend *= float(sense)
    if order == RATE:
        return as_count(-rate / bend / w.plans.per_tick) if bend != 0.0 else 0
    root = math.sqrt(larger(rate * rate - 2.0 * bend * first, 0.0))
    if rate < 0.0:
        return as_count(2.0 * first / (root - rate) / w.plans.per_tick)
    return as_count((rate + root) / -bend / w.plans.per_tick) if bend < 0.0 else 0


@subroutine
def first_with(
    f: Numbers, w: Approach, face: int, kind: int, order: int, sense: int, closed: int, low: int, high: int
) -> int:
    """Returns the first count after ``low`` with a measure or its rate, times ``sense``, below 0, or at most
    0 if ``closed`` is 1: it is so at ``high``, not at ``low``, and changes once."""
    stride = 1
    guess = between(low, high, guess_of(f, w, face, kind, order, sense))
    while high - low > 1:
        before = sense * sign_of(f, w, face, kind, order, guess) >= closed
        low, high, guess, stride = narrowed(low, high, guess, stride, before)
    return int(high)


@subroutine
def next_below(f: Numbers, w: Approach, face: int, kind: int, sense: int, closed: int, start: int) -> int:
    """Returns the first count from ``start`` on with a measure, times ``sense``, below 0, or at most 0 if
    ``closed`` is 1; ``NEVER`` without one up to ``LIMIT``."""
    if start > LIMIT:
        return NEVER
    if sense * sign_of(f, w, face, kind, ITSELF, start) < closed:
        return start
    falls = next_falling(f, w, face, kind, sense, start)
    if falls >= LIMIT:
        return NEVER
    stops = LIMIT
    if sense * sign_of(f, w, face, kind, RATE, LIMIT) >= 0:
        stops = first_with(f, w, face, kind, RATE, -sense, 1, falls, LIMIT)
    if sense * sign_of(f, w, face, kind, ITSELF, stops) >= closed:
        return NEVER
    return first_with(f, w, face, kind, ITSELF, sense, closed, falls, stops)


@subroutine
def next_falling(f: Numbers, w: Approach, face: int, kind: int, sense: int, start: int) -> int:
    """Returns the first count from ``start`` on with the rate of a measure, times ``sense``, below 0;
    ``NEVER`` without one up to ``LIMIT``."""
    if start > LIMIT:
        return NEVER
    if sense * sign_of(f, w, face, kind, RATE, start) < 0:
        return start
    if sense * sign_of(f, w, face, kind, RATE, LIMIT) >= 0:
        return NEVER
    return first_with(f, w, face, kind, RATE, sense, 0, start, LIMIT)


@subroutine
def first_inside(f: Numbers, w: Approach, kind: int, start: int) -> int:
    """Returns the first count from ``start`` on with a place inside the lines of all faces."""
    count = int(f[w.row + CORNERS])
    here = start
    agreed = 0
    k = 0
    while agreed < count:
        there = next_below(f, w, w.row + FIRST_CORNER + k * WIDE, kind, 1, 0, here)
        if there == NEVER:
            return NEVER
        agreed = agreed + 1 if there == here else 1
        here = there
        k = (k + 1) % count
    return here


@subroutine
def first_outside(f: Numbers, w: Approach, kind: int, closed: int, start: int) -> int:
    """Returns the first count from ``start`` on with a place outside a line, or on it if ``closed``."""
    found = NEVER
    for k in range(int(f[w.row + CORNERS])):
        face = w.row + FIRST_CORNER + k * WIDE
        found = smaller(found, next_below(f, w, face, kind, -1, closed, start))
    return int(found)


@subroutine
def is_inside(f: Numbers, w: Approach, count: int) -> bool:
    """Returns True if a place is within the lines of all faces, moved out by R, after a number of ticks."""
    for face in range(w.row + FIRST_CORNER, w.row + FIRST_CORNER + int(f[w.row + CORNERS]) * WIDE, WIDE):
        if sign_of(f, w, face, GAP, ITSELF, count) >= 0:
            return False
    return True


@subroutine
def at_whole_tick(f: Numbers, row: int, plans: Plans, guess: int, deep: bool) -> int:
    """Returns the tick of a place's entry into a difference without a margin, if it is near a guess, or
    ``NEVER`` if the place stays outside of one line, or ``OPEN``. Without accelerations it is inside for one
    run of ticks; ``deep``: at some tick deeper than the strip."""
    w = approach_of(row, plans)
    for face in range(row + FIRST_CORNER, row + FIRST_CORNER + int(f[row + CORNERS]) * WIDE, WIDE):
        rises = sign_of(f, w, face, LINE, RATE, 0) >= 0
        if rises and sign_of(f, w, face, GAP, ITSELF, 0) >= 0:
            return NEVER
    if deep and guess < LIMIT:
        if is_inside(f, w, guess):
            return guess - 1 if guess > 0 and not is_inside(f, w, guess - 1) else OPEN
        return guess if is_inside(f, w, guess + 1) else OPEN
    return OPEN


class Crossings(NamedTuple):
    """The times of a place's crossings of the lines of the faces, moved out by R: inwards last at ``into``,
    off by ``into_error``, at most ``latest``; outwards not before ``stays``, and surely by ``out``.
    ``highest`` is the largest gap at time 0. It ``misses`` if it stays outside of a line; ``known``: no rate
    is within its error, except for lines that it surely is within."""

    into: float
    into_error: float
    latest: float
    out: float
    stays: float
    highest: float
    misses: bool
    known: bool


@hook
def crossings_of(
    f: Numbers, row: int, x: Separation, y: Separation, size: float, doubt: float, slack: float, until: float
) -> Crossings:
    """Returns the crossings of all faces; outward ones after ``until`` do not count."""
    into = -math.inf
    into_error = 0.0
    latest = -math.inf
    out = math.inf
    stays = until
    highest = -math.inf
    misses = False
    known = True
    for face in range(row + FIRST_CORNER, row + FIRST_CORNER + int(f[row + CORNERS]) * WIDE, WIDE):
        nx = f[face + NX]
        ny = f[face + NY]
        gap = (nx * x.d + ny * y.d) - f[face + OUT]
        rate = nx * x.u + ny * y.u
        highest = larger(highest, gap)
        if abs(rate) <= slack:
            still = is_still(nx, ny, x, y)
            misses = misses or (still and gap > doubt)
            known = known and gap < (-doubt if still else -(2.0**-20) * size)
            continue
        t = -gap / rate
        error = (doubt + slack * abs(t)) / (abs(rate) - slack)
        if rate > 0.0:
            out = smaller(out, t + error)
            stays = smaller(stays, t - error)
        else:
            latest = larger(latest, t + error)
            if t > into:
                into = t
                into_error = error
    misses = misses or into - into_error > out or out < 0.0
    return Crossings(into, into_error, latest, out, stays, highest, misses, known)


@hook
def enters_at_corner(
    f: Numbers, row: int, corner: int, x: Separation, y: Separation, plans: Plans, doubt: float, slack: float
) -> int:
    """Returns the number of ticks until a place enters the disc around a corner, with the margin, and with
    the strip's margin as well, beyond the faces beside it; or another answer of ``filtered``, or ``OPEN``."""
    reach = f[row + RADIUS]
    corner_x = less_corner(x, f[corner + CX], f[corner + CX_LOW])
    corner_y = less_corner(y, f[corner + CY], f[corner + CY_LOW])
    found = filtered(corner_x, corner_y, reach, f[row + RADIUS_LOW], plans.per_time)
    if found == NEVER or found == OPEN:  # noqa: SIM109 - no tuple in a hook
        return found
    speed = abs(x.u) + abs(y.u)
    moved = speed * plans.per_tick
    t = float(found) * plans.per_tick
    inner = reach - (f[row + FLUSH] + 2.0 * doubt + moved)
    cross = corner_x.d * y.u - corner_y.d * x.u
    root = math.sqrt(larger(inner * inner * (x.u * x.u + y.u * y.u) - cross * cross, 0.0))
    around = 2.0 * (doubt + moved + slack * t) + reach * (reach - inner) * speed / root
    known = inner > 0.0 and root > 0.0 and t + 2.0 * around / speed < FAR * plans.per_tick
    return found if known and is_beside(f, row, corner, x, y, t, around) else OPEN


@apart
def enters_surely(f: Numbers, row: int, plans: Plans) -> int:
    """Returns the number of ticks until two convex bodies without accelerations touch, or ``OPEN``."""
    x, y = separations(plans)
    per_time = plans.per_time
    faces = row + FIRST_CORNER
    reach = f[row + RADIUS]
    size = (x.size + y.size) + f[row + ALL_SIZES]
    speed = abs(x.u) + abs(y.u)
    if not (speed > SMALL and speed < LARGE and size < LARGE):
        return OPEN
    doubt = 2.0**-48 * size
    slack = 2.0**-50 * speed
    moved = speed * plans.per_tick
    last_time = FAR * plans.per_tick
    c = crossings_of(f, row, x, y, size, doubt, slack, last_time)
    if c.misses:
        return NEVER
    comes = c.into - c.into_error
    known = c.known and (reach == 0.0 or reach > 4.0 * moved + doubt)
    known = known and c.into * speed < 2.0**20 * size and (comes > 0.0 or (reach > 0.0 and c.latest < 0.0))
    known = known and (reach > 0.0 or c.latest < c.stays)
    half = 0.5 * (c.into + c.stays)
    deep = reach == 0.0 and is_deep(f, row, x, y, half, doubt + slack * abs(half) + moved)
    corner = -1
    found = -1
    for face in range(faces, faces + int(f[row + CORNERS]) * WIDE if known else 0, WIDE):
        nx = f[face + NX]
        ny = f[face + NY]
        gap = (nx * x.d + ny * y.d) - f[face + OUT]
        rate = nx * x.u + ny * y.u
        t = 0.0
        error = 0.0
        if comes > 0.0:
            t = -gap / rate
            error = (doubt + slack * abs(t)) / (abs(rate) - slack)
            if rate >= -slack or t + error < comes:
                continue
        elif gap < c.highest - 2.0 * doubt:
            continue
        over = True
        sinks = deep
        if reach > 0.0:
            around = doubt + speed * error + moved
            first, last = along_face(f, row, face, x, y, t)
            over = first > around and last < -around
            if over and comes > 0.0:  # it must be over the face until it is a strip deeper
                sinking = error + f[row + FLUSH] / (-rate - slack)
                further = around + speed * sinking + moved
                sinks = first > further and last < -further and t + sinking < last_time
            nearest = face if first < -around else next_corner(f, row, face)
            if not over:
                known = known and (first < -around or last > around) and (corner < 0 or corner == nearest)
                corner = nearest
        if over:
            ticks = OPEN
            if comes > 0.0:
                ticks = tick_at_face(f, face, t, x, y, per_time)
            if ticks != OPEN and reach > 0.0 and sinks:
                return ticks
            known = known and ticks != OPEN and sinks
            found = larger(found, ticks)
    if known and corner >= 0:
        return enters_at_corner(f, row, corner, x, y, plans, doubt, slack)
    if not known and reach == 0.0:
        return at_whole_tick(f, row, plans, as_count(c.into * per_time + 0.5), deep)
    return found if known else OPEN


@subroutine
def farther(f: Numbers, w: Approach, face: int, other: int, count: int) -> int:
    """Returns the sign of a place's distance out of a face's line less its distance out of another face's
    line, after a number of ticks."""
    t, rest = time_of(count, w.plans.per_tick)
    px, _, x_size = place_at(w.x, t, rest)
    py, _, y_size = place_at(w.y, t, rest)
    gap = (f[face + NX] - f[other + NX]) * px + (f[face + NY] - f[other + NY]) * py
    gap -= f[face + OUT] - f[other + OUT]
    if abs(gap) > 2.0**-48 * (x_size + y_size + f[w.row + ALL_SIZES]):
        return 1 if gap > 0.0 else -1
    return int(farther_out(f, w.row, face, other, w.plans, count))


@subroutine
def nearest_face(f: Numbers, w: Approach, count: int) -> int:
    """Returns a face whose line a place is farthest out of, or least deep in, after a number of ticks."""
    found = w.row + FIRST_CORNER
    for face in range(found + WIDE, found + int(f[w.row + CORNERS]) * WIDE, WIDE):
        if farther(f, w, face, found, count) > 0:
            found = face
    return found


@subroutine
def first_nearer(f: Numbers, w: Approach, start: int) -> int:
    """Returns the first tick from ``start`` on in which a place falls towards each of the faces that it is
    nearest to at ``start``."""
    nearest = nearest_face(f, w, start)
    here = start
    moved = True
    while moved:
        moved = False
        for face in range(w.row + FIRST_CORNER, w.row + FIRST_CORNER + int(f[w.row + CORNERS]) * WIDE, WIDE):
            if face == nearest or farther(f, w, face, nearest, start) == 0:
                there = next_falling(f, w, face, LINE, 1, here)
                if there == NEVER:
                    return NEVER
                moved = moved or there > here
                here = there
    return int(here)


@subroutine
def is_over(f: Numbers, w: Approach, face: int, count: int) -> bool:
    """Returns True if a place is over a face, its ends included, on the outer side of its line or on it."""
    if sign_of(f, w, face, LINE, ITSELF, count) < 0 or sign_of(f, w, face, ALONG, ITSELF, count) < 0:
        return False
    return sign_of(f, w, face, BEYOND, ITSELF, count) <= 0


@subroutine
def first_beside(f: Numbers, w: Approach, corner: int, start: int) -> int:
    """Returns the first count from ``start`` on with a place between the two faces at a corner."""
    first = w.row + FIRST_CORNER
    before = corner - WIDE if corner > first else first + (int(f[w.row + CORNERS]) - 1) * WIDE
    here = start
    while True:
        there = next_below(f, w, before, BEYOND, -1, 1, next_below(f, w, corner, ALONG, 1, 1, here))
        if there == NEVER or there == here:  # noqa: SIM109 - no tuple in a hook
            return there
        here = there


@subroutine
def across_corner(f: Numbers, w: Approach, corner: int, kind: int, sense: int, start: int) -> int:
    """Returns the first tick from ``start`` on at whose begin and end a corner is nearest, and in which rule
    5 holds for the disc around it, with the margin of ``kind``; or for its outside if ``sense`` is -1."""
    own = from_corner(f, corner, w.plans)
    margin, low = margin_of(f, w.row, kind)
    tick = start
    while True:
        tick = closely(own, margin, low, sense, 0, 0, tick)
        there = first_beside(f, w, corner, tick) if tick != NEVER else NEVER
        if there == NEVER:
            return NEVER
        if there == tick:
            there = tick + 1
            if first_beside(f, w, corner, there) == there:
                return int(tick)
        tick = there


@subroutine
def across_face(f: Numbers, w: Approach, face: int, kind: int, sense: int, over: int, start: int) -> int:
    """Returns the first tick from ``start`` on at whose end a place is within a margin, ``kind``, of the line
    of a face, and in which it comes nearer; or if ``sense`` is -1, at whose end it is beyond that and goes
    away. If ``over`` is 1, it is also over the face at the end."""
    here = start + 1
    while True:
        there = next_below(f, w, face, kind, sense, 0, here)
        if over > 0:
            there = next_below(f, w, face, ALONG, -1, 1, there)
            there = next_below(f, w, face, BEYOND, 1, 1, there)
            there = next_below(f, w, face, LINE, -1, 1, there)
        falls = next_falling(f, w, face, LINE, sense, there - 1)
        there = falls + 1 if falls < LIMIT else NEVER
        if there == NEVER or there == here:  # noqa: SIM109 - no tuple in a hook
            return NEVER if there == NEVER else int(there - 1)
        here = there


@subroutine
def across_any(f: Numbers, w: Approach, kind: int, sense: int, start: int) -> int:
    """Returns the first tick from ``start`` on in which a place comes within a margin, ``kind``, of the
    nearest face or corner at its end, or leaves it, by ``sense``."""
    found = NEVER
    for this in range(w.row + FIRST_CORNER, w.row + FIRST_CORNER + int(f[w.row + CORNERS]) * WIDE, WIDE):
        found = smaller(found, across_face(f, w, this, kind, sense, 1, start))
        found = smaller(found, across_corner(f, w, this, kind, sense, start))
    return int(found)


@subroutine
def counts_after(f: Numbers, w: Approach) -> int:
    """Returns the first tick of a new contact allowed for two that have just met (rule 7s)."""
    first = w.row + FIRST_CORNER
    count = int(f[w.row + CORNERS])
    outside = f[w.row + RADIUS] == 0.0
    own = -1
    kind = LINE
    if not outside:
        for this in range(first, first + count * WIDE, WIDE):
            beyond = sign_of(f, w, this, LINE, ITSELF, 0) > 0
            outside = outside or beyond
            if own < 0 and beyond and is_over(f, w, this, 0):
                own = this
        if own < 0 and (outside or count == 2):
            for this in range(first, first + count * WIDE, WIDE):
                if own < 0 and first_beside(f, w, this, 0) == 0:
                    own = this
                    kind = AWAY
    nearest = own if own >= 0 else nearest_face(f, w, 0)
    presses = True
    found = NEVER
    for this in range(first, first + count * WIDE, WIDE):
        if this == nearest or (own < 0 and farther(f, w, this, nearest, 0) == 0):
            if sign_of(f, w, this, kind, RATE, 0) > 0:
                return 0
            presses = presses and sign_of(f, w, this, kind, BEND, 0) < 0
            found = smaller(found, next_falling(f, w, this, kind, -1, 0))
    return 0 if presses else int(found)


@subroutine
def first_visit(f: Numbers, w: Approach, start: int) -> int:
    """Returns the tick of contact without a margin, from ``start`` on."""
    here = start
    while True:
        begins = first_inside(f, w, GAP, here)
        if begins == NEVER:
            return NEVER
        ends = first_outside(f, w, GAP, 1, begins)
        if first_inside(f, w, STRIP, begins) < ends:
            if begins > start:
                return int(begins - 1)
            falls = first_nearer(f, w, start)
            if falls < ends - 1:  # it may be NEVER
                return falls
        if ends >= LIMIT:
            return NEVER
        here = ends


@subroutine
def first_within(f: Numbers, w: Approach, kind: int, start: int) -> int:
    """Returns the first tick from ``start`` on in which a place comes within a margin, ``kind``, of M."""
    found = across_any(f, w, kind, 1, start)
    if f[w.row + CORNERS] > 2.0:
        inside = first_inside(f, w, LINE, start)
        if inside == start:
            inside = first_inside(f, w, LINE, first_outside(f, w, LINE, 1, start))
        if inside < NEVER and inside - 1 < found:
            return int(inside - 1)
    return found


@subroutine
def first_touch(f: Numbers, w: Approach, start: int) -> int:
    """Returns the tick of contact with a margin, from ``start`` on."""
    here = start
    while True:
        begins = first_within(f, w, GAP, here)
        if begins == NEVER or f[w.row + RADIUS] <= f[w.row + FLUSH]:
            return begins
        ends = across_any(f, w, GAP, -1, begins + 1)
        if first_within(f, w, STRIP, begins) < ends:
            return begins
        if ends == NEVER:
            return NEVER
        here = ends


@subroutine
def enters_by_measures(f: Numbers, row: int, plans: Plans, met: int, since: int) -> int:
    """Returns the same as ``enters``, for a difference that is not a point."""
    w = approach_of(row, plans)
    start = since
    if met > 0:
        start = larger(start, counts_after(f, w))
    if start >= LIMIT:
        return NEVER
    return first_visit(f, w, start) if f[row + RADIUS] == 0.0 else first_touch(f, w, start)


@subroutine
def leaves_by_measures(f: Numbers, row: int, plans: Plans, since: int) -> int:
    """Returns the same as ``leaves``, for a difference that is not a point."""
    w = approach_of(row, plans)
    if f[row + RADIUS] > 0.0:
        return across_any(f, w, GAP, -1, since)
    found = NEVER
    for face in range(row + FIRST_CORNER, row + FIRST_CORNER + int(f[row + CORNERS]) * WIDE, WIDE):
        found = smaller(found, across_face(f, w, face, GAP, -1, 0, since))
    return int(found)


@apart
def enters(f: Numbers, row: int, plans: Plans, met: int, since: int) -> int:
    """Returns the ticks after the later anchor until two convex bodies touch, from ``since`` on, or
    ``NEVER``; ``met`` is 1 if they have just met. ``row`` is the index of their difference's row in the table
    ``f``."""
    count = int(f[row + CORNERS])
    if count == 1:
        own = from_corner(f, row + FIRST_CORNER, plans)
        return int(touch(own, f[row + RADIUS], f[row + RADIUS_LOW], met, -1, since))
    if f[row + RADIUS] == 0.0 and count == 2:
        return NEVER
    if met > 0 and have_one_acceleration(plans):
        return NEVER
    if not is_accelerated(plans):
        if have_one_velocity(plans):
            return NEVER
        found = enters_surely(f, row, plans)
        if found >= since:
            return found
    return enters_by_measures(f, row, plans, met, since)


@apart
def leaves(f: Numbers, row: int, plans: Plans, since: int) -> int:
    """Returns the ticks after the later anchor until two convex bodies that pass through each other part,
    from ``since`` on, or ``NEVER``."""
    if f[row + CORNERS] == 1.0:
        own = from_corner(f, row + FIRST_CORNER, plans)
        return int(parting(own, f[row + RADIUS], f[row + RADIUS_LOW], since))
    if not is_accelerated(plans):
        if have_one_velocity(plans):
            return NEVER
        found = leaves_surely(f, row, plans)
        if found >= since:
            return found
    return leaves_by_measures(f, row, plans, since)


@apart
def comes_nearer(f: Numbers, row: int, face: int, plans: Plans) -> int:
    """Returns 1 if a second body comes nearer to a face of a first in the tick after the later anchor,
    exactly; else 0."""
    x = plans.x
    y = plans.y
    half = 0.5 * plans.per_tick
    time = plans.elapsed * plans.per_tick + half  # since the first one's anchor
    across = f[face + TY] * ((x.v2 + half * x.a2) - (x.v + time * x.a))
    up = f[face + TX] * ((y.v2 + half * y.a2) - (y.v + time * y.a))
    size = abs(f[face + TY]) * (abs(x.v2) + half * abs(x.a2) + (abs(x.v) + time * abs(x.a)))
    size += abs(f[face + TX]) * (abs(y.v2) + half * abs(y.a2) + (abs(y.v) + time * abs(y.a)))
    if abs(across - up) > 2.0**-48 * size + TINY:
        return 1 if across < up else 0
    return 1 if sign_of(f, approach_of(row, plans), face, LINE, RATE, 0) < 0 else 0
