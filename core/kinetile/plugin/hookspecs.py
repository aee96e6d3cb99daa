"""The hooks by which plugins offer phases and scenes.

A plugin is a module (or any object) with functions of these names, decorated with ``hookimpl``. It is found
by the entry-point group ``kinetile`` of the distribution that brings it, or handed over by
``kinetile.registry().add``. Hooks take nothing and return lists of specs. They are called once, when the
registry is made, and never while a simulation runs.
"""

from __future__ import annotations

import pluggy

from kinetile.plugin.specs import BroadPhaseSpec, NarrowPhaseSpec, ResponseSpec, SceneSpec

__all__ = [
    "PROJECT",
    "hookimpl",
    "hookspec",
    "kinetile_broad_phases",
    "kinetile_narrow_phases",
    "kinetile_responses",
    "kinetile_scenes",
]

PROJECT = "kinetile"

hookspec = pluggy.HookspecMarker(PROJECT)
"""Marks a function as the specification of a hook."""

hookimpl = pluggy.HookimplMarker(PROJECT)
"""Marks a plugin's function as its implementation of the hook of that name."""


@hookspec
def kinetile_broad_phases() -> list[BroadPhaseSpec]:
    """Return the broad phases that this plugin brings."""
    raise NotImplementedError


@hookspec
def kinetile_narrow_phases() -> list[NarrowPhaseSpec]:
    """Return the narrow phases that this plugin brings."""
    raise NotImplementedError


@hookspec
def kinetile_responses() -> list[ResponseSpec]:
    """Return the responses that this plugin brings."""
    raise NotImplementedError


@hookspec
def kinetile_scenes() -> list[SceneSpec]:
    """Return the scene recipes that this plugin brings."""
    raise NotImplementedError
