"""Reach of bodies for broad phases at the start: their radius and the skin.

The skin (``kinetile.kernel.skin``) follows from a speed that no body exceeds, and from the largest distance
of bodies from the origin.
"""

import math

import numpy as np

from kinetile.arrays import Floats
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.plan import SHARE
from kinetile.kernel.skin import Skin
from kinetile.scene.commands import Accelerate, Insert, Move, Turn
from kinetile.scene.scene import Scene

SPANS = 4
"""The skin of a scene without walls is valid for this number of the clock's spans."""


def reach_of(scene: Scene) -> Floats:
    """Returns (n,) the reach of each body at the start: its radius and the skin, as in ``k.bodies.reach``:
    for sizes in ``prepare``. A scene with an arena is assumed to have walls.

    Reaches grow if bodies without walls fly far, if an interactive turn adds energy, and if an arena's walls
    are left out. Then ``arrange`` is called again, and ``k.bodies.reach`` has the present values.
    """
    return np.asarray(scene.radius + skin_at_start(scene, walls=scene.arena is not None).delta)


def skin_at_start(scene: Scene, walls: bool, slots: int | None = None, limit: float | None = None) -> Skin:
    """Returns the skin of a scene, with or without the walls of its arena, in tables with this number of
    ``slots`` for bodies (None: the scene's number of bodies), for a phase with this ``skin_limit``."""
    count, speed = len(scene) if slots is None else slots, speed_bound(scene)
    far = np.abs(scene.position).max(axis=0, initial=0.0)
    extent = extent_of(scene, walls, speed, far, SPANS if count else 0)
    return Skin.of(count, extent, speed, scene.time_unit / TICKS, margin_of(scene, limit))


def extent_of(scene: Scene, walls: bool, speed: float, far: Floats, spans: int) -> float:
    """Returns the largest distance along an axis between the origin and a plan's place, including the body's
    extent there, at a speed.

    On an axis with walls this is the far wall's place, and the margin of chords; on a periodic one half a
    period and the flight of four units, with room for one more rounding; on an open one the present places
    (``far``, for each axis) or those of commands, and the flight in a number of spans. A shape need not be
    around its body's place, which may be outside the arena by as much as the radius of the circle that holds
    the shape.
    """
    extents = [0.0]
    for axis, at in zip("xy", far.tolist(), strict=True):
        side = scene.arena["xy".index(axis)] if scene.arena is not None else 0.0
        if axis in scene.periodic:
            extents.append(1.25 * (0.5 * side + 4.0 * speed * scene.time_unit))
        elif walls:
            extents.append(side + margin_of(scene))
        else:
            places = (each.position for each in scene.commands if isinstance(each, Insert | Move))
            put = max((abs(place["xy".index(axis)]) for place in places), default=0.0)
            extents.append(max(at, put) + flown(speed, scene.time_unit, spans))
    return max(extents) + (float(scene.radius.max(initial=0.0)) if scene.shapes else 0.0)


def flown(speed: float, unit: float, spans: int) -> float:
    """Returns the distance flown at a speed within a number of spans of the clock of this unit."""
    return speed * unit * (spans * SPAN // TICKS)


def margin_of(scene: Scene, limit: float | None = None) -> float:
    """Returns the largest distance of a shadow from its body (``kinetile.kernel.chords``): an eighth of the
    smallest radius, and half of the skin's limit at most; 0 if no body is accelerated."""
    if not scene.accelerated:
        return 0.0
    coming = [command.radius for command in scene.commands if isinstance(command, Insert)]
    most = min([*scene.radius.tolist(), *coming], default=1.0) * SHARE
    return most if limit is None else min(most, 0.5 * limit)


def drop_of(scene: Scene) -> float:
    """Returns the largest square of a speed that a body can gain by falling: 2 a.d for the arena's diagonal d
    and the largest accelerations; in the open plane 2 |a|^2 t^2 for the time t up to the scene's end."""
    if not scene.accelerated:
        return 0.0
    x, y = scene.pull
    if scene.arena is not None:
        return 2.0 * (x * scene.arena[0] + y * scene.arena[1])
    assert scene.settings.until is not None
    time = scene.settings.until - scene.start
    return 2.0 * (x * x + y * y) * (time * time)


def fastest(scene: Scene, squares: float, lightest: float) -> float:
    """Returns the speed of the lightest body if it had all the energy: half of ``squares``, the sum of mass *
    (speed^2 + drop).

    In the open plane the root W of the sum of m v^2 grows by sum(m a.v) / W <= |a| sqrt(M) a unit of time, M
    being the sum of m: up to W + |a| sqrt(M) t, whose square is at most 2 (W^2 + M |a|^2 t^2).
    """
    return math.sqrt((2.0 if scene.accelerated and scene.arena is None else 1.0) * squares / lightest)


def chord_speed(scene: Scene) -> float:
    """Returns the most that a shadow is faster than its body: |a| span, with |a| span^2 / 2 = margin."""
    return math.sqrt(2.0 * margin_of(scene) * sum(scene.pull))


def speed_bound(scene: Scene) -> float:
    """Returns a speed that no body and no shadow can exceed: all energy, including every command's and every
    height's, in the lightest body.

    If immovable bodies fly, or a response adds energy, no such speed exists before the run: then this is an
    initial value.
    """
    mass = dict(enumerate(scene.mass.tolist()))
    mass |= {command.body: command.mass for command in scene.commands if isinstance(command, Insert)}
    if not mass:
        return 0.0
    squares = np.einsum("ij,ij->i", scene.velocity, scene.velocity)
    static = np.isinf(scene.mass)
    pushed = [float(squares[static].max(initial=0.0))]
    terms = (scene.mass[~static] * squares[~static]).tolist()
    lifted = [mass[each.body] for each in scene.commands if isinstance(each, Accelerate | Move)]
    drop = drop_of(scene)
    terms += (
        [each * drop for each in (*mass.values(), *lifted) if each < math.inf] if scene.accelerated else []
    )
    for command in scene.commands:
        if isinstance(command, Insert | Turn):
            square = command.velocity[0] ** 2 + command.velocity[1] ** 2
            if mass[command.body] < math.inf:
                terms.append(mass[command.body] * square)
            else:
                pushed.append(square)
    lightest = min(mass.values())
    speed = fastest(scene, math.fsum(terms), lightest) if lightest < math.inf else 0.0
    return (speed + 2.0 * math.sqrt(max(pushed)) + chord_speed(scene)) * (1.0 + 2.0**-20)
