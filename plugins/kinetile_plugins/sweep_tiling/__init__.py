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
from kinetile.kernel.vectors import eight, lane, spread_whole
from kinetile.scene import Scene
from kinetile.toolbox import (
    BroadPhaseParts,
    Kernel,
    hook,
    offer,
    schedule,
    smaller,
)

from .audit import audit
from .construction import arrange, construct
from .events import Change, Tile, flip, meeting, parting, passing
from .walk import near
from .watch import chosen, failures, sides, swapped
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
    left_bound,
    own_tile,
    port,
    right_bound,
    set_due,
    side_of,
)

__all__ = ["SweepTiling"]


@hook
def settle(k: Kernel, s: State, body: int) -> None:
    """Schedule a body's certificate for the first of its three tiles to fail."""
    first = smaller(due_of(s, body, OUTER), smaller(due_of(s, body, UPPER), due_of(s, body, LOWER)))
    schedule(k, body, first)


@hook
def first_to_fail(s: State, body: int) -> Tile:
    """Which of the three tiles that a body owns fails first."""
    outer = own_tile(body, OUTER)
    upper = own_tile(body, UPPER)
    lower = own_tile(body, LOWER)
    p, q, due = outer, facing(s, outer), due_of(s, body, OUTER)
    other = facing(s, upper)
    sooner = due_of(s, body, UPPER) < due
    p, q, due = upper if sooner else p, other if sooner else q, due_of(s, body, UPPER) if sooner else due
    other = facing(s, lower)
    sooner = due_of(s, body, LOWER) < due
    return Tile(lower if sooner else p, other if sooner else q)


@hook
def watch_around(k: Kernel, s: State, body: int) -> None:
    """Watch the six tiles at a body's ports: the three that it owns, and those at its right ports."""
    outer = own_tile(body, OUTER)
    upper = own_tile(body, UPPER)
    lower = own_tile(body, LOWER)
    before = port(left_bound(body), OUTER)
    over_it = port(right_bound(body), UPPER)
    under_it = port(right_bound(body), LOWER)
    first = facing(s, before)
    second = facing(s, over_it)
    third = facing(s, under_it)
    own = sides(k, outer, upper, lower, lower, before, over_it, under_it, under_it)
    fourth = facing(s, outer)
    fifth = facing(s, upper)
    sixth = facing(s, lower)
    far = sides(k, fourth, fifth, sixth, sixth, first, second, third, third)
    mine = eight(1, 1, 1, 0, 0, 0, 0, 0) > spread_whole(0)
    asked = eight(1, 1, 1, 0, 1, 1, 1, 0) > spread_whole(0)
    tick, by_order = failures(k, s, chosen(mine, own, far), chosen(mine, far, own), asked)
    set_due(s, outer, lane(tick, 0), lane(by_order, 0))
    set_due(s, upper, lane(tick, 1), lane(by_order, 1))
    set_due(s, lower, lane(tick, 2), lane(by_order, 2))
    set_due(s, first, lane(tick, 4), lane(by_order, 4))
    set_due(s, second, lane(tick, 5), lane(by_order, 5))
    set_due(s, third, lane(tick, 6), lane(by_order, 6))
    if body_of(first) < len(s.level):  # it may be the left edge
        settle(k, s, body_of(first))
    settle(k, s, body_of(second))
    settle(k, s, body_of(third))
    settle(k, s, body)


@hook
def build(k: Kernel, s: State) -> None:
    """Construct the tiling and watch its tiles."""
    construct(k, s)
    for body in range(len(s.level)):
        watch_around(k, s, body)


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
    """The first of a body's three tiles fails: relink, watch what is new, name who came into sight."""
    n = len(s.level)
    p, q = first_to_fail(s, body)
    if fails_by_order(s, p):
        flip(s, bound_of(q), bound_of(p), side_of(q))
        for turn in range(2):
            watch_around(k, s, body if turn == 0 else body_of(q))
        return 0
    change = collapse(k, s, p, q)
    one, two, three = change.tiles
    left = sides(
        k, one.left, two.left, three.left, three.left, one.right, two.right, three.right, three.right
    )
    asked = eight(1, 1, 1, 0, 0, 0, 0, 0) > spread_whole(0)
    tick, by_order = failures(k, s, left, swapped(left), asked)
    set_due(s, one.left, lane(tick, 0), lane(by_order, 0))
    set_due(s, two.left, lane(tick, 1), lane(by_order, 1))
    set_due(s, three.left, lane(tick, 2), lane(by_order, 2))
    if body_of(one.left) < n:  # it may be the left edge
        settle(k, s, body_of(one.left))
    settle(k, s, body_of(two.left))
    settle(k, s, body_of(three.left))
    above = change.come.one
    below = change.come.other
    if above >= n or below >= n:
        return 0
    if above != body and below != body:
        offer(k, above, below)
        return 0
    k.near[0] = below if above == body else above
    return 1


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """A body's plan changed: watch the six tiles at its ports."""
    watch_around(k, s, body)


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
                "give the scene an arena, or choose cells, sap-1d, sap-2d or naive"
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
