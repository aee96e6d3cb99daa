"""Finding phases and scenes by name.

A plugin enters whole or not at all: only when everything that it offers is found good do its names enter the
table. One that fails, at whatever point, leaves nothing behind and harms nobody else; it is remembered as a
Failure, with its distribution, and told to whoever asks for a name that is not there.

kinetile's own distribution goes first, the rest follow in alphabetical order. So nobody can take a built-in
name, and which of two rivals gets a name does not depend on the order of ``sys.path``.

The environment variable KINETILE_STRICT_PLUGINS turns failures into exceptions. It is on for "1", "true",
"yes" and "on"; it is off for "0", "false", "no", "off", the empty text, and where there is no such variable.
Case and surrounding blanks do not matter; any other text is an error.
"""

from __future__ import annotations

import os
import pkgutil
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from kinetile.errors import (
    BadOption,
    BadPlugin,
    DuplicateName,
    PhaseError,
    PluginApiMismatch,
    UnknownName,
    nearest,
)
from kinetile.plugin.discovery import Kind, installed, offers, sentence
from kinetile.plugin.specs import API_VERSION, MOVING, SceneSpec, Spec

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["Failure", "Kind", "Provided", "Registry", "registry"]

_STRICT = "KINETILE_STRICT_PLUGINS"


class Provided(NamedTuple):
    """One name in the registry, and who brought it (no distribution and version: added in this process)."""

    kind: Kind
    spec: Spec
    plugin: str
    distribution: str | None = None
    version: str | None = None

    @property
    def source(self) -> str:
        """The plugin and its distribution, as messages name them."""
        return _source(self.plugin, self.distribution, self.version)


class Failure(NamedTuple):
    """A plugin that was found and could not be used, and why. As text it is one line."""

    plugin: str
    distribution: str | None
    error: BaseException
    version: str | None = None

    def __str__(self) -> str:
        return f"{_source(self.plugin, self.distribution, self.version)}: {sentence(self.error)}"


