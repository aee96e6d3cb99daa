"""Discs of random sizes at random places, the generic scene; equal discs on a grid, the thesis's benchmark.


Radii are drawn evenly on a logarithmic scale and then scaled together to the requested density.
Discs are placed one after the other, the largest first, each at the first random point with room for
it. This ends at some density: equal discs jam at about 0.547, and long before that most
points are refused. If all tries fail, and new starts do not help, equal discs start from a lattice
instead: hexagonal or square, whichever leaves more room between them, stretched to fill the square; the
empty sites are drawn at random. They forget the lattice after a few contacts each. For
unequal discs there is no such start, and the scene is refused.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from kinetile import Scene
from kinetile.errors import BadOption
from kinetile.scene.checks import HEAVIEST
from kinetile_plugins.scenes.numerics import (
    Draws,
    Floats,
    demand,
    demand_number,
    demand_size,
    draws,
    in_random_directions,
    powers,
)

_Levels: TypeAlias = list[tuple[float, dict[tuple[int, int], list[tuple[float, float, float]]]]]
"""For each size of disc, the cells' width and what lies in them: places and radii."""

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
) -> Scene:
    """Discs of random sizes and masses at random places in the unit square, nowhere overlapping.

    ``density`` is the part of the square that they cover. The largest radius is up to ``radius_ratio`` times
    the smallest, the heaviest mass up to ``mass_ratio`` times the lightest, which is 1 or more. All have the
    same speed. Equal discs too dense to be placed at random start from a lattice.
    """
    demand_number("bodies", bodies, 0, "a scene has 0 bodies or more")
    demand(0.0 < density < 1.0, f"density is {density}; it is above 0 and below 1")
    for name, ratio in (("radius_ratio", radius_ratio), ("mass_ratio", mass_ratio)):
        demand(1.0 <= ratio < math.inf, f"{name} is {ratio}; a ratio is finite, and 1 or more")
        demand(ratio <= HEAVIEST, f"{name} is {ratio}; it is at most 2**100 ({HEAVIEST:.1e})")
    for_radii, for_masses, for_places, for_velocities = draws(seed, 4)
    radius = powers(radius_ratio, for_radii.uniform(bodies))
    radius *= math.sqrt(density / (math.pi * math.fsum(radius * radius))) if bodies else 1.0
    demand_size(density, min(radius.tolist(), default=1.0))
    velocity = in_random_directions(speed, bodies, for_velocities)
    mass = powers(mass_ratio, for_masses.uniform(bodies))
    position = _places(radius, density, radius_ratio == 1.0, for_places)
    return Scene(position, velocity, radius, mass, (1.0, 1.0))


def _places(radius: Floats, density: float, equal: bool, random: Draws) -> Floats:
    """Returns (n, 2) places where no two discs overlap; raises BadOption if none are found."""
    order = np.argsort(-radius, kind="stable")
    tries = _TRIES + _TRIES_PER_BODY * len(radius)
    most = 0
    for _ in range(_STARTS):
        placed = list(_at_random(radius[order].tolist(), tries, random))
        most = max(most, len(placed))
        if most == len(radius):
            position = np.empty((len(radius), 2))
            position[order] = np.array(placed).reshape(-1, 2)
            return position
    reached = math.pi * math.fsum(radius[order[:most]] ** 2)
    refusal = f"density is {density}; random placement came to {reached:.3f} ({most} of {len(radius)} discs)"
    if not equal:
        raise BadOption(f"{refusal}; ask for less, or for equal radii, which can start from a lattice")
    lattice, widest = _lattice(len(radius))
    limit = math.pi * len(radius) * widest**2 / 4.0
    demand(widest >= 2.0 * radius[0], f"{refusal}, and a lattice has room for {limit:.3f}; ask for less")
    return lattice[random.order(len(lattice))[: len(radius)]]


def _at_random(radius: list[float], tries: int, random: Draws) -> Iterator[tuple[float, float]]:
    """Yields places for discs in descending order of radius, until all have one or the tries run out.

    Placed discs are kept by size, a power of two each, in cells of that width: a disc that is not larger than
    they are can overlap only those in the nine cells around it.
    """
    levels: _Levels = []
    points: Iterator[list[float]] = iter(())
    for r in radius:
        if r > 0.5:
            return
        width = _power_of_two_above(2.0 * r)
        if not levels or levels[-1][0] != width:
            levels.append((width, {}))
        while True:
            if tries == 0:
                return
            tries -= 1
            point = next(points, None)
            if point is None:
                points = iter(random.uniform(1024, 2).tolist())
                point = next(points)
            x, y = (r + part * (1.0 - 2.0 * r) for part in point)
            if _has_room(x, y, r, levels):
                break
        cells = levels[-1][1]
        cells.setdefault((int(x / width), int(y / width)), []).append((x, y, r))
        yield x, y


def _power_of_two_above(length: float) -> float:
    """Returns the least power of two that is not below a length."""
    part, exponent = math.frexp(length)
    return math.ldexp(1.0, exponent if part > 0.5 else exponent - 1)


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


def grid(*, bodies: int = 400, density: float = 0.5, seed: int = 1, speed: float = 1.0) -> Scene:
    """The thesis's benchmark: one disc in the middle of each square of a grid, moving in a random direction.

    ``bodies`` is a square number; ``density`` is the part of the unit square that the discs cover, below
    pi / 4, where they would touch; ``speed`` is in sides of the square per unit of time.
    """
    side = math.isqrt(max(bodies, 0))
    near = " or ".join(str(each * each) for each in (side, side + 1) if each)
    square = bodies >= 1 and side * side == bodies
    demand(square, f"bodies is {bodies}; a grid needs a square number of bodies, such as {near}")
    demand_number("bodies", bodies, 1, "a grid has 1 body or more")
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
