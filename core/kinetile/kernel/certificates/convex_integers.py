"""Contacts of convex bodies in whole numbers: the last resort, right for all finite doubles.

What is asked (``convex``) are signs of sums of products, in rows of digits as in ``integers``. A difference
is a row of doubles in a table that a narrow phase makes (``kinetile.toolbox.differences``).
"""

from __future__ import annotations

from kinetile.kernel.certificates.integers import (
    CELLS,
    DX,
    DY,
    FOURS,
    LIMIT,
    MEMORY,
    REACH,
    SUM,
    UX,
    UY,
    Cells,
    add_product,
    between,
    carry,
    clear,
    copy,
    narrowed,
    put,
    put_count,
    read_in,
    room,
    two_products,
)
from kinetile.kernel.certificates.integers import COUNT as TICKS
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.compiled import Numbers, apart, hook, larger, subroutine, zeros
from kinetile.kernel.tables import NEVER

COUNT, RADIUS, RADIUS_LOW, SIZE, LEAST, PLAIN, FLUSH, HEAD = range(8)
"""Columns of a row's head: the corners, R as a sum of two, more than all coordinates and R together, not more
than any double in the row that is not 0; whether M is an upright box without a margin, or 0; the width of the
strip that counts for nothing; and where the corners begin."""

CX, CY, CX_LOW, CY_LOW, TX, TY, TX_LOW, TY_LOW, FAR_OUT, FAR_LOW, NX, NY, OUT, RANK, WIDE = range(15)
"""Columns of a corner and the face that goes from it: the corner; the face's way, or another vector along it;
how far its line, moved out by R, is from the origin, in units of that vector's length; its normal as rule 9s
has it; the same distance in units of that; its number; and how many columns there are."""


X, Y, AX, AY, WAY_X, WAY_Y = range(MEMORY, MEMORY + 6 * CELLS, CELLS)
"""Rows of lengths: the separation at a tick, a place from a corner, and a vector along a face."""

SPEED2, REACH2, GAP, LENGTH2, LEAST_GAP, LEAST_LENGTH2 = range(
    MEMORY + 6 * CELLS, MEMORY + 18 * CELLS, 2 * CELLS
)
"""Rows of products of two: the squares of what a tick adds, and of R; of a normal and a place, and the square
of the normal; and the same of the face that is nearest so far."""

SIXES = MEMORY + 18 * CELLS
SIGNS = SIXES + 6 * CELLS
"""Rows of products of six, and for each corner the signs of the gap to its face, of the place along this, and
along the face before it."""

MOST = 16
"""Corners that a difference of two cores can have."""

ROOM = SIGNS + 3 * MOST


@hook
def next_corner(f: Numbers, row: int, face: int) -> int:
    """Return the corner at the end of a face."""
    after = face + WIDE
    return after if after < row + HEAD + int(f[row + COUNT]) * WIDE else row + HEAD


@subroutine
def place_at(m: Cells, first: int, end: int, count: int) -> None:
    """Put the separation at a count of ticks after the later anchor in the rows ``X`` and ``Y``."""
    put_count(m, TICKS, count)
    copy(m, X, DX, first, end)
    copy(m, Y, DY, first, end)
    add_product(m, X, UX, first, end - 3, TICKS, 0, 3)
    add_product(m, Y, UY, first, end - 3, TICKS, 0, 3)
    carry(m, X, first, end, 1)
    carry(m, Y, first, end, 1)


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
    return two_products(m, target, ax, bx, 1, ay, by, first, end)


@subroutine
def cross(m: Cells, target: int, ax: int, ay: int, bx: int, by: int, first: int, end: int) -> int:
    """Put the cross product of two vectors in a row; return its sign."""
    return two_products(m, target, ax, by, -1, ay, bx, first, end)


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
def outside_of(m: Cells, f: Numbers, faces: int, count: int, first: int, end: int) -> tuple[int, bool]:
    """Return what ``distance_at`` does where there is no margin, for a place whose line goes into M: outside
    it is to come in if one of the faces that it is before is crossed inwards."""
    highest = -1
    falls = False
    for k in range(count):
        face = faces + k * WIDE
        from_corner(m, f, face, X, Y, first, end)
        along_face(m, f, face, first, end)
        gap = cross(m, SUM, AX, AY, WAY_X, WAY_Y, first, end)
        if gap >= larger(highest, 0):
            inwards = cross(m, SUM, UX, UY, WAY_X, WAY_Y, first, end) < 0
            if gap > highest:
                falls = inwards
            elif gap == 0:
                falls = falls and inwards  # on a corner both faces are crossed
            else:
                falls = falls or inwards
            highest = gap
    return highest, falls if highest >= 0 else falls_within(m, f, faces, count, first, end)


@subroutine
def distance_at(m: Cells, f: Numbers, row: int, first: int, end: int, ticks: int) -> tuple[int, bool]:
    """Return the sign of a place's distance from M, less R, at a count of ticks, and whether it falls."""
    place_at(m, first, end, ticks)
    count = int(f[row + COUNT])
    faces = row + HEAD
    if f[row + RADIUS] == 0.0:
        return outside_of(m, f, faces, count, first, end)
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
        return -1, falls_within(m, f, faces, count, first, end)
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
            return two_products(m, FOURS, GAP, GAP, -1, REACH2, LENGTH2, 2 * first, 2 * end), falls
    return -1, False


