"""Sweep-tiling: the thesis's contribution (section 4), with its gaps and errors repaired.

Sweep-and-prune keeps the order of all bounds, however far apart they are. Sweep-tiling draws each bound only
as far as it can be seen, from its body up and down to the next ones, and so cuts the free space into 3n + 1
tiles (``web``). A tile states two things: its left bound is left of its right bound, and the body on its top
does not touch the one on its bottom (thesis, figure 13). The first is a certificate of the tile, the second
makes a candidate pair of the two bodies. Bodies that hide each other from view need no certificate about each
other. The gain: O(n) pairs, at most 3n - 6 of them between bodies, and only bounds in sight of each other
pass each other.

Two bodies that touch have been in sight of each other before, so their pair is there (docs/sweep-tiling.md
has the proof, and the errors of the thesis's text). It holds only while bodies do not pass through each
other: otherwise a hidden body could appear without an event.

Files: ``web`` the stored structure; ``construction`` the first tiling, by a sweep line; ``events`` changes at
a collapse, an insertion or a removal; ``certificates`` when tiles fail; ``audit`` every invariant, slowly.
This file has the hooks that the kernel calls, and the drawing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile.toolbox import (
    At,
    Box,
    BroadPhaseParts,
    Coordinate,
    Item,
    Kernel,
    Segment,
    hook,
    offer,
    pair_links,
    positions_now,
    unchecked,
)

from .audit import audit, tiles_of
from .certificates import first_to_fail, watch_around, watch_tiles
from .construction import arrange, construct
from .events import collapse, enter, flip, leave
from .web import (
    ENDS,
    FLIPS,
    LOWER,
    UPPER,
    State,
    body_of,
    bound_of,
    empty,
    fails_by_order,
    near,
    side_of,
    soon,
)


@unchecked
@hook
def build(k: Kernel, s: State) -> None:
    """Construct the tiling and watch its tiles."""
    construct(k, s)
    for body in range(k.clock[0].bodies):
        watch_around(k, s, body)


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """The first of a body's three tiles fails: relink, watch the new tiles, name the body in sight."""
    n = len(s.level)
    p, q = first_to_fail(s, body)
    if fails_by_order(s, p):
        flip(s, bound_of(q), bound_of(p), side_of(q))
        for turn in range(2):
            watch_around(k, s, body if turn == 0 else body_of(q))
        return 0
    change = collapse(k, s, p, q)
    watch_tiles(k, s, change.tiles)
    one = change.come.one
    other = change.come.other
    if one >= n or other >= n:
        return 0
    if one != body:  # then the other is not the body either: see passing
        offer(k, one, other)
        return 0
    k.near[0] = other
    return 1


class SweepTiling:
    """Sweep-tiling: the free space in tiles, candidate pairs of bodies that see each other."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; refuses a scene that is periodic along y, or with other shapes than discs.

        Beside a contact of two bodies a third's bound is at least .41 r^2 / R away, for radii from r to R; a
        skin of at most an eighth of r^2 / R cannot hide the contact from sight (docs/sweep-tiling.md).
        """
        if "y" in scene.periodic:
            raise Refused(
                "sweep-tiling tiles an arena from its floor to its ceiling, and this scene is periodic along "
                f"{scene.periodic}: it takes periodic='x' alone"
            )
        if scene.shapes:
            raise Refused(
                "sweep-tiling is for discs, and this scene has other shapes: where sides are flush, a third "
                "body can hide a contact from it (docs/sweep-tiling.md, Other shapes)"
            )
        n = len(scene)
        radius = scene.radius
        state = empty(scene.capacity, bool(scene.periodic))
        return BroadPhaseParts(
            near=near,
            state=state,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=watch_around,
            enter=enter,
            leave=leave,
            soon=soon,
            audit=audit,
            draw=draw,
            drawn_as="" if scene.arena is None else "tiling",
            ticks=(state.due,),
            solid=True,
            skin_limit=float(radius.min() / (8.0 * radius.max()) * radius.min()) if n else None,
            room=3 * scene.capacity + 1,
            periodic=True,
        )


# To the tiling a disc is the line from its leftmost to its rightmost point. A bound goes up and down from
# there to the lines of the bodies that it meets, and a tile is a rectangle between two bounds and two such
# lines. With the discs drawn over them, tiles seem to end at the discs. So tiles hang on bodies, at most
# four each, and move with them between events; they cover the arena, and no two of them overlap (thesis,
# figures 12 and 13). No certificate asks where the arena's edges are, so in the open plane they are as far
# away as one likes: in a drawing, around the bodies.


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yields tiles, each with the tick at which it fails, bounds, and the pairs of those that have a tile
    between them."""
    n = len(s.level)
    bodies = np.flatnonzero(k.queue.number >= 0).tolist()
    there, pairs = {*bodies, n}, set()
    due, flips = s.due.tolist(), s.web[FLIPS:].tolist()
    (west, floor), (east, ceiling) = _edges(k, bodies)
    across: list[Coordinate] = [*_bounds(k, n), east, west]
    height: list[Coordinate] = [*map(At, range(n)), ceiling, floor]
    period = float(k.clock[0].torus.x)
    for p, q, top, bottom, away in zip(*(column.tolist() for column in tiles_of(k, s)), strict=True):
        owner = p >> 4
        if owner not in there:
            continue
        if top < n and bottom < n:
            pairs.add((top, bottom) if top < bottom else (bottom, top))
        label = "corner" if owner < n and flips[p] else ""
        left, right = across[p >> 3], across[q >> 3]
        if period and isinstance(right, At):
            right = right._replace(turns=round(away / period))
        yield Box("tile", (left, height[bottom]), (right, height[top]), due[4 * owner + (p & 3)], label)
    for body in bodies:
        for bound in (16 * body, 16 * body + 8):
            x = across[bound >> 3]
            low, high = (height[int(s.web[bound + ENDS + side])] for side in (LOWER, UPPER))
            yield Segment("bound", (x, low), (x, high), label="R" if bound & 8 else "L")
    yield from pair_links(pairs)


def _bounds(k: Kernel, n: int) -> Iterator[Coordinate]:
    """Yields where bounds are on the x axis, two a body, L before R."""
    for body, reach in enumerate(k.bodies.reach[:n].tolist()):
        yield At(body, -reach)
        yield At(body, reach)


def _edges(k: Kernel, bodies: list[int]) -> list[list[float]]:
    """Returns the lowest and the highest corner of what is tiled: the arena, or a box around the bodies."""
    limits = k.clock[0].limits
    if limits.width or not bodies:
        return [[0.0, 0.0], [float(limits.width), float(limits.height)]]
    places, reach = positions_now(k)[bodies], 2.0 * k.bodies.reach[bodies].max()
    return [(places.min(axis=0) - reach).tolist(), (places.max(axis=0) + reach).tolist()]
