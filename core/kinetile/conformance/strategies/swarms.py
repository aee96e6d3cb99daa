"""Swarms: scenes of many bodies, each of a kind that puts places, lists and counters of a phase to use.

What a phase keeps in a list overflows in a crowd, what it keeps in a table collides when there are many, a
number of 8 bits ends at 256 bodies, and truncation is not floor left of the origin. None of that shows with
six bodies. A swarm is made with NumPy from its kind, how many bodies, a seed, and a variation of its kind;
one drawn number says all four. What fails is made smaller body by body (``reduction``).

Every body begins in a slot of its own, so that none overlap. All masses are equal, since each case of the
loop is compiled; kinds without an arena keep together by turns.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from kinetile.scene import Scene, Settings, Turn

__all__ = ["CONTACTS", "KINDS", "swarm", "swarm_scenes"]

CONTACTS = 1500
"""After so many contacts a swarm has shown what it can show."""

FEWEST, MOST = 8, 400

Floats = npt.NDArray[np.float64]


class Swarm(NamedTuple):
    """Bodies, (n, 2) and (n,), their arena, their turns and until when they run."""

    position: Floats
    velocity: Floats
    radius: Floats
    arena: tuple[float, float] | None
    until: float
    turns: list[Turn]

    @property
    def scene(self) -> Scene:
        """The scene."""
        return Scene(
            self.position,
            self.velocity,
            self.radius,
            arena=self.arena,
            turns=self.turns,
            settings=Settings(until=self.until),
        )


def _slots(random: np.random.Generator, bodies: int, columns: int, rows: int) -> Floats:
    """Return the middles of so many different unit squares of a lattice, (n, 2)."""
    chosen = random.choice(columns * rows, bodies, replace=False)
    middles: Floats = np.column_stack([chosen % columns, chosen // columns]).astype(np.float64) + 0.5
    return middles


def _square(bodies: int, room: float) -> int:
    """Return the side of a square lattice with room for so many times the bodies."""
    return int(np.ceil(np.sqrt(room * bodies)))


def _radii(random: np.random.Generator, bodies: int, variation: int) -> Floats:
    """Return radii of at most .45: all alike, of two sizes, or of any."""
    ratio = (1.0, 0.5, 0.125, 2.0**-6)[variation % 4]
    small: npt.NDArray[np.bool_] = random.random(bodies) < 0.75
    fills = np.ones(bodies) if variation < 4 else random.uniform(0.5, 1.0, bodies)
    radius: Floats = np.where(small, 0.45 * ratio, 0.45) * fills
    return radius


def _jitter(random: np.random.Generator, radius: Floats) -> Floats:
    """Return displacements with which bodies stay in their unit squares, (n, 2)."""
    return (0.499 - radius)[:, None] * random.uniform(-1.0, 1.0, (len(radius), 2))


def _anyhow(random: np.random.Generator, bodies: int) -> Floats:
    """Return velocities in all directions, (n, 2)."""
    return random.normal(size=(bodies, 2))


def _gas(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Bodies of one or several sizes in a square."""
    side = _square(bodies, 1.2)
    radius = _radii(random, bodies, variation)
    place = _slots(random, bodies, side, side) + _jitter(random, radius)
    return Swarm(place, _anyhow(random, bodies), radius, (float(side), float(side)), 40.0, [])


