"""How a body comes and goes: meetings and partings from nothing.

The thesis has no rule for either. None is needed beyond those it has. To the tiling a disc is the line from
its leftmost to its rightmost point: bounds stand on its two ends, and other bounds end on whatever is
between. So a body comes as a line of no length, its L and its R on one place in one tile, which it cuts into
an outer tile on each side and two inner ones of no width above and below. Then, while time stands still, its
R moves right to where it belongs. Whatever bound it reaches on the way is a tile that collapses, a meeting or
a passing as at any time (``events``). A body goes the same way back: its R moves left to its L, by passings
and partings, and what is left is taken out of the one tile in which it lies.

The line never crosses another body, for the disc that it belongs to does not. So each of these events is one
that bodies in motion could have caused, and leaves a web that is right for the line as it is then.

Costs: one look at each tile to find the first one, O(n), and an event for each bound that stands over or
under the body.
"""

from __future__ import annotations

from kinetile.toolbox import NEVER, Kernel, hook, is_there, offer, since_anchor

from .events import Tile, Tiles, collapse, stands_above
from .upkeep import watch_around, watch_tiles
from .walk import over
from .web import (
    LOWER,
    OUTER,
    UPPER,
    State,
    body_of,
    facing,
    is_right_bound,
    left_bound,
    link,
    own_tile,
    port,
    right_bound,
    set_due,
    set_end,
)

__all__ = ["enter", "leave"]


@hook
def where(k: Kernel, p: int) -> float:
    """Return where the bound of a port is now, along x."""
    body = k.bodies[body_of(p)]
    place = body.x + body.vx * since_anchor(k, body, k.clock[0].now)
    return float(place + body.reach if is_right_bound(p) else place - body.reach)


@hook
def room_in(k: Kernel, s: State, p: int, body: int, x: float) -> float:
    """Return by how much x lies within the tile of a left port, if the tile's top and bottom are above and
    below a body; else less than any number."""
    n = len(s.level)
    q = facing(s, p)
    top = over(s, p, UPPER)
    bottom = over(s, p, LOWER)
    if (top < n and stands_above(k, s, body, top)) or (bottom < n and stands_above(k, s, bottom, body)):
        return -float("inf")
    left = float("inf") if body_of(p) == n else x - where(k, p)
    right = float("inf") if body_of(q) == n else where(k, q) - x
    return left if left < right else right


@hook
def tile_for(k: Kernel, s: State, body: int) -> int:
    """Return the left port of the tile in which the leftmost point of a body lies; of tiles that rounding
    lets it lie in, the one in which it lies deepest."""
    x = where(k, left_bound(body))
    best = port(right_bound(len(s.level)), OUTER)
    most = room_in(k, s, best, body, x)
    for other in range(k.clock[0].bodies):
        if other != body and is_there(k, other):
            for which in range(3):
                p = own_tile(other, which)
                room = room_in(k, s, p, body, x)
                if room > most:
                    most = room
                    best = p
    return best


@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """A body comes: a line of no length in one tile, which then grows to the right."""
    n = len(s.level)
    left = left_bound(body)
    right = right_bound(body)
    p = tile_for(k, s, body)
    q = facing(s, p)
    top = over(s, p, UPPER)
    bottom = over(s, p, LOWER)
    for side in (UPPER, LOWER):
        link(s, port(left, side), port(right, side))
        set_end(s, left, side, top if side == UPPER else bottom)
        set_end(s, right, side, top if side == UPPER else bottom)
    link(s, p, port(left, OUTER))
    link(s, port(right, OUTER), q)
    watch_around(k, s, body)
    reached = where(k, right)
    q = facing(s, port(right, OUTER))
    while body_of(q) < n and where(k, q) < reached:
        change = collapse(k, s, port(right, OUTER), q)
        watch_tiles(k, s, change.tiles)
        q = facing(s, port(right, OUTER))


@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """A body goes: its R moves left to its L, and the line of no length that is left is taken out of its
    tile."""
    n = len(s.level)
    left = left_bound(body)
    right = right_bound(body)
    above = facing(s, port(right, UPPER))
    below = facing(s, port(right, LOWER))
    while body_of(above) != body or body_of(below) != body:
        upper = body_of(below) == body or (body_of(above) != body and where(k, above) >= where(k, below))
        change = collapse(k, s, above if upper else below, port(right, UPPER if upper else LOWER))
        watch_tiles(k, s, change.tiles)
        one, other = change.come
        if one < n and other < n and one != body and other != body:
            offer(k, one, other)
        above = facing(s, port(right, UPPER))
        below = facing(s, port(right, LOWER))
    p = facing(s, port(left, OUTER))
    q = facing(s, port(right, OUTER))
    for which in (OUTER, UPPER, LOWER):
        set_due(s, own_tile(body, which), NEVER, False)
    link(s, p, q)
    if body_of(p) < n:
        rest = Tile(p, q)
        watch_tiles(k, s, Tiles(rest, rest, rest))
