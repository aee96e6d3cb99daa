"""Changes of the triangulation: flip of an edge, insertion and removal of a body, and the first
triangulation.

No site of disjoint discs is ever hidden (docs/cells.md), so the triangles that a moving triangulation needs
are always there: an edge that fails flips, and that is all. A body is inserted into the triangle in which its
centre lies, which it divides in three; then the edges around it flip that fail. A removal is the reverse: its
edges flip in the order in which they would if its point was raised over the lifted surface, until three are
left.
"""

from __future__ import annotations

from kinetile.toolbox import NEVER, Kernel, hook, unchecked

from .certificates import fails, settle, spot, sunk, turn, watch
from .web import (
    PER_LENGTH,
    State,
    around,
    enlist,
    enlist_around,
    flip,
    merge,
    offer_edge,
    owned,
    pred,
    split,
    start,
    succ,
)


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """An edge of a body fails, or has come to its bound: it flips, or is watched again."""
    h = int(s.first[body])
    for _ in range(len(s.first)):
        if s.due[h] == s.soonest[body]:
            break
        h = around(s, h)
    flips = fails(k, s, h)
    count = 0
    if flips:
        flip(s, h)
        offer_edge(k, s, h)
        count = enlist(s, count, succ(h))
        count = enlist(s, count, pred(h))
        count = enlist(s, count, succ(s.twin[h]))
        count = enlist(s, count, pred(s.twin[h]))
    count = enlist(s, count, h)
    watch(k, s, count)
    settle(k, s, body)
    return 0


@unchecked
@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """Watch all edges that depend on a body's plan."""
    watch(k, s, enlist_around(s, body))


@hook
def locate(k: Kernel, s: State, body: int) -> int:
    """Return the triangle in which a body's centre is: by a walk, and if that does not end the one in which
    it lies deepest."""
    x = spot(k, s, body)
    t = int(s.heads[1])
    for _ in range(len(s.org)):
        beyond = -1
        for h in range(4 * t, 4 * t + 3):
            if s.twin[h] >= 0 and turn(spot(k, s, s.org[h]), spot(k, s, s.org[succ(h)]), x) < 0.0:
                beyond = s.twin[h] >> 2
        if beyond < 0:
            return t
        t = beyond
    deepest = -1.0e300
    for other in range(len(s.org) >> 2):
        if s.org[4 * other] >= 0:
            least = 1.0e300
            for h in range(4 * other, 4 * other + 3):
                room = turn(spot(k, s, s.org[h]), spot(k, s, s.org[succ(h)]), x)
                least = room if room < least else least
            if least > deepest:
                deepest = least
                t = other
    return t


@hook
def insert(k: Kernel, s: State, body: int) -> None:
    """Take a body into the triangulation; nothing is watched yet."""
    split(s, locate(k, s, body), body)
    x = spot(k, s, body)
    h = int(s.first[body])
    left = 3
    for _ in range(len(s.org)):
        e = succ(h)
        g = int(s.twin[e])
        flips = False
        if g >= 0:
            a = spot(k, s, s.org[e])
            b = spot(k, s, s.org[g])
            flips = sunk(x, b, a, spot(k, s, s.org[pred(g)]), 1.0) > 0.0
        if flips:
            flip(s, e)
            h = succ(e)
            left += 2
        else:
            h = around(s, h)
            left -= 1
        if left == 0:
            break
    s.heads[1] = h >> 2


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Triangulate by insertion, and watch all edges."""
    start(s)
    for i in range(k.clock[0].bodies):
        s.soonest[i] = NEVER
    for i in range(k.clock[0].bodies):
        insert(k, s, int(s.order[i]))
    count = 0
    end = len(s.org)
    for h in range(end):
        if s.org[h] >= 0 and owned(s, h) == h:
            s.listed[count] = h
            count += 1
        if count == 8 or (h == end - 1 and count > 0):
            watch(k, s, count)
            count = 0


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """Insert a body."""
    s.soonest[body] = NEVER
    s.weight[body] = (s.scale[PER_LENGTH] * k.bodies[body].reach) ** 2
    insert(k, s, body)
    watch_anew(k, s, enlist_around(s, body))


@hook
def watch_anew(k: Kernel, s: State, count: int) -> None:
    """Watch the edges that are listed, of which some are others than before, and queue their ends."""
    watch(k, s, count)
    for i in range(count):
        settle(k, s, s.org[s.listed[i]])
        settle(k, s, s.org[s.twin[s.listed[i]]])


@hook
def next_to_flip(k: Kernel, s: State, body: int) -> int:
    """Return the edge of a body that flips first if its point is raised over the lifted surface."""
    o = spot(k, s, body)
    h = int(s.first[body])
    best = h
    least = 1.0e300
    begin = h
    for _ in range(len(s.first)):
        u = spot(k, s, s.org[pred(s.twin[h])])
        v = spot(k, s, s.org[succ(h)])
        w = spot(k, s, s.org[pred(h)])
        area = turn(u, v, w)
        depth = sunk(o, u, v, w, 0.0)
        if area > 0.0 and depth < least * area:
            least = depth / area
            best = h
        h = around(s, h)
        if h == begin:
            break
    return best


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """Remove a body."""
    count = 0
    begin = int(s.first[body])
    h = begin
    degree = 0
    for _ in range(len(s.first)):
        s.listed[count] = s.twin[succ(h)]
        count += 1 if s.listed[count] >= 0 else 0
        degree += 1
        h = around(s, h)
        if h == begin:
            break
    while degree > 3:
        h = next_to_flip(k, s, body)
        g = s.twin[h]
        flip(s, h)
        offer_edge(k, s, g)
        s.listed[count] = g
        count += 1
        degree -= 1
    merge(s, int(s.first[body]))
    links = count
    count = 0
    for i in range(links):
        count = enlist(s, count, s.listed[i])
    s.soonest[body] = NEVER
    watch_anew(k, s, count)
