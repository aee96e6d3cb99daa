"""Maintenance: what happens to the web when the width of a tile becomes zero (thesis, section 4.3).

A tile collapses when the bound on its left reaches the one on its right. What that means follows from the two
ports:

    left port    right port    event
    R.OUTER      L.OUTER       *meeting*: two bodies that were side by side come to stand over each other
    L.UPPER      R.LOWER       *parting*, the exact inverse; also L.LOWER with R.UPPER
    L.UPPER      L.OUTER       *passing*: one body's bound passes that of a body it stands on or hangs under;
    R.OUTER      R.UPPER       likewise with LOWER

Each replaces three links and two ends, takes one candidate pair away and brings one; it returns the left
ports of the three new tiles, the pair that goes and the pair that comes. It never looks at a
coordinate, but for one question at a meeting: which of the two is above.

Two bodies whose tile is a corner (one just over the end of the other, its width nearly zero) can slide past
each other exactly where they would graze: no width changes its sign, no contact happens, and yet the one that
was above is below. The thesis has no rule for that, and its web is wrong from then on. Here the vertical
order of a narrow corner tile is a certificate too, and when it fails the two exchange places in it: the
*flip*.
"""

from __future__ import annotations

from kinetile.toolbox import Kernel, hook

from .web import LOWER, OUTER, UPPER, State, link

__all__ = ["flip", "meeting", "parting", "passing"]


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
def join(s: State, rb: int, lb: int, near: int) -> tuple[int, int, int]:
    """Relink for a meeting of R bound ``rb`` and L bound ``lb``; ``near`` is the port of rb on the side of
    lb.

    Returns the left ports of the three tiles that are new.
    """
    web = s.web
    far = 3 - near
    x = int(web[rb + near])
    z = int(web[lb + far])
    link(s, lb + OUTER, x)
    link(s, rb + OUTER, z)
    link(s, lb + far, rb + near)
    web[rb + 4 + near] = lb >> 4
    web[lb + 4 + far] = rb >> 4
    return x, rb + OUTER, lb + far


@hook
def separate(s: State, rb: int, lb: int, near: int) -> tuple[int, int, int]:
    """Relink for a parting, the inverse of ``join``; return the left ports of the new tiles."""
    web = s.web
    far = 3 - near
    x = int(web[lb + OUTER])
    z = int(web[rb + OUTER])
    link(s, rb + near, x)
    link(s, lb + far, z)
    link(s, rb + OUTER, lb + OUTER)
    web[rb + 4 + near] = web[lb + 4 + near]
    web[lb + 4 + far] = web[rb + 4 + far]
    return x, lb + far, rb + OUTER


@hook
def meeting(k: Kernel, s: State, rb: int, lb: int) -> tuple[int, int, int, int, int, int, int]:
    """Tile R.OUTER - L.OUTER collapses: the bodies come to stand over each other (thesis, figure 14)."""
    a = rb >> 4
    b = lb >> 4
    top = int(s.web[rb + 4 + UPPER])
    bottom = int(s.web[rb + 4 + LOWER])
    one, two, three = join(s, rb, lb, LOWER if stands_above(k, s, a, b) else UPPER)
    return one, two, three, top, bottom, a, b


@hook
def parting(s: State, lb: int, rb: int, near: int) -> tuple[int, int, int, int, int, int, int]:
    """A corner tile collapses: the bodies come to stand side by side (thesis, figure 14, read backwards)."""
    one, two, three = separate(s, rb, lb, near)
    return one, two, three, rb >> 4, lb >> 4, int(s.web[rb + 4 + UPPER]), int(s.web[rb + 4 + LOWER])


@hook
def passing(s: State, a: int, b: int, side: int) -> tuple[int, int, int, int, int, int, int]:
    """The tile of inner port ``side`` of bound a and OUTER of bound b collapses (thesis, figure 15).

    One rule for L and R bounds, above and below; once more, with the roles exchanged, it undoes itself.
    """
    web = s.web
    other = 3 - side
    p = int(web[a + OUTER])
    x = int(web[b + other])
    end = int(web[a + 4 + side])
    far = int(web[a + 4 + other])
    link(s, b + OUTER, p)
    link(s, b + other, a + OUTER)
    link(s, a + side, x)
    web[b + 4 + other] = far
    web[a + 4 + side] = b >> 4
    if a & 8 == 0:
        return p, b + other, a + side, a >> 4, end, b >> 4, far
    return b + OUTER, a + OUTER, x, a >> 4, end, b >> 4, far


@hook
def flip(s: State, lb: int, rb: int, near: int) -> None:
    """The vertical order of a corner tile fails: its two bodies exchange top and bottom, in place.

    Parting and meeting at once; the candidate pairs stay the same, each held as often as before.
    """
    separate(s, rb, lb, near)
    join(s, rb, lb, 3 - near)
