"""The hooks for several levels: bodies of different size are at home in different levels (docs/cells.md,
Bodies of many sizes). A body is near the bodies at home and the guests around it in its own level, and near
the bodies at home around it in each coarser level. So this relation is symmetric."""

import math

from kinetile.toolbox import NOBODY, Kernel, hook, larger, prefetch, unchecked
from kinetile_plugins.cells.layout import (
    State,
    cell_of,
    come_home,
    go_over,
    list_ahead,
    list_around,
    move_out,
    put_home,
    wrapped,
)
from kinetile_plugins.cells.uniform import fetch_around, watch


@hook
def _enter_as_guest(s: State, number: int, cell: int) -> None:
    guest = s.guests[number]
    guest.cell = cell
    guest.next = s.hosts[cell]
    guest.prev = NOBODY
    if guest.next >= 0:
        s.guests[guest.next].prev = number
    s.hosts[cell] = number


@hook
def _leave_as_guest(s: State, number: int) -> None:
    guest = s.guests[number]
    if guest.prev >= 0:
        s.guests[guest.prev].next = guest.next
    else:
        s.hosts[guest.cell] = guest.next
    if guest.next >= 0:
        s.guests[guest.next].prev = guest.prev


@hook
def _list_guests(k: Kernel, s: State, cell: int, count: int) -> int:
    """Writes the guests of a cell behind ``k.near[:count]``; returns the new count."""
    coarser = len(s.levels) - 1
    number = s.hosts[cell]
    while number >= 0:
        k.near[count] = number // coarser
        count += 1
        number = s.guests[number].next
    return count


@hook
def _invite(s: State, body: int) -> None:
    """Registers a body as a guest in all levels that are coarser than its own."""
    coarser = len(s.levels) - 1
    home = s.homes[body]
    level = int(home.level)
    for at in range(level + 1, coarser + 1):
        over = s.levels[at]
        part = s.levels[level].side / over.side
        cell = cell_of(over, math.floor(home.x * part), math.floor(home.y * part))
        _enter_as_guest(s, body * coarser + at - 1, cell)


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Puts every body into its cells from ``arrange``, and watches it."""
    for body in range(k.clock[0].bodies):
        put_home(s, body)
        _invite(s, body)
        watch(k, s, body)


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Names bodies at home and guests around a body in its level, and bodies at home in coarser levels."""
    home = s.homes[body]
    level = int(home.level)
    coarser = len(s.levels) - 1
    count = 0
    cell = home.cell
    for at in range(level, coarser + 1):
        if at > level:
            cell = s.guests[body * coarser + at - 1].cell
        count = list_around(k, s, at, cell, count)
    if level > 0:
        grid = s.levels[level]
        for up in range(-1, 2):
            for right in range(-1, 2):
                there = wrapped(grid, home.cell + right + up * grid.columns)
                count = _list_guests(k, s, there, count)
    return count


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """Moves a body over an edge of its cell, which may be an edge of coarser cells, too.

    The body crosses in all these levels; the bodies ahead of it in any of them are named as newcomers.
    """
    home = s.homes[body]
    level = int(home.level)
    grid = s.levels[level]
    coarser = len(s.levels) - 1
    right, up = go_over(s, body)
    watch(k, s, body)
    count = 0
    ahead = wrapped(grid, home.cell + right + up * grid.columns)
    aside = up + right * grid.columns
    if level > 0:
        for step in range(-1, 2):
            there = wrapped(grid, ahead + step * aside)
            count = _list_guests(k, s, there, count)
    edge = (home.x if right != 0 else home.y) + (1.0 if right + up < 0 else 0.0)
    cell = home.cell
    for at in range(level, coarser + 1):
        if at > level:
            over = s.levels[at]
            edges = edge * (grid.side / over.side)
            if edges != math.floor(edges):
                break
            number = body * coarser + at - 1
            cell = wrapped(over, s.guests[number].cell + right + up * over.columns)
            _leave_as_guest(s, number)
            _enter_as_guest(s, number, cell)
        count = list_ahead(k, s, at, cell, right, up, count)
    return count


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """Inserts a body: at home in the finest level that is wide enough, a guest in the coarser levels."""
    coarser = len(s.levels) - 1
    level = 0
    while level < coarser and s.levels[level].widest < k.bodies[body].radius:
        level += 1
    come_home(k, s, body, level)
    _invite(s, body)
    watch(k, s, body)


@unchecked
@hook
def soon(k: Kernel, s: State, body: int, stage: int) -> None:
    """Prefetches a body's home and its entries as a guest; then the cells around it in these levels; then the
    bodies in these cells, and the first guest in each cell of its own level."""
    coarser = len(s.levels) - 1
    home = s.homes[body]
    if stage == 0:
        prefetch(s.homes, body)
        prefetch(s.guests, body * coarser)
        return
    cell = home.cell
    for at in range(home.level, coarser + 1):
        if at > home.level:
            cell = s.guests[body * coarser + at - 1].cell
        fetch_around(k, s, at, cell, stage)
    columns = s.levels[home.level].columns
    for row in range(home.cell - columns, home.cell + columns + 1, columns):
        if row > 0 and row + 1 < len(s.hosts):
            if stage == 1:
                prefetch(s.hosts, row)
            else:
                for there in range(row - 1, row + 2):
                    guest = larger(s.hosts[there], 0)
                    prefetch(s.guests, guest)
                    prefetch(k.places, guest // coarser)


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """Removes a body from its home and from the lists of guests."""
    home = s.homes[body]
    coarser = len(s.levels) - 1
    move_out(s, body, home.cell)
    for at in range(home.level + 1, coarser + 1):
        _leave_as_guest(s, body * coarser + at - 1)
