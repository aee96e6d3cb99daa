"""Contacts and partings in whole numbers: the last resort, right for all finite doubles.

Every double is a whole number times a power of two, and so is all that is made of them by sums and
products. So q and B at a whole tick K, and the discriminant, are whole numbers in ``limbs``, and their
signs are exact. The floor of the first root is the greatest K with q(K) >= 0 and B(K) < 0: once that has
ceased to hold it does not hold again, so bisection finds it, from wherever it starts. The floor of the last
root is likewise the greatest K with q(K) <= 0 or B(K) < 0. Some microseconds, more where the guess is bad.
"""

from __future__ import annotations

import math

import numpy as np

from kinetile.kernel.certificates.limbs import (
    CELLS,
    Cells,
    add_product,
    carry,
    clear,
    copy,
    put,
    put_count,
    room,
)
from kinetile.kernel.compiled import hook, smaller, subroutine
from kinetile.kernel.tables import NEVER

__all__ = ["as_count", "first_touch_of_integers", "last_touch_of_integers"]

FAR = 1 << 62

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
    return int(ticks) if ticks < 2.0**62 else FAR


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
def signs_at(m: Cells, first: int, end: int, count: int) -> tuple[int, int]:
    """Return the signs of B and of q so many ticks after the later anchor."""
    put_count(m, COUNT, count)
    copy(m, X, DX, first, end)
    copy(m, Y, DY, first, end)
    add_product(m, X, UX, first, end - 3, COUNT, 0, 3)
    add_product(m, Y, UY, first, end - 3, COUNT, 0, 3)
    carry(m, X, first, end, 1)
    carry(m, Y, first, end, 1)
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


@subroutine
def last_before(m: Cells, first: int, end: int, guess: int, parting: bool) -> int:
    """Return the greatest count of ticks, 0 to 2^62, at which a contact, or a parting, has not been passed;
    at 0 it has not.

    Goes away from the guess by strides that double, then halves what is left.
    """
    low = 0
    high = FAR + 1
    stride = 1
    while high - low > 1:
        if not (low < guess and guess < high):
            guess = low + ((high - low) >> 1)
        bend, gap = signs_at(m, first, end, guess)
        if (bend < 0 or gap <= 0) if parting else (bend < 0 and gap >= 0):
            low = guess
            guess += stride
        else:
            high = guess
            guess -= stride
        stride = smaller(2 * stride, FAR >> 1)
    return low


@subroutine
def read_in(
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
    radius: float,
    radius2: float,
    tick: float,
) -> tuple[int, int]:
    """Make numbers of two paths; return the cells that are in use, from the first to before the end, which is
    beyond ``CELLS`` where one of them is no finite number."""
    power = int(math.frexp(tick)[1]) - 1
    first = CELLS
    end = 0
    for value in (x, y, x2, y2, radius, radius2):
        first, end = room(first, end, value, 0)
    for value in (vx, vy, vx2, vy2):
        first, end = room(first, end, value, power)
    if end > CELLS:
        return first, end
    put_count(m, COUNT, elapsed)
    put(m, UX, vx, power, -1)
    put(m, UY, vy, power, -1)
    add_product(m, DX, UX, first, end - 3, COUNT, 0, 3)
    add_product(m, DY, UY, first, end - 3, COUNT, 0, 3)
    put(m, UX, vx2, power, 1)
    put(m, UY, vy2, power, 1)
    put(m, DX, x, 0, -1)
    put(m, DX, x2, 0, 1)
    put(m, DY, y, 0, -1)
    put(m, DY, y2, 0, 1)
    put(m, REACH, radius, 0, 1)
    put(m, REACH, radius2, 0, 1)
    for row in range(DX, COUNT, CELLS):
        carry(m, row, first, end, 1)
    return first, end


@subroutine
def first_touch_of_integers(
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
    guess: int,
) -> int:
    """Return what ``first_touch`` does, for finite numbers of any size; for others ``NEVER``."""
    m = np.zeros(MEMORY, dtype=np.int64)
    first, end = read_in(m, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick)
    if end > CELLS:
        return NEVER
    bend, gap = signs_at(m, first, end, 0)
    if bend >= 0:
        return NEVER
    if gap <= 0:
        return 0
    if sign_of_inside(m, first, end) <= 0:
        return NEVER
    found = last_before(m, first, end, guess, False)
    return found if found < FAR else NEVER


@subroutine
def last_touch_of_integers(
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
    guess: int,
) -> int:
    """Return what ``last_touch`` does, for finite numbers of any size; for others 0."""
    m = np.zeros(MEMORY, dtype=np.int64)
    first, end = read_in(m, x, y, vx, vy, elapsed, x2, y2, vx2, vy2, radius, radius2, tick)
    if end > CELLS:
        return 0
    bend, gap = signs_at(m, first, end, 0)
    if gap > 0 and (bend >= 0 or sign_of_inside(m, first, end) <= 0):
        return 0
    if vx == vx2 and vy == vy2:
        return NEVER
    found = last_before(m, first, end, guess, True)
    return found if found < FAR else NEVER
