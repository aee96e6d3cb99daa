"""Gravity: bodies in a frame that falls with them, in which they fly straight.

All bodies have the same acceleration, so a frame of reference can have it. In such a frame every plan is
straight, and pairs, broad phases and the queue have nothing to do with gravity; only walls move, and their
narrow phase knows that (``certificates.falling``). ``clock.fall`` has the acceleration and the tick at which
the present frame was at rest: its *origin*. A body of the frame is in the room, at a tick T, at its place + g
(T - origin)^2 / 2, and has its velocity + g (T - origin), in time. So ``k.bodies`` has velocities and places
of the frame, and all that is read out has those of the room (``shift_of``).

A frame lasts for a number of ticks that follows from the scene (``clock.frame_of``), so that it falls by a
quarter of a side at most. Then all bodies pass to the next one at once (``pass_frame`` of the engine),
between two chunks of the loop, and the structure of the broad phase is built again. Each is anchored in doing
so, which is part of the answer (docs/specification.md, rule 8g).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import TICKS
from kinetile.kernel.compiled import hook
from kinetile.kernel.flight import positions_now
from kinetile.kernel.tables import Kernel


@hook
def fallen_for(k: Kernel, tick: int) -> float:
    """Return how long the present frame has been falling at a tick, in the scene's time: exactly."""
    clock = k.clock[0]
    return float(float(tick - clock.fall.origin) * clock.tick)


@hook
def place_in_frame(k: Kernel, x: float, y: float, tick: int) -> tuple[float, float]:
    """Return a place in the room as one in the frame."""
    fall = k.clock[0].fall
    time = fallen_for(k, tick)
    return x - fall.x * (0.5 * (time * time)), y - fall.y * (0.5 * (time * time))


@hook
def velocity_in_frame(k: Kernel, vx: float, vy: float, tick: int) -> tuple[float, float]:
    """Return a velocity in the room as one in the frame."""
    fall = k.clock[0].fall
    time = fallen_for(k, tick)
    return vx - fall.x * time, vy - fall.y * time


@hook
def squares_in_room(k: Kernel, vx: float, vy: float, tick: int) -> float:
    """Return the square of the speed in the room that a velocity in the frame has."""
    fall = k.clock[0].fall
    time = fallen_for(k, tick)
    vx += fall.x * time
    vy += fall.y * time
    return float(vx * vx + vy * vy)


@hook
def squares_of_height(k: Kernel, x: float, y: float, tick: int) -> float:
    """Return the square of the speed with which a body arrives in the corner (0, 0) of the room that begins
    at rest at a place in the frame, below 0 if it has to be thrown up to there: twice the energy of its
    height, for a mass of 1."""
    fall = k.clock[0].fall
    time = fallen_for(k, tick)
    half = 0.5 * (time * time)
    return float(-2.0 * (fall.x * (x + fall.x * half) + fall.y * (y + fall.y * half)))


def shift_of(gravity: npt.NDArray[np.float64], time: Any) -> tuple[Any, Any]:
    """Return what is added to places and to velocities of a frame, each (..., 2), to have those of the room,
    at times (...) since the frame was at rest. This is the one place that turns a frame into the room."""
    fallen = np.asarray(time)[..., np.newaxis]
    return gravity * (0.5 * (fallen * fallen)), gravity * fallen


def shift_at(scene: Any, epoch: Any, tick: Any) -> tuple[Any, Any]:
    """Return what ``shift_of`` does in a scene at moments (epoch, tick), each in the frame of that moment."""
    since = ((epoch & 1) << 52 | tick) & (scene.frame - 1)  # a frame has 2^53 ticks at most
    return shift_of(np.array(scene.gravity), since * (scene.time_unit / TICKS))


def falls(k: Kernel) -> bool:
    """Whether there is gravity."""
    fall = k.clock[0].fall
    return bool(fall.x != 0.0 or fall.y != 0.0)


def shift_now(k: Kernel, tick: int | None = None) -> tuple[Any, Any]:
    """Return what ``shift_of`` does for the present frame, at the present tick or another one."""
    clock = k.clock[0]
    gravity = np.array([clock.fall.x, clock.fall.y])
    since = (int(clock.now) if tick is None else tick) - int(clock.fall.origin)
    return shift_of(gravity, since * float(clock.tick))


def arena_now(k: Kernel) -> npt.NDArray[np.float64]:
    """Return the lower left and the upper right corner of the arena where they are in the present frame, as a
    drawing needs them; (2, 2), without an arena all 0."""
    limits = k.clock[0].limits
    corners = np.array([[0.0, 0.0], [float(limits.width), float(limits.height)]])
    return corners - shift_now(k)[0] if falls(k) else corners


Slots = npt.NDArray[np.intp]


def places_now(k: Kernel, slots: Slots) -> npt.NDArray[np.float64]:
    """Return (n, 2) where the bodies in some slots are in the room, at the present tick."""
    places = positions_now(k, slots)
    return places + shift_now(k)[0] if falls(k) else places


def velocities_now(k: Kernel, slots: Slots) -> npt.NDArray[np.float64]:
    """Return (n, 2) the velocities in the room of the bodies in some slots, at the present tick."""
    bodies = k.bodies.view(np.ndarray).take(slots)
    velocities = np.column_stack([bodies["vx"], bodies["vy"]])
    return velocities + shift_now(k)[1] if falls(k) else velocities
