"""The composer: puts a loop together from a template and hooks, compiles it, and caches it on disk.

Numba reports an error in a hook with the whole way from the loop down to it, once forwards and once
backwards. Its first sentence and the first place are what an author can do something about: ``complaint``
makes one sentence of them, with the author's own file and line.
"""

from __future__ import annotations

import logging
import re
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from copy import copy
from functools import cache, partial
from inspect import getattr_static
from itertools import chain, pairwise
from pathlib import Path
from types import FunctionType
from typing import Any, cast

import numpy as np

from kinetile.errors import printable
from kinetile.kernel.compiled.fingerprint import fingerprint
from kinetile.kernel.compiled.hooks import INTERPRETED, hook, is_checked, uncollected
from kinetile.kernel.compiled.views import wrapping

if not INTERPRETED:
    from kinetile.kernel.compiled import backend
    from kinetile.kernel.compiled.cache import CheckedCache, dropped_together, is_whole
    from kinetile.kernel.compiled.views import ViewModel, packed_kind
else:
    from kinetile.kernel.compiled.views import quick


class NotCompiled(Exception):
    """The compiler refuses a hook; the message says what, and where."""


def compose(
    template: Callable[..., Any], parts: Mapping[str, Any], label: str, state: type
) -> Callable[..., Any]:
    """Compiles ``template`` with ``parts`` in place of its global names: once a process, and cached on disk.

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
    given = {name: with_numpy(part) if is_checked(part) else part for name, part in parts.items()}
    function = _filled_in(source, given, {})
    if INTERPRETED:
        return function
    digest, modules, called = fingerprint(function, state)
    function.__qualname__ = f"{source.__name__}_{label}_{digest}"
    if "__main__" not in modules:
        with suppress(RuntimeError):  # there is no folder that Numba could write its cache to
            return _njit(function, True, called)
    return _njit(function, False, called)


@cache
def with_numpy(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a hook that calls a hook with NumPy's arrays in place of views."""
    if INTERPRETED:
        return function

    @hook
    def call(*given: Any) -> Any:
        return function(*wrapping(given))

    return call


def _filled_in(source: FunctionType, parts: Mapping[str, Any], made: dict[str, Any]) -> FunctionType:
    """Returns a function with parts in place of its global names, and of those of the templates it calls."""
    names = {**source.__globals__, **parts}
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


def _njit(function: Callable[..., Any], cache: bool, called: list[Any]) -> _Composed:
    def with_what_it_calls(compiles: Callable[[Any], Any], signature: Any) -> Any:
        with _compiling(), dropped_together(), warnings.catch_warnings():
            # A hook that takes a body has one form for discs and one, with more fields, for shapes. Numba
            # takes the right one, and warns that it has looked at the other.
            warnings.simplefilter("ignore", backend.NumbaExperimentalFeatureWarning)
            for each in called:
                each.load_apart()
            return compiles(signature)

    return _Composed(backend.entry(function, CheckedCache if cache else None, with_what_it_calls))


class Packed:
    """Tables, a named tuple of arrays, as compiled code takes them: the address of a row of words for each
    array, where it begins, its lengths and its steps. Numba takes 6 us to read the tuple."""

    def __init__(self, tables: Any) -> None:
        self.tables = tables
        key = _kind(tables)
        if key not in _kinds:  # Numba takes milliseconds for this
            _kinds[key] = packed_kind(tables)
        self.kind = _kinds[key]
        self._take([_words_of(each) for each in tables])

    def _take(self, rows: list[tuple[int, ...]]) -> None:
        self._rows, self._words = rows, np.array([*chain.from_iterable(rows)], dtype=np.int64)
        self.address = _address(self._words)

    def replaced(self, name: str, table: Any) -> Packed:
        """Returns the same tables but for one, which is to be of the same kind."""
        other, rows = copy(self), self._rows.copy()
        rows[self.tables._fields.index(name)] = _words_of(table)
        other.tables = self.tables._replace(**{name: table})
        other._take(rows)
        return other


