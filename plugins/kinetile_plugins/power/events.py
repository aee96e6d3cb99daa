"""Changes of the triangulation: a failing edge flips, and bodies are inserted and removed.

A body is inserted into the triangle that contains its centre, and divides it into three; then the failing
edges around it flip. A removal is the reverse: the body's edges flip in the same order as if its point was
raised over the lifted surface, until three are left.
"""

from kinetile.toolbox import Kernel, hook, offer, unchecked

from .certificates import enlist, fails, owned, reschedule, ring, spot, sunk, turn, watch, watch_around
from .web import PER_LENGTH, THETA, State, around, flip, merge, pred, slots, split, succ


@hook
def flip_and_offer(k: Kernel, s: State, h: int) -> None:
    """Flips an edge, and offers its two new ends, if they are bodies."""
    flip(s, h)
    if s.org[h] < slots(s) and s.org[s.twin[h]] < slots(s):
        offer(k, s.org[h], s.org[s.twin[h]])


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """Flips an edge of a body at its scheduled tick if it fails; otherwise watches it again."""
    h = int(s.first[body])
    for _ in range(len(s.first)):
        if s.due[h] == k.queue[body].certificate:
            break
        h = around(s, h)
    count = 0
    if fails(k, s, h, 0.5 * s.scale[THETA]):
        flip_and_offer(k, s, h)
        count = enlist(s, count, succ(h))
        count = enlist(s, count, pred(h))
        count = enlist(s, count, succ(s.twin[h]))
        count = enlist(s, count, pred(s.twin[h]))
    count = enlist(s, count, h)
    watch(k, s, count)
    reschedule(k, s, body)
    return 0


@hook
def locate(k: Kernel, s: State, body: int) -> int:
    """Returns the triangle of a body's centre, by a walk; random choices between two ways make it end."""
    x = spot(k, s, body)
    t = int(s.first[slots(s)]) >> 2
    for step in range(len(s.org)):
        beyond = -1
        for i in range(3):
            h = 4 * t + (i + (step * 40503 >> 7)) % 3
            if s.twin[h] >= 0 and turn(spot(k, s, s.org[h]), spot(k, s, s.org[succ(h)]), x) < 0.0:
                beyond = int(s.twin[h]) >> 2
        if beyond < 0:
            break
        t = beyond
    return t


@hook
def insert(k: Kernel, s: State, body: int) -> None:
    """Inserts a body into the triangulation; nothing is watched yet.

    ``left`` counts the edges opposite to the body that may fail: a flip replaces one of them by two.
    """
    split(s, locate(k, s, body), body)
    h = int(s.first[body])
    left = 3
    while left > 0:
        e = succ(h)
        if fails(k, s, e, 0.0):
            flip(s, e)
            h = succ(e)
            left += 1
        else:
            h = around(s, h)
            left -= 1


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Triangulates by insertion, and watches all edges."""
    for i in range(k.clock[0].bodies):
        insert(k, s, int(s.order[i]))
    count = 0
    for h in range(len(s.org)):
        s.listed[count] = h
        count += 1 if s.org[h] >= 0 and owned(s, h) == h else 0
    watch(k, s, count)


@unchecked
@hook
def enter(k: Kernel, s: State, body: int) -> None:
    """Inserts a body."""
    s.weight[body] = (s.scale[PER_LENGTH] * k.bodies[body].reach) ** 2
    insert(k, s, body)
    watch_around(k, s, body)
    for i in range(ring(s, body)):
        reschedule(k, s, s.sites[i])


@unchecked
@hook
def leave(k: Kernel, s: State, body: int) -> None:
    """Removes a body."""
    o = spot(k, s, body)
    degree = ring(s, body)
    links = 0
    for i in range(degree):
        s.listed[links] = s.twin[succ(s.spokes[i])]
        links += 1 if s.listed[links] >= 0 else 0
    for _ in range(degree - 3):
        h = int(s.first[body])
        least = 1.0e300
        for i in range(ring(s, body)):
            e = s.spokes[i]
            u = spot(k, s, s.org[pred(s.twin[e])])
            v = spot(k, s, s.org[succ(e)])
            w = spot(k, s, s.org[pred(e)])
            area = turn(u, v, w)
            depth = sunk(o, u, v, w)
            if area > 0.0 and depth < least * area:
                least = depth / area
                h = e
        g = s.twin[h]
        flip_and_offer(k, s, h)
        s.listed[links] = g
        links += 1
    merge(s, int(s.first[body]))
    count = 0
    for i in range(links):
        count = enlist(s, count, s.listed[i])
    watch(k, s, count)
    for i in range(count):  # some edges have new ends: both ends are queued
        reschedule(k, s, s.org[s.listed[i]])
        reschedule(k, s, s.org[s.twin[s.listed[i]]])
