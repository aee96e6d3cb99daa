"""Audit of the cells, slow and from scratch, and their drawing.

Between two events every body is within its home, except for rounding and for a body about to cross. The table
has every body in the cell of its home and nowhere else, block before list. Every body is a guest in the cells
of all coarser levels that contain its own cell, and nowhere else. Each certificate is for the tick of
the plan's arrival at an edge. No cell, without its slack, is narrower than the bodies of its level.
"""

import math
from collections import defaultdict
from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import NEVER, NOBODY, Box, Item, Kernel, pair_links, positions_now, reaches_of
from kinetile.toolbox.ticks import FAR
from kinetile_plugins.cells.layout import BLOCK, FULL, State, cells_of, cells_on_torus, least_side

Whole = npt.NDArray[np.intp]


def audit(k: Kernel, s: State) -> Iterator[str]:
    """Yields a sentence for each fault."""
    there = np.flatnonzero(k.queue.number >= 0)
    homes, skin = s.homes[there], k.clock[0].limits.skin
    level, grid = homes.level, s.levels[homes.level]
    wide = reaches_of(k)[there].max(axis=1) > grid.widest + skin
    for body, of in zip(there[wide], level[wide], strict=True):
        yield f"body {body} is too wide for the cells of level {of}"
    levels = s.levels
    across = np.where(levels.columns > 1, levels.side, np.inf)
    narrow = np.minimum(across, np.where(levels.rows > 1, levels.height, np.inf))
    room = 0.5 * (narrow - least_side(levels.widest, skin))
    for of in np.flatnonzero((levels.slack > room) | (room < 0.0)):
        yield f"level {of} has cells of side {narrow[of]}: too narrow for a slack of {levels.slack[of]}"
    cells = _cells(k, s, there)
    yield from _places(k, there, cells)
    yield from _certificates(k, s, there, cells)
    right = (cells_on_torus if len(k.images) > 0 else cells_of)(grid, homes.x, homes.y)
    for body in np.flatnonzero(homes.cell != right):
        cell = f"cell ({homes.x[body]:.0f}, {homes.y[body]:.0f}) of the plane"
        yield f"body {there[body]} is at home in cell {homes.cell[body]} of the table, where {cell} is not"
    yield from _table(s, there)
    for at in range(1, len(s.levels)):
        yield from _guests(s, at, there)


class _Cells(NamedTuple):
    """The cells of m bodies along both axes, (m, 2): columns and rows in the plans' frame, their widths and
    slack, and True if there are several: no body leaves the only column or row."""

    at: Any
    side: Any
    slack: Any
    several: Any


def _cells(k: Kernel, s: State, there: Whole) -> _Cells:
    homes = s.homes[there]
    grid = s.levels[homes.level]
    at = np.column_stack([homes.x, homes.y])
    if len(k.images) > 0:
        images = k.images[there]
        at -= np.column_stack([images.kx * grid.columns, images.ky * grid.rows])
    side = np.column_stack([grid.side, grid.height])
    return _Cells(at, side, grid.slack[:, None], np.column_stack([grid.columns > 1, grid.rows > 1]))


def _places(k: Kernel, there: Whole, cells: _Cells) -> Iterator[str]:
    """Yields each body that by its plan is two skins or more outside its cell."""
    at, side, slack, several = cells
    waiting, place = np.asarray(k.queue.certificate[there]) > k.clock[0].now, positions_now(k)[there]
    slack = slack + 2.0 * k.clock[0].limits.skin
    outside = (place < at * side - slack) | (place > (at + 1.0) * side + slack)
    for body, axis in np.argwhere(outside & waiting[:, None] & several):
        home = f"cell {at[body, axis]:.0f} of side {side[body, axis]}"
        yield f"body {there[body]} is at {'xy'[axis]} = {place[body, axis]}, outside {home}"


def _certificates(k: Kernel, s: State, there: Whole, cells: _Cells) -> Iterator[str]:
    """Yields each certificate that is not for the body's first edge ahead, and each wrongly noted edge."""
    bodies, homes, clock, own = k.bodies[there], s.homes[there], k.clock[0], k.queue.certificate[there]
    at, side, slack, several = cells
    place, speed = np.column_stack([bodies.x, bodies.y]), np.column_stack([bodies.vx, bodies.vy])
    with np.errstate(all="ignore"):
        delay = ((at + (speed > 0.0)) * side + np.where(speed > 0.0, slack, -slack) - place) / speed
    across, along = np.where((speed != 0.0) & several, delay, np.inf).T
    with np.errstate(over="ignore"):
        ticks = np.maximum(np.minimum(across, along), 0.0) * clock.per_time
    soon = ticks < FAR
    tick = np.maximum(bodies.anchor + np.where(soon, ticks, 0.0).astype(np.int64), clock.now)
    tick = np.where(soon, tick, NEVER)
    way = np.where(across <= along, bodies.vx > 0.0, 2 + (bodies.vy > 0.0))
    for body in np.flatnonzero(tick != own):
        yield f"body {there[body]} reaches an edge at tick {tick[body]}, and is watched for {own[body]}"
    for body in np.flatnonzero((way != homes.way) & soon):
        noted = homes.way[body]
        yield f"body {there[body]} reaches edge {way[body]} of its cell first, and edge {noted} is noted"