def _lattice(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Columns and rows: bodies with one coordinate in common, dyadic numbers, ties in bulk."""
    columns = (2, 4, _square(bodies, 1.3), _square(bodies, 3.0))[variation % 4]
    rows = -(-int(1.4 * bodies) // columns)
    radius = np.full(bodies, 0.25 if variation < 4 else 0.5)
    velocity = random.integers(-2, 3, (bodies, 2)) / 2.0
    velocity[np.arange(bodies), random.integers(0, 2, bodies)] = 0.0
    place, arena = _slots(random, bodies, columns, rows), (float(columns), float(rows))
    if variation & 1:
        return Swarm(place[:, ::-1], velocity[:, ::-1], radius, arena[::-1], 100.0, [])
    return Swarm(place, velocity, radius, arena, 100.0, [])


def _shear(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Rows that fly past each other, touching or just not, as trains."""
    side = _square(bodies, 1.5)
    place = _slots(random, bodies, side, side)
    speed = np.where(place[:, 1] % 2 < 1, 1.0, -1.0) * (1.0 + variation % 2)
    radius = np.full(bodies, (0.5, 0.375, 0.5 - 2.0**-30, 0.25)[variation % 4])
    velocity = np.column_stack([speed, np.zeros(bodies)])
    velocity[random.integers(0, bodies), 1] = 0.5
    return Swarm(place, velocity, radius, (float(side), float(side)), 50.0, [])


def _corridor(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """An arena a thousand times as long as it is wide."""
    length = 1024
    radius = 0.5 * _radii(random, bodies, variation % 4)
    place = _slots(random, bodies, length, 1) + _jitter(random, radius)
    velocity = _anyhow(random, bodies) * np.array([30.0, 1.0])
    arena = (float(length), 1.0)
    if variation & 1:
        return Swarm(place[:, ::-1], velocity[:, ::-1], radius, arena[::-1], 10.0, [])
    return Swarm(place, velocity, radius, arena, 10.0, [])


def _crowd(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """All small bodies in the place of one large one, of which some stand about."""
    small = bodies - 3
    side = _square(small, 1.3)
    pitch = 1.5 / side
    radius = np.full(bodies, 0.4 * pitch)
    radius[:3] = 1.0
    place = np.empty((bodies, 2))
    place[:3] = np.array([[1.5, 5.5], [5.5, 1.5], [6.5, 6.5]])
    place[3:] = 0.25 + pitch * _slots(random, small, side, side)
    velocity = 0.1 * (1 + variation % 4) * _anyhow(random, bodies)
    velocity[:3] *= 0.5 * (variation & 1)
    return Swarm(place, velocity, radius, (8.0, 8.0), 30.0, [])


def _giants(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Fine beside coarse: few large bodies, many that are up to a thousand times smaller between them."""
    large = 4
    side = _square(bodies, 1.2)
    radius = np.full(bodies, 2.0 ** -(4 + 2 * (variation % 4)) * 4.0)
    radius[:large] = 4.0
    place = np.empty((bodies, 2))
    place[:large] = np.array([[5.0, 5.0], [15.0, 5.0], [5.0, 15.0], [15.0, 15.0]])
    pitch = 20.0 / side
    fine = np.minimum(radius[large:], 0.24 * pitch)
    place[large:] = np.array([0.0, 20.0]) + pitch * _slots(random, bodies - large, side, side)
    radius[large:] = fine
    return Swarm(place, 2.0 * _anyhow(random, bodies), radius, (20.0, 40.0), 12.0, [])


def _resting(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Bodies at rest, and a few fast ones among them."""
    swarm = _gas(random, bodies, variation)
    fast = random.random(bodies) < 2.0 ** -(2 + variation % 4)
    fast[0] = True
    return swarm._replace(velocity=np.where(fast[:, None], 8.0 * swarm.velocity, 0.0))


def _burst(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """All in the middle, and off at one moment in all directions."""
    side = _square(bodies, 1.2)
    radius = _radii(random, bodies, variation)
    inside = _slots(random, bodies, side, side) + _jitter(random, radius) - side / 2.0
    wide = 3.0 * side
    return Swarm(inside + wide / 2.0, inside * (2.0, 8.0)[variation & 1], radius, (wide, wide), 8.0, [])


def _crossings(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Small and fast, with much room: hardly any contact, and thousands of places passed."""
    side = _square(bodies, 1.2)
    radius = np.full(bodies, (0.125, 2.0**-5, 2.0**-7, 0.25)[variation % 4])
    place = _slots(random, bodies, side, side) + _jitter(random, radius)
    velocity = side * _anyhow(random, bodies)
    return Swarm(place, velocity, radius, (float(side), float(side)), 512.0 / bodies, [])


def _cloud(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Without an arena, about the origin: bodies that fly together, or anywhere, and back."""
    side = _square(bodies, 1.5)
    radius = _radii(random, bodies, variation)
    place = _slots(random, bodies, side, side) + _jitter(random, radius) - side / 2.0
    velocity = -place * random.uniform(0.8, 1.2, (bodies, 1)) + 0.1 * _anyhow(random, bodies)
    if random.random() < 0.5:
        velocity = _anyhow(random, bodies)
    moments = _moments(bodies)
    return Swarm(place, velocity, radius, None, moments[-1] + 2.0, _back_and_forth(velocity, moments))


def _far(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """A cloud far from the origin, so fine that its lanes have numbers beyond 2^31."""
    swarm = _cloud(random, bodies, 0 if variation < 4 else 1)
    scale = 2.0 ** (-10 if variation & 1 else 0)
    away = (2.0**33, 2.0**12, 2.0**20, 2.0**32)[variation % 4] * random.choice([-1.0, 1.0], 2)
    velocity = scale * swarm.velocity
    return swarm._replace(
        position=scale * (away + swarm.position),
        velocity=velocity,
        radius=scale * swarm.radius,
        turns=_back_and_forth(velocity, _moments(bodies)),
    )


def _returning(random: np.random.Generator, bodies: int, variation: int) -> Swarm:
    """Without an arena: bodies leave for far away, and come back."""
    side = _square(bodies, 1.5)
    radius = _radii(random, bodies, variation)
    place = _slots(random, bodies, side, side) + _jitter(random, radius) - side / 2.0
    velocity = place * (2.0, 16.0)[variation & 1]
    # At 4 they are where they began, and fly on through each other's midst.
    return Swarm(place, velocity, radius, None, 7.0, _back_and_forth(velocity, (2.0, 5.0)))


def _back_and_forth(velocity: Floats, moments: tuple[float, ...]) -> list[Turn]:
    """Return turns with which each body flies back, and forth again."""
    there, back = velocity.tolist(), (-velocity).tolist()
    return [
        Turn(body, moment, (vx, vy))
        for turn, moment in enumerate(moments)
        for body, (vx, vy) in enumerate(there if turn % 2 else back)
    ]


def _moments(bodies: int) -> tuple[float, ...]:
    """Return when a cloud turns: the more often, the fewer its bodies are."""
    return tuple(2.0 * (turn + 1) for turn in range(1 + 300 // bodies))


KINDS: dict[str, Callable[[np.random.Generator, int, int], Swarm]] = {
    "gas": _gas,
    "cloud": _cloud,
    "crowd": _crowd,
    "far": _far,
    "lattice": _lattice,
    "shear": _shear,
    "corridor": _corridor,
    "giants": _giants,
    "resting": _resting,
    "burst": _burst,
    "crossings": _crossings,
    "returning": _returning,
}
"""The kinds of swarms, the simplest first."""


def swarm(kind: str, bodies: int = 100, seed: int = 0, variation: int = 0) -> Scene:
    """Return a swarm of a kind, of so many bodies (at least 8); ``variation``, from 0 to 7, is of its sizes,
    speeds or proportions."""
    return KINDS[kind](np.random.default_rng(seed), bodies, variation).scene


def _numbered(number: int) -> Scene:
    """Return the swarm of a number: its kind is the remainder, the rest is drawn from the quotient."""
    seed, kind = divmod(number, len(KINDS))
    random = np.random.default_rng(seed)
    bodies, variation = random.integers(FEWEST, MOST + 1), random.integers(8)
    return swarm(list(KINDS)[kind], int(bodies), seed, int(variation))


def swarm_scenes() -> st.SearchStrategy[Scene]:
    """Return the swarms.

    They are drawn by one number: of several, Hypothesis draws the first and the last values over and over,
    and of twelve kinds leaves out three or four in fifty scenes.
    """
    return st.integers(0, 2**24 - 1).map(_numbered)
