"""The registry of names: what plugins of this process bring, and what they can do wrong."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import kinetile as kt
from kinetile import BroadPhaseSpec, NarrowPhaseSpec, Registry, SceneSpec, hookimpl
from kinetile.errors import BadPlugin, DuplicateName, PhaseError, PluginApiMismatch, UnknownName
from kinetile.plugin import registry as registry_module


class Stripes:
    """Stands for a broad phase."""


def recipe() -> Any:
    """Stand for a recipe."""


def bringing(*specs: Any, returned: Any = None) -> SimpleNamespace:
    """Return a plugin whose hook for broad phases returns these specs, or exactly ``returned``."""

    @hookimpl
    def kinetile_broad_phases() -> Any:
        return list(specs) if returned is None else returned

    return SimpleNamespace(kinetile_broad_phases=kinetile_broad_phases)


# Names


def test_an_empty_registry_holds_nothing() -> None:
    registry = Registry(plugins=())
    assert list(registry) == []
    assert registry.failures == ()
    assert registry.as_dicts() == {"provided": [], "failures": []}
    with pytest.raises(UnknownName, match="available: none"):
        registry.target("broad phase", "naive")


def test_a_class_a_function_or_a_string_may_be_the_target() -> None:
    class Plugin:
        @hookimpl
        def kinetile_broad_phases(self) -> list[BroadPhaseSpec]:
            return [BroadPhaseSpec("stripes", Stripes, aliases=("bands",))]

        @hookimpl
        def kinetile_narrow_phases(self) -> list[NarrowPhaseSpec]:
            return [NarrowPhaseSpec("capsule", "collections:OrderedDict", role="pair")]

        @hookimpl
        def kinetile_scenes(self) -> list[SceneSpec]:
            return [SceneSpec("empty", recipe), SceneSpec("nested", "pathlib:Path.cwd")]

    registry = Registry([Plugin()])
    assert registry.target("broad phase", "stripes") is Stripes
    assert registry.target("broad phase", "bands") is Stripes
    assert registry.target("narrow phase", "capsule").__name__ == "OrderedDict"
    assert registry.target("scene", "empty") is recipe
    assert registry.target("scene", "nested")() == Path.cwd()
    assert registry.names("scene") == ("empty", "nested")
    assert registry.spec("broad phase", "bands").name == "stripes"
    assert {(p.kind, p.plugin, p.distribution, p.version) for p in registry} == {
        (kind, "Plugin", None, None) for kind in ("broad phase", "narrow phase", "scene")
    }


def test_one_name_may_stand_for_a_phase_and_for_a_scene() -> None:
    plugin = bringing(BroadPhaseSpec("grid", Stripes))
    plugin.kinetile_scenes = hookimpl(specname="kinetile_scenes")(lambda: [SceneSpec("grid", recipe)])
    registry = Registry([plugin])
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


# What a plugin of this process can do wrong


def test_a_plugin_brings_everything_or_nothing() -> None:
    registry = Registry([bringing(BroadPhaseSpec("stripes", Stripes))])
    rival = bringing(BroadPhaseSpec("fresh", Stripes), BroadPhaseSpec("stripes", Stripes))
    rival.__name__ = "rival"
    with pytest.raises(DuplicateName, match=r"broad phase 'stripes' .* SimpleNamespace .*; rival \(added in"):
        registry.add(rival)
    assert registry.names("broad phase") == ("stripes",)
    assert registry.failures == ()


@pytest.mark.parametrize(
    "specs",
    [
        [BroadPhaseSpec("a", Stripes), BroadPhaseSpec("a", Stripes)],
        [BroadPhaseSpec("a", Stripes), BroadPhaseSpec("b", Stripes, aliases=("a",))],
        [BroadPhaseSpec("a", Stripes, aliases=("b",)), BroadPhaseSpec("b", Stripes)],
    ],
)
def test_aliases_count_as_names(specs: list[BroadPhaseSpec]) -> None:
    registry = Registry()
    with pytest.raises(DuplicateName):
        registry.add(bringing(*specs))
    assert list(registry) == []


def test_another_api_version_is_refused() -> None:
    registry = Registry()
    said = "'ancient' was written for version 1 of the plugin API; this kinetile has version 2"
    with pytest.raises(PluginApiMismatch, match=said):
        registry.add(bringing(BroadPhaseSpec("fresh", Stripes), BroadPhaseSpec("ancient", Stripes, api=1)))
    assert list(registry) == []


def with_lambda(name: str, function: Callable[..., Any]) -> object:
    return SimpleNamespace(**{name: function})


def fails() -> Any:
    raise ZeroDivisionError("no luck")


def leaves_the_process() -> Any:
    sys.exit(3)


HOOK = "kinetile_broad_phases"


@pytest.mark.parametrize(
    ("plugin", "says"),
    [
        (
            with_lambda("kinetile_broad_phase", hookimpl(lambda: [])),
            "no hook 'kinetile_broad_phase'; did you mean",
        ),
        (with_lambda("kinetile_zebra", hookimpl(lambda: [])), "no hook 'kinetile_zebra'"),
        (with_lambda(HOOK, lambda: []), "not marked as a hook"),
        (with_lambda(HOOK, hookimpl(lambda surprise: [])), "surprise"),
        (with_lambda(HOOK, hookimpl(fails)), "raised ZeroDivisionError: no luck"),
        (with_lambda(HOOK, hookimpl(leaves_the_process)), "raised SystemExit: 3"),
        (with_lambda(HOOK, hookimpl(lambda: None)), "returned nothing; expected a list of BroadPhaseSpec"),
        (bringing(returned="stripes"), "returned 'stripes'; expected a list of BroadPhaseSpec"),
        (bringing(returned=[Stripes]), "returned a list with .*Stripes.*; expected a list of BroadPhaseSpec"),
        (bringing(SceneSpec("grid", recipe)), "returned a list with SceneSpec"),
        (object(), "implements no hook of kinetile"),
        (None, "implements no hook of kinetile"),
    ],
)
def test_hooks_that_cannot_be_used_are_refused(plugin: object, says: str) -> None:
    registry = Registry()
    with pytest.raises(BadPlugin, match=says):
        registry.add(plugin)
    assert list(registry) == []


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"name": ""}, "'' is not a name"),
        ({"name": "two words"}, "'two words' is not a name"),
        ({"name": "a,b"}, "'a,b' is not a name"),
        ({"name": 3}, "3 is not a name"),
        ({"aliases": "stripes"}, "aliases is 'stripes'; expected a collection of words"),
        ({"aliases": ("a", "b c")}, "'b c' is not a name"),
        ({"features": "insert"}, "features is 'insert'"),
        ({"summary": None}, "summary is None"),
        ({"target": "no_colon"}, "target is 'no_colon'; expected a class, or 'package.module:class'"),
        ({"target": 3}, "target is 3"),
        ({"target": fails}, "expected a class"),
    ],
)
def test_a_spec_is_checked_when_it_is_made(fields: dict[str, Any], says: str) -> None:
    with pytest.raises(BadPlugin, match=says):
        BroadPhaseSpec(**{"name": "stripes", "target": Stripes, **fields})


def test_specs_bring_collections_into_their_form() -> None:
    words: Any = ["b", "a", "b"]
    spec = BroadPhaseSpec("stripes", Stripes, features=words, aliases=iter(words))
    assert spec.features == frozenset("ab")
    assert spec.aliases == ("b", "a", "b")
    assert hash(spec) == hash(BroadPhaseSpec("stripes", Stripes, features=words, aliases=words))
    with pytest.raises(BadPlugin, match="role is 'floor'; expected 'pair' or 'wall'"):
        NarrowPhaseSpec("floor", Stripes, role="floor")  # type: ignore[arg-type]
    with pytest.raises(BadPlugin, match="expected a function"):
        SceneSpec("empty", 3)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "target", "says"),
    [
        ("broad phase", "no_such_package.phase:Stripes", "does not import: ModuleNotFoundError"),
        ("broad phase", "collections:Stripes", "does not import: AttributeError"),
        ("broad phase", "math:pi", "is 3.14.*; expected a class"),
        ("scene", "math:pi", "is 3.14.*; expected a function that makes a scene"),
    ],
)
def test_a_target_that_is_not_there_is_reported_when_it_is_selected(
    kind: Any, target: str, says: str
) -> None:
    plugin = bringing(BroadPhaseSpec("stripes", target))
    plugin.kinetile_scenes = hookimpl(specname="kinetile_scenes")(lambda: [SceneSpec("stripes", target)])
    registry = Registry([plugin])
    assert registry.names(kind) == ("stripes",)
    with pytest.raises(
        PhaseError, match=f"^{kind} 'stripes' of SimpleNamespace .*'{target}' {says}"
    ) as caught:
        registry.target(kind, "stripes")
    assert "\n" not in str(caught.value)


def test_what_was_added_can_be_removed() -> None:
    registry = Registry([bringing(BroadPhaseSpec("stripes", Stripes))])
    again = bringing(BroadPhaseSpec("stripes", Stripes))
    registry.remove(again)
    registry.add(again)
    registry.remove("SimpleNamespace")
    assert list(registry) == []
    with pytest.raises(UnknownName, match="no plugin added in this process is called 'SimpleNamespace'"):
        registry.remove(again)


# Installed plugins


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
    """Return a registry in a world where one plugin is installed."""
    one = registry_module.Installed("broken:plugin", "broken", "1.0", load)
    monkeypatch.setattr(registry_module, "installed", lambda: [one])
    registry = Registry()
    registry._discover()
    return registry
