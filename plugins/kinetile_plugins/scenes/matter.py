"""Starts of simulations of hard discs as matter: mixtures of sizes, and crystals with vacancies.

Radii are the given lengths, and the arena follows from the density. Velocities are drawn from Maxwell's
distribution at a temperature, the mean kinetic energy of a body; the total momentum is 0. Between walls the
temperature is kT; on a torus kT is N/(N - 1) of it (docs/observables.md).
"""

import math
from fractions import Fraction

import numpy as np

from kinetile import Scene
from kinetile.arrays import Floats, Integers
from kinetile_plugins.scenes import numerics
from kinetile_plugins.scenes.numerics import demand, demand_in_range, demand_number, draws
from kinetile_plugins.scenes.random_discs import places


def mixture(
    *,
    bodies: int = 100,
    density: float = 0.5,
    radii: tuple[float, ...] = (0.5, 0.7),
    fractions: tuple[float, ...] = (),
    mass: str = "equal",
    masses: tuple[float, ...] = (),
    temperature: float = 1.0,
    seed: int = 1,
) -> Scene:
    """Discs of two and more sizes at random places in a square, nowhere overlapping, at a temperature.

    Discs are numbered by size, in the order of ``radii``. The side of the square follows from ``density``. On
    a torus kT is N/(N - 1) of ``temperature``. A mixture too dense for random places, from 0.48 (equal radii)
    to 0.56, starts from a lattice, if it has room for the largest radius at each site: for equal numbers of
    radii 0.5 and 0.7 up to 0.59 (100 discs) or 0.67 (4,000).

    Args:
        bodies: the number of discs
        density: the part of the square that they cover
        radii: of each size, lengths
        fractions: the part of each size, in proportion, by largest remainders; left out, all are equal
        mass: equal (1) or area (in proportion to the square of the radius, 1 for the first)
        masses: instead of mass, the mass of each size
        temperature: the mean kinetic energy of a disc, above 0
        seed: of all that is drawn, a whole number from 0
    """
    numerics.demand_density(density)
    radius, every_mass = sizes_and_masses(bodies, radii, fractions, mass, masses)
    for_places, for_velocities = draws(seed, 2)
    side = side_of_square(radius, density)
    velocity = numerics.maxwell(temperature, every_mass, for_velocities)
    position = places(radius, density, side, for_places)
    return Scene(position, velocity, radius, every_mass, (side, side))


def side_of_square(radius: Floats, density: float) -> float:
    """Returns the side of a square if discs of these radii cover the part ``density`` of it."""
    area = math.pi * math.fsum(radius * radius) / density
    demand(area < math.inf, f"density is {density}; expected more, for a square of finite size")
    return math.sqrt(area)


def sizes_and_masses(
    bodies: int, radii: tuple[float, ...], fractions: tuple[float, ...], mass: str, masses: tuple[float, ...]
) -> tuple[Floats, Floats]:
    """Returns radius and mass of each disc, in the order of ``radii``, for the parameters of ``mixture``."""
    radius_of = _numbers("radii", radii, len(radii))
    demand(bool(radii), "radii are left empty; a mixture has one radius or more")
    numbers = _numbers_of(bodies, len(radii), fractions)
    demand(mass in ("equal", "area"), f"mass is {mass!r}; it is 'equal' or 'area'")
    demand(not masses or mass == "equal", f"mass is {mass!r} beside masses; expected one of the two")
    mass_of = (radius_of / radii[0]) ** 2 if mass == "area" else np.ones(len(radii))
    if masses:
        mass_of = _numbers("masses", masses, len(radii))
    return np.repeat(radius_of, numbers), np.repeat(mass_of, numbers)


def _numbers_of(bodies: int, sizes: int, fractions: tuple[float, ...]) -> Integers:
    demand_number("bodies", bodies, 2, "a mixture has 2 bodies or more")
    if fractions:
        _numbers("fractions", fractions, sizes)
    parts = [Fraction(each) for each in fractions or (1,) * sizes]
    exact = [bodies * each / sum(parts) for each in parts]
    numbers = [int(each) for each in exact]
    by_remainder = sorted(range(sizes), key=lambda k: numbers[k] - exact[k])
    for k in by_remainder[: bodies - sum(numbers)]:
        numbers[k] += 1
    return np.array(numbers)


def _numbers(name: str, numbers: tuple[float, ...], sizes: int) -> Floats:
    """Returns the numbers as an array; raises BadOption unless each size has a possible number."""
    many = len(numbers)
    demand(many == sizes, f"{name} has {many} numbers, and radii has {sizes}; expected one for each radius")
    for k, number in enumerate(numbers):
        demand_in_range(f"{name}[{k}]", number)
    return np.array(numbers)


