"""When two convex bodies touch that do not rotate: the exact tick.

Seen from the first body, the place d of the second moves on a line, and the two touch where d is as far from
the difference M of their cores as the sum R of their radii (docs/specification.md, rule 5s). So a place
enters a convex polygon with a margin. ``enters`` finds the tick in double, with bounds of all rounding:

* In double, the place crosses the line of each face, moved out by R, at some time: inwards or outwards. It
  comes within all of them at the last crossing inwards, unless it has crossed one outwards before: then it
  never enters.
* If R > 0 and it is then beyond an end of that last face, it is in a tip, which the margin does not fill, and
  from there only the disc around this corner can be entered: a question about two discs (``contact``).
* Otherwise it enters across that face, and one step in compensated arithmetic says in which tick.

What any of these leaves open is decided by ``enters_exactly``, in whole numbers. There the place enters if
its line has corners of M on both sides, or passes one at less than R; and floor(T) is the greatest tick at
which it is outside, or touches, and comes nearer. Bisection finds that, since both cease for good.

A difference is a row of doubles in a table that a narrow phase makes: its corners and the ways of its faces
are exact, as sums of two doubles each.
"""

from __future__ import annotations

import math

import numpy as np

from kinetile.kernel.certificates.contact import (
    LARGE,
    OPEN,
    SMALL,
    TINY,
    about,
    filtered,
    look_closer,
    plus,
    seen_from,
)
from kinetile.kernel.certificates.integers import (
    CELLS,
    DX,
    DY,
    FOURS,
    LIMIT,
    MEMORY,
    REACH,
    REACH2,
    SPEED2,
    SUM,
    UX,
    UY,
    Cells,
    X,
    Y,
    add_product,
    as_count,
    carry,
    clear,
    copy,
    place_at,
    put,
    read_in,
)
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import Numbers, apart, hook, larger, smaller, subroutine
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error

COUNT, RADIUS, RADIUS_LOW, SIZE, LEAST, PLAIN, HEAD = range(7)
"""Columns of a row's head: the corners, R as a sum of two, more than all coordinates and R together, not more
than any double in the row that is not 0; whether M is an upright box without a margin, or 0; and where the
corners begin."""

CX, CY, CX_LOW, CY_LOW, TX, TY, TX_LOW, TY_LOW, FAR_OUT, FAR_LOW, NX, NY, OUT, RANK, WIDE = range(15)
"""Columns of a corner and the face that goes from it: the corner; the face's way, or another vector along it;
how far its line, moved out by R, is from the origin, in units of that vector's length; its normal as rule 9s
has it; the same distance in units of that; its number; and how many columns there are."""


AX, AY, WAY_X, WAY_Y = range(MEMORY, MEMORY + 4 * CELLS, CELLS)
"""Rows of lengths: a place from a corner, and a vector along a face."""

GAP, LENGTH2, LEAST_GAP, LEAST_LENGTH2 = range(MEMORY + 4 * CELLS, MEMORY + 12 * CELLS, 2 * CELLS)
"""Rows of products of two: of a normal and a place, and the square of the normal; and the same of the face
that is nearest so far."""

SIXES = MEMORY + 12 * CELLS
SIGNS = SIXES + 6 * CELLS
"""Rows of products of six, and for each corner the signs of the gap to its face, of the place along this, and
along the face before it."""

MOST = 16
"""Corners that a difference of two cores can have."""

ROOM = SIGNS + 3 * MOST


@subroutine
def difference_of(
    m: Cells, target: int, from_row: int, value: float, low: float, first: int, end: int
) -> None:
    """Make a number another one less a sum of two doubles."""
    copy(m, target, from_row, first, end)
    put(m, target, value, 0, -1)
    put(m, target, low, 0, -1)
    carry(m, target, first, end, 1)


@subroutine
def from_corner(m: Cells, f: Numbers, corner: int, x: int, y: int, first: int, end: int) -> None:
    """Put a place, less a corner, in the rows ``AX`` and ``AY``."""
    difference_of(m, AX, x, f[corner + CX], f[corner + CX_LOW], first, end)
    difference_of(m, AY, y, f[corner + CY], f[corner + CY_LOW], first, end)


@subroutine
def along_face(m: Cells, f: Numbers, face: int, first: int, end: int) -> None:
    """Put the vector along a face in the rows ``WAY_X`` and ``WAY_Y``."""
    for row, at, low in ((WAY_X, TX, TX_LOW), (WAY_Y, TY, TY_LOW)):
        clear(m, row, first, end)
        put(m, row, f[face + at], 0, 1)
        put(m, row, f[face + low], 0, 1)
        carry(m, row, first, end, 1)


