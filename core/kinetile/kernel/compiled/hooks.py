"""Hooks: functions that are compiled into the kernel's loop.

Every hook and every hook it calls is forced inline, so that no array is ever passed by value between them.
And at the kernel's entry each array loses its owner (``views.disowned``).

A function that is too long for a hook is marked ``apart``: compiled once, and cached separately. Numba would
link it into all its callers, and make its machine code again for each choice of phases. Its callers refer to
it by a name only, which gets an address when their code is compiled or loaded from the disk. The name has a
fingerprint, so old machine code refers to old names.
"""

import gc
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from opcode import opmap
from types import FunctionType
from typing import Any, TypeAlias, TypeVar, cast, get_type_hints

import numpy as np

from kinetile.kernel.compiled.fingerprint import APART, fingerprint

F = TypeVar("F", bound=Callable[..., Any])

Hook: TypeAlias = Callable[..., Any]
Numbers: TypeAlias = Any
"""An array of float64 for functions marked ``apart``: to be read by an index from 0."""


@contextmanager
def uncollected() -> Iterator[None]:
    """Stops garbage collection in this context: all that Numba makes stays, and would be scanned again."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def to_be_filled_in(*arguments: Any) -> Any:
    """Marks, in a template, the place of a hook from ``compose``."""
    raise NotImplementedError


def template(function: F) -> F:
    """Marks a function that ``compose`` makes a hook of, with parts in place of its global names."""
    cast(Any, function).is_template = True
    return function


with uncollected():
    from kinetile.kernel.compiled import backend
    from kinetile.kernel.compiled.backend import CPUDispatcher, LinkingCompiler, ir, types
    from kinetile.kernel.compiled.cache import CheckedCache, KeptHook

_HOOK = {
    "nopython": True,
    "forceinline": True,
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
"""The compiler options of a hook. Wrappers, for calls from Python, would cost half of the time."""

_SHORT = (types.int8, types.int16, types.int32)


def _kept(function: FunctionType, key: str) -> KeptHook | None:
    """Returns the place of a hook's code on disk; None if a part of the hook is in ``__main__``."""
    digest, modules = fingerprint(function, tuple)
    return None if "__main__" in modules else KeptHook(function, digest, key)


LinkingCompiler.kept = staticmethod(_kept)


class _Hook(CPUDispatcher):
    """A function that compiled code inlines."""

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self.calls: dict[tuple[int, ...], Any] = {}

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        """Returns the template of a call: one for all constants, and for all signed integers.

        Else each constant would compile it again; also the first value of a variable, with code that is
        never used: ``found = NOBODY`` before a loop.
        """
        given = [types.unliteral(each) for each in arguments]
        given = [types.int64 if each in _SHORT else each for each in given]
        key = tuple([each._code for each in given])
        if named or key not in self.calls:
            self.calls[key] = super().get_call_template(given, named)
        return self.calls[key]


class _ByRecord(_Hook):
    """A hook that has two forms: the record that comes first, by its type, chooses one of them."""

    field: str
    forms: tuple[_Hook, _Hook]

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)

    def get_call_template(self, arguments: Any, named: Any) -> Any:
        return self._chosen(arguments).get_call_template(arguments, named)

    def get_overload(self, arguments: Any) -> Any:
        return self._chosen(arguments).get_overload(arguments)

    def _chosen(self, arguments: Any) -> _Hook:
        return self.forms[self.field in arguments[0].fields]


class _Subroutine(_Hook):
    """A function that compiled code calls; its name lets fingerprints distinguish it from inlined code."""


def hook(function: F) -> F:
    """Marks a function that runs inside the kernel's loop: compiled, forced inline, IEEE division (no
    exceptions).

    Called from Python it is the function itself. Raises TypeError for one that assigns to a global variable.
    """
    if opmap["STORE_GLOBAL"] in cast(FunctionType, function).__code__.co_code[::2]:
        raise TypeError(f"{function.__name__} assigns to a global variable; a hook keeps values in its state")
    return cast(F, _Hook(function, targetoptions=_HOOK, pipeline_class=LinkingCompiler))


def with_field(field: str, other: F) -> Callable[[F], F]:
    """Marks a hook, above ``hook``, and another hook that replaces it for records with a field.

    The first argument of both is a record, or a named tuple. The code compiled for records without the field
    has no part of the other form.
    """

    def decorated(usual: F) -> F:
        @wraps(python_of(usual))
        def chosen(row: Any, *rest: Any) -> Any:
            kind = type(row)  # the type of a named tuple, or of a quick row, has its fields
            there = field in row.dtype.names if kind in (np.record, np.void) else hasattr(kind, field)
            return (other if there else usual)(row, *rest)

        made = _ByRecord(chosen, targetoptions=_HOOK, pipeline_class=LinkingCompiler)
        made.field, made.forms = field, (cast(Any, usual), cast(Any, other))
        return cast(F, made)

    return decorated


def with_accelerations(of_accelerated: F) -> Callable[[F], F]:
    """Marks a hook of a body's record, above ``hook``: ``of_accelerated`` replaces it if some are."""
    return with_field("ax", of_accelerated)


def with_shapes(of_shape: F) -> Callable[[F], F]:
    """Marks a hook of a body's record, above ``hook``: ``of_shape`` replaces it unless all are discs."""
    return with_field("left", of_shape)


