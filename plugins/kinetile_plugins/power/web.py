"""The triangulation: the stored structure of ``power``, and the changes that keep it a triangulation.

Its vertices are the *sites*: the bodies, by their slots, and behind them four fixed points far outside of the
arena, whose square is the hull. A triangle has three half-edges, from site to site with the triangle on the
left. The half-edges of triangle t are 4t, 4t + 1 and 4t + 2; the place 4t + 3 is not used. The half-edge on
the other side of an edge is its twin; half-edges of the hull have no twin. There are 2n + 2 triangles.
"""

from typing import NamedTuple

import numpy as np

from kinetile.toolbox import NEVER, NOBODY, Kernel, Records, hook, unchecked

CORNERS = 4
"""Far points."""


class State(NamedTuple):
    """The triangulation of m sites, m - 4 of them slots for bodies, and the certificates of its edges."""

    org: Records  # (8 m,) the site at which a half-edge begins; in an unused triangle, NOBODY
    # (8 m,) the half-edge on the other side, or NOBODY; in an unused triangle, the next unused one
    twin: Records
    due: Records  # (8 m,) the tick of an edge's certificate, at its owner's half-edge; else NEVER
    first: Records  # (m,) a half-edge that begins at a site
    weight: Records  # (m,) the squares of reaches, by the scale; 0 of far points
    far_x: Records  # (m,) the places of far points, by the scale; 0 of bodies
    far_y: Records
    order: Records  # (m,) the bodies in the order of insertion into the first triangulation
    spokes: Records  # (m + 16,) half-edges around a site
    listed: Records  # (3 m + 16,) half-edges to be watched
    # (2 m + 32,) a, b, c and d of eight edges: a to b, with c on the left and d on the right; or the sites
    # around a site, and from the middle on the sites beyond the edges between them
    sites: Records
    plans: Records  # (2 m + 32,) the same, with a body instead of far points
    unused: Records  # (1,) the first unused triangle
    scale: Records  # (3,) see below


PER_LENGTH, UNIT, THETA = range(3)
"""The entries of ``scale``: the factor of lengths, a power of two, which makes the arena's longer side about
1; a unit of the clock in the scene's time; and the depth that a site may be below a plane, by the scale."""


def empty(bodies: int) -> State:
    """Returns the arrays for a number of slots."""
    m = bodies + CORNERS
    return State(
        org=np.zeros(8 * m, dtype=np.int32),
        twin=np.zeros(8 * m, dtype=np.int32),
        due=np.zeros(8 * m, dtype=np.int64),
        first=np.zeros(m, dtype=np.int32),
        weight=np.zeros(m),
        far_x=np.zeros(m),
        far_y=np.zeros(m),
        order=np.zeros(m, dtype=np.int32),
        spokes=np.zeros(m + 16, dtype=np.int32),
        listed=np.zeros(3 * m + 16, dtype=np.int32),
        sites=np.zeros(2 * m + 32, dtype=np.int32),
        plans=np.zeros(2 * m + 32, dtype=np.int32),
        unused=np.zeros(1, dtype=np.int32),
        scale=np.zeros(3),
    )


def start(s: State) -> None:
    """Makes the square of the far points, in two triangles; all other triangles are unused."""
    n = slots(s)
    s.org[:], s.due[:] = NOBODY, NEVER
    s.twin[:] = NOBODY
    s.twin[::4] = np.arange(1, len(s.org) // 4 + 1)
    s.org[:7] = n, n + 1, n + 2, NOBODY, n, n + 2, n + 3
    s.twin[:7] = NOBODY
    s.twin[[2, 4]] = 4, 2
    s.first[n:] = 0, 1, 2, 6
    s.unused[0] = 2


@hook
def slots(s: State) -> int:
    """Returns the number of slots for bodies, which is also the number of the first far point."""
    return len(s.first) - CORNERS


@hook
def succ(h: int) -> int:
    """Returns the next half-edge of a triangle."""
    return h - 2 if h & 3 == 2 else h + 1


@hook
def pred(h: int) -> int:
    """Returns the half-edge of a triangle before another."""
    return h + 2 if h & 3 == 0 else h - 1


@hook
def around(s: State, h: int) -> int:
    """Returns the next half-edge that begins at the site of another, counter-clockwise."""
    return int(s.twin[pred(h)])


@unchecked
@hook
def near(k: Kernel, s: State, body: int) -> int:
    """Names the bodies at the other ends of a body's edges."""
    n = slots(s)
    count = 0
    h = int(s.first[body])
    for _ in range(len(s.first)):
        g = pred(h)
        other = s.org[g]
        k.near[count] = other
        count += 1 if other < n else 0
        h = int(s.twin[g])
        if h == s.first[body]:
            break
    return count


@hook
def join(s: State, h: int, g: int) -> None:
    """Makes two half-edges twins; the second may be NOBODY."""
    s.twin[h] = g
    if g >= 0:
        s.twin[g] = h


@hook
def lay(s: State, h: int, a: int, b: int, c: int) -> None:
    """Makes a triangle of three sites, counter-clockwise, which begins with half-edge h."""
    for each, site in ((h, a), (succ(h), b), (pred(h), c)):
        s.org[each] = site
        s.first[site] = each


@hook
def move(s: State, h: int, to: int) -> None:
    """Moves the twin and the tick of a half-edge to another half-edge."""
    join(s, to, int(s.twin[h]))
    s.due[to] = s.due[h]


@hook
def flip(s: State, h: int) -> None:
    """Turns an edge within its two triangles: the edge from a to b, with c on the left and d on the right,
    becomes the edge from d to c, with a on the left and b on the right."""
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
def split(s: State, t: int, body: int) -> None:
    """Divides a triangle into three, with a body in their middle."""
    h = 4 * t
    f = 4 * int(s.unused[0])
    g = 4 * int(s.twin[f])
    s.unused[0] = s.twin[g]
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
    """Merges the three triangles around the body at the beginning of a half-edge."""
    two = around(s, h)
    three = around(s, two)
    a = s.org[succ(h)]
    b = s.org[succ(two)]
    c = s.org[succ(three)]
    move(s, succ(three), h)
    move(s, succ(two), pred(h))
    for t in (two >> 2, three >> 2):
        for each in range(4 * t, 4 * t + 3):
            s.org[each] = NOBODY
            s.due[each] = NEVER
        s.twin[4 * t] = s.unused[0]
        s.unused[0] = t
    lay(s, h, c, a, b)
