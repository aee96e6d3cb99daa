"""What there is to see of the cells: those that somebody is in, level by level, and the pairs."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from kinetile.toolbox import NEVER, Box, Item, Kernel, pair_links
from kinetile_plugins.cells.table import State

__all__ = ["draw"]


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yield each cell in which somebody is at home or a guest, with the tick at which the first of those at
    home leaves it, then the pairs.

    A pair is two bodies of which the smaller, at home or as a guest, stands in the cell of the larger or in
    one of the eight around it, on the table: where the plane is wound up that may be far away.
    """
    there = np.flatnonzero(k.queue.number >= 0).tolist()
    own = k.queue.own.tolist()
    homes = s.homes.view(np.ndarray).tolist()  # (x, y, column, row, next, way, level)
    sides, columns, rows = (s.levels[name].tolist() for name in ("side", "columns", "rows"))
    fails: dict[tuple[int, int, int], int] = {}
    standing = defaultdict(list)
    for body in there:
        x, y, *_, level = homes[body]
        for at in range(level, len(sides)):
            part = sides[level] / sides[at]
            across, up = math.floor(x * part), math.floor(y * part)
            leaves = own[body] if at == level else NEVER
            fails[at, across, up] = min(leaves, fails.get((at, across, up), NEVER))
            standing[at, across % columns[at], up % rows[at]].append(body)
    for (at, across, up), tick in sorted(fails.items()):
        side = sides[at]
        label = f"level {at}" if len(sides) > 1 else ""
        yield Box("cell", (across * side, up * side), ((across + 1) * side, (up + 1) * side), tick, label)
    pairs = set()
    for body in there:
        _, _, column, row, _, _, level = homes[body]
        for across in (column - 1, column, column + 1):
            for up in (row - 1, row, row + 1):
                for other in standing.get((level, across % columns[level], up % rows[level]), ()):
                    pairs.add((body, other) if body < other else (other, body))
    yield from pair_links((a, b) for a, b in pairs if a != b)
