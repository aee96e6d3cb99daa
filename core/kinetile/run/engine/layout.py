"""A scene laid out as the kernel's tables, its bodies at their start, and the limits that a speed sets."""

from __future__ import annotations

from kinetile.errors import PhaseError
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import Kernel, allocate, pair_set
from kinetile.plugin.calling import described
from kinetile.run.composition import Composition
from kinetile.scene import Scene

__all__ = ["set_limits", "tables_of"]

LOG_ROWS = 1 << 14


def tables_of(scene: Scene, composition: Composition, unit: float) -> Kernel:
    """Return tables for a scene under its phases; ``unit`` is that of the clock.

    Raises PhaseError where there is no memory for what the broad phase asks for.
    """
    n = len(scene)
    pairs, room = int(composition.broad.pairs), max(int(composition.broad.room), n)
    try:
        k = allocate(n, room, LOG_ROWS)
        if pairs:
            k = pair_set(k, pairs)
    except MemoryError as error:
        who = described("broad phase", composition.broad_phase)
        said = f"there is no memory for its {pairs} pairs and for {room} bodies near one"
        raise PhaseError(f"{who}: {said}") from error
    k.bodies.x, k.bodies.y = scene.position.T
    k.bodies.vx, k.bodies.vy = scene.velocity.T
    k.bodies.radius = scene.radius
    k.radii[:] = scene.radius
    k.bodies.last = -1
    k.mass[:] = scene.mass
    clock = k.clock[0]
    clock.tick = unit / TICKS
    clock.per_time = TICKS / unit
    if scene.arena is not None:
        clock.width, clock.height = scene.arena
    clock.spin_limit = 2 * (2 * n + 2) ** 2 + 1000
    clock.window_size = 200 * n + 2000
    clock.window_tick = -(2**62)
    return k


def set_limits(k: Kernel, skin: Skin, extent: float, speed: float) -> None:
    """Write down what follows from a skin, for bodies within an extent of the origin and never faster than a
    speed: their reach, when they are jammed, and for how long and how well the common clock holds."""
    clock = k.clock[0]
    k.bodies.reach = k.bodies.radius + skin.delta
    clock.skin, clock.theta, clock.tolerance = skin.delta, skin.theta, skin.tolerance
    span = SPAN // 2
    if len(k.bodies) and speed > 0.0:
        flight = 1e-13 * float(k.radii.min()) / speed  # jammed: contacts within 1e-13 radii of flight each
        clock.window_ticks = int(min(int(clock.window_size) * flight * clock.per_time, SPAN))
        span = int(min(4.0 * extent / speed * float(clock.per_time), float(span)))
    clock.span = span
    clock.fat = skin.fat(extent + 2.0 * speed * (span * float(clock.tick)))
