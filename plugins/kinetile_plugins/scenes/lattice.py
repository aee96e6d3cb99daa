"""Discs on a lattice: exact ties, touching starts, and cases a rounding away from them.

Errors of broad phases show most often if bounds coincide, many events share one instant, discs touch each
other or a wall at the start, and several discs reach one place together. Each seed draws a lattice, a few
sizes and velocities, and the discs that are moved along their line until they touch the disc before them:

- ``kind="dyadic"``: all lengths are multiples of 1/64 and all velocities of 1/4, so that positions,
  contacts in line with an axis and ties are exact in floating point;
- ``kind="non-dyadic"``: cells of 1/3 to 1/12 and no square arena, several radii and masses, so that
  a tie in exact arithmetic is one only up to a rounding;
- ``jitter`` moves each centre by up to this length (1e-16 to 1e-9 find most errors), and shrinks discs that
  would overlap;
- ``turns`` are changes of velocity at multiples of 1/16, the times of many contacts.
"""

import math

import numpy as np

from kinetile import Scene, Turn
from kinetile.arrays import Floats
from kinetile.scene.bodies import distance, overlapping_pairs
from kinetile.scene.checks import TOLERANCE
from kinetile_plugins.scenes.numerics import Draws, demand, demand_number, draws

_LAST_TURN = 64  # in sixteenths of a time unit


def lattice(
    *,
    bodies: int = 16,
    kind: str = "dyadic",
    touching: float = 0.4,
    jitter: float = 0.0,
    turns: int = 0,
    seed: int = 1,
) -> Scene:
    """Discs on a lattice: exact ties and touching starts, or almost.

    Args:
        bodies: the number of discs
        kind: dyadic or non-dyadic numbers
        touching: the share of the discs that are moved until they touch the one before, or the wall; 0 to 1
        jitter: the largest displacement of centres, 0 to 0.001
        turns: the number of changes of velocity, at multiples of 1/16 up to 4
        seed: of all that is drawn, a whole number from 0
    """
    demand_number("bodies", bodies, 1, "a lattice has 1 body or more")
    demand(kind in ("dyadic", "non-dyadic"), f"kind is {kind!r}; it is 'dyadic' or 'non-dyadic'")
    demand(0.0 <= touching <= 1.0, f"touching is {touching}; it is a share, from 0 to 1")
    demand(0.0 <= jitter <= 1e-3, f"jitter is {jitter}; it is from 0 to 0.001, much less than a disc")
    demand_number("turns", turns, 0, "it is 0 or more")
    for_lattice, for_bodies, for_jitter, for_turns = draws(seed, 4)
    exact = kind == "dyadic"
    cells = 8 if exact else 3 + int(for_lattice.below(10))
    columns, rows = _shape(bodies, for_lattice)
    arena = (columns / cells, rows / cells)
    radius, mass = _sizes(bodies, exact, 1.0 / cells, for_lattice, for_bodies)
    steps = ([1, 2, 4] if exact else [1, 3, 7])[int(for_lattice.below(3))]
    velocity = (for_bodies.below(2 * steps + 1, bodies, 2) - steps) / steps
    if for_lattice.uniform() < 0.5:  # along the lattice's lines: contacts keep all numbers simple
        velocity[np.arange(bodies), for_bodies.below(2, bodies)] = 0.0
    site = for_bodies.order(columns * rows)[:bodies]
    position = (np.stack([site % columns, site // columns], axis=1) + 0.5) / cells
    _move_into_contact(position, radius, int(for_lattice.below(2)), touching, for_bodies)
    if jitter:
        position += 2.0 * jitter * for_jitter.uniform(bodies, 2) - jitter
        radius = _without_overlap(position, radius, arena)
    times = for_turns.below(_LAST_TURN + 1, turns) / 16.0
    turned = for_turns.below(bodies, turns)
    after = (for_turns.below(2 * steps + 1, turns, 2) - steps) / steps
    schedule = [
        Turn(body, time, (vx, vy))
        for body, time, (vx, vy) in zip(turned.tolist(), times.tolist(), after.tolist(), strict=True)
    ]
    return Scene(position, velocity, radius, mass, arena, schedule)


def _shape(bodies: int, random: Draws) -> tuple[int, int]:
    """Returns the columns and rows of a lattice with room for more than these bodies; never a square."""
    sites = bodies * (1.2 + (2.5 - 1.2) * float(random.uniform()))
    columns = max(2, round(math.sqrt(sites) * (0.7 + (1.4 - 0.7) * float(random.uniform()))))
    rows = math.ceil(sites / columns)
    return columns, rows + (rows == columns)


def _sizes(
    bodies: int, exact: bool, cell: float, for_lattice: Draws, for_bodies: Draws
) -> tuple[Floats, Floats]:
    radii = cell * np.array([1.0, 2.0, 3.0, 4.0] if exact else [0.4, 1.1, 2.3, 3.3, 4.0]) / 8.0
    masses = np.array([1.0, 2.0, 4.0] if exact else [0.3, 1.0, 2.5, 7.0])
    radius = radii[for_bodies.below(len(radii), bodies)]
    mass = masses[for_bodies.below(len(masses), bodies)]
    if exact and for_lattice.uniform() < 0.7:
        radius = np.full(bodies, radii[1 + int(for_lattice.below(len(radii) - 1))])
    if exact and for_lattice.uniform() < 0.8:
        mass = np.ones(bodies)
    return radius, mass


def _move_into_contact(position: Floats, radius: Floats, axis: int, share: float, random: Draws) -> None:
    """Moves a share of the discs along ``axis`` until they touch the one before them, or the wall."""
    moved = random.uniform(len(radius)) < share
    order = np.lexsort((position[:, axis], position[:, 1 - axis]))
    line, end = math.nan, 0.0
    for body in order.tolist():
        if position[body, 1 - axis] != line:
            line, end = position[body, 1 - axis], 0.0
        if moved[body]:
            position[body, axis] = end + radius[body]
        end = position[body, axis] + radius[body]


def _without_overlap(position: Floats, radius: Floats, arena: tuple[float, float]) -> Floats:
    """Returns radii no larger than these, so that no discs overlap by more than a scene allows."""
    less = np.zeros(len(radius))
    for pairs in overlapping_pairs(position, radius, TOLERANCE):
        a, b = pairs.T
        depth = radius[a] + radius[b] - distance(position[a] - position[b])
        np.maximum.at(less, pairs.ravel(), np.repeat(depth / 2.0, 2))
    for axis in (0, 1):
        depth = radius - np.minimum(position[:, axis], arena[axis] - position[:, axis])
        less = np.where(depth > TOLERANCE * radius, np.maximum(less, depth), less)
    return radius - less
