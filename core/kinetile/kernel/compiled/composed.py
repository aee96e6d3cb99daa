"""Composing: the loop of a choice of phases, made of templates and hooks, compiled once and cached on disk.

Numba's own cache looks at one file's date only, and would serve old machine code after a change in a phase;
it would also miss in every process if the loop closed over its hooks. So the hooks are put among the
globals of a function whose name carries the fingerprint of everything that is compiled into it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

from kinetile.kernel.compiled.fingerprint import fingerprint_of
from kinetile.kernel.compiled.hooks import INTERPRETED, hook

__all__ = ["NotCompiled", "compose", "is_cached", "make_ready", "template", "to_be_filled_in"]

F = TypeVar("F", bound=Callable[..., Any])


def to_be_filled_in(*arguments: Any) -> Any:
    """Stand, in a template, where ``compose`` puts a hook."""
    raise NotImplementedError


def template(function: F) -> F:
    """Mark a function of which ``compose`` makes a hook, with parts in place of its global names."""
    cast(Any, function).is_template = True
    return function


class NotCompiled(Exception):
    """The compiler refuses a hook; the message is its own."""


def compose(
    template: Callable[..., Any], parts: Mapping[str, Any], label: str, state: type
) -> Callable[..., Any]:
    """Compile ``template`` with ``parts`` in place of its global names: once a process, and cached on disk.

    ``template`` is a plain function; ``parts`` maps names it uses, itself or in a ``template`` that it calls,
    to hooks and constants; ``label`` names the choice of phases in the cache. The result is compiled when it
    is first called.
    """
    key = (template, label, state, *sorted(parts.items(), key=lambda part: part[0]))
    if key not in _composed:
        _composed[key] = _compose(template, parts, label, state)
    return _composed[key]


_composed: dict[tuple[Any, ...], Callable[..., Any]] = {}


def _compose(
    template: Callable[..., Any], parts: Mapping[str, Any], label: str, state: type
) -> Callable[..., Any]:
    source = cast(FunctionType, template)
    function = _filled_in(source, parts, {})
    if INTERPRETED:
        return function
    fingerprint, modules, called = fingerprint_of(function, state)
    function.__qualname__ = f"{source.__name__}_{label}_{fingerprint}"
    if "__main__" not in modules:
        try:
            return _knowing(called, _njit(function, cache=True))
        except RuntimeError:  # there is no folder that Numba could write its cache to
            pass
    return _knowing(called, _njit(function, cache=False))


def _filled_in(source: FunctionType, parts: Mapping[str, Any], made: dict[str, Any]) -> FunctionType:
    """Return a function with parts in place of its global names, and of those of the templates it calls."""
    names = dict(source.__globals__)
    names.update(parts)
    function = FunctionType(source.__code__, names, source.__name__, source.__defaults__, source.__closure__)
    function.__module__ = source.__module__
    function.__qualname__ = source.__qualname__
    function.__doc__ = source.__doc__
    for name in source.__code__.co_names:
        value = names.get(name)
        if getattr(value, "is_template", False):
            if name not in made:
                made[name] = hook(_filled_in(cast(FunctionType, value), parts, made))
            names[name] = made[name]
    return function


def _njit(function: Callable[..., Any], cache: bool) -> Callable[..., Any]:
    import numba

    return cast("Callable[..., Any]", numba.njit(cache=cache, error_model="numpy", nogil=True)(function))


def _knowing(called: list[Any], function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that loads what it calls apart before it is compiled, or loaded from the disk."""
    made: Any = function
    compiles = made.compile

    def with_what_it_calls(signature: Any) -> Any:
        for each in called:
            each.load_apart()
        return compiles(signature)

    made.compile = with_what_it_calls
    return function


def make_ready(function: Callable[..., Any], *arguments: Any) -> None:
    """Compile a composed function for such arguments, or load it from the disk cache, without running it.

    Raises NotCompiled, with what the compiler says, where a hook is not such as can be compiled.
    """
    if INTERPRETED:
        return
    import numba

    typeof = cast(Any, numba).typeof
    try:
        cast(Any, function).compile(tuple(typeof(argument) for argument in arguments))
    except Exception as error:  # Numba lets errors of all types through
        raise NotCompiled(f"{type(error).__name__}: {error}") from error


def is_cached(function: Callable[..., Any]) -> bool | None:
    """Whether a composed function's machine code lies in the disk cache; None when it runs interpreted."""
    if INTERPRETED:
        return None
    folder = Path(cast(Any, function).stats.cache_path or ".")
    return any(folder.glob(f"*{function.__qualname__}*.nbi"))