def hexagonal(
    *,
    columns: int = 10,
    rows: int = 10,
    density: float = 0.7,
    vacancies: int = 0,
    radius: float = 0.5,
    walls: bool = True,
    temperature: float = 1.0,
    seed: int = 1,
) -> Scene:
    """A hexagonal crystal: equal discs on a triangular lattice, at a temperature.

    Every other row is half a spacing to the right; the spacing follows from ``density`` and ``radius``. The
    arena leaves half a spacing around the outermost sites.

    Args:
        columns: sites of a row
        rows: how many there are
        density: the part that the discs cover of the arena or, without walls, of the plane; below 0.907
        vacancies: the number of empty sites, drawn at random
        radius: a length
        walls: whether there is an arena
        temperature: the mean kinetic energy of a disc, above 0
        seed: of all that is drawn, a whole number from 0
    """
    row, column = _rows_and_columns(columns, rows)
    step = math.sqrt(0.75)
    sites = np.stack([column + 0.5 + 0.5 * (row % 2), row * step + 0.5], axis=1)
    width = columns + (0.5 if rows > 1 else 0.0)
    size = (width, (rows - 1) * step + 1.0) if walls else (float(columns), rows * step)
    return _crystal(sites, size, density, vacancies, radius, walls, temperature, seed)


def square(
    *,
    columns: int = 10,
    rows: int = 10,
    density: float = 0.5,
    vacancies: int = 0,
    radius: float = 0.5,
    walls: bool = True,
    temperature: float = 1.0,
    seed: int = 1,
) -> Scene:
    """A square crystal: equal discs on a square lattice, at a temperature.

    Each site is in the middle of a square of the lattice, whose side follows from ``density`` and ``radius``.

    Args:
        columns: sites of a row
        rows: how many there are
        density: the part of the squares that the discs cover, below pi / 4 = 0.785
        vacancies: the number of empty sites, drawn at random
        radius: a length
        walls: whether there is an arena, filled by the squares
        temperature: the mean kinetic energy of a disc, above 0
        seed: of all that is drawn, a whole number from 0
    """
    row, column = _rows_and_columns(columns, rows)
    sites = np.stack([column + 0.5, row + 0.5], axis=1)
    size = (float(columns), float(rows))
    return _crystal(sites, size, density, vacancies, radius, walls, temperature, seed)


def _rows_and_columns(columns: int, rows: int) -> tuple[Integers, Integers]:
    """Returns row and column of each site; raises BadOption for too few or too many sites."""
    demand_number("columns", columns, 1, "a crystal has 1 column or more")
    demand_number("rows", rows, 1, "a crystal has 1 row or more")
    sites = columns * rows
    many = f"{columns} columns and {rows} rows are {sites:,} sites; expected 2 to {numerics.MOST:,}"
    demand(2 <= sites <= numerics.MOST, many)
    row, column = np.divmod(np.arange(sites), columns)
    return row, column


def _crystal(
    sites: Floats,
    size: tuple[float, float],
    density: float,
    vacancies: int,
    radius: float,
    walls: bool,
    temperature: float,
    seed: int,
) -> Scene:
    """Returns discs at all but ``vacancies`` of the sites, (n, 2), scaled to a density. ``size`` is the box
    that they fill, in units of the spacing: the arena, or without walls whole cells of the lattice."""
    most = len(sites) - 2
    demand(0 <= vacancies <= most, f"vacancies is {vacancies}; it is from 0 to {most}, of {len(sites)} sites")
    demand_in_range("radius", radius)
    bodies = len(sites) - vacancies
    limit = math.pi / 4 * bodies / (size[0] * size[1])
    demand(
        0.0 < density < limit,
        f"density is {density}; {bodies} discs at {len(sites)} sites {'with' if walls else 'without'} walls "
        f"have one above 0 and below {limit:.6f}, where they would touch",
    )
    for_vacancies, for_velocities = draws(seed, 2)
    spacing = 2.0 * radius * math.sqrt(limit / density)
    kept = np.sort(for_vacancies.order(len(sites))[vacancies:]) if vacancies else slice(None)
    velocity = numerics.maxwell(temperature, np.ones(bodies), for_velocities)
    arena = (spacing * size[0], spacing * size[1]) if walls else None
    return Scene(spacing * sites[kept], velocity, radius, arena=arena)
