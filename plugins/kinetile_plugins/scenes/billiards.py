"""Small scenes with known answers: a cradle, a billiard break, and two discs in a box."""

from __future__ import annotations

import math

import numpy as np

from kinetile import Scene
from kinetile_plugins.scenes._draws import Draws, Floats
from kinetile_plugins.scenes._functions import cosine_and_sine
from kinetile_plugins.scenes._terms import demand, demand_number, demand_speed, draws

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
    ``speed`` is the cue ball's, ``aim`` its angle to the table's long axis in radians, at most a whole turn.
    There is no friction: the balls do not stop. With no angle everything is symmetric, and contacts that
    share a ball fall on one instant.
    """
    demand(abs(aim) <= 2.0 * math.pi, f"aim is {aim}; it is at most a whole turn, 2 pi = 6.283, in size")
    demand_speed(speed)
    width, height, radius = 2.54, 1.27, 0.028575
    centres = [(width / 4.0, height / 2.0)]
    for row in range(5):
        x = 0.75 * width + row * math.sqrt(3.0) * radius
        centres += [(x, height / 2.0 + (2 * place - row) * radius) for place in range(row + 1)]
    velocity = np.zeros((len(centres), 2))
    velocity[0] = speed * np.concatenate(cosine_and_sine(np.array([aim])))
    return Scene(centres, velocity, radius, 0.17, (width, height))


def two_discs(*, radius: float = 0.15, seed: int = 1) -> Scene:
    """Two discs in the unit square, at a random point of their energy surface: mean rates are known exactly.

    The places are drawn evenly from all that do not overlap, the velocities from all whose squares add up
    to 2. For such a start the mean times between contacts, and between contacts with a wall, are those of
    the microcanonical ensemble (Zapfe, Sanders and Rodríguez-Mota, arXiv:1908.04749).
    """
    roomy = 0.0 < radius <= 0.25
    demand(roomy, f"radius is {radius}; it is above 0 and at most 0.25, beyond which two hardly have room")
    (random,) = draws(seed, 1)
    one, its_square = _in_unit_disc(random)
    other, square = _in_unit_disc(random)
    share = math.sqrt((1.0 - its_square) / square)
    velocity = math.sqrt(2.0) * np.stack([one, share * other])
    room = (1.0 - radius) - radius
    while True:
        position = radius + room * random.uniform(2, 2)
        across, up = (position[1] - position[0]).tolist()
        if across * across + up * up >= 4.0 * radius * radius:
            return Scene(position, velocity, radius, arena=(1.0, 1.0))


def _in_unit_disc(random: Draws) -> tuple[Floats, float]:
    """Return a random point of the unit disc, not its centre, and the square of its distance from it.

    Two of them make a random point of the sphere in four dimensions (Marsaglia, 1972).
    """
    while True:
        point = 2.0 * random.uniform(2) - 1.0
        square = float(point[0] * point[0] + point[1] * point[1])
        if 0.0 < square < 1.0:
            return point, square
