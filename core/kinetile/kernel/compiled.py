"""The one place that knows Numba.

Phases and kernel are plain Python functions marked with ``hook``. Three things make them as fast as C, and
all of them live here:

* every hook and every function it calls is forced inline, so that no array is ever passed by value between
them;
* at the kernel's entry each array is re-viewed without its owner (``disowned``): Numba counts references
atomically on
  every pass of an array that has one, and that count is most of the cost of a small function;
* the loop is composed once for a choice of phases (``compose``) and cached on disk under a name that carries
a
  fingerprint of everything compiled into it. Numba's own cache looks at one file's date only, and would serve
  old machine code after a change in a phase; it would also miss in every process if the loop closed over its
  hooks.

With ``NUMBA_DISABLE_JIT=1`` the same source runs interpreted, for a debugger and for coverage.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar, cast

import numpy as np

__all__ = [
    "INTERPRETED",
    "NotCompiled",
    "apart",
    "compose",
    "disowned",
    "hook",
    "is_cached",
    "is_hook",
    "larger",
    "make_ready",
    "nobody_compiles",
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


class NotCompiled(Exception):
    """The compiler refuses a hook; the message is its own."""


def hook(function: F) -> F:
    """Mark a function that runs inside the kernel's loop: compiled, forced inline, IEEE division (no
    exceptions)."""
    if INTERPRETED:
        return function
    import numba

    return cast(F, numba.njit(forceinline=True, error_model="numpy")(function))


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
    from llvmlite.binding import add_symbol as _add_symbol
    from numba import extending as _extending
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

    class _Apart(_types.ExternalFunction):
        """A function that compiled code knows by name only; it is loaded before such code is."""

        def __init__(self, function: FunctionType) -> None:
            fingerprint, _, self.called = _fingerprint(function, tuple)
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
                self.address = _address(named, self.sig)
                _add_symbol(self.symbol, self.address)

        def get_call_type(self, context: Any, arguments: Any, named: Any) -> Any:
            """Return the signature, to code that is being compiled."""
            self.load_apart()
            return super().get_call_type(context, arguments, named)

    cast(Any, _extending).register_model(_Apart)(cast(Any, _extending).models.OpaqueModel)

    def _address(function: FunctionType, signature: Any) -> int:
        import numba

        for cache in (True, False):
            try:
                made = numba.cfunc(signature, cache=cache, error_model="numpy")(function)
            except RuntimeError:  # there is no folder that Numba could write its cache to
                continue
            return int(cast(Any, made).address)
        raise AssertionError("Numba compiles without a cache")


def apart(function: F) -> F:
    """Mark a function that hooks call but do not take in: compiled once for all loops, and cached by itself.

    For what is long: a hook is compiled again at each place that calls it, and with each choice of phases. It
    takes and returns numbers only, which its annotations call ``float`` or ``int``, so that no array is
    passed by value, and code that calls it knows no more of it than a name, with a fingerprint.
    """
    return function if INTERPRETED else cast(F, _Apart(cast(FunctionType, function)))


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
    fingerprint, modules, called = _fingerprint(function, state)
    function.__qualname__ = f"{source.__name__}_{label}_{fingerprint}"
    if "__main__" not in modules:
        try:
            return _njit(function, True, called)
        except RuntimeError:  # there is no folder that Numba could write its cache to
            pass
    return _njit(function, False, called)


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


def _njit(function: Callable[..., Any], cache: bool, called: list[Any]) -> Callable[..., Any]:
    import numba

    made: Any = numba.njit(cache=cache, error_model="numpy", nogil=True)(function)
    compiles = made.compile

    def with_what_it_calls(signature: Any) -> Any:
        for each in called:
            each.load_apart()
        return compiles(signature)

    made.compile = with_what_it_calls
    return cast("Callable[..., Any]", made)


def _fingerprint(function: Callable[..., Any], state: type) -> tuple[str, set[str], list[Any]]:
    """Return a digest of a function and of all that it reaches, the modules that it was found in, and what it
    calls ``apart``.

    What counts is bytecode, constants, hooks and the values of globals, also where they are reached through a
    module.
    """
    digest = hashlib.sha256(repr((sys.version, np.__version__, API)).encode())
    for source in sorted(Path(__file__).with_name("vectors").glob("*.py")):
        digest.update(source.read_bytes())  # bytecode does not show intrinsics
    seen: set[int] = set()
    modules: set[str] = set()
    called: list[Any] = []

    def visit(value: Any) -> None:
        if hasattr(value, "load_apart") and value not in called:
            called.append(value)
        value = getattr(value, "py_func", value)
        if isinstance(value, FunctionType | type):
            modules.add(value.__module__)
            digest.update(f"{value.__module__}.{value.__qualname__}".encode())
            digest.update(repr((getattr(value, "_fields", ()), getattr(value, "__members__", ()))).encode())
        if isinstance(value, FunctionType):
            if id(value) in seen:
                return
            seen.add(id(value))
            code(value.__code__, value.__globals__)
            for cell in value.__closure__ or ():
                visit(cell.cell_contents)
            visit(value.__defaults__)
        elif isinstance(value, ModuleType):
            digest.update(value.__name__.encode())
        elif isinstance(value, tuple | list):
            digest.update(f"{len(value)}(".encode())
            for item in value:
                visit(item)
        elif isinstance(value, np.ndarray):
            digest.update(value.tobytes())
        elif callable(value):
            digest.update(getattr(value, "__name__", type(value).__name__).encode())
        else:
            digest.update(repr(value).encode())

    def code(block: CodeType, names: Mapping[str, Any]) -> None:
        digest.update(block.co_code)
        digest.update(repr(block.co_varnames).encode())
        for constant in block.co_consts:
            if isinstance(constant, CodeType):
                code(constant, names)
            else:
                digest.update(repr(constant).encode())
        rooms: list[ModuleType] = []
        for name in block.co_names:  # in the order of the code: package, module in it, function in that
            for value in (names.get(name), *(getattr(room, name, None) for room in rooms)):
                if isinstance(value, ModuleType) and value not in rooms and not _foreign(value):
                    rooms.append(value)
        for name in block.co_names:
            digest.update(name.encode())
            if name in names:
                visit(names[name])
            for room in rooms:
                if hasattr(room, name):
                    visit(getattr(room, name))

    visit(function)
    visit(state)
    return digest.hexdigest()[:16], modules, called


def _foreign(module: ModuleType) -> bool:
    """Whether a module's functions change only with its version: the standard library, NumPy, Numba."""
    root = module.__name__.partition(".")[0]
    return root in sys.stdlib_module_names or root in ("numpy", "numba")


API = 2
"""Raised when the shape of the kernel's tables changes in a way that bytecode does not show."""


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
