"""A heap: discs lie on each other in a box, by hops of their contact time (rule 11h)."""

import math

import numpy as np

from kinetile import Response, Scene
from kinetile_plugins.scenes.numerics import demand, demand_number, draws

_RADIUS = 0.5
_GAP = 1.02
"""The distance of neighbours at the start, in diameters of the largest disc that there may be."""


def heap(
    *,
    bodies: int = 60,
    columns: int = 8,
    e: float = 0.3,
    contact_time: float = 1e-3,
    spread: float = 0.1,
    seed: int = 1,
) -> Scene:
    """A heap: discs fall a short way into a box, and come to lie on each other.

    Metres, seconds and kilograms: gravity is 9.8, the mean radius 0.5, and the discs weigh 1 a square metre.
    They never rest, but hop (docs/scenes.md): a heap has at most bodies / contact_time contacts a second, up
    to some forty layers. With ``spread`` 0 all discs are alike, and lie as a crystal.

    Args:
        bodies: the number of discs, 1 or more
        columns: how many start beside each other, 1 or more
        e: the share of its closing speed that a contact gives back, from 0 to 1
        contact_time: of the response: about as long as a hop, in seconds
        spread: how much radii differ from their mean, at most, as a share of it; from 0 to 0.5
        seed: of all that is drawn, a whole number from 0
    """
    for name, number in (("bodies", bodies), ("columns", columns)):
        demand_number(name, number, 1, "a heap has 1 or more")
    demand(0.0 <= spread <= 0.5, f"spread is {spread}; it is from 0 to 0.5")
    for_radii, for_places = draws(seed, 2)
    radius = _RADIUS * (1.0 + spread * (2.0 * for_radii.uniform(bodies) - 1.0))
    step = 2.0 * _RADIUS * (1.0 + spread) * _GAP
    row, column = np.divmod(np.arange(bodies), columns)
    x = (column + 0.5 * (1 + row % 2)) + 0.008 * for_places.uniform(bodies)  # less than the gap
    y = 0.5 + math.sqrt(0.75) * row
    return Scene(
        step * np.stack([x, y], axis=1),
        np.zeros((bodies, 2)),
        radius,
        math.pi * radius * radius,
        (step * (columns + 0.52), step * float(y[-1] + 1.0)),
        gravity=(0.0, -9.8),
        responses=Response("restitution", e=e, contact_time=contact_time),
    )
