"""Phases of this process: a plugin made of specs, where there is no module that brings them."""

from __future__ import annotations

from kinetile.plugin.hookspecs import hookimpl
from kinetile.plugin.specs import BroadPhaseSpec, NarrowPhaseSpec

__all__ = ["Brought"]


class Brought:
    """A plugin that brings one phase, and is listed under the phase's name."""

    def __init__(self, spec: BroadPhaseSpec | NarrowPhaseSpec) -> None:
        self.__name__ = spec.name
        self._spec = spec

    @hookimpl
    def kinetile_broad_phases(self) -> list[BroadPhaseSpec]:
        """Name it, if it is a broad phase."""
        return [self._spec] if isinstance(self._spec, BroadPhaseSpec) else []

    @hookimpl
    def kinetile_narrow_phases(self) -> list[NarrowPhaseSpec]:
        """Name it, if it is a narrow phase."""
        return [self._spec] if isinstance(self._spec, NarrowPhaseSpec) else []
