"""Small scenes with known answers: a cradle, a billiard break, and two discs in a box."""

from __future__ import annotations

import math

import numpy as np

from kinetile import Scene
from kinetile_plugins.scenes._terms import demand, demand_number, demand_speed, generators

__all__ = ["billiard_break", "cradle", "two_discs"]


def cradle(*, bodies: int = 5, moving: int = 1) -> Scene:
    """A row of touching discs, struck at one end: as many leave at the other end as came.

    Newton's cradle, lying down: what leaves comes back from the wall and strikes again. All coordinates are
    multiples of a power of two, so every contact time is exact. The ``moving`` discs come from the left at
    speed 1.
    """
    demand(bodies >= 2, f"bodies is {bodies}; a cradle has 2 bodies or more")
    demand(0 < moving < bodies, f"moving is {moving}; it is from 1 to {bodies - 1}, less than the bodies")
    demand_number("bodies", bodies)
    radius, gap = 0.125, 1.0
    width = 2.0 * gap + 2.0 * radius * bodies
    position = np.full((bodies, 2), 0.5)
    position[:, 0] = gap + radius * (2.0 * np.arange(bodies) + 1.0)
    position[:moving, 0] -= gap / 2.0
    velocity = np.zeros((bodies, 2))
    velocity[:moving, 0] = 1.0
    return Scene(position, velocity, radius, arena=(width, 1.0))


def billiard_break(*, speed: float = 8.0, aim: float = 0.0) -> Scene:
    """A billiard break: the cue ball runs into fifteen balls racked in a touching triangle.

    Metres, seconds and kilograms: the cushions are 2.54 by 1.27, a ball has a diameter of 57.15 mm.
    ``speed`` is the cue ball's, ``aim`` its angle to the table's long axis in radians. There is no
    friction: the balls do not stop. With no angle everything is symmetric, and contacts that share a ball
    fall on one instant.
    """
    demand(math.isfinite(speed) and math.isfinite(aim), f"speed is {speed} and aim is {aim}; both are finite")
    demand_speed(speed)
    width, height, radius = 2.54, 1.27, 0.028575
    centres = [(width / 4.0, height / 2.0)]
    for row in range(5):
        x = 0.75 * width + row * math.sqrt(3.0) * radius
        centres += [(x, height / 2.0 + (2 * place - row) * radius) for place in range(row + 1)]
    velocity = np.zeros((len(centres), 2))
    velocity[0] = speed * math.cos(aim), speed * math.sin(aim)
    return Scene(centres, velocity, radius, 0.17, (width, height))


def two_discs(*, radius: float = 0.15, seed: int = 1) -> Scene:
    """Two discs in the unit square, at a random point of their energy surface: mean rates are known exactly.

    The places are drawn evenly from all that do not overlap, the velocities from all whose squares add up
    to 2. For such a start the mean times between contacts, and between contacts with a wall, are those of
    the microcanonical ensemble (Zapfe, Sanders and Rodríguez-Mota, arXiv:1908.04749).
    """
    roomy = 0.0 < radius <= 0.25
    demand(roomy, f"radius is {radius}; it is above 0 and at most 0.25, beyond which two hardly have room")
    (random,) = generators(seed, 1)
    velocity = random.normal(size=(2, 2))
    velocity *= math.sqrt(2.0 / float(np.sum(velocity**2)))
    while True:
        position = random.uniform(radius, 1.0 - radius, (2, 2))
        if math.dist(*position.tolist()) >= 2.0 * radius:
            return Scene(position, velocity, radius, arena=(1.0, 1.0))
