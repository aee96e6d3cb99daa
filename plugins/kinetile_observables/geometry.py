"""Distances in the arena and motion about its centre of mass, with walls and with periodic axes."""

from collections.abc import Iterator

import numpy as np

from kinetile import Moment, Scene
from kinetile.arrays import Flags, Floats, Integers

_MOST_PARTS = 10
_AT_ONCE = 2**16
"""Pairs compared at once, except the pairs of one place, which are never split."""


def axes_with_walls(scene: Scene) -> str:
    """Returns the axes with walls at their ends."""
    return "".join(axis for axis in "xy" if scene.arena and axis not in scene.periodic)


def displacement(scene: Scene, apart: Floats) -> Floats:
    """Returns differences of positions, (..., 2), reduced to the nearest images."""
    periods = np.array(scene.periods)
    return np.asarray(apart - np.rint(apart / np.where(periods > 0.0, periods, np.inf)) * periods)


def narrowest(scene: Scene) -> Floats:
    """Returns the width of the narrowest body and the height of the lowest: the differences of the arena's
    sides from the range of bodies' middles; infinite without bodies."""
    if not scene.shapes:
        return np.full(2, 2.0 * float(scene.radius.min(initial=np.inf)))
    reaches = np.array([scene.shapes[each].reaches for each in scene.shape.tolist()])
    return np.asarray((reaches[:, ::2] + reaches[:, 1::2]).min(axis=0))


def inner_motion(moment: Moment) -> tuple[Floats, Floats, Floats]:
    """Returns the masses of all movable bodies, (n, 1), their velocities relative to their centre of mass,
    (n, 2), and their degrees of freedom, (n,). kT of all, or of some, is their m v^2 over their degrees.
    Momentum is conserved along an axis without walls if no body is immovable: there a body of mass m, among
    bodies of total mass M, has 1 - m/M of a degree, for in equilibrium <m v^2> = kT (1 - m/M)."""
    mass, velocity = movable(moment)
    degrees = np.full(len(mass), 2.0)
    if 0 < len(mass) == len(moment.bodies):
        share = mass[:, 0] / mass.sum()
        for axis in range(2):
            if "xy"[axis] not in axes_with_walls(moment.scene):
                velocity[:, axis] -= (share * velocity[:, axis]).sum()
                degrees -= share
    return mass, velocity, degrees


def parts(moment: Moment, name: str) -> dict[str, Flags]:
    """Returns masks of the movable bodies, (n,), by the names of a quantity: ``name`` for all bodies, and
    ``name of big`` for each kind, or in a scene of one kind for each mass, if these are 2 to 10."""
    mass, several = moment.masses(), len(moment.scene.kinds) > 1
    its = (moment.kinds.astype(str) if several else mass)[np.isfinite(mass)]
    found, names = {name: np.ones(len(its), dtype=bool)}, np.unique(its)
    for each in names if 1 < len(names) <= _MOST_PARTS else ():
        found[f"{name} of {'' if several else 'mass '}{each}"] = its == each
    return found


def movable(moment: Moment) -> tuple[Floats, Floats]:
    """Returns the masses, (n, 1), and the velocities, (n, 2), of the bodies of finite mass."""
    mass = moment.masses()
    moves = np.isfinite(mass)
    return mass[moves, None], moment.velocities()[moves]


def neighbours(scene: Scene, positions: Floats, within: float) -> Iterator[tuple[Integers, Integers, Floats]]:
    """Yields all pairs of places in the arena with a distance of at most ``within``, in pieces: both places,
    (m,), and the vector between, (m, 2), to the nearest image. Both places are in one cell of a grid, or in
    adjoining cells; if fewer than three cells of width ``within`` fit, the grid has one column, or row."""
    n, sides = len(positions), np.array(scene.arena)
    if not n:
        return
    cells = np.minimum(sides / (within * (1.0 + 1e-9)), 2.0**20).astype(np.int64)
    cells[cells < 3] = 1
    row, around = np.array([1, cells[0]]), np.array([axis in scene.periodic for axis in "xy"])
    cell = np.clip((positions / sides * cells).astype(np.int64), 0, cells - 1)
    order = np.argsort(cell @ row, kind="stable")
    cell, positions = cell[order], positions[order]
    for step in np.array([(0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)]):
        if (cells[step != 0] == 1).any():
            continue
        there = (cell + step) % cells
        first, end = (np.searchsorted(cell @ row, there @ row, side) for side in ("left", "right"))
        first = first if step.any() else np.arange(1, n + 1)
        many = np.where((around | (there == cell + step)).all(axis=1), end - first, 0)
        total, alone = np.cumsum(many), (around & (cells == 1)).any()
        wraps = alone | (there != cell + step).any(axis=1)
        for some in np.split(np.arange(n), np.searchsorted(total, np.arange(_AT_ONCE, total[-1], _AT_ONCE))):
            one = np.repeat(some, many[some])
            other = np.arange(len(one)) + np.repeat((first + many - total)[some], many[some])
            other += (total - many)[some[:1]].sum()
            apart = positions.take(other, 0) - positions.take(one, 0)
            across = np.flatnonzero(wraps.take(one))  # others have no nearer image
            apart[across] = displacement(scene, apart[across])
            near = np.flatnonzero(np.hypot(*apart.T) <= within)
            yield order.take(one.take(near)), order.take(other.take(near)), apart.take(near, 0)
