"""What is too long for a hook: compiled once, apart from the loops that call it, and cached by itself.

Numba links whatever a function calls into it, and makes machine code of it all again, for each function of
the loop and for each choice of phases. A function marked ``apart`` is known to the code that calls it by a
name only, which is given an address when that code is compiled or comes from the disk. The name has a
fingerprint, so old machine code asks for old names.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from types import FunctionType
from typing import Any, TypeVar, cast

from kinetile.kernel.compiled.fingerprint import fingerprint
from kinetile.kernel.compiled.hooks import INTERPRETED

__all__ = ["apart"]

F = TypeVar("F", bound=Callable[..., Any])

if not INTERPRETED:
    from llvmlite.binding import add_symbol
    from numba import extending, types
    from numba.core.ccallback import CFunc

    from kinetile.kernel.compiled.cache import CheckedCache

    class _Apart(types.ExternalFunction):
        """A function that compiled code knows by name only; it is loaded before such code is."""

        def __init__(self, function: FunctionType) -> None:
            digest, _, self.called = fingerprint(function, tuple)
            self.py_func = function
            self.address: int | None = None
            kinds = {"float": types.float64, "int": types.int64}
            kind = [kinds[name] for name in function.__annotations__.values()]
            name = f"kinetile_{function.__name__}_{digest}"
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
                self.made = _compiled(named, self.sig)  # kept, or its code would go
                self.address = int(self.made.address)
                add_symbol(self.symbol, self.address)

        def get_call_type(self, context: Any, arguments: Any, named: Any) -> Any:
            """Return the signature, to code that is being compiled."""
            self.load_apart()
            return super().get_call_type(context, arguments, named)

    cast(Any, extending).register_model(_Apart)(cast(Any, extending).models.OpaqueModel)

    def _compiled(function: FunctionType, signature: Any) -> Any:
        made = cast(Any, CFunc)(
            function, (signature.args, signature.return_type), locals={}, options={"error_model": "numpy"}
        )
        with suppress(RuntimeError):  # there is no folder that the cache could be written to
            made._cache = CheckedCache(function)
        made.compile()
        return made


def apart(function: F) -> F:
    """Mark a function that hooks call but do not take in: compiled once for all loops, and cached by itself.

    For what is long: a hook is compiled again at each place that calls it, and with each choice of phases. It
    takes and returns numbers only, which its annotations call ``float`` or ``int``, so that no array is
    passed by value, and code that calls it knows no more of it than a name, with a fingerprint.
    """
    return function if INTERPRETED else cast(F, _Apart(cast(FunctionType, function)))
