"""The table of cells: their widths, the bodies in each, and the hooks that read and change it.

docs/cells.md describes the stored tables and the width of cells. Rows of the table follow each other: cell
(x, y) of the plane is place x + ``columns`` y, modulo the number of places. The end of a row adjoins the
beginning of the next one, and the last place adjoins the first: a helix, wrapped to a torus. So the eight
cells around a cell are at fixed distances from it, everywhere, and only places near the two ends of the table
need wrapping. With an arena the table has one more column and row than the arena, so no two cells of the
arena share a place, and opposite edges of the arena are not adjacent.

A place has a block of eight integers: the numbers of seven bodies, and the count of the valid ones. So one
vector operation copies a block (``append``). If the block is full, a body is put into the list of the cell,
which is linked through the bodies. Each level counts its cells that have a list: none in most scenes, and
then no list is read. The width of a body is twice its largest reach. A cell is wider than necessary by twice
its ``slack``.

Why the table loses no pair
===========================

Let N be the number of places of a level, and C its columns. N is a multiple of C, and both N / C and C are at
least 3. Let p(x, y) = (x + C y) mod N.

- *Steps.* p(x + a, y + b) = (p(x, y) + a + C b) mod N, for all whole numbers. So the distance on the table of
  cells that are adjacent on the plane is a + C b, with a and b in {-1, 0, 1}. Each crossing changes the place
  of a body by such a step, so the body stays at p of its cell. Adjacency is mutual, since each distance
  occurs with both signs: a is near b if b is near a. ``near`` reads the table alone.
- *Nine places.* The nine distances lie from -C - 1 to C + 1, and are different integers, since C >= 3. Two of
  them differ by at most 2 C + 2, less than 3 C <= N, so also modulo N: no body is named twice.
- *The two ends.* For a place n with C < n < N - C - 1 all nine places lie from 0 to N - 1 without wrapping,
  and are three runs of three blocks. For the other places (the first row, the last row, and one place beside
  each) every sum is more than -N and less than 2 N, since C + 1 < N: adding or subtracting N once wraps it.
- *An arena.* It has at most C - 1 columns and N / C - 1 rows of cells, numbered from 0. The place before
  (0, y) and the place behind (C - 2, y) are in column C - 1, which has no cell of the arena. The places below
  row 0 and above row N / C - 2 are in the last row, or wrapped to it. So an empty place is between the end of
  a row and the next row, and each named pair is adjacent on the plane. Without the walls' narrow phase bodies
  leave the arena; then the other items hold.
- *Large numbers.* p is computed from x and y as doubles when a body is inserted or the structure is built,
  and must not be rounded. A side is at least 2 (r + 2 delta), more than 256 (n + 4) u X. So |x| and |y| are
  less than 2^45 / (n + 4) + 1, for n bodies. A level has at most 8 n + 15 places, and C is at most a third of
  them: C |y| and the sum x + C y are less than 2^47, exact. The quotient by N is off by at most 2^-6 / N,
  while a quotient that is not whole is at least 1 / N from the next whole number: its floor is right.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from kinetile.scene import Scene
from kinetile.toolbox import NOBODY, Kernel, Records, hook, positions_now, record_table
from kinetile.toolbox.lanes import append

BLOCK = 8
FULL = BLOCK - 1
"""Bodies in a block, and the place of their count."""

PERIODIC = False
"""True if homes are unwrapped, in cells of a torus (``torus.py``)."""

HOME = np.dtype(
    [
        ("x", "f8"),  # the body's cell in the plane: a whole number
        ("y", "f8"),
        ("cell", "i8"),  # and its number, a place of the table
        ("next", "i4"),  # the next body in the list of a full cell
        ("way", "i2"),  # the edge of its cell that it reaches next: 0 left, 1 right, 2 lower, 3 upper
        ("level", "i2"),  # the level of its cell
    ]
)
LEVEL = np.dtype(
    [
        ("side", "f8"),  # of a cell, a length
        ("slack", "f8"),  # the distance that a body may be outside its cell
        ("widest", "f8"),  # the farthest reach to a side of a body at home in it, now or later
        ("columns", "i8"),  # of its part of the table
        ("cells", "i8"),  # in all its rows
        ("height", "f8"),  # of a cell: not its side if an axis is periodic (``torus.py``)
        ("rows", "i8"),
        ("first", "i8"),  # the number of its first cell
    ]
)
GUEST = np.dtype([("cell", "i8"), ("next", "i4"), ("prev", "i4")])
"""A body's cell of a coarser level, and its neighbours in that cell's list, or NOBODY."""


class State(NamedTuple):
    """The cells of all levels, and the homes of the bodies."""

    blocks: Records  # (8 cells,) seven bodies and their number
    lists: Records  # (cells,) the first body of the list for a full block, or NOBODY
    listed: Records  # (levels,) the number of cells with such a list
    homes: Records  # (n,)
    levels: Records  # (levels,) from the finest to the coarsest
    guests: Records  # (n (levels - 1),) one for each body and each level above the finest
    hosts: Records  # (cells,) the first guest of a cell, or NOBODY; empty with one level


@hook
def wrapped(grid: Records, cell: int) -> int:
    """Returns the wrapped number of a level's cell, less than a turn beyond either end of its places."""
    if cell < grid.first:
        return int(cell + grid.cells)
    return int(cell - grid.cells if cell >= grid.first + grid.cells else cell)


