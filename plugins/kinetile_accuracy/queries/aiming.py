"""Pairs of discs that are aimed at each other: what most families are made of."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from kinetile_accuracy.queries.questions import Queries

__all__ = ["aimed", "generic", "usual"]

Floats = npt.NDArray[np.float64]
Draws = np.random.Generator


def aimed(
    radius: Floats, base: Floats, drift: Floats, course: Floats, speed: Floats, run: Floats, miss: Floats
) -> Queries:
    """Return pairs by their encounter: (m,) arrays, but radius, base, drift (m, 2).

    The first disc is at ``base`` with velocity ``drift``. The second comes with ``speed`` relative to it, in
    direction ``course``; it is nearest after a way of ``run``, and would then pass at distance ``miss``.
    """
    along = np.column_stack([np.cos(course), np.sin(course)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    apart = miss[:, None] * across - run[:, None] * along
    position = np.stack([base, base + apart], axis=1)
    velocity = np.stack([drift, drift + speed[:, None] * along], axis=1)
    return Queries(position, velocity, radius, np.zeros((len(radius), 2), dtype=np.int64))


def usual(
    draws: Draws, count: int, run: Callable[[Floats], Floats], miss: Callable[[Floats], Floats]
) -> Queries:
    """Return pairs that are usual but for ``run`` and ``miss``, functions of the sum of the radii."""
    radius = draws.uniform(0.005, 0.05, (count, 2))
    reach = radius.sum(axis=1)
    return aimed(
        radius,
        draws.uniform(-0.5, 0.5, (count, 2)),
        draws.uniform(-0.7, 0.7, (count, 2)),
        draws.uniform(0.0, 2.0 * np.pi, count),
        draws.uniform(0.1, 1.0, count),
        run(reach),
        miss(reach),
    )


def generic(draws: Draws, count: int) -> Queries:
    """Return pairs 2 to 20 R away, about half of which meet."""
    return usual(
        draws,
        count,
        lambda reach: reach * draws.uniform(2.0, 20.0, count),
        lambda reach: reach * draws.uniform(-2.0, 2.0, count),
    )
