"""The worst cases of the thesis: arrangements in which a broad phase excludes little or nothing.

The thesis draws them (figures 10, 11 and 16) without coordinates; these are discs that show what its captions
say. All three are rare: nothing keeps discs in such a place, and figures 11 and 16 come apart as they move.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from kinetile import Scene
from kinetile_plugins.scenes._terms import (
    demand,
    demand_number,
    demand_speed,
    draws,
    in_random_directions,
)

__all__ = ["figure_10", "figure_11", "figure_16"]

_INWARD = 0.98
_SHRINK = 0.16


def figure_10(*, bodies: int = 16, speed: float = 1.0, seed: int = 1) -> Scene:
    """Figure 10: sweep and prune in one dimension excludes no pair.

    A column of equal discs with one common x, moving up and down. All intervals on the x-axis overlap, and
    since every contact is along the column, they do so for ever: sweep and prune along x has all n (n - 1)
    / 2 pairs, along y only those that are next to each other.
    """
    demand(bodies >= 1, f"bodies is {bodies}; figure 10 has 1 body or more")
    demand_number("bodies", bodies)
    demand_speed(speed)
    (random,) = draws(seed, 1)
    position = np.full((bodies, 2), 0.5)
    position[:, 1] = (np.arange(bodies) + 0.5) / bodies
    velocity = np.zeros((bodies, 2))
    velocity[:, 1] = speed * (2.0 * random.uniform(bodies) - 1.0)
    return Scene(position, velocity, 0.3 / bodies, arena=(1.0, 1.0))


def figure_11(*, bodies: int = 20, speed: float = 1.0, seed: int = 1) -> Scene:
    """Figure 11: axis-aligned bounding boxes exclude no pair, though no discs touch.

    Every box holds the origin. The k-th disc of a quadrant has the radius r = 0.16**k and its centre at
    (0.98 r, 0.98 r), a little nearer to the axes than its edge; discs that shrink at least as fast as
    (sqrt(2) - 1) / (sqrt(2) + 1) = 0.17 do not overlap. Two opposite quadrants are filled (of discs in
    neighbouring ones, two of similar size would overlap). There are no walls; velocities are proportional
    to the radii, so that all sizes part in the same time.

    Radii stay above 2**-200, the smallest that a scene may have, for 152 bodies. A run needs bodies that are
    large against the rounding of its largest coordinates, which about 20 are.
    """
    demand(1 <= bodies <= 152, f"bodies is {bodies}; figure 11 has from 1 to 152, as far as radii may shrink")
    (random,) = draws(seed, 1)
    radius = np.array([float(Fraction(_SHRINK) ** (k // 2)) for k in range(bodies)])
    side = np.where(np.arange(bodies) % 2 == 0, 1.0, -1.0)
    position = np.repeat((side * _INWARD * radius)[:, np.newaxis], 2, axis=1)
    velocity = in_random_directions(speed, bodies, random) * radius[:, np.newaxis]
    return Scene(position, velocity, radius)


def figure_16(*, bodies: int = 21, speed: float = 0.1, seed: int = 1) -> Scene:
    """Figure 16: one wide disc is paired with every other in a tiling, and sweep and prune has O(n^2) pairs.

    Under a wide disc the others stand one below the other, each a little to the right of the one above. So
    all their intervals on the x-axis overlap, and a vertical line from each one's right end reaches the
    wide disc unhindered.
    """
    demand(bodies >= 2, f"bodies is {bodies}; figure 16 has 2 bodies or more, the wide disc and others")
    demand_number("bodies", bodies)
    (random,) = draws(seed, 1)
    others = bodies - 1
    radius = 0.2 / others
    step = np.arange(others)
    x = 0.5 + radius * (step / others - 0.5)
    y = 0.45 - (step + 0.5) * 0.45 / others
    position = np.concatenate([[[0.5, 0.75]], np.stack([x, y], axis=1)])
    velocity = in_random_directions(speed, bodies, random)
    return Scene(position, velocity, np.array([0.2, *np.full(others, radius)]), arena=(1.0, 1.0))
