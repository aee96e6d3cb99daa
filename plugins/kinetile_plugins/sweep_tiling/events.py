"""Changes of the web: collapse of a tile (thesis, section 4.3), insertion and removal of a body.

docs/sweep-tiling.md has a table of the event for each two ports of a tile, and of the links that it replaces;
it also describes the flip at a corner, and the insertion of a body as a growing line. ``Change`` has the
tiles that an event makes, and the pair that comes into sight. No coordinate is read, except for one decision
at a meeting: the upper one of the two bodies.

The line of an insertion or a removal never crosses another body, for its disc does not. So each of its events
could also be caused by moving bodies, and leaves a web that is right for the present line.
"""

import math
from typing import NamedTuple

from kinetile.toolbox import NEVER, Kernel, hook, is_there, offer, position_at, unchecked
from kinetile.toolbox.ticks import near_zero

from .certificates import edge_of, periods, watch_around, watch_tiles
from .web import (
    LOWER,
    OUTER,
    UPPER,
    State,
    Tile,
    Tiles,
    body_of,
    bound_of,
    end,
    facing,
    is_inner,
    is_right_bound,
    left_bound,
    link,
    opposite,
    over,
    own_tile,
    port,
    right_bound,
    set_due,
    set_end,
    side_of,
    turns_to,
)


class Pair(NamedTuple):
    """Two bodies in sight of each other; TOP and BOTTOM count as bodies."""

    one: int
    other: int


class Change(NamedTuple):
    """The result of an event: the tiles that it made, and the pair that came into sight."""

    tiles: Tiles
    come: Pair


@hook
def is_above(k: Kernel, s: State, a: int, b: int) -> bool:
    """Returns True if body a is above body b now; if they are level, a moment later; else by number."""
    one = k.bodies[a]
    two = k.bodies[b]
    now = k.clock[0].now
    rise = position_at(k, one, now)[1] - position_at(k, two, now)[1]
    if abs(rise) > s.limits[0]:
        return bool(rise > 0.0)
    if one.vy != two.vy:
        return bool(one.vy > two.vy)
    return a > b


@hook
def join(s: State, a: int, b: int, p: int) -> Tiles:
    """Relinks bounds a, an R, and b, an L, so that the body of b is on side ``p`` of the body of a."""
    o = opposite(p)
    beyond_a = facing(s, port(a, p))
    beyond_b = facing(s, port(b, o))
    across = turns_to(s, port(a, OUTER))
    to_a = turns_to(s, port(a, p))
    to_b = turns_to(s, port(b, o))
    link(s, port(b, OUTER), beyond_a, to_a - across)
    link(s, port(a, OUTER), beyond_b, to_b + across)
    link(s, port(b, o), port(a, p), -across)
    set_end(s, a, p, body_of(b))
    set_end(s, b, o, body_of(a))
    return Tiles(Tile(beyond_a, port(b, OUTER)), Tile(port(a, OUTER), beyond_b), Tile(port(b, o), port(a, p)))


@hook
def separate(s: State, a: int, b: int, p: int) -> Tiles:
    """Undoes ``join`` for bounds a, an R, and b, an L: the body of b is on side ``p`` of a's body."""
    o = opposite(p)
    beyond_a = facing(s, port(b, OUTER))
    beyond_b = facing(s, port(a, OUTER))
    across = turns_to(s, port(a, p))
    to_a = turns_to(s, port(b, OUTER))
    to_b = turns_to(s, port(a, OUTER))
    link(s, port(a, p), beyond_a, to_a + across)
    link(s, port(b, o), beyond_b, to_b - across)
    link(s, port(a, OUTER), port(b, OUTER), across)
    set_end(s, a, p, end(s, b, p))
    set_end(s, b, o, end(s, a, o))
    return Tiles(Tile(beyond_a, port(a, p)), Tile(port(b, o), beyond_b), Tile(port(a, OUTER), port(b, OUTER)))


@hook
def meeting(k: Kernel, s: State, a: int, b: int) -> Change:
    """Collapses tile a.OUTER - b.OUTER of an R and an L: one body is now over the other (figure 14)."""
    tiles = join(s, a, b, LOWER if is_above(k, s, body_of(a), body_of(b)) else UPPER)
    return Change(tiles, Pair(body_of(a), body_of(b)))


@hook
def parting(s: State, a: int, b: int, p: int) -> Change:
    """Collapses the corner tile at port ``p`` of a, an R, and b, an L: the bodies are now side by side
    (thesis, figure 14, read backwards)."""
    tiles = separate(s, a, b, p)
    return Change(tiles, Pair(end(s, a, UPPER), end(s, a, LOWER)))


@hook
def passing(s: State, a: int, b: int, p: int) -> Change:
    """Collapses the tile of inner port ``p`` of bound a and OUTER of bound b (thesis, figure 15).

    One rule serves L and R bounds, above and below. Applied again with the roles exchanged, it undoes itself.
    """
    o = opposite(p)
    beyond_a = facing(s, port(a, OUTER))
    beyond_b = facing(s, port(b, o))
    come = Pair(body_of(b), end(s, a, o))
    across = turns_to(s, port(a, p))
    to_a = turns_to(s, port(a, OUTER))
    to_b = turns_to(s, port(b, o))
    link(s, port(b, OUTER), beyond_a, to_a - across)
    link(s, port(b, o), port(a, OUTER), -across)
    link(s, port(a, p), beyond_b, to_b + across)
    set_end(s, b, o, end(s, a, o))
    set_end(s, a, p, body_of(b))
    first, second, third = port(b, OUTER), port(a, OUTER), beyond_b
    if is_right_bound(a):
        return Change(Tiles(Tile(first, beyond_a), Tile(second, port(b, o)), Tile(third, port(a, p))), come)
    return Change(Tiles(Tile(beyond_a, first), Tile(port(b, o), second), Tile(port(a, p), third)), come)


