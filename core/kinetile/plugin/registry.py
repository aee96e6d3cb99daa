"""Registry of phases, responses, scenes and observables: installed plugins and their contents, by name.

A plugin is registered as a whole, if all of its contents are valid, or not at all. A plugin that fails does
not affect others; it is a Failure, and the error about an unknown name names it. pluggy's own loader stops at
the first plugin that does not import, and silently drops a second distribution with the same entry-point
name. So this module reads entry points one by one, and each plugin has its own pluggy manager. kinetile's
distribution is first, the rest follow in alphabetical order, whatever the order of ``sys.path``.
"""

import pkgutil
import re
import threading
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib import metadata
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple, get_args

import pluggy

from kinetile.errors import (
    BadPlugin,
    DuplicateName,
    PhaseError,
    PluginApiMismatch,
    UnknownName,
    answering,
    nearest,
    shown,
)
from kinetile.plugin import specs
from kinetile.plugin.specs import NarrowPhaseSpec, PluginKind, SceneSpec, Spec


class Provided(NamedTuple):
    """One name in the registry, and its plugin (without distribution and version: added in this process)."""

    kind: PluginKind
    spec: Spec
    plugin: str
    distribution: str | None = None
    version: str | None = None

    @property
    def source(self) -> str:
        """The plugin and its distribution, as messages name them."""
        return _source(self.plugin, self.distribution, self.version)

    @property
    def built_in(self) -> bool:
        """True if it comes with kinetile."""
        return self.distribution is not None and _folded(self.distribution) == "kinetile"


class Failure(NamedTuple):
    """An installed plugin that could not be used, with the reason. As text it is one line."""

    plugin: str
    distribution: str | None
    error: BaseException
    version: str | None = None

    def __str__(self) -> str:
        return f"{_source(self.plugin, self.distribution, self.version)}: {sentence(self.error)}"


