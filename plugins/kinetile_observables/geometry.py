"""Distances in the arena and motion about its centre of mass, with walls and with periodic axes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from kinetile import Scene
from kinetile.run.moment import Moment
from kinetile.scene.bodies import whole_periods

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


def axes_with_walls(scene: Scene) -> str:
    """Returns the axes at whose ends there are walls."""
    return "".join(axis for axis in "xy" if scene.arena and axis not in scene.periodic)


def displacement(scene: Scene, apart: Floats) -> Floats:
    """Returns differences of positions, (..., 2), as those to the nearest image."""
    return np.asarray(apart - whole_periods(apart, scene.periods) * np.array(scene.periods))


def narrowest(scene: Scene) -> Floats:
    """Returns the width of the narrowest body and the height of the lowest: how much less than the arena's
    sides the middles of bodies can have; infinite without bodies."""
    if not scene.shapes:
        return np.full(2, 2.0 * float(scene.radius.min(initial=np.inf)))
    reaches = np.array([scene.shapes[each].reaches for each in scene.shape.tolist()])
    return np.asarray((reaches[:, ::2] + reaches[:, 1::2]).min(axis=0))


def inner_energy(moment: Moment) -> tuple[float, int]:
    """Returns the kinetic energy of movable bodies, and its degrees of freedom: two a body, less one for each
    axis along which momentum is kept, which is without the energy of the common motion. kT is twice the
    energy a degree. Momentum is kept along periodic axes, unless a body is immovable."""
    mass, velocity = movable(moment)
    energy = float((mass * velocity**2).sum()) / 2
    kept = moment.scene.periodic if 0 < len(mass) == len(moment.bodies) else ""
    for axis in kept:
        energy -= float((mass * velocity)[:, "xy".index(axis)].sum()) ** 2 / (2.0 * float(mass.sum()))
    return energy, 2 * len(mass) - len(kept)


def movable(moment: Moment) -> tuple[Floats, Floats]:
    """Returns the masses, (n, 1), and the velocities, (n, 2), of the bodies of finite mass."""
    mass = moment.masses()
    moves = np.isfinite(mass)
    return mass[moves, None], moment.velocities()[moves]


def neighbours(scene: Scene, positions: Floats, within: float) -> Iterator[tuple[Integers, Integers, Floats]]:
    """Yields all pairs of places not further apart than ``within``, in pieces: both places, (m,), and the way
    between, (m, 2), to the nearest image. By x, each is compared with the next, ... until all are too far."""
    order = np.argsort(positions[:, 0], kind="stable")
    sorted_places, n = positions[order], len(positions)
    for step in range(1, n // 2 + 1):
        apart = displacement(scene, np.roll(sorted_places, -step, axis=0) - sorted_places)
        if 2 * step == n:
            apart = apart[: n // 2]  # the other half is the same pairs
        if not (np.abs(apart[:, 0]) <= within).any():
            return
        near = np.flatnonzero(np.hypot(*apart.T) <= within)
        yield order[near], order[(near + step) % n], apart[near]
