"""What there is to see of a tiling: bounds, tiles and pairs (thesis, figures 12 and 13).

To the tiling a disc is the line from its leftmost to its rightmost point. A bound goes up and down from there
to the lines of the bodies that it meets, and a tile is a rectangle between two bounds and two such lines.
Whoever draws the discs over it sees tiles that end at the discs. So tiles hang on bodies, at most four each,
and move with them between events; they cover the arena, and no two of them overlap.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinetile.toolbox import At, Box, Coordinate, Item, Kernel, Segment, pair_links

from .audit import tiles_of
from .web import ENDS, FLIPS, LOWER, UPPER, State

__all__ = ["draw"]


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yield tiles, each with the tick at which it fails, bounds, and the pairs of those that have a tile
    between them."""
    n = len(s.level)
    bodies = np.flatnonzero(k.queue.number >= 0).tolist()
    there, pairs = {*bodies, n}, set()
    due, flips = s.due.tolist(), s.web[FLIPS:].tolist()
    across, height = _across(k, n), _height(k, n)
    for p, q, top, bottom in zip(*(column.tolist() for column in tiles_of(s)), strict=True):
        owner = p >> 4
        if owner not in there:
            continue
        if top < n and bottom < n:
            pairs.add((top, bottom) if top < bottom else (bottom, top))
        yield Box(
            "tile",
            (across[p >> 3], height[bottom]),
            (across[q >> 3], height[top]),
            due[4 * owner + (p & 3)],
            "corner" if owner < n and flips[p] else "",
        )
    for body in bodies:
        for bound in (16 * body, 16 * body + 8):
            x = across[bound >> 3]
            low, high = (height[int(s.web[bound + ENDS + side])] for side in (LOWER, UPPER))
            yield Segment("bound", (x, low), (x, high), label="R" if bound & 8 else "L")
    yield from pair_links(pairs)


def _across(k: Kernel, n: int) -> list[Coordinate]:
    """Return where bounds are on the x axis, two a body, L before R; the edges are bounds of body n."""
    found: list[Coordinate] = []
    for body, reach in enumerate(k.bodies.reach[:n].tolist()):
        found += [At(body, -reach), At(body, reach)]
    return [*found, float(k.clock[0].width), 0.0]


def _height(k: Kernel, n: int) -> list[Coordinate]:
    """Return the heights of the bodies, of TOP and of BOTTOM."""
    return [*map(At, range(n)), float(k.clock[0].height), 0.0]
