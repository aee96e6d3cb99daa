"""When two convex bodies touch that do not rotate: the exact tick.

Seen from the first body, the place d of the second moves on a line, and the two touch where d is as far from
the difference M of their cores as the sum R of their radii (docs/specification.md, rule 5s). So a place
enters a convex polygon with a margin. ``enters`` finds the tick in double: the place comes within the lines
of all faces, moved out by R, at the last crossing inwards, unless it has crossed one outwards before. Then
one step in compensated arithmetic says in which tick the gap to this face is none (``tick_at_face``).

Scenes on lattices have crossings at whole ticks all the time (``by_ticks``). A place may enter where M is
only grazed, by no more than what is flush: it does not count (``runs_deep``). What any of these leaves open
is decided in whole numbers (``convex_integers``).

Error bounds
============

u is 2^-53, size the sum of all magnitudes that d and the corners are made of.

- *In double.* The gap to the line of each face, moved out by R, n.d - h with n of length 1, is off by less
  than eight roundings of size: 2^-48 size covers it. Its rate n.v is off by less than 2^-50 of |vx| + |vy|.
  So each crossing has an interval, and what the classification needs is asked of intervals: which face is
  crossed inwards last, whether any is crossed outwards before, and, at that time, whether the place is over
  the face or beyond one of its corners. Rates within their error, ties of two faces and starts on a line are
  left open.
- *A corner.* From a tip, outside the margin but inside the lines of two faces, only the disc around their
  corner can be entered, or the lines be left: a question about two discs (``contact``), the corner taken off
  d and off its rounding.
- *A face.* With x + rest, x a double, along each axis, and the vector along the face a sum of two doubles,
  n.d - h is computed with every rounding of a product or a sum caught but those of products of two roundings:
  2^-97 of the sum of the magnitudes, and 2^-52 of the result. One step from the estimate, as of discs.
- *Ties.* Where no margin is left to be rounded, the ticks of all crossings decide if they are known and
  differ (``by_ticks``). At a whole tick the coordinates of the place are whole multiples of a power of two,
  its grain: the least of the lowest bits of both places and of both velocities times a tick. The gap to a
  face is n.(d - c), c being a corner of it, so it is a multiple of the lowest bit of n times the lesser of
  the grain and the lowest bit of c. If what is computed and its bound together are less than that, the gap is
  0: so a root at a whole tick is known, and a place on a line at the later anchor.
- *Flush.* A tick that is found stands only if M with its margin surely is on both sides of the line by more
  than the strip (``runs_deep``). The products v x (d - c) are off by less than 2^-48 size |v| together with
  the rounding of (strip - R) |v|; who only grazes is left open.
- *Parting* (``leaves``, rule 11s). A line that goes out of a convex set at a point of its outline, inwards
  before, does not come back. So it is enough to know one such point: where the line of a face, moved out by
  R, is crossed outwards, the place being surely between the face's ends; or where the disc around a corner is
  left, the place being surely beyond the faces on both sides. The intervals and the steps are those above.
  The rest goes to the integers: they are asked for the greatest tick at which the place is in M with its
  margin, or comes nearer on a line that goes into it.
- *Integers.* Corners and the vectors along faces are sums of two doubles, exactly: a corner of M is a
  difference of two doubles, and a face is along an edge of one of the bodies. So are the gap to a face
  (products of two), its square against that of R |n| (of four), and which of two faces a place inside is
  nearer to (g^2 n'.n', of six: six times the room, 960 cells). The place meets M if M with its margin is on
  both sides of its line by more than the strip: products of two and four. The tick is the greatest at which
  the distance from M, less R, is not below 0 and falls; the distance is convex in time, so both cease for
  good.
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.contact import (
    LARGE,
    OPEN,
    SMALL,
    TINY,
    Separation,
    about,
    after,
    filtered,
    floor_of,
    left,
    look_closer,
    plus,
    separations,
)
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
    SIZE,
    TX,
    TX_LOW,
    TY,
    TY_LOW,
    WIDE,
    enters_exactly,
    leaves_exactly,
    next_corner,
)
from kinetile.kernel.certificates.integers import LIMIT, as_count
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import Numbers, apart, hook, larger, smaller
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error


@hook
def gap_to_face(
    f: Numbers, face: int, t: float, along_x: Separation, along_y: Separation
) -> tuple[float, float]:
    """Return how far a place is outside the line of a face, moved out by R, at a time t after the later
    anchor, in units of the length of the vector along the face; and how far that can be off."""
    nx = f[face + TY]
    ny = -f[face + TX]
    x, x_rest = after(t, along_x)
    y, y_rest = after(t, along_y)
    across = nx * x
    up = ny * y
    both, both_low = plus(across, up)
    gap, gap_low = plus(both, -f[face + FAR_OUT])
    mixed = (nx * x_rest + f[face + TY_LOW] * x) + (ny * y_rest - f[face + TX_LOW] * y)
    lost = product_error(nx, x, across) + product_error(ny, y, up)
    size = abs(nx) * (along_x.size + abs(x)) + abs(ny) * (along_y.size + abs(y)) + abs(f[face + FAR_OUT])
    left = gap + (((both_low + gap_low) + lost) + (mixed - f[face + FAR_LOW]))
    return left, 2.0**-97 * size + 2.0**-52 * abs(left) + TINY


@hook
def is_still(nx: float, ny: float, x: Separation, y: Separation) -> bool:
    """Whether a place does not move across a line at all."""
    return (nx == 0.0 or (x.u == 0.0 and x.w == 0.0)) and (ny == 0.0 or (y.u == 0.0 and y.w == 0.0))


@hook
def grain_of(value: float) -> float:
    """Return the greatest power of two of which a number is a multiple: infinity for 0."""
    if value == 0.0:
        return math.inf
    part, exponent = math.frexp(value)
    digits = int(abs(part) * 2.0**53)
    return float(math.ldexp(float(digits & -digits), exponent - 53))


@hook
def grain_along(axis: Axis, tick: float) -> float:
    """Return the greatest power of two of which coordinates at whole ticks are multiples, along an axis."""
    speeds = smaller(grain_of(axis.v), grain_of(axis.v2))
    lengths = smaller(grain_of(axis.x), grain_of(axis.x2))
    if axis.turns != 0.0:
        lengths = smaller(lengths, grain_of(axis.period))
    return float(smaller(tick * speeds, lengths))


@hook
def grain_at(f: Numbers, face: int, grain: float) -> float:
    """Return a power of two of which the gap to a face without a margin is a multiple, as the coordinates of
    the place are of ``grain``; 0 where it would be too small."""
    corner = smaller(
        smaller(grain_of(f[face + CX]), grain_of(f[face + CX_LOW])),
        smaller(grain_of(f[face + CY]), grain_of(f[face + CY_LOW])),
    )
    way = smaller(
        smaller(grain_of(f[face + TX]), grain_of(f[face + TX_LOW])),
        smaller(grain_of(f[face + TY]), grain_of(f[face + TY_LOW])),
    )
    return float(way * smaller(corner, grain))


@hook
def tick_at_face(
    f: Numbers, face: int, t: float, x: Separation, y: Separation, per_time: float, grain: float
) -> int:
    """Return in which tick after the later anchor a place crosses the line of a face, moved out by R, where
    it does at about a time t > 0; ``OPEN`` if that is not sure. At whole ticks the gap is a multiple of
    ``grain``."""
    left, error = gap_to_face(f, face, t, x, y)
    rate = f[face + TX] * y.u - f[face + TY] * x.u
    unsure = 2.0**-50 * (abs(f[face + TX] * y.u) + abs(f[face + TY] * x.u))
    ticks = t * per_time
    if abs(rate) > 2.0 * unsure and ticks < FAR:
        step = left / rate
        bound = (error + abs(step) * unsure) / (abs(rate) - unsure) * per_time * (1.0 + 2.0**-20)
        step *= per_time
        bound += 2.0**-49 * abs(step) + 2.0**-50
        if bound < 0.5:
            found = floor_of(ticks, step, bound)
            if found != OPEN:
                return found
            base = int(ticks)
            flown = ticks - float(base)
            near = math.floor(flown + step + 0.5)
            away = (near - flown) / per_time
            there = left - rate * away
            error += abs(away) * unsure + 2.0**-51 * (abs(left) + abs(there))
            found = base + int(near)
            if abs(there) + error < grain and found < LIMIT:
                return int(larger(found, 0))
    return OPEN


@hook
def by_ticks(f: Numbers, row: int, x: Separation, y: Separation, per_time: float, grain: float) -> int:
    """Return what ``enters`` does for a difference without a margin, by the ticks in which the lines of its
    faces are crossed; ``OPEN`` where one of them, or a gap at the later anchor, is not sure, where a place
    would come in and go out in one tick, and where the bodies overlap. At whole ticks the coordinates of the
    place are multiples of ``grain``."""
    comes = -1
    goes = NEVER
    known = True
    for k in range(int(f[row + COUNT])):
        face = row + HEAD + k * WIDE
        nx = f[face + TY]
        ny = -f[face + TX]
        own = grain_at(f, face, grain)
        gap, error = gap_to_face(f, face, 0.0, x, y)
        nothing = abs(gap) + error < own
        gap = 0.0 if nothing else gap
        rate = nx * x.u + ny * y.u
        unsure = 2.0**-49 * (abs(nx * x.u) + abs(ny * y.u))
        still = is_still(nx, ny, x, y)
        if (abs(gap) <= error and not nothing) or (abs(rate) <= unsure and not still):
            known = False
            continue
        if gap >= 0.0 and rate >= 0.0:
            return NEVER
        t = -gap / rate if rate != 0.0 else 0.0
        ticks = 0
        if t > 0.0 and (rate < 0.0 or t * per_time < FAR):
            ticks = tick_at_face(f, face, t, x, y, per_time, own)
            known = known and ticks != OPEN
            if rate > 0.0:
                goes = smaller(goes, ticks)
        if rate < 0.0 and gap >= 0.0:
            comes = larger(comes, ticks)
    if not known or comes < 0 or comes == goes:
        return OPEN
    return comes if comes < goes else NEVER


@hook
def from_corner(s: Separation, c: float, c_low: float) -> Separation:
    """Return a separation less the coordinate of a corner."""
    d, low = plus(s.d, -c)
    return Separation(d, low + (s.low - c_low), s.size + abs(c), s.u, s.w)


@hook
def runs_deep(f: Numbers, row: int, x: Separation, y: Separation) -> bool:
    """Whether M with its margin is surely on both sides of the line of a place by more than what is flush."""
    count = int(f[row + COUNT])
    speed = math.sqrt(x.u * x.u + y.u * y.u)
    size = (x.size + y.size) + f[row + SIZE]
    least = (f[row + FLUSH] - f[row + RADIUS]) * speed + 2.0**-48 * size * speed
    left = -math.inf
    right = -math.inf
    for corner in range(row + HEAD, row + HEAD + count * WIDE, WIDE):
        side = (x.d - f[corner + CX]) * y.u - (y.d - f[corner + CY]) * x.u
        left = larger(left, side)
        right = larger(right, -side)
    return count == 1 or (left > least and right > least)


@hook
def along_face(
    f: Numbers, row: int, face: int, x: Separation, y: Separation, t: float
) -> tuple[float, float]:
    """Return how far a place is beyond the first and the last corner of a face at a time, along its way."""
    end = next_corner(f, row, face)
    nx = f[face + NX]
    ny = f[face + NY]
    px = x.d + x.u * t
    py = y.d + y.u * t
    first = nx * (py - f[face + CY]) - ny * (px - f[face + CX])
    return first, nx * (py - f[end + CY]) - ny * (px - f[end + CX])


@apart
def enters(f: Numbers, row: int, plans: Plans) -> int:
    """Return how many ticks after the later anchor two convex bodies touch, rounded down exactly, or
    ``NEVER``; ``row`` is where the row of their difference begins in the table ``f``."""
    x, y = separations(plans)
    per_time = plans.per_time
    count = int(f[row + COUNT])
    faces = row + HEAD
    reach = f[row + RADIUS]
    size = (x.size + y.size) + f[row + SIZE]
    speed = abs(x.u) + abs(y.u)
    guess = 0
    deep = False
    if speed > SMALL and speed < LARGE and size < LARGE:
        doubt = 2.0**-48 * size
        slack = 2.0**-50 * speed
        into = -math.inf
        into_error = 0.0
        latest = -math.inf
        out = math.inf
        stays = math.inf
        highest = -math.inf
        known = True
        for k in range(count if count > 1 else 0):
            face = faces + k * WIDE
            nx = f[face + NX]
            ny = f[face + NY]
            gap = (nx * x.d + ny * y.d) - f[face + OUT]
            rate = nx * x.u + ny * y.u
            highest = larger(highest, gap)
            if abs(rate) <= slack:
                still = is_still(nx, ny, x, y)
                if still and gap > doubt:
                    return NEVER
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
        if into - into_error > out or out < 0.0:
            return NEVER
        deep = runs_deep(f, row, x, y)
        comes = into - into_error
        known = known and into * speed < 2.0**20 * size and (comes > 0.0 or latest < 0.0)
        known = known and (reach > 0.0 or latest < stays)
        corner = faces if count == 1 else -1
        found = -1
        if count > 1 and comes > 0.0:
            guess = as_count(into * per_time)
        for k in range(count if known and count > 1 else 0):
            face = faces + k * WIDE
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
            elif gap < highest - 2.0 * doubt:
                continue
            over = True
            if reach > 0.0:
                around = doubt + speed * error
                first, last = along_face(f, row, face, x, y, t)
                over = first > around and last < -around
                nearest = face if first < -around else next_corner(f, row, face)
                if not over:
                    known = known and (first < -around or last > around) and (corner < 0 or corner == nearest)
                    corner = nearest
            if over:
                ticks = -1
                if comes > 0.0:
                    ticks = tick_at_face(f, face, t, x, y, per_time, 0.0)
                known = known and ticks >= 0 and deep
                if ticks >= 0 and reach > 0.0 and deep:
                    return ticks
                found = larger(found, ticks)
        if known and corner < 0:
            return found
        if not known:
            corner = -1
        if corner >= 0:
            corner_x = from_corner(x, f[corner + CX], f[corner + CX_LOW])
            corner_y = from_corner(y, f[corner + CY], f[corner + CY_LOW])
            found = filtered(corner_x, corner_y, reach, f[row + RADIUS_LOW], per_time)
            if found == NEVER or (found != OPEN and deep):
                return found
            at_origin = f[corner + CX] == 0.0 and f[corner + CY] == 0.0
            if count == 1 and at_origin:  # two discs
                return look_closer(plans, reach, f[row + RADIUS_LOW])
            guess = as_count(about(corner_x, corner_y, reach) * per_time)
        if count > 2 and reach == 0.0:
            grain = smaller(grain_along(plans.x, plans.tick), grain_along(plans.y, plans.tick))
            found = by_ticks(f, row, x, y, per_time, grain)
            if found == NEVER or (found != OPEN and deep):
                return found
    return enters_exactly(f, row, plans, guess)


@hook
def last_corner(f: Numbers, row: int, x: Separation, y: Separation) -> int:
    """Return the corner whose disc a place leaves last, or that which it passes nearest."""
    reach = f[row + RADIUS]
    speed2 = x.u * x.u + y.u * y.u
    found = row + HEAD
    latest = -math.inf
    for corner in range(row + HEAD, row + HEAD + int(f[row + COUNT]) * WIDE, WIDE):
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
def leaves(f: Numbers, row: int, plans: Plans) -> int:
    """Return how many ticks after the later anchor two convex bodies part that pass through each other,
    rounded down exactly, or ``NEVER`` (rule 11s)."""
    x, y = separations(plans)
    per_time = plans.per_time
    count = int(f[row + COUNT])
    reach = f[row + RADIUS]
    size = (x.size + y.size) + f[row + SIZE]
    speed = abs(x.u) + abs(y.u)
    guess = 0
    if speed > SMALL and speed < LARGE and size < LARGE:
        doubt = 2.0**-48 * size
        slack = 2.0**-50 * speed
        out = math.inf
        rate = 0.0
        error = 0.0
        face = -1
        for k in range(count if count > 2 or (count == 2 and reach > 0.0) else 0):  # else M has no inside
            this = row + HEAD + k * WIDE
            rises = f[this + NX] * x.u + f[this + NY] * y.u
            if rises > slack:
                t = (f[this + OUT] - (f[this + NX] * x.d + f[this + NY] * y.d)) / rises
                if t < out:
                    out = t
                    rate = rises
                    face = this
        over = False
        if face >= 0:
            error = (doubt + slack * abs(out)) / (rate - slack)
            first, last = along_face(f, row, face, x, y, out)
            around = doubt + speed * error
            over = first > around and last < -around
            guess = as_count(out * per_time)
        if over and out > error:
            grain = 0.0
            if reach == 0.0:
                grain = smaller(grain_along(plans.x, plans.tick), grain_along(plans.y, plans.tick))
                grain = grain_at(f, face, grain)
            found = tick_at_face(f, face, out, x, y, per_time, grain)
            if found != OPEN:
                return found
        elif over and out < -error:
            return 0
        if reach > 0.0 and not over:
            corner = last_corner(f, row, x, y)
            around_x = from_corner(x, f[corner + CX], f[corner + CX_LOW])
            around_y = from_corner(y, f[corner + CY], f[corner + CY_LOW])
            found, t = left(around_x, around_y, reach, f[row + RADIUS_LOW], per_time)
            around = doubt + speed * (plans.tick + 2.0**-50 * abs(t))
            before = corner - WIDE if corner > row + HEAD else row + HEAD + (count - 1) * WIDE
            beyond = count == 1
            if not beyond:
                first, _ = along_face(f, row, corner, x, y, t)
                _, last = along_face(f, row, before, x, y, t)
                beyond = first < -around and last > around
            guess = as_count(t * per_time)
            if found != OPEN and beyond:
                return found
    return leaves_exactly(f, row, plans, guess)
