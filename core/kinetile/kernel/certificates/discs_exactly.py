"""Contacts of discs and walls in whole numbers: the last resort, right for all numbers that fit into cells.

Q at a whole tick n is a polynomial of degree 4 at most; its coefficients are whole numbers times a power of
two. The contact is the first n >= 0 with Q(n + 1) < 0 and Q(n + 1) - Q(n) < 0 (rule 5), and both are signs of
whole numbers. Let F1(n) = Q(n + 1) - Q(n), F2 and F3 the differences of F1 and F2: of degree 3, 2 and 1. A
sequence is monotone where its differences do not change between negative and not negative. So F3 is monotone,
and bisection finds its change of sign; between these places F2 is monotone, and so on: F1 is negative in the
whole of each of at most eight pieces, or nowhere in it. In a piece where F1 is negative, Q falls, and
bisection finds the first tick with Q < 0.

Cells
=====

Rows and digits are those of ``digits``. With q the length of a tick a separation is D + U n + H n^2, with H
half the acceleration times q^2. A double takes 78 bits from its cell on, times the square of a count up to
2^62 it is below 2^202, and with fewer than 2^32 periods of an image below 2^110; a sum of six such numbers is
below 2^205: 8 cells with a sign, and ``room`` with 3 more has 11. A product of two has 22 cells, 572 bits. Q
sums 6 such products for each of two axes, and the factors of the differences add up to less than 2^7: below
2^(410 + 11). Digits: a cell gets at most 160 products of 2^51 before a carry; a difference adds up to 15
digits of 2^25.

``scene.checks`` has accelerations from 2^-200 to 2^200 in size, and a tick is 2^-952 at least, so H is not
beyond the cells: 2^-201 times 2^-1904, brought to 53 bits, is 2^-2158 and begins in cell 96 - 83 = 13. If a
number does not fit, or is not finite, there is no contact: ``NEVER``.
"""

import math
from typing import NamedTuple

from kinetile.kernel.certificates.digits import (
    CELLS,
    LIMIT,
    Cells,
    add_product,
    between,
    carry,
    clear,
    copy,
    narrowed,
    put,
    put_count,
    room,
)
from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.compiled import larger, subroutine, zeros
from kinetile.kernel.tables import NEVER


class Window(NamedTuple):
    """The search window for rule 5: from a count of ticks to before another. ``levels`` is the number of
    differences of Q whose signs may change: 0 if Q falls all along, 1 without accelerations, else 3.
    ``risen`` says that Q has risen before."""

    low: int
    high: int
    levels: int
    risen: bool


NO_FALL, NO_FALL_YET = -1, -2
"""The values of ``first_fall`` if rule 5 does not hold in a window: Q has risen by its end, or not."""

D_ROW, U_ROW, H_ROW, V_ROW, N_ROW = range(0, 5 * CELLS, CELLS)
"""Rows of lengths: D, U and H along an axis, the rate of the first body's flight, and a count of ticks."""

TERMS = 5 * CELLS
"""Rows of products of two: the coefficients of Q, F1, F2 and F3, 5, 4, 3 and 2 of them."""

VALUE_ROW = TERMS + 14 * 2 * CELLS

OTHER_ROW = VALUE_ROW + 2 * CELLS
"""Rows of products of two, for computing a polynomial."""

MEMORY = OTHER_ROW + 2 * CELLS


