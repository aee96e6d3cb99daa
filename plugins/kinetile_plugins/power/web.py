"""The triangulation: what ``power`` stores, and the changes that keep it one.

Its vertices are the *sites*: the bodies, by their slots, and behind them four points that do not move, far
outside of the arena, whose square is the hull. A triangle has three half-edges, from site to site with the
triangle on the left. That of triangle t are 4t, 4t + 1 and 4t + 2, and the place 4t + 3 is not used. The
half-edge on the other side of an edge is its twin; those of the hull have none. So there are 2n + 2
triangles, whatever happens.

An edge is watched for the body that *owns* it: its end with the smaller number, hence never a far point. Its
tick is kept at the half-edge that begins at the owner, and the twin has ``NEVER``. So what a body owns is
read in one turn around it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import NEVER, NOBODY, Kernel, Records, hook, offer, smaller, unchecked

CORNERS = 4
"""Far points."""


class State(NamedTuple):
    """The triangulation of m sites, m - 4 of them slots for bodies, and what is watched."""

    org: Records  # (8 m,) the site at which a half-edge begins; of a triangle that is not used, NOBODY
    # (8 m,) the half-edge on the other side, or NOBODY; of a triangle that is not used the next such one
    twin: Records
    due: Records  # (8 m,) when the certificate of an edge fails, at its owner's half-edge; else NEVER
    first: Records  # (m,) a half-edge that begins at a site
    soonest: Records  # (m,) the least tick of the edges that a body owns
    weight: Records  # (m,) the squares of reaches, by the scale; 0 of far points
    order: Records  # (m,) the bodies in the order in which the first triangulation takes them
    listed: Records  # (3 m + 16,) half-edges to be watched
    sites: Records  # (32,) a, b, c and d of eight edges: a to b, with c on the left and d on the right
    plans: Records  # (32,) the same, with body 0 in the place of far points
    heads: Records  # (2,) the first triangle that is not used, and one that is
    scale: Records  # (6,) see below


PER_LENGTH, UNIT, THETA, CENTRE_X, CENTRE_Y, FAR = range(6)
"""What is in ``scale``: what lengths are multiplied by, a power of two, so that the arena's longer side is
about 1; a unit of the clock in the scene's time; how far a site may be below a plane; and, by the scale, the
arena's centre and how far the far points are from it."""


def empty(bodies: int) -> State:
    """Returns the arrays for a number of slots."""
    m = bodies + CORNERS
    whole, tick = np.full(8 * m, NOBODY, dtype=np.int32), np.full(8 * m, NEVER, dtype=np.int64)
    return State(
        org=whole,
        twin=whole.copy(),
        due=tick,
        first=np.zeros(m, dtype=np.int32),
        soonest=tick[:m].copy(),
        weight=np.zeros(m),
        order=np.zeros(m, dtype=np.int32),
        listed=np.zeros(3 * m + 16, dtype=np.int32),
        sites=np.zeros(32, dtype=np.int32),
        plans=np.zeros(32, dtype=np.int32),
        heads=np.zeros(2, dtype=np.int32),
        scale=np.zeros(6),
    )


def far_points(s: State) -> npt.NDArray[np.float64]:
    """Returns the places of the far points, by the scale."""
    around = s.scale[FAR] * np.array([[-1, 0], [0, -1], [1, 0], [0, 1]])
    return np.asarray(s.scale[[CENTRE_X, CENTRE_Y]] + around)


@hook
def slots(s: State) -> int:
    """Return how many slots for bodies there are: the number of the first far point."""
    return len(s.first) - CORNERS


@hook
def succ(h: int) -> int:
    """Return the next half-edge of a triangle."""
    return h - 2 if h & 3 == 2 else h + 1


@hook
def pred(h: int) -> int:
    """Return the half-edge of a triangle before another."""
    return h + 2 if h & 3 == 0 else h - 1


@hook
def around(s: State, h: int) -> int:
    """Return the next half-edge that begins at the site of another, counter-clockwise."""
    return int(s.twin[pred(h)])


