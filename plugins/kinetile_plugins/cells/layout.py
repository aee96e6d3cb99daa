"""How wide the cells are, how many there are of them, and where the bodies stand when the structure is built.

The narrower the cells, the fewer bodies are near each other, and the more often one goes over into another
cell. A cell cannot be narrower than the widest body at home in it (docs/cells.md has the exact bound and its
proof). Where bodies are far apart it is best to have two or three in a cell: ``SPACING`` times the side at
which there is one. That is measured, and the optimum is flat. By what a cell is wider than it must be, half
of that, a body may be outside it and stay at home (``slack``): who wanders to and fro over an edge then does
not go over each time.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kinetile.scene import Scene
from kinetile.toolbox import NOBODY, Kernel, Records, positions_now
from kinetile_plugins.cells.table import BLOCK, FULL, GUEST, HOME, LEVEL, LISTED, State

__all__ = ["arrange", "cells_of", "empty", "least_side", "narrowest", "sides_for"]

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
    """Return the least side of cells in which a body of a radius may be at home; arrays will do."""
    return 2.0 * (radius + 2.0 * skin)


def _widths(scene: Scene) -> Any:
    """Return how wide the cells of a body have to be, with some room for the skin."""
    return least_side(scene.radius, 0.0) * ROOM


def narrowest(scene: Scene) -> float:
    """Return the least side of cells that suits any body of a scene."""
    return float(_widths(scene).min())


def _extent(scene: Scene) -> tuple[float, float]:
    """Return width and height of where bodies are: of the arena, or of the middle half of them, twice."""
    if scene.arena is not None:
        return scene.arena
    lower, upper = np.quantile(scene.position, [0.25, 0.75], axis=0)
    width, height = (2.0 * (upper - lower)).tolist()
    return width, height


def _spaced(extent: tuple[float, float], bodies: int, widest: float) -> float:
    """Return the side of cells that are as many as ``SPACING`` says, in a thin arena too."""
    width, height = extent
    square = math.sqrt(width / bodies) * math.sqrt(height)
    one = max(square, width / bodies, height / bodies)
    crowded, sparse = SPACING
    return max(crowded * one, sparse * one - 0.5 * widest)


def sides_for(scene: Scene, side: float | None) -> list[float]:
    """Return the sides of the levels' cells, from the finest to the coarsest, each a power of two times the
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
    """Return columns and rows of the table of a level: three at least, so that nine cells are nine.

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
    """Return the state for a scene and the sides of its levels; ``arrange`` fills it."""
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
    """Return zeroed memory that begins on a cache line, which no block or record then straddles."""
    raw = np.zeros(length * dtype.itemsize + 64, np.uint8)
    at = -raw.ctypes.data % 64
    found = raw[at : at + length * dtype.itemsize].view(dtype)
    return found.view(np.recarray) if dtype.names else found


def arrange(k: Kernel, s: State) -> None:
    """Put every body into its cells as it stands now; the cells become wider where the skin asks for it.

    How wide they must be is not asked of those who are here: a wider one may be about to come.
    """
    homes, levels = s.homes[: len(k.bodies)], s.levels
    level = homes.level
    least = least_side(levels.widest, k.clock[0].skin)
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
    """Return the numbers of the cells in which bodies are at home, or of cells to the right and above."""
    home = s.homes[body]
    grid = s.levels[home.level]
    return grid.first + (home.row + up) % grid.rows * grid.columns + (home.column + right) % grid.columns


def _invite(s: State, at: int, homes: Records) -> None:
    """Make guests in a level of all who have homes in finer ones."""
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
    """Return who stands in cells, sorted by cell, who stands before each, and how many do so in its cell."""
    order = np.argsort(cell, kind="stable")
    sorted_cells, where = cell[order], np.arange(len(order))
    begins = np.append(True, sorted_cells[1:] != sorted_cells[:-1])[: len(order)]
    rank = where - np.maximum.accumulate(np.where(begins, where, 0))
    return order, np.roll(order, 1), rank
