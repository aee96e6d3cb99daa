"""Discs of random sizes at random places, the generic scene; equal discs on a grid, the thesis's benchmark.

Radii are drawn uniformly on a logarithmic scale and then scaled together to the requested density. Discs are
placed one after the other, the largest first, each at the first random point with room for it. Equal discs
jam at about 0.547, and long before that most points are refused. If all tries fail, and new starts as well,
the discs start from a lattice instead: hexagonal or square, whichever leaves more room between them. Each
disc has a random site, with room for the largest. Below the density of freezing, some 0.7, the lattice
disappears within some tens of contacts of each disc. If the lattice has no room either, the scene is refused.
"""

import math
from collections.abc import Iterator
from itertools import chain, count, islice
from typing import TypeAlias

import numpy as np

from kinetile import Scene
from kinetile.arrays import Floats
from kinetile_plugins.scenes import numerics
from kinetile_plugins.scenes.numerics import Draws, demand, demand_number, draws

_Levels: TypeAlias = list[tuple[float, dict[tuple[int, int], list[tuple[float, float, float]]]]]
"""For each size of disc, the cells' width and the discs in them: places and radii."""

_STARTS = 10
_TRIES, _TRIES_PER_BODY = 20_000, 20  # for each start


def random_discs(
    *,
    bodies: int = 100,
    density: float = 0.25,
    radius_ratio: float = 1.0,
    mass_ratio: float = 1.0,
    speed: float = 1.0,
    seed: int = 1,
    temperature: float = 0.0,
) -> Scene:
    """Discs of random sizes and masses at random places in the unit square, nowhere overlapping.

    Discs too dense to be placed at random start from a lattice, if it has room for the largest.

    Args:
        bodies: the number of discs
        density: the part of the square that the discs cover, above 0
        radius_ratio: bound of the largest radius over the smallest, 1 or more
        mass_ratio: bound of the heaviest mass over the lightest, which is 1; 1 or more
        speed: of each disc, in sides of the square per unit of time
        seed: of all that is drawn, a whole number from 0
        temperature: instead of speed, the mean kinetic energy of a disc; the total momentum is then 0
    """
    demand_number("bodies", bodies, 0, "a scene has 0 bodies or more")
    numerics.demand_density(density)
    for name, ratio in (("radius_ratio", radius_ratio), ("mass_ratio", mass_ratio)):
        demand(1.0 <= ratio < math.inf, f"{name} is {ratio}; a ratio is finite, and 1 or more")
    for_radii, for_masses, for_places, for_velocities = draws(seed, 4)
    radius = numerics.powers(radius_ratio, for_radii.uniform(bodies))
    radius *= math.sqrt(density / (math.pi * math.fsum(radius * radius))) if bodies else 1.0
    mass = numerics.powers(mass_ratio, for_masses.uniform(bodies))
    velocity = numerics.draw_velocities(speed, temperature, mass, for_velocities)
    position = places(radius, density, 1.0, for_places)
    return Scene(position, velocity, radius, mass, (1.0, 1.0))


def places(radius: Floats, density: float, side: float, random: Draws) -> Floats:
    """Returns (n, 2) places in [0, side]^2 where no two discs, (n,) radii, overlap; raises BadOption, which
    names the ``density``, if none are found."""
    order = np.argsort(-radius, kind="stable")
    tries = _TRIES + _TRIES_PER_BODY * len(radius)
    most = 0
    for _ in range(_STARTS):
        placed = list(_at_random(radius[order].tolist(), tries, side, random))
        most = max(most, len(placed))
        if most == len(radius):
            position = np.empty((len(radius), 2))
            position[order] = np.array(placed).reshape(-1, 2)
            return position
    reached = density * math.fsum(radius[order[:most]] ** 2) / math.fsum(radius**2)
    lattice, widest = _lattice(len(radius))
    largest = 2.0 * float(radius.max())
    limit = math.pi * math.fsum(radius**2) * (widest / largest) ** 2
    demand(
        widest * side >= largest,
        f"density is {density}; random placement came to {reached:.3f} ({most} of {len(radius)} discs), and "
        f"a lattice with room for the largest at each site has {limit:.3f}; ask for less, for radii that "
        "differ less, or for equal discs as the recipe 'hexagonal' has them",
    )
    return side * lattice[random.order(len(lattice))[: len(radius)]]


