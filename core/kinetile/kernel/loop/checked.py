"""Hooks that are not marked ``unchecked``, as the loop calls them.

Counts and numbers of bodies that they return are compared with how many there are, because the loop reads its
tables there, and its index is not checked (``kernel.compiled.views``): one that is none is a fault that names
the phase, and not a read of other memory.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from kinetile.kernel.compiled import hook, larger, smaller, unchecked, with_numpy
from kinetile.kernel.tables import BAD_COUNT, BAD_NAME, BAD_PARTNER, NOBODY, SPARE, Kernel, blame

Hook = Callable[..., Any]


@cache
def checked(name: str, function: Hook) -> Hook:
    """Return a hook as the loop calls it, by its name in the loop; the same one for the same hook."""
    if name in ("near", "repair"):
        return _naming(function)
    return _bounding(function) if name == "soonest" else function


def _naming(function: Hook) -> Hook:
    given = with_numpy(function)

    @unchecked
    @hook
    def call(k: Kernel, s: Any, body: int) -> int:
        count = given(k, s, body)
        if count < 0 or count > len(k.near) - SPARE:
            blame(k, BAD_COUNT, body, count)
            return 0
        lowest = np.int32(0)  # as short as names are: the compiler takes eight at a time
        highest = np.int32(0)
        for i in range(count):
            lowest = smaller(lowest, k.near[i])
            highest = larger(highest, k.near[i])
        if lowest < 0 or highest >= k.clock[0].bodies:
            blame(k, BAD_NAME, body, int(lowest if lowest < 0 else highest))
            return 0
        return int(count)

    return call


def _bounding(function: Hook) -> Hook:
    given = with_numpy(function)

    @unchecked
    @hook
    def call(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
        first, second, who = given(k, body, count, barred, at)
        if first < math.inf and (who < 0 or who >= k.clock[0].bodies):
            blame(k, BAD_PARTNER, body, who)
            return math.inf, math.inf, NOBODY
        return float(first), float(second), int(who)

    return call