class Registry:
    """The phases and scenes that can be chosen by name.

    ``Registry()`` is empty; ``Registry([plugin, ...])`` holds what these bring; ``kinetile.registry()`` is
    the one of this process, with everything that is installed. Iterating gives a Provided for each phase and
    scene.
    """

    def __init__(self, plugins: Iterable[object] = ()) -> None:
        self.failures: tuple[Failure, ...] = ()
        self._provided: list[Provided] = []
        for plugin in plugins:
            self.add(plugin)

    def __iter__(self) -> Iterator[Provided]:
        return iter(tuple(self._provided))

    def __repr__(self) -> str:
        return f"<Registry: {len(self._provided)} names, {len(self.failures)} failures>"

    def broad_phase(self, name: str) -> type[Any]:
        """Import and return the class of a broad phase.

        Raises UnknownName, and PhaseError where the target does not import or is no class.
        """
        return cast("type[Any]", _load(self._find("broad phase", name)))

    def narrow_phase(self, name: str) -> type[Any]:
        """Import and return the class of a narrow phase.

        Raises UnknownName, and PhaseError where the target does not import or is no class.
        """
        return cast("type[Any]", _load(self._find("narrow phase", name)))

    def response(self, name: str) -> type[Any]:
        """Import and return the class of a response.

        Raises UnknownName, and PhaseError where the target does not import or is no class.
        """
        return cast("type[Any]", _load(self._find("response", name)))

    def scene(self, name: str) -> Callable[..., Scene]:
        """Import and return the recipe of a scene.

        Raises UnknownName, and PhaseError where the target does not import or cannot be called.
        """
        return cast("Callable[..., Scene]", _load(self._find("scene", name)))

    def spec(self, kind: Kind, name: str) -> Spec:
        """Return what the plugin says about a name or alias, importing nothing. Raises UnknownName."""
        return self._find(kind, name).spec

    def provided(self, kind: Kind, name: str) -> Provided:
        """Return what has a name or alias, with the plugin that brings it. Raises UnknownName."""
        return self._find(kind, name)

    def names(self, kind: Kind) -> tuple[str, ...]:
        """Return the names of one kind, without aliases: the built-in ones first."""
        return tuple(provided.spec.name for provided in self._provided if provided.kind == kind)

    def add(self, plugin: object) -> None:
        """Take in a plugin of this process: a module, or any object, with functions marked by ``hookimpl``.

        It brings all of its names, or none. Raises BadPlugin, PluginApiMismatch or DuplicateName.
        """
        self._take_in(plugin, _label(plugin))

    def remove(self, plugin: object) -> None:
        """Take out what a plugin of this process brought: the object, or its name as a listing shows it.

        So a notebook cell that defines and adds a plugin can be run again. Raises UnknownName if there is
        none.
        """
        label = plugin if isinstance(plugin, str) else _label(plugin)
        kept = [p for p in self._provided if p.distribution is not None or p.plugin != label]
        if len(kept) == len(self._provided):
            added = dict.fromkeys(p.plugin for p in self._provided if p.distribution is None)
            raise UnknownName("plugin added in this process", label, available=tuple(added))
        self._provided = kept

    def as_dicts(self) -> dict[str, list[dict[str, Any]]]:
        """Return the listing in plain types, ready for JSON.

        "provided" has a row for each name, with kind, name, summary, features, aliases, api, plugin,
        distribution and version; "failures" has a row for each plugin that failed, with plugin, distribution,
        version, error (its type) and message.
        """
        provided = [
            {
                "kind": kind,
                "name": spec.name,
                "summary": spec.summary,
                "features": [] if isinstance(spec, SceneSpec) else sorted(spec.features),
                "aliases": list(spec.aliases),
                "api": spec.api,
                "plugin": plugin,
                "distribution": distribution,
                "version": version,
            }
            for kind, spec, plugin, distribution, version in self._provided
        ]
        failures = [
            {
                "plugin": failure.plugin,
                "distribution": failure.distribution,
                "version": failure.version,
                "error": type(failure.error).__name__,
                "message": str(failure.error),
            }
            for failure in self.failures
        ]
        return {"provided": provided, "failures": failures}

    def _discover(self) -> None:
        """Take in what is installed; remember what fails, or raise it where strictness is asked for."""
        strict = _is_strict()
        for found in installed():
            try:
                self._take_in(found.load(), found.plugin, found.distribution, found.version)
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # SystemExit too, and what compiled modules throw beside Exception
                failure = Failure(found.plugin, found.distribution, error, found.version)
                if strict:
                    raise BadPlugin(f"{failure} (raised because {_STRICT} is set)") from error
                self.failures += (failure,)

    def _take_in(
        self, plugin: object, label: str, distribution: str | None = None, version: str | None = None
    ) -> None:
        """Add all that a plugin brings, or raise and add nothing."""
        fresh: list[Provided] = []
        owners = {(p.kind, name): p for p in self._provided for name in _all_names(p.spec)}
        for kind, spec in offers(plugin):
            provided = Provided(kind, spec, label, distribution, version)
            if spec.api != API_VERSION:
                raise PluginApiMismatch(
                    f"{kind} {spec.name!r} was written for version {spec.api!r} of the plugin API; "
                    f"this kinetile speaks version {API_VERSION}: {MOVING}"
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

    def _find(self, kind: Kind, name: str) -> Provided:
        """Return what has this name or alias, to the letter; raise UnknownName otherwise."""
        known: dict[str, Provided] = {}
        for provided in self._provided:
            if provided.kind == kind:
                known.update(dict.fromkeys(_all_names(provided.spec), provided))
        if name in known:
            return known[name]
        meant = nearest(str(name), known)
        raise UnknownName(kind, name, suggestion=meant, available=self.names(kind), failures=self.failures)


_shared: Registry | None = None
_lock = threading.RLock()


def registry() -> Registry:
    """Return this process's registry; what is installed is looked for once, when it is first asked for.

    No plugin can make this raise, unless KINETILE_STRICT_PLUGINS is set: then BadPlugin, for the first that
    fails; BadOption where that variable says neither yes nor no. A plugin that asks for the registry while it
    is itself being loaded sees what was loaded before it.
    """
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


def _load(provided: Provided) -> object:
    """Return what a spec's target stands for, importing it if need be; raise PhaseError if that fails."""
    kind, spec = provided.kind, provided.spec
    if not isinstance(spec.target, str):
        return spec.target
    where = f"{kind} {spec.name!r} of {provided.source}: its target {spec.target!r}"
    try:
        found = pkgutil.resolve_name(spec.target)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise PhaseError(f"{where} does not import: {sentence(error)}") from error
    if kind == "scene" and not callable(found):
        raise PhaseError(f"{where} is {found!r}; expected a function that makes a scene")
    if kind != "scene" and not isinstance(found, type):
        raise PhaseError(f"{where} is {found!r}; expected a class")
    return found


def _is_strict() -> bool:
    """Read KINETILE_STRICT_PLUGINS; raise BadOption for a value that says neither yes nor no."""
    value = os.environ.get(_STRICT, "")
    word = value.strip().casefold()
    if word in ("1", "true", "yes", "on"):
        return True
    if word in ("", "0", "false", "no", "off"):
        return False
    raise BadOption(
        f"the environment variable {_STRICT} is {value!r}; expected 1, true, yes, on or 0, false, no, off"
    )


def _all_names(spec: Spec) -> tuple[str, ...]:
    return (spec.name, *spec.aliases)


def _label(plugin: object) -> str:
    """Return the name under which a plugin of this process is listed."""
    name = getattr(plugin, "__name__", None)
    return name if isinstance(name, str) else type(plugin).__name__


def _source(plugin: str, distribution: str | None, version: str | None) -> str:
    if distribution is None:
        return f"{plugin} (added in this process)"
    return f"{plugin} ({distribution} {version or 'of unknown version'})"
