"""The thesis's benchmark (section 5.3): equal discs on a square grid, set off in random directions.

The unit square is divided into equal squares, one for each disc. The thesis says that a disc is put into
each; here it is put into the middle. All start with the same speed, so that the kinetic energy is the same
for every seed. The mass is not given there and does not matter, since all discs are alike.
"""

from __future__ import annotations

import math

import numpy as np

from kinetile import Scene
from kinetile_plugins.scenes._terms import demand, demand_number, demand_size, draws, in_random_directions

__all__ = ["grid"]


def grid(*, bodies: int = 400, density: float = 0.5, seed: int = 1, speed: float = 1.0) -> Scene:
    """The thesis's benchmark: one disc in the middle of each square of a grid, moving in a random direction.

    ``bodies`` is a square number; ``density`` is the part of the unit square that the discs cover, below
    pi / 4, where they would touch; ``speed`` is in sides of the square per unit of time.
    """
    side = math.isqrt(max(bodies, 0))
    near = " or ".join(str(each * each) for each in (side, side + 1) if each)
    square = bodies >= 1 and side * side == bodies
    demand(square, f"bodies is {bodies}; a grid needs a square number of bodies, such as {near}")
    demand_number("bodies", bodies)
    sparse = 0.0 < density < math.pi / 4
    demand(
        sparse, f"density is {density}; it is above 0, and below pi / 4 = 0.785, where the discs would touch"
    )
    radius = math.sqrt(density / (bodies * math.pi))
    demand_size(density, radius)
    (random,) = draws(seed, 1)
    velocity = in_random_directions(speed, bodies, random)
    cell = np.arange(bodies)
    position = (np.stack([cell % side, cell // side], axis=1) + 0.5) / side
    return Scene(position, velocity, radius, arena=(1.0, 1.0))
