"""Sweep-tiling: the thesis's contribution (section 4), with its gaps and errors repaired.

Sweep-and-prune keeps the order of all bounds, at any distance. Sweep-tiling draws each bound only as far as
it is visible, from its body up and down to the next bodies, so only bounds in sight of each other pass each
other. docs/sweep-tiling.md describes the tiling and its events, proves that the pair of two touching bodies
is present, and lists the errors of the thesis's text. The proof holds only while bodies do not pass through
each other: otherwise a hidden body could appear without an event.

Files: ``web`` the stored structure; ``construction`` the first tiling, by a sweep line; ``events`` changes at
a collapse, an insertion or a removal; ``certificates`` the ticks of failing tiles; ``audit`` every
invariant, slowly. This file has the hooks that the kernel calls, and the drawing.

Why a skin delta of at most r^2 / 8R hides no contact, for radii from r to R and n discs (docs/one-answer.md
defines rho, V and q):

*A third body stays away.* Let discs a and b touch at p. Let c be a disc that touches neither, its centre not
higher than the centre of a and not lower than the centre of b. Then both extreme points of c are at least
(sqrt(2) - 1) r^2 / R from p on the x axis. Put p at the origin, c to its right with its centre at (x, y), and
take y >= 0; otherwise exchange up and down. Let h be the height of a's centre above c's, A the distance of
a's centre left of p (A <= 0 if it is right of p), and m = r_a r_b / (r_a + r_b), which is at least r / 2.

1. By Stewart's theorem, with |ac| >= r_a + r_c and |bc| >= r_b + r_c: x^2 + y^2 >= r_c^2 + 4 m r_c.
2. If y^2 <= 2 m r_c, then x - r_c >= sqrt(r_c^2 + 2 m r_c) - r_c. The right side grows with r_c and m, so it
   is at least (sqrt(2) - 1) r.
3. Else consider a alone: x >= sqrt((r_a + r_c)^2 - h^2) - A. If A <= 0, then h^2 <= r_a^2 - A^2, so x - r_c
   is at least sqrt(r_c^2 + 2 r_a r_c) - r_c >= (sqrt(3) - 1) r.
4. If A > 0: h is at most sqrt(r_a^2 - A^2) - y, so h^2 <= r_a^2 - A^2 - y^2. The square of the root is then
   larger than (A + r_c)^2 by at least 2 r_c (r_a - A) + y^2. As r_a - A >= y^2 / 2 r_a, this is at least
   y^2 (1 + r_c / r_a). With y^2 > 2 m r_c and M = r_a + r_c it is more than 2 r_c M r_b / (r_a + r_b). Since
   A + r_c <= M, x - r_c >= sqrt(M^2 + 2 r_c M r_b / (r_a + r_b)) - M. The right side grows with M, r_c and
   r_b; for r_b = r_c = r it is at least .89 r^2 / (r_a + r) >= .44 r^2 / R.

*Rounding.* When a contact is the next event, no tile is narrower than -3 rho at the end of its tick. The
tiles, as edges from left bound to right bound, and L(b) before R(b), have no circle. So there are abscissae,
each from 0 to 6 n rho above the true one at that moment, with all bounds in order, and the structure is
exactly the tiling of these abscissae. In them the enlarged bodies a and b still overlap, since 6 n rho is
less than two skins: at p, or, if only the moved bound is in the way, up to 6 n rho - delta right of p. So a
and b have a tile there, unless a bound of a third body c, between them in height, is as near to p: enlarged
by delta and moved by up to 6 n rho. As delta is more than 4 n rho, this bound is nearer than 2.5 delta.

*So 2.5 delta has to be less than .41 r^2 / R*, with room for errors. At the contact's tick discs overlap by
the rounding of anchors, which takes 10 rho. The gap of a and b is up to 2 V q. At the end of the tick each
has flown V q further. Shrinking all discs until they are disjoint, and a and b touch, costs 34 rho + 4 V q of
the distance, and the flight 2 V q. delta <= r^2 / 8R leaves .10 r^2 / R, that is .81 delta, for all of it,
besides the surplus of 24 rho + 6 V q in 2.5 delta: enough from three discs on.
"""

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
    reaches_of,
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
    """Constructs the tiling and watches its tiles."""
    construct(k, s)
    for body in range(k.clock[0].bodies):
        watch_around(k, s, body)


