"""Hooks: plain functions, compiled and forced inline; and what one may call that Numba does not have."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any, TypeVar, cast

__all__ = ["INTERPRETED", "disowned", "hook", "is_hook", "larger", "nobody_compiles", "smaller"]

INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
"""True when hooks run as plain Python."""

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")


def hook(function: F) -> F:
    """Mark a function that runs inside the kernel's loop: compiled, forced inline, IEEE division (no
    exceptions)."""
    if INTERPRETED:
        return function
    import numba

    return cast(F, numba.njit(forceinline=True, error_model="numpy")(function))


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


def nobody_compiles() -> AbstractContextManager[Any]:
    """Return a context in which no other thread compiles: only then is it safe to fork this process."""
    if INTERPRETED or "numba" not in sys.modules:
        return nullcontext()
    from numba.core.compiler_lock import global_compiler_lock

    return cast("AbstractContextManager[Any]", global_compiler_lock)


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
