"""Fixed scenes: the gallery that every phase is shown, the smallest scene, and scenes on which memory is
watched.

Memory is watched on few bodies of all kinds where hooks run interpreted, on many where they run compiled.
These scenes come from a generator of their own and not from Hypothesis, since a breach is named with hook,
field and line, and need not be minimised to be understood. What matters is that each hook runs in each
situation: crowds and lone bodies, walls and none, turns, sizes that differ, places far from the origin and
below it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Any

import numpy as np

from kinetile.errors import UnknownName
from kinetile.scene import Scene, Settings, Turn
from kinetile.scene.by_name import make_scene

SCENES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("grid", {"bodies": 25, "density": 0.5}),
    ("grid", {"bodies": 25, "density": 0.01}),
    ("random", {"bodies": 20, "density": 0.2, "radius_ratio": 20.0, "mass_ratio": 100.0}),
    ("figure-10", {}),
    ("figure-11", {}),
    ("figure-16", {}),
    ("cradle", {}),
    ("break", {}),
    ("lattice", {"bodies": 16, "seed": 3}),
    ("lattice", {"bodies": 16, "kind": "non-dyadic", "turns": 20, "seed": 4}),
    ("lattice", {"bodies": 16, "jitter": 1e-12, "seed": 5}),
)


def gallery() -> Iterator[tuple[str, Scene]]:
    """Yield (title, scene); recipes that are not installed are left out."""
    yield "a row between two", row_between_two()
    for name, parameters in SCENES:
        title = ", ".join([name, *(f"{key}={value}" for key, value in parameters.items())])
        try:
            yield title, make_scene(name, **parameters)
        except UnknownName:
            continue


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


LARGEST = 0.375
"""The largest radius: a body that filled its cell could bounce between two walls without time passing."""


@dataclass(frozen=True)
class CellScene:
    """A kind of scene: bodies on a lattice of unit cells, no two in one.

    Attributes:
        bodies: how many.
        columns: cells from left to right.
        rows: cells from bottom to top.
        walls: whether there is an arena; it needs a ``corner`` at the origin.
        corner: where the lower left corner of the lattice is, for both coordinates.
        ratio: how much smaller the smallest radius is than the largest.
        turns: how many bodies turn, each once.
        resting: how many bodies are at rest at the start.
        seed: the seed of its numbers.
    """

    bodies: int
    columns: int
    rows: int
    walls: bool = True
    corner: float = 0.0
    ratio: int = 2
    turns: int = 0
    resting: int = 0
    seed: int = 0

    def __str__(self) -> str:
        bodies = f"{self.bodies} {'body' if self.bodies == 1 else 'bodies'}"
        cells = f"{self.columns} x {self.rows} cells"
        return f"{bodies} in {cells} from {self.corner:g} on, {'with' if self.walls else 'without'} walls"

    def scene(self) -> Scene:
        """Return the scene of this kind."""
        random = Random(f"{self.seed} {self.bodies} {self.columns}")
        cells = random.sample(range(self.columns * self.rows), self.bodies)
        radius = [LARGEST / random.choice((1, 2, self.ratio)) for _ in cells]
        velocity = [[random.randint(-8, 8) / 8, random.randint(-8, 8) / 8] for _ in cells]
        for body in range(self.resting):
            velocity[body] = [0.0, 0.0]
        place = [divmod(cell, self.columns)[::-1] for cell in cells]
        turning = random.sample(range(self.bodies), self.turns)
        return Scene(
            position=[[self.corner + column + 0.5, self.corner + row + 0.5] for column, row in place],
            velocity=velocity,
            radius=radius,
            arena=(float(self.columns), float(self.rows)) if self.walls else None,
            turns=[
                Turn(body, random.randint(0, 16) / 8, (random.randint(-8, 8) / 8, 0.5)) for body in turning
            ],
            settings=Settings(until=4.0),
        )


SMALL = (
    CellScene(1, 2, 2),
    CellScene(2, 2, 1),
    CellScene(3, 2, 2, walls=False, turns=2),
    CellScene(4, 2, 2, turns=2),
    CellScene(5, 3, 3, ratio=32, seed=1),
    CellScene(6, 3, 3, walls=False, corner=-1.5),
    CellScene(7, 12, 1, resting=3, turns=2),
    CellScene(8, 1, 12, ratio=8),
    CellScene(8, 4, 4, walls=False, corner=2.0**20),
    CellScene(9, 3, 3, turns=3),
    CellScene(12, 4, 4, ratio=1, resting=4),
    CellScene(12, 5, 5, walls=False, corner=-(2.0**30), ratio=16),
    CellScene(30, 6, 6, turns=4),
    CellScene(30, 40, 1, walls=False, corner=-20.0),
    CellScene(30, 8, 8, ratio=64),
)
"""For interpreted hooks."""

MANY = (
    *SMALL,
    CellScene(36, 6, 6),
    CellScene(50, 200, 1, turns=6),
    CellScene(64, 9, 9, walls=False, corner=-4.5, ratio=16),
    CellScene(80, 10, 10, ratio=1024, turns=8),
    CellScene(100, 12, 12, resting=30),
    CellScene(100, 20, 20, walls=False, corner=2.0**16),
)
"""For compiled ones."""


def titled(kinds: tuple[CellScene, ...]) -> Iterator[tuple[str, Scene]]:
    """Yield the scenes of these kinds, each with its name in messages."""
    return ((str(kind), kind.scene()) for kind in kinds)
