"""When two upright boxes touch, or a disc and one: the exact ticks, an axis at a time.

A *box* is centred on its body's place and has half a width and half a height; a disc is a box without sides
and a radius. Seen from one body the other's place moves on a line, and the two overlap while it is in their
difference: a box with the halves of both, rounded by the sum of the radii (docs/specification.md, 5s).

Along one axis that is a question about two discs on a line: the gap of an axis closes when discs of those
halves would touch, and opens again when they would part. So ``contact`` has the ticks, exactly, with a filter
in double in front. A place enters a box when it is within it along both axes: at the later of the two
entries, if that is before either exit. Ticks tell which is before, nearly always; where both are of one tick
whole numbers decide (``enters_first``).

A box with a margin is a union: a box that is wider by the margin, one that is higher, and a disc at each
corner. The first entry into a union is the first into a member, and no entry is lost between them: where the
boxes end the discs begin.
"""

from __future__ import annotations

import numpy as np

from kinetile.kernel.certificates.contact import first_touch, plus, seen_from, touch_through
from kinetile.kernel.certificates.integers import (
    CELLS,
    CROSS,
    DX,
    DY,
    MEMORY,
    REACH,
    SUM,
    UX,
    UY,
    Cells,
    X,
    add_product,
    carry,
    copy,
    put,
    read_in,
    signs_at,
)
from kinetile.kernel.compiled import apart, hook, larger, smaller, subroutine
from kinetile.kernel.tables import NEVER

BEYOND, AT, WITHIN = 1, 0, -1
"""Signs of the gap along an axis."""


@apart
def exact_gap(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    radius: float,
    radius2: float,
    tick: float,
    right: float,
    up: float,
    width: float,
    height: float,
) -> int:
    """Return the sign of the gap of two discs at the later anchor, 3 more if they approach and 3 less if they
    go apart. Arguments as in ``contact.last_touch``."""
    m = np.zeros(MEMORY, dtype=np.int64)
    first, end = read_in(
        m, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick, right, up, width, height
    )
    if end > CELLS:
        return BEYOND
    bend, gap = signs_at(m, first, end, 0)
    return gap - 3 * bend


@hook
def exact_gap_along(
    x: float, vx: float, elapsed: int, x2: float, vx2: float, half: float, half2: float, tick: float
) -> int:
    """Return the same of two intervals along an axis."""
    return exact_gap(x, 0.0, vx, 0.0, elapsed, x2, 0.0, vx2, 0.0, half, half2, tick, 0.0, 0.0, 0.0, 0.0)


@hook
def sign_in(found: int) -> int:
    """Return the sign of the gap from what ``exact_gap`` returns."""
    if found > 1:
        return found - 3
    return found + 3 if found < -1 else found


@hook
def gap_of(
    x: float, vx: float, elapsed: int, x2: float, vx2: float, half: float, half2: float, tick: float
) -> int:
    """Return the sign of the gap of two intervals at the later anchor: BEYOND, AT or WITHIN."""
    whole = float(elapsed)
    d, low, size, _, _ = seen_from(x, vx, x2, vx2, whole * tick, float(elapsed - int(whole)) * tick)
    sides, sides_low = plus(half, half2)
    gap = (abs(d) - sides) + ((low if d > 0.0 else -low) - sides_low)
    if abs(gap) > 2.0**-48 * (size + sides):
        return BEYOND if gap > 0.0 else WITHIN
    return sign_in(exact_gap_along(x, vx, elapsed, x2, vx2, half, half2, tick))


@subroutine
def axes_read(
    m: Cells,
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    width: float,
    width2: float,
    height: float,
    height2: float,
    tick: float,
) -> tuple[int, int]:
    """Make numbers of two paths, of half the width (``REACH``) and half the height (``X``) of a difference;
    return the cells in use, as ``integers.read_in``."""
    first, end = read_in(
        m, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, width, width2, tick, 0.0, 0.0, height, height2
    )
    if end <= CELLS:
        put(m, X, height, 0, 1)
        put(m, X, height2, 0, 1)
        carry(m, X, first, end, 1)
    return first, end


@apart
def deeper(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    width: float,
    width2: float,
    height: float,
    height2: float,
    tick: float,
) -> int:
    """Return the sign of the gap along x less that along y, at the later anchor."""
    m = np.zeros(MEMORY, dtype=np.int64)
    first, end = axes_read(m, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, width, width2, height, height2, tick)
    if end > CELLS:
        return 0
    copy(m, SUM, DX, first, end)
    if carry(m, SUM, first, end, 1) < 0:
        carry(m, SUM, first, end, -1)
    copy(m, CROSS, DY, first, end)
    if carry(m, CROSS, first, end, 1) < 0:
        carry(m, CROSS, first, end, -1)
    for i in range(first, end):
        m[SUM + i] += m[X + i] - m[REACH + i] - m[CROSS + i]
    return carry(m, SUM, first, end, 1)


