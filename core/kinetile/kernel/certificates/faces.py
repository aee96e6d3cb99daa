"""When a moving place crosses the lines of a convex polygon's faces, in double with bounds of all rounding.

The gap to a line, moved out by the margin R, is a straight function of time. It is computed in compensated
arithmetic, at a time near its root or at the later anchor, and one step from there says the tick of the root,
where it is not so near to a whole tick that the bound reaches it.

Scenes on lattices have roots at whole ticks all the time. There the coordinates of the place are whole
multiples of a power of two, the *grain*: of the lowest bits of places, and of speeds times a tick. So is the
gap of what has no margin, and a gap that is smaller than its grain is none.
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.contact import OPEN, TINY, after, plus
from kinetile.kernel.certificates.convex_integers import (
    COUNT,
    CX,
    CX_LOW,
    CY,
    CY_LOW,
    FAR_LOW,
    FAR_OUT,
    HEAD,
    TX,
    TX_LOW,
    TY,
    TY_LOW,
    WIDE,
)
from kinetile.kernel.certificates.integers import LIMIT
from kinetile.kernel.certificates.structural import FAR
from kinetile.kernel.compiled import Numbers, hook, larger, smaller
from kinetile.kernel.tables import NEVER
from kinetile.kernel.vectors import product_error


@hook
def gap_to_face(
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
) -> tuple[float, float]:
    """Return how far a place is outside the line of a face, moved out by R, at a time t after the later
    anchor, in units of the length of the vector along the face; and how far that can be off."""
    nx = f[face + TY]
    ny = -f[face + TX]
    x, x_rest = after(t, dx, x_low, ux, wx)
    y, y_rest = after(t, dy, y_low, uy, wy)
    across = nx * x
    up = ny * y
    both, both_low = plus(across, up)
    gap, gap_low = plus(both, -f[face + FAR_OUT])
    mixed = (nx * x_rest + f[face + TY_LOW] * x) + (ny * y_rest - f[face + TX_LOW] * y)
    lost = product_error(nx, x, across) + product_error(ny, y, up)
    size = abs(nx) * (x_size + abs(x)) + abs(ny) * (y_size + abs(y)) + abs(f[face + FAR_OUT])
    left = gap + (((both_low + gap_low) + lost) + (mixed - f[face + FAR_LOW]))
    return left, 2.0**-97 * size + 2.0**-52 * abs(left) + TINY


@hook
def grain_of(value: float) -> float:
    """Return the greatest power of two of which a number is a multiple: infinity for 0."""
    if value == 0.0:
        return math.inf
    part, exponent = math.frexp(value)
    digits = int(abs(part) * 2.0**53)
    return float(math.ldexp(float(digits & -digits), exponent - 53))


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
    grain: float,
) -> int:
    """Return in which tick after the later anchor a place crosses the line of a face, moved out by R, where
    it does at about a time t > 0; ``OPEN`` if that is not sure.

    One step from there, the gap in compensated arithmetic. Where that ends at a whole tick, or
    nearly, it is that one if the gap is none there: at whole ticks it is a multiple of ``grain``.
    """
    left, error = gap_to_face(f, face, t, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy)
    rate = f[face + TX] * uy - f[face + TY] * ux
    unsure = 2.0**-50 * (abs(f[face + TX] * uy) + abs(f[face + TY] * ux))
    ticks = t * per_time
    if abs(rate) > 2.0 * unsure and ticks < FAR:
        step = left / rate
        bound = (error + abs(step) * unsure) / (abs(rate) - unsure) * per_time * (1.0 + 2.0**-20)
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
            near = math.floor(part + 0.5)
            away = (near - (ticks - float(base))) / per_time
            there = left - rate * away
            error += abs(away) * unsure + 2.0**-51 * (abs(left) + abs(there))
            found = base + int(near)
            if abs(there) + error < grain and found < LIMIT:
                return int(larger(found, 0))
    return OPEN


@hook
def by_ticks(
    f: Numbers,
    row: int,
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
    grain: float,
) -> int:
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
        gap, error = gap_to_face(f, face, 0.0, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy)
        nothing = abs(gap) + error < own
        gap = 0.0 if nothing else gap
        rate = nx * ux + ny * uy
        unsure = 2.0**-49 * (abs(nx * ux) + abs(ny * uy))
        still = (nx == 0.0 or (ux == 0.0 and wx == 0.0)) and (ny == 0.0 or (uy == 0.0 and wy == 0.0))
        if (abs(gap) <= error and not nothing) or (abs(rate) <= unsure and not still):
            known = False
            continue
        if gap >= 0.0 and rate >= 0.0:
            return NEVER
        t = -gap / rate if rate != 0.0 else 0.0
        ticks = 0
        if t > 0.0 and (rate < 0.0 or t * per_time < FAR):
            ticks = tick_at_face(
                f, face, t, dx, x_low, x_size, ux, wx, dy, y_low, y_size, uy, wy, per_time, own
            )
            known = known and ticks != OPEN
            if rate > 0.0:
                goes = smaller(goes, ticks)
        if rate < 0.0 and gap >= 0.0:
            comes = larger(comes, ticks)
    if not known or comes < 0 or comes == goes:
        return OPEN
    return comes if comes < goes else NEVER
