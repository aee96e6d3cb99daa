"""Who is there: slots, and the numbers of the bodies in them.

What happens at one tick is put in order by numbers, never by slots: a body has its number from the moment it
comes until it goes, under every broad phase, while its slot depends on who has left before and on how often
the tables were laid out anew.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import hook
from kinetile.kernel.tables import NOBODY, Kernel

__all__ = ["ROOM", "elder", "is_there", "slot_of", "slots_taken"]


ROOM = 1e-12
"""By how much a body may reach into another, of the sum of their radii, or into a wall, of its own: as in a
scene (``scene.checks.TOLERANCE``)."""


@hook
def is_there(k: Kernel, body: int) -> bool:
    """Whether there is a body in a slot."""
    return bool(k.queue[body].number >= 0)


@hook
def elder(k: Kernel, a: int, b: int) -> int:
    """Return which of the bodies in two slots has the smaller number; the other one is in a + b - elder."""
    return a if k.queue[a].number < k.queue[b].number else b


@hook
def slot_of(k: Kernel, number: int) -> int:
    """Return the slot of the body with a number, or NOBODY: there is none."""
    if number < 0 or number >= len(k.slots):
        return NOBODY
    return int(k.slots[number])


def slots_taken(k: Kernel) -> npt.NDArray[np.intp]:
    """Return the slots with bodies in them, in the order of the bodies' numbers; not for hooks."""
    number: Any = k.queue.view(np.ndarray)["number"]
    taken = np.flatnonzero(number >= 0)
    found: npt.NDArray[np.intp] = taken[np.argsort(number[taken], kind="stable")]  # in order, but for a few
    return found
