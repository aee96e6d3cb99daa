"""Hand-made scenes: the worst cases of the thesis, and small scenes with known answers. The thesis draws its
worst cases (figures 10, 11 and 16) without coordinates: a broad phase excludes little or nothing there. These
discs have the properties of its captions. The worst cases of figures 11 and 16 end as their discs move."""

import math
from fractions import Fraction

import numpy as np

from kinetile import Scene
from kinetile.arrays import Floats
from kinetile_plugins.scenes import numerics
from kinetile_plugins.scenes.numerics import Draws, demand, demand_number, draws


def cradle(*, bodies: int = 5, moving: int = 1) -> Scene:
    """A row of touching discs, struck at one end: as many leave at the other end as strike.

    Newton's cradle, lying down: the leaving discs return from the wall and strike again. All contact times
    are exact.

    Args:
        bodies: the number of discs
        moving: how many of them come from the left, at speed 1; from 1 to fewer than all
    """
    demand_number("bodies", bodies, 2, "a cradle has 2 bodies or more")
    demand(0 < moving < bodies, f"moving is {moving}; it is from 1 to {bodies - 1}, less than the bodies")
    radius, gap = 0.125, 1.0
    width = 2.0 * gap + 2.0 * radius * bodies
    position = np.full((bodies, 2), 0.5)
    position[:, 0] = gap + radius * (2.0 * np.arange(bodies) + 1.0)
    position[:moving, 0] -= gap / 2.0
    velocity = np.zeros((bodies, 2))
    velocity[:moving, 0] = 1.0
    return Scene(position, velocity, radius, arena=(width, 1.0))


def billiard_break(*, speed: float = 8.0, aim: float = 0.0) -> Scene:
    """A billiard break: the cue ball strikes fifteen balls racked in a touching triangle.

    Metres, seconds and kilograms: the cushions are 2.54 by 1.27, a ball has a diameter of 57.15 mm. There is
    no friction. With angle 0 all is symmetric, and contacts that share a ball are simultaneous.

    Args:
        speed: of the cue ball, in metres per second
        aim: its angle to the long axis of the table, in radians, at most 2 pi in size
    """
    demand(abs(aim) <= 2.0 * math.pi, f"aim is {aim}; it is at most a whole turn, 2 pi = 6.283, in size")
    width, height, radius = 2.54, 1.27, 0.028575
    centres = [(width / 4.0, height / 2.0)]
    for row in range(5):
        x = 0.75 * width + row * math.sqrt(3.0) * radius
        centres += [(x, height / 2.0 + (2 * place - row) * radius) for place in range(row + 1)]
    velocity = np.zeros((len(centres), 2))
    velocity[0] = speed * np.concatenate(numerics.cosine_and_sine(np.array([aim])))
    return Scene(centres, velocity, radius, 0.17, (width, height))


def two_discs(*, radius: float = 0.15, seed: int = 1) -> Scene:
    """Two discs in the unit square, at a random point of their energy surface: mean rates are known exactly.

    The places are drawn uniformly from all places without overlap, the velocities from all velocities whose
    squares add up to 2. The microcanonical ensemble gives the mean times between contacts, and between
    contacts with a wall (Zapfe, Sanders and Rodríguez-Mota, arXiv:1908.04749).

    Args:
        radius: of both, above 0 and at most 0.25
        seed: of all that is drawn, a whole number from 0
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
    """Returns a random point of the unit disc, not its centre, and the square of its distance from the
    centre. Two such points make a random point of the sphere in four dimensions (Marsaglia, 1972)."""
    while True:
        point = 2.0 * random.uniform(2) - 1.0
        square = float(point[0] * point[0] + point[1] * point[1])
        if 0.0 < square < 1.0:
            return point, square


_INWARD = 0.98
_SHRINK = 0.16


def figure_10(*, bodies: int = 16, speed: float = 1.0, seed: int = 1) -> Scene:
    """Figure 10: sweep and prune in one dimension excludes no pair.

    A column of equal discs with one common x, moving up and down. All intervals on the x-axis overlap, and
    every contact is along the column, so they always overlap: sweep and prune along x has all n (n - 1) / 2
    pairs, and along y only adjacent pairs.

    Args:
        bodies: the number of discs
        speed: of each disc
        seed: of all that is drawn, a whole number from 0
    """
    demand_number("bodies", bodies, 1, "figure 10 has 1 body or more")
    (random,) = draws(seed, 1)
    position = np.full((bodies, 2), 0.5)
    position[:, 1] = (np.arange(bodies) + 0.5) / bodies
    velocity = np.zeros((bodies, 2))
    velocity[:, 1] = speed * (2.0 * random.uniform(bodies) - 1.0)
    return Scene(position, velocity, 0.3 / bodies, arena=(1.0, 1.0))


def figure_11(*, bodies: int = 20, speed: float = 1.0, seed: int = 1) -> Scene:
    """Figure 11: axis-aligned bounding boxes exclude no pair, though no discs touch.

    Every box contains the origin. The k-th disc of a quadrant has the radius r = 0.16**k and its centre at
    (0.98 r, 0.98 r), closer to the axes than r. Discs that shrink at least as fast as (sqrt(2) - 1) /
    (sqrt(2) + 1) = 0.17 do not overlap. Two opposite quadrants are filled (in neighbouring quadrants two
    discs of similar size would overlap). There are no walls; velocities are proportional to the radii, so all
    sizes part in the same time. The radii of 152 bodies are above 2**-200, the least in a scene. A run needs
    bodies much larger than the rounding of its largest coordinates: about 20 are.

    Args:
        bodies: the number of discs, from 1 to 152
        speed: of the largest discs
        seed: of all that is drawn, a whole number from 0
    """
    demand(1 <= bodies <= 152, f"bodies is {bodies}; figure 11 has from 1 to 152, as far as radii may shrink")
    (random,) = draws(seed, 1)
    radius = np.array([float(Fraction(_SHRINK) ** (k // 2)) for k in range(bodies)])
    side = np.where(np.arange(bodies) % 2 == 0, 1.0, -1.0)
    position = np.repeat((side * _INWARD * radius)[:, np.newaxis], 2, axis=1)
    velocity = numerics.in_random_directions(speed, bodies, random) * radius[:, np.newaxis]
    return Scene(position, velocity, radius)


def figure_16(*, bodies: int = 21, speed: float = 0.1, seed: int = 1) -> Scene:
    """Figure 16: one wide disc is paired with every other in a tiling, and sweep and prune has O(n^2) pairs.

    The other discs are in a column under a wide disc, each slightly to the right of the one above. So all
    their intervals on the x-axis overlap, and a vertical line from the right end of each disc reaches the
    wide disc without meeting another.

    Args:
        bodies: the number of discs
        speed: of each disc
        seed: of all that is drawn, a whole number from 0
    """
    demand_number("bodies", bodies, 2, "figure 16 has 2 bodies or more, the wide disc and others")
    (random,) = draws(seed, 1)
    others = bodies - 1
    radius = 0.2 / others
    step = np.arange(others)
    x = 0.5 + radius * (step / others - 0.5)
    y = 0.45 - (step + 0.5) * 0.45 / others
    position = np.concatenate([[[0.5, 0.75]], np.stack([x, y], axis=1)])
    velocity = numerics.in_random_directions(speed, bodies, random)
    return Scene(position, velocity, np.array([0.2, *np.full(others, radius)]), arena=(1.0, 1.0))
