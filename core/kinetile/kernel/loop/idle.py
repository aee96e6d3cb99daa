"""Hooks in place of those that a phase does not have, which return a value (others: ``compiled.NOTHING``)."""

from typing import NamedTuple

from kinetile.kernel.compiled import hook, unchecked
from kinetile.kernel.tables import LONG_AGO, Kernel, Records


class NoState(NamedTuple):
    """The state of a broad phase that keeps none; a named tuple of arrays needs one array."""

    nothing: Records


@unchecked
@hook
def repair(k: Kernel, s: NoState, body: int) -> int:
    """There is no certificate that could fail."""
    return 0


@unchecked
@hook
def inside(k: Kernel, body: Records, tick: int) -> bool:
    """There is no shortcut."""
    return False


@unchecked
@hook
def ledge(k: Kernel, body: int, support: int, mx: float, my: float, new: bool) -> int:
    """No two bodies touch at a face."""
    return LONG_AGO
