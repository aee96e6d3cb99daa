"""The registry of names: plugins of this process, and their possible faults."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import kinetile as kt
from kinetile import BroadPhaseSpec, NarrowPhaseSpec, Registry, SceneSpec, hookimpl
from kinetile.errors import DuplicateName, UnknownName
from kinetile.plugin import registry as registry_module
from messages import table


class Stripes:
    """Stands for a broad phase."""


def recipe() -> Any:
    """Stand for a recipe."""


def bringing(*specs: Any, returned: Any = None, **more: list[Any]) -> SimpleNamespace:
    given = {"broad_phases": list(specs) if returned is None else returned, **more}
    hooks = {f"kinetile_{what}": hookimpl(lambda each=each: each) for what, each in given.items()}
    return SimpleNamespace(**hooks)


def test_a_class_a_function_or_a_string_may_be_the_target() -> None:
    scenes = [SceneSpec("empty", recipe), SceneSpec("nested", "pathlib:Path.cwd")]
    narrow = [NarrowPhaseSpec("capsule", "collections:OrderedDict", role="pair")]
    broad = BroadPhaseSpec("stripes", Stripes, aliases=("bands",))
    registry = Registry([bringing(broad, narrow_phases=narrow, scenes=scenes)])
    assert registry.target("broad phase", "stripes") is Stripes
    assert registry.target("broad phase", "bands") is Stripes
    assert registry.target("narrow phase", "capsule").__name__ == "OrderedDict"
    assert registry.target("scene", "empty") is recipe
    assert registry.target("scene", "nested")() == Path.cwd()
    assert registry.names("scene") == ("empty", "nested")
    assert registry.spec("broad phase", "bands").name == "stripes"
    assert {(p.kind, p.plugin, p.distribution, p.version) for p in registry} == {
        (kind, "SimpleNamespace", None, None) for kind in ("broad phase", "narrow phase", "scene")
    }


def test_one_name_may_stand_for_a_phase_and_for_a_scene() -> None:
    registry = Registry([bringing(BroadPhaseSpec("grid", Stripes), scenes=[SceneSpec("grid", recipe)])])
    assert registry.target("broad phase", "grid") is Stripes
    assert registry.target("scene", "grid") is recipe


def test_a_module_is_a_plugin() -> None:
    module = ModuleType("my_phases")
    module.kinetile_broad_phases = bringing(BroadPhaseSpec("stripes", Stripes)).kinetile_broad_phases  # type: ignore[attr-defined]
    (provided,) = Registry([module])
    assert (provided.plugin, provided.source) == ("my_phases", "my_phases (added in this process)")


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ("sap1d", "sap-1d"),
        ("SAP_1D", "sap-1d"),
        ("SAP 2D", "sap-2d"),
        ("Naive", "naive"),
        ("nave", "naive"),
        ("sweep_and_prune", "sweep-and-prune"),
        ("sweep-and-prun-matrix", "sweep-and-prune-matrix"),
        ("grid", None),
    ],
)
def test_an_unknown_name_is_answered_with_what_was_meant_and_what_there_is(
    asked: str, meant: str | None
) -> None:
    with pytest.raises(UnknownName) as caught:
        kt.registry().target("broad phase", asked)
    error = caught.value
    assert isinstance(error, LookupError)
    assert (error.kind, error.name, error.suggestion) == ("broad phase", asked, meant)
    assert error.available == kt.registry().names("broad phase")
    first, second, *_ = str(error).splitlines()
    ending = f"; did you mean {meant!r}?" if meant else ": it is a scene."
    assert first == f"no broad phase is called {asked!r}{ending}"
    assert second.startswith("available: naive, cells, sap-1d, sap-2d")


def test_the_kits_own_reference_was_among_the_names_that_an_error_lists() -> None:
    registry = Registry([bringing(BroadPhaseSpec("stripes", Stripes), BroadPhaseSpec("_stripes", Stripes))])
    assert registry.target("broad phase", "_stripes") is Stripes
    assert registry.names("broad phase") == ("stripes",)
    with pytest.raises(UnknownName) as caught:
        registry.target("broad phase", "_stripe")
    assert (caught.value.suggestion, caught.value.available) == ("stripes", ("stripes",))


def test_a_plugin_brings_everything_or_nothing() -> None:
    registry = Registry([bringing(BroadPhaseSpec("stripes", Stripes))])
    rival = bringing(BroadPhaseSpec("fresh", Stripes), BroadPhaseSpec("stripes", Stripes))
    rival.__name__ = "rival"
    with pytest.raises(DuplicateName, match=r"broad phase 'stripes' .* SimpleNamespace .*; rival \(added in"):
        registry.add(rival)
    assert registry.names("broad phase") == ("stripes",)
    assert registry.failures == ()


def hook(function: Callable[..., Any], name: str = "kinetile_broad_phases") -> object:
    return SimpleNamespace(**{name: function})


def unadded(plugin: object) -> None:
    registry = Registry()
    try:
        registry.add(plugin)
    finally:
        assert list(registry) == []


def selected(kind: Any, target: str) -> None:
    scenes = [SceneSpec("stripes", target)]
    registry = Registry([bringing(BroadPhaseSpec("stripes", target), scenes=scenes)])
    assert registry.names(kind) == ("stripes",)
    registry.target(kind, "stripes")


class Instance:
    """Stands for a plugin that was not made."""

    @hookimpl
    def kinetile_scenes(self) -> Any:
        return []


def fails() -> Any:
    raise ZeroDivisionError("no luck")


def leaves_the_process() -> Any:
    sys.exit(3)


def test_specs_bring_collections_into_their_form() -> None:
    words: Any = ["b", "a", "b"]
    spec = BroadPhaseSpec("stripes", Stripes, features=words, aliases=iter(words))
    assert spec.features == frozenset("ab")
    assert spec.aliases == ("b", "a", "b")
    assert hash(spec) == hash(BroadPhaseSpec("stripes", Stripes, features=words, aliases=words))


def test_what_was_added_can_be_removed() -> None:
    registry = Registry([bringing(BroadPhaseSpec("stripes", Stripes))])
    again = bringing(BroadPhaseSpec("stripes", Stripes))
    registry.remove(again)
    registry.add(again)
    registry.remove("SimpleNamespace")
    assert list(registry) == []


def interrupted() -> object:
    raise KeyboardInterrupt


@pytest.mark.parametrize("load", [fails, leaves_the_process])
def test_a_plugin_that_does_not_load_is_a_failure_with_its_distribution(
    load: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    (failure,) = discovered(load, monkeypatch).failures
    assert str(failure).startswith(f"broken:plugin (broken 1.0): {type(failure.error).__name__}: ")


def test_an_interrupt_is_no_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(KeyboardInterrupt):
        discovered(interrupted, monkeypatch)


def discovered(load: Callable[[], object], monkeypatch: pytest.MonkeyPatch) -> Registry:
    one = registry_module.Installed("broken:plugin", "broken", "1.0", load)
    monkeypatch.setattr(registry_module, "installed", lambda: [one])
    registry = Registry()
    registry._discover()
    return registry


test_message = table(globals())
