"""The table of cells: who is where, and what the hooks do with it.

The plane is cut into square cells, and the cells are laid on a torus of ``columns`` x ``rows`` places: column
c of the plane is column c mod ``columns`` of the table. With an arena the table has a column and a row more
than the arena, so that no two cells of the arena share a place and its opposite edges are no neighbours.
Without one the plane is wound up on the torus, and cells a whole turn apart share a place. That brings pairs
that are far apart, which costs time and nothing else: who is near whom is read off the table alone, the same
from both sides.

A place has a block of eight integers: the numbers of seven bodies, and how many of them count, so that one
vector copies it (``append``). Whoever finds the block full stands in the list of the cell instead, which is
threaded through the bodies: any number of bodies fits into a cell, and nothing has to be allocated. The
eighth integer also says whether there is a list, so that one look at those of the cells that were copied
tells whether there is any.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kinetile.kernel.vectors import append
from kinetile.toolbox import NOBODY, Kernel, Records, hook

__all__ = [
    "BLOCK",
    "FULL",
    "GUEST",
    "HOME",
    "LEVEL",
    "LISTED",
    "State",
    "come_home",
    "folded",
    "list_ahead",
    "list_around",
    "move_in",
    "move_out",
    "wrapped",
]

BLOCK = 8
FULL = BLOCK - 1
"""Bodies in a block, and the place of their count; of its bits, those that count them."""

LISTED = 8
"""The bit of the count that says that the cell has a list."""

HOME = np.dtype(
    [
        ("x", "f8"),  # the body's cell in the plane: a whole number
        ("y", "f8"),
        ("column", "i4"),  # and in the table
        ("row", "i4"),
        ("next", "i4"),  # the next body in the list of a cell that is full
        ("way", "i2"),  # the edge of its cell that it reaches next: 0 left, 1 right, 2 lower, 3 upper
        ("level", "i2"),  # of which level its cell is
    ]
)
LEVEL = np.dtype(
    [
        ("side", "f8"),  # of a cell, a length
        ("slack", "f8"),  # how far a body may be outside its cell, a length
        ("widest", "f8"),  # the greatest radius of a body at home in it, now or later
        ("columns", "i8"),
        ("rows", "i8"),
        ("first", "i8"),  # the number of its first cell
    ]
)
GUEST = np.dtype([("column", "i4"), ("row", "i4"), ("next", "i4"), ("prev", "i4")])
"""Where a body stands in a coarser level, and its neighbours in the list of the cell's guests; before the
first: -2 - cell."""


class State(NamedTuple):
    """The cells of all levels, and the homes of the bodies."""

    blocks: Records  # (8 cells,) seven bodies and how many of them there are
    lists: Records  # (cells,) the first of those who found the block full, or NOBODY
    homes: Records  # (n,)
    levels: Records  # (levels,) from the finest to the coarsest
    guests: Records  # (n (levels - 1),) for each body one for each level above the finest
    hosts: Records  # (cells,) the first guest of a cell, or NOBODY; empty where there is one level


@hook
def wrapped(place: int, size: int) -> int:
    """Return a column or a row, at most one beyond the edge of the table, wound up."""
    if place < 0:
        return place + size
    return place - size if place >= size else place


@hook
def move_in(s: State, body: int, level: int, column: int, row: int) -> None:
    """Put a body into a cell. O(1)."""
    cell = s.levels[level].first + row * s.levels[level].columns + column
    at = cell * BLOCK
    count = s.blocks[at + FULL]
    if count < FULL:
        s.blocks[at + count] = body
        s.blocks[at + FULL] = count + 1
    else:
        s.homes[body].next = s.lists[cell]
        s.lists[cell] = body
        s.blocks[at + FULL] = FULL | LISTED


@hook
def folded(cell: float, size: int) -> float:
    """Return the column or row of the table in which a column or row of the plane is."""
    return cell - math.floor(cell / size) * size


@hook
def come_home(k: Kernel, s: State, body: int, level: int) -> None:
    """Put a body that comes into the cell of a level in which it stands, by its rounded coordinates: a cell
    is history, and its begins here."""
    plan = k.bodies[body]
    home = s.homes[body]
    grid = s.levels[level]
    home.x = math.floor(plan.x / grid.side)
    home.y = math.floor(plan.y / grid.side)
    home.column = int(folded(home.x, grid.columns))
    home.row = int(folded(home.y, grid.rows))
    home.level = level
    home.next = NOBODY
    move_in(s, body, level, home.column, home.row)


@hook
def move_out(s: State, body: int, level: int, column: int, row: int) -> None:
    """Take a body out of a cell; the first of the cell's list takes its place in the block."""
    cell = s.levels[level].first + row * s.levels[level].columns + column
    at = cell * BLOCK
    last = at + (s.blocks[at + FULL] & FULL) - 1
    place = at
    while place <= last and s.blocks[place] != body:
        place += 1
    listed = s.lists[cell]
    if listed < 0:
        s.blocks[place] = s.blocks[last]
        s.blocks[at + FULL] = last - at
        return
    if place <= last:
        s.blocks[place] = listed
        s.lists[cell] = s.homes[listed].next
    elif listed == body:
        s.lists[cell] = s.homes[body].next
    else:
        while s.homes[listed].next != body:
            listed = s.homes[listed].next
        s.homes[listed].next = s.homes[body].next
    if s.lists[cell] < 0:
        s.blocks[at + FULL] = FULL


@hook
def _append_list(k: Kernel, s: State, cell: int, count: int) -> int:
    """Write the bodies in the list of a cell behind ``k.near[:count]``; return the new count."""
    body = s.lists[cell]
    while body >= 0:
        k.near[count] = body
        count += 1
        body = s.homes[body].next
    return count


@hook
def _append_three(k: Kernel, s: State, one: int, two: int, three: int, count: int) -> int:
    """Write the bodies of three cells behind ``k.near[:count]``; return the new count."""
    first = append(s.blocks, one * BLOCK, k.near, count)
    count += first & FULL
    second = append(s.blocks, two * BLOCK, k.near, count)
    count += second & FULL
    third = append(s.blocks, three * BLOCK, k.near, count)
    count += third & FULL
    if (first | second | third) & LISTED != 0:
        count = _append_list(k, s, one, count)
        count = _append_list(k, s, two, count)
        count = _append_list(k, s, three, count)
    return count


@hook
def list_around(k: Kernel, s: State, level: int, column: int, row: int, count: int) -> int:
    """Write the bodies at home in a cell and in the eight around it behind ``k.near[:count]``; return the new
    count."""
    grid = s.levels[level]
    left = wrapped(column - 1, grid.columns)
    right = wrapped(column + 1, grid.columns)
    for step in range(-1, 2):
        base = grid.first + wrapped(row + step, grid.rows) * grid.columns
        count = _append_three(k, s, base + left, base + column, base + right, count)
    return count


@hook
def list_ahead(
    k: Kernel, s: State, level: int, column: int, row: int, right: int, up: int, count: int
) -> int:
    """Write the bodies at home in the three cells on one side of a cell behind ``k.near[:count]``; return the
    new count. The side is (right, up): (-1, 0), (1, 0), (0, -1) or (0, 1)."""
    grid = s.levels[level]
    middle = wrapped(row + up, grid.rows) * grid.columns + wrapped(column + right, grid.columns)
    low = wrapped(row + up - right, grid.rows) * grid.columns + wrapped(column + right - up, grid.columns)
    high = wrapped(row + up + right, grid.rows) * grid.columns + wrapped(column + right + up, grid.columns)
    return _append_three(k, s, grid.first + low, grid.first + middle, grid.first + high, count)
