"""The web of bounds: what sweep-tiling stores.

From the leftmost and the rightmost point of each body a vertical line is drawn up and down until it meets
another body or the border: its *bounds* L and R (thesis, figure 12). The bounds cut the free space into
*tiles*. A bound has three *ports*, each on one tile::

    OUTER   the side away from the body           UPPER, LOWER   the inner side, above and below the body

and two *ends*: the bodies (or TOP, BOTTOM) that its line meets above and below. A tile lies between two
bounds, so it is a *link* between a port of its left bound and a port of its right bound::

    left ports    L.UPPER  L.LOWER  R.OUTER      right ports    R.UPPER  R.LOWER  L.OUTER

Every tile has exactly one left port, and every body has three, so there are 3n + 1 tiles whatever happens:
the one more belongs to the arena's left edge, an R bound without a body, as the right edge is an L bound
without one.

All of it is one array of integers, ``web``. Bound 2b is L of body b, bound 2b + 1 its R; a bound owns eight
places:

    8 * bound + 0, 1, 2   the port linked to its OUTER, UPPER, LOWER port
    8 * bound + 5, 6      its ends above and below
    8 * bound + 3         of an L bound: which of its body's three tiles would fail by a flip, as bits

A port is known by the place that holds its link, so ``web[web[p]] == p``, ``p >> 4`` is the body, and the end
that a port UPPER or LOWER looks at stands four places on. The two bounds of a body share a cache line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kinetile.toolbox import NEVER, Records, hook

__all__ = ["FLIPS", "LOWER", "OUTER", "UPPER", "State", "empty", "is_left", "link"]

OUTER, UPPER, LOWER = 0, 1, 2
"""Ports of a bound; 3 - UPPER is LOWER."""

FLIPS = 3


class State(NamedTuple):
    """The web, when its tiles fail, and what the static construction needs.

    As ends, body n is TOP and body n + 1 BOTTOM; the arena's edges are the bounds of body n.
    """

    web: Records  # (16 (n + 1),) links and ends
    due: Records  # (4n,) ticks at which a body's tiles at R.OUTER, L.UPPER, L.LOWER fail; the fourth is NEVER
    sweep: Records  # (2n,) the bounds from left to right, at the last construction
    level: Records  # (n,) rank of each body from bottom to top, at the last construction
    at_level: Records  # (n,) the body of each rank
    status: Records  # (2m,) tree over the ranks: which bodies are on the sweep line
    opened: Records  # (n + 1,) the left port that is open above each body; n: above BOTTOM
    limits: Records  # (2,) how narrow a tile counts as of no width: for ties, and for flips


def empty(bodies: int) -> State:
    """Return a state for so many bodies, to be filled by the construction."""
    leaves = 1 << max(bodies - 1, 0).bit_length()
    return State(
        web=np.zeros(16 * (bodies + 1), dtype=np.int32),
        due=np.full(4 * bodies, NEVER, dtype=np.int64),
        sweep=np.zeros(2 * bodies, dtype=np.int32),
        level=np.zeros(bodies, dtype=np.int32),
        at_level=np.zeros(bodies, dtype=np.int32),
        status=np.zeros(2 * leaves, dtype=np.int8),
        opened=np.zeros(bodies + 1, dtype=np.int32),
        limits=np.zeros(2),
    )


@hook
def link(s: State, p: int, q: int) -> None:
    """Make two ports the two sides of one tile."""
    s.web[p] = q
    s.web[q] = p


@hook
def is_left(p: int) -> bool:
    """Whether a port is the left one of its tile: OUTER of an R bound, or an inner port of an L bound."""
    return (p & 7 == OUTER) == (p >> 3 & 1 == 1)
