"""Measures of convex bodies in whole numbers: the last resort, right for all numbers that fit.

A measure (``shapes``) is a product of two vectors: one is a place, its change in a tick, or the change of
that change; the other lies along a face of the difference of two shapes, or across it, or begins at a corner.
At whole ticks all of them are whole numbers times a power of two. The distance of a line from a face's line
is a multiple of the vector's length, a root, so squares are compared: products of four. Comparing the
distances of a place from two faces needs products of six.

Rows are those of ``discs_exactly``, among them H, half the acceleration times the square of a tick, with room
for the square of a count.
"""

import math

from kinetile.kernel.certificates.digits import (
    CELLS,
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
from kinetile.kernel.certificates.discs_exactly import put_axis, room_of_plans
from kinetile.kernel.certificates.plans import Plans
from kinetile.kernel.compiled import Numbers, apart, hook, subroutine, zeros

CORNERS, RADIUS, RADIUS_LOW, ALL_SIZES, LEAST, PLAIN, FLUSH, FIRST_CORNER = range(8)
"""Columns of a row's head: the number of corners, R as a sum of two, more than all coordinates and R
together, not more than any double in the row that is not 0; whether M is an upright box without a margin, or
0; the width of the strip without effect; and the beginning of the corners."""

CX, CY, CX_LOW, CY_LOW, TX, TY, TX_LOW, TY_LOW, FAR_OUT, FAR_LOW, NX, NY, OUT, RANK, WIDE = range(15)
"""Columns of a corner and the face that begins there: the corner; the face's way, or another vector along it;
the distance of its line, moved out by R, from the origin, in units of that vector's length; its normal as in
rule 9s; the same distance in units of that; its number; and the number of columns."""


DX, DY, UX, UY, HX, HY, AX, AY, WAY_X, WAY_Y, WIDTH, COUNT_ROW = range(0, 12 * CELLS, CELLS)
"""Rows of lengths: the separation at the later anchor, its change in a tick, and half the change of that; a
place or a rate, a vector along a face, a width, and a count of ticks."""

GAP_OF, LENGTH2, LEAST_GAP, LEAST_LENGTH2, WIDTH2 = range(12 * CELLS, 22 * CELLS, 2 * CELLS)
"""Rows of products of two: of a normal and a place, and the square of the normal; the same of another face;
and the square of a width."""

FOURS = 22 * CELLS
SIXES = 26 * CELLS
"""Rows of products of four and of six."""

WHOLE = 32 * CELLS


GAP, STRIP, LINE, ALONG, BEYOND, AWAY = range(6)
"""Measures: beyond the line of a face moved out by R, or by R less the strip, or not moved; along a face from
its first corner, and from its last; and, for rates alone, away from a corner, from the place at the later
anchor."""

ITSELF, RATE, BEND = range(3)
"""Orders of a measure: itself, its change in a tick, and half the change of that."""


@hook
def next_corner(f: Numbers, row: int, face: int) -> int:
    """Returns the corner at the end of a face."""
    after = face + WIDE
    return after if after < row + FIRST_CORNER + int(f[row + CORNERS]) * WIDE else row + FIRST_CORNER


@hook
def margin_of(f: Numbers, row: int, kind: int) -> tuple[float, float]:
    """Returns the outward shift of lines, a sum of two doubles: R, or R' of rule 5s; below 0 for inward."""
    if kind == GAP:
        return f[row + RADIUS], f[row + RADIUS_LOW]
    return f[row + RADIUS] - f[row + FLUSH], 0.0


@subroutine
def difference_of(
    m: Cells, target: int, from_row: int, value: float, low: float, first: int, end: int
) -> None:
    """Writes the difference of a number and a sum of two doubles into a row."""
    copy(m, target, from_row, first, end)
    put(m, target, value, 0, -1)
    put(m, target, low, 0, -1)
    carry(m, target, first, end, 1)


@subroutine
def from_corner(m: Cells, f: Numbers, corner: int, x: int, y: int, first: int, end: int) -> None:
    """Writes a place, less a corner, into two rows."""
    difference_of(m, AX, x, f[corner + CX], f[corner + CX_LOW], first, end)
    difference_of(m, AY, y, f[corner + CY], f[corner + CY_LOW], first, end)


@subroutine
def along_face(m: Cells, f: Numbers, face: int, first: int, end: int) -> None:
    """Writes the vector along a face into the rows ``WAY_X`` and ``WAY_Y``."""
    for row, at, low in ((WAY_X, TX, TX_LOW), (WAY_Y, TY, TY_LOW)):
        clear(m, row, first, end)
        put(m, row, f[face + at], 0, 1)
        put(m, row, f[face + low], 0, 1)
        carry(m, row, first, end, 1)


@subroutine
def dot(m: Cells, target: int, ax: int, ay: int, bx: int, by: int, first: int, end: int) -> int:
    """Writes the scalar product of two vectors into a row; returns its sign."""
    return two_products(m, target, ax, bx, 1, ay, by, first, end)


@subroutine
def cross(m: Cells, target: int, ax: int, ay: int, bx: int, by: int, first: int, end: int) -> int:
    """Writes the cross product of two vectors into a row; returns its sign."""
    return two_products(m, target, ax, by, -1, ay, bx, first, end)


@subroutine
def is_nearer(m: Cells, first: int, end: int) -> int:
    """Returns the sign of g'^2 n.n - g^2 n'.n': positive if a place in M is nearer to the line of a face
    (``GAP_OF``, ``LENGTH2``) than to another face's (``LEAST_GAP``, ``LEAST_LENGTH2``)."""
    clear(m, SIXES, 6 * first, 6 * end)
    for gap, length2, sign in ((GAP_OF, LEAST_LENGTH2, -1), (LEAST_GAP, LENGTH2, 1)):
        clear(m, FOURS, 4 * first, 4 * end)
        add_product(m, FOURS, gap, 2 * first, 2 * end, gap, 2 * first, 2 * end)
        carry(m, FOURS, 4 * first, 4 * end, 1)
        add_product(m, SIXES, FOURS, 4 * first, 4 * end, length2, 2 * first, 2 * end)
        carry(m, SIXES, 6 * first, 6 * end, sign)
    return carry(m, SIXES, 6 * first, 6 * end, 1)


@subroutine
def read_in(m: Cells, f: Numbers, row: int, plans: Plans) -> tuple[int, int]:
    """Writes the numbers of two paths and of a row; returns the cells in use, or an end of 0: no room."""
    power = int(math.frexp(plans.per_tick)[1]) - 1
    first, end = room(CELLS, 0, f[row + ALL_SIZES], 0)
    first, end = room(first, end, f[row + LEAST], 0)  # and so all numbers of the row have room
    first, end = room_of_plans(plans, power, f[row + RADIUS], f[row + RADIUS_LOW], first, end)
    if end > 0:
        put_count(m, COUNT_ROW, plans.elapsed)
        put_axis(m, DX, UX, HX, WIDTH, COUNT_ROW, plans.x, power, first, end)
        put_axis(m, DY, UY, HY, WIDTH, COUNT_ROW, plans.y, power, first, end)
    return first, end


@subroutine
def put_vector(m: Cells, order: int, count: int, first: int, end: int) -> None:
    """Writes the separation after a number of ticks, its change in the tick then, or the change of that, into
    the rows ``AX`` and ``AY``."""
    put_count(m, COUNT_ROW, count)
    for target, place, step, bend in ((AX, DX, UX, HX), (AY, DY, UY, HY)):
        copy(m, target, bend, first, end)
        if order == ITSELF:  # (H n + U) n + D
            for more in (step, place):
                copy(m, WAY_X, target, first, end)
                copy(m, target, more, first, end)
                add_product(m, target, WAY_X, first, end - 3, COUNT_ROW, 0, 3)
                carry(m, target, first, end, 1)
        elif order == RATE:  # U + H + 2 H n
            for cell in range(first, end):
                m[target + cell] += m[step + cell]
                m[WAY_X + cell] = 2 * m[bend + cell]
            add_product(m, target, WAY_X, first, end - 3, COUNT_ROW, 0, 3)
            carry(m, target, first, end, 1)


@subroutine
def compared(m: Cells, gap: int, width: float, low: float, first: int, end: int) -> int:
    """Returns the sign of a gap's square less the square of a width times the length of a face's vector."""
    clear(m, WIDTH, first, end)
    put(m, WIDTH, width, 0, 1)
    put(m, WIDTH, low, 0, 1)
    carry(m, WIDTH, first, end, 1)
    clear(m, WIDTH2, 2 * first, 2 * end)
    add_product(m, WIDTH2, WIDTH, first, end, WIDTH, first, end)
    carry(m, WIDTH2, 2 * first, 2 * end, 1)
    dot(m, LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
    return two_products(m, FOURS, gap, gap, -1, WIDTH2, LENGTH2, 2 * first, 2 * end)


@apart
def sign_exactly(f: Numbers, row: int, face: int, kind: int, order: int, plans: Plans, count: int) -> int:
    """Returns the sign of a measure, of its rate or of its bend; 1 if it does not fit."""
    m = zeros(WHOLE)
    first, end = read_in(m, f, row, plans)
    if end == 0:
        return 1
    put_vector(m, order, count, first, end)
    if order == ITSELF:
        copy(m, WAY_X, AX, first, end)
        copy(m, WAY_Y, AY, first, end)
        corner = next_corner(f, row, face) if kind == BEYOND else face
        from_corner(m, f, corner, WAY_X, WAY_Y, first, end)
    if kind == AWAY:
        copy(m, HX, AX, first, end)
        copy(m, HY, AY, first, end)
        from_corner(m, f, face, DX, DY, first, end)
        return dot(m, GAP_OF, AX, AY, HX, HY, first, end)
    along_face(m, f, face, first, end)
    if kind >= ALONG:
        return dot(m, GAP_OF, AX, AY, WAY_X, WAY_Y, first, end)
    sign = cross(m, GAP_OF, AX, AY, WAY_X, WAY_Y, first, end)
    if order != ITSELF or kind == LINE:
        return sign
    width, low = margin_of(f, row, kind)
    if width == 0.0:
        return sign
    if width < 0.0:
        return 1 if sign >= 0 else -compared(m, GAP_OF, width, low, first, end)
    return -1 if sign <= 0 else compared(m, GAP_OF, width, low, first, end)


@apart
def farther_out(f: Numbers, row: int, face: int, other: int, plans: Plans, count: int) -> int:
    """Returns the sign of a place's distance out of a face's line less that out of another face's line, after
    a number of ticks; 0 if it does not fit."""
    m = zeros(WHOLE)
    first, end = read_in(m, f, row, plans)
    if end == 0:
        return 0
    put_vector(m, ITSELF, count, first, end)
    copy(m, HX, AX, first, end)
    copy(m, HY, AY, first, end)
    from_corner(m, f, other, HX, HY, first, end)
    along_face(m, f, other, first, end)
    its = cross(m, LEAST_GAP, AX, AY, WAY_X, WAY_Y, first, end)
    dot(m, LEAST_LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
    from_corner(m, f, face, HX, HY, first, end)
    along_face(m, f, face, first, end)
    own = cross(m, GAP_OF, AX, AY, WAY_X, WAY_Y, first, end)
    dot(m, LENGTH2, WAY_X, WAY_Y, WAY_X, WAY_Y, first, end)
    if own != its:
        return 1 if own > its else -1
    return -own * is_nearer(m, first, end)
