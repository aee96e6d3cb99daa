"""The narrow phase of a body and the arena's four walls.

The kernel holds one wall certificate for each body: the first wall that its present plan reaches. It is
recomputed only when the plan changes, so no broad phase depends on walls.

As with discs, contact means approach: a body that touches a wall and moves along it or away is not in
contact. In a corner the first wall of left, right, bottom, top counts; the other follows at the same tick.

A body that is accelerated along an axis may reach either wall at its ends: ``ACCELERATED`` has the hooks.
"""

from collections.abc import Callable

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile.toolbox import (
    BOTTOM,
    LEFT,
    NEVER,
    RIGHT,
    TOP,
    Kernel,
    Records,
    WallParts,
    hook,
    inside_accelerated,
    inside_arena,
    unchecked,
)
from kinetile.toolbox.ticks import reaches_edge, with_shapes


@hook
def _of_shape(body: Records) -> tuple[float, float, float, float]:
    return body.left, body.right, body.down, body.up


@with_shapes(_of_shape)
@hook
def extent(body: Records) -> tuple[float, float, float, float]:
    """Returns the reaches of a body to the left, right, bottom and top (rules 6 and 6s)."""
    return body.radius, body.radius, body.radius, body.radius


@hook
def after(k: Kernel, body: Records, side: float, far: float, near: float, slope: float, pull: float) -> int:
    """Returns the tick at which the gap between two coordinates, less a reach, closes, with a rate ``slope``
    and an acceleration ``pull``; or ``NEVER``."""
    clock = k.clock[0]
    delay = reaches_edge(far, near, side, slope, pull, clock.per_tick, clock.per_time)
    return int(body.anchor + delay) if delay != NEVER else NEVER


@hook
def first_wall(k: Kernel, body: Records, x: bool, y: bool) -> tuple[int, int]:
    """Returns (tick, wall) of the first contact with the walls at the ends of these axes, or ``NEVER``."""
    limits = k.clock[0].limits
    to_left, to_right, down, up = extent(body)
    tick = NEVER
    wall = LEFT
    if x and body.vx != 0.0:
        left = body.vx < 0.0
        side = to_left if left else to_right
        tick = after(
            k, body, side, body.x if left else limits.width, 0.0 if left else body.x, -abs(body.vx), 0.0
        )
        wall = LEFT if left else RIGHT
    if y and body.vy != 0.0:
        low = body.vy < 0.0
        side = down if low else up
        other = after(
            k, body, side, body.y if low else limits.height, 0.0 if low else body.y, -abs(body.vy), 0.0
        )
        if other < tick:
            tick = other
            wall = BOTTOM if low else TOP
    return tick, wall


def _walls(x: bool, y: bool) -> Callable[[Kernel, Records], tuple[int, int]]:
    """Returns the hook ``reach_wall`` for walls at the ends of these axes."""

    @unchecked
    @hook
    def reach_wall(k: Kernel, body: Records) -> tuple[int, int]:
        """Returns (tick, wall) of the first contact of a body with a wall; ``NEVER`` without a contact."""
        return first_wall(k, body, x, y)

    return reach_wall


WALLS = {"": _walls(True, True), "x": _walls(False, True), "y": _walls(True, False)}
"""``reach_wall`` by the periodic axes."""


@unchecked
@hook
def reach_any_wall(k: Kernel, body: Records) -> tuple[int, int]:
    """Returns the same for any scene, also without an arena or with a periodic axis."""
    clock = k.clock[0]
    walls = clock.limits.width > 0.0
    return first_wall(k, body, walls and clock.torus.x == 0.0, walls and clock.torus.y == 0.0)


@unchecked
@hook
def touch(k: Kernel, body: Records, wall: int) -> tuple[float, float, float]:
    """Returns the normal into the wall, and the depth of the body in it."""
    limits = k.clock[0].limits
    left, right, down, up = extent(body)
    if wall == LEFT:
        return -1.0, 0.0, float(left - body.x)
    if wall == RIGHT:
        return 1.0, 0.0, float(right - (limits.width - body.x))
    if wall == BOTTOM:
        return 0.0, -1.0, float(down - body.y)
    return 0.0, 1.0, float(up - (limits.height - body.y))


@unchecked
@hook
def bounce(k: Kernel, body: Records, wall: int) -> float:
    """Turns the velocity away from the wall; returns the depth of the body in it."""
    _, _, depth = touch(k, body, wall)
    if wall == LEFT or wall == RIGHT:  # noqa: SIM109 - no tuple in a hook
        body.vx = -body.vx
    else:
        body.vy = -body.vy
    return float(depth)


@unchecked
@hook
def reach_accelerated(k: Kernel, body: Records) -> tuple[int, int]:
    """Returns (tick, wall) of the first contact; for a tie the first of left, right, bottom, top."""
    clock = k.clock[0]
    limits = clock.limits
    if limits.width == 0.0:  # there is no arena, and the parts are general
        return NEVER, LEFT
    steady_x = clock.torus.x == 0.0 and body.ax == 0.0
    steady_y = clock.torus.y == 0.0 and body.ay == 0.0
    to_left, to_right, down, up = extent(body)
    tick, wall = first_wall(k, body, steady_x, steady_y)
    if body.ax != 0.0:
        left = after(k, body, to_left, body.x, 0.0, body.vx, body.ax)
        right = after(k, body, to_right, limits.width, body.x, -body.vx, -body.ax)
        if left <= tick or right <= tick:  # before the walls of the other axis
            tick = left if left <= right else right
            wall = LEFT if left <= right else RIGHT
    if body.ay != 0.0:
        bottom = after(k, body, down, body.y, 0.0, body.vy, body.ay)
        top = after(k, body, up, limits.height, body.y, -body.vy, -body.ay)
        if bottom < tick:
            tick = bottom
            wall = BOTTOM
        if top < tick:
            tick = top
            wall = TOP
    return tick, wall


ACCELERATED = WallParts(
    reach_accelerated, bounce, touch, periodic=True, inside=inside_accelerated, shapes=True, accelerated=True
)
"""The parts for a scene with accelerations."""


class Wall:
    """Elastic contact of a body with the walls of a rectangular arena.

    Args:
        general: True for the same parts in all scenes, also without an arena, so that they share a loop.
    """

    def __init__(self, general: bool = False) -> None:
        self.general = general

    def prepare(self, scene: Scene) -> WallParts:
        """Returns the parts; refuses a scene without walls, unless the parts are general."""
        if self.general and not scene.accelerated:
            return _parts(reach_any_wall)
        if scene.arena is None and not self.general:
            raise Refused(
                "wall needs an arena, and this scene has none: give the scene an arena or leave wall out"
            )
        if scene.periodic == "xy":
            raise Refused("this scene is periodic along both axes, so there are no walls: leave wall out")
        return ACCELERATED if scene.accelerated else _parts(WALLS[scene.periodic])


def _parts(reach: Callable[[Kernel, Records], tuple[int, int]]) -> WallParts:
    return WallParts(reach, bounce, touch, periodic=True, shapes=True, inside=inside_arena)
