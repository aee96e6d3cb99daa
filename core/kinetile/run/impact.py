"""What happened at a contact: its normal, the closing speed and the impulse.

The loop keeps the velocities before its last contact, for two instructions a contact. The normal it computes
only for some responses: the narrow phase computes it here once more, from the plans as they were.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from kinetile.kernel.compiled import python_of
from kinetile.kernel.flight import plans_now
from kinetile.kernel.plan import positions_after, velocities_after
from kinetile.kernel.rest import is_held_by
from kinetile.run.engine.engine import Engine

Vector = tuple[float, float]


class Impact(NamedTuple):
    """A contact: see ``Event``."""

    normal: Vector | None = None
    closing_speed: float | None = None
    impulse: Vector | None = None


def impact_of(engine: Engine, a: int, b: int, passes: bool) -> Impact:
    """Returns what happened at the contact that was the engine's last event: of the bodies in two slots, a
    the elder, or of a body and a wall (b below 0); ``passes``: the two begin to pass each other."""
    if passes:
        return _of_passing(engine, a, b)
    k = engine.packed[0].plain
    meeting, one, two = k.clock[0].meeting, k.bodies[a], k.bodies[b] if b >= 0 else None
    before = [_vector(meeting.avx, meeting.avy), (0.0, 0.0)]
    after = [_vector(one.vx, one.vy), (0.0, 0.0)]
    if two is not None:
        before[1], after[1] = _vector(meeting.bvx, meeting.bvy), _vector(two.vx, two.vy)
    bodies = [one] if two is None else [one, two]
    resting = bodies if engine.scene.resting else []
    pulls = [(body.ax, body.ay) for body in resting]
    try:
        _set_velocities(bodies, before)
        for body in resting:  # what held it until then
            body.ax, body.ay = body.was_x, body.was_y
        normal = _normal(engine, k, a, b)[0]
    finally:
        _set_velocities(bodies, after)
        for body, (ax, ay) in zip(resting, pulls, strict=True):
            body.ax, body.ay = ax, ay
    speed = None if normal is None else _closing(before, normal)
    return Impact(normal, speed, _impulse(engine, a, b, before, after))


def _of_passing(engine: Engine, a: int, b: int) -> Impact:
    """Returns the impact of two that begin to pass now; none if one was put into the other."""
    k, slots = engine.k, np.array([a, b])
    bodies: Any = k.bodies.view(np.ndarray)
    torus: Any = k.clock.view(np.ndarray)["torus"]
    kept, through, plans = bodies[slots], torus.copy(), plans_now(k, slots)
    velocities = velocities_after(*plans)
    try:
        bodies["x"][slots], bodies["y"][slots] = positions_after(*plans).T
        bodies["vx"][slots], bodies["vy"][slots] = velocities.T
        bodies["anchor"][slots] = k.clock[0].now
        if len(k.images):
            right, up = _through(engine, a, b)
            torus["right"], torus["up"] = right * torus["x"], up * torus["y"]
        normal, depth = _normal(engine, k, a, b)
    finally:
        bodies[slots], torus[...] = kept, through
    reach = float(kept["radius"].sum())
    if normal is None or depth > k.clock[0].limits.tolerance + 1e-9 * reach:
        return Impact()
    return Impact(normal, _closing(velocities.tolist(), normal), (0.0, 0.0))


def _vector(x: Any, y: Any) -> Vector:
    return float(x) + 0.0, float(y) + 0.0  # no -0.0


def _set_velocities(bodies: list[Any], velocities: list[Vector]) -> None:
    for body, (vx, vy) in zip(bodies, velocities, strict=False):
        body.vx, body.vy = vx, vy


def _normal(engine: Engine, k: Any, a: int, b: int) -> tuple[Vector | None, float]:
    """Returns the normal at a contact, if the narrow phase tells it, and the depth of the overlap."""
    phase = engine.composition.pair if b >= 0 else engine.composition.wall
    if phase is None or phase.touch is None:
        return None, 0.0
    nx, ny, depth = python_of(phase.touch)(k, a if b >= 0 else k.bodies[a], b)
    return (_vector(nx, ny) if nx == nx else None), float(depth)


def _closing(velocities: list[Vector], normal: Vector) -> float:
    (vx, vy), (wx, wy) = velocities
    return float((vx - wx) * normal[0] + (vy - wy) * normal[1]) + 0.0


def _impulse(engine: Engine, a: int, b: int, before: list[Vector], after: list[Vector]) -> Vector:
    """Returns the momentum that the second one has received from the first, by the change of the lighter one:
    a heavier one's velocity hardly changes, and is rounded; or of the one that rests on the other now. Of two
    equals it is the mean, so that their order does not matter where a response takes momentum from both.
    """
    if before == after:
        return 0.0, 0.0
    masses = [float(engine.k.mass[a]), float(engine.k.mass[b]) if b >= 0 else math.inf]
    if b >= 0 and engine.scene.resting:  # one that rests itself passes on what it receives
        k, holds = engine.packed[0].plain, python_of(is_held_by)
        masses = [math.inf if holds(k, b, a) else masses[0], math.inf if holds(k, a, b) else masses[1]]
    if (mass := min(masses)) == math.inf:
        return math.nan, math.nan
    given = [
        (sign * mass * (wx - vx), sign * mass * (wy - vy))
        for sign, own, (vx, vy), (wx, wy) in zip((-1.0, 1.0), masses, before, after, strict=True)
        if own == mass
    ]
    x, y = (sum(values) / len(given) for values in zip(*given, strict=True))
    return x + 0.0, y + 0.0  # no -0.0


def _through(engine: Engine, a: int, b: int) -> Vector:
    """Returns the periods from b's place to the image through which the two have begun to pass."""
    k = engine.k
    pairs = k.passings.view(np.ndarray)
    pairs = pairs[((pairs["a"] == a) & (pairs["b"] == b)) | ((pairs["a"] == b) & (pairs["b"] == a))]
    latest = pairs[np.argmax(pairs["begun"])]
    one, two = k.images[a], k.images[b]
    return float(latest["m"] + two.kx - one.kx), float(latest["n"] + two.ky - one.ky)