@apart
def enters_first(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    width: float,
    width2: float,
    height: float,
    height2: float,
    tick: float,
) -> int:
    """Return 1 if a place comes within a difference along x before it leaves it along y, else 0. Before: it
    moves along both axes.

    It enters at (-R - s.d)/|v| along x, s being the sign of v there, and leaves at (R - s.d)/|v| along y.
    """
    m = np.zeros(MEMORY, dtype=np.int64)
    first, end = axes_read(m, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, width, width2, height, height2, tick)
    if end > CELLS:
        return 0
    right = carry(m, UX, first, end, 1)
    up = carry(m, UY, first, end, 1)
    if right < 0:
        carry(m, UX, first, end, -1)
        carry(m, DX, first, end, -1)
    if up < 0:
        carry(m, UY, first, end, -1)
        carry(m, DY, first, end, -1)
    for i in range(first, end):
        m[DX + i] += m[REACH + i]  # the negated way to the entry
        m[X + i] -= m[DY + i]  # the way to the exit
    carry(m, DX, first, end, 1)
    carry(m, X, first, end, 1)
    add_product(m, SUM, DX, first, end, UY, first, end)
    add_product(m, SUM, X, first, end, UX, first, end)
    return 1 if carry(m, SUM, 2 * first, 2 * end, 1) > 0 else 0


OPEN = -1
"""What ``leaves_after`` returns where double does not decide."""


@hook
def leaves_after(
    ticks: int,
    x: float,
    vx: float,
    elapsed: int,
    x2: float,
    vx2: float,
    half: float,
    half2: float,
    tick: float,
    per_time: float,
) -> int:
    """Return 1 if two intervals are still to part, or still to meet, more than a tick after ``ticks`` after
    the later anchor; 0 if they have parted a tick before; or OPEN."""
    whole = float(elapsed)
    d, low, size, u, _ = seen_from(x, vx, x2, vx2, whole * tick, float(elapsed - int(whole)) * tick)
    if u == 0.0:
        return 1 if vx == vx2 else OPEN
    sides = half + half2
    rest = sides - (d + low if u > 0.0 else -(d + low))
    time = rest / abs(u)
    error = (2.0**-48 * (size + sides)) / abs(u) + 2.0**-50 * abs(time)
    over = time * per_time - float(ticks)
    doubt = error * per_time + 2.0**-50 * float(ticks) + 4.0
    if over > doubt:
        return 1
    return 0 if over < -doubt else OPEN


@hook
def into_box(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    width: float,
    width2: float,
    height: float,
    height2: float,
    tick: float,
    per_time: float,
    across: int,
    along: int,
) -> int:
    """Return how many ticks after the later anchor a place enters a box without a margin, rounded down
    exactly, or ``NEVER``. ``across`` and ``along`` are ``gap_of`` along x and y, not both ``WITHIN``."""
    enters_x = -1
    enters_y = -1
    if across != WITHIN:
        enters_x = first_touch(x, 0.0, vx, 0.0, elapsed, x2, 0.0, vx2, 0.0, width, width2, tick, per_time)
    if along != WITHIN:
        enters_y = first_touch(y, 0.0, vy, 0.0, elapsed, y2, 0.0, vy2, 0.0, height, height2, tick, per_time)
    if enters_x == NEVER or enters_y == NEVER:
        return NEVER
    if enters_x >= 0:
        before = leaves_after(enters_x, y, vy, elapsed, y2, vy2, height, height2, tick, per_time)
        if before == OPEN:
            before = enters_first(
                x, y, vx, vy, elapsed, x2, y2, vx2, vy2, width, width2, height, height2, tick
            )
        if before == 0:
            return NEVER
    if enters_y >= 0:
        before = leaves_after(enters_y, x, vx, elapsed, x2, vx2, width, width2, tick, per_time)
        if before == OPEN:
            before = enters_first(
                y, x, vy, vx, elapsed, y2, x2, vy2, vx2, height, height2, width, width2, tick
            )
        if before == 0:
            return NEVER
    return int(larger(enters_x, enters_y))


