"""The naive broad phase: every pair is a candidate, always.

It prunes nothing, has no certificate of its own and never changes its attribute, so by every measure of a
kinetic data structure except the number of pairs it is ideal (thesis, section 2.2). It is the reference:
nothing that it does can be wrong, so whatever differs from it is.

Its cost is its pairs: n(n-1)/2 of them are kept, and each change of a flight plan asks n-1 of them again.
Above ``LIMIT`` bodies it refuses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile.toolbox import BroadPhaseParts, Kernel, Records, add_pair, hook

__all__ = ["LIMIT", "Naive"]

LIMIT = 4000
"""Bodies: eight million pairs, some 500 MB of tables."""


class State(NamedTuple):
    """Nothing to keep; a named tuple of arrays needs one array."""

    nothing: Records


@hook
def build(k: Kernel, s: State) -> None:
    """Make every pair a candidate."""
    for a in range(len(k.bodies)):
        for b in range(a + 1, len(k.bodies)):
            add_pair(k, a, b)


@hook
def repair(k: Kernel, s: State, certificate: int) -> None:
    """There is no structural certificate that could fail."""


@hook
def replan(k: Kernel, s: State, body: int) -> None:
    """There is no structural certificate that depends on a flight plan."""


class Naive:
    """Every pair is a candidate: the reference, for small scenes."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Return the parts; refuse more than ``LIMIT`` bodies."""
        if len(scene) > LIMIT:
            raise Refused(
                f"naive keeps all n(n-1)/2 pairs and stops at {LIMIT} bodies; this scene has {len(scene)}: "
                "choose another broad phase, such as sap-1d or sap-2d"
            )
        n = len(scene)
        return BroadPhaseParts(
            state=State(np.zeros(1)),
            certificates=0,
            build=build,
            repair=repair,
            replan=replan,
            pairs=n * (n - 1) // 2,
        )