@hook
def flip(s: State, a: int, b: int, p: int) -> None:
    """Exchanges the two bodies of the corner tile at port ``p`` of a, an R, and b, an L, as top and bottom,
    in place: the vertical order of the tile fails.

    It is a parting and a meeting at once; the pairs in sight of each other stay the same.
    """
    separate(s, a, b, p)
    join(s, a, b, opposite(p))


@hook
def collapse(k: Kernel, s: State, p: int, q: int) -> Change:
    """Relinks after the width of the tile between left port ``p`` and right port ``q`` has become zero."""
    if not is_inner(p) and not is_inner(q):
        return meeting(k, s, bound_of(p), bound_of(q))
    if is_inner(p) and is_inner(q):
        return parting(s, bound_of(q), bound_of(p), side_of(q))
    inner, outer = (p, q) if is_inner(p) else (q, p)
    return passing(s, bound_of(inner), bound_of(outer), side_of(inner))


@hook
def where(k: Kernel, p: int) -> float:
    """Returns the present position of a port's bound along x."""
    return float(position_at(k, k.bodies[body_of(p)], k.clock[0].now)[0] + edge_of(k, p))


@hook
def width(k: Kernel, s: State, p: int) -> float:
    """Returns the present width of a left port's tile, between two bounds of bodies."""
    q = facing(s, p)
    apart = where(k, q) - where(k, p)
    if len(s.turns) > 0:
        apart += periods(k, s, p, q) * k.clock[0].torus.x
    return float(apart)


@hook
def room_in(k: Kernel, s: State, p: int, body: int, x: float) -> float:
    """Returns the depth of x inside the tile of a left port, if the tile's top and bottom are above and below
    a body; else -inf."""
    n = len(s.level)
    q = facing(s, p)
    top = over(s, p, UPPER)
    bottom = over(s, p, LOWER)
    if (top < n and is_above(k, s, body, top)) or (bottom < n and is_above(k, s, bottom, body)):
        return -float("inf")
    if len(s.turns) > 0:
        half = 0.5 * width(k, s, p)
        return half - abs(near_zero(x - (where(k, p) + half), k.clock[0].torus.x))
    left = float("inf") if body_of(p) == n else x - where(k, p)
    right = float("inf") if body_of(q) == n else where(k, q) - x
    return left if left < right else right


@hook
def tile_for(k: Kernel, s: State, body: int) -> int:
    """Returns the left port of the tile that contains the leftmost point of a body; if by rounding several
    tiles contain it, of the tile with the point deepest inside."""
    x = where(k, left_bound(body))
    best = port(right_bound(len(s.level)), OUTER)
    most = -float("inf") if len(s.turns) > 0 else room_in(k, s, best, body, x)
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
def turns_into(k: Kernel, s: State, p: int, bound: int) -> int:
    """Returns the number of periods along the link from a left port to a bound within its tile."""
    if len(s.turns) == 0:
        return 0
    half = 0.5 * width(k, s, p)
    torus = k.clock[0].torus
    apart = where(k, bound) - where(k, p)
    into = half + near_zero(apart - half, torus.x)
    rounds = int(math.floor((into - apart) * torus.per_x + 0.5))
    return int(rounds + k.images[body_of(p)].kx - k.images[body_of(bound)].kx)


@hook
def lay(s: State, body: int, top: int, bottom: int) -> None:
    """Lays the line of a body between a top and a bottom: links two inner tiles, sets its bounds' ends."""
    left = left_bound(body)
    right = right_bound(body)
    for side in (UPPER, LOWER):
        link(s, port(left, side), port(right, side), 0)
        set_end(s, left, side, top if side == UPPER else bottom)
        set_end(s, right, side, top if side == UPPER else bottom)


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """Inserts a body: a line of no length in one tile, which then grows to the right."""
    n = len(s.level)
    left = left_bound(body)
    right = right_bound(body)
    if len(s.turns) > 0 and k.clock[0].present == 1:  # alone on a cylinder, which has no tile to cut
        lay(s, body, n, n + 1)
        link(s, port(right, OUTER), port(left, OUTER), 1)
        watch_around(k, s, body)
        return
    p = tile_for(k, s, body)
    q = facing(s, p)
    turns = turns_to(s, p)
    before = turns_into(k, s, p, left)
    lay(s, body, over(s, p, UPPER), over(s, p, LOWER))
    link(s, p, port(left, OUTER), before)
    link(s, port(right, OUTER), q, turns - before)
    watch_around(k, s, body)
    q = facing(s, port(right, OUTER))
    while body_of(q) < n and width(k, s, port(right, OUTER)) < 0.0:
        change = collapse(k, s, port(right, OUTER), q)
        watch_tiles(k, s, change.tiles)
        q = facing(s, port(right, OUTER))


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """Removes a body: its R moves left to its L, and the line of no length is removed from its tile."""
    n = len(s.level)
    left = left_bound(body)
    right = right_bound(body)
    above = facing(s, port(right, UPPER))
    below = facing(s, port(right, LOWER))
    while body_of(above) != body or body_of(below) != body:
        upper = body_of(below) == body or (
            body_of(above) != body and width(k, s, above) <= width(k, s, below)
        )
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
    if body_of(p) == body:  # it was alone on a cylinder
        return
    link(s, p, q, turns_to(s, p) + turns_to(s, port(right, OUTER)))
    if body_of(p) < n:
        rest = Tile(p, q)
        watch_tiles(k, s, Tiles(rest, rest, rest))