@hook
def owned(s: State, h: int) -> int:
    """Return the half-edge at which an edge is watched; NOBODY for one between two far points."""
    a = s.org[h]
    b = s.org[succ(h)]
    if smaller(a, b) >= slots(s):
        return NOBODY
    return h if a < b else int(s.twin[h])


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Name the bodies to which a body has an edge."""
    n = slots(s)
    count = 0
    start = int(s.first[body])
    h = start
    for _ in range(len(s.first)):
        other = s.org[succ(h)]
        if other < n:
            k.near[count] = other
            count += 1
        h = around(s, h)
        if h == start:
            break
    return count


@hook
def join(s: State, h: int, g: int) -> None:
    """Make two half-edges twins; the second may be NOBODY."""
    s.twin[h] = g
    if g >= 0:
        s.twin[g] = h


@hook
def lay(s: State, h: int, a: int, b: int, c: int) -> None:
    """Make a triangle of three sites, counter-clockwise, which begins with half-edge h."""
    one = succ(h)
    two = succ(one)
    s.org[h] = a
    s.org[one] = b
    s.org[two] = c
    s.first[a] = h
    s.first[b] = one
    s.first[c] = two


@hook
def move(s: State, h: int, to: int) -> None:
    """Give another half-edge the twin and the tick of one."""
    join(s, to, int(s.twin[h]))
    s.due[to] = s.due[h]


@hook
def flip(s: State, h: int) -> None:
    """Turn an edge within its two triangles: from a to b, with c on the left and d on the right, it becomes
    that from d to c, with a on the left and b on the right."""
    g = int(s.twin[h])
    a = s.org[h]
    b = s.org[g]
    c = s.org[pred(h)]
    d = s.org[pred(g)]
    bc, ca, ad, db = succ(h), pred(h), succ(g), pred(g)
    beyond_bc = int(s.twin[bc])
    due_bc = s.due[bc]
    lay(s, h, d, c, a)
    lay(s, g, c, d, b)
    move(s, ca, bc)
    move(s, ad, ca)
    move(s, db, ad)
    join(s, db, beyond_bc)
    s.due[db] = due_bc
    s.due[h] = NEVER
    s.due[g] = NEVER


@hook
def taken(s: State) -> int:
    """Return the first half-edge of a triangle that was not used."""
    t = int(s.heads[0])
    s.heads[0] = s.twin[4 * t]
    return 4 * t


@hook
def given_back(s: State, h: int) -> None:
    """Note that the triangle of a half-edge is not used any more."""
    t = h >> 2
    for each in range(4 * t, 4 * t + 3):
        s.org[each] = NOBODY
        s.due[each] = NEVER
    s.twin[4 * t] = s.heads[0]
    s.heads[0] = t


@hook
def split(s: State, t: int, body: int) -> None:
    """Divide a triangle into three, with a body in their middle."""
    h = 4 * t
    f = taken(s)
    g = taken(s)
    a = s.org[h]
    b = s.org[h + 1]
    c = s.org[h + 2]
    lay(s, f, b, c, body)
    lay(s, g, c, a, body)
    lay(s, h, a, b, body)
    move(s, h + 1, f)
    move(s, h + 2, g)
    s.due[h + 1] = NEVER
    s.due[h + 2] = NEVER
    join(s, h + 1, f + 2)
    join(s, f + 1, g + 2)
    join(s, g + 1, h + 2)


@hook
def merge(s: State, h: int) -> None:
    """Make one triangle of the three around the body at which a half-edge begins."""
    two = around(s, h)
    three = around(s, two)
    a = s.org[succ(h)]
    b = s.org[succ(two)]
    c = s.org[succ(three)]
    move(s, succ(three), h)
    move(s, succ(two), pred(h))
    given_back(s, two)
    given_back(s, three)
    lay(s, h, c, a, b)
    s.heads[1] = h >> 2


@hook
def start(s: State) -> None:
    """Make the square of the far points, in two triangles, with all others not used."""
    n = slots(s)
    for t in range(len(s.org) >> 2):
        s.heads[0] = t + 1
        given_back(s, 4 * t)
        s.twin[4 * t] = t + 1
    lay(s, 0, n, n + 1, n + 2)
    lay(s, 4, n, n + 2, n + 3)
    for h in range(7):
        s.twin[h] = NOBODY
    join(s, 2, 4)
    s.heads[0] = 2
    s.heads[1] = 0


@hook
def enlist(s: State, count: int, h: int) -> int:
    """Add the edge of a half-edge to those to be watched; return how many there are then."""
    own = owned(s, h)
    s.listed[count] = own
    return count + 1 if own >= 0 else count


@hook
def enlist_around(s: State, body: int) -> int:
    """List the edges of which a body is an end or opposite to, to be watched; return how many there are."""
    count = 0
    begin = int(s.first[body])
    h = begin
    for _ in range(len(s.first)):
        count = enlist(s, count, h)
        count = enlist(s, count, succ(h))
        h = around(s, h)
        if h == begin:
            break
    return count


@hook
def offer_edge(k: Kernel, s: State, h: int) -> None:
    """Offer the two ends of an edge that is new, if they are bodies."""
    n = slots(s)
    a = s.org[h]
    b = s.org[succ(h)]
    if a < n and b < n:
        offer(k, a, b)