@hook
def cell_of(grid: Records, x: float, y: float) -> int:
    """Returns the number of a level's cell (x, y) of the plane; the sum is exact (see above)."""
    place = x + y * grid.columns
    return int(grid.first + (place - math.floor(place / grid.cells) * grid.cells))


@hook
def move_in(s: State, body: int, cell: int) -> None:
    """Puts a body into a cell. O(1)."""
    at = cell * BLOCK
    count = s.blocks[at + FULL]
    if count < FULL:
        s.blocks[at + count] = body
        s.blocks[at + FULL] = count + 1
    else:
        home = s.homes[body]
        if s.lists[cell] < 0:
            s.listed[home.level] += 1
        home.next = s.lists[cell]
        s.lists[cell] = body


@hook
def move_out(s: State, body: int, cell: int) -> None:
    """Removes a body from a cell; the first body of the cell's list replaces it in the block."""
    at = cell * BLOCK
    last = at + s.blocks[at + FULL] - 1
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
        s.listed[s.homes[body].level] -= 1


@hook
def append_list(k: Kernel, s: State, cell: int, count: int) -> int:
    """Writes the bodies in the list of a cell behind ``k.near[:count]``; returns the new count."""
    body = s.lists[cell]
    while body >= 0:
        k.near[count] = body
        count += 1
        body = s.homes[body].next
    return count


@hook
def append_block(k: Kernel, s: State, cell: int, count: int) -> int:
    """Writes the bodies in a cell's block behind ``k.near[:count]``; returns the new count."""
    return count + append(s.blocks, cell * BLOCK, k.near, count)


@hook
def append_row(k: Kernel, s: State, left: int, count: int) -> int:
    """Writes the bodies in the blocks of three cells in a row, likewise."""
    block = left * BLOCK
    count += append(s.blocks, block, k.near, count)
    count += append(s.blocks, block + BLOCK, k.near, count)
    return count + append(s.blocks, block + 2 * BLOCK, k.near, count)


@hook
def wrapped_index(at: int, cells: int) -> int:
    """Returns the wrapped number of a column or row, less than a round off either end."""
    if at < 0:
        return int(at + cells)
    return int(at - cells if at >= cells else at)


@hook
def cell_on_torus(grid: Records, x: float, y: float) -> int:
    """Returns the number of the cell in an unwrapped column and row, if an axis is periodic."""
    column = x - math.floor(x / grid.columns) * grid.columns
    row = y - math.floor(y / grid.rows) * grid.rows
    return int(int(column) + int(row) * grid.columns)


@hook
def beside_on_torus(grid: Records, cell: int, right: int, up: int) -> int:
    """Returns the number of a cell up to one to the right and up to one above, if an axis is periodic."""
    row = cell // grid.columns
    column = wrapped_index(cell - row * grid.columns + right, grid.columns)
    return int(column + wrapped_index(row + up, grid.rows) * grid.columns)


@hook
def beside(grid: Records, cell: int, right: int, up: int) -> int:
    """Returns the number of a cell up to one to the right and up to one above."""
    if PERIODIC:
        return beside_on_torus(grid, cell, right, up)
    return wrapped(grid, cell + right + up * grid.columns)