@hook
def out_of_overlap(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    width: float,
    width2: float,
    height: float,
    height2: float,
    tick: float,
) -> int:
    """Return 0 if a place that is in a box comes nearer to its middle across the face that it is nearest to,
    or ``NEVER``; of several faces, across each."""
    nearer_x = exact_gap_along(x, vx, elapsed, x2, vx2, width, width2, tick) > 1
    nearer_y = exact_gap_along(y, vy, elapsed, y2, vy2, height, height2, tick) > 1
    which = deeper(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, width, width2, height, height2, tick)
    falls = (nearer_x or which < 0) and (nearer_y or which > 0)
    return 0 if falls else NEVER


@apart
def boxes_touch(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    width: float,
    width2: float,
    height: float,
    height2: float,
    tick: float,
    per_time: float,
) -> int:
    """Return how many ticks after the later anchor two boxes touch, rounded down exactly, or ``NEVER``;
    ``width`` to ``height2`` are half of theirs, other arguments those of ``contact.first_touch``."""
    across = gap_of(x, vx, elapsed, x2, vx2, width, width2, tick)
    along = gap_of(y, vy, elapsed, y2, vy2, height, height2, tick)
    if across != BEYOND and along != BEYOND:
        return out_of_overlap(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, width, width2, height, height2, tick)
    return into_box(
        x,
        y,
        vx,
        vy,
        elapsed,
        x2,
        y2,
        vx2,
        vy2,
        width,
        width2,
        height,
        height2,
        tick,
        per_time,
        across,
        along,
    )


@apart
def disc_touches_box(
    x: float,
    y: float,
    vx: float,
    vy: float,
    elapsed: int,
    x2: float,
    y2: float,
    vx2: float,
    vy2: float,
    width: float,
    height: float,
    radius: float,
    tick: float,
    per_time: float,
) -> int:
    """Return what ``boxes_touch`` does for a disc of a radius and a box of half a width and half a height,
    whichever is the first."""
    across = gap_of(x, vx, elapsed, x2, vx2, width, 0.0, tick)
    along = gap_of(y, vy, elapsed, y2, vy2, height, 0.0, tick)
    if across != BEYOND and along != BEYOND:
        return out_of_overlap(x, y, vx, vy, elapsed, x2, y2, vx2, vy2, width, 0.0, height, 0.0, tick)
    wider = gap_of(x, vx, elapsed, x2, vx2, width, radius, tick)
    higher = gap_of(y, vy, elapsed, y2, vy2, height, radius, tick)
    if along != BEYOND and wider != BEYOND:  # it touches the left or the right face, or overlaps it
        nearer = exact_gap_along(x, vx, elapsed, x2, vx2, width, radius, tick) > 1
        return 0 if nearer else NEVER
    if across != BEYOND and higher != BEYOND:
        nearer = exact_gap_along(y, vy, elapsed, y2, vy2, height, radius, tick) > 1
        return 0 if nearer else NEVER
    if along == BEYOND and across == BEYOND:
        whole = float(elapsed)
        time = whole * tick
        rest = float(elapsed - int(whole)) * tick
        dx, _, x_size, _, _ = seen_from(x, vx, x2, vx2, time, rest)
        dy, _, y_size, _, _ = seen_from(y, vy, y2, vy2, time, rest)
        beside = abs(dx) - width
        above = abs(dy) - height
        edge = radius * (1.0 + 2.0**-40) + 2.0**-48 * (x_size + y_size + width + height)
        if beside < edge and above < edge and beside * beside + above * above < edge * edge:
            right = -1.0 if dx > 0.0 else 1.0
            up = -1.0 if dy > 0.0 else 1.0
            gap = exact_gap(
                x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, 0.0, tick, right, up, width, height
            )
            if sign_in(gap) != BEYOND:  # it touches that corner, or overlaps it
                return 0 if gap > 1 else NEVER
    found = into_box(
        x,
        y,
        vx,
        vy,
        elapsed,
        x2,
        y2,
        vx2,
        vy2,
        width,
        radius,
        height,
        0.0,
        tick,
        per_time,
        wider,
        along,
    )
    found = smaller(
        found,
        into_box(
            x,
            y,
            vx,
            vy,
            elapsed,
            x2,
            y2,
            vx2,
            vy2,
            width,
            0.0,
            height,
            radius,
            tick,
            per_time,
            across,
            higher,
        ),
    )
    for corner in range(4):
        right = 1.0 if corner < 2 else -1.0
        up = 1.0 if corner % 2 == 0 else -1.0
        found = smaller(
            found,
            touch_through(
                x,
                y,
                vx,
                vy,
                elapsed,
                x2,
                y2,
                vx2,
                vy2,
                radius,
                0.0,
                tick,
                per_time,
                right,
                up,
                width,
                height,
            ),
        )
    return int(found)
