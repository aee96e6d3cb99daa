"""Lattices by the hundred: one scene of many small ones, each full of exact ties, and far from the others.

To run a simulation costs a few milliseconds before anything has happened, however small it is. So that ties
can be looked at in bulk, a hundred lattices of two to nine bodies stand in one scene, so far apart that no
body comes from one to the other. Places, radii and velocities are small dyadic numbers, the shifts from
lattice to lattice are dyadic as well, and a lattice is the same to the last bit wherever it stands.

Phases that need an arena have the lattices in cells of one: there walls are far, and nothing else changes.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from kinetile.scene import Scene, Settings

__all__ = ["CONTACTS", "LATTICES", "lattice_scenes", "lattices"]

LATTICES = 100
"""Lattices in a scene."""

CONTACTS = 20_000
"""More than there are until the end."""

APART = (16, 10)
"""From lattice to lattice: farther than most fly, or so near that at last they meet."""

FEWEST, MOST = 2, 9
UNTIL = 6.0

SHAPES = np.array([(4, 4), (3, 3), (9, 1), (1, 9), (5, 2), (2, 5)])
"""Columns and rows of unit squares."""


def lattices(count: int, seed: int, arena: bool, apart: int = APART[0]) -> Scene:
    """Return so many lattices in one scene, so far apart, with or without an arena around them all."""
    random = np.random.default_rng(seed)
    bodies = random.integers(FEWEST, MOST + 1, count)
    shape = SHAPES[random.integers(0, len(SHAPES), count)]
    # Arrays have a row for each lattice and a place for each body that it could have.
    squares = np.where(np.arange(16) < shape.prod(axis=1)[:, None], random.random((count, 16)), 2.0)
    chosen = np.argsort(squares, axis=1)[:, :MOST]
    place = np.stack([chosen % shape[:, :1], chosen // shape[:, :1]], axis=2) + 0.5 - shape[:, None] / 2.0
    own, common = random.integers(1, 5, (count, MOST)), random.integers(1, 5, (count, 1))
    radius = np.where(_some(random, count, 0.3)[:, :, 0], own, common) / 8.0
    # Against a side of their squares many touch at the start.
    aside = (0.5 - radius)[:, :, None] * random.integers(-1, 2, (count, MOST, 1))
    axis = random.integers(0, 2, (count, 1, 1)) == np.arange(2)
    place = place + np.where(axis & _some(random, count, 0.5), aside, 0.0)
    steps = random.choice([1, 2, 4], (count, 1, 1))
    velocity = random.integers(-steps, steps + 1, (count, MOST, 2)) / steps
    # Along the lattice's lines numbers stay simple; towards the middle many come together.
    along = _some(random, count, 0.6) | (shape.min(axis=1) == 1)[:, None, None]
    rests = np.where((shape == 1).any(axis=1)[:, None], shape[:, :1] == 1, random.random((count, MOST)) < 0.5)
    across = np.stack([rests, ~rests], axis=2)
    velocity = np.where(along & across, 0.0, velocity)
    inwards = _some(random, count, 0.7) & (place * velocity > 0.0)
    velocity = np.where(inwards, -velocity, velocity)
    side = int(np.ceil(np.sqrt(count)))
    at = np.arange(count)
    corner = apart / 2.0 if arena else -apart * float(side // 2)
    place = place + (apart * np.column_stack([at % side, at // side]) + corner)[:, None]
    there = np.arange(MOST) < np.minimum(bodies, shape.prod(axis=1))[:, None]
    return Scene(
        place[there],
        velocity[there],
        radius[there],
        arena=(float(apart * side), float(apart * side)) if arena else None,
        settings=Settings(until=UNTIL),
    )


def _some(random: np.random.Generator, count: int, share: float) -> npt.NDArray[np.bool_]:
    """Return which lattices are among so large a share of them, (count, 1, 1)."""
    return random.random((count, 1, 1)) < share


def _numbered(number: int) -> Scene:
    """Return the hundred lattices of a number."""
    return lattices(LATTICES, number, bool(number & 1), APART[number >> 1 & 1])


def lattice_scenes() -> st.SearchStrategy[Scene]:
    """Return scenes of a hundred lattices."""
    return st.integers(0, 2**24 - 1).map(_numbered)
