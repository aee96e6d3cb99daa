"""Measures of accelerated convex bodies in whole numbers: the last resort, right for all that has room.

A measure (``bent_convex``) is a product of two vectors: of a place, of what a tick adds to it, or of what it
bends by; and of a vector along a face of the difference of two shapes, or across it, or from a corner. At
whole ticks all of them are whole numbers times a power of two. The distance of a line from that of a face is
a multiple of the vector's length, a root, so squares are compared: products of four. Which of two faces a
place is farther out of is a question of products of six.

Rows are those of ``convex_integers``, and two more for H, half the acceleration times the square of a tick,
as ``bent_integers`` has it: with its room for the square of a count. Products of six take 6 x 11 cells for
less than 58.
"""

from __future__ import annotations

import math

from kinetile.kernel.certificates.bent_integers import put_axis, room_of_bends
from kinetile.kernel.certificates.convex_integers import (
    AX,
    AY,
    FLUSH,
    LEAST,
    LEAST_GAP,
    LEAST_LENGTH2,
    LENGTH2,
    RADIUS,
    RADIUS_LOW,
    REACH2,
    ROOM,
    SIZE,
    WAY_X,
    WAY_Y,
    along_face,
    cross,
    dot,
    from_corner,
    is_nearer,
    next_corner,
)
from kinetile.kernel.certificates.convex_integers import GAP as OWN_GAP
from kinetile.kernel.certificates.integers import (
    CELLS,
    DX,
    DY,
    FOURS,
    REACH,
    UX,
    UY,
    Cells,
    add_product,
    carry,
    clear,
    copy,
    put,
    put_count,
    room,
    two_products,
)
from kinetile.kernel.certificates.integers import COUNT as TICKS
from kinetile.kernel.certificates.plans import BentPlans
from kinetile.kernel.compiled import Numbers, apart, subroutine, zeros

GAP, STRIP, LINE, ALONG, BEYOND, AWAY = range(6)
"""Measures: beyond the line of a face moved out by R, or in by the strip, or as it is; along a face from its
first corner, and from its last; and, of rates alone, away from a corner, from where the place is at the later
anchor."""

VALUE, RATE, BEND = range(3)
"""What is asked of a measure: itself, what a tick adds to it, and half of what that changes by."""

HX, HY = ROOM, ROOM + CELLS
"""Rows of lengths: half of what changes what a tick adds to the separation."""

WHOLE = ROOM + 2 * CELLS


@subroutine
def read_in_bent(m: Cells, f: Numbers, row: int, plans: BentPlans) -> tuple[int, int]:
    """Make numbers of two paths and of a row; return the cells that are in use; an end of 0: no room."""
    power = int(math.frexp(plans.tick)[1]) - 1
    first, end = room(CELLS, 0, f[row + SIZE], 0)
    first, end = room(first, end, f[row + LEAST], 0)  # and so all numbers of the row have room
    first, end = room_of_bends(plans, power, f[row + RADIUS], f[row + RADIUS_LOW], first, end)
    if end > 0:
        put_count(m, TICKS, plans.elapsed)
        put_axis(m, DX, UX, HX, REACH, TICKS, plans.x, power, first, end)
        put_axis(m, DY, UY, HY, REACH, TICKS, plans.y, power, first, end)
    return first, end


@subroutine
def put_vector(m: Cells, order: int, count: int, first: int, end: int) -> None:
    """Put the separation after a number of ticks, what a tick then adds to it, or what that bends by, in the
    rows ``AX`` and ``AY``."""
    put_count(m, TICKS, count)
    for target, place, step, bend in ((AX, DX, UX, HX), (AY, DY, UY, HY)):
        copy(m, target, bend, first, end)
        if order == VALUE:  # (H n + U) n + D
            for more in (step, place):
                copy(m, WAY_X, target, first, end)
                copy(m, target, more, first, end)
                add_product(m, target, WAY_X, first, end - 3, TICKS, 0, 3)
                carry(m, target, first, end, 1)
        elif order == RATE:  # U + H + 2 H n
            for cell in range(first, end):
                m[target + cell] += m[step + cell]
                m[WAY_X + cell] = 2 * m[bend + cell]
            add_product(m, target, WAY_X, first, end - 3, TICKS, 0, 3)
            carry(m, target, first, end, 1)


@subroutine
def compared(m: Cells, gap: int, width: float, low: float, first: int, end: int) -> int:
    """Return the sign of a square of a gap, less that of a width times the length of the vector of a face."""
    clear(m, REACH, first, end)
    put(m, REACH, width, 0, 1)
    put(m, REACH, low, 0, 1)
    carry(m, REACH, first, end, 1)
    clear(m, REACH2, 2 * first, 2 * end)
    add_product(m, REACH2, REACH, first, end, REACH, first, end)
    carry(m, REACH2, 2 * first, 2 * end, 1)
    dot(m, LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
    return two_products(m, FOURS, gap, gap, -1, REACH2, LENGTH2, 2 * first, 2 * end)


@apart
def sign_exactly(f: Numbers, row: int, face: int, kind: int, order: int, plans: BentPlans, count: int) -> int:
    """Return the sign of a measure, of its rate or of its bend; 1 of what has no room."""
    m = zeros(WHOLE)
    first, end = read_in_bent(m, f, row, plans)
    if end == 0:
        return 1
    put_vector(m, order, count, first, end)
    if order == VALUE:
        copy(m, WAY_X, AX, first, end)
        copy(m, WAY_Y, AY, first, end)
        corner = next_corner(f, row, face) if kind == BEYOND else face
        from_corner(m, f, corner, WAY_X, WAY_Y, first, end)
    if kind == AWAY:
        copy(m, HX, AX, first, end)
        copy(m, HY, AY, first, end)
        from_corner(m, f, face, DX, DY, first, end)
        return dot(m, OWN_GAP, AX, AY, HX, HY, first, end)
    along_face(m, f, face, first, end)
    if kind >= ALONG:
        return dot(m, OWN_GAP, AX, AY, WAY_X, WAY_Y, first, end)
    sign = cross(m, OWN_GAP, AX, AY, WAY_X, WAY_Y, first, end)
    if order != VALUE or kind == LINE:
        return sign
    if kind == GAP:
        if f[row + RADIUS] == 0.0 or sign <= 0:
            return sign if f[row + RADIUS] == 0.0 else -1
        return compared(m, OWN_GAP, f[row + RADIUS], f[row + RADIUS_LOW], first, end)
    return 1 if sign >= 0 else -compared(m, OWN_GAP, f[row + FLUSH], 0.0, first, end)


@apart
def farther_out(f: Numbers, row: int, face: int, other: int, plans: BentPlans, count: int) -> int:
    """Return the sign of how much farther a place is out of the line of a face than of that of another one,
    after a number of ticks; 0 of what has no room."""
    m = zeros(WHOLE)
    first, end = read_in_bent(m, f, row, plans)
    if end == 0:
        return 0
    put_vector(m, VALUE, count, first, end)
    copy(m, HX, AX, first, end)
    copy(m, HY, AY, first, end)
    from_corner(m, f, other, HX, HY, first, end)
    along_face(m, f, other, first, end)
    its = cross(m, LEAST_GAP, AX, AY, WAY_X, WAY_Y, first, end)
    dot(m, LEAST_LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
    from_corner(m, f, face, HX, HY, first, end)
    along_face(m, f, face, first, end)
    own = cross(m, OWN_GAP, AX, AY, WAY_X, WAY_Y, first, end)
    dot(m, LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
    if own != its:
        return 1 if own > its else -1
    return -own * is_nearer(m, first, end)