@hook
def list_around(k: Kernel, s: State, level: int, cell: int, count: int) -> int:
    """Writes the bodies at home in a cell and in the eight around it behind ``k.near[:count]``; returns the
    new count. On a torus, the only column or row has no neighbours."""
    grid = s.levels[level]
    columns = grid.columns
    left = down = -1
    inner = cell > grid.first + columns and cell < grid.first + grid.cells - columns - 1
    if PERIODIC:
        left = 0 if columns == 1 else -1
        down = 0 if grid.rows == 1 else -1
        row = cell // columns
        column = cell - row * columns
        inner = column > 0 and column < columns - 1 and row > 0 and row < grid.rows - 1
    if inner:
        count = append_row(k, s, cell - columns - 1, count)
        count = append_row(k, s, cell - 1, count)
        count = append_row(k, s, cell + columns - 1, count)
    else:  # near an end of the table: some cells are at the other end
        for up in range(down, 1 - down):
            for right in range(left, 1 - left):
                count = append_block(k, s, beside(grid, cell, right, up), count)
    if s.listed[level] > 0:
        for up in range(down, 1 - down):
            for right in range(left, 1 - left):
                count = append_list(k, s, beside(grid, cell, right, up), count)
    return count


@hook
def list_ahead(k: Kernel, s: State, level: int, cell: int, right: int, up: int, count: int) -> int:
    """Writes the bodies at home in the three cells on one side of a cell behind ``k.near[:count]``;
    returns the new count. The side is (right, up): (-1, 0), (1, 0), (0, -1) or (0, 1)."""
    grid = s.levels[level]
    middle = beside(grid, cell, right, up)
    low = beside(grid, middle, -up, -right)
    high = beside(grid, middle, up, right)
    alone = PERIODIC and (grid.rows if right != 0 else grid.columns) == 1
    count = append_block(k, s, middle, count)
    if not alone:
        count = append_block(k, s, low, count)
        count = append_block(k, s, high, count)
    if s.listed[level] > 0:
        count = append_list(k, s, middle, count)
        if not alone:
            count = append_list(k, s, low, count)
            count = append_list(k, s, high, count)
    return count


@hook
def put_home(s: State, body: int) -> None:
    """Puts a body into the cell of its column and row."""
    home = s.homes[body]
    grid = s.levels[home.level]
    home.cell = cell_on_torus(grid, home.x, home.y) if PERIODIC else cell_of(grid, home.x, home.y)
    home.next = NOBODY
    move_in(s, body, home.cell)


@hook
def come_home(k: Kernel, s: State, body: int, level: int) -> None:
    """Inserts a body into its cell of a level, by rounded coordinates; later only crossings change it."""
    plan = k.bodies[body]
    home = s.homes[body]
    grid = s.levels[level]
    home.x = math.floor(plan.x / grid.side)
    home.y = math.floor(plan.y / (grid.height if PERIODIC else grid.side))
    if PERIODIC:
        home.x += float(k.images[body].kx * grid.columns)
        home.y += float(k.images[body].ky * grid.rows)
    home.level = level
    put_home(s, body)


@hook
def go_over(s: State, body: int) -> tuple[int, int]:
    """Moves a body over the edge that it has reached; returns the side for ``list_ahead``."""
    home = s.homes[body]
    step = 2 * (home.way & 1) - 1
    right = step * (1 - (home.way >> 1))
    up = step * (home.way >> 1)
    move_out(s, body, home.cell)
    home.x += right
    home.y += up
    home.cell = beside(s.levels[home.level], home.cell, right, up)
    move_in(s, body, home.cell)
    return right, up


SPACING = 1.25, 1.65
"""The side of cells that no body forces to be wider, in units of one body a cell: in crowds; for points."""

CROWD = 16.0
"""If a cell of a level has more smaller bodies than this, on average, they get a finer level."""

ROOM = 1.0 + 2.0**-10
"""The side of cells over the width of the widest body, before the skin is known."""

ABOVE = 1.0 + 2.0**-50
"""The factor from the least side to the side: it covers the roundings of a quotient and a product."""

MOST = 8
"""The most cells of a level for each body; with more, the table is wrapped."""


def least_side(reach: Any, skin: float) -> Any:
    """Returns the least side of cells for a body of this farthest reach, without its skin, or for arrays."""
    return 2.0 * (reach + 2.0 * skin)


def _farthest(scene: Scene) -> Any:
    if not scene.shapes:
        return scene.radius
    return np.array([max(each.reaches) for each in scene.shapes])[scene.shape]


def _widths(scene: Scene) -> Any:
    """Returns the least widths of the bodies' cells, with some room for the skin."""
    return least_side(_farthest(scene), 0.0) * ROOM


