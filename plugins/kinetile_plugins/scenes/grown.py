"""Dense random starts: discs that grow while they move.

Random placement ends near a density of .5. Lubachevsky and Stillinger (1990, "Geometric properties of random
disk packings") exceed it with discs whose radii grow at a constant rate between their collisions. Here radii
grow in steps between runs: each of two discs that would touch grows by half of the gap between them. No disc
becomes larger than the smallest, relative to final radii, times 1 + ``RATE``, so none stays small.
"""

import math

import numpy as np

from kinetile import Scene, Simulation
from kinetile.arrays import Floats
from kinetile.errors import BadOption, ZenoError
from kinetile.scene.bodies import distance, nearest_image, overlapping_images
from kinetile_plugins.scenes import numerics
from kinetile_plugins.scenes.matter import side_of_square, sizes_and_masses
from kinetile_plugins.scenes.numerics import demand, demand_in_range, draws
from kinetile_plugins.scenes.random_discs import places

START = 0.3
"""Density of the discs at random places, before they grow."""

RATE = 0.005
"""The most that a disc may exceed the smallest after one step, as a part of the size."""

SLOWEST = 2.0**-12
"""The least growth of the smallest disc within ``PATIENCE`` steps, as a part of its final size."""

PATIENCE = 200
_BELOW = 1.0 - 2.0**-30  # of half a gap: less than 1 by the rounding of a sum of two radii


def grown(
    *,
    bodies: int = 100,
    density: float = 0.75,
    radii: tuple[float, ...] = (0.5, 0.7),
    fractions: tuple[float, ...] = (),
    mass: str = "equal",
    masses: tuple[float, ...] = (),
    temperature: float = 1.0,
    contacts: float = 4.0,
    periodic: str = "",
    seed: int = 1,
) -> Scene:
    """Discs denser than random places allow; they grow while they move and collide.

    The discs begin at random places with a density of 0.3, and grow in steps. Equal discs form patches of
    crystal; equal numbers of radii 0.5 and 0.7 stay disordered, and reach about 0.84. Velocities are drawn
    again at the end.

    Args:
        bodies: the number of discs
        density: the part of the square that they cover at the end
        radii: of each size, lengths
        fractions: the part of each size, in proportion; left out, all are equal
        mass: equal (1) or area (in proportion to the square of the radius)
        masses: instead of mass, the mass of each size
        temperature: the mean kinetic energy of a disc, above 0
        contacts: the mean number of contacts of a disc after a step: the more, the closer to equilibrium
        periodic: axes along which discs grow into their images too: x, y or xy
        seed: of all that is drawn, a whole number from 0
    """
    numerics.demand_density(density)
    demand(periodic in ("", "x", "y", "xy"), f"periodic is {periodic!r}; it is 'x', 'y', 'xy' or ''")
    demand_in_range("contacts", contacts)
    final, every_mass = sizes_and_masses(bodies, radii, fractions, mass, masses)
    for_places, for_moving, for_velocities = draws(seed, 3)
    side = side_of_square(final, density)
    first = min(density, START)
    radius = final * math.sqrt(first / density)
    scene = Scene(
        places(radius, first, side, for_places),
        numerics.maxwell(temperature, every_mass, for_moving),
        radius,
        every_mass,
        (side, side),
        periodic=periodic,
    )
    scene = _grow(scene, final, density, contacts)
    return scene.replace(velocity=numerics.maxwell(temperature, every_mass, for_velocities))


def _grow(scene: Scene, final: Floats, density: float, contacts: float) -> Scene:
    """Returns the scene after alternate runs and growth until each radius is final."""
    moves = scene.mass[:, np.newaxis] * scene.velocity**2
    speed = math.sqrt(math.fsum(moves.ravel()) / math.fsum(scene.mass))
    most = max(1, round(0.5 * contacts * len(scene)))
    longest = contacts * max(scene.arena or ()) / speed  # of a run whose discs do not meet
    smallest = [float((scene.radius / final).min())]  # of each step

    def held() -> BadOption:
        reached = density * math.fsum(scene.radius**2) / math.fsum(final**2)
        return BadOption(
            f"density is {density}; after {len(smallest) - 1} steps the discs held each other at "
            f"{reached:.4f}; ask for less, for more contacts a step than {contacts}, or for equal discs as "
            "the recipe 'hexagonal' has them"
        )

    while True:
        scene = scene.replace(radius=_larger(scene, final * min(1.0, smallest[-1] * (1.0 + RATE))))
        smallest.append(float((scene.radius / final).min()))
        if smallest[-1] == 1.0:
            return scene
        if len(smallest) > PATIENCE and smallest[-1] - smallest[-PATIENCE] < SLOWEST:
            raise held()
        sim = Simulation(scene, "cells", keep_contacts=False)
        try:
            sim.run(until=longest, max_contacts=most)
            sim.run(until=sim.time * (1.0 + 0.5 / most))  # beyond a contact: two discs have no gap there
        except ZenoError as error:
            raise held() from error
        scene = scene.replace(position=sim.positions(), velocity=sim.velocities())


def _larger(scene: Scene, wanted: Floats) -> Floats:
    """Returns radii between the scene's radii and the wanted radii, without an overlap of discs."""
    place, radius = scene.position, scene.radius
    grown = np.maximum(wanted, radius)
    for pairs in overlapping_images(place, grown, scene.periods):
        one, two = pairs.T
        gap = distance(nearest_image(place[one] - place[two], scene.periods)) - radius[one] - radius[two]
        half = 0.5 * _BELOW * np.maximum(gap, 0.0)
        np.minimum.at(grown, one, radius[one] + half)
        np.minimum.at(grown, two, radius[two] + half)
    for at, side, period in zip(place.T, scene.arena or (), scene.periods, strict=True):
        room = 0.5 * _BELOW * side if period else np.minimum(at, side - at)
        grown = np.minimum(grown, np.maximum(room, radius))
    return grown
