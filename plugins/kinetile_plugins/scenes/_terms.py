"""What the recipes share: refusing a parameter in a sentence, and drawing from a seed."""

from __future__ import annotations

import math

import numpy as np

from kinetile.errors import BadOption
from kinetile.scene.checks import LARGEST, SMALLEST
from kinetile_plugins.scenes._draws import Draws, Floats
from kinetile_plugins.scenes._functions import cosine_and_sine

__all__ = ["demand", "demand_number", "demand_size", "demand_speed", "draws", "in_random_directions"]

MOST = 10_000_000
"""How many bodies, or turns, a recipe makes: a scene of more would not fit into memory, nor would its run."""


def demand(granted: bool, sentence: str) -> None:
    """Raise BadOption with ``sentence`` unless the demand is granted."""
    if not granted:
        raise BadOption(sentence)


def demand_number(name: str, number: int) -> None:
    """Raise BadOption if there are to be more bodies, or turns, than memory would hold."""
    demand(number <= MOST, f"{name} is {number}; it is at most {MOST:,}, for memory would not hold more")


def demand_size(density: float, radius: float) -> None:
    """Raise BadOption if the smallest radius that a density leads to is below what a scene can have."""
    demand(
        radius >= SMALLEST,
        f"density is {density}, for which a radius would be {radius:.3g}; radii are at least 2**-200 "
        f"({SMALLEST:.1e})",
    )


def demand_speed(speed: float) -> None:
    """Raise BadOption unless a speed is finite and within what a scene can have."""
    demand(math.isfinite(speed), f"speed is {speed}; a speed is finite")
    demand(abs(speed) <= LARGEST, f"speed is {speed}; it is at most 2**200 ({LARGEST:.1e}) in size")


def draws(seed: int, count: int) -> list[Draws]:
    """Return independent draws from a seed: what is drawn from one does not move what others give."""
    demand(seed >= 0, f"seed is {seed}; a seed is 0 or more")
    return [Draws(child) for child in np.random.SeedSequence(seed).spawn(count)]


def in_random_directions(speed: float, bodies: int, random: Draws) -> Floats:
    """Return (bodies, 2) velocities of one speed, in directions drawn evenly from the whole turn."""
    demand_speed(speed)
    return speed * np.stack(cosine_and_sine(2.0 * math.pi * random.uniform(bodies)), axis=1)
