"""The web of bounds: the stored structure of sweep-tiling.

docs/sweep-tiling.md defines the terms: bounds and tiles, the ports and ends of a bound, the tile as a link.
The web is one array of integers, ``web``. Bound 2b is L of body b, bound 2b + 1 its R; a bound owns eight
places:

    8 * bound + 0, 1, 2   the port linked to its OUTER, UPPER, LOWER port
    8 * bound + 6, 7      its ends above and below
    8 * bound + 3, 4, 5   for its left ports: 1 if that tile would fail by a flip

Each body owns three tiles. One more tile belongs to the arena's left edge, an R bound without a body; the
right edge is an L bound without a body. The number of a port is the place of its link, and the number of a
bound is its first place, the link of its port OUTER. The two bounds of a body share a cache line. Only the
hooks below use these numbers. The rules are about bodies, bounds, ports, ends and tiles; a tile has the
number of its left port. On a cylinder a link has the number of its periods, between unwrapped places; without
a body there is no tile.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import NEVER, Kernel, Records, hook, prefetch, record_table, unchecked

OUTER, UPPER, LOWER = 0, 1, 2
"""Ports of a bound, and sides of a body; also the numbers of the three tiles that a body owns, at its left
ports R.OUTER, L.UPPER and L.LOWER."""

ENDS, FLIPS = 5, 3
"""Offsets in a bound's eight places: of its ends, counted from a side; of a tile's flip, from its port."""

RANK, COLUMN = 3, 4
"""Offsets in a bound's eight places of ``turns``: of its rank in the last construction; of its period."""


class State(NamedTuple):
    """The web, the ticks of its failing tiles, and the arrays of the static construction.

    As ends, body n is TOP and body n + 1 BOTTOM; the arena's edges are the bounds of body n.
    """

    web: Records  # (16 (n + 1),) links and ends
    due: Records  # (4 (n + 1),) the ticks of a body's tiles at R.OUTER, L.UPPER, L.LOWER, and NEVER
    sweep: Records  # (2n,) the bounds from left to right, at the last construction
    level: Records  # (n,) rank of each body from bottom to top, at the last construction
    at_level: Records  # (n,) the body of each rank
    status: Records  # (2m,) tree over the ranks: 1 for bodies on the sweep line
    opened: Records  # (n + 1,) the open left port above each body; n: above BOTTOM
    limits: Records  # (2,) the width below which a tile counts as of no width: for ties, and for flips
    # as web if x is periodic, else empty: the periods from a port's bound to the linked bound
    turns: Records


def empty(bodies: int, periodic: bool) -> State:
    """Returns an empty state for this many bodies, for the construction."""
    leaves = 1 << max(bodies - 1, 0).bit_length()
    due = record_table(np.dtype(np.int64), 4 * (bodies + 1))
    due[:] = NEVER
    return State(
        web=record_table(np.dtype(np.uint32), 16 * (bodies + 1)),
        due=due,
        sweep=np.zeros(2 * bodies, dtype=np.int32),
        level=np.zeros(bodies, dtype=np.int32),
        at_level=np.zeros(bodies, dtype=np.int32),
        status=np.zeros(2 * leaves, dtype=np.int8),
        opened=np.zeros(bodies + 1, dtype=np.int32),
        limits=np.zeros(2),
        turns=np.zeros(16 * (bodies + 1) if periodic else 0, dtype=np.int64),
    )


def bounds(bodies: int) -> npt.NDArray[np.int32]:
    """Returns L and R of each body, one body after the other."""
    return np.arange(0, 16 * bodies, 8, dtype=np.int32)


@hook
def link(s: State, p: int, q: int, turns: int) -> None:
    """Makes two ports the two sides of one tile, the second port ``turns`` periods on."""
    s.web[p] = q
    s.web[q] = p
    if len(s.turns) > 0:
        s.turns[p] = turns
        s.turns[q] = -turns


@hook
def turns_to(s: State, p: int) -> int:
    """Returns the number of periods along a port's link, between unwrapped places."""
    return int(s.turns[p]) if len(s.turns) > 0 else 0


@hook
def left_bound(body: int) -> int:
    """Returns L of a body; for body n, the arena's right edge."""
    return 16 * body


@hook
def right_bound(body: int) -> int:
    """Returns R of a body; for body n, the arena's left edge."""
    return 16 * body + 8


@hook
def port(bound: int, side: int) -> int:
    """Returns the port of a bound on a side."""
    return bound + side