@subroutine
def term(level: int, power: int) -> int:
    """Returns the row of a coefficient of Q, or of its differences."""
    return TERMS + 2 * CELLS * (level * (11 - level) // 2 + power)


@subroutine
def sign_at(m: Cells, first: int, end: int, level: int, count: int) -> int:
    """Returns the sign of Q, or of its differences of a level, at a count of ticks."""
    put_count(m, N_ROW, count)
    value = VALUE_ROW
    other = OTHER_ROW
    copy(m, value, term(level, 4 - level), first, end)
    sign = 0
    for power in range(3 - level, -1, -1):
        copy(m, other, term(level, power), first, end)
        add_product(m, other, value, first, end - 3, N_ROW, 0, 3)
        sign = carry(m, other, first, end, 1)
        value, other = other, value
    return sign


@subroutine
def change_of(m: Cells, first: int, end: int, level: int, low: int, high: int, guess: int) -> int:
    """Returns the first count after ``low`` with the sign, negative or not, that a monotone sequence has at
    ``high``; at ``low`` it has the other. A guess that is not between them is ignored."""
    negative = sign_at(m, first, end, level, low) < 0
    stride = 1 if low < guess and guess < high else LIMIT >> 1
    guess = between(low, high, guess)
    while high - low > 1:
        before = (sign_at(m, first, end, level, guess) < 0) == negative
        low, high, guess, stride = narrowed(low, high, guess, stride, before)
    return high


@subroutine
def add_differences(m: Cells, first: int, end: int, level: int) -> None:
    """Writes the coefficients of the differences of a level into their rows."""
    for power in range(5 - level):
        target = term(level, power)
        times = 1
        for i in range(power + 1, 6 - level):
            times = times * i // (i - power)  # i over power
            source = term(level - 1, i)
            for cell in range(first, end):
                m[target + cell] += times * m[source + cell]
        carry(m, target, first, end, 1)


@subroutine
def first_fall(m: Cells, first: int, end: int, window: Window, guess: int) -> int:
    """Returns the first count in a window that satisfies rule 5, after Q has risen; else ``NO_FALL`` if it
    has risen by the window's end, ``NO_FALL_YET`` if not. It is fast if Q becomes negative near ``guess``."""
    levels = window.levels
    for level in range(1, larger(levels, 1) + 1):
        add_differences(m, first, end, level)
    ends = zeros(32)
    ends[0] = window.low
    ends[1] = window.high
    pieces = 1
    for level in range(levels, 0, -1):
        for i in range(pieces, -1, -1):
            ends[2 * i] = ends[i]  # each piece may become two
        kept = 0
        for i in range(pieces):
            start = ends[2 * i]
            stop = ends[2 * i + 2]
            ends[kept] = start
            kept += 1
            if (sign_at(m, first, end, level, start) < 0) != (sign_at(m, first, end, level, stop) < 0):
                change = change_of(m, first, end, level, start, stop, -1)
                if change < stop:
                    ends[kept] = change
                    kept += 1
        ends[kept] = window.high
        pieces = kept
    risen = window.risen
    for i in range(pieces):
        start = ends[i]
        stop = ends[i + 1]
        rise = sign_at(m, first, end, 1, start)
        if rise >= 0:
            risen = risen or rise > 0 or sign_at(m, first, end, 1, stop - 1) > 0
        elif risen and sign_at(m, first, end, 0, stop) < 0:
            if sign_at(m, first, end, 0, start) < 0:
                return int(start)
            return int(change_of(m, first, end, 0, start, stop, guess) - 1)
    return NO_FALL if risen else NO_FALL_YET


@subroutine
def put_axis(
    m: Cells,
    place: int,
    rate: int,
    bend: int,
    flown: int,
    count: int,
    axis: Axis,
    power: int,
    first: int,
    end: int,
) -> None:
    """Writes D, U and H along an axis into three rows, and the rate of the first body's flight into a fourth;
    the count of elapsed ticks is in its row."""
    for row in (place, rate, bend, flown):
        clear(m, row, first, end)
    put(m, bend, axis.a, 2 * power - 1, -1)
    put(m, flown, axis.v, power, -1)
    add_product(m, flown, bend, first, end - 3, count, 0, 3)
    carry(m, flown, first, end, 1)
    put(m, place, axis.x, 0, -1)
    put(m, place, axis.x2, 0, 1)
    put(m, place, axis.period, 0, int(axis.turns))
    put(m, place, axis.corner, 0, -1)
    put(m, place, axis.corner_low, 0, -1)
    add_product(m, place, flown, first, end - 3, count, 0, 3)
    put(m, rate, axis.v2, power, 1)
    add_product(m, rate, bend, first, end - 3, count, 0, 3)
    for cell in range(first, end):
        m[rate + cell] += m[flown + cell]
    put(m, bend, axis.a2, 2 * power - 1, 1)
    for row in (place, rate, bend):
        carry(m, row, first, end, 1)


@subroutine
def add_axis(m: Cells, axis: Axis, power: int, first: int, end: int) -> None:
    """Adds the square of a separation along an axis to Q; the count of elapsed ticks is in its row."""
    put_axis(m, D_ROW, U_ROW, H_ROW, V_ROW, N_ROW, axis, power, first, end)
    for i in range(3):
        one = D_ROW + i * CELLS
        for j in range(i, 3):
            row = term(0, i + j)
            add_product(m, row, one, first, end, D_ROW + j * CELLS, first, end)
            carry(m, row, 2 * first, 2 * end, 1)
            if j == i:
                for cell in range(first, end):
                    m[one + cell] *= 2  # for its products with the others


@subroutine
def room_of_plans(
    plans: Plans, power: int, radius: float, radius2: float, first: int, end: int
) -> tuple[int, int]:
    """Returns the cells that two plans and radii need, in addition to the given ones; an end of 0 if they do
    not fit."""
    first, end = room(first, end, radius, 0)
    first, end = room(first, end, radius2, 0)
    for axis in (plans.x, plans.y):
        for value in (axis.x, axis.x2, axis.period, axis.corner, axis.corner_low):
            first, end = room(first, end, value, 0)
        for value in (axis.v, axis.v2):
            first, end = room(first, end, value, power)
        for value in (axis.a, axis.a2):
            first, end = room(first, end, value, 2 * power - 1)
    end += 3
    return (0, 0) if end > CELLS or first < 0 else (first, end)


@subroutine
def read_plans(m: Cells, plans: Plans, radius: float, radius2: float, sense: int) -> tuple[int, int]:
    """Writes the coefficients of Q, or of -Q if ``sense`` is -1, into their rows; returns the cells in use,
    from the first to before the end, or an end of 0 if they do not fit."""
    power = int(math.frexp(plans.per_tick)[1]) - 1
    first, end = room_of_plans(plans, power, radius, radius2, CELLS, 0)
    if end == 0:
        return first, end
    put(m, D_ROW, radius, 0, 1)
    put(m, D_ROW, radius2, 0, 1)
    carry(m, D_ROW, first, end, 1)
    add_product(m, term(0, 0), D_ROW, first, end, D_ROW, first, end)
    carry(m, term(0, 0), 2 * first, 2 * end, -1)
    put_count(m, N_ROW, plans.elapsed)
    add_axis(m, plans.x, power, first, end)
    add_axis(m, plans.y, power, first, end)
    first *= 2
    end *= 2
    for degree in range(5):
        carry(m, term(0, degree), first, end, sense)
    return first, end


@subroutine
def touch_exactly(plans: Plans, radius: float, radius2: float, sense: int, window: Window, guess: int) -> int:
    """Returns the same as ``first_fall`` for Q, or for -Q if ``sense`` is -1."""
    m = zeros(MEMORY)
    first, end = read_plans(m, plans, radius, radius2, sense)
    return first_fall(m, first, end, window, guess) if end > 0 else NO_FALL


@subroutine
def rises_or_presses(plans: Plans, radius: float, radius2: float, since: int) -> bool:
    """Returns True if Q rises in a tick, or presses: F1 > 0, or F2 < 0."""
    m = zeros(MEMORY)
    first, end = read_plans(m, plans, radius, radius2, 1)
    if end == 0:
        return False
    add_differences(m, first, end, 1)
    add_differences(m, first, end, 2)
    return sign_at(m, first, end, 1, since) > 0 or sign_at(m, first, end, 2, since) < 0


@subroutine
def read_gap(
    m: Cells, far: float, near: float, radius: float, slope: float, pull: float, per_tick: float
) -> tuple[int, int]:
    """Writes the coefficients of the gap of ``wall_exactly`` into their rows; returns the cells in use, or an
    end of 0 if they do not fit."""
    power = int(math.frexp(per_tick)[1]) - 1
    first, end = room(CELLS, 0, far, 0)
    first, end = room(first, end, near, 0)
    first, end = room(first, end, radius, 0)
    first, end = room(first, end, slope, power)
    first, end = room(first, end, pull, 2 * power - 1)
    end += 3
    if end > CELLS or first < 0:
        return 0, 0
    put(m, term(0, 0), far, 0, 1)
    put(m, term(0, 0), near, 0, -1)
    put(m, term(0, 0), radius, 0, -1)
    put(m, term(0, 1), slope, power, 1)
    put(m, term(0, 2), pull, 2 * power - 1, 1)
    for degree in range(3):
        carry(m, term(0, degree), first, end, 1)
    return first, end


@subroutine
def wall_exactly(
    far: float, near: float, radius: float, slope: float, pull: float, per_tick: float, guess: int
) -> int:
    """Returns the first count of ticks that satisfies rule 5 for the gap to a wall, or ``NEVER``."""
    m = zeros(MEMORY)
    first, end = read_gap(m, far, near, radius, slope, pull, per_tick)
    found = first_fall(m, first, end, Window(0, LIMIT, 3, True), guess) if end > 0 else NO_FALL
    return found if found >= 0 else NEVER


@subroutine
def gap_sign_exactly(gap: float, slope: float, pull: float, per_tick: float, count: int) -> int:
    """Returns the sign of a gap that widens like this, after a number of ticks; 1 if it does not fit."""
    m = zeros(MEMORY)
    first, end = read_gap(m, gap, 0.0, 0.0, slope, pull, per_tick)
    return sign_at(m, first, end, 0, count) if end > 0 else 1
