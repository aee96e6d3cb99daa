"""Whole numbers of any size, as rows of digits: the arithmetic of the certificates' last resort.

A whole number is a row of digits in base 2^26: the digit in cell i counts 2^(26 (i - z)), z being the row's
zero: cell ``ZERO`` for lengths and for speeds times a tick, cell 0 for counts of ticks; in a product zeros
add up. All rows are in one array, ``m``, each identified by its first cell.

*Digits.* After ``carry`` a digit is from -2^25 to 2^25 - 1. All below a digit is at most 2^25 (1 + 2^26 + ...
) < 1 unit of it, so the highest that is not zero has the number's sign. A cell gets one product for each pair
of cells i + j: at most 160 for two rows of lengths (two such products are added before a carry), and 320 for
two rows of products: 320 of 2^50 each, and 4,096 fit. Counts are not carried, digits below 2^26, and three
cells long; a speed that is not carried either has digits below 2^26: three products below 2^52, and the
digits of two doubles.

*Cells.* A double is a whole number of 53 bits times 2^p, p from -1126 (the least subnormal, brought to 53
bits) to 971; a tick takes up to 1,100 off. So ``cell``, ZERO + floor(p / 26), is from **ZERO = 96** - 86 = 10
up to 96 + 37 = 133. From there a double needs 3 cells (53 bits and a shift of up to 25: 78). Times a count
(62 bits), and six of them summed, it is below 2^(78 + 65), that is 6 cells with a sign: ``room`` gives 8.
Three fewer are enough for a speed, and a number multiplied by a count stays inside. Products of two have
twice the room, products of four four times, 16 and 32 cells for less than 12 and 24. The highest end is 141,
or 144 with accelerations, of **CELLS = 160**. The periods of an image are such a length times a whole number
below 2^32, less than a count: its digits are added before carrying, each below 2^58.
"""

import math
from typing import Any, TypeAlias

from kinetile.kernel.compiled import hook, larger, smaller, subroutine

Cells: TypeAlias = Any
"""An array of 64-bit integers."""

LARGEST_DOUBLE = 2.0**1023 * (2.0 - 2.0**-52)

LIMB = 26
HALF = 1 << (LIMB - 1)
MASK = (1 << LIMB) - 1

ZERO = 96
CELLS = 160


@subroutine
def room(first: int, end: int, value: float, power: int) -> tuple[int, int]:
    """Returns the cells, from the first to before the end, that also hold a double times 2^``power``, with
    room for sums, a product with a count of ticks, and carries; an end beyond ``CELLS`` for a number that is
    not finite."""
    if value == 0.0:
        return first, end
    if not abs(value) <= LARGEST_DOUBLE:
        return first, CELLS + 1
    cell = ZERO + (int(math.frexp(value)[1]) - 53 + power) // LIMB
    return smaller(first, cell), larger(end, cell + 8)


@subroutine
def clear(m: Cells, row: int, first: int, end: int) -> None:
    """Makes a number 0."""
    for i in range(row + first, row + end):
        m[i] = 0


@subroutine
def copy(m: Cells, target: int, source: int, first: int, end: int) -> None:
    """Copies a number to another row."""
    for i in range(first, end):
        m[target + i] = m[source + i]


@subroutine
def put_count(m: Cells, row: int, count: int) -> None:
    """Makes a number a count of ticks, 0 to 2^62."""
    m[row] = count & MASK
    m[row + 1] = (count >> LIMB) & MASK
    m[row + 2] = count >> (2 * LIMB)


@subroutine
def put(m: Cells, row: int, value: float, power: int, times: int) -> None:
    """Adds ``times`` times a double times 2^``power`` to a number; ``times`` is whole, below 2^32 in size."""
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
    """Adds to a number the product of two, whose cells first to end and start to stop are in use."""
    for i in range(first, end):
        digit = m[one + i]
        if digit != 0:
            for j in range(start, stop):
                m[target + i + j] += digit * m[two + j]


@subroutine
def carry(m: Cells, row: int, first: int, end: int, by: int) -> int:
    """Multiplies a number by 1 or -1 and makes its digits small; returns its sign: 1, 0 or -1."""
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


@subroutine
def two_products(m: Cells, row: int, a: int, b: int, way: int, c: int, d: int, first: int, end: int) -> int:
    """Writes a b + c d into a row, or a b - c d if ``way`` is -1 and not 1; returns its sign."""
    clear(m, row, 2 * first, 2 * end)
    add_product(m, row, c, first, end, d, first, end)
    carry(m, row, 2 * first, 2 * end, way)
    add_product(m, row, a, first, end, b, first, end)
    return carry(m, row, 2 * first, 2 * end, 1)


LIMIT = 1 << 62
"""Ticks after the later anchor that limit predictions: ``structural.FAR`` as a whole number."""


@hook
def as_count(ticks: float) -> int:
    """Returns a number of ticks as a whole number from 0 to 2^62, also if it lies outside."""
    if not ticks > 0.0:
        return 0
    return int(ticks) if ticks < 2.0**62 else LIMIT


@hook
def narrowed(low: int, high: int, guess: int, stride: int, before: bool) -> tuple[int, int, int, int]:
    """Returns the bounds, the guess and the stride of a search for a last count, after a guess that is before
    its end or not.

    Moves away from the guess by strides that double, then halves the remaining range.
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
    """Returns a guess between two bounds, or the middle."""
    return guess if low < guess and guess < high else low + ((high - low) >> 1)