@subroutine
def dot(m: Cells, target: int, ax: int, ay: int, bx: int, by: int, first: int, end: int) -> int:
    """Put the scalar product of two vectors in a row; return its sign."""
    clear(m, target, 2 * first, 2 * end)
    add_product(m, target, ax, first, end, bx, first, end)
    add_product(m, target, ay, first, end, by, first, end)
    return carry(m, target, 2 * first, 2 * end, 1)


@subroutine
def cross(m: Cells, target: int, ax: int, ay: int, bx: int, by: int, first: int, end: int) -> int:
    """Put the cross product of two vectors in a row; return its sign."""
    clear(m, target, 2 * first, 2 * end)
    add_product(m, target, ay, first, end, bx, first, end)
    carry(m, target, 2 * first, 2 * end, -1)
    add_product(m, target, ax, first, end, by, first, end)
    return carry(m, target, 2 * first, 2 * end, 1)


@subroutine
def compare_products(m: Cells, a: int, b: int, c: int, d: int, first: int, end: int) -> int:
    """Return the sign of a b - c d, of products of two."""
    clear(m, FOURS, 4 * first, 4 * end)
    add_product(m, FOURS, c, 2 * first, 2 * end, d, 2 * first, 2 * end)
    carry(m, FOURS, 4 * first, 4 * end, -1)
    add_product(m, FOURS, a, 2 * first, 2 * end, b, 2 * first, 2 * end)
    return carry(m, FOURS, 4 * first, 4 * end, 1)


@subroutine
def is_nearer(m: Cells, first: int, end: int) -> int:
    """Return the sign of how much nearer a place in M is to the line of a face (``GAP``, ``LENGTH2``) than to
    that of another one (``LEAST_GAP``, ``LEAST_LENGTH2``): of g'^2 n.n - g^2 n'.n'."""
    clear(m, SIXES, 6 * first, 6 * end)
    for gap, length2, sign in ((GAP, LEAST_LENGTH2, -1), (LEAST_GAP, LENGTH2, 1)):
        clear(m, FOURS, 4 * first, 4 * end)
        add_product(m, FOURS, gap, 2 * first, 2 * end, gap, 2 * first, 2 * end)
        carry(m, FOURS, 4 * first, 4 * end, 1)
        add_product(m, SIXES, FOURS, 4 * first, 4 * end, length2, 2 * first, 2 * end)
        carry(m, SIXES, 6 * first, 6 * end, sign)
    return carry(m, SIXES, 6 * first, 6 * end, 1)


