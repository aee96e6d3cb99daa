"""The table of cells: their widths, the bodies in each, and how the hooks read and change it.

The plane is divided into square cells, mapped to a torus of ``columns`` x ``rows`` places: column
c of the plane is column c mod ``columns`` of the table. With an arena the table has one more column and row
than the arena, so that no two cells of the arena share a place and its opposite edges are not adjacent.
Without one the plane wraps around the torus, and cells a whole turn apart share a place. That makes pairs
that are far apart, which only costs time: nearness depends on the table alone, and is the same
from both sides.

A place has a block of eight integers: the numbers of seven bodies, and how many of them count, so that one
vector copies it (``append``). A body that finds the block full goes into the list of the cell, which is
threaded through the bodies: any number of bodies fits into a cell, and nothing has to be allocated. The
eighth integer also marks whether there is a list, so that one test of those of the copied cells
finds whether there is any.

The narrower the cells, the fewer bodies are near each other, and the more often one moves to another
cell. A cell cannot be narrower than the widest body at home in it (docs/cells.md has the exact bound and its
proof). For bodies that are far apart it is best to have two or three in a cell: ``SPACING`` times the side at
which there is one. That is measured, and the optimum is flat. A cell is wider than it must be by twice its
``slack``: a body may be outside its cell by that and stay at home, so a body that oscillates over an
edge does not cross each time.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from kinetile.kernel.vectors import append
from kinetile.scene import Scene
from kinetile.toolbox import NOBODY, Kernel, Records, hook, positions_now

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
    lists: Records  # (cells,) the first of the bodies that found the block full, or NOBODY
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


SPACING = 1.25, 1.65
"""The side of cells that no body forces to be wider, where 1 is one body a cell: in crowds; for points."""

CROWD = 16.0
"""More smaller bodies than this in a cell of a level, on average, get a finer level."""

ROOM = 1.0 + 2.0**-10
"""What cells have over the widest body, relative, before the skin is known."""

ABOVE = 1.0 + 2.0**-50
"""By what cells become wider than they must be, where they do: more than a quotient and a product round."""

MOST = 8
"""Cells of a level for each body; where there would be more, the table is wound up."""


def least_side(radius: Any, skin: float) -> Any:
    """Returns the least side of cells in which a body of a radius may be at home; arrays will do."""
    return 2.0 * (radius + 2.0 * skin)


def _widths(scene: Scene) -> Any:
    """Returns how wide the cells of a body have to be, with some room for the skin."""
    return least_side(scene.radius, 0.0) * ROOM


def narrowest(scene: Scene) -> float:
    """Returns the least side of cells that suits any body of a scene."""
    return float(_widths(scene).min())


def _extent(scene: Scene) -> tuple[float, float]:
    """Returns width and height of where bodies are: of the arena, or of the middle half of them, twice."""
    if scene.arena is not None:
        return scene.arena
    lower, upper = np.quantile(scene.position, [0.25, 0.75], axis=0)
    width, height = (2.0 * (upper - lower)).tolist()
    return width, height


def _spaced(extent: tuple[float, float], bodies: int, widest: float) -> float:
    """Returns the side of cells that are as many as ``SPACING`` says, in a thin arena too."""
    width, height = extent
    square = math.sqrt(width / bodies) * math.sqrt(height)
    one = max(square, width / bodies, height / bodies)
    crowded, sparse = SPACING
    return max(crowded * one, sparse * one - 0.5 * widest)


def sides_for(scene: Scene, side: float | None) -> list[float]:
    """Returns the sides of the levels' cells, from the finest to the coarsest, each a power of two times the
    first; a scene without bodies has one level.

    With a ``side`` it is that of the finest level, and a body that is wider is at home in the first level
    that is not narrower than it is. Otherwise the coarsest level is as wide as the widest body, or as
    ``SPACING`` says, and while smaller bodies crowd in its cells they get a level of their own.
    """
    if not len(scene):
        return [side or 1.0]
    widths = np.sort(_widths(scene))
    if side is not None:
        steps = np.ceil(np.log2(np.maximum(widths / side, 1.0)))
        return [math.ldexp(side, int(step)) for step in np.unique(np.append(steps, 0.0))]
    extent = _extent(scene)
    sides = [max(float(widths[-1]), _spaced(extent, len(widths), float(widths[-1])))]
    while True:
        finest = sides[0]
        smaller = int(np.searchsorted(widths, 0.5 * finest, side="right"))
        cells = max(extent[0] / finest, 1.0) * max(extent[1] / finest, 1.0)
        if smaller <= CROWD * cells:
            return sides
        width = float(widths[smaller - 1])
        wanted = max(width, _spaced(extent, smaller, width))
        if wanted > 0.5 * finest:
            return sides
        sides.insert(0, math.ldexp(finest, -math.floor(math.log2(finest / wanted))))


def _size(scene: Scene, side: float) -> tuple[int, int]:
    """Returns columns and rows of the table of a level: three at least, so that nine cells are nine.

    Where the plane is wound up both are odd, so that bodies on a lattice hardly ever fall on each other.
    """
    most = MOST * len(scene) + 9
    if scene.arena is not None:
        columns, rows = (max(math.floor(length / side) + 2, 3) for length in scene.arena)
        if columns * rows <= most:
            return columns, rows
    columns = math.isqrt(3 * len(scene) // 2) | 3
    return columns, columns + 2


def empty(scene: Scene, sides: list[float]) -> State:
    """Returns the state for a scene and the sides of its levels; ``arrange`` fills it."""
    n, coarser = scene.capacity, len(sides) - 1
    levels = np.zeros(len(sides), LEVEL).view(np.recarray)
    cells = 0
    for level, side in zip(levels, sides, strict=True):
        columns, rows = _size(scene, side)
        level.side, level.columns, level.rows, level.first = side, columns, rows, cells
        cells += columns * rows
    homes = _aligned(HOME, n)
    home_level = np.minimum(np.searchsorted(sides, _widths(scene)), coarser)
    homes.level[: len(scene)] = home_level
    np.maximum.at(levels.widest, home_level, scene.radius)
    return State(
        blocks=_aligned(np.dtype(np.int32), cells * BLOCK),
        lists=_aligned(np.dtype(np.int32), cells),
        homes=homes,
        levels=levels,
        guests=_aligned(GUEST, n * coarser),
        hosts=np.zeros(cells if coarser else 0, np.int32),
    )


def _aligned(dtype: np.dtype[Any], length: int) -> Records:
    """Returns zeroed memory that begins on a cache line, which no block or record then straddles."""
    raw = np.zeros(length * dtype.itemsize + 64, np.uint8)
    at = -raw.ctypes.data % 64
    found = raw[at : at + length * dtype.itemsize].view(dtype)
    return found.view(np.recarray) if dtype.names else found


def arrange(k: Kernel, s: State) -> None:
    """Puts every body into its present cells; the cells become wider if the skin needs it.

    The present bodies do not determine the width: a wider one may be inserted later.
    """
    homes, levels = s.homes[: len(k.bodies)], s.levels
    level = homes.level
    least = least_side(levels.widest, k.clock[0].limits.skin)
    levels.side *= max(float((least / levels.side).max()) * ABOVE, 1.0)
    levels.slack = 0.5 * (levels.side - least)
    homes.x, homes.y = np.floor(positions_now(k) / levels.side[level][:, None]).T
    homes.next = NOBODY
    s.blocks[:] = 0
    s.lists[:] = NOBODY
    s.hosts[:] = NOBODY
    homes.column, homes.row = np.mod(homes.x, levels.columns[level]), np.mod(homes.y, levels.rows[level])
    body, before, rank = _queued(cells_of(s, np.arange(len(homes))))
    inside, cell = rank < FULL, cells_of(s, body)
    s.blocks[cell[inside] * BLOCK + rank[inside]] = body[inside]
    np.maximum.at(s.blocks, cell * BLOCK + FULL, np.minimum(rank + 1, FULL))
    homes.next[body[rank > FULL]] = before[rank > FULL]
    s.lists[cell[~inside]] = body[~inside]  # of several in a cell, the last
    s.blocks[cell[~inside] * BLOCK + FULL] |= LISTED
    for at in range(1, len(levels)):
        _invite(s, at, homes)


def cells_of(s: State, body: Any, right: int = 0, up: int = 0) -> Any:
    """Returns the numbers of the cells in which bodies are at home, or of cells to the right and above."""
    home = s.homes[body]
    grid = s.levels[home.level]
    return grid.first + (home.row + up) % grid.rows * grid.columns + (home.column + right) % grid.columns


def _invite(s: State, at: int, homes: Records) -> None:
    """Makes guests in a level of all bodies that have homes in finer ones."""
    guest, grid = s.guests, s.levels[at]
    (smaller,) = np.nonzero(homes.level < at)
    number = smaller * (len(s.levels) - 1) + at - 1
    home = homes[smaller]
    part = s.levels.side[home.level] / grid.side
    guest.column[number] = np.mod(np.floor(home.x * part), grid.columns)
    guest.row[number] = np.mod(np.floor(home.y * part), grid.rows)
    cell = grid.first + guest.row[number].astype(np.int64) * grid.columns + guest.column[number]
    which, _, rank = _queued(cell)
    number, cell = number[which], cell[which]
    first = rank == 0
    guest.next[number] = np.where(first, NOBODY, number[np.maximum(np.arange(len(number)) - 1, 0)])
    last = np.append(first[1:], True)
    guest.prev[number] = np.where(last, -2 - cell, np.append(number[1:], 0))
    s.hosts[cell] = number  # of several in a cell, the last


def _queued(cell: Any) -> tuple[Any, Any, Any]:
    """Returns the bodies in cells, sorted by cell, the one before each, and their number in its cell."""
    order = np.argsort(cell, kind="stable")
    sorted_cells, where = cell[order], np.arange(len(order))
    begins = np.append(True, sorted_cells[1:] != sorted_cells[:-1])[: len(order)]
    rank = where - np.maximum.accumulate(np.where(begins, where, 0))
    return order, np.roll(order, 1), rank
