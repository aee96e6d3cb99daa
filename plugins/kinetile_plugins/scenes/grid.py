"""The thesis's benchmark (section 5.3): equal discs on a square grid, set off in random directions.

The unit square is divided into equal squares, one for each disc. The thesis says that a disc is put into each; here
it is put into the middle. All start with the same speed, so that the kinetic energy is the same for every
seed. The mass is not given there and does not matter, since all discs are alike.
"""

from __future__ import annotations

import math

import numpy as np

from kinetile import Scene
from kinetile.errors import BadOption

__all__ = ["grid"]


def grid(*, bodies: int = 400, density: float = 0.5, seed: int = 1, speed: float = 1.0) -> Scene:
    """The thesis's benchmark: one disc in the middle of each square of a grid, moving in a random direction.

    ``bodies`` is a square number, m * m; ``density`` the part of the unit square that the discs cover, below pi / 4,
    where they would touch; ``speed`` is in sides of the square per unit of time.
    """
    side = math.isqrt(max(bodies, 0))
    if bodies < 1 or side * side != bodies:
        near = [each * each for each in (side, side + 1) if each]
        raise BadOption(
            f"bodies is {bodies}; the grid needs a square number of bodies, such as {' or '.join(map(str, near))}"
        )
    if not 0.0 < density < math.pi / 4:
        raise BadOption(
            f"density is {density}; the grid needs a density above 0 and below pi / 4 = 0.785, where its discs touch"
        )
    if seed < 0 or not math.isfinite(speed):
        raise BadOption(f"seed is {seed} and speed is {speed}; a seed is 0 or more, and a speed is finite")
    cell = np.arange(bodies)
    position = (np.stack([cell % side, cell // side], axis=1) + 0.5) / side
    direction = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, bodies)
    velocity = speed * np.stack([np.cos(direction), np.sin(direction)], axis=1)
    return Scene(position, velocity, math.sqrt(density / (bodies * math.pi)), arena=(1.0, 1.0))
