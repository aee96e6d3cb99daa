"""Plugins and phases that are registered for a while."""

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

import kinetile as kt
from kinetile.plugin.specs import Spec

HOOKS = {
    kt.BroadPhaseSpec: "kinetile_broad_phases",
    kt.NarrowPhaseSpec: "kinetile_narrow_phases",
    kt.ResponseSpec: "kinetile_responses",
    kt.ObservableSpec: "kinetile_observables",
    kt.SceneSpec: "kinetile_scenes",
}


@contextmanager
def registered(*plugins: Any) -> Iterator[None]:
    """Within this context these plugins or specs are registered."""
    with remove():
        for plugin in plugins:
            if isinstance(plugin, Spec):
                brings = kt.hookimpl(lambda spec=plugin: [spec])
                plugin = SimpleNamespace(__name__=plugin.name, **{HOOKS[type(plugin)]: brings})
            kt.registry().add(plugin)
        yield


def fixture(*plugins: Any, **how: Any) -> Any:
    """Returns a fixture with these registered, for all tests of a file unless ``autouse`` is False."""

    @pytest.fixture(**{"autouse": True, **how})
    def _registered() -> Iterator[None]:
        with registered(*plugins):
            yield

    return _registered


@contextmanager
def remove(*names: str) -> Iterator[None]:
    """Within this context nothing has these names, from a distribution or from this process; after it the
    registry is restored."""
    registry = kt.registry()
    before = registry._provided
    registry._provided = [each for each in before if each.spec.name not in names]
    try:
        yield
    finally:
        registry._provided = before