_kinds: dict[tuple[Any, ...], Any] = {}


def packed(tables: Any) -> Any:
    """Returns tables as a composed function takes them, for many calls; they stay the same arrays."""
    return quick(tables) if INTERPRETED else Packed(tables)


def replaced(tables: Any, name: str, table: Any) -> Any:
    """Returns packed tables with another one, of the same kind, in the place of one of them."""
    return tables._replace(**{name: quick(table)}) if INTERPRETED else tables.replaced(name, table)


def bound(function: Callable[..., Any], *tables: Any, given: Iterable[Any]) -> Callable[..., Any]:
    """Returns a composed function of packed tables, and of other values, as one of such values as ``given``
    alone. The caller keeps the tables."""
    if INTERPRETED:
        return np.errstate(all="ignore")(partial(function, *tables))  # compiled, nothing warns
    entry = cast(_Composed, function).entry([*tables, *given])
    addresses = [each.address for each in tables]

    def run_bound(*given: Any) -> Any:  # a frame of this file: who dies in here has died in compiled code
        return entry(*addresses, *given)

    return run_bound


def _address(array: Any) -> int:
    return int(array.ctypes.data)


def _words_of(table: Any) -> tuple[int, ...]:
    plain = np.asarray(table)
    return _address(plain), *plain.shape, *plain.strides


class _Composed:
    """A composed function that Python calls. Its machine code is called without Numba's dispatcher, which
    derives the types of all arrays at each call."""

    def __init__(self, made: Any) -> None:
        self.made = made
        self.__qualname__ = made.__qualname__
        self._entries: dict[tuple[Any, ...], Any] = {}

    def __call__(self, *given: Any) -> Any:
        taken = [_as_taken(each) for each in given]
        return self.entry(taken)(*[each.address if type(each) is Packed else each for each in taken])

    def entry(self, taken: list[Any]) -> Any:
        key = tuple([each.kind._code if type(each) is Packed else _kind(each) for each in taken])
        if key not in self._entries:
            kinds = [each.kind if type(each) is Packed else backend.numba.typeof(each) for each in taken]
            self._entries[key] = self.made.compile(tuple(kinds))
        return self._entries[key]


def _as_taken(given: Any) -> Any:
    is_tables = isinstance(given, tuple) and all(isinstance(each, np.ndarray) for each in given)
    return Packed(given) if is_tables else given


_spent = 0.0
_meanwhile: Callable[[], AbstractContextManager[Any]] = nullcontext


SLOW = 1.0
"""CPU seconds of a compilation from which the log ``kinetile`` tells of it, at the level of information."""


@contextmanager
def _compiling() -> Iterator[None]:
    """Counts the processor time of what is compiled, or loaded, within this context."""
    global _spent
    began = time.process_time()
    with _meanwhile():
        try:
            yield
        finally:
            took = time.process_time() - began
            _spent += took
            if took >= SLOW:
                logging.getLogger("kinetile").info("compiled in %.1f CPU seconds", took)


def compiling_seconds() -> float:
    """Returns the processor time spent so far on compiling composed functions, or loading them from disk."""
    return _spent


def while_compiling(context: Callable[[], AbstractContextManager[Any]]) -> None:
    """Enters a context whenever a composed function is compiled or loaded. A runner that limits the CPU time
    of this process uses it to leave compilation out."""
    global _meanwhile
    _meanwhile = context


def make_ready(function: Callable[..., Any], *arguments: Any) -> None:
    """Compiles a composed function for such arguments, or loads it from the disk cache, without running it.

    Raises NotCompiled where a hook is not such as can be compiled.
    """
    if INTERPRETED:
        return
    with uncollected():
        try:
            cast(_Composed, function).entry([_as_taken(each) for each in arguments])
        except Exception as error:  # Numba lets errors of all types through
            raise NotCompiled(complaint(error)) from error


