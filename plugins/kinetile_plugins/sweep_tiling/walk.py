"""The walk around a body: over it and under it from left to right, tile by tile (thesis, section 5.1).

It finds the bodies in sight, those on the other side of these tiles. Nothing else says who is near whom.
"""

from __future__ import annotations

from kinetile.toolbox import Kernel, hook

from .web import (
    LOWER,
    OUTER,
    UPPER,
    State,
    body_of,
    bound_of,
    end,
    facing,
    is_right_bound,
    opposite,
    own_tile,
    side_of,
)

__all__ = ["near"]


@hook
def over(s: State, p: int, side: int) -> int:
    """The body that a tile has on a side, its top or its bottom, as the bound of its left port knows it."""
    return body_of(p) if side_of(p) == opposite(side) else end(s, bound_of(p), side)


@hook
def next_along(q: int, side: int) -> int:
    """The left port of the next tile on a side of a body, after the one whose right port is ``q``.

    An L bound that stands on the body is left by its other inner port, an R bound by its outer.
    """
    return bound_of(q) + (OUTER if is_right_bound(q) else opposite(side))


@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies on the other side of the tiles over a body, then of those under it."""
    n = len(s.level)
    left = 3 * n + 1  # there are no more tiles: a web that is broken leads no further
    count = 0
    for side in (UPPER, LOWER):
        p = own_tile(body, side)
        last = n
        while left > 0:
            left -= 1
            other = over(s, p, side)
            if other != last and other < n:
                k.near[count] = other
                count += 1
            last = other
            q = facing(s, p)
            if body_of(q) == body:
                break
            p = next_along(q, side)
    return count
