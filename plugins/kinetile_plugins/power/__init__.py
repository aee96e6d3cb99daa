"""Power: a kinetic regular triangulation, of discs that do not pass through each other.

A body is near all bodies that it has an edge to, and the only event is the flip of an edge (docs/cells.md has
the proofs; radii there are reaches here). There are at most 3n + 5 edges and no parameters.

Files: ``web`` the stored structure; ``certificates`` the ticks of failing edges; ``events`` flips, insertion,
removal; ``audit`` every invariant, slowly. This file has the class, and the drawing.
"""

import math
from collections.abc import Iterator

import numpy as np

from kinetile.arrays import Integers
from kinetile.errors import BadOption, Refused
from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    At,
    BroadPhaseParts,
    Item,
    Kernel,
    Polygon,
    Segment,
    pair_links,
    positions_now,
)
from kinetile.toolbox.reach import margin_of

from .audit import audit
from .certificates import watch_around
from .events import build, enter, leave, repair
from .web import CORNERS, PER_LENGTH, UNIT, State, empty, near, slots, start, succ

THINNEST = 2.0**-14
"""The smallest radius, in units of the arena's longer side: rounding may add 2^-39 to a power, and theta,
which is more, is at most 2^-10 of the square of the radius."""


def arrange(k: Kernel, s: State) -> None:
    """Computes the weights and the order of insertion, and lays out the square of the far points."""
    n = len(k.bodies)
    s.scale[UNIT] = float(k.clock[0].per_tick) * 2.0**52
    s.weight[:n] = (s.scale[PER_LENGTH] * k.bodies.reach) ** 2
    s.order[:n] = np.random.default_rng(0).permutation(n)
    start(s)


def between_bodies(s: State) -> Integers:
    """Returns the owner's half-edge of each edge between two bodies."""
    h = np.flatnonzero((s.org >= 0) & (s.twin >= 0))
    a, b = s.org[h], s.org[s.twin[h]]
    return np.asarray(h[(a < b) & (b < slots(s))])


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Yields the triangles between bodies, each with the tick of the first of its own edges to fail, the
    pairs of bodies that have an edge, and the edge that fails first, perhaps to a far point."""
    n = slots(s)
    corners, due = s.org.reshape(-1, 4)[:, :3], s.due.reshape(-1, 4)[:, :3].min(axis=1)
    between = (corners >= 0).all(axis=1) & (corners < n).all(axis=1)
    for sites, tick in zip(corners[between].tolist(), due[between].tolist(), strict=True):
        yield Polygon("tile", tuple((At(site), At(site)) for site in sites), tick)
    h = between_bodies(s)
    yield from pair_links(zip(s.org[h].tolist(), s.org[s.twin[h]].tolist(), strict=True))
    first = int(s.due.argmin())
    if s.due[first] != NEVER:
        far = np.column_stack([s.far_x, s.far_y]) / s.scale[PER_LENGTH]
        one, two = (
            (At(site), At(site)) if site < n else (float(far[site, 0]), float(far[site, 1]))
            for site in (int(s.org[first]), int(s.org[succ(first)]))
        )
        yield Segment("certificate", one, two, int(s.due[first]))


def draw_cells(k: Kernel, s: State) -> Iterator[Item]:
    """Yields the items of ``draw``, and the sides of the power cells, which are drawn fixed until the next
    event. A side joins the points of equal powers over the corners of two adjoining triangles."""
    yield from draw(k, s)
    place = np.column_stack([s.far_x, s.far_y])
    place[: slots(s)] = positions_now(k)[: slots(s)] * s.scale[PER_LENGTH]
    height = (place**2).sum(axis=1) - s.weight
    used = np.flatnonzero(s.org[::4] >= 0)
    a, others = s.org[4 * used, None], s.org.reshape(-1, 4)[used, 1:3]
    equal = np.zeros((len(s.org) // 4, 2))
    ways, rises = 2.0 * (place[others] - place[a]), height[others] - height[a]
    equal[used] = np.linalg.solve(ways, rises[..., None])[..., 0] / s.scale[PER_LENGTH]
    h = between_bodies(s)
    for (x, y), (p, q) in zip(equal[h >> 2].tolist(), equal[s.twin[h] >> 2].tolist(), strict=True):
        yield Segment("cell", (x, y), (p, q))


class Power:
    """A kinetic regular triangulation: pairs of bodies whose regions of least power adjoin.

    Args:
        cells: True for drawings with the power cells as well.
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
        width, height = scene.arena
        side = max(width, height) + 2.0 * margin_of(scene)
        if radius < THINNEST * side:
            raise Refused(
                f"power is for bodies that are at most {1.0 / THINNEST:.0f} times as small as the arena, and "
                f"the smallest radius is {radius!r} in an arena of {side!r}"
            )
        state = empty(scene.capacity)
        scale = math.ldexp(1.0, -math.frexp(side)[1])
        proven = min(1.0, max(16.0 * radius / side, (2.0**-12 * side / radius) ** 2))  # (docs/cells.md)
        theta = 2.0**-10 * (scale * radius) ** 2 * proven if len(scene) else 0.0
        state.scale[:] = scale, 0.0, theta
        far = 2.0 * side * np.array([-1.0, 0.0, 1.0, 0.0])
        state.far_x[-CORNERS:] = scale * (0.5 * width + far)
        state.far_y[-CORNERS:] = scale * (0.5 * height + np.roll(far, 1))
        return BroadPhaseParts(
            near=near,
            state=state,
            arrange=arrange,
            build=build,
            repair=repair,
            replan=watch_around,
            enter=enter,
            leave=leave,
            audit=audit,
            draw=self.draw,
            ticks=(state.due,),
            solid=True,
            walled=True,
            skin_limit=radius / 16.0 if len(scene) else None,
            room=scene.capacity + 4,
        )