def _kind(argument: Any) -> tuple[Any, ...]:
    """Returns what the machine code depends on in an argument: types, and of arrays how they lie."""
    if isinstance(argument, tuple):
        return type(argument), *(_kind(each) for each in argument)
    if isinstance(argument, np.ndarray):
        plain = np.asarray(argument)  # attributes of an array of records take ten times as long
        flags, dtype = plain.flags, plain.dtype
        if id(dtype) not in _known:  # to compare two with many fields takes long
            if len(_known) > _MOST_KNOWN:
                _known.clear()
            _known[id(dtype)] = dtype, _numbers.setdefault(dtype, len(_numbers))
        lie = flags.c_contiguous, flags.f_contiguous, flags.aligned, flags.writeable
        return type(argument), _known[id(dtype)][1], plain.ndim, *lie
    return (type(argument),)


_numbers: dict[Any, int] = {}
_known: dict[int, tuple[Any, int]] = {}
"""Element types by their addresses, each kept, with its number: equal ones have the same."""

_MOST_KNOWN = 10_000


def is_cached(function: Callable[..., Any]) -> bool | None:
    """Whether a composed function's machine code lies whole in the disk cache; None if it is interpreted."""
    if INTERPRETED:
        return None
    folder = Path(cast(_Composed, function).made.stats.cache_path or ".")
    files = [*folder.glob(f"*{function.__qualname__}*.nb[ic]")]
    return any(file.suffix == ".nbi" for file in files) and all(f.is_file() and is_whole(f) for f in files)


PLACE = re.compile(r'^File "(?P<file>.*)", line (?P<line>\d+):$')
STEP = re.compile(r"^(Failed in nopython mode pipeline|During: |<source elided>|\s*\^)")
PLAIN = re.compile(r"Untyped global name '(?P<name>\w+)': .* type of <class 'function'>")
RECORD = re.compile(r"Record\([^)]*\)")


def complaint(error: Exception) -> str:
    """Returns what the compiler says, with the place; some of its errors do not say where, but it knows."""
    text = brief(str(error))
    if text != str(error):
        return text
    text = f"{type(error).__name__}: {RECORD.sub('records', text)}"
    if ViewModel.__name__ in text:
        text = (
            "an array in an unchecked hook has indices from 0, slices, len and iteration, and nothing else "
            "of NumPy: leave out the mark toolbox.unchecked"
        )
    return f"{text}{_place(error)}"


def _place(error: Exception) -> str:
    """Returns the file and line at which the compiler was: its innermost frame but for Numba's own code."""
    found, trace = "", error.__traceback__
    while trace is not None:
        for value in list(trace.tb_frame.f_locals.values()):
            loc = getattr_static(value, "loc", None)  # some values raise an error of their own for a name
            file, line = getattr_static(loc, "filename", None), getattr_static(loc, "line", None)
            if isinstance(file, str) and isinstance(line, int) and not file.startswith(backend.FOLDER):
                found = f" ({file}, line {line})"
        trace = trace.tb_next
    return found


def brief(message: str) -> str:
    """Returns what is wrong, where, and in which line of code; the message itself where it has no place."""
    lines = message.strip().splitlines()
    places = [at for at, line in enumerate(lines) if PLACE.match(line)]
    if not places:
        return RECORD.sub("records", message)
    text = " ".join(line.strip() for line in lines[: places[0]] if line.strip() and not STEP.match(line))
    plain = PLAIN.search(text)
    if plain is not None:
        text = f"{plain['name']} is a plain function, and hooks call only hooks: mark it with toolbox.hook"
    if "Cannot modify readonly array" in text:
        text = "a hook changes an array of its module, which is a constant for it: only state can change"
    text = printable(text.partition(" There are ")[0], 250)
    file, number = PLACE.findall(lines[places[0]])[0]
    return f"{RECORD.sub('records', text)} ({file}, line {number}){_code(lines[places[0] + 1 :])}"


def _code(lines: list[str]) -> str:
    """Returns the line of code above the first caret, after a colon; "" without a caret."""
    for above, line in pairwise(lines):
        if line.strip() == "^":
            return f": {printable(above.strip(), 80)}"
        if not above.strip():
            break
    return ""
