"""Swarms of few large bodies and many small ones: what has levels for sizes has them here."""

from __future__ import annotations

import numpy as np

from kinetile_conformance.strategies.swarms.pieces import Swarm, anyhow, slots, square

__all__ = ["crowd", "giants", "lanes", "plough"]


def _octaves(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Sizes over eight octaves, and most of them the smallest: what has levels for sizes has three of them.

    A large body fills most of the arena, four of a third of its size stand beside it, and small ones of four
    sizes begin in a strip between.
    """
    large = min(5, bodies - 3)
    width, height, strip = 6.0, 4.5, (4.05, 0.5)
    radius, place = np.empty(bodies), np.empty((bodies, 2))
    radius[0], place[0] = 1.95, (2.0, 2.25)
    radius[1:large] = 0.55
    place[1:large, 0], place[1:large, 1] = 5.35, 0.5625 + 1.125 * np.arange(large - 1)
    small = bodies - large
    columns = max(int(np.sqrt(1.3 * small * strip[1] / height)), 1)
    rows = -(-int(1.3 * small + 1) // columns)
    pitch = np.array([strip[1] / columns, height / rows])
    place[large:] = np.array([strip[0], 0.0]) + pitch * slots(random, small, columns, rows)
    radius[large:] = 0.45 * min(pitch.min(), 0.0625) * 2.0 ** -random.integers(0, 4, small)
    velocity = anyhow(random, bodies)
    velocity[:large] *= (variation & 1, 0.25)[variation >> 1 & 1]
    return Swarm(place, velocity, radius, (width, height), 12.0, [])


def crowd(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """All small bodies in the place of one large one, of which some stand about; or bodies of all sizes."""
    if variation >= 4:
        return _octaves(random, bodies, variation)
    small = bodies - 3
    side = square(small, 1.3)
    pitch = 1.5 / side
    radius = np.full(bodies, 0.4 * pitch)
    radius[:3] = 1.0
    place = np.empty((bodies, 2))
    place[:3] = np.array([[1.5, 5.5], [5.5, 1.5], [6.5, 6.5]])
    place[3:] = 0.25 + pitch * slots(random, small, side, side)
    velocity = 0.1 * (1 + variation % 4) * anyhow(random, bodies)
    velocity[:3] *= 0.5 * (variation & 1)
    return Swarm(place, velocity, radius, (8.0, 8.0), 30.0, [])


def giants(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Fine beside coarse: few large bodies, many that are up to a thousand times smaller between them; or
    bodies of all sizes."""
    if variation >= 4:
        return _octaves(random, bodies, variation)
    large = 4
    side = square(bodies, 1.2)
    radius = np.full(bodies, 2.0 ** -(4 + 2 * (variation % 4)) * 4.0)
    radius[:large] = 4.0
    place = np.empty((bodies, 2))
    place[:large] = np.array([[5.0, 5.0], [15.0, 5.0], [5.0, 15.0], [15.0, 15.0]])
    pitch = 20.0 / side
    fine = np.minimum(radius[large:], 0.24 * pitch)
    place[large:] = np.array([0.0, 20.0]) + pitch * slots(random, bodies - large, side, side)
    radius[large:] = fine
    return Swarm(place, 2.0 * anyhow(random, bodies), radius, (20.0, 40.0), 12.0, [])


def plough(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Four large bodies that plough through small ones at rest, one in each direction, past each other: those
    have no new plans, so it is by the large one's certificate that they become near it, or not at all."""
    small = bodies - 4
    side = square(small, 1.2)
    wide = (0.2, 0.1875, 0.175, 0.15)[variation % 4] * side
    radius = np.append(np.full(small, 0.25), [wide] * 4)
    field = slots(random, small, side, side) - side / 2.0
    aside, away = 0.3 * side, side * random.uniform(0.8, 1.2)
    ploughs = np.array([[-aside, away], [-away, -aside], [aside, -away], [away, aside]])
    ahead = np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    place = np.vstack([field, ploughs]) + random.uniform(-side, side, 2) * (variation >> 2)
    velocity = np.vstack([2.0**-8 * anyhow(random, small), ahead])
    return Swarm(place, velocity, radius, None, 2.5 * side, [])


def lanes(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Large bodies in lanes among few small ones that drift, beside a crowd that makes a grid fine: few
    contacts come between two changes of place, also over the axis."""
    large, crowd = 3, int(0.8 * (bodies - 3))
    few = bodies - large - crowd
    side = 0.475 * np.sqrt(bodies)
    pitch = 0.75 / square(crowd, 1.0)
    apart = side / square(few, 1.1)
    radius = np.concatenate([np.ones(large), np.full(crowd, 0.4 * pitch), np.full(few, 0.03125)])
    lanes = side * np.array([0.25, 0.5, 0.75])[random.permutation(3)]
    start = np.column_stack([lanes, [-1.5, side + 1.5, -4.0]])
    thick = side + 1.5 + pitch * slots(random, crowd, square(crowd, 1.0), square(crowd, 1.0))
    thin = apart * slots(random, few, square(few, 1.1), square(few, 1.1))
    place = np.vstack([start, thick, thin]) - side * (random.random(2) if variation & 4 else 0.5)
    velocity = 2.0**-8 * anyhow(random, bodies) + (variation & 1) * 0.25 * random.normal(size=2)
    velocity[:large] = np.array([[0.0, 1.0], [0.0, -1.0], [0.0, 1.0]])
    if variation & 2:
        place, velocity = place[:, ::-1], velocity[:, ::-1]
    return Swarm(place, velocity, radius, None, 4.0 * side, [])
