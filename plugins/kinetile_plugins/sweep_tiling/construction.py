"""The static construction: a sweep line from left to right over the bounds (thesis, section 4.2).

docs/sweep-tiling.md describes the step at a bound, and the order of bounds that tie. The bodies on the line
are disjoint, so they are in the order of their centres, and ranks from bottom to top can be assigned
beforehand. A tree of marks over the ranks finds the next body above a rank: two sorts and 4n queries.

On a cylinder the sweep makes three rounds. It begins with no body on the line. After the first round the
bodies across the starting place are on the line; after the second round the tiles across it are open. So the
third round links all ports correctly, whatever the first two linked.
"""

import numpy as np

from kinetile.toolbox import Kernel, hook, positions_now, reaches_of

from .web import (
    COLUMN,
    LOWER,
    OUTER,
    RANK,
    UPPER,
    State,
    body_of,
    bound_of,
    bounds,
    left_bound,
    link,
    port,
    right_bound,
    set_end,
)


def arrange(k: Kernel, s: State) -> None:
    """Sorts bounds and bodies by their positions now; ties by their positions a moment later."""
    bodies = k.bodies
    n = len(bodies)
    place = positions_now(k)
    body = np.repeat(np.arange(n), 2)  # of each bound
    right = np.tile([False, True], n)
    reach = reaches_of(k)
    edge = place[body, 0] + np.where(right, reach[body, 1], -reach[body, 0])
    turn = np.floor(edge * k.clock[0].torus.per_x)  # 0 between walls
    order = np.lexsort((body, ~right, bodies.vx[body], edge - turn * k.clock[0].torus.x))
    s.sweep[: 2 * n] = bounds(n)[order]
    if len(s.turns):
        s.turns[bounds(n)[order] + RANK] = np.arange(2 * n)
        s.turns[bounds(n) + COLUMN] = turn + k.images.kx[body]
    s.at_level[:n] = np.lexsort((np.arange(n), bodies.vy, place[:, 1]))
    s.level[s.at_level[:n]] = np.arange(n)
    limits = k.clock[0].limits
    tie = max(2.0**-46 * max(float(limits.width), float(limits.height)), float(limits.skin))
    widest, least = (2.0**-36 * float(bodies.radius.max()), float(bodies.radius.min())) if n else (0.0, 0.0)
    strip = widest if k.forms.size else 0.0  # more than the overlap of grazing shapes
    s.limits[:] = tie, max(tie, 4.0 * float(limits.skin) + strip, 2.0**-30 * least)


@hook
def mark(s: State, rank: int, present: int) -> None:
    """Marks the body of a rank as on the sweep line (``present`` 1) or not (0)."""
    at = (len(s.status) >> 1) + rank
    s.status[at] = present
    while at > 1:
        at >>= 1
        s.status[at] = s.status[2 * at] | s.status[2 * at + 1]


@hook
def next_to(s: State, rank: int, up: int) -> int:
    """Returns the body next above a rank on the sweep line (``up`` 1), or below it (0); or TOP or BOTTOM."""
    leaves = len(s.status) >> 1
    at = leaves + rank
    while at > 1:
        if at & 1 != up and s.status[at ^ 1]:
            at ^= 1
            while at < leaves:
                at = 2 * at + 1 - up
                if not s.status[at]:
                    at ^= 1
            return int(s.at_level[at - leaves])
        at >>= 1
    return len(s.level) + 1 - up


@hook
def link_in_order(s: State, p: int, q: int) -> None:
    """Links an open left port to the right port of its tile: on a cylinder the first one behind it."""
    turns = 0
    if len(s.turns) > 0:
        one = bound_of(p)
        other = bound_of(q)
        turns = int(s.turns[one + COLUMN] - s.turns[other + COLUMN])
        turns += 1 if s.turns[one + RANK] > s.turns[other + RANK] else 0
    link(s, p, q, turns)


@hook
def construct(k: Kernel, s: State) -> None:
    """Links all ports and sets all ends."""
    n = len(s.level)
    left_edge = right_bound(n)
    right_edge = left_bound(n)
    for edge in (left_edge, right_edge):
        set_end(s, edge, UPPER, n)
        set_end(s, edge, LOWER, n + 1)
    if len(s.turns) > 0:
        for _ in range(3):
            sweep_once(k, s)
    else:
        s.opened[n] = port(left_edge, OUTER)
        sweep_once(k, s)
        link(s, s.opened[n], port(right_edge, OUTER), 0)


@hook
def sweep_once(k: Kernel, s: State) -> None:
    """Moves the sweep line over all bounds."""
    n = len(s.level)
    for at in range(2 * k.clock[0].bodies):
        bound = int(s.sweep[at])
        b = body_of(bound)
        above = next_to(s, s.level[b], 1)
        below = next_to(s, s.level[b], 0)
        set_end(s, bound, UPPER, above)
        set_end(s, bound, LOWER, below)
        gap = min(below, n)
        if bound == left_bound(b):
            link_in_order(s, s.opened[gap], port(bound, OUTER))
            s.opened[gap] = port(bound, LOWER)
            s.opened[b] = port(bound, UPPER)
            mark(s, s.level[b], 1)
        else:
            link_in_order(s, s.opened[gap], port(bound, LOWER))
            link_in_order(s, s.opened[b], port(bound, UPPER))
            s.opened[gap] = port(bound, OUTER)
            mark(s, s.level[b], 0)
