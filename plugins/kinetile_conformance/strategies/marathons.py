"""Marathons: few bodies and a hundred thousand contacts, so slow that the base of the clock moves often.

A counter of 16 bits overflows, a tick that is kept and not named in ``ticks`` is out of date, and what is
rounded a little wrong at each event has become visible at the end.
"""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from kinetile.kernel.clock import SPAN, TICKS
from kinetile.scene import Scene, Settings

__all__ = ["CONTACTS", "marathon", "marathon_scenes"]

CONTACTS = 100_000

FEWEST, MOST = 2, 9

BASES = 40
"""How often the base of the clock moves in a marathon, or more often."""


def marathon(bodies: int, seed: int) -> Scene:
    """Return so many bodies in a small box, which meet each other and the walls for a long time."""
    random = np.random.default_rng(seed)
    columns, rows = random.permutation([3, 4])
    chosen = random.choice(12, bodies, replace=False)
    radius = random.choice([0.25, 0.375, 0.4375], bodies)
    place = np.column_stack([chosen % columns, chosen // columns]) + 0.5
    place += (0.5 - radius)[:, None] * random.uniform(-1.0, 1.0, (bodies, 2))
    velocity = random.normal(size=(bodies, 2))
    # A body meets a wall or another about once in the time in which it flies 1: in all a contact each
    # 1 / (bodies speed). The speed is such that so many last for so many spans of the clock.
    speed = CONTACTS / (bodies * BASES * (SPAN // TICKS))
    velocity *= speed / np.sqrt((velocity**2).sum(axis=1).mean())
    until = float(4 * BASES * (SPAN // TICKS))
    return Scene(place, velocity, radius, arena=(float(columns), float(rows)), settings=Settings(until=until))


def _numbered(number: int) -> Scene:
    """Return the marathon of a number."""
    return marathon(FEWEST + number % (MOST - FEWEST + 1), number)


def marathon_scenes() -> st.SearchStrategy[Scene]:
    """Return the marathons."""
    return st.integers(0, 2**24 - 1).map(_numbered)
