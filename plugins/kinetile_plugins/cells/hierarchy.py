"""The hooks where bodies of different size are at home in different levels of cells.

The cells of a level are a power of two times as wide as those of the level below, and made of them. A body is
at home in one level, and a *guest* in the cells around its own of every coarser level. Two bodies are near
each other if the smaller one, at home or as a guest, stands in the cell of the larger or in one of the eight
around it. So a body looks for those at home and the guests around it in its own level, and for those at home
around it in each coarser one; either side finds the other.
"""

from __future__ import annotations

import math

from kinetile.toolbox import Kernel, hook
from kinetile_plugins.cells.layout import (
    State,
    come_home,
    folded,
    list_ahead,
    list_around,
    move_in,
    move_out,
    wrapped,
)
from kinetile_plugins.cells.uniform import watch


@hook
def _enter_as_guest(s: State, number: int, body: int, cell: int) -> None:
    """Put a guest into a cell. O(1)."""
    guest = s.guests[number]
    guest.next = s.hosts[cell]
    guest.prev = -2 - cell
    if guest.next >= 0:
        s.guests[guest.next].prev = number
    s.hosts[cell] = number


@hook
def _leave_as_guest(s: State, number: int) -> None:
    """Take a guest out of its cell. O(1)."""
    guest = s.guests[number]
    if guest.prev >= 0:
        s.guests[guest.prev].next = guest.next
    else:
        s.hosts[-2 - guest.prev] = guest.next
    if guest.next >= 0:
        s.guests[guest.next].prev = guest.prev


@hook
def _list_guests(k: Kernel, s: State, cell: int, count: int) -> int:
    """Write the guests of a cell behind ``k.near[:count]``; return the new count."""
    coarser = len(s.levels) - 1
    number = s.hosts[cell]
    while number >= 0:
        k.near[count] = number // coarser
        count += 1
        number = s.guests[number].next
    return count


@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies at home and the guests around a body in its level, and those at home around it in each
    coarser one."""
    home = s.homes[body]
    level = int(home.level)
    coarser = len(s.levels) - 1
    count = 0
    column = int(home.column)
    row = int(home.row)
    for at in range(level, coarser + 1):
        if at > level:
            guest = s.guests[body * coarser + at - 1]
            column = int(guest.column)
            row = int(guest.row)
        count = list_around(k, s, at, column, row, count)
    if level > 0:
        grid = s.levels[level]
        for up in range(-1, 2):
            base = grid.first + wrapped(home.row + up, grid.rows) * grid.columns
            for right in range(-1, 2):
                cell = base + wrapped(home.column + right, grid.columns)
                count = _list_guests(k, s, cell, count)
    return count


@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A body reaches an edge of its cell, which may be one of coarser cells, too.

    It goes over in all these levels, and whoever it has come near to in one of them is a newcomer.
    """
    home = s.homes[body]
    level = int(home.level)
    grid = s.levels[level]
    coarser = len(s.levels) - 1
    step = 2 * (home.way & 1) - 1
    right = step * (1 - (home.way >> 1))
    up = step * (home.way >> 1)
    move_out(s, body, level, home.column, home.row)
    home.x += right
    home.y += up
    home.column = wrapped(home.column + right, grid.columns)
    home.row = wrapped(home.row + up, grid.rows)
    move_in(s, body, level, home.column, home.row)
    watch(k, s, body)
    count = 0
    if level > 0:
        for step in range(-1, 2):
            there = wrapped(home.row + up + step * right, grid.rows) * grid.columns
            cell = grid.first + there + wrapped(home.column + right + step * up, grid.columns)
            count = _list_guests(k, s, cell, count)
    edge = (home.x if right != 0 else home.y) + (1.0 if right + up < 0 else 0.0)
    column = int(home.column)
    row = int(home.row)
    for at in range(level, coarser + 1):
        if at > level:
            over = s.levels[at]
            edges = edge * (grid.side / over.side)
            if edges != math.floor(edges):
                break
            number = body * coarser + at - 1
            guest = s.guests[number]
            _leave_as_guest(s, number)
            column = wrapped(guest.column + right, over.columns)
            row = wrapped(guest.row + up, over.rows)
            guest.column = column
            guest.row = row
            _enter_as_guest(s, number, body, over.first + row * over.columns + column)
        count = list_ahead(k, s, at, column, row, right, up, count)
    return count


@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """A body comes: it is at home in the finest level that has been prepared for bodies as wide, and a guest
    in the coarser ones."""
    coarser = len(s.levels) - 1
    level = 0
    while level < coarser and s.levels[level].widest < k.bodies[body].radius:
        level += 1
    come_home(k, s, body, level)
    home = s.homes[body]
    for at in range(level + 1, coarser + 1):
        over = s.levels[at]
        part = s.levels[level].side / over.side
        guest = s.guests[body * coarser + at - 1]
        guest.column = int(folded(math.floor(home.x * part), over.columns))
        guest.row = int(folded(math.floor(home.y * part), over.rows))
        cell = over.first + guest.row * over.columns + guest.column
        _enter_as_guest(s, body * coarser + at - 1, body, cell)
    watch(k, s, body)


@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """A body goes, from its home and from where it is a guest."""
    home = s.homes[body]
    coarser = len(s.levels) - 1
    move_out(s, body, home.level, home.column, home.row)
    for at in range(home.level + 1, coarser + 1):
        _leave_as_guest(s, body * coarser + at - 1)
