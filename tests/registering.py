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
    specs = (kt.BroadPhaseSpec, kt.NarrowPhaseSpec)
    added = [PhasePlugin(each) if isinstance(each, specs) else each for each in plugins]
    for plugin in added:
        kt.registry().add(plugin)
    try:
        yield
    finally:
        for plugin in added:
            kt.registry().remove(plugin)
