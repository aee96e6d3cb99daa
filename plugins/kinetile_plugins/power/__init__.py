"""Power: a kinetic regular triangulation, of discs that do not pass through each other.

The weight of a site is the square of its body's reach. The power of a point over a body is the square of its
distance from the centre less that weight, and the regular triangulation has an edge where two bodies share
a border of their regions of least power. Two bodies that touch always share one, and no body is ever without
a region (docs/cells.md has the proofs). So a body is near those to which it has an edge, and all that can
happen is that an edge flips. There are at most 3n + 5 edges and never a parameter; the number of flips for a
contact hardly grows with the number of bodies.

Files: ``web`` the stored structure; ``certificates`` when edges fail; ``events`` flips, insertion, removal;
``audit`` every invariant, slowly. This file has the class, and the drawing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from kinetile.errors import BadOption, Refused
from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    At,
    BroadPhaseParts,
    Item,
    Kernel,
    Point,
    Polygon,
    Segment,
    pair_links,
    positions_now,
)
from kinetile.toolbox.reach import fall_of

from .audit import audit
from .events import build, enter, leave, repair, replan
from .web import PER_LENGTH, UNIT, State, empty, far_points, near, slots, succ

THINNEST = 2.0**-14
"""The smallest radius, by the arena's longer side: rounding may make 2^-39 of a power, and theta, which is
more, is at most 2^-10 of the square of the radius."""

DISTANCE = 2.0
"""How far the far points are from the arena's centre, by its longer side."""


def arrange(k: Kernel, s: State) -> None:
    """Computes scale and weights, and the order in which bodies are inserted."""
    limits, n = k.clock[0].limits, len(k.bodies)
    sides, fall = (float(limits.width), float(limits.height)), k.clock[0].fall
    side = max(sides) + (0.25 * min(sides) if fall.end > fall.origin else 0.0)  # what a frame may fall
    if float(limits.theta) != 2.0**-48 * side:  # that is, if bodies may leave the arena
        raise Refused(
            "power triangulates an arena whose walls keep the bodies in it, and no narrow phase for walls is "
            "named: name one, or choose another broad phase, such as cells"
        )
    s.scale[UNIT] = float(k.clock[0].tick) * 2.0**52
    s.weight[:n] = (s.scale[PER_LENGTH] * k.bodies.reach) ** 2
    s.order[:n] = np.random.default_rng(0).permutation(n)


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yields the triangles between bodies, each with the tick at which the first of its own edges fails, the
    pairs of bodies that have an edge, and the edge that fails first, perhaps to a far point."""
    n = slots(s)
    corners, due = s.org.reshape(-1, 4)[:, :3], s.due.reshape(-1, 4)[:, :3].min(axis=1)
    between = (corners >= 0).all(axis=1) & (corners < n).all(axis=1)
    for sites, tick in zip(corners[between].tolist(), due[between].tolist(), strict=True):
        yield Polygon("tile", tuple((At(site), At(site)) for site in sites), tick)
    h = np.flatnonzero((s.org >= 0) & (s.org < n) & (s.twin >= 0))
    a, b = s.org[h], s.org[s.twin[h]]
    once = (a < b) & (b < n)
    yield from pair_links(zip(a[once].tolist(), b[once].tolist(), strict=True))
    first = int(s.due.argmin())
    if s.due[first] != NEVER:
        far: list[Point] = [(x, y) for x, y in (far_points(s) / s.scale[PER_LENGTH]).tolist()]
        one, two = (
            (At(site), At(site)) if site < n else far[site - n]
            for site in (int(s.org[first]), int(s.org[succ(first)]))
        )
        yield Segment("certificate", one, two, int(s.due[first]))


def draw_cells(k: Kernel, s: State) -> Iterator[Item]:
    """Yields what ``draw`` does, and the sides of the power cells, which do not move until the next event: a
    side leads from the point of equal powers over the corners of one triangle to that of the next."""
    yield from draw(k, s)
    n, scale = slots(s), s.scale[PER_LENGTH]
    place = np.concatenate([positions_now(k)[:n] * scale, far_points(s)])
    height = (place**2).sum(axis=1) - s.weight
    corners = s.org.reshape(-1, 4)[:, :3]
    a, b, c = np.where(corners[:, :1] < 0, [n, n + 1, n + 2], corners).T  # any three, where none is used
    u, v = 2.0 * (place[b] - place[a]), 2.0 * (place[c] - place[a])
    rise, climb = height[b] - height[a], height[c] - height[a]
    equal = np.column_stack([rise * v[:, 1] - climb * u[:, 1], climb * u[:, 0] - rise * v[:, 0]])
    equal /= (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])[:, None] * scale
    h = np.flatnonzero((s.org >= 0) & (s.org < n) & (s.twin >= 0))
    h = h[(s.org[h] < s.org[s.twin[h]]) & (s.org[s.twin[h]] < n)]
    for (x, y), (p, q) in zip(equal[h >> 2].tolist(), equal[s.twin[h] >> 2].tolist(), strict=True):
        yield Segment("cell", (x, y), (p, q))


class Power:
    """A kinetic regular triangulation: pairs of bodies whose regions of least power adjoin.

    Args:
        cells: whether drawings have the power cells as well.
    """

    def __init__(self, cells: bool = False) -> None:
        if not isinstance(cells, bool):
            raise BadOption(f"cells is {cells!r}; expected true or false")
        self.draw = draw_cells if cells else draw

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; refuses a scene without an arena, with a periodic axis, with other shapes than
        discs, or with a body that is too small for the arena."""
        why = "power triangulates the discs of an arena between far points outside of it, and this scene "
        if scene.arena is None:
            raise Refused(f"{why}has no arena")
        if scene.periodic:
            raise Refused(f"{why}is periodic along {scene.periodic}")
        if scene.shapes:
            raise Refused("power is for discs, and this scene has other shapes")
        radius = float(scene.radius.min(initial=math.inf))
        side = max(scene.arena) + 2.0 * fall_of(scene)
        if radius < THINNEST * side:
            raise Refused(
                f"power is for bodies that are at most {1.0 / THINNEST:.0f} times as small as the arena, and "
                f"the smallest radius is {radius!r} in an arena of {side!r}"
            )
        state = empty(scene.capacity)
        width, height = scene.arena
        scale = math.ldexp(1.0, -math.frexp(side)[1])
        proven = min(1.0, max(16.0 * radius / side, (2.0**-12 * side / radius) ** 2))  # (docs/cells.md)
        theta = 2.0**-10 * (scale * radius) ** 2 * proven if len(scene) else 0.0
        state.scale[:] = scale, 0.0, theta, 0.5 * scale * width, 0.5 * scale * height, DISTANCE * scale * side
        return BroadPhaseParts(
            near=near,
            state=state,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=replan,
            enter=enter,
            leave=leave,
            audit=audit,
            draw=self.draw,
            ticks=(state.due, state.soonest),
            solid=True,
            skin_limit=radius / 16.0 if len(scene) else None,
            room=scene.capacity + 4,
        )
