"""Specs of phases, responses, scenes and observables, and the hooks that plugins offer them with.

The target of a spec is usually a string, ``"package.module:attribute"``, which is imported only when its name
is selected; in notebooks and tests it may be the class or the function itself. A plugin is a module (or any
object) with functions named like the hooks below, decorated with ``hookimpl``. The registry finds it by the
entry-point group ``kinetile`` of its distribution, or ``kinetile.registry().add`` adds it. Hooks take no
arguments and return lists of specs; they are called once, when the registry is made.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import pluggy

from kinetile.errors import BadPlugin, one_of, shown

API_VERSION = 2
"""The version of the plugin API: of the specs, and of the protocol of phases."""

PluginKind: TypeAlias = Literal["broad phase", "narrow phase", "response", "scene", "observable"]
"""The kinds of choices by name."""

_NAME = re.compile(r"[^\s,=:]+")
_TARGET = re.compile(r"\w+(\.\w+)*:\w+(\.\w+)*")


@dataclass(frozen=True)
class Spec:
    """The common fields of all specs: see ``BroadPhaseSpec``."""

    name: str
    target: str | Callable[..., Any]
    summary: str = ""
    features: frozenset[str] = frozenset()
    api: int = API_VERSION
    aliases: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Normalises the collections, and raises BadPlugin for an invalid field."""
        where = f"{type(self).__name__} {shown(self.name)}"
        if not isinstance(self.api, int):
            raise BadPlugin(f"{where}: api is {shown(self.api)}; expected a whole number")
        if self.api != API_VERSION:
            return  # another API version: the registry refuses it with the reason
        object.__setattr__(self, "aliases", _words(self, "aliases"))
        object.__setattr__(self, "features", frozenset(_words(self, "features")))
        for name in (self.name, *self.aliases):
            if not (isinstance(name, str) and _NAME.fullmatch(name)):
                raise BadPlugin(
                    f"{where}: {shown(name)} is not a name; expected text without spaces, commas, '=' and ':'"
                )
        if not isinstance(self.summary, str):
            raise BadPlugin(f"{where}: summary is {shown(self.summary)}; expected text")
        target: Any = self.target
        wanted = "function" if isinstance(self, SceneSpec) else "class"
        fits = callable(target) if isinstance(self, SceneSpec) else isinstance(target, type)
        if not (_TARGET.fullmatch(target) if isinstance(target, str) else fits):
            raise BadPlugin(
                f"{where}: target is {shown(target)}; expected a {wanted}, or 'package.module:{wanted}'"
            )


@dataclass(frozen=True)
class BroadPhaseSpec(Spec):
    """A broad phase: keeps a set of candidate pairs complete. Raises BadPlugin if a field is invalid.

    ``name`` is the public name ("sap-1d"): no spaces, commas, ``=`` or ``:``; a name that begins with ``_``
    is found, but not listed. ``aliases`` are other names for it. ``target`` is the class, or
    "package.module:Class". ``summary`` is one line for a listing. ``features`` are words for abilities beyond
    the protocol. ``api`` is the version of the plugin API that the phase was written for: only API_VERSION is
    accepted.
    """


@dataclass(frozen=True)
class NarrowPhaseSpec(Spec):
    """A narrow phase: predicts contacts of one kind, and runs them; ``role`` is that kind: "pair" (two
    bodies) or "wall" (a body and a wall).

    ``shapes`` are kinds of shapes (``Shape.kind``: "disc", "box" and so on); the phase takes every two of
    them. If several phases are named, the first that takes two shapes decides their contacts
    (``kinetile.run.pair_phases``). The other fields, and the errors, are as in BroadPhaseSpec.
    """

    role: Literal["pair", "wall"] = field(kw_only=True)
    shapes: tuple[str, ...] = field(default=("disc",), kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "shapes", _words(self, "shapes"))
        if not isinstance(self.role, str) or self.role not in ("pair", "wall"):
            raise BadPlugin(
                f"NarrowPhaseSpec {shown(self.name)}: role is {shown(self.role)}; expected 'pair' or 'wall'"
            )


@dataclass(frozen=True)
class ResponseSpec(Spec):
    """A response: the outcome of a contact. Its only possible feature is "dissipative"; the other fields, and
    the errors, are as in BroadPhaseSpec."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for word in sorted({*self.features} - {"dissipative"}) if self.api == API_VERSION else ():
            wanted = f"expected {one_of(word, ['dissipative'])}, or none"
            raise BadPlugin(f"ResponseSpec {shown(self.name)}: features has {shown(word)}; {wanted}")


@dataclass(frozen=True)
class ObservableSpec(Spec):
    """An observable: a measurement during a run. The fields, and the errors, are as in BroadPhaseSpec."""


@dataclass(frozen=True)
class SceneSpec(Spec):
    """A recipe for scenes: ``target`` is a callable with the scene's parameters as keyword arguments, or
    "package.module:function". The other fields, and the errors, are as in BroadPhaseSpec."""


def _words(spec: Spec, field_name: str) -> tuple[str, ...]:
    words: object = getattr(spec, field_name)
    if isinstance(words, Iterable) and not isinstance(words, str) and getattr(words, "ndim", 1) != 0:
        found = tuple(words)
        if all(isinstance(word, str) for word in found):
            return found
    where = f"{type(spec).__name__} {shown(spec.name)}"
    raise BadPlugin(
        f"{where}: {field_name} is {shown(words)}; expected a collection of words, such as ('a', 'b')"
    )


PROJECT = "kinetile"

hookspec = pluggy.HookspecMarker(PROJECT)
"""Marks a function as the specification of a hook."""

hookimpl = pluggy.HookimplMarker(PROJECT)
"""Marks a plugin's function as its implementation of the hook with this name."""


@hookspec
def kinetile_broad_phases() -> list[BroadPhaseSpec]:
    """Returns the broad phases of this plugin."""
    raise NotImplementedError


@hookspec
def kinetile_narrow_phases() -> list[NarrowPhaseSpec]:
    """Returns the narrow phases of this plugin."""
    raise NotImplementedError


@hookspec
def kinetile_responses() -> list[ResponseSpec]:
    """Returns the responses of this plugin."""
    raise NotImplementedError


@hookspec
def kinetile_scenes() -> list[SceneSpec]:
    """Returns the scene recipes of this plugin."""
    raise NotImplementedError


@hookspec
def kinetile_observables() -> list[ObservableSpec]:
    """Returns the observables of this plugin."""
    raise NotImplementedError
