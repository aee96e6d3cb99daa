"""What a plugin says about a phase or a scene: enough to list it, and where to find it once it is selected.

A spec is light on purpose. Its target is usually a string, ``"package.module:attribute"``, which is imported
when somebody selects the name and not before, so that listing a hundred phases imports none of them. In
notebooks and tests the class or the function itself may stand in its place.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from kinetile.errors import BadPlugin

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["API_VERSION", "MOVING", "BroadPhaseSpec", "NarrowPhaseSpec", "ResponseSpec", "SceneSpec", "Spec"]

API_VERSION = 2
"""The version of the plugin API: of the specs, and of the protocol that phases follow."""

MOVING = "docs/moving-to-api-2.md says what to change"
"""What is told to whoever comes with an older version."""

_NAME = re.compile(r"[^\s,=:]+")
_TARGET = re.compile(r"\w+(\.\w+)*:\w+(\.\w+)*")


@dataclass(frozen=True)
class BroadPhaseSpec:
    """A broad phase: keeps a set of candidate pairs complete.

    ``name`` is what users write ("sap-1d"): no spaces, commas, ``=`` or ``:``; ``aliases`` are other names
    that find it. ``target`` is the class, or "package.module:Class". ``summary`` is one line for a listing.
    ``features`` are words for what the phase can do beyond the protocol. ``api`` is the version of the plugin
    API that the phase was written for; the registry takes in no other than API_VERSION.

    Raises BadPlugin where a field cannot be used.
    """

    name: str
    target: str | type
    summary: str = ""
    features: frozenset[str] = frozenset()
    api: int = API_VERSION
    aliases: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class NarrowPhaseSpec:
    """A narrow phase: predicts contacts of one kind, and answers them.

    ``role`` says what it judges: "pair" (two bodies) or "wall" (a body and a wall). The other fields, and the
    errors, are as in BroadPhaseSpec.
    """

    name: str
    target: str | type
    summary: str = ""
    features: frozenset[str] = frozenset()
    api: int = API_VERSION
    aliases: tuple[str, ...] = ()
    role: Literal["pair", "wall"] = field(kw_only=True)

    def __post_init__(self) -> None:
        _check(self)
        if self.role not in ("pair", "wall"):
            raise BadPlugin(
                f"NarrowPhaseSpec {self.name!r}: role is {self.role!r}; expected 'pair' or 'wall'"
            )


@dataclass(frozen=True)
class ResponseSpec:
    """A response: what happens at a contact. The fields, and the errors, are as in BroadPhaseSpec."""

    name: str
    target: str | type
    summary: str = ""
    features: frozenset[str] = frozenset()
    api: int = API_VERSION
    aliases: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True)
class SceneSpec:
    """A recipe for scenes: a callable whose keyword arguments are the scene's parameters.

    ``target`` is the callable, or "package.module:function". The other fields, and the errors, are as in
    BroadPhaseSpec.
    """

    name: str
    target: str | Callable[..., Scene]
    summary: str = ""
    api: int = API_VERSION
    aliases: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check(self)


Spec: TypeAlias = BroadPhaseSpec | NarrowPhaseSpec | ResponseSpec | SceneSpec


def _check(spec: Spec) -> None:
    """Bring the collections into their form, and raise BadPlugin for a field that cannot be used."""
    if spec.api != API_VERSION:
        return  # made for other rules than these; the registry refuses it, and says why
    where = f"{type(spec).__name__} {spec.name!r}"
    object.__setattr__(spec, "aliases", _words(spec, "aliases"))
    for name in (spec.name, *spec.aliases):
        if not (isinstance(name, str) and _NAME.fullmatch(name)):
            raise BadPlugin(
                f"{where}: {name!r} is not a name; expected text without spaces, commas, '=' and ':'"
            )
    if not isinstance(spec, SceneSpec):
        object.__setattr__(spec, "features", frozenset(_words(spec, "features")))
    if not isinstance(spec.summary, str):
        raise BadPlugin(f"{where}: summary is {spec.summary!r}; expected text")
    target: Any = spec.target
    wanted = "function" if isinstance(spec, SceneSpec) else "class"
    fits = callable(target) if isinstance(spec, SceneSpec) else isinstance(target, type)
    if not (_TARGET.fullmatch(target) if isinstance(target, str) else fits):
        raise BadPlugin(f"{where}: target is {target!r}; expected a {wanted}, or 'package.module:{wanted}'")


def _words(spec: Spec, field_name: str) -> tuple[str, ...]:
    """Return a field that holds several words; raise BadPlugin where it is anything else."""
    words: object = getattr(spec, field_name)
    if isinstance(words, Iterable) and not isinstance(words, str):
        found = tuple(words)
        if all(isinstance(word, str) for word in found):
            return found
    where = f"{type(spec).__name__} {spec.name!r}"
    raise BadPlugin(f"{where}: {field_name} is {words!r}; expected a collection of words, such as ('a', 'b')")