class Registry:
    """The phases and scenes that can be chosen by name; iterating gives a Provided for each. ``Registry()``
    is empty, ``Registry([plugin, ...])`` has the contents of these plugins, and ``kinetile.registry()`` has
    all installed ones."""

    @answering
    def __init__(self, plugins: Iterable[object] = ()) -> None:
        self.failures: tuple[Failure, ...] = ()
        self._provided: list[Provided] = []
        for plugin in plugins:
            self.add(plugin)

    def __iter__(self) -> Iterator[Provided]:
        return iter(tuple(self._provided))

    def __repr__(self) -> str:
        return f"<Registry: {len(self._provided)} names, {len(self.failures)} failures>"

    def target(self, kind: PluginKind, name: str) -> Callable[..., Any]:
        """Imports and returns the class of a phase, response or observable, or the recipe of a scene. Raises
        UnknownName, and PhaseError if the target does not import, or is no class or function."""
        provided = self.provided(kind, name)
        spec = provided.spec
        if not isinstance(spec.target, str):
            return spec.target
        where = f"{kind} {spec.name!r} of {provided.source}: its target {spec.target!r}"
        try:
            found: Callable[..., Any] = pkgutil.resolve_name(spec.target)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise PhaseError(f"{where} does not import: {sentence(error)}") from error
        if kind == "scene" and not callable(found):
            raise PhaseError(f"{where} is {found!r}; expected a function that makes a scene")
        if kind != "scene" and not isinstance(found, type):
            raise PhaseError(f"{where} is {found!r}; expected a class")
        return found

    def spec(self, kind: PluginKind, name: str) -> Spec:
        """Returns the spec of a name or alias, importing nothing. Raises UnknownName."""
        return self.provided(kind, name).spec

    @answering
    def provided(self, kind: PluginKind, name: str) -> Provided:
        """Returns the entry of an exact name or alias, with its plugin. Raises UnknownName."""
        if not isinstance(kind, str) or kind not in get_args(PluginKind):
            raise UnknownName("kind of plugin", kind, available=get_args(PluginKind))
        known = {each: p for p in self._provided if p.kind == kind for each in _all_names(p.spec)}
        if name in known:
            return known[name]
        meant = nearest(str(name), [each for each in known if not each.startswith("_")])
        other = next((each.kind for each in self._provided if name in _all_names(each.spec)), None)
        there = self.names(kind)
        raise UnknownName(kind, name, suggestion=meant, available=there, failures=self.failures, other=other)

    def names(self, kind: PluginKind) -> tuple[str, ...]:
        """Returns the names of a kind, built-in ones first, without aliases and names with ``_``."""
        names = (each.spec.name for each in self._provided if each.kind == kind)
        return tuple(name for name in names if not name.startswith("_"))

    def add(self, plugin: object) -> None:
        """Adds a plugin of this process: a module, or any object, with functions marked by ``hookimpl``; all
        of its names, or none. Raises BadPlugin, PluginApiMismatch or DuplicateName."""
        self._take_in(plugin, _label(plugin))

    def remove(self, plugin: object) -> None:
        """Removes the names of a plugin of this process: the object, or its name in a listing. So a notebook
        cell that adds a plugin can run again. Raises UnknownName if no plugin has it."""
        label = plugin if isinstance(plugin, str) else _label(plugin)
        kept = [p for p in self._provided if p.distribution is not None or p.plugin != label]
        if len(kept) == len(self._provided):
            added = dict.fromkeys(p.plugin for p in self._provided if p.distribution is None)
            raise UnknownName("plugin added in this process", label, available=tuple(added))
        self._provided = kept

    def as_dicts(self) -> dict[str, list[dict[str, Any]]]:
        """Returns the listing in plain types, ready for JSON: under "provided" a row for each name, with
        kind, name, summary, features, aliases, api, plugin, distribution and version, and for narrow phases
        of two bodies shapes; under "failures" one for each plugin that failed, with plugin, distribution,
        version, error (its type) and message."""
        provided = []
        for kind, spec, *source in self._provided:
            row: dict[str, Any] = {"kind": kind, "name": spec.name, "summary": spec.summary}
            row |= {"features": sorted(spec.features), "aliases": list(spec.aliases), "api": spec.api}
            row |= zip(("plugin", "distribution", "version"), source, strict=True)
            if isinstance(spec, NarrowPhaseSpec) and spec.role == "pair":
                row["shapes"] = list(spec.shapes)
            provided.append(row)
        failures = [
            failure._asdict() | {"error": type(failure.error).__name__, "message": str(failure.error)}
            for failure in self.failures
        ]
        return {"provided": provided, "failures": failures}

    def _discover(self) -> None:
        for found in installed():
            try:
                self._take_in(found.load(), found.plugin, found.distribution, found.version)
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # also SystemExit, and compiled modules' other exceptions
                self.failures += (Failure(found.plugin, found.distribution, error, found.version),)

    def _take_in(
        self, plugin: object, label: str, distribution: str | None = None, version: str | None = None
    ) -> None:
        """Adds all contents of a plugin, or raises and adds nothing."""
        fresh: list[Provided] = []
        owners = {(p.kind, name): p for p in self._provided for name in _all_names(p.spec)}
        for kind, spec in offers(plugin):
            provided = Provided(kind, spec, label, distribution, version)
            if spec.api != specs.API_VERSION:
                raise PluginApiMismatch(
                    f"{kind} {spec.name!r} was written for version {spec.api!r} of the plugin API; "
                    f"this kinetile has version {specs.API_VERSION}"
                )
            for name in _all_names(spec):
                owner = owners.setdefault((kind, name), provided)
                if owner is not provided:
                    raise DuplicateName(
                        f"{kind} {name!r} is already provided by {owner.source}; "
                        f"{provided.source} cannot provide it as well"
                    )
            fresh.append(provided)
        self._provided += fresh


_shared: Registry | None = None
_lock = threading.RLock()


def registry() -> Registry:
    """Returns this process's registry; installed plugins are searched once, at the first call. No plugin can
    make this raise. A plugin that calls this while it is loaded gets the plugins loaded before it."""
    global _shared
    with _lock:
        if _shared is None:
            _shared = Registry()
            try:
                _shared._discover()
            except BaseException:
                _shared = None
                raise
        return _shared


def _all_names(spec: Spec) -> tuple[str, ...]:
    return (spec.name, *spec.aliases)


def _label(plugin: object) -> str:
    name = getattr(plugin, "__name__", None)
    return name if isinstance(name, str) else type(plugin).__name__


def _source(plugin: str, distribution: str | None, version: str | None) -> str:
    if distribution is None:
        return f"{plugin} (added in this process)"
    return f"{plugin} ({distribution} {version or 'of unknown version'})"


_GROUP = "kinetile"
_HOOKS: dict[str, tuple[PluginKind, type[Spec]]] = {
    "kinetile_broad_phases": ("broad phase", specs.BroadPhaseSpec),
    "kinetile_narrow_phases": ("narrow phase", specs.NarrowPhaseSpec),
    "kinetile_responses": ("response", specs.ResponseSpec),
    "kinetile_scenes": ("scene", SceneSpec),
    "kinetile_observables": ("observable", specs.ObservableSpec),
}


class Installed(NamedTuple):
    """A plugin, "<distribution>:<entry point>", that is installed but not loaded, and its distribution."""

    plugin: str
    distribution: str
    version: str | None
    load: Callable[[], object]


