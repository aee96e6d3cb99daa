"""Many exact ties in one scene, many contacts in one run, many bodies in one box.

A simulation costs a few milliseconds before its first event, so a hundred lattices of two to nine bodies are
in one scene, too distant to meet, and all numbers are small and dyadic. A marathon has few bodies and a
hundred thousand contacts, so slow that the base of the clock moves often: a counter of 16 bits overflows, a
tick that is not named in ``ticks`` is out of date, and small errors add up.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile import Scene
from kinetile.arrays import Flags
from kinetile.instruments import SPAN, TICKS
from kinetile_conformance.strategies.strategy import numbered
from kinetile_conformance.strategies.swarms import slots, square, swarm, swarm_of
from kinetile_conformance.strategies.torus import torus

LATTICES = 100
APART = (16, 10)
"""Distances of lattices: farther than most bodies fly, or so near that their bodies meet at last."""

FEWEST, MOST = 2, 9
"""Bodies of a lattice, and of a marathon."""

UNTIL = 6.0

SHAPES = np.array([(4, 4), (3, 3), (9, 1), (1, 9), (5, 2), (2, 5)])
"""Columns and rows of unit squares."""


def lattices(count: int, seed: int, arena: bool, apart: int = APART[0]) -> Scene:
    """Returns lattices in one scene, at a distance ``apart``, with or without an arena around them all."""
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
    walls = (float(apart * side), float(apart * side)) if arena else None
    return swarm_of(place[there], velocity[there], radius[there], walls, UNTIL)


def _some(random: np.random.Generator, count: int, share: float) -> Flags:
    """Returns a random choice of a share of the lattices, (count, 1, 1)."""
    return random.random((count, 1, 1)) < share


def falling(number: int) -> Scene:
    """Returns lattices, or bodies of several sizes, that fall along one axis or both, by much or hardly; some
    have their own accelerations, and one of six is immovable. No body rests on a wall; half of the swarms
    have no walls."""
    random = np.random.default_rng(number)
    base = lattices(4, number, True, APART[1]) if number & 1 else swarm("gas", 30, number, number % 7)
    bodies = np.arange(len(base))
    pulls = random.choice([-1.0, 0.0, 1.0], (len(base) + 1, 2))
    gravity, *own = pulls * 2.0 ** random.integers(-6, 4, pulls.shape)
    own = np.array(own)
    fixed = bodies % 6 == number % 6
    own[fixed] = 0.0
    own[random.random(len(base)) < 0.5] = math.nan
    velocity = np.where(base.velocity == 0.0, 0.25, base.velocity)
    velocity[fixed] = 0.0
    mass = np.where(fixed, math.inf, 2.0 ** random.integers(-1, 2, len(base)))
    arena, settings = base.arena, base.settings
    if number % 4 == 2:  # in the plane they part soon
        arena, settings = None, replace(settings, until=6.0)
    more: dict[str, Any] = {"gravity": gravity.tolist(), "acceleration": own, "settings": settings}
    return base.replace(velocity=velocity, mass=mass, arena=arena, **more)


def falling_round(number: int) -> Scene:
    """Returns bodies of several kinds that fall across a periodic axis; some turn."""
    scene = torus(number)
    if scene.periodic == "xy":  # nothing would stop a fall
        return falling_round(number + 1)
    return scene.replace(gravity=(0.0, -0.25) if scene.periodic == "x" else (0.25, 0.0))


ROUND = 5
"""Falling scenes on walls for each one on a torus."""


def _falling(count: int, seed: int) -> Iterator[Scene]:
    for at, number in enumerate(np.random.default_rng(seed).integers(0, 2**24, count).tolist()):
        yield (falling_round if at % (ROUND + 1) == ROUND else falling)(number)


BASES, CONTACTS = 40, 100_000
"""The least number of moves of the clock's base in a marathon, and its number of contacts."""


def marathon(bodies: int, seed: int) -> Scene:
    """Returns bodies in a small box, which meet each other and the walls for a long time."""
    random = np.random.default_rng(seed)
    columns, rows = random.permutation([3, 4])
    place = slots(random, bodies, int(columns), int(rows))
    radius = random.choice([0.25, 0.375, 0.4375], bodies)
    place += (0.5 - radius)[:, None] * random.uniform(-1.0, 1.0, (bodies, 2))
    velocity = random.normal(size=(bodies, 2))
    # A body meets a wall or another about once while it flies a length of 1: in all a contact each
    # 1 / (bodies speed). With this speed the contacts last for this many spans of the clock.
    speed = CONTACTS / (bodies * BASES * (SPAN // TICKS))
    velocity *= speed / np.sqrt((velocity**2).sum(axis=1).mean())
    until = float(4 * BASES * (SPAN // TICKS))
    return swarm_of(place, velocity, radius, (float(columns), float(rows)), until)


FEW = 128
"""Pairs that meet among many bodies."""


def of_few(bodies: int) -> tuple[Scene, npt.NDArray[np.integer]]:
    """Returns many bodies at rest, except the first of each of some pairs, which flies at the second; no
    other bodies meet. Also returns the numbers of the pairs."""
    random, side = np.random.default_rng(bodies), square(bodies, 1.0)
    place = slots(random, bodies, side, side) + random.uniform(-0.25, 0.25, (bodies, 2))
    last = np.arange(bodies - FEW, bodies)
    chosen, velocity = np.append(random.permutation(last[0])[:FEW], last), np.zeros((bodies, 2))
    one, two = random.permutation(chosen).reshape(2, FEW)
    place[two] = place[one] + [0.125, 0.0]
    velocity[one, 0] = random.uniform(0.0625, 0.125, FEW)
    radius = np.full(bodies, 1.0 / 64.0)
    return swarm_of(place, velocity, radius, (float(side), float(side)), 1.5), np.sort(chosen)


DRAWS = {
    "lattices": numbered(lambda number: lattices(LATTICES, number, bool(number & 1), APART[number >> 1 & 1])),
    "falling scenes": _falling,
    "marathons": numbered(lambda number: marathon(FEWEST + number % (MOST - FEWEST + 1), number)),
    "large scenes": numbered(lambda number: swarm("gas", 1_500, number, 1 + number % 7)),
}
