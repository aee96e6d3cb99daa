"""Reach of bodies for broad phases at the start: their radius and the skin.

The skin (``kinetile.kernel.skin``) follows from a speed that no body exceeds, and from how far from the
origin bodies can come.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.skin import Skin
from kinetile.scene.commands import Insert, Remove
from kinetile.scene.scene import Scene

SPANS = 4
"""Spans of the clock for which the skin of a scene without walls is valid."""


def reach_of(scene: Scene) -> npt.NDArray[np.float64]:
    """Returns (n,) the reach of each body at the start: its radius and the skin, as in ``k.bodies.reach``.

    This is for the sizes in ``prepare``; a scene with an arena is assumed to have walls. It may change
    later: reaches grow if bodies without walls fly far, if an interactive turn adds
    energy, and if an arena's walls are left out. Then ``arrange`` is called again, and ``k.bodies.reach``
    has the present values.
    """
    return np.asarray(scene.radius + skin_at_start(scene, walls=scene.arena is not None).delta)


def skin_at_start(scene: Scene, walls: bool, slots: int | None = None) -> Skin:
    """Returns the skin of a scene, with or without the walls of its arena, in tables with this number of
    ``slots`` for bodies; None: as many as it has."""
    count, speed = len(scene) if slots is None else slots, speed_bound(scene)
    far = np.abs(scene.position).max(axis=0, initial=0.0)
    extent = extent_of(scene, walls, speed, far, SPANS if count else 0)
    return Skin.of(count, extent, speed, scene.time_unit / TICKS)


def extent_of(scene: Scene, walls: bool, speed: float, far: npt.NDArray[np.float64], spans: int) -> float:
    """Returns how far from the origin of an axis a plan's place, and what a body reaches from there, can be,
    at a speed.

    On an axis with walls that is where the other wall is; on a periodic one half a period and the flight of
    four units, with room for one more rounding; on an open one where bodies are now (``far``, for each axis),
    and what they fly in a number of spans. With gravity it is further by what a frame falls. A shape need
    not be around its body's place, which may be outside the arena by as much as the radius of the circle that
    holds the shape.
    """
    extents = [0.0]
    for axis, at in zip("xy", far.tolist(), strict=True):
        side = scene.arena["xy".index(axis)] if scene.arena is not None else 0.0
        if axis in scene.periodic:
            extents.append(1.25 * (0.5 * side + 4.0 * speed * scene.time_unit))
        elif walls:
            extents.append(side + fall_of(scene))
        else:
            extents.append(at + flown(speed, scene.time_unit, spans))
    return max(extents) + (float(scene.radius.max(initial=0.0)) if scene.shapes else 0.0)


def flown(speed: float, unit: float, spans: int) -> float:
    """Returns how far a body flies at a speed within a number of spans of the clock of this unit."""
    return speed * unit * (spans * SPAN // TICKS)


def fall_of(scene: Scene) -> float:
    """Returns how far a frame falls at most, by which bodies in it can be outside of the arena: a quarter of
    the shorter side (rule 3g)."""
    return 0.25 * min(scene.arena) if scene.arena is not None and scene.falls else 0.0


def drop_of(scene: Scene) -> float:
    """Returns the largest square of a speed that a body can gain by falling: 2 g.d for the arena's diagonal
    d. A frame, which falls by a quarter of a side at most, gains half of such a speed at most."""
    if not scene.falls:
        return 0.0
    return 2.0 * sum(abs(pull) * side for pull, side in zip(scene.gravity, scene.arena or (), strict=False))


def speed_bound(scene: Scene) -> float:
    """Returns a speed that no body can exceed in its frame: all energy, that of every command added, in the
    lightest body.

    If immovable bodies fly, or a response adds energy, there is no such speed before the run:
    then it is an initial value.
    """
    mass = dict(enumerate(scene.mass.tolist()))
    mass |= {command.body: command.mass for command in scene.commands if isinstance(command, Insert)}
    if not mass:
        return 0.0
    squares = np.einsum("ij,ij->i", scene.velocity, scene.velocity)
    static = np.isinf(scene.mass)
    pushed = [float(squares[static].max(initial=0.0))]
    terms = (scene.mass[~static] * squares[~static]).tolist()
    terms += [each * drop_of(scene) for each in mass.values()] if scene.falls else []
    for command in scene.commands:
        if not isinstance(command, Remove):
            square = command.velocity[0] ** 2 + command.velocity[1] ** 2
            if mass[command.body] < math.inf:
                terms.append(mass[command.body] * square)
            else:
                pushed.append(square)
    lightest = min(mass.values())
    speed = math.sqrt(math.fsum(terms) / lightest) if lightest < math.inf else 0.0
    return (speed + 2.0 * math.sqrt(max(pushed)) + 0.5 * math.sqrt(drop_of(scene))) * (1.0 + 2.0**-20)
