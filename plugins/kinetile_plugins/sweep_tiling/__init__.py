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
    add_pair,
    falls,
    hook,
    remove_pair,
    schedule,
)

from .audit import audit
from .construction import arrange, construct
from .events import flip, meeting, parting, passing
from .web import FLIPS, LOWER, OUTER, UPPER, State, empty

__all__ = ["SweepTiling"]

L_OUTER, R_OUTER, R_UPPER = 0, 8, 9
"""Ports of a body, counted from 16 * body."""

@hook
def watch(k: Kernel, s: State, p: int) -> None:
    """Work out when the tile at left port ``p`` fails: by its width, or a corner by its vertical order."""
    q = s.web[p]
    a = p >> 4
    b = q >> 4
    n = len(s.level)
    if a == n:
        return
    tick = NEVER
    flips = 0
    if b != n and b != a:
        left = k.bodies[a]
        right = k.bodies[b]
        since = max(left.anchor, right.anchor)
        unit = k.clock[0].tick
        left_time = (since - left.anchor) * unit
        right_time = (since - right.anchor) * unit
        left_reach = left.reach if p & 8 else -left.reach
        right_reach = right.reach if q & 8 else -right.reach
        width = (right.x + right.vx * right_time + right_reach) - (left.x + left.vx * left_time + left_reach)
        rate = right.vx - left.vx
        tick = falls(k, since, width, rate)
        if p & 7 != OUTER and q & 7 != OUTER:
            rise = (right.y + right.vy * right_time) - (left.y + left.vy * left_time)
            climb = right.vy - left.vy
            if p & 7 == LOWER:  # the left body is the upper one
                rise = -rise
                climb = -climb
            if climb < 0.0:
                then = width * -climb + rate * rise  # the width when they are level, times -climb
                if s.limits[0] * climb <= then <= s.limits[1] * -climb:
                    level = falls(k, since, rise, climb)
                    if level < tick:
                        tick = level
                        flips = 1
    slot = p & 3
    s.due[4 * a + slot] = tick
    s.web[16 * a + FLIPS] = (s.web[16 * a + FLIPS] & ~(1 << slot)) | (flips << slot)


@hook
def settle(k: Kernel, s: State, body: int) -> None:
    """Queue a body's certificate for the first of its three tiles to fail."""
    if body < len(s.level):
        schedule(k, body, min(s.due[4 * body], min(s.due[4 * body + 1], s.due[4 * body + 2])))


@hook
def hold(k: Kernel, s: State, a: int, b: int) -> None:
    """Two bodies bound a tile from above and below: a candidate pair, unless one of them is TOP or BOTTOM."""
    if a < len(s.level) and b < len(s.level):
        add_pair(k, a, b)


@hook
def tile_of(s: State, body: int, which: int) -> int:
    """Return the left port of one of the six tiles at a body's ports: 0 to 2 are those that the body owns."""
    if which < 3:
        return 16 * body + (R_OUTER if which == 0 else which)
    return int(s.web[16 * body + (L_OUTER if which == 3 else R_UPPER + which - 4)])


@hook
def build(k: Kernel, s: State) -> None:
    """Construct the tiling, watch its tiles, and make their tops and bottoms candidate pairs."""
    construct(k, s)
    for body in range(len(s.level)):
        for slot in range(3):
            watch(k, s, tile_of(s, body, slot))
            top = body if slot == LOWER else s.web[16 * body + (12 if slot == 0 else 4) + UPPER]
            bottom = body if slot == UPPER else s.web[16 * body + (12 if slot == 0 else 4) + LOWER]
            hold(k, s, top, bottom)
        settle(k, s, body)


@hook
def repair(k: Kernel, s: State, body: int) -> None:
    """The first of a body's three tiles fails: see which, see how, relink, and watch the new tiles."""
    due = s.due
    slot = 0
    if due[4 * body + 1] < due[4 * body + slot]:
        slot = 1
    if due[4 * body + 2] < due[4 * body + slot]:
        slot = 2
    p = 16 * body + (R_OUTER if slot == 0 else slot)
    q = int(s.web[p])
    left = p & 7
    right = q & 7
    one = two = three = 0
    gone = going = come = coming = len(s.level)
    count = 3
    if s.web[16 * body + FLIPS] >> slot & 1:
        flip(s, p - left, q - right, right)
        count = 12  # all tiles of both bodies
    elif left == OUTER and right == OUTER:
        one, two, three, gone, going, come, coming = meeting(k, s, p, q)
    elif left == OUTER or right == OUTER:
        inner, outer, side = (q - right, p, right) if left == OUTER else (p - left, q, left)
        one, two, three, gone, going, come, coming = passing(s, inner, outer, side)
    else:
        one, two, three, gone, going, come, coming = parting(s, p - left, q - right, right)
    if gone < len(s.level) and going < len(s.level):
        remove_pair(k, gone, going)
    hold(k, s, come, coming)
    for turn in range(count):
        if count == 3:
            tile = one if turn == 0 else two if turn == 1 else three
        else:
            tile = tile_of(s, p >> 4 if turn < 6 else q >> 4, turn % 6)
        watch(k, s, tile)
        settle(k, s, tile >> 4)


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: watch the six tiles at its ports."""
    for which in range(6):
        tile = tile_of(s, body, which)
        watch(k, s, tile)
        if which > 1:
            settle(k, s, tile >> 4)


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
            state=state,
            certificates=n,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=replan,
            audit=audit,
            ticks=(state.due,),
            solid=True,
            skin_limit=float(radius.min() / (8.0 * radius.max()) * radius.min()) if n else None,
            pairs=3 * n + 8,
        )
