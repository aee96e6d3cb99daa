"""Sweep-tiling: the thesis's contribution (section 4), with what it leaves open or gets wrong repaired.

Sweep-and-prune keeps the order of all bounds, however far apart they are. Sweep-tiling draws each bound only
as far as it can be seen, from its body up and down to the next ones, and so cuts the free space into 3n + 1
tiles (``web``). A tile says two things: its left bound is left of its right bound, and the body on its top
does not touch the one on its bottom (thesis, figure 13). The first is a certificate of the tile, the second
makes a candidate pair of the two bodies. Bodies that hide each other from view need no certificate about each
other, and that is the gain: O(n) pairs, at most 3n - 6 of them between bodies, and only such bounds pass each
other as are in sight.

Two bodies that touch have been in sight of each other before, so their pair is there (docs/sweep-tiling.md
has the proof, and what the thesis's text has wrong). It holds only while bodies do not pass through each
other: then what was hidden could come out unseen.

Rooms: ``web`` what is stored; ``construction`` the first tiling, by a sweep line; ``events`` what happens
    when a tile collapses; ``audit`` every invariant, slowly. This file has the certificates. A body owns the
    three tiles at its left ports and has one certificate in the queue, for the first of them to fail.
"""

from __future__ import annotations

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    BroadPhaseParts,
    Kernel,
    Records,
    falls,
    hook,
    offer,
    schedule,
)

from .audit import audit
from .construction import arrange, construct
from .events import Change, flip, meeting, parting, passing
from .walk import near
from .web import (
    LOWER,
    OUTER,
    UPPER,
    State,
    body_of,
    bound_of,
    due_of,
    empty,
    facing,
    fails_by_order,
    is_inner,
    is_right_bound,
    left_bound,
    own_tile,
    port,
    right_bound,
    set_due,
    side_of,
)

__all__ = ["SweepTiling"]


@hook
def reach_to(body: Records, p: int) -> float:
    """How far right of a body's centre the bound of its port ``p`` is."""
    return float(body.reach if is_right_bound(p) else -body.reach)


@hook
def watch(k: Kernel, s: State, p: int) -> None:
    """Work out when the tile at left port ``p`` fails: by its width, or a corner by its vertical order."""
    q = facing(s, p)
    a = body_of(p)
    b = body_of(q)
    n = len(s.level)
    if a == n:
        return
    tick = NEVER
    by_order = 0
    if b != n and b != a:
        left = k.bodies[a]
        right = k.bodies[b]
        since = max(left.anchor, right.anchor)
        unit = k.clock[0].tick
        left_time = (since - left.anchor) * unit
        right_time = (since - right.anchor) * unit
        left_edge = left.x + left.vx * left_time + reach_to(left, p)
        right_edge = right.x + right.vx * right_time + reach_to(right, q)
        width = right_edge - left_edge
        rate = right.vx - left.vx
        tick = falls(k, since, width, rate)
        if is_inner(p) and is_inner(q):
            rise = (right.y + right.vy * right_time) - (left.y + left.vy * left_time)
            climb = right.vy - left.vy
            if side_of(p) == LOWER:  # the left body is the upper one
                rise = -rise
                climb = -climb
            if climb < 0.0:
                then = width * -climb + rate * rise  # the width when they are level, times -climb
                if s.limits[0] * climb <= then <= s.limits[1] * -climb:
                    level = falls(k, since, rise, climb)
                    if level < tick:
                        tick = level
                        by_order = 1
    set_due(s, p, tick, by_order)


@hook
def settle(k: Kernel, s: State, body: int) -> None:
    """Queue a body's certificate for the first of its three tiles to fail."""
    if body < len(s.level):
        schedule(k, body, min(due_of(s, body, OUTER), min(due_of(s, body, UPPER), due_of(s, body, LOWER))))


@hook
def first_to_fail(s: State, body: int) -> int:
    """Which of the three tiles that a body owns fails first."""
    which = OUTER
    if due_of(s, body, UPPER) < due_of(s, body, which):
        which = UPPER
    if due_of(s, body, LOWER) < due_of(s, body, which):
        which = LOWER
    return own_tile(body, which)


@hook
def tile_around(s: State, body: int, which: int) -> int:
    """One of the six tiles at a body's ports: the three that it owns, then those at its right ports."""
    if which < 3:
        return own_tile(body, which)
    if which == 3:
        return facing(s, port(left_bound(body), OUTER))
    return facing(s, port(right_bound(body), UPPER if which == 4 else LOWER))


@hook
def build(k: Kernel, s: State) -> None:
    """Construct the tiling and watch its tiles."""
    construct(k, s)
    for body in range(len(s.level)):
        for which in range(3):
            watch(k, s, own_tile(body, which))
        settle(k, s, body)


@hook
def collapse(k: Kernel, s: State, p: int, q: int) -> Change:
    """Relink after the width of the tile between left port ``p`` and right port ``q`` has become zero."""
    if not is_inner(p) and not is_inner(q):
        return meeting(k, s, bound_of(p), bound_of(q))
    if is_inner(p) and is_inner(q):
        return parting(s, bound_of(q), bound_of(p), side_of(q))
    inner, outer = (p, q) if is_inner(p) else (q, p)
    return passing(s, bound_of(inner), bound_of(outer), side_of(inner))


@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """The first of a body's three tiles fails: see how, relink, watch what is new; name who comes in sight."""
    p = first_to_fail(s, body)
    q = facing(s, p)
    if fails_by_order(s, p):
        flip(s, bound_of(q), bound_of(p), side_of(q))
        for turn in range(12):  # all tiles of both bodies
            tile = tile_around(s, body_of(p) if turn < 6 else body_of(q), turn % 6)
            watch(k, s, tile)
            settle(k, s, body_of(tile))
    else:
        change = collapse(k, s, p, q)
        for tile in change.tiles:
            watch(k, s, tile)
            settle(k, s, body_of(tile))
        one = change.come.one
        other = change.come.other
        if one < len(s.level) and other < len(s.level):
            if one != body and other != body:
                offer(k, one, other)
            else:
                k.near[0] = other if one == body else one
                return 1
    return 0


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: watch the six tiles at its ports."""
    for which in range(6):
        tile = tile_around(s, body, which)
        watch(k, s, tile)
        if which > 1:
            settle(k, s, body_of(tile))


class SweepTiling:
    """Sweep-tiling: the free space in tiles, candidate pairs of bodies that see each other."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Return the parts; refuse a scene without an arena.

        Beside a contact of two bodies a third's bound is at least .41 r^2 / R away, for radii from r to R; a
        skin of at most an eighth of r^2 / R cannot hide the contact from sight (docs/sweep-tiling.md).
        """
        if scene.arena is None:
            raise Refused(
                "sweep-tiling tiles an arena, and this scene has none: "
                "give the scene an arena, or choose sap-1d, sap-2d or naive"
            )
        n = len(scene)
        radius = scene.radius
        state = empty(n)
        return BroadPhaseParts(
            near=near,
            state=state,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=replan,
            audit=audit,
            ticks=(state.due,),
            solid=True,
            skin_limit=float(radius.min() / (8.0 * radius.max()) * radius.min()) if n else None,
            room=3 * n + 1,
        )