def narrowest(scene: Scene) -> float:
    """Returns the least side of cells that suits any body of a scene."""
    return float(_widths(scene).min())


def _extent(scene: Scene) -> tuple[float, float]:
    """Returns width and height of the arena, or of the region of the middle half of bodies, doubled."""
    if scene.arena is not None:
        return scene.arena
    lower, upper = np.quantile(scene.position, [0.25, 0.75], axis=0)
    width, height = (2.0 * (upper - lower)).tolist()
    return width, height


def _spaced(extent: tuple[float, float], bodies: int, widest: float) -> float:
    """Returns the side of cells by ``SPACING``, in a thin arena too."""
    width, height = extent
    square = math.sqrt(width / bodies) * math.sqrt(height)
    one = max(square, width / bodies, height / bodies)
    crowded, sparse = SPACING
    return max(crowded * one, sparse * one - 0.5 * widest)


def sides_for(scene: Scene, side: float | None) -> list[float]:
    """Returns the sides of the levels' cells, from the finest to the coarsest, each a power of two times the
    first; a scene without bodies has one level.

    A given ``side`` is the side of the finest level, and each wider body is at home in the first level whose
    cells are not narrower than the body. Otherwise the coarsest level has the width of the widest body, or
    the width by ``SPACING``; while smaller bodies crowd in its cells, they get a separate level.
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


def table_size(scene: Scene, side: float) -> tuple[int, int]:
    """Returns columns and rows of the table of a level: at least three, so nine cells are different.

    If the plane is wrapped, both are odd, so bodies on a lattice seldom share a place.
    """
    most = MOST * len(scene) + 9
    if scene.arena is not None:
        columns, rows = (max(math.floor(length / side) + 2, 3) for length in scene.arena)
        if columns * rows <= most:
            return columns, rows
    columns = math.isqrt(3 * len(scene) // 2) | 3
    return columns, columns + 2


def empty(scene: Scene, sides: list[float], size: Callable[..., tuple[int, int]] = table_size) -> State:
    """Returns the state for a scene and the sides of its levels; ``arrange`` fills it."""
    n, coarser = scene.capacity, len(sides) - 1
    levels = np.zeros(len(sides), LEVEL).view(np.recarray)
    cells = 0
    for level, side in zip(levels, sides, strict=True):
        columns, rows = size(scene, side)
        level.height, level.rows = side, rows
        level.side, level.columns, level.cells, level.first = side, columns, columns * rows, cells
        cells += columns * rows
    homes = record_table(HOME, n)
    home_level = np.minimum(np.searchsorted(sides, _widths(scene)), coarser)
    homes.level[: len(scene)] = home_level
    np.maximum.at(levels.widest, home_level, _farthest(scene))
    return State(
        blocks=record_table(np.dtype(np.int32), cells * BLOCK),
        lists=record_table(np.dtype(np.int32), cells),
        listed=np.zeros(len(sides), np.int64),
        homes=homes,
        levels=levels,
        guests=record_table(GUEST, n * coarser),
        hosts=np.zeros(cells if coarser else 0, np.int32),
    )


def arrange(k: Kernel, s: State) -> None:
    """Computes every body's present cell; widens the cells if the skin needs it.

    The present bodies do not determine the width: a wider one may be inserted later.
    """
    homes, levels = s.homes[: len(k.bodies)], s.levels
    least = least_side(levels.widest, k.clock[0].limits.skin)
    levels.side *= max(float((least / levels.side).max()) * ABOVE, 1.0)
    levels.height = levels.side
    levels.slack = 0.5 * (levels.side - least)
    homes.x, homes.y = np.floor(positions_now(k) / levels.side[homes.level][:, None]).T
    clear(s)


def clear(s: State) -> None:
    """Empties all cells."""
    s.blocks[:] = s.listed[:] = 0
    s.lists[:] = s.hosts[:] = NOBODY


def cells_of(grid: Records, x: Any, y: Any) -> Any:
    """Returns the values of ``cell_of`` for arrays."""
    return grid.first + np.mod(x + y * grid.columns, grid.cells).astype(np.int64)


def cells_on_torus(grid: Records, x: Any, y: Any) -> Any:
    """Returns the values of ``cell_on_torus`` for arrays."""
    return (np.mod(x, grid.columns) + np.mod(y, grid.rows) * grid.columns).astype(np.int64)
