"""What swarms are made of: places apart from each other, sizes, velocities, turns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.scene import Scene, Settings, Turn

__all__ = ["Floats", "Swarm", "anyhow", "back_and_forth", "jitter", "moments_of", "radii", "slots", "square"]

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


def slots(random: np.random.Generator, bodies: int, columns: int, rows: int) -> Floats:
    """Return the middles of so many different unit squares of a lattice, (n, 2)."""
    chosen = random.choice(columns * rows, bodies, replace=False)
    middles: Floats = np.column_stack([chosen % columns, chosen // columns]).astype(np.float64) + 0.5
    return middles


def square(bodies: int, room: float) -> int:
    """Return the side of a square lattice with room for so many times the bodies."""
    return int(np.ceil(np.sqrt(room * bodies)))


def radii(random: np.random.Generator, bodies: int, variation: int) -> Floats:
    """Return radii of at most .45: all alike, of two sizes, or of any."""
    ratio = (1.0, 0.5, 0.125, 2.0**-6)[variation % 4]
    small: npt.NDArray[np.bool_] = random.random(bodies) < 0.75
    fills = np.ones(bodies) if variation < 4 else random.uniform(0.5, 1.0, bodies)
    radius: Floats = np.where(small, 0.45 * ratio, 0.45) * fills
    return radius


def jitter(random: np.random.Generator, radius: Floats) -> Floats:
    """Return displacements with which bodies stay in their unit squares, (n, 2)."""
    return (0.499 - radius)[:, None] * random.uniform(-1.0, 1.0, (len(radius), 2))


def anyhow(random: np.random.Generator, bodies: int) -> Floats:
    """Return velocities in all directions, (n, 2)."""
    return random.normal(size=(bodies, 2))


def moments_of(bodies: int) -> tuple[float, ...]:
    """Return when a cloud turns: the more often, the fewer its bodies are."""
    return tuple(2.0 * (turn + 1) for turn in range(1 + 300 // bodies))


def back_and_forth(velocity: Floats, moments: tuple[float, ...]) -> list[Turn]:
    """Return turns with which each body flies back, and forth again."""
    there, back = velocity.tolist(), (-velocity).tolist()
    return [
        Turn(body, moment, (vx, vy))
        for turn, moment in enumerate(moments)
        for body, (vx, vy) in enumerate(there if turn % 2 else back)
    ]