@unchecked
@hook
def repair(k: Kernel, s: State, body: int) -> int:
    """Repairs the first tile of a body to fail: relinks, watches new tiles, names the body in sight."""
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
        """Returns the parts; refuses a scene that is periodic along y, or with other shapes than discs and
        level capsules.

        At a contact of two bodies the bounds of any third body are at least .41 r^2 / R away, for radii from
        r to R. A skin of at most an eighth of r^2 / R cannot hide the contact from sight (proof: above).
        Grazing shapes may overlap by 2^-38 of their size; the limit leaves room for that.
        """
        if "y" in scene.periodic:
            raise Refused(
                "sweep-tiling tiles an arena from its floor to its ceiling, and this scene is periodic along "
                f"{scene.periodic}: it takes periodic='x' alone"
            )
        level = all(
            shape.radius > 0.0 and len(shape.core) < 3 and not any(y for _, y in shape.core)
            for shape in scene.shapes
        )
        if not level:
            raise Refused(
                "sweep-tiling is for discs, and for capsules that lie level at the height of their position, "
                "and this scene has other shapes: where sides are flush, a third body can hide a contact "
                "from it (docs/sweep-tiling.md, Other shapes)"
            )
        n = len(scene)
        radius = np.array([shape.radius for shape in scene.shapes] or scene.radius)
        longest = float(scene.radius.max(initial=0.0)) if scene.shapes else 0.0
        thickest = (
            float(radius.min() / (8.0 * radius.max()) * radius.min() - 2.0**-29 * longest) if n else None
        )
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
            drawn_as="" if scene.arena is None or scene.shapes else "tiling",
            ticks=(state.due,),
            solid=True,
            outlines=True,
            skin_limit=thickest,
            room=3 * scene.capacity + 1,
            periodic=True,
        )


# In the tiling a disc is the line from its leftmost to its rightmost point. A bound leads up and down from
# there to the lines of the next bodies, and a tile is a rectangle between two bounds and two such lines. With
# the discs drawn over them, tiles seem to end at the discs. So tiles are attached to bodies, at most four
# each, and move with them between events; they cover the arena, and no two of them overlap (thesis, figures
# 12 and 13). No certificate reads the arena's edges, so in the open plane they are at any distance: in a
# drawing, around the bodies.


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yields tiles, each with its tick of failure; bounds; and the pairs with a tile between them."""
    n = len(s.level)
    bodies = np.flatnonzero(k.queue.number >= 0).tolist()
    pairs = set()
    due, flips = s.due.tolist(), s.web[FLIPS:].tolist()
    (west, floor), (east, ceiling) = _edges(k, bodies)
    reach = reaches_of(k)[:n, :2] * (-1.0, 1.0)
    across: list[Coordinate] = [At(body, x) for body, sides in enumerate(reach.tolist()) for x in sides]
    across += [east, west]
    height: list[Coordinate] = [*map(At, range(n)), ceiling, floor]
    period = float(k.clock[0].torus.x)
    for p, q, top, bottom, away in zip(*(column.tolist() for column in tiles_of(k, s)[:5]), strict=True):
        owner = p >> 4
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


def _edges(k: Kernel, bodies: list[int]) -> list[list[float]]:
    """Returns the lowest and the highest corner of the tiling: the arena, or a box around the bodies."""
    limits = k.clock[0].limits
    if limits.width or not bodies:
        return [[0.0, 0.0], [float(limits.width), float(limits.height)]]
    places, reach = positions_now(k)[bodies], 2.0 * k.bodies.reach[bodies].max()
    return [(places.min(axis=0) - reach).tolist(), (places.max(axis=0) + reach).tolist()]
