"""The naive broad phase: every body is near every other, always.

It prunes nothing and has no certificate that could fail, so it is ideal by every measure of a kinetic data
structure, except the number of pairs (thesis, section 2.2). It is the reference: it cannot miss a pair,
so a phase that differs from it is wrong. It is also the shortest possible broad phase: ``near`` alone. It is
prepared again for each insertion or removal, like any phase without ``enter`` and ``leave``.

Its cost: each change of a flight plan checks n - 1 others. Above ``LIMIT`` bodies it refuses.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from kinetile.errors import Refused
from kinetile.scene import Scene
from kinetile.toolbox import BroadPhaseParts, Item, Kernel, NoState, hook, pair_links, unchecked

LIMIT = 4000
"""Bodies. At this number a contact checks 8,000 others, and every other phase is a hundred times as fast."""


@unchecked
@hook
def near(k: Kernel, s: NoState, body: int) -> int:
    """Names every body; that a body is near itself does no harm."""
    count = len(k.bodies)
    for other in range(count):
        k.near[other] = other
    return count


def draw(k: Kernel, s: NoState) -> Iterator[Item]:
    """Draws a link between every two bodies."""
    return pair_links(combinations(np.flatnonzero(k.queue.number >= 0).tolist(), 2))


class Naive:
    """Every body is near every other: the reference, for small scenes."""

    def prepare(self, scene: Scene) -> BroadPhaseParts:
        """Returns the parts; refuses more than ``LIMIT`` bodies."""
        if len(scene) > LIMIT:
            raise Refused(
                f"naive compares every body with every other and stops at {LIMIT} bodies; this scene has "
                f"{len(scene)}"
            )
        return BroadPhaseParts(draw=draw, periodic=True, near=near)
