"""A grid in which a body is in all cells that its bounding box touches; those that share a cell are near.

So a large body is in many cells and a small one in few, and a cell need not be as wide as the largest. How
many rows and columns of cells a body is in never changes: as many as its box needs wherever it stands, and
one more. A body has as many *entries* as it has cells, side by side in one array; the entry for a cell is
the one of its column and row modulo that number. When the box comes to the border of its cells, they move
on by one column: the entries of the column that is left behind are those that the column ahead asks for. No
hook ever has to allocate. The column that is left behind was more than the box needs, by up to a cell; so a
body that turns round at a border has some way to go before it crosses one again.

Cells lie on a table that is wound up like a torus, with as many columns and rows as powers of two. No body
is in so many that it meets itself, and each knows the true numbers of its cells, so bodies that meet on the
table alone are not near. A body is named in one cell only of those that two share, the first in x and y.

Why no pair is missed: a body leaves its cells when its box, which has the reach in it, comes to their
border, early or late by one rounding. Bodies that share no cell have a border between their boxes on one
axis, so their boxes overlap by at most two roundings, and the two skins in the reaches are wider than that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import kinetile as kt
import numpy as np
from kinetile.errors import BadOption
from kinetile.toolbox import (
    Box,
    BroadPhaseParts,
    Item,
    Kernel,
    Records,
    falls,
    hook,
    positions_now,
    schedule,
    unchecked,
)

__all__ = ["Boxes"]

_ENTRIES = 16  # a body, on average: at four a small body's, much room for large ones
_COLUMN, _ROW, _ACROSS, _FIRST, _AXIS = range(5)


class State(NamedTuple):
    """For n bodies, e entries and m places of the table; a list is a ring with e + its place at both ends."""

    box: Records  # (n, 5) first column and row, how many of each, first entry, axis of the next crossing
    body: Records  # (e,) whose an entry is
    after: Records  # (e + m,) the next in the ring
    before: Records  # (e + m,) the one before
    side: Records  # (2,) of a cell: what was asked for, and what it is
    table: Records  # (2,) columns and rows, powers of two; the place of a cell is in its remainders


def arrange(k: Kernel, s: State) -> None:
    """Choose the side, and say in which cells each body is; every list is empty."""
    place, reach = positions_now(k), k.bodies.reach
    n, e = len(s.box), len(s.body)
    extent = np.ptp(place, axis=0) if n else np.zeros(2)
    wanted = s.side[0] or 0.8 * math.sqrt(extent[0] * extent[1] / max(n, 1))
    side = max(wanted, 1.5 * reach.min(initial=math.inf)) if n else 1.0
    places = len(s.after) - e
    widest = 1 << (places.bit_length() - 1) // 2  # so many columns and rows there is always room for
    while (_across(reach, side) ** 2).sum() > e or _across(reach, side).max(initial=0) > widest:
        side *= 1.25
    across = _across(reach, side)
    s.side[1] = side
    s.table[:] = _table(extent / side, across.max(initial=1), places)
    s.box[:, :2] = np.floor(place / side - across[:, None] / 2 + 0.5)
    s.box[:, _ACROSS] = across
    s.box[:, _FIRST] = np.cumsum(across**2) - across**2
    used = int((across**2).sum())
    s.body[:used] = np.repeat(np.arange(n), across**2)
    s.after[:] = s.before[:] = np.arange(len(s.after))


def _across(reach: Records, side: float) -> Records:
    """Return how many cells a box needs wherever it stands, and one more."""
    return (np.floor(2.0 * reach / side) + 2.0).astype(np.int64)


def _table(cells: Records, widest: int, places: int) -> tuple[int, int]:
    """Return columns and rows for so many cells each way, if there are places, and the widest body."""
    columns, rows = (1 << math.ceil(math.log2(max(min(float(c), 2.0**40), widest) + 2)) for c in cells)
    while columns * rows > places:
        if columns > rows:
            columns //= 2
        else:
            rows //= 2
    return columns, rows


@hook
def head(s: State, column: int, row: int) -> int:
    """Return where the ring of a cell begins and ends."""
    return int(len(s.body) + (row & (s.table[1] - 1)) * s.table[0] + (column & (s.table[0] - 1)))


@hook
def enter(s: State, entry: int, end: int) -> None:
    """Take an entry out of the ring it is in and put it into another."""
    s.before[s.after[entry]] = s.before[entry]
    s.after[s.before[entry]] = s.after[entry]
    s.after[entry] = s.after[end]
    s.before[entry] = end
    s.before[s.after[end]] = entry
    s.after[end] = entry


@unchecked
@hook
def watch(k: Kernel, s: State, body: int) -> None:
    """Schedule the first of two crossings: the box comes to the border of its cells ahead, in x or in y."""
    b = k.bodies[body]
    side = s.side[1]
    across = s.box[body, _ACROSS]
    left = s.box[body, _COLUMN] * side
    right = (s.box[body, _COLUMN] + across) * side
    low = s.box[body, _ROW] * side
    high = (s.box[body, _ROW] + across) * side
    gap_x = b.x - b.reach - left if b.vx < 0.0 else right - (b.x + b.reach)
    gap_y = b.y - b.reach - low if b.vy < 0.0 else high - (b.y + b.reach)
    in_x = falls(k, b.anchor, gap_x, -abs(b.vx))
    in_y = falls(k, b.anchor, gap_y, -abs(b.vy))
    s.box[body, _AXIS] = 1 if in_y < in_x else 0
    schedule(k, body, in_y if in_y < in_x else in_x)


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Put each body into its cells."""
    for body in range(len(s.box)):
        across = s.box[body, _ACROSS]
        for i in range(across):
            column = s.box[body, _COLUMN] + i
            for j in range(across):
                row = s.box[body, _ROW] + j
                entry = s.box[body, _FIRST] + column % across * across + row % across
                enter(s, entry, head(s, column, row))
        watch(k, s, body)


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies that share a cell with a body, each once."""
    count = 0
    left, low, across = s.box[body, _COLUMN], s.box[body, _ROW], s.box[body, _ACROSS]
    for column in range(left, left + across):
        for row in range(low, low + across):
            end = head(s, column, row)
            entry = s.after[end]
            while entry != end:
                other = s.body[entry]
                x, y, wide = s.box[other, _COLUMN], s.box[other, _ROW], s.box[other, _ACROSS]
                # In this cell of the plane, and in none before it that both are in.
                if (x == column or (column == left and x < column < x + wide)) and (
                    y == row or (row == low and y < row < y + wide)
                ):
                    k.near[count] = other
                    count += 1
                entry = s.after[entry]
    return count


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """A body's cells move on by one column or row, and it meets those whose cells begin there."""
    axis = s.box[body, _AXIS]
    speed = k.bodies[body].vy if axis else k.bodies[body].vx
    across = s.box[body, _ACROSS]
    step = -1 if speed < 0.0 else 1
    ahead = s.box[body, axis] + (-1 if speed < 0.0 else across)
    start = s.box[body, 1 - axis]
    count = 0
    for along in range(start, start + across):
        column = along if axis else ahead
        row = ahead if axis else along
        end = head(s, column, row)
        entry = s.after[end]
        while entry != end:
            other = s.body[entry]
            wide = s.box[other, _ACROSS]
            first = s.box[other, axis]
            side = s.box[other, 1 - axis]
            if (first if step > 0 else first + wide - 1) == ahead and (
                side == along or (along == start and side < along < side + wide)
            ):
                k.near[count] = other
                count += 1
            entry = s.after[entry]
        enter(s, s.box[body, _FIRST] + column % across * across + row % across, end)
    s.box[body, axis] += step
    watch(k, s, body)
    return count


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yield a sentence for each body outside its cells, and for each entry that is not where it belongs."""
    place, reach = positions_now(k), k.bodies.reach[:, None]
    rounding = reach - k.bodies.radius[:, None]
    low = s.box[:, :2] * s.side[1]
    high = (s.box[:, :2] + s.box[:, _ACROSS, None]) * s.side[1]
    for body, axis in np.argwhere((place - reach < low - rounding) | (place + reach > high + rounding)):
        where = f"{s.box[body, _ACROSS]} columns and rows from {s.box[body, :2].tolist()}"
        yield f"body {body} at {place[body].tolist()} is outside its cells ({where}) in {'xy'[axis]}"
    e = len(s.body)
    for body, (left, start, across, first, _) in enumerate(s.box.tolist()):
        for column in range(left, left + across):
            for row in range(start, start + across):
                entry = first + column % across * across + row % across
                end = e + row % int(s.table[1]) * int(s.table[0]) + column % int(s.table[0])
                if not _stands(s, entry, end):
                    yield f"body {body} does not stand in the list of cell ({column}, {row}), in which it is"


def _stands(s: State, entry: int, end: int) -> bool:
    """Say whether an entry stands in a ring, and its neighbours know."""
    if s.before[s.after[entry]] != entry or s.after[s.before[entry]] != entry:
        return False
    at = s.after[end]
    while at not in (entry, end):
        at = s.after[at]
    return bool(at == entry)


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draw for each body the cells that it is in, as one, with the tick at which they move on."""
    side = float(s.side[1])
    for body, (left, low, across, _, _) in enumerate(s.box.tolist()):
        corners = (left * side, low * side), ((left + across) * side, (low + across) * side)
        yield Box("cell", *corners, int(k.queue.own[body]), f"{across} x {across}")


class Boxes:
    """A grid for mixed sizes.

    Args:
        side: of a cell, at least; by default there are somewhat fewer bodies than cells. Where large bodies
            would be in more cells than there is room for, 16 a body on average, cells are wider.
    """

    def __init__(self, *, side: float = 0.0) -> None:
        if not 0.0 <= side < math.inf:
            raise BadOption(f"side must be a finite number, 0 or greater, not {side!r}")
        self.side = side

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        """Return the parts; any scene will do."""
        n = len(scene)
        entries = _ENTRIES * n
        rings = np.zeros(entries + max(4, 4 << n.bit_length()), dtype=np.int64)
        state = State(
            box=np.zeros((n, 5), dtype=np.int64),
            body=np.zeros(entries, dtype=np.int64),
            after=rings,
            before=rings.copy(),
            side=np.array([self.side, 0.0]),
            table=np.zeros(2, dtype=np.int64),
        )
        # A new plan leaves a body where it is: it only meets another border, or the same at another time.
        return BroadPhaseParts(
            near, state, build, repair, replan=watch, arrange=arrange, audit=audit, draw=draw
        )
