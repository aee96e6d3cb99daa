"""Plugins one at a time: which are installed, and what a single one offers.

pluggy's own loader stops at the first plugin that does not import, and drops without a word a second
distribution with the same entry-point name. So entry points are gone through here one by one, and each plugin
is asked through a pluggy manager of its own: there is nothing to roll back when it fails, and no doubt about
whose fault it was.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from importlib import metadata
from typing import Literal, NamedTuple, TypeAlias

import pluggy

from kinetile.errors import BadPlugin, nearest
from kinetile.plugin import hookspecs
from kinetile.plugin.specs import BroadPhaseSpec, NarrowPhaseSpec, ResponseSpec, SceneSpec, Spec

__all__ = ["Installed", "Kind", "installed", "offers", "sentence"]

Kind: TypeAlias = Literal["broad phase", "narrow phase", "response", "scene"]

_GROUP = "kinetile"
_HOOKS: dict[str, tuple[Kind, type[Spec]]] = {
    "kinetile_broad_phases": ("broad phase", BroadPhaseSpec),
    "kinetile_narrow_phases": ("narrow phase", NarrowPhaseSpec),
    "kinetile_responses": ("response", ResponseSpec),
    "kinetile_scenes": ("scene", SceneSpec),
}


class Installed(NamedTuple):
    """A plugin that is installed but not loaded yet, and the distribution that brings it.

    ``plugin`` is "<distribution>:<entry point>", for two distributions may choose the same entry-point name.
    """

    plugin: str
    distribution: str
    version: str | None
    load: Callable[[], object]


def installed() -> list[Installed]:
    """Return the plugins that are installed, kinetile's own first and the others in alphabetical order."""
    return sorted(_entry_points(), key=_built_in_first)


def offers(plugin: object) -> list[tuple[Kind, Spec]]:
    """Return all that a plugin offers; raise BadPlugin where its hooks are not what they should be."""
    manager = pluggy.PluginManager(hookspecs.PROJECT)
    manager.add_hookspecs(hookspecs)
    try:
        manager.register(plugin)
    except pluggy.PluginValidationError as error:
        raise BadPlugin(str(error)) from error
    _check_hooks(plugin, {caller.name: caller for caller in manager.get_hookcallers(plugin) or ()})
    return [
        (kind, spec)
        for hook, (kind, spec_type) in _HOOKS.items()
        for spec in _call(getattr(manager.hook, hook), spec_type)
    ]


def sentence(error: BaseException) -> str:
    """Return an error's type and message on one line."""
    message = " ".join(str(error).split())
    return f"{type(error).__name__}: {message}" if message else type(error).__name__


def _check_hooks(plugin: object, callers: dict[str, pluggy.HookCaller]) -> None:
    """Raise BadPlugin for a hook that kinetile does not have, one that is not marked, or none at all."""
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
    """Yield what one hook of one plugin returns; raise BadPlugin unless it is a list of such specs."""
    expected = f"a list of {spec_type.__name__}"
    try:
        answers = caller()
    except (BadPlugin, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise BadPlugin(f"its hook {caller.name} raised {sentence(error)}") from error
    if len(answers) < len(caller.get_hookimpls()):  # pluggy leaves out a None
        raise BadPlugin(f"its hook {caller.name} returned nothing; expected {expected}")
    for answer in answers:
        if not isinstance(answer, list | tuple):
            raise BadPlugin(f"its hook {caller.name} returned {answer!r}; expected {expected}")
        for spec in answer:
            if not isinstance(spec, spec_type):
                raise BadPlugin(f"its hook {caller.name} returned a list with {spec!r}; expected {expected}")
            yield spec


def _entry_points() -> Iterator[Installed]:
    """Yield the entry points of kinetile's group; of two distributions of one name, of the first."""
    seen: set[str] = set()
    for distribution in metadata.distributions():
        try:
            found = [(point.name, point.load) for point in distribution.entry_points.select(group=_GROUP)]
        except Exception as error:  # one damaged line anywhere in the file
            if f"[{_GROUP}]" not in (distribution.read_text("entry_points.txt") or ""):
                continue
            found = [("entry_points.txt", partial(_refuse, error))]
        if found:
            name = distribution.name or "unknown"  # None where the metadata is damaged
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