def installed(group: str = _GROUP) -> list[Installed]:
    """Returns the plugins of a group of entry points, kinetile's own first, the others alphabetically."""
    return sorted(_entry_points(group), key=_built_in_first)


def offers(plugin: object) -> list[tuple[PluginKind, Spec]]:
    """Returns all contents of a plugin; raises BadPlugin for invalid hooks."""
    if isinstance(plugin, type) and any(isinstance(vars(plugin).get(each), FunctionType) for each in _HOOKS):
        raise BadPlugin(f"{plugin.__name__} is a class; expected an object of it, {plugin.__name__}()")
    manager = pluggy.PluginManager(specs.PROJECT)
    manager.add_hookspecs(specs)
    try:
        manager.register(plugin)
        callers = manager.get_hookcallers(plugin) or ()
    except (pluggy.PluginValidationError, TypeError, ValueError) as error:
        raise BadPlugin(f"a plugin is {shown(plugin)}: {error}") from error
    _check_hooks(plugin, {caller.name: caller for caller in callers})
    return [
        (kind, spec)
        for hook, (kind, spec_type) in _HOOKS.items()
        for spec in _call(getattr(manager.hook, hook), spec_type)
    ]


def sentence(error: BaseException) -> str:
    """Returns an error's type and message on one line."""
    message = " ".join(str(error).split())
    return f"{type(error).__name__}: {message}" if message else type(error).__name__


def defined_at(function: Any) -> str:
    """Returns file and line of a function, as the end of a message; "" without them."""
    code = getattr(getattr(function, "py_func", function), "__code__", None)
    return "" if code is None else f" ({Path(code.co_filename).name}, line {code.co_firstlineno})"


def _check_hooks(plugin: object, callers: dict[str, pluggy.HookCaller]) -> None:
    for name, caller in callers.items():
        if not caller.has_spec() and not all(hook.optionalhook for hook in caller.get_hookimpls()):
            meant = nearest(name, _HOOKS)
            hint = f"; did you mean {meant}?" if meant else "."
            raise BadPlugin(f"kinetile has no hook {name!r}{hint} There are: {', '.join(_HOOKS)}")
    for name in _HOOKS:
        if name not in callers and callable(getattr(plugin, name, None)):
            raise BadPlugin(
                f"its function {name} is not marked as a hook; decorate it with kinetile.hookimpl"
            )
    if not callers:
        raise BadPlugin(f"it implements no hook of kinetile; there are: {', '.join(_HOOKS)}")


def _call(caller: pluggy.HookCaller, spec_type: type[Spec]) -> Iterator[Spec]:
    expected = f"a list of {spec_type.__name__}"
    try:
        answers = caller()
    except (BadPlugin, KeyboardInterrupt):
        raise
    except BaseException as error:
        where = defined_at(caller.get_hookimpls()[0].function)
        raise BadPlugin(f"its hook {caller.name} raised {sentence(error)}{where}") from error
    if len(answers) < len(caller.get_hookimpls()):  # pluggy drops None
        raise BadPlugin(f"its hook {caller.name} returned nothing; expected {expected}")
    for answer in answers:
        if not isinstance(answer, list | tuple):
            raise BadPlugin(f"its hook {caller.name} returned {answer!r}; expected {expected}")
        for spec in answer:
            if not isinstance(spec, spec_type):
                raise BadPlugin(f"its hook {caller.name} returned a list with {spec!r}; expected {expected}")
            yield spec


def _entry_points(group: str) -> Iterator[Installed]:
    """Yields the entry points of a group; if two distributions have one name, only the first one's."""
    seen: set[str] = set()
    for distribution in metadata.distributions():
        try:
            found = [(point.name, point.load) for point in distribution.entry_points.select(group=group)]
        except Exception as error:  # one damaged line anywhere in the file
            if f"[{group}]" not in (distribution.read_text("entry_points.txt") or ""):
                continue
            found = [("entry_points.txt", partial(_refuse, error))]
        if not found:
            continue
        name = distribution.name or "unknown"  # None if the metadata is damaged
        if _folded(name) not in seen:
            seen.add(_folded(name))
            for entry_point, load in found:
                yield Installed(f"{name}:{entry_point}", name, distribution.version, load)


def _refuse(error: Exception) -> object:
    raise BadPlugin(f"its entry points cannot be read: {sentence(error)}") from error


def _built_in_first(found: Installed) -> tuple[bool, str, str]:
    folded = _folded(found.distribution)
    return folded != "kinetile", folded, found.plugin


def _folded(distribution: str) -> str:
    return re.sub(r"[-_.]+", "-", distribution).lower()
