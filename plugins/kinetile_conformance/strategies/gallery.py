"""Fixed scenes: the gallery that every phase is shown, and scenes on which memory is watched.

Memory is watched on few bodies of all kinds, with interpreted hooks.
These scenes come from a generator of their own and not from Hypothesis, since a breach is named with hook,
field and line, and need not be minimised to be understood. What matters is that each hook runs in each
situation: crowds and lone bodies, walls and none, turns, sizes that differ, places far from the origin and
below it.
"""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import numpy as np

from kinetile.scene import Scene, Settings, Turn
from kinetile_conformance.strategies.shapes import shape_torus
from kinetile_conformance.strategies.strategy import Strategy
from kinetile_conformance.strategies.torus import torus


def row_between_two() -> Scene:
    """Return two large bodies, one over the other, and a row of small ones between them: behind each gap of
    the row the two see each other, so one may be named to the other many times."""
    small = 24
    place = np.concatenate([[[8.0, 8.0], [8.0, 25.5]], np.full((small, 2), 16.75)])
    place[2:, 0] = 2.25 + np.arange(small) / 2
    velocity = np.zeros((small + 2, 2))
    velocity[:2, 1] = -0.125, 0.125
    velocity[2:, 0] = np.arange(small) % 3 - 1.0
    return Scene(place, velocity, [8.0, 8.0] + [0.125] * small, arena=(16.0, 34.0))


def smallest() -> Scene:
    """Return one body in a box."""
    return Scene([[0.5, 0.5]], [[0.0, 0.0]], 0.25, arena=(1.0, 1.0))


def _shown() -> Iterator[Scene]:
    """Yield scenes with nothing, one body, or nothing that moves, and a row between two."""
    nobody = np.zeros((0, 2))
    yield Scene(nobody, nobody, np.zeros(0), arena=(1.0, 1.0))
    yield smallest()
    yield smallest().replace(velocity=[[1.0, 0.5]])
    yield Scene([[0.25, 0.5], [0.75, 0.5]], np.zeros((2, 2)), 0.25, arena=(1.0, 1.0))
    yield Scene([[0.5, 0.5], [1.5, 0.5]], [[1.0, 0.0], [1.0, 0.0]], 0.5, arena=(8.0, 1.0))
    yield row_between_two()


gallery_scenes = Strategy(
    "the gallery",
    "-in-the-gallery",
    "where there is nothing, one body, nothing that moves, or a row between two",
    lambda count, seed: _shown(),
    fixed=6,
)


LARGEST = 0.375
"""The largest radius: a body that filled its cell could bounce between two walls without time passing."""


def cells(
    bodies: int,
    columns: int,
    rows: int,
    walls: bool = True,
    corner: float = 0.0,
    ratio: int = 2,
    turns: int = 0,
    resting: int = 0,
    seed: int = 0,
) -> tuple[str, Scene]:
    """Return a title, and a scene of bodies on a lattice of unit cells, no two in one.

    Args:
        bodies: how many.
        columns, rows: cells from left to right, and from bottom to top.
        walls: whether there is an arena; it needs a ``corner`` at the origin.
        corner: where the lower left corner of the lattice is, for both coordinates.
        ratio: how much smaller the smallest radius is than the largest.
        turns: how many bodies turn, each once.
        resting: how many bodies are at rest at the start.
        seed: the seed of its numbers.
    """
    random = Random(f"{seed} {bodies} {columns}")
    chosen = random.sample(range(columns * rows), bodies)
    radius = [LARGEST / random.choice((1, 2, ratio)) for _ in chosen]
    velocity = [[random.randint(-8, 8) / 8, random.randint(-8, 8) / 8] for _ in chosen]
    velocity[:resting] = [[0.0, 0.0]] * resting
    turning = random.sample(range(bodies), turns)
    scene = Scene(
        position=[[corner + cell % columns + 0.5, corner + cell // columns + 0.5] for cell in chosen],
        velocity=velocity,
        radius=radius,
        arena=(float(columns), float(rows)) if walls else None,
        turns=[Turn(body, random.randint(0, 16) / 8, (random.randint(-8, 8) / 8, 0.5)) for body in turning],
        settings=Settings(until=4.0),
    )
    many = f"{bodies} {'body' if bodies == 1 else 'bodies'} in {columns} x {rows} cells"
    return f"{many} from {corner:g} on, {'with' if walls else 'without'} walls", scene


SMALL = (
    cells(1, 2, 2),
    cells(2, 2, 1),
    cells(3, 2, 2, walls=False, turns=2),
    cells(4, 2, 2, turns=2),
    cells(5, 3, 3, ratio=32, seed=1),
    cells(6, 3, 3, walls=False, corner=-1.5),
    cells(7, 12, 1, resting=3, turns=2),
    cells(8, 1, 12, ratio=8),
    cells(8, 4, 4, walls=False, corner=2.0**20),
    cells(9, 3, 3, turns=3),
    cells(12, 4, 4, ratio=1, resting=4),
    cells(12, 5, 5, walls=False, corner=-(2.0**30), ratio=16),
    cells(30, 6, 6, turns=4),
    cells(30, 40, 1, walls=False, corner=-20.0),
    cells(30, 8, 8, ratio=64),
    *(
        (title, scene.replace(settings=Settings(until=1.0)))
        for title, scene in (
            ("a swarm on a torus", torus(7)),
            ("a swarm of shapes on a torus", shape_torus(6)),
        )
    ),
)
"""For interpreted hooks: on many bodies they would take too long."""
