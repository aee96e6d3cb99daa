"""What the recipes share: refusing a parameter in a sentence, and drawing from a seed."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from kinetile.errors import BadOption

__all__ = ["Floats", "demand", "generators", "in_random_directions"]

Floats = npt.NDArray[np.float64]


def demand(granted: bool, sentence: str) -> None:
    """Raise BadOption with ``sentence`` unless the demand is granted."""
    if not granted:
        raise BadOption(sentence)


def generators(seed: int, count: int) -> list[np.random.Generator]:
    """Return independent random generators: what one of them draws does not move what the others will."""
    demand(seed >= 0, f"seed is {seed}; a seed is 0 or more")
    return [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(count)]


def in_random_directions(speed: float, bodies: int, random: np.random.Generator) -> Floats:
    """Return (bodies, 2) velocities of one speed, in directions drawn evenly from the whole turn."""
    demand(math.isfinite(speed), f"speed is {speed}; a speed is finite")
    direction = random.uniform(0.0, 2.0 * math.pi, bodies)
    return speed * np.stack([np.cos(direction), np.sin(direction)], axis=1)