@hook
def opposite(side: int) -> int:
    """Returns LOWER for UPPER, UPPER for LOWER."""
    return 3 - side


@hook
def side_of(p: int) -> int:
    """Returns the side of a port: OUTER, UPPER or LOWER."""
    return p & 7


@hook
def bound_of(p: int) -> int:
    """Returns the bound of a port."""
    return p & ~7


@hook
def body_of(p: int) -> int:
    """Returns the body of a bound or a port; n for an edge of the arena."""
    return p >> 4


@hook
def is_right_bound(p: int) -> bool:
    """Returns True if a bound, or the bound of a port, is an R."""
    return p & 8 != 0


@hook
def is_inner(p: int) -> bool:
    """Returns True if a port is UPPER or LOWER."""
    return p & 7 != OUTER


@hook
def facing(s: State, p: int) -> int:
    """Returns the port at the other side of a port's tile."""
    return int(np.int64(s.web[p]))  # compiled, int alone would leave it 32 bits wide


@hook
def end(s: State, bound: int, side: int) -> int:
    """Returns the body, or TOP or BOTTOM, that a bound's line meets on a side."""
    return int(np.int64(s.web[bound + ENDS + side]))


@hook
def set_end(s: State, bound: int, side: int, body: int) -> None:
    """Sets the body that a bound's line meets on a side."""
    s.web[bound + ENDS + side] = body


@hook
def own_tile(body: int, which: int) -> int:
    """Returns one of the three tiles that a body owns."""
    return right_bound(body) if which == OUTER else left_bound(body) + which


@hook
def due_of(s: State, body: int, which: int) -> int:
    """Returns the tick at which one of the three tiles that a body owns fails."""
    return int(s.due[4 * body + which])


@hook
def set_due(s: State, tile: int, tick: int, by_order: bool) -> None:
    """Notes the tick at which a tile fails, by its vertical order (``by_order``) or by its width."""
    s.due[4 * body_of(tile) + (tile & 3)] = tick  # side_of, in two bits: the short shift saves time
    s.web[tile + FLIPS] = by_order


@hook
def fails_by_order(s: State, tile: int) -> bool:
    """Returns True if a tile would fail by its vertical order."""
    return bool(s.web[tile + FLIPS])


class Tile(NamedTuple):
    """A tile, by the two ports that it links."""

    left: int
    right: int


class Tiles(NamedTuple):
    """The three new tiles of an event."""

    first: Tile
    second: Tile
    third: Tile


# The walk around a body visits the tiles over it and under it from left to right (thesis, section 5.1). It
# finds the bodies in sight, on the other side of these tiles. Nearness is not stored anywhere else.


@hook
def over(s: State, p: int, side: int) -> int:
    """Returns the body on a side of a tile, its top or its bottom, by the bound of its left port."""
    return body_of(p) if side_of(p) == opposite(side) else end(s, bound_of(p), side)


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Names the bodies on the other side of the tiles over a body, then of the tiles under it.

    The walk leaves an L bound on the body by the bound's other inner port, an R bound by its outer port.
    """
    n = len(s.level)
    left = 3 * n + 1  # there are no more tiles: the walk ends in a broken web, too
    count = 0
    for side in (UPPER, LOWER):
        p = own_tile(body, side)
        other = end(s, left_bound(body), side)
        last = n
        while left > 0:
            left -= 1
            k.near[count] = other
            count += 1 if other != last and other < n else 0
            last = other
            q = facing(s, p)
            if body_of(q) == body:
                break
            is_right = is_right_bound(q)
            p = bound_of(q) + (OUTER if is_right else opposite(side))
            other = end(s, bound_of(q), side) if is_right else body_of(q)
    return count


@unchecked
@hook
def soon(k: Kernel, s: State, body: int, stage: int) -> None:
    """Prefetches a body's bounds; then plans and bounds of the bodies in sight; then their queue entries."""
    first = port(left_bound(body), OUTER)
    if stage == 0:
        prefetch(s.web, first)
        prefetch(s.due, 4 * body)
        return
    for place in range(first, first + 16):
        column = place & 7
        if column <= LOWER or column > FLIPS + LOWER:
            there = int(np.int64(s.web[place]))  # not as a number without a sign
            other = body_of(there) if column <= LOWER else there
            if other < len(s.level):
                if stage == 1:
                    prefetch(k.bodies, other)
                    prefetch(s.web, port(left_bound(other), OUTER))
                    prefetch(s.due, 4 * other)
                else:
                    prefetch(k.queue, other)
                    prefetch(k.places, other)
