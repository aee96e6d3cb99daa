"""Scenes on which mutants show that they are wrong."""

from __future__ import annotations

import numpy as np

import kinetile as kt

__all__ = ["billiard", "corner", "crowd", "gas", "meeting", "numbered", "overlapping", "row", "stack"]


def gas(bodies: int, density: float = 0.5, seed: int = 1) -> kt.Scene:
    """Return discs of one size in a box."""
    return kt.make_scene("grid", bodies=bodies, density=density, seed=seed)


def meeting(far: float = 0.0, radius: float = 0.5, speed: float = 1.0, apart: float = 4.0) -> kt.Scene:
    """Return two bodies of which one, at rest, is met by the other from below."""
    position = [[far, far], [far, far + apart * radius]]
    return kt.Scene(position, [[0.0, speed], [0.0, 0.0]], radius)


def crowd(bodies: int, wide: float = 8.0, low: float = 0.0, seed: int = 1) -> kt.Scene:
    """Return a cloud of small bodies with a wide one above, in the open plane about the origin."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(bodies)))
    places = np.stack(np.divmod(np.arange(bodies), side), axis=1) - [side / 2, side / 2 + low]
    position = np.vstack([places, [[0.0, side / 2 + wide + 8.0]]])
    velocity = np.vstack([rng.uniform(-1.0, 1.0, (bodies, 2)), [[0.0, -1.0]]])
    return kt.Scene(position, velocity, [0.25] * bodies + [wide])


def corner(bodies: int, seed: int = 1) -> kt.Scene:
    """Return bodies that fly about close together in a large box: there are many in a cell."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(bodies)))
    position = np.stack(np.divmod(np.arange(bodies), side), axis=1) * 0.625 + 6.5
    return kt.Scene(position, rng.uniform(-1.0, 1.0, (bodies, 2)), 0.25, arena=(40.0, 40.0))


def numbered(bodies: int, one: int, other: int) -> kt.Scene:
    """Return bodies of which two of given numbers meet, and the others stand by."""
    position = np.stack([8.0 * np.arange(bodies), np.zeros(bodies)], axis=1)
    position[other] = position[one] + [0.0, 2.0]
    velocity = np.zeros((bodies, 2))
    velocity[one] = 0.0, 1.0
    return kt.Scene(position, velocity, 0.5)


def stack(bodies: int) -> kt.Scene:
    """Return bodies at rest on top of each other: all their intervals in x overlap."""
    return kt.Scene([[0.0, 2.0 * i] for i in range(bodies)], np.zeros((bodies, 2)), 0.5)


def overlapping() -> kt.Scene:
    """Return a wide body at rest with eight small ones in the corners of its bounding box."""
    corners = [[x * far, y * 3.625] for x in (-1, 1) for y in (-1, 1) for far in (3.25, 3.75)]
    return kt.Scene([[0.0, 0.0], *corners], np.zeros((9, 2)), [4.0] + [0.125] * 8)


def row(bodies: int, gap: float = 0.5) -> kt.Scene:
    """Return bodies side by side in a corridor, of which the first one flies at the others."""
    position = [[0.5 + (1.0 + gap) * i, 0.5] for i in range(bodies)]
    velocity = [[1.0, 0.0]] + [[0.0, 0.0]] * (bodies - 1)
    return kt.Scene(position, velocity, 0.5, arena=((1.0 + gap) * bodies, 1.0))


def billiard() -> kt.Scene:
    """Return three bodies in a small box, which meet for ever."""
    return kt.Scene(
        [[0.5, 0.5], [1.5, 0.5], [0.75, 1.5]],
        [[1.0, 0.25], [-1.0, 0.5], [0.5, -1.0]],
        0.375,
        arena=(2.0, 2.0),
    )
