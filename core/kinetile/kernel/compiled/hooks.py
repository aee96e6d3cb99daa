"""Hooks: functions that are compiled into the kernel's loop.

Every hook and every hook it calls is forced inline, so that no array is ever passed by value between them.
And at the kernel's entry each array is re-viewed without its owner (``disowned``): Numba counts references
atomically on every pass of an array that has one, and that count is most of the cost of a small function.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar, cast

__all__ = [
    "INTERPRETED",
    "disowned",
    "hook",
    "is_hook",
    "larger",
    "smaller",
    "subroutine",
    "template",
    "to_be_filled_in",
]

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
"""True when hooks run as plain Python."""

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")


def to_be_filled_in(*arguments: Any) -> Any:
    """Stand, in a template, where ``compose`` puts a hook."""
    raise NotImplementedError


def template(function: F) -> F:
    """Mark a function of which ``compose`` makes a hook, with parts in place of its global names."""
    cast(Any, function).is_template = True
    return function


if not INTERPRETED:
    import numba
    from numba.core.registry import CPUDispatcher

    _HOOK = {
        "nopython": True,
        "forceinline": True,
        "error_model": "numpy",
        "no_cpython_wrapper": True,
        "no_cfunc_wrapper": True,
    }
    """What a hook is compiled with. Wrappers, to be called from Python, would cost half of the time."""

    class _Hook(CPUDispatcher):
        """A function that compiled code inlines."""

        def __call__(self, *arguments: Any) -> Any:
            """Run from Python."""
            return _alone(self.py_func)(*arguments)

    class _Subroutine(_Hook):
        """A function that compiled code calls."""

        def get_call_template(self, arguments: Any, named: Any) -> Any:
            """Return what a call comes to: one for all constants, else each would compile it anew."""
            unliteral = cast(Any, numba.types).unliteral
            return super().get_call_template([unliteral(each) for each in arguments], named)

    @cache
    def _alone(function: Callable[..., Any]) -> Callable[..., Any]:
        return cast(
            "Callable[..., Any]", cast(Any, numba).njit(error_model="numpy", no_cfunc_wrapper=True)(function)
        )


def hook(function: F) -> F:
    """Mark a function that runs inside the kernel's loop: compiled, forced inline, IEEE division (no
    exceptions).

    Called from Python, in a test say, it is compiled once more, apart and with what such a call needs.
    """
    if INTERPRETED:
        return function
    return cast(F, _Hook(function, targetoptions=_HOOK))


def subroutine(function: F) -> F:
    """Mark a function that functions marked ``apart`` call: compiled once, not inlined, arrays and all."""
    if INTERPRETED:
        return function
    return cast(F, _Subroutine(function, targetoptions={**_HOOK, "forceinline": False}))


@hook
def smaller(a: Any, b: Any) -> Any:
    """Return the smaller of two numbers. Numba's ``min`` is not inlined into large functions."""
    return a if a < b else b


@hook
def larger(a: Any, b: Any) -> Any:
    """Return the larger of two numbers."""
    return a if a > b else b


def is_hook(value: Any) -> bool:
    """Whether a value is a function marked with ``hook``; where hooks are interpreted, whether it is a
    function."""
    return callable(value) if INTERPRETED else hasattr(value, "py_func")


if INTERPRETED:

    def disowned(tables: T) -> T:
        """Return ``tables`` as they are: interpreted code counts no references worth saving."""
        return tables

else:
    from numba import types as _types
    from numba.core import cgutils as _cgutils
    from numba.extending import intrinsic as _intrinsic

    @_intrinsic
    def disowned(typing_context: Any, tables: Any) -> Any:
        """Return a named tuple of arrays, each viewing the same memory without a reference to its owner.

        The caller keeps the owners alive for as long as the views are in use.
        """

        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            (value,) = arguments
            null = cast(Any, _cgutils).get_null_value
            for position, kind in enumerate(tables.types):
                if isinstance(kind, _types.Array):
                    element = builder.extract_value(value, position)
                    array = context.make_array(kind)(context, builder, value=element)
                    array.meminfo = null(array.meminfo.type)
                    array.parent = null(array.parent.type)
                    value = builder.insert_value(value, array._getvalue(), position)
            return value

        return tables(tables), codegen
