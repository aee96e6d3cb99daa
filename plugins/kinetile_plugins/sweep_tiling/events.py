"""Maintenance: what happens to the web when the width of a tile becomes zero (thesis, section 4.3).

A tile collapses when the bound on its left reaches the one on its right. What that means follows from the two
ports:

    left port    right port    event
    R.OUTER      L.OUTER       *meeting*: two bodies that were side by side come to stand over each other
    L.UPPER      R.LOWER       *parting*, the exact inverse; also L.LOWER with R.UPPER
    L.UPPER      L.OUTER       *passing*: one body's bound passes that of a body it stands on or hangs under;
    R.OUTER      R.UPPER       likewise with LOWER

Each replaces three links and two ends, and one pair of bodies in sight by another: ``Change`` says what is
new. It never looks at a coordinate, but for one question at a meeting: which of the two is above.

Two bodies whose tile is a corner (one just over the end of the other, its width nearly zero) can slide past
each other exactly where they would graze: no width changes its sign, no contact happens, and yet the one that
was above is below. The thesis has no rule for that, and its web is wrong from then on. Here the vertical
order of a narrow corner tile is a certificate too, and when it fails the two exchange places in it: the
*flip*.
"""

from __future__ import annotations

from typing import NamedTuple

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
    is_inner,
    is_right_bound,
    link,
    opposite,
    port,
    set_end,
    side_of,
)

__all__ = ["Change", "Pair", "Tile", "Tiles", "collapse", "flip", "meeting", "parting", "passing"]


class Tile(NamedTuple):
    """A tile, by the two ports that it links."""

    left: int
    right: int


class Tiles(NamedTuple):
    """The three new tiles of an event."""

    first: Tile
    second: Tile
    third: Tile


class Pair(NamedTuple):
    """Two bodies in sight of each other; TOP and BOTTOM count as bodies."""

    one: int
    other: int


class Change(NamedTuple):
    """What an event did: the tiles that it made, and the pair that came into sight."""

    tiles: Tiles
    come: Pair


@hook
def stands_above(k: Kernel, s: State, a: int, b: int) -> bool:
    """Whether body a is above body b now; if they are level, whether it will be; else by number."""
    one = k.bodies[a]
    two = k.bodies[b]
    clock = k.clock[0]
    rise = (one.y + one.vy * ((clock.now - one.anchor) * clock.tick)) - (
        two.y + two.vy * ((clock.now - two.anchor) * clock.tick)
    )
    if abs(rise) > s.limits[0]:
        return bool(rise > 0.0)
    if one.vy != two.vy:
        return bool(one.vy > two.vy)
    return a > b


@hook
def join(s: State, a: int, b: int, p: int) -> Tiles:
    """Relink bounds a, an R, and b, an L: the body of b comes to stand on side ``p`` of the body of a."""
    o = opposite(p)
    beyond_a = facing(s, port(a, p))
    beyond_b = facing(s, port(b, o))
    link(s, port(b, OUTER), beyond_a)
    link(s, port(a, OUTER), beyond_b)
    link(s, port(b, o), port(a, p))
    set_end(s, a, p, body_of(b))
    set_end(s, b, o, body_of(a))
    return Tiles(Tile(beyond_a, port(b, OUTER)), Tile(port(a, OUTER), beyond_b), Tile(port(b, o), port(a, p)))


@hook
def separate(s: State, a: int, b: int, p: int) -> Tiles:
    """Relink bounds a, an R, and b, an L, whose body stands on side ``p`` of that of a: ``join`` undone."""
    o = opposite(p)
    beyond_a = facing(s, port(b, OUTER))
    beyond_b = facing(s, port(a, OUTER))
    link(s, port(a, p), beyond_a)
    link(s, port(b, o), beyond_b)
    link(s, port(a, OUTER), port(b, OUTER))
    set_end(s, a, p, end(s, b, p))
    set_end(s, b, o, end(s, a, o))
    return Tiles(Tile(beyond_a, port(a, p)), Tile(port(b, o), beyond_b), Tile(port(a, OUTER), port(b, OUTER)))


@hook
def meeting(k: Kernel, s: State, a: int, b: int) -> Change:
    """Tile a.OUTER - b.OUTER of an R and an L collapses: the bodies come to stand over each other (thesis,
    figure 14)."""
    tiles = join(s, a, b, LOWER if stands_above(k, s, body_of(a), body_of(b)) else UPPER)
    return Change(tiles, Pair(body_of(a), body_of(b)))


@hook
def parting(s: State, a: int, b: int, p: int) -> Change:
    """The corner tile at port ``p`` of a, an R, and b, an L, collapses: the bodies come to stand side by side
    (thesis, figure 14, read backwards)."""
    tiles = separate(s, a, b, p)
    return Change(tiles, Pair(end(s, a, UPPER), end(s, a, LOWER)))


@hook
def passing(s: State, a: int, b: int, p: int) -> Change:
    """The tile of inner port ``p`` of bound a and OUTER of bound b collapses (thesis, figure 15).

    One rule for L and R bounds, above and below; once more, with the roles exchanged, it undoes itself.
    """
    o = opposite(p)
    beyond_a = facing(s, port(a, OUTER))
    beyond_b = facing(s, port(b, o))
    come = Pair(body_of(b), end(s, a, o))
    link(s, port(b, OUTER), beyond_a)
    link(s, port(b, o), port(a, OUTER))
    link(s, port(a, p), beyond_b)
    set_end(s, b, o, end(s, a, o))
    set_end(s, a, p, body_of(b))
    first, second, third = port(b, OUTER), port(a, OUTER), beyond_b
    if is_right_bound(a):
        return Change(Tiles(Tile(first, beyond_a), Tile(second, port(b, o)), Tile(third, port(a, p))), come)
    return Change(Tiles(Tile(beyond_a, first), Tile(port(b, o), second), Tile(port(a, p), third)), come)


@hook
def flip(s: State, a: int, b: int, p: int) -> None:
    """The vertical order of the corner tile at port ``p`` of a, an R, and b, an L, fails: the two bodies
    exchange top and bottom, in place.

    Parting and meeting at once; the pairs in sight of each other stay the same.
    """
    separate(s, a, b, p)
    join(s, a, b, opposite(p))


@hook
def collapse(k: Kernel, s: State, p: int, q: int) -> Change:
    """Relink after the width of the tile between left port ``p`` and right port ``q`` has become zero."""
    if not is_inner(p) and not is_inner(q):
        return meeting(k, s, bound_of(p), bound_of(q))
    if is_inner(p) and is_inner(q):
        return parting(s, bound_of(q), bound_of(p), side_of(q))
    inner, outer = (p, q) if is_inner(p) else (q, p)
    return passing(s, bound_of(inner), bound_of(outer), side_of(inner))
