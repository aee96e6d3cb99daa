"""Fixed scenes on which memory is watched: few bodies of all kinds where hooks run interpreted, many where
they run compiled.

They are made with a generator of their own and not drawn by Hypothesis, since a breach is named, with hook,
field and line, and need not be made smaller to be understood. What matters is that each hook runs in each
situation: crowds and lone bodies, walls and none, turns, sizes that differ, places far from the origin and
below it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from random import Random

from kinetile.scene import Scene, Settings, Turn

__all__ = ["MANY", "SMALL", "Kind", "titled"]

LARGEST = 0.375
"""The largest radius: a body that filled its cell could bounce between two walls without time passing."""


@dataclass(frozen=True)
class Kind:
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
        seed: what the numbers begin with.
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
    Kind(1, 2, 2),
    Kind(2, 2, 1),
    Kind(3, 2, 2, walls=False, turns=2),
    Kind(4, 2, 2, turns=2),
    Kind(5, 3, 3, ratio=32, seed=1),
    Kind(6, 3, 3, walls=False, corner=-1.5),
    Kind(7, 12, 1, resting=3, turns=2),
    Kind(8, 1, 12, ratio=8),
    Kind(8, 4, 4, walls=False, corner=2.0**20),
    Kind(9, 3, 3, turns=3),
    Kind(12, 4, 4, ratio=1, resting=4),
    Kind(12, 5, 5, walls=False, corner=-(2.0**30), ratio=16),
    Kind(30, 6, 6, turns=4),
    Kind(30, 40, 1, walls=False, corner=-20.0),
    Kind(30, 8, 8, ratio=64),
)
"""For interpreted hooks."""

MANY = (
    *SMALL,
    Kind(36, 6, 6),
    Kind(50, 200, 1, turns=6),
    Kind(64, 9, 9, walls=False, corner=-4.5, ratio=16),
    Kind(80, 10, 10, ratio=1024, turns=8),
    Kind(100, 12, 12, resting=30),
    Kind(100, 20, 20, walls=False, corner=2.0**16),
)
"""For compiled ones."""


def titled(kinds: tuple[Kind, ...]) -> Iterator[tuple[str, Scene]]:
    """Yield the scenes of these kinds, each with what messages call it."""
    return ((str(kind), kind.scene()) for kind in kinds)