def unchecked(function: F) -> F:
    """Marks a hook that needs no checks, above ``hook``: it runs faster, but an error in it may corrupt
    memory.

    Its tables are not NumPy's arrays but the loop's own views (``kernel.compiled.views``): to be read and
    written by an index from 0, sliced, iterated over, with ``len``. An index below 0 is not counted from the
    end, nor noticed. Numbers of bodies that ``near``, ``repair`` and ``soonest`` return are not compared with
    the number of bodies. Have the conformance kit judge the hook without this mark first.
    """
    cast(Any, function).is_unchecked = True
    return function


def names_any(value: Any, constants: Mapping[str, object]) -> bool:
    """Returns True if a value is a hook that names a constant, or calls a hook that does."""
    if not is_hook(value):
        return False
    code, names = python_of(value).__code__, python_of(value).__globals__
    return any(name in constants or names_any(names.get(name), constants) for name in code.co_names)


def with_constants(hooks: Iterable[Hook], **constants: object) -> dict[str, Any]:
    """Returns hooks by their names, with these constants in place of global names; a hook that calls others
    comes after them, and calls the new ones.

    A branch on a name of the module, like ``if PERIODIC:``, is decided when the hook is compiled. So one text
    serves several kinds of scenes, and a loop has no code for absent features. Raises TypeError for a
    constant that no hook names, and for a hook that calls another one outside the list with such a constant.
    """
    hooks = list(hooks)
    used = {name for each in hooks for name in python_of(each).__code__.co_names}
    if unused := sorted(constants.keys() - used):
        raise TypeError(f"no hook names {', '.join(unused)}")
    made: dict[str, Any] = dict(constants)
    for each in hooks:
        usual = python_of(each)
        for name in usual.__code__.co_names:
            if name not in made and names_any(usual.__globals__.get(name), constants):
                raise TypeError(
                    f"{usual.__name__} calls {name}, which is not listed before it, with a constant"
                )
        code, names = usual.__code__, usual.__globals__ | made
        again = hook(FunctionType(code, names, usual.__name__, usual.__defaults__, usual.__closure__))
        made[usual.__name__] = again if is_checked(each) else unchecked(again)
    return made


_EMPTY = (
    *(lambda k, a: None, lambda k, a, b: None, lambda k, a, b, c: None),
    *(lambda k, a, b, c, d: None, lambda k, a, b, c, d, e: None),
)
NOTHING = {each.__code__.co_argcount: unchecked(hook(each)) for each in _EMPTY}
"""Hooks that do nothing, by their number of arguments."""


def is_checked(value: Any) -> bool:
    """Returns True if a value is a hook that is not marked with ``unchecked``."""
    return is_hook(value) and not getattr(value, "is_unchecked", False)


def subroutine(function: F) -> F:
    """Marks a function that functions marked ``apart`` call: compiled once, not inlined, arrays and all."""
    options = {**_HOOK, "forceinline": False}
    return cast(F, _Subroutine(function, targetoptions=options, pipeline_class=LinkingCompiler))


@hook
def smaller(a: Any, b: Any) -> Any:
    """Returns the smaller of two numbers. Numba's ``min`` is not inlined into large functions."""
    return a if a < b else b


@hook
def larger(a: Any, b: Any) -> Any:
    """Returns the larger of two numbers."""
    return a if a > b else b


def python_of(part: Any) -> Any:
    """Returns the Python function of a hook, to be called without compilation; any other part unchanged."""
    return getattr(part, "py_func", part)


def is_hook(value: Any) -> bool:
    """Returns True if a value is a function marked with ``hook``."""
    return hasattr(value, "py_func")


def _kind(annotation: Any) -> Any:
    kinds = {float: types.float64, int: types.int64, Numbers: types.CPointer(types.float64)}
    if annotation in kinds:
        return kinds[annotation]
    fields = get_type_hints(annotation)
    return types.BaseTuple.from_types([_kind(each) for each in fields.values()], annotation)


class _Apart:
    """A function that compiled code calls by name only; it is loaded before such code."""

    def __init__(self, function: FunctionType) -> None:
        digest, _ = fingerprint(function, tuple)
        self.function = function
        self.name = f"kinetile_{function.__name__}_{digest}"
        *kinds, result = (_kind(each) for each in get_type_hints(function).values())
        self.signature = result(*kinds)
        self.address: int | None = None

    def load(self) -> None:
        """Compiles the function, or loads it from the disk cache, and registers its name."""
        if self.address is None:
            source = self.function
            named = FunctionType(source.__code__, source.__globals__, source.__name__)
            named.__module__ = source.__module__
            named.__qualname__ = self.name
            # kept, or its code would go
            self.made = backend.at_an_address(named, self.signature, CheckedCache)
            self.address = int(self.made.address)
            backend.add_symbol(self.name, self.address)

    def typed(self, *given: Any) -> Any:
        self.load()
        return self.signature

    def call(self, context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        """Returns the code of a call. Named tuples are passed as values, as the function takes them."""
        kinds = [context.get_value_type(each) for each in (signature.return_type, *signature.args)]
        made = ir.FunctionType(kinds[0], kinds[1:])
        known = backend.cgutils.get_or_insert_function(builder.module, made, self.name)
        return builder.call(known, arguments)


def apart(function: F) -> F:
    """Marks a function that hooks call without inlining it: compiled once for all loops, cached separately.

    It takes and returns numbers, which its annotations call ``float`` or ``int``, and takes arrays of
    doubles, ``Numbers``, as ``pointer`` makes them, and named tuples of all these.
    """
    known = _Apart(cast(FunctionType, function))
    names = inspect.signature(function).parameters
    made = backend.lowered(function.__name__, names, known.typed, known.call)
    made.py_func, made.known = function, known
    APART[known.name] = known.load
    return cast(F, backend.both(function)(made))