@subroutine
def read_row(m: Cells, f: Numbers, row: int, plans: Plans) -> tuple[int, int]:
    """Make numbers of two paths and of a row; return what ``read_in`` does."""
    first, end = room(CELLS, 0, f[row + SIZE], 0)
    first, end = room(first, end, f[row + LEAST], 0)  # and so all numbers of the row have room
    first, end = read_in(m, plans, f[row + RADIUS], f[row + RADIUS_LOW], first, end)
    if end <= CELLS:
        dot(m, SPEED2, UX, UY, UX, UY, first, end)
        add_product(m, REACH2, REACH, first, end, REACH, first, end)
        carry(m, REACH2, 2 * first, 2 * end, 1)
    return first, end


@subroutine
def last_within(
    m: Cells, f: Numbers, row: int, first: int, end: int, guess: int, leaves: bool, returns: bool
) -> int:
    """Return the last count of ticks at which a place is outside, or touches, and comes nearer; or if it
    ``leaves``, at which it is in, or touches, and before that if it ``returns``, comes nearer."""
    low = 0
    high = LIMIT + 1
    stride = 1
    guess = between(low, high, guess)
    while high - low > 1:
        gap, falls = distance_at(m, f, row, first, end, guess)
        before = (gap <= 0 or (returns and falls)) if leaves else (falls and gap >= 0)
        low, high, guess, stride = narrowed(low, high, guess, stride, before)
    return low if low < LIMIT else NEVER


@subroutine
def passes_through(m: Cells, f: Numbers, row: int, first: int, end: int) -> bool:
    """Whether M with its margin is on both sides of the line on which a place moves, by more than a strip:
    a corner is not as far on the other side as R is wider than the strip, or farther on this one."""
    left = False
    right = False
    copy(m, WAY_X, REACH, first, end)
    put(m, WAY_X, f[row + FLUSH], 0, -1)
    wider = carry(m, WAY_X, first, end, 1) > 0
    clear(m, LEAST_GAP, 2 * first, 2 * end)
    add_product(m, LEAST_GAP, WAY_X, first, end, WAY_X, first, end)
    carry(m, LEAST_GAP, 2 * first, 2 * end, 1)
    for k in range(int(f[row + COUNT])):
        from_corner(m, f, row + HEAD + k * WIDE, DX, DY, first, end)
        side = cross(m, GAP, AX, AY, UX, UY, first, end)
        farther = two_products(m, FOURS, GAP, GAP, -1, LEAST_GAP, SPEED2, 2 * first, 2 * end)
        left = left or (side >= 0 or farther < 0 if wider else side > 0 and farther > 0)
        right = right or (side <= 0 or farther < 0 if wider else side < 0 and farther > 0)
    return left and right and (f[row + COUNT] > 2.0 or f[row + RADIUS] > 0.0)


@apart
def enters_exactly(f: Numbers, row: int, plans: Plans, guess: int) -> int:
    """Return what ``enters`` does, for finite numbers of any size; for others ``NEVER``."""
    x = plans.x
    y = plans.y
    if x.v == x.v2 and y.v == y.v2:
        return NEVER
    m = zeros(ROOM)
    first, end = read_row(m, f, row, plans)
    if end > CELLS or not passes_through(m, f, row, first, end):
        return NEVER
    gap, falls = distance_at(m, f, row, first, end, 0)
    if not falls:
        return NEVER
    return 0 if gap <= 0 else last_within(m, f, row, first, end, guess, False, False)


@subroutine
def goes_into(m: Cells, f: Numbers, row: int, first: int, end: int) -> bool:
    """Whether the line on which a place moves has points nearer to M than R, or inside it."""
    left = False
    right = False
    for k in range(int(f[row + COUNT])):
        from_corner(m, f, row + HEAD + k * WIDE, DX, DY, first, end)
        side = cross(m, GAP, AX, AY, UX, UY, first, end)
        nearer = two_products(m, FOURS, GAP, GAP, -1, REACH2, SPEED2, 2 * first, 2 * end) < 0
        left = left or side > 0 or nearer
        right = right or side < 0 or nearer
    return left and right


@apart
def leaves_exactly(f: Numbers, row: int, plans: Plans, guess: int) -> int:
    """Return what ``leaves`` does, for finite numbers of any size; for others 0."""
    if f[row + COUNT] < 3.0 and f[row + RADIUS] == 0.0:
        return 0
    m = zeros(ROOM)
    first, end = read_row(m, f, row, plans)
    if end > CELLS:
        return 0
    gap, falls = distance_at(m, f, row, first, end, 0)
    returns = gap > 0
    if returns and not (falls and goes_into(m, f, row, first, end)):
        return 0
    if plans.x.v == plans.x.v2 and plans.y.v == plans.y.v2:
        return NEVER
    return last_within(m, f, row, first, end, guess, True, returns)


@apart
def comes_nearer(f: Numbers, row: int, face: int, vx: float, vy: float, vx2: float, vy2: float) -> int:
    """Return 1 if a second body comes nearer to the line of a face, seen from a first, exactly; else 0."""
    across = f[face + TY] * (vx2 - vx)
    up = f[face + TX] * (vy2 - vy)
    if abs(across - up) > 2.0**-49 * (abs(across) + abs(up)):
        return 1 if across < up else 0
    m = zeros(ROOM)
    size, least = f[row + SIZE], f[row + LEAST]
    plans = Plans(Axis(0.0, vx, 0.0, vx2, 0.0, 0.0), Axis(0.0, vy, 0.0, vy2, 0.0, 0.0), 0, 2.0**-52, 2.0**52)
    first, end = read_in(m, plans, size, least)
    if end > CELLS:
        return 0
    along_face(m, f, face, first, end)
    return 1 if cross(m, SUM, UX, UY, WAY_X, WAY_Y, first, end) < 0 else 0