@subroutine
def falls_within(m: Cells, f: Numbers, faces: int, count: int, first: int, end: int) -> bool:
    """Whether a place in M, at (``X``, ``Y``), comes nearer to the middle across the face that it is nearest
    to; of several, across each."""
    falls = False
    for k in range(count):
        face = faces + k * WIDE
        from_corner(m, f, face, X, Y, first, end)
        along_face(m, f, face, first, end)
        cross(m, GAP, AX, AY, WAY_X, WAY_Y, first, end)
        dot(m, LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
        nearer = 1 if k == 0 else is_nearer(m, first, end)
        if nearer >= 0:
            inwards = cross(m, SUM, UX, UY, WAY_X, WAY_Y, first, end) < 0
            falls = inwards and (nearer > 0 or falls)
        if nearer > 0:
            copy(m, LEAST_GAP, GAP, 2 * first, 2 * end)
            copy(m, LEAST_LENGTH2, LENGTH2, 2 * first, 2 * end)
    return falls


@subroutine
def distance_at(m: Cells, f: Numbers, row: int, first: int, end: int, ticks: int) -> tuple[int, bool]:
    """Return the sign of the distance of a place from M, less R, at a count of ticks after the later anchor,
    and whether it falls there."""
    place_at(m, first, end, ticks)
    count = int(f[row + COUNT])
    faces = row + HEAD
    outside = 0
    for k in range(count):
        corner = faces + k * WIDE
        from_corner(m, f, corner, X, Y, first, end)
        along_face(m, f, corner, first, end)
        m[SIGNS + 3 * k] = cross(m, SUM, AX, AY, WAY_X, WAY_Y, first, end)
        m[SIGNS + 3 * k + 1] = dot(m, SUM, AX, AY, WAY_X, WAY_Y, first, end)
        along_face(m, f, faces + ((k + count - 1) % count) * WIDE, first, end)
        m[SIGNS + 3 * k + 2] = dot(m, SUM, AX, AY, WAY_X, WAY_Y, first, end)
        if m[SIGNS + 3 * k] > 0:
            outside = 1
    if outside == 0 and count == 2 and (m[SIGNS + 1] < 0 or m[SIGNS + 5] > 0):
        outside = 1
    if outside == 0 and count > 1:
        falls = falls_within(m, f, faces, count, first, end)
        highest = -1
        for k in range(count):
            highest = larger(highest, m[SIGNS + 3 * k])
        return (highest if f[row + RADIUS] == 0.0 else -1), falls
    for k in range(count):
        corner = faces + k * WIDE
        after = (k + 1) % count
        if count == 1 or (m[SIGNS + 3 * k + 2] >= 0 and m[SIGNS + 3 * k + 1] <= 0):
            from_corner(m, f, corner, X, Y, first, end)
            falls = dot(m, SUM, AX, AY, UX, UY, first, end) < 0
            clear(m, SUM, 2 * first, 2 * end)
            add_product(m, SUM, REACH, first, end, REACH, first, end)
            carry(m, SUM, 2 * first, 2 * end, -1)
            add_product(m, SUM, AX, first, end, AX, first, end)
            add_product(m, SUM, AY, first, end, AY, first, end)
            return carry(m, SUM, 2 * first, 2 * end, 1), falls
        if m[SIGNS + 3 * k] > 0 and m[SIGNS + 3 * k + 1] >= 0 and m[SIGNS + 3 * after + 2] <= 0:
            from_corner(m, f, corner, X, Y, first, end)
            along_face(m, f, corner, first, end)
            falls = cross(m, SUM, UX, UY, WAY_X, WAY_Y, first, end) < 0
            cross(m, GAP, AX, AY, WAY_X, WAY_Y, first, end)
            dot(m, LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
            return compare_products(m, GAP, GAP, REACH2, LENGTH2, first, end), falls
    return -1, False


@subroutine
def passes_through(m: Cells, f: Numbers, row: int, first: int, end: int) -> bool:
    """Whether the line on which a place moves comes nearer to M than R; into it, if R = 0."""
    left = False
    right = False
    for k in range(int(f[row + COUNT])):
        from_corner(m, f, row + HEAD + k * WIDE, DX, DY, first, end)
        side = cross(m, GAP, AX, AY, UX, UY, first, end)
        left = left or side > 0
        right = right or side < 0
        if f[row + RADIUS] > 0.0 and compare_products(m, GAP, GAP, REACH2, SPEED2, first, end) < 0:
            return True
    return left and right and (f[row + COUNT] > 2.0 or f[row + RADIUS] > 0.0)


@apart
def enters_exactly(
    f: Numbers,
    row: int,
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    tick: float,
    guess: int,
) -> int:
    """Return what ``enters`` does, for finite numbers of any size; for others ``NEVER``."""
    if vx == vx2 and vy == vy2:
        return NEVER
    m = np.zeros(ROOM, dtype=np.int64)
    first, end = read_in(
        m,
        x,
        y,
        vx,
        vy,
        elapsed,
        x2,
        y2,
        vx2,
        vy2,
        f[row + RADIUS],
        f[row + RADIUS_LOW],
        tick,
        0.0,
        0.0,
        f[row + SIZE],
        f[row + LEAST],
    )
    if end > CELLS:
        return NEVER
    dot(m, SPEED2, UX, UY, UX, UY, first, end)
    add_product(m, REACH2, REACH, first, end, REACH, first, end)
    carry(m, REACH2, 2 * first, 2 * end, 1)
    if not passes_through(m, f, row, first, end):
        return NEVER
    gap, falls = distance_at(m, f, row, first, end, 0)
    if not falls:
        return NEVER
    if gap <= 0:
        return 0
    low = 0
    high = LIMIT + 1
    stride = 1
    while high - low > 1:
        if not (low < guess and guess < high):
            guess = low + ((high - low) >> 1)
        gap, falls = distance_at(m, f, row, first, end, guess)
        if falls and gap >= 0:
            low = guess
            guess += stride
        else:
            high = guess
            guess -= stride
        stride = smaller(2 * stride, LIMIT >> 1)
    return low if low < LIMIT else NEVER


@hook
def tick_at_face(
    f: Numbers,
    face: int,
    t: float,
    dx: float,
    x_low: float,
    x_size: float,
    ux: float,
    wx: float,
    dy: float,
    y_low: float,
    y_size: float,
    uy: float,
    wy: float,
    per_time: float,
) -> int:
    """Return in which tick after the later anchor a place crosses the line of a face, moved out by R,
    inwards, where it does at about a time t > 0; ``OPEN`` if that is not sure.

    One step from there, the gap in compensated arithmetic, in units of the length of the vector along the
    face.
    """
    nx = f[face + TY]
    ny = -f[face + TX]
    px = ux * t
    py = uy * t
    x, x_rest = plus(dx, px)
    y, y_rest = plus(dy, py)
    x_rest += product_error(ux, t, px) + (x_low + wx * t)
    y_rest += product_error(uy, t, py) + (y_low + wy * t)
    across = nx * x
    up = ny * y
    both, both_low = plus(across, up)
    gap, gap_low = plus(both, -f[face + FAR_OUT])
    mixed = (nx * x_rest + f[face + TY_LOW] * x) + (ny * y_rest - f[face + TX_LOW] * y)
    lost = product_error(nx, x, across) + product_error(ny, y, up)
    size = abs(nx) * (x_size + abs(x)) + abs(ny) * (y_size + abs(y)) + abs(f[face + FAR_OUT])
    left = gap + (((both_low + gap_low) + lost) + (mixed - f[face + FAR_LOW]))
    error = 2.0**-97 * size + 2.0**-52 * abs(left) + TINY
    rate = -(nx * ux + ny * uy)
    unsure = 2.0**-50 * (abs(nx * ux) + abs(ny * uy))
    ticks = t * per_time
    if rate > 2.0 * unsure and ticks < FAR:
        step = left / rate
        bound = (error + abs(step) * unsure) / (rate - unsure) * per_time * (1.0 + 2.0**-20)
        step *= per_time
        bound += 2.0**-49 * abs(step) + 2.0**-50
        if bound < 0.5:
            base = int(ticks)
            part = (ticks - float(base)) + step
            down = math.floor(part)
            over = part - float(down)
            if over > bound and over < 1.0 - bound:
                found = base + int(down)
                return larger(found, 0) if found < LIMIT else NEVER
    return OPEN


@apart
def enters(
    f: Numbers,
    row: int,
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    tick: float,
    per_time: float,
) -> int:
    """Return how many ticks after the later anchor two convex bodies touch, rounded down exactly, or
    ``NEVER``.

    ``row`` is where the row of their difference begins in the table ``f``, other arguments are those of
    ``contact.first_touch``.
    """
    whole = float(elapsed)
    time = whole * tick
    rest = float(elapsed - int(whole)) * tick
    dx, x_low, x_size, ux, wx = seen_from(x, vx, x2, vx2, time, rest)
    dy, y_low, y_size, uy, wy = seen_from(y, vy, y2, vy2, time, rest)
    count = int(f[row + COUNT])
    faces = row + HEAD
    reach = f[row + RADIUS]
    size = (x_size + y_size) + f[row + SIZE]
    speed = abs(ux) + abs(uy)
    guess = 0
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
            gap = (nx * dx + ny * dy) - f[face + OUT]
            rate = nx * ux + ny * uy
            highest = larger(highest, gap)
            if abs(rate) <= slack:
                still = (nx == 0.0 or (ux == 0.0 and wx == 0.0)) and (ny == 0.0 or (uy == 0.0 and wy == 0.0))
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
            gap = (nx * dx + ny * dy) - f[face + OUT]
            rate = nx * ux + ny * uy
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
                after = face + WIDE
                after = faces if after == faces + count * WIDE else after
                px = dx + ux * t
                py = dy + uy * t
                first = nx * (py - f[face + CY]) - ny * (px - f[face + CX])
                last = nx * (py - f[after + CY]) - ny * (px - f[after + CX])
                over = first > around and last < -around
                nearest = face if first < -around else after
                if not over:
                    known = known and (first < -around or last > around) and (corner < 0 or corner == nearest)
                    corner = nearest
            if over:
                ticks = -1
                if comes > 0.0:
                    ticks = tick_at_face(
                        f, face, t, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, per_time
                    )
                known = known and ticks >= 0
                if ticks >= 0 and reach > 0.0:
                    return ticks
                found = larger(found, ticks)
        if known and corner < 0:
            return found
        if not known:
            corner = -1
        if corner >= 0:
            ax, ax_low = plus(dx, -f[corner + CX])
            ay, ay_low = plus(dy, -f[corner + CY])
            found = filtered(
                ax,
                ax_low + (x_low - f[corner + CX_LOW]),
                x_size + abs(f[corner + CX]),
                ux,
                wx,
                ay,
                ay_low + (y_low - f[corner + CY_LOW]),
                y_size + abs(f[corner + CY]),
                uy,
                wy,
                reach,
                f[row + RADIUS_LOW],
                tick,
                per_time,
            )
            if found != OPEN:
                return found
            at_origin = f[corner + CX] == 0.0 and f[corner + CY] == 0.0
            if count == 1 and at_origin:  # two discs
                return look_closer(
                    x,
                    y,
                    vx,
                    vy,
                    elapsed,
                    x2,
                    y2,
                    vx2,
                    vy2,
                    reach,
                    f[row + RADIUS_LOW],
                    tick,
                    per_time,
                    0.0,
                    0.0,
                    0.0,
                    0.0,
                )
            guess = as_count(about(ax, ay, ux, uy, reach) * per_time)
    return enters_exactly(f, row, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, tick, guess)
