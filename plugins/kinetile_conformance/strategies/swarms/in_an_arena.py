"""Swarms in an arena, of bodies that are about as large or of several sizes anyhow."""

from __future__ import annotations

import numpy as np

from kinetile_conformance.strategies.swarms.pieces import Swarm, anyhow, jitter, radii, slots, square

__all__ = ["burst", "corridor", "crossings", "gas", "lattice", "resting", "shear"]


def gas(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Bodies of one or several sizes in a square."""
    side = square(bodies, 1.2)
    radius = radii(random, bodies, variation)
    place = slots(random, bodies, side, side) + jitter(random, radius)
    return Swarm(place, anyhow(random, bodies), radius, (float(side), float(side)), 40.0, [])


def lattice(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Columns and rows: bodies with one coordinate in common, dyadic numbers, ties in bulk."""
    columns = (2, 4, square(bodies, 1.3), square(bodies, 3.0))[variation % 4]
    rows = -(-int(1.4 * bodies) // columns)
    radius = np.full(bodies, 0.25 if variation < 4 else 0.5)
    velocity = random.integers(-2, 3, (bodies, 2)) / 2.0
    velocity[np.arange(bodies), random.integers(0, 2, bodies)] = 0.0
    place, arena = slots(random, bodies, columns, rows), (float(columns), float(rows))
    if variation & 1:
        return Swarm(place[:, ::-1], velocity[:, ::-1], radius, arena[::-1], 100.0, [])
    return Swarm(place, velocity, radius, arena, 100.0, [])


def shear(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Rows that fly past each other, touching or just not, as trains."""
    side = square(bodies, 1.5)
    place = slots(random, bodies, side, side)
    speed = np.where(place[:, 1] % 2 < 1, 1.0, -1.0) * (1.0 + variation % 2)
    radius = np.full(bodies, (0.5, 0.375, 0.5 - 2.0**-30, 0.25)[variation % 4])
    velocity = np.column_stack([speed, np.zeros(bodies)])
    velocity[random.integers(0, bodies), 1] = 0.5
    return Swarm(place, velocity, radius, (float(side), float(side)), 50.0, [])


def corridor(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """An arena a thousand times as long as it is wide."""
    length = 1024
    radius = 0.5 * radii(random, bodies, variation % 4)
    place = slots(random, bodies, length, 1) + jitter(random, radius)
    velocity = anyhow(random, bodies) * np.array([30.0, 1.0])
    arena = (float(length), 1.0)
    if variation & 1:
        return Swarm(place[:, ::-1], velocity[:, ::-1], radius, arena[::-1], 10.0, [])
    return Swarm(place, velocity, radius, arena, 10.0, [])


def resting(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Bodies at rest, and a few fast ones among them."""
    swarm = gas(random, bodies, variation)
    fast = random.random(bodies) < 2.0 ** -(2 + variation % 4)
    fast[0] = True
    return swarm._replace(velocity=np.where(fast[:, None], 8.0 * swarm.velocity, 0.0))


def burst(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """All in the middle, and off at one moment in all directions."""
    side = square(bodies, 1.2)
    radius = radii(random, bodies, variation)
    inside = slots(random, bodies, side, side) + jitter(random, radius) - side / 2.0
    wide = 3.0 * side
    return Swarm(inside + wide / 2.0, inside * (2.0, 8.0)[variation & 1], radius, (wide, wide), 8.0, [])


def crossings(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Small and fast, with much room: hardly any contact, and thousands of places passed."""
    side = square(bodies, 1.2)
    radius = np.full(bodies, (0.125, 2.0**-5, 2.0**-7, 0.25)[variation % 4])
    place = slots(random, bodies, side, side) + jitter(random, radius)
    velocity = side * anyhow(random, bodies)
    return Swarm(place, velocity, radius, (float(side), float(side)), 512.0 / bodies, [])
