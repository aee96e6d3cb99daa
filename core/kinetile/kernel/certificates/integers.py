"""Contacts and partings in whole numbers: the last resort, right for all finite doubles.

Every double is a whole number times a power of two, and so is all that is made of them by sums and
products. So q and B at a whole tick K, and the discriminant, are whole numbers, and their signs are exact.
The floor of the first root is the greatest K with q(K) >= 0 and B(K) < 0: once that has ceased to hold it
does not hold again, so bisection finds it, from wherever it starts. The floor of the last root is likewise
the greatest K with q(K) <= 0 or B(K) < 0. Some microseconds, more where the guess is bad.

A whole number is a row of digits in base 2^26: the digit in cell i counts 2^(26 (i - z)), z being the row's
zero. Digits are signed, and after ``carry`` at most 2^25 in size, so all that is below a digit is less
than one unit of it, and the sign of a number is that of its highest digit that is not zero. A product of two
such digits is at most 2^50: a cell holds 4,096 of them, more than any sum here has.

All rows are in one array, ``m``, each known by where it begins. A double is three digits. Rows of lengths,
and of speeds times a tick, have their zero in cell ``ZERO``; in a product zeros add up. Counts of ticks
have theirs in cell 0. The lowest bit of a double is worth 2^-1126 or more, brought to 53 bits, and 2^971 at
most, and a tick is 2^-1100 to 2^-52: so a row of lengths takes ``CELLS`` cells, and none is before the
first or behind the last.

Why it is right
===============

B, q and the discriminant R^2 |U|^2 - (D x U)^2 at a whole K are whole numbers times a power of two, so their
signs are exact. B >= 0 at the anchor: never; q <= 0: 0; a discriminant <= 0: never. Otherwise "q(K) >= 0 and
B(K) < 0" is true from 0 to the floor of the first root, then q < 0 up to the second root, and then B > 0. It
does not become true again, so bisection finds the last K with it, whatever the guess.

*Digits.* After ``carry`` a digit is from -2^25 to 2^25 - 1. All below a digit is at most 2^25 (1 + 2^26 + ...
) < 1 unit of it, so the highest that is not zero has the number's sign. A cell gets one product for each pair
of cells i + j: at most 160 for two rows of lengths, of which two products are added before a carry, and 320
for two rows of products: 320 of 2^50 each, and 4,096 fit. Counts are not carried, digits below 2^26, and
three cells long; a speed that is not carried either has digits below 2^26: three products below 2^52, and
what two doubles add.

*Cells.* A double is a whole number of 53 bits times 2^p, p from -1126 (the least subnormal, brought to 53
bits) to 971; a tick takes up to 1,100 off. So ``cell``, ZERO + floor(p / 26), is from **ZERO = 96** - 86 = 10
up to 96 + 37 = 133. From there a double needs 3 cells (53 bits and a shift of up to 25: 78). Times a count
(62 bits), and six of them summed, it is below 2^(78 + 65), that is 6 cells with a sign: ``room`` gives 8.
Three fewer are enough for a speed, and what a count multiplies stays inside. Products of two have twice, of
four four times the room, 16 and 32 cells for less than 12 and 24. The highest end is 141, of **CELLS = 160**.
The periods of an image are such a length times a whole number below 2^32, less than a count: its digits are
added before carrying, each below 2^58.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from kinetile.kernel.certificates.plans import Axis, Plans
from kinetile.kernel.compiled import hook, larger, smaller, subroutine, zeros
from kinetile.kernel.tables import NEVER

Cells: TypeAlias = Any
"""An array of 64-bit integers."""

LARGEST = 2.0**1023 * (2.0 - 2.0**-52)

LIMB = 26
HALF = 1 << (LIMB - 1)
MASK = (1 << LIMB) - 1

ZERO = 96
CELLS = 160


@subroutine
def room(first: int, end: int, value: float, power: int) -> tuple[int, int]:
    """Return the cells, from the first to before the end, that take a double times 2^``power`` as well,
    with room for sums, a product with a count of ticks, and carries; an end beyond ``CELLS`` for what is no
    finite number."""
    if value == 0.0:
        return first, end
    if not abs(value) <= LARGEST:
        return first, CELLS + 1
    cell = ZERO + (int(math.frexp(value)[1]) - 53 + power) // LIMB
    return smaller(first, cell), larger(end, cell + 8)


@subroutine
def clear(m: Cells, row: int, first: int, end: int) -> None:
    """Make a number 0."""
    for i in range(row + first, row + end):
        m[i] = 0


@subroutine
def copy(m: Cells, target: int, source: int, first: int, end: int) -> None:
    """Make a number what another is."""
    for i in range(first, end):
        m[target + i] = m[source + i]


@subroutine
def put_count(m: Cells, row: int, count: int) -> None:
    """Make a number a count of ticks, 0 to 2^62."""
    m[row] = count & MASK
    m[row + 1] = (count >> LIMB) & MASK
    m[row + 2] = count >> (2 * LIMB)


@subroutine
def put(m: Cells, row: int, value: float, power: int, times: int) -> None:
    """Add ``times`` times a double times 2^``power`` to a number; ``times`` is whole, below 2^32 in size."""
    part, exponent = math.frexp(value)
    whole = int(abs(part) * 2.0**53)
    if part < 0.0:
        times = -times
    place = int(exponent) - 53 + power
    cell = place // LIMB
    shift = place - cell * LIMB
    low = (whole & MASK) << shift
    middle = (low >> LIMB) + (((whole >> LIMB) & MASK) << shift)
    high = (middle >> LIMB) + ((whole >> (2 * LIMB)) << shift)
    cell += row + ZERO
    m[cell] += times * (low & MASK)
    m[cell + 1] += times * (middle & MASK)
    m[cell + 2] += times * high


@subroutine
def add_product(
    m: Cells, target: int, one: int, first: int, end: int, two: int, start: int, stop: int
) -> None:
    """Add to a number the product of two, of which cells first to end and start to stop are in use."""
    for i in range(first, end):
        digit = m[one + i]
        if digit != 0:
            for j in range(start, stop):
                m[target + i + j] += digit * m[two + j]


@subroutine
def carry(m: Cells, row: int, first: int, end: int, by: int) -> int:
    """Multiply a number by 1 or -1 and make its digits small; return its sign: 1, 0 or -1."""
    over = 0
    sign = 0
    for i in range(row + first, row + end):
        digit = by * m[i] + over
        over = (digit + HALF) >> LIMB
        digit -= over << LIMB
        m[i] = digit
        if digit != 0:
            sign = 1 if digit > 0 else -1
    return sign


LIMIT = 1 << 62
"""Ticks after the later anchor from which on nothing is predicted: ``structural.FAR`` as a whole number."""

DX, DY, UX, UY, X, Y, REACH, COUNT = range(0, 8 * CELLS, CELLS)
"""Rows of lengths: the separation at the later anchor, what a tick adds to it, the separation at a tick,
R."""

SUM, CROSS, SPEED2, REACH2 = range(8 * CELLS, 16 * CELLS, 2 * CELLS)
"""Rows of products of two."""

FOURS = 16 * CELLS
"""The row of products of four."""

MEMORY = 20 * CELLS


@hook
def as_count(ticks: float) -> int:
    """Return a number of ticks as a whole one from 0 to 2^62, wherever it lies."""
    if not ticks > 0.0:
        return 0
    return int(ticks) if ticks < 2.0**62 else LIMIT


@subroutine
def sign_of_inside(m: Cells, first: int, end: int) -> int:
    """Return the sign of R^2 |v|^2 - (d x v)^2."""
    add_product(m, CROSS, DY, first, end, UX, first, end)
    carry(m, CROSS, 2 * first, 2 * end, -1)
    add_product(m, CROSS, DX, first, end, UY, first, end)
    carry(m, CROSS, 2 * first, 2 * end, 1)
    add_product(m, SPEED2, UX, first, end, UX, first, end)
    add_product(m, SPEED2, UY, first, end, UY, first, end)
    carry(m, SPEED2, 2 * first, 2 * end, 1)
    add_product(m, REACH2, REACH, first, end, REACH, first, end)
    carry(m, REACH2, 2 * first, 2 * end, 1)
    add_product(m, FOURS, CROSS, 2 * first, 2 * end, CROSS, 2 * first, 2 * end)
    carry(m, FOURS, 4 * first, 4 * end, -1)
    add_product(m, FOURS, SPEED2, 2 * first, 2 * end, REACH2, 2 * first, 2 * end)
    return carry(m, FOURS, 4 * first, 4 * end, 1)


@subroutine
def place_at(m: Cells, first: int, end: int, count: int) -> None:
    """Put the separation at a count of ticks after the later anchor in the rows ``X`` and ``Y``."""
    put_count(m, COUNT, count)
    copy(m, X, DX, first, end)
    copy(m, Y, DY, first, end)
    add_product(m, X, UX, first, end - 3, COUNT, 0, 3)
    add_product(m, Y, UY, first, end - 3, COUNT, 0, 3)
    carry(m, X, first, end, 1)
    carry(m, Y, first, end, 1)


@subroutine
def signs_at(m: Cells, first: int, end: int, count: int) -> tuple[int, int]:
    """Return the signs of B and of q at a count of ticks after the later anchor."""
    place_at(m, first, end, count)
    clear(m, SUM, 2 * first, 2 * end)
    add_product(m, SUM, X, first, end, UX, first, end)
    add_product(m, SUM, Y, first, end, UY, first, end)
    bend = carry(m, SUM, 2 * first, 2 * end, 1)
    clear(m, SUM, 2 * first, 2 * end)
    add_product(m, SUM, REACH, first, end, REACH, first, end)
    carry(m, SUM, 2 * first, 2 * end, -1)
    add_product(m, SUM, X, first, end, X, first, end)
    add_product(m, SUM, Y, first, end, Y, first, end)
    return bend, carry(m, SUM, 2 * first, 2 * end, 1)


@hook
def narrowed(low: int, high: int, guess: int, stride: int, before: bool) -> tuple[int, int, int, int]:
    """Return the bounds, the guess and the stride of a search for a last count, after a guess that is before
    its end or not.

    Goes away from the guess by strides that double, then halves what is left.
    """
    if before:
        low = guess
        guess += stride
    else:
        high = guess
        guess -= stride
    return low, high, between(low, high, guess), smaller(2 * stride, LIMIT >> 1)


@hook
def between(low: int, high: int, guess: int) -> int:
    """Return a guess between two bounds, or the middle."""
    return guess if low < guess and guess < high else low + ((high - low) >> 1)


@subroutine
def last_before(m: Cells, first: int, end: int, guess: int, parting: bool) -> int:
    """Return the greatest count of ticks, 0 to 2^62, at which a contact, or a parting, has not been passed;
    at 0 it has not."""
    low = 0
    high = LIMIT + 1
    stride = 1
    guess = between(low, high, guess)
    while high - low > 1:
        bend, gap = signs_at(m, first, end, guess)
        before = (bend < 0 or gap <= 0) if parting else (bend < 0 and gap >= 0)
        low, high, guess, stride = narrowed(low, high, guess, stride, before)
    return low


@subroutine
def put_axis(m: Cells, d: int, u: int, axis: Axis, power: int, first: int, end: int) -> None:
    """Put the separation along an axis, and what a tick adds to it, into two rows; the count of elapsed ticks
    is in its own."""
    put(m, u, axis.v, power, -1)
    add_product(m, d, u, first, end - 3, COUNT, 0, 3)
    put(m, u, axis.v2, power, 1)
    put(m, d, axis.x, 0, -1)
    put(m, d, axis.x2, 0, 1)
    put(m, d, axis.period, 0, int(axis.turns))


@subroutine
def read_in(
    m: Cells, plans: Plans, radius: float, radius2: float, first: int = CELLS, end: int = 0
) -> tuple[int, int]:
    """Make numbers of two paths; return the cells that are in use, from the first to before the end, those
    given among them; the end is beyond ``CELLS`` where one of the numbers is not finite."""
    power = int(math.frexp(plans.tick)[1]) - 1
    first, end = room(first, end, radius, 0)
    first, end = room(first, end, radius2, 0)
    for axis in (plans.x, plans.y):
        for value in (axis.x, axis.x2, axis.period):
            first, end = room(first, end, value, 0)
        for value in (axis.v, axis.v2):
            first, end = room(first, end, value, power)
    if end > CELLS:
        return first, end
    put_count(m, COUNT, plans.elapsed)
    put_axis(m, DX, UX, plans.x, power, first, end)
    put_axis(m, DY, UY, plans.y, power, first, end)
    put(m, REACH, radius, 0, 1)
    put(m, REACH, radius2, 0, 1)
    for row in range(DX, COUNT, CELLS):
        carry(m, row, first, end, 1)
    return first, end


@subroutine
def touch_of_integers(plans: Plans, radius: float, radius2: float, guess: int, parting: bool) -> int:
    """Return what ``first_touch`` does, or ``last_touch`` for a parting, for finite numbers of any size; for
    others ``NEVER``, or 0."""
    m = zeros(MEMORY)
    first, end = read_in(m, plans, radius, radius2)
    if end > CELLS:
        return 0 if parting else NEVER
    bend, gap = signs_at(m, first, end, 0)
    if parting:
        if gap > 0 and (bend >= 0 or sign_of_inside(m, first, end) <= 0):
            return 0
        if plans.x.v == plans.x.v2 and plans.y.v == plans.y.v2:
            return NEVER
    elif bend >= 0:
        return NEVER
    elif gap <= 0:
        return 0
    elif sign_of_inside(m, first, end) <= 0:
        return NEVER
    found = last_before(m, first, end, guess, parting)
    return found if found < LIMIT else NEVER
