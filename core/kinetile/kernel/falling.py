"""Gravity: bodies in a frame that falls with them, in which they fly straight.

All bodies have the same acceleration, so a frame of reference can have it. In such a frame every plan is
straight, and pairs, broad phases and the queue have nothing to do with gravity; only walls move, and their
narrow phase knows that (``certificates.falling``). ``clock.fall`` has the acceleration and the tick at which
the present frame was at rest: its *origin*. A body of the frame is in the room, at a tick T, at its place + g
(T - origin)^2 / 2, and has its velocity + g (T - origin), in time. So ``k.bodies`` has velocities and places
of the frame, and all that is read out has those of the room (``fallen``).

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
from kinetile.kernel.compiled import hook, python_of, template
from kinetile.kernel.flight import plans_now, positions_now
from kinetile.kernel.plan import velocities_after
from kinetile.kernel.tables import Kernel, Records

FALLING = False


@hook
def fallen(k: Kernel, tick: int) -> tuple[float, float, float, float]:
    """Return what a place (x, y) and a velocity (x, y) in the room have more than in the present frame, at a
    tick. The time since the frame was at rest is exact."""
    clock = k.clock[0]
    time = float(tick - clock.fall.origin) * clock.tick
    half = 0.5 * (time * time)
    return clock.fall.x * half, clock.fall.y * half, clock.fall.x * time, clock.fall.y * time


@hook
def shift_plan(k: Kernel, plan: Records, way: float) -> None:
    """Make a plan of the frame one of the room, at its anchor; or the other way round, if ``way`` is not 1
    but -1."""
    x, y, vx, vy = fallen(k, plan.anchor)
    plan.x += way * x
    plan.y += way * y
    plan.vx += way * vx
    plan.vy += way * vy


@template
def squares_in_room(k: Kernel, plan: Records) -> float:
    """Return the square of the speed in the room that a plan has at its anchor."""
    vx = plan.vx
    vy = plan.vy
    if FALLING:
        _, _, more_x, more_y = fallen(k, plan.anchor)
        vx += more_x
        vy += more_y
    return float(vx * vx + vy * vy)


@template
def twice_energy(k: Kernel, plan: Records) -> float:
    """Return twice the energy that a mass of 1 has in the room, at the anchor of its plan: the square of its
    speed, and with gravity that of the speed with which it arrives in the corner (0, 0) if it begins at rest
    where it is; below 0 if it has to be thrown up to there."""
    squares = squares_in_room(k, plan)
    if FALLING:
        fall = k.clock[0].fall
        x, y, _, _ = fallen(k, plan.anchor)
        squares -= 2.0 * (fall.x * (plan.x + x) + fall.y * (plan.y + y))
    return squares


def shift_at(scene: Any, epoch: Any, tick: Any) -> npt.NDArray[np.float64]:
    """Return what ``fallen`` does in a scene at moments (...) of (epoch, tick), each in the frame of that
    moment, (..., 4)."""
    since = ((epoch & 1) << 52 | tick) & (scene.frame - 1)  # a frame has 2^53 ticks at most
    time = np.asarray(since * (scene.time_unit / TICKS))[..., np.newaxis]
    gravity = np.array(scene.gravity)
    return np.concatenate([gravity * (0.5 * (time * time)), gravity * time], axis=-1)


def shift_now(k: Kernel, tick: int | None = None) -> npt.NDArray[np.float64]:
    """Return what ``fallen`` does at the present tick, or at another one, (4,)."""
    return np.array(python_of(fallen)(k, int(k.clock[0].now) if tick is None else tick))


def falls(k: Kernel) -> bool:
    """Whether there is gravity."""
    fall = k.clock[0].fall
    return bool(fall.x != 0.0 or fall.y != 0.0)


def arena_now(k: Kernel) -> npt.NDArray[np.float64]:
    """Return the lower left and the upper right corner of the arena where they are in the present frame, as a
    drawing needs them; (2, 2), without an arena all 0."""
    limits = k.clock[0].limits
    corners = np.array([[0.0, 0.0], [float(limits.width), float(limits.height)]])
    return np.asarray(corners - shift_now(k)[:2])


Slots = npt.NDArray[np.intp]


def places_now(k: Kernel, slots: Slots) -> npt.NDArray[np.float64]:
    """Return (n, 2) where the bodies in some slots are in the room, at the present tick."""
    places = positions_now(k, slots)
    return places + shift_now(k)[:2] if falls(k) else places


def velocities_now(k: Kernel, slots: Slots) -> npt.NDArray[np.float64]:
    """Return (n, 2) the velocities in the room of the bodies in some slots, at the present tick."""
    velocities = velocities_after(*plans_now(k, slots))
    return velocities + shift_now(k)[2:] if falls(k) else velocities
