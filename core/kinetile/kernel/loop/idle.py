"""Hooks for phases that lack them and must return a value (for other hooks: ``compiled.NOTHING``)."""

from typing import NamedTuple

from kinetile.kernel.compiled import hook, unchecked
from kinetile.kernel.tables import LONG_AGO, Kernel, Records


class NoState(NamedTuple):
    """The state of a broad phase without state; a named tuple of arrays needs one array."""

    nothing: Records


@unchecked
@hook
def repair(k: Kernel, s: NoState, body: int) -> int:
    """Returns 0: there is no certificate that could fail."""
    return 0


@unchecked
@hook
def inside(k: Kernel, body: Records, tick: int) -> bool:
    """Returns False: there is no shortcut."""
    return False


@unchecked
@hook
def ledge(k: Kernel, body: int, support: int, mx: float, my: float, new: bool) -> int:
    """Returns LONG_AGO: no two bodies touch at a face."""
    return LONG_AGO
