"""The candidate pairs of a simulation: who is near whom, as its broad phase says now, by their slots."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.loop.presence import is_there
from kinetile.kernel.tables import Kernel
from kinetile.run.composition import Composition

__all__ = ["by_number", "candidates", "named_near", "pairs_of_named"]

near = to_be_filled_in


def list_near(k: Kernel, s: Any, found: npt.NDArray[np.int32]) -> int:
    """Write (body, other) for everybody near each body, while there is room; return how many there are.

    A template, as ``kernel.loop.advance`` is.
    """
    k = disowned(k)
    s = disowned(s)
    count = 0
    for body in range(k.clock[0].bodies):
        if is_there(k, body):
            for i in range(near(k, s, body)):
                if count < len(found):
                    found[count, 0] = body
                    found[count, 1] = k.near[i]
                count += 1
    return count


def named_near(k: Kernel, composition: Composition) -> npt.NDArray[np.int32]:
    """Return (body, other) for everybody whom the broad phase names near each body, itself apart; (m, 2).

    The answers are written aside: a run in another thread has its own in ``k.near``.
    """
    broad, k = composition.broad, k._replace(near=np.zeros_like(k.near))
    listing = compose(list_near, {"near": broad.near}, composition.label, type(broad.state))
    found = np.zeros((8 * len(k.bodies) + 64, 2), dtype=np.int32)
    count = int(listing(k, broad.state, found))
    if count > len(found):
        found = np.zeros((count, 2), dtype=np.int32)
        listing(k, broad.state, found)
    named: npt.NDArray[np.int32] = found[:count][found[:count, 0] != found[:count, 1]]
    return named


def pairs_of_named(named: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return the pairs (a, b), a < b, of which one is near the other, sorted; (m, 2)."""
    pairs: npt.NDArray[np.int32] = np.unique(np.sort(named, axis=1), axis=0)
    return pairs


def candidates(k: Kernel, composition: Composition) -> npt.NDArray[np.int32]:
    """Return the candidate pairs (a, b), a < b, by the numbers of the bodies, sorted; (m, 2)."""
    return pairs_of_named(by_number(k, named_near(k, composition)))


def by_number(k: Kernel, named: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return pairs of slots as pairs of the numbers of the bodies in them."""
    numbers: npt.NDArray[np.int32] = np.asarray(k.queue["number"])[named]
    return numbers
