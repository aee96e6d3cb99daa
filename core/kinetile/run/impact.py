"""What happened at a contact: its normal, the closing speed and the impulse.

The loop keeps the velocities before its last contact, and the normal where a response needed one. An elastic
contact of bodies that fall alike needs none: then the narrow phase computes the same one here, once more.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from kinetile.kernel.flight import plans_now
from kinetile.kernel.plan import positions_after, velocities_after
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
    before, after = _velocities(engine, a, b, passes)
    normal = _normal(engine, a, b, before, passes)
    speed = None
    if normal is not None:
        (vx, vy), (wx, wy) = before
        speed = (vx - wx) * normal[0] + (vy - wy) * normal[1]
    return Impact(normal, speed, _impulse(engine, a, b, before, after))


def _velocities(engine: Engine, a: int, b: int, passes: bool) -> tuple[list[Vector], list[Vector]]:
    """Returns the velocities of both before the contact, and after it; a wall's are 0."""
    k = engine.k
    if passes:
        flies = [(x, y) for x, y in velocities_after(*plans_now(k, np.array([a, b]))).tolist()]
        return flies, flies
    meeting, one = k.clock[0].meeting, k.bodies[a]
    before = [(float(meeting.avx), float(meeting.avy)), (0.0, 0.0)]
    after = [(float(one.vx), float(one.vy)), (0.0, 0.0)]
    if b >= 0:
        two = k.bodies[b]
        before[1], after[1] = (float(meeting.bvx), float(meeting.bvy)), (float(two.vx), float(two.vy))
    return before, after


def _impulse(engine: Engine, a: int, b: int, before: list[Vector], after: list[Vector]) -> Vector:
    """Returns the momentum that the second one has received from the first: the mean of what the second has
    gained and the first has lost, or one of these if the other is immovable."""
    if before == after:
        return 0.0, 0.0
    mass = engine.k.mass
    given = [
        (sign * float(mass[slot]) * (wx - vx) + 0.0, sign * float(mass[slot]) * (wy - vy) + 0.0)  # no -0.0
        for sign, slot, (vx, vy), (wx, wy) in zip((-1.0, 1.0), (a, b), before, after, strict=True)
        if slot >= 0 and mass[slot] < math.inf
    ]
    if not given:
        return math.nan, math.nan
    return 0.5 * (given[0][0] + given[-1][0]), 0.5 * (given[0][1] + given[-1][1])


def _normal(engine: Engine, a: int, b: int, before: list[Vector], passes: bool) -> Vector | None:
    k, composition = engine.k, engine.composition
    meeting = k.clock[0].meeting
    if not passes and (meeting.nx != 0.0 or meeting.ny != 0.0):
        return float(meeting.nx), float(meeting.ny)
    phase = composition.pair if b >= 0 else composition.wall
    if phase is None or phase.touch is None:
        return None
    with _at_contact(engine, [a, b] if b >= 0 else [a], before, passes):
        nx, ny, depth = phase.touch(k, a, b) if b >= 0 else phase.touch(k, k.bodies[a], b)
    if passes and depth > k.clock[0].limits.tolerance + 1e-9 * (k.bodies[a].radius + k.bodies[b].radius):
        return None  # one was put into the other by a command
    return (float(nx), float(ny)) if nx == nx else None


@contextmanager
def _at_contact(engine: Engine, slots: list[int], before: list[Vector], passes: bool) -> Iterator[None]:
    """Has the plans of bodies be those of their contact for a while, anchored there."""
    k = engine.k
    bodies: Any = k.bodies.view(np.ndarray)
    torus: Any = k.clock.view(np.ndarray)["torus"]
    kept, through = bodies[slots], torus.copy()
    try:
        if passes:
            bodies["x"][slots], bodies["y"][slots] = positions_after(*plans_now(k, np.array(slots))).T
            bodies["anchor"][slots] = k.clock[0].now
            if len(k.images):
                right, up = _through(engine, *slots)
                torus["right"], torus["up"] = right * torus["x"], up * torus["y"]
        for name, values in zip(("vx", "vy"), zip(*before, strict=True), strict=True):
            bodies[name][slots] = values[: len(slots)]
        yield
    finally:
        bodies[slots], torus[...] = kept, through


def _through(engine: Engine, a: int, b: int) -> Vector:
    """Returns the periods from b's place to the image through which the two have begun to pass."""
    k = engine.k
    pairs = k.passings.view(np.ndarray)
    pairs = pairs[((pairs["a"] == a) & (pairs["b"] == b)) | ((pairs["a"] == b) & (pairs["b"] == a))]
    latest = pairs[np.argmax(pairs["begun"])]
    one, two = k.images[a], k.images[b]
    return float(latest["m"] + two.kx - one.kx), float(latest["n"] + two.ky - one.ky)
