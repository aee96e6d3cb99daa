"""Whole numbers of any size in fixed memory, for signs that doubles cannot tell.

A number is a row of digits in base 2^26: the digit in cell i counts 2^(26 (i - z)), z being the row's zero.
Digits are signed, and after ``carry`` at most 2^25 in size, so all that stands below a digit is less than
one unit of it, and the sign of a number is that of its highest digit that is not zero. A product of two
such digits is at most 2^50: a cell holds 4,096 of them, more than any sum here has.

All rows are in one array, ``m``, each known by where it begins. A double is three digits. Rows of lengths,
and of speeds times a tick, have their zero in cell ``ZERO``; in a product zeros add up. Counts of ticks
have theirs in cell 0. The lowest bit of a double is worth 2^-1126 or more, brought to 53 bits, and 2^971 at
most, and a tick is 2^-1100 to 2^-52: so a row of lengths takes ``CELLS`` cells, and none is before the
first or behind the last.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from kinetile.kernel.compiled import larger, smaller, subroutine

__all__ = ["CELLS", "ZERO", "Cells", "add_product", "carry", "clear", "copy", "put", "put_count", "room"]

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
def put(m: Cells, row: int, value: float, power: int, sign: int) -> None:
    """Add ``sign`` times a double times 2^``power`` to a number; ``sign`` is 1 or -1."""
    part, exponent = math.frexp(value)
    whole = int(abs(part) * 2.0**53)
    if part < 0.0:
        sign = -sign
    place = int(exponent) - 53 + power
    cell = place // LIMB
    shift = place - cell * LIMB
    low = (whole & MASK) << shift
    middle = (low >> LIMB) + (((whole >> LIMB) & MASK) << shift)
    high = (middle >> LIMB) + ((whole >> (2 * LIMB)) << shift)
    cell += row + ZERO
    m[cell] += sign * (low & MASK)
    m[cell + 1] += sign * (middle & MASK)
    m[cell + 2] += sign * high


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