def _at_random(radius: list[float], tries: int, side: float, random: Draws) -> Iterator[tuple[float, float]]:
    """Yields places for discs in descending order of radius, until all have one or no tries are left. Placed
    discs are in cells by size, a power of two: a smaller disc overlaps only discs in nine cells."""
    levels: _Levels = []
    blocks = (random.uniform(1024, 2).tolist() for _ in count())
    points = islice(chain.from_iterable(blocks), tries)
    for r in radius:
        if r > 0.5 * side:
            return
        part, exponent = math.frexp(2.0 * r)
        width = math.ldexp(1.0, exponent if part > 0.5 else exponent - 1)  # the next power of two
        if not levels or levels[-1][0] != width:
            levels.append((width, {}))
        for point in points:
            x, y = (r + part * (side - 2.0 * r) for part in point)
            if _has_room(x, y, r, levels):
                break
        else:
            return  # the tries have run out
        cells = levels[-1][1]
        cells.setdefault((int(x / width), int(y / width)), []).append((x, y, r))
        yield x, y


def _has_room(x: float, y: float, r: float, levels: _Levels) -> bool:
    for width, cells in levels:
        column, row = int(x / width), int(y / width)
        for i in (column, column - 1, column + 1):
            for j in (row, row - 1, row + 1):
                for other_x, other_y, other_r in cells.get((i, j), ()):
                    across, up, reach = x - other_x, y - other_y, r + other_r
                    if across * across + up * up <= reach * reach:
                        return False
    return True


def _lattice(bodies: int) -> tuple[Floats, float]:
    """Returns the sites of the roomiest lattice for this many bodies, and the widest diameter that fits."""
    rows = np.arange(1, bodies + 1)
    columns = -(-bodies // rows)
    height = 1.0 + (rows - 1) * math.sqrt(0.75)
    hexagonal = np.minimum(1.0 / (columns + 0.5), 1.0 / height)
    square = np.minimum(1.0 / columns, 1.0 / rows)
    best = int(np.argmax(np.maximum(hexagonal, square)))
    across, up = int(columns[best]), int(rows[best])
    row, column = np.divmod(np.arange(across * up), across)
    if square[best] >= hexagonal[best]:
        return np.stack([(column + 0.5) / across, (row + 0.5) / up], axis=1), float(square[best])
    x = (column + 0.5 + 0.5 * (row % 2)) / (across + 0.5)
    y = (row * math.sqrt(0.75) + 0.5) / height[best]
    return np.stack([x, y], axis=1), float(hexagonal[best])


def grid(
    *, bodies: int = 400, density: float = 0.5, seed: int = 1, speed: float = 1.0, temperature: float = 0.0
) -> Scene:
    """The thesis's benchmark: one disc in the middle of each square of a grid, moving in a random direction.

    Args:
        bodies: the number of discs; if it is no square, the end of the last row is empty
        density: the part of the unit square that they cover, below pi / 4, where they would touch
        seed: of all that is drawn, a whole number from 0
        speed: of each disc, in sides of the square per unit of time
        temperature: instead of speed, the mean kinetic energy of a disc; the total momentum is then 0
    """
    demand_number("bodies", bodies, 1, "a grid has 1 body or more")
    columns = math.isqrt(bodies - 1) + 1
    rows = -(-bodies // columns)
    limit = math.pi / 4 * bodies / columns**2
    demand(
        0.0 < density < limit,
        f"density is {density}; it is above 0, and below pi / 4 * {bodies} / {columns}**2 = {limit:.3f}, "
        f"where {bodies} discs would touch",
    )
    radius = math.sqrt(density / (bodies * math.pi))
    (random,) = draws(seed, 1)
    velocity = numerics.draw_velocities(speed, temperature, np.ones(bodies), random)
    row, column = np.divmod(np.arange(bodies), columns)
    position = np.stack([(column + 0.5) / columns, (row + 0.5) / rows], axis=1)
    return Scene(position, velocity, radius, arena=(1.0, 1.0))
