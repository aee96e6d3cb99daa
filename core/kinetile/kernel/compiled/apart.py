"""What is too long for a hook: compiled once, apart from the loops that call it, and cached by itself.

Numba links whatever a function calls into it, and makes machine code of it all again, for each function of
the loop and for each choice of phases: the exact ticks of contacts came to a minute of compiling each time.
A function marked ``apart`` is known to the code that calls it by a name only, which is given an address
when that code is compiled or comes from the disk. The name has a fingerprint, so old machine code asks for
old names.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar, cast

from kinetile.kernel.compiled.fingerprint import fingerprint_of
from kinetile.kernel.compiled.hooks import INTERPRETED

__all__ = ["apart", "subroutine"]

F = TypeVar("F", bound=Callable[..., Any])

if not INTERPRETED:
    from llvmlite.binding import add_symbol
    from numba import extending as _extending
    from numba import types as _types

    extending = cast(Any, _extending)

    class _Apart(_types.ExternalFunction):
        """A function that compiled code knows by name only; it is loaded before such code is."""

        def __init__(self, function: FunctionType) -> None:
            fingerprint, _, self.called = fingerprint_of(function, tuple)
            self.py_func = function
            self.address: int | None = None
            kinds = {"float": _types.float64, "int": _types.int64}
            kind = [kinds[name] for name in function.__annotations__.values()]
            name = f"kinetile_{function.__name__}_{fingerprint}"
            super().__init__(name, kind[-1](*kind[:-1]))

        def load_apart(self) -> None:
            """Compile the function, or load it from the disk cache, and make its name known."""
            for each in self.called:
                each.load_apart()
            if self.address is None:
                source = self.py_func
                named = FunctionType(source.__code__, source.__globals__, source.__name__)
                named.__module__ = source.__module__
                named.__qualname__ = self.symbol
                self.made = self.compile(named)
                self.address = int(self.made.address)
                add_symbol(self.symbol, self.address)

        def compile(self, function: FunctionType) -> Any:
            """Return the machine code, from the disk or new."""
            import numba

            try:
                return numba.cfunc(self.sig, cache=True, error_model="numpy")(function)
            except RuntimeError:  # there is no folder that Numba could write its cache to
                return numba.cfunc(self.sig, error_model="numpy")(function)

        def get_call_type(self, context: Any, arguments: Any, named: Any) -> Any:
            """Return the signature, to code that is being compiled."""
            self.load_apart()
            return super().get_call_type(context, arguments, named)

    extending.register_model(_Apart)(extending.models.OpaqueModel)


def apart(function: F) -> F:
    """Mark a function that hooks call but do not take in: compiled once for all loops, and cached by itself.

    It takes and returns numbers only, which its annotations call ``float`` or ``int``, so that no array is
    passed by value. It may call hooks, and what is marked ``subroutine``.
    """
    return function if INTERPRETED else cast(F, _Apart(cast(FunctionType, function)))


def subroutine(function: F) -> F:
    """Mark a function that functions marked ``apart`` call: compiled once, not inlined, arrays and all."""
    if INTERPRETED:
        return function
    import numba

    unliteral = cast(Any, numba.types).unliteral
    made: Any = numba.njit(error_model="numpy")(function)
    template = made.get_call_template

    def one_for_all_constants(arguments: Any, named: Any) -> Any:  # else each constant compiles it anew
        return template([unliteral(each) for each in arguments], named)

    made.get_call_template = one_for_all_constants
    return cast(F, made)
