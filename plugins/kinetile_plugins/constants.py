"""Hooks for kinds of scenes: one text, and other constants in it.

A hook branches on names of its module in capitals, which have the values of the usual scene. Such a branch is
decided when the hook is compiled, so a loop has no code for what its scene does not have.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import FunctionType
from typing import Any

from kinetile.toolbox import hook, unchecked


def with_constants(hooks: Iterable[Callable[..., Any]], **constants: object) -> dict[str, Any]:
    """Returns hooks by their names, with these constants in place of global names; a hook that calls others
    comes after them, and calls those of the result."""
    made: dict[str, Any] = dict(constants)
    for each in hooks:
        usual: FunctionType = each.py_func  # type: ignore[attr-defined]
        names = usual.__globals__ | made
        function = FunctionType(usual.__code__, names, usual.__name__, usual.__defaults__, usual.__closure__)
        again = hook(function)
        made[usual.__name__] = unchecked(again) if hasattr(each, "is_unchecked") else again
    return made
