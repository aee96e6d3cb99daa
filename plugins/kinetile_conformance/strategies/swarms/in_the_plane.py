"""Swarms without an arena: they keep together by turns."""

from __future__ import annotations

import numpy as np

from kinetile_conformance.strategies.swarms.pieces import (
    Swarm,
    anyhow,
    back_and_forth,
    jitter,
    moments_of,
    radii,
    slots,
    square,
)

__all__ = ["cloud", "far", "returning"]


def cloud(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Without an arena, about the origin: bodies that fly together, or anywhere, and back."""
    side = square(bodies, 1.5)
    radius = radii(random, bodies, variation)
    place = slots(random, bodies, side, side) + jitter(random, radius) - side / 2.0
    velocity = -place * random.uniform(0.8, 1.2, (bodies, 1)) + 0.1 * anyhow(random, bodies)
    if random.random() < 0.5:
        velocity = anyhow(random, bodies)
    moments = moments_of(bodies)
    return Swarm(place, velocity, radius, None, moments[-1] + 2.0, back_and_forth(velocity, moments))


def far(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """A cloud far from the origin, so fine that its lanes have numbers beyond 2^31."""
    swarm = cloud(random, bodies, 0 if variation < 4 else 1)
    scale = 2.0 ** (-10 if variation & 1 else 0)
    away = (2.0**33, 2.0**12, 2.0**20, 2.0**32)[variation % 4] * random.choice([-1.0, 1.0], 2)
    velocity = scale * swarm.velocity
    return swarm._replace(
        position=scale * (away + swarm.position),
        velocity=velocity,
        radius=scale * swarm.radius,
        turns=back_and_forth(velocity, moments_of(bodies)),
    )


def returning(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Without an arena: bodies leave for far away, and come back."""
    side = square(bodies, 1.5)
    radius = radii(random, bodies, variation)
    place = slots(random, bodies, side, side) + jitter(random, radius) - side / 2.0
    velocity = place * (2.0, 16.0)[variation & 1]
    # At 4 they are where they began, and fly on through each other's midst.
    return Swarm(place, velocity, radius, None, 7.0, back_and_forth(velocity, (2.0, 5.0)))
