"""Several narrow phases for pairs in one loop: the shapes of two bodies select the phase.

``k.numbers`` then begins with the number of shapes S, a table (S, S) with the phase for each two shapes, from
0, and the first index of each phase's numbers. A phase finds its own numbers from index 0, as if it were
alone (``numbers_from``).
"""

from functools import cache
from typing import Any

import numpy as np

from kinetile.arrays import Floats, Integers
from kinetile.kernel.compiled import Hook, hook, is_checked, numbers_from, unchecked, with_numpy
from kinetile.kernel.tables import Kernel

Doubles = Floats


def all_numbers(takes: Integers, numbers: list[Doubles | None]) -> Doubles:
    """Returns ``k.numbers`` for several phases: (S, S) the phase for two shapes, and each phase's numbers."""
    kept = [np.zeros(0) if each is None else each for each in numbers]
    head = 1 + takes.size + len(kept)
    begins = head + np.cumsum([0, *(len(each) for each in kept[:-1])])
    return np.concatenate([[len(takes)], takes.ravel(), begins, *kept]).astype(np.float64)


@hook
def takes(k: Kernel, one: int, other: int) -> int:
    """Returns the number of the phase for two shapes."""
    return int(k.numbers[1 + one * int(k.numbers[0]) + other])


@hook
def takes_bodies(k: Kernel, a: int, b: int) -> int:
    """Returns the number of the phase for the shapes of two bodies."""
    return takes(k, k.bodies[a].form, k.bodies[b].form)


@cache
def by_shape(hooks: tuple[Hook, ...], which: Hook = takes_bodies, first: int = 0) -> Hook:
    """Returns a hook that calls, for two bodies, the hook of their phase; phases are numbered from ``first``
    on. ``gap`` gets shapes and no bodies: then ``which`` is ``takes``."""
    mine = of_phase(hooks[0], first)
    if len(hooks) == 1:
        return mine
    others = by_shape(hooks[1:], which, first + 1)

    @unchecked
    @hook
    def call(k: Kernel, a: int, b: int, *rest: Any) -> Any:
        return mine(k, a, b, *rest) if which(k, a, b) == first else others(k, a, b, *rest)

    return call


@cache
def of_phase(function: Hook, phase: int) -> Hook:
    """Returns a phase's hook, changed to take the tables of all phases."""
    given = with_numpy(function) if is_checked(function) else function

    @unchecked
    @hook
    def call(k: Kernel, *rest: Any) -> Any:
        shapes = int(k.numbers[0])
        return given(numbers_from(k, int(k.numbers[1 + shapes * shapes + phase])), *rest)

    return call
