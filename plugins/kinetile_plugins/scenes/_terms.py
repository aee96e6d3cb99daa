"""What the recipes share: refusing a parameter in a sentence, and drawing from a seed."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from kinetile.errors import BadOption
from kinetile.scene.checks import LARGEST

__all__ = ["Floats", "demand", "demand_number", "demand_speed", "generators", "in_random_directions"]

MOST = 10_000_000
"""How many bodies, or turns, a recipe makes: a scene of more would not fit into memory, nor would its run."""

Floats = npt.NDArray[np.float64]


def demand(granted: bool, sentence: str) -> None:
    """Raise BadOption with ``sentence`` unless the demand is granted."""
    if not granted:
        raise BadOption(sentence)


def demand_number(name: str, number: int) -> None:
    """Raise BadOption if there are to be more bodies, or turns, than memory would hold."""
    demand(number <= MOST, f"{name} is {number}; it is at most {MOST:,}, for memory would not hold more")


def demand_speed(speed: float) -> None:
    """Raise BadOption unless a speed is finite and within what a scene can have."""
    demand(math.isfinite(speed), f"speed is {speed}; a speed is finite")
    demand(abs(speed) <= LARGEST, f"speed is {speed}; it is at most 2**200 ({LARGEST:.1e}) in size")


def generators(seed: int, count: int) -> list[np.random.Generator]:
    """Return independent random generators: what one of them draws does not move what the others will."""
    demand(seed >= 0, f"seed is {seed}; a seed is 0 or more")
    return [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(count)]


def in_random_directions(speed: float, bodies: int, random: np.random.Generator) -> Floats:
    """Return (bodies, 2) velocities of one speed, in directions drawn evenly from the whole turn."""
    demand_speed(speed)
    direction = random.uniform(0.0, 2.0 * math.pi, bodies)
    return speed * np.stack([np.cos(direction), np.sin(direction)], axis=1)
