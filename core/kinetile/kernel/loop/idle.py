"""Hooks in the place of those that a phase does not have: they do nothing."""

from __future__ import annotations

from typing import NamedTuple

from kinetile.kernel.compiled import hook, unchecked
from kinetile.kernel.tables import LONG_AGO, Kernel, Records


class NoState(NamedTuple):
    """The state of a broad phase that keeps none; a named tuple of arrays needs one array."""

    nothing: Records


@unchecked
@hook
def build(k: Kernel, s: NoState) -> None:
    """There is no structure."""


@unchecked
@hook
def repair(k: Kernel, s: NoState, body: int) -> int:
    """There is no certificate that could fail."""
    return 0


@unchecked
@hook
def enter(k: Kernel, s: NoState, body: int) -> None:
    """There is no structure that a body could be taken into."""


@unchecked
@hook
def leave(k: Kernel, s: NoState, body: int) -> None:
    """There is no structure that a body could be taken out of."""


@unchecked
@hook
def replan(k: Kernel, s: NoState, body: int) -> None:
    """There is no certificate that depends on a flight plan."""


@unchecked
@hook
def ledge(k: Kernel, body: int, support: int, mx: float, my: float, new: bool) -> int:
    """No two bodies touch at a face."""
    return LONG_AGO
