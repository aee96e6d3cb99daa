"""How long the slices of the calendar are: about as long as things come to the head apart.

The length decides how fast the head is found, and nothing else (``kernel.loop.calendar``).
"""

from __future__ import annotations

import math

import numpy as np

from kinetile.kernel.tables import Kernel
from kinetile.run.engine.dials import Dials

__all__ = ["first_shift", "fit", "steps"]

FEW = 256
"""Heads in a chunk; from fewer no length is taken."""


def steps(count: Dials) -> int:
    """Return how often something came to the head so far, but for guesses that were right."""
    return int(count.asks[0] + count.structural[0])


def first_shift(k: Kernel, extent: float) -> int:
    """Return a shift before anything is known: for as many events as a gas of discs has."""
    n = len(k.bodies)
    squares = float(np.sum(k.bodies.vx**2 + k.bodies.vy**2)) if n else 0.0
    events = 8.0 * n * math.sqrt(n) * math.sqrt(squares / n) / extent if squares > 0.0 else 1.0
    return _shift(k, float(k.clock[0].per_time) / events)


def fit(k: Kernel, dial: Dials, since: int, heads: int) -> None:
    """Give the slices the length that heads were apart, of which so many came since a tick."""
    if heads > FEW and dial.now[0] > since:
        shift = _shift(k, (dial.now[0] - since) / heads)
        if abs(shift - dial.shift[0]) > 1:
            dial.shift[0] = shift
            dial.filed[0] = 0


def _shift(k: Kernel, ticks: float) -> int:
    """Return the shift of slices of about so many ticks; a year is no longer than a span of the clock."""
    most = 61 - (len(k.marks).bit_length() + 6)
    return min(max(round(math.log2(max(ticks, 1.0))), 1), most)
