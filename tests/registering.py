"""Plugins and phases that are registered for a while."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import kinetile as kt
from kinetile_conformance.cases import PhasePlugin


@contextmanager
def registered(*plugins: Any) -> Iterator[None]:
    """Within this context these are registered: plugins, or specs of phases."""
    specs = (kt.BroadPhaseSpec, kt.NarrowPhaseSpec, kt.ResponseSpec)
    added = [PhasePlugin(each) if isinstance(each, specs) else each for each in plugins]
    with remove():
        for plugin in added:
            kt.registry().add(plugin)
        yield


@contextmanager
def remove(*names: str) -> Iterator[None]:
    """Within this context nothing has these names, whether a distribution brought it or this process added
    it; after it the registry is as it was before."""
    registry = kt.registry()
    before = registry._provided
    registry._provided = [each for each in before if each.spec.name not in names]
    try:
        yield
    finally:
        registry._provided = before
