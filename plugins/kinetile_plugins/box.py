"""The narrow phase of upright boxes, of discs among them, and of both.

Bodies do not rotate. When two of them touch is decided exactly, an axis at a time
(``kinetile.kernel.certificates.boxes``; docs/specification.md, rule 5s). What follows is rule 9s: they
exchange momentum across the face at which they touch, so that of two boxes one component of the velocities
changes alone, or along the line from a corner to the disc.

Lower bounds are those of boxes that are wider by the radii, and fattened by more than all rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from kinetile.errors import Refused
from kinetile.kernel.certificates.boxes import boxes_touch, disc_touches_box
from kinetile.scene import Scene
from kinetile.toolbox import (
    NEVER,
    NOBODY,
    TOO_DEEP,
    Kernel,
    PairParts,
    blame,
    hook,
    larger,
    since_anchor,
    since_origin,
    smaller,
    unchecked,
)
from kinetile_plugins.disc import exchange
from kinetile_plugins.disc import meet as meet_discs

SHAPES = ("box", "disc")


def demand_boxes(phase: str, scene: Scene) -> None:
    """Raises Refused for a scene with bodies of other shapes than upright boxes and discs."""
    there = dict.fromkeys(scene.shapes[each].kind for each in scene.shape.tolist())
    others = [kind for kind in there if kind not in SHAPES]
    if others:
        raise Refused(
            f"{phase} takes upright boxes and discs, and this scene has bodies of another shape "
            f"({', '.join(others)}): no narrow phase takes them yet"
        )


@hook
def overlaps_while(d: float, v: float, reach: float) -> tuple[float, float]:
    """Return from when until when a place, d away along an axis at a speed v, is within a reach."""
    if v == 0.0:
        return (-math.inf, math.inf) if abs(d) <= reach else (math.inf, -math.inf)
    middle = -d / v
    half = reach / abs(v)
    return middle - half, middle + half


@hook
def around_corner(
    x: float, y: float, vx: float, vy: float, width: float, height: float, margin: float
) -> float:
    """Return a bound below the time until a disc touches a box, where it has come within the box's margins
    but may still be beside a corner: until it touches that or is beside it no longer."""
    beside = abs(x) - width
    above = abs(y) - height
    if beside <= 0.0 or above <= 0.0:
        return 0.0
    vx = vx if x > 0.0 else -vx
    vy = vy if y > 0.0 else -vy
    approach = beside * vx + above * vy
    speed2 = vx * vx + vy * vy
    gap = beside * beside + above * above - margin * margin
    inside = approach * approach - speed2 * gap
    soon = math.inf
    if gap <= 0.0:
        soon = 0.0
    elif approach < 0.0 and inside >= 0.0:
        soon = gap / (math.sqrt(inside) - approach)
    if vx < 0.0:
        soon = smaller(soon, -beside / vx)
    if vy < 0.0:
        soon = smaller(soon, -above / vy)
    return soon * (1.0 - 2.0**-40)


@unchecked
@hook
def soonest(k: Kernel, body: int, count: int, barred: int, known: int, at: int) -> tuple[float, float, int]:
    """Return bounds below the first contact of a body with ``k.near[:count]``, the second, and with whom: as
    delays after tick ``at``, infinite where there is no contact."""
    fat = k.clock[0].limits.fat
    elapsed = since_origin(k, at)
    one = k.places[body]
    mine = k.bodies[body]
    soon = math.inf
    rest = math.inf
    who = NOBODY
    for i in range(count):
        other = k.near[i]
        if other != body and other != barred and other != known:
            two = k.places[other]
            its = k.bodies[other]
            margin = mine.margin + its.margin + fat
            width = mine.half_width + its.half_width
            height = mine.half_height + its.half_height
            vx = two.vx - one.vx
            vy = two.vy - one.vy
            dx = (two.x - one.x) + vx * elapsed
            dy = (two.y - one.y) + vy * elapsed
            enters, leaves = overlaps_while(dx, vx, width + margin)
            enters_y, leaves_y = overlaps_while(dy, vy, height + margin)
            delay = larger(larger(enters, enters_y), 0.0)
            delay = delay if delay <= smaller(leaves, leaves_y) else math.inf
            if margin > fat and delay < rest:
                delay += around_corner(dx + vx * delay, dy + vy * delay, vx, vy, width, height, margin)
            rest = smaller(rest, larger(soon, delay))
            who = int(other) if delay < soon else who
            soon = smaller(soon, delay)
    return soon, rest, who


@hook
def is_disc(k: Kernel, body: int) -> bool:
    """Whether a body is a disc, not a box."""
    return bool(k.bodies[body].margin > 0.0)


@hook
def line_of(k: Kernel, a: int, b: int, dx: float, dy: float) -> tuple[float, float, float]:
    """Return the normal from a to b across which two bodies touch whose places differ by (dx, dy), of length
    1, and how deep they overlap (rule 9s)."""
    one = k.bodies[a]
    two = k.bodies[b]
    width = one.half_width + two.half_width
    height = one.half_height + two.half_height
    margin = one.margin + two.margin
    beside = abs(dx) - width
    above = abs(dy) - height
    if margin > 0.0 and beside > 0.0 and above > 0.0:
        x = dx - (width if dx > 0.0 else -width)
        y = dy - (height if dy > 0.0 else -height)
        distance = math.sqrt(x * x + y * y)
        return x / distance, y / distance, margin - distance
    closes_x = dx * (two.vx - one.vx) < 0.0
    closes_y = dy * (two.vy - one.vy) < 0.0
    across = beside >= above
    if margin == 0.0 and closes_x != closes_y:
        across = closes_x
    if across:
        return (1.0 if dx > 0.0 else -1.0), 0.0, margin - beside
    return 0.0, (1.0 if dy > 0.0 else -1.0), margin - above


@unchecked
@hook
def touch(k: Kernel, a: int, b: int) -> tuple[float, float, float]:
    """Return the normal from a to b at which they touch, and how deep they overlap."""
    one = k.bodies[a]
    two = k.bodies[b]
    return line_of(k, a, b, two.x - one.x, two.y - one.y)


@unchecked
@hook
def collide(k: Kernel, a: int, b: int) -> float:
    """Exchange momentum along the normal, elastically; return how deep the two overlap."""
    nx, ny, depth = touch(k, a, b)
    exchange(k, a, b, nx, ny)
    return float(depth)


def _meet(discs: bool, boxes: bool) -> Callable[..., Any]:
    """Returns the hook ``meet`` for bodies among which there are two discs, or two boxes."""

    @unchecked
    @hook
    def meet(k: Kernel, a: int, b: int) -> int:
        """Return the tick of the first contact of two bodies, or ``NEVER``."""
        if discs and is_disc(k, a) and is_disc(k, b):
            return meet_discs(k, a, b)
        clock = k.clock[0]
        early = a if k.bodies[a].anchor < k.bodies[b].anchor else b
        late = a + b - early
        one = k.bodies[early]
        two = k.bodies[late]
        since = two.anchor
        elapsed = since - one.anchor
        if boxes and not is_disc(k, a) and not is_disc(k, b):
            delay = boxes_touch(
                one.x,
                one.y,
                one.vx,
                one.vy,
                elapsed,
                two.x,
                two.y,
                two.vx,
                two.vy,
                one.half_width,
                two.half_width,
                one.half_height,
                two.half_height,
                clock.tick,
                clock.per_time,
            )
        else:
            delay = disc_touches_box(
                one.x,
                one.y,
                one.vx,
                one.vy,
                elapsed,
                two.x,
                two.y,
                two.vx,
                two.vy,
                one.half_width + two.half_width,
                one.half_height + two.half_height,
                one.margin + two.margin,
                clock.tick,
                clock.per_time,
            )
        if delay == NEVER:
            return NEVER
        if delay == 0:
            time = since_anchor(k, one, since)
            dx = two.x - (one.x + one.vx * time)
            dy = two.y - (one.y + one.vy * time)
            _, _, depth = line_of(k, early, late, dx, dy)
            if depth > clock.limits.tolerance + 1e-9 * (one.radius + two.radius):
                blame(k, TOO_DEEP, a, b)
        return int(since + delay)

    return meet


MEET = {(discs, boxes): _meet(discs, boxes) for discs in (False, True) for boxes in (False, True)}


class Box:
    """Elastic contact of upright boxes and discs.

    Args:
        general: the same parts for all scenes, so that they share one compiled loop.
    """

    def __init__(self, general: bool = False) -> None:
        self.general = general

    def prepare(self, scene: Scene) -> PairParts:
        """Returns the parts; refuses a scene of discs alone, and one with other shapes."""
        if not scene.shapes:
            raise Refused("box is for scenes with shapes, and this one has discs alone: choose disc")
        demand_boxes("box", scene)
        discs = sum(scene.shapes[each].is_disc for each in scene.shape.tolist())
        several = (self.general or discs > 1, self.general or len(scene) - discs > 1)
        return PairParts(meet=MEET[several], collide=collide, soonest=soonest, touch=touch, shapes=True)