def _table(s: State, there: Whole) -> Iterator[str]:
    """Yields each body that is not once in the table, in its cell; and each list of a cell with room."""
    home = s.homes.cell
    blocks = s.blocks.reshape(-1, BLOCK)
    cells, places = np.nonzero(np.arange(FULL) < blocks[:, FULL:])
    listed = list(zip(cells.tolist(), blocks[cells, places].tolist(), strict=True))
    for cell in np.flatnonzero((s.lists >= 0) & (blocks[:, FULL] != FULL)).tolist():
        yield f"cell {cell} has a list beginning with {s.lists[cell]}, and counts {blocks[cell, FULL]}"
    for level, count in enumerate(s.listed.tolist()):
        grid = s.levels[level]
        lists = int(np.count_nonzero(s.lists[grid.first : grid.first + grid.cells] >= 0))
        if lists != count:
            yield f"{lists} cells of level {level} have a list, and {count} are counted"
    for cell in np.flatnonzero(s.lists >= 0).tolist():
        body = int(s.lists[cell])
        while body >= 0 and len(listed) <= 2 * len(s.homes):
            listed.append((cell, body))
            body = int(s.homes.next[body])
    for cell, body in listed:
        if cell != home[body]:
            yield f"body {body} is listed in cell {cell} of the table, and is at home in cell {home[body]}"
    times = np.bincount([body for _, body in listed], minlength=len(home))
    wanted = np.zeros(len(home), dtype=np.int64)
    wanted[there] = 1
    for body in np.flatnonzero(times != wanted).tolist():
        yield f"body {body} is {times[body]} times in the table"


def _guests(s: State, at: int, there: Whole) -> Iterator[str]:
    """Yields each body of a finer level that is not a guest of this one once, in the cell around its own."""
    grid, coarser = s.levels[at], len(s.levels) - 1
    part = s.levels.side[s.homes.level] / grid.side
    around = cells_of(grid, np.floor(s.homes.x * part), np.floor(s.homes.y * part))
    wanted: Any = dict.fromkeys(there[s.homes.level[there] < at].tolist())
    for body in wanted:
        wanted[body] = int(around[body])
        if s.guests[body * coarser + at - 1].cell != wanted[body]:
            yield f"body {body} is a guest of level {at} in another cell than the one around its own"
    seen = set()
    for cell in range(int(grid.first), int(grid.first + grid.cells)):
        before, number = NOBODY, int(s.hosts[cell])
        while number >= 0 and number not in seen:
            seen.add(number)
            if wanted.get(number // coarser) != cell or number % coarser != at - 1:
                yield f"cell {cell} of level {at} has body {number // coarser} as a guest, wrongly"
            if s.guests[number].prev != before:
                yield f"the guests of cell {cell} of level {at} cannot be read backwards"
            before, number = number, int(s.guests[number].next)
    if len(seen) != len(wanted):
        yield f"level {at} has {len(seen)} guests, and {len(wanted)} bodies are at home in finer ones"


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yields each cell with a home or a guest in it, with the first tick of a body at home to leave it;
    then the pairs. If an axis is periodic, yields the cells of the arena alone.

    In a pair the smaller body, at home or as a guest, is in the cell of the larger or in one of the eight
    around it, on the table; if the plane is wrapped, that may be far away.
    """
    there = np.flatnonzero(k.queue.number >= 0).tolist()
    own = k.queue.certificate.tolist()
    homes = s.homes.view(np.ndarray).tolist()  # (x, y, cell, next, way, level)
    grids = s.levels.view(np.ndarray)
    names = ("side", "height", "columns", "rows", "cells", "first")
    sides, heights, columns, rows, cells, firsts = (grids[name].tolist() for name in names)
    periodic = len(k.images) > 0
    fails: dict[tuple[int, int, int], int] = {}
    inside = defaultdict(list)  # by the number of the cell
    for body in there:
        x, y, *_, level = homes[body]
        for at in range(level, len(sides)):
            part = sides[level] / sides[at]
            across, up = math.floor(x * part), math.floor(y * part)
            inside[firsts[at] + (across + up * columns[at]) % cells[at]].append(body)
            cell = (at, across % columns[at], up % rows[at]) if periodic else (at, across, up)
            fails[cell] = min(own[body] if at == level else NEVER, fails.get(cell, NEVER))
    for (at, across, up), tick in sorted(fails.items()):
        low = across * sides[at], up * heights[at]
        high = (across + 1) * sides[at], (up + 1) * heights[at]
        yield Box("cell", low, high, tick, f"level {at}" if len(sides) > 1 else "")
    pairs = set()
    for body in [] if periodic else there:
        _, _, cell, _, _, level = homes[body]
        for across, up in product((-1, 0, 1), repeat=2):
            place = cell - firsts[level] + across + up * columns[level]
            for other in inside.get(firsts[level] + place % cells[level], ()):
                pairs.add((body, other) if body < other else (other, body))
    yield from pair_links((a, b) for a, b in pairs if a != b)
