"""The composer: puts a loop together from a template and hooks, runs it as Python or compiles it, and caches
its machine code on disk.

Called from Python a hook is its Python function, so a composed function is one too, of the same arrays.
Compiling a loop takes some ten seconds. So it first runs as Python until that has taken a second, unless its
machine code is on the disk, or Python would take as long as the compiler for so many bodies.

Numba reports an error in a hook with the whole path from the loop down to it, once forwards and once
backwards. An author needs only its first sentence and its first place: ``complaint`` makes one sentence of
them, with the author's own file and line.
"""

import logging
import os
import re
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from copy import copy
from functools import cache, cached_property, partial
from inspect import getattr_static
from itertools import chain, pairwise
from pathlib import Path
from types import FunctionType
from typing import Any, cast

import numpy as np

from kinetile.errors import printable
from kinetile.kernel.compiled import backend
from kinetile.kernel.compiled.cache import CheckedCache, dropped_together, is_whole
from kinetile.kernel.compiled.fingerprint import fingerprint
from kinetile.kernel.compiled.hooks import NOTHING, hook, is_checked, python_of, uncollected
from kinetile.kernel.compiled.plain import quick
from kinetile.kernel.compiled.views import ViewModel, packed_kind, wrapping
from kinetile.kernel.features import Feature

NOTHING_IS_COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
"""Whether nothing is compiled in this process."""

WORTH = 1.0
"""A composed function is compiled when it has taken this many CPU seconds as Python."""

FEW_BODIES = 1_100
"""The most bodies for running as Python first. Building the structure of so many takes up to 6 CPU seconds
(``naive``; ``cells`` .2), which grow with their square, and the compiler takes 9."""

_default: bool | None = None


def default() -> bool | None:
    """Returns the default mode of compilation: True, before the function runs; False, never; None, when it
    pays."""
    return _default


@contextmanager
def compiled_by_default(compiled: bool | None) -> Iterator[None]:
    """Sets ``default`` within this context, for all threads."""
    global _default
    before, _default = _default, compiled
    try:
        yield
    finally:
        _default = before


def as_python() -> bool:
    """Returns True if everything runs as Python now by default."""
    return NOTHING_IS_COMPILED or _default is False


class NotCompiled(Exception):
    """The compiler refuses a hook; the message names the fault and the place."""


def compose(
    template: Callable[..., Any], parts: Mapping[str, Any], label: str, state: type
) -> Callable[..., Any]:
    """Returns ``template`` with ``parts`` in place of its global names: one function a process.

    ``template`` is a plain function; ``parts`` maps names it uses, itself or in a ``template`` that it calls,
    to hooks and constants, among them every feature that these name; ``label`` names the choice of phases in
    the cache. The result runs as Python until that has taken a second, is compiled then, and its machine code
    is kept on disk.
    """
    key = (template, label, state, *sorted(parts.items(), key=lambda part: part[0]))
    if key not in _composed:
        _composed.setdefault(key, _compose(template, parts, label, state))  # another thread may do the same
    return _composed[key]


_composed: "dict[tuple[Any, ...], _Composed]" = {}


def _compose(template: Callable[..., Any], parts: Mapping[str, Any], label: str, state: type) -> "_Composed":
    given = {name: with_numpy(part) if is_checked(part) else part for name, part in parts.items()}
    return _Composed(_filled_in(cast(FunctionType, template), given, {}), label, state)


@cache
def with_numpy(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a hook that calls a hook with NumPy's arrays in place of views."""

    @hook
    def call(*given: Any) -> Any:
        return function(*wrapping(given))

    return call


def _filled_in(source: FunctionType, parts: Mapping[str, Any], made: dict[Any, Any]) -> FunctionType:
    """Returns a function with parts in place of its global names and those in templates it calls."""
    names = {**source.__globals__, **parts}
    function = FunctionType(source.__code__, names, source.__name__, source.__defaults__, source.__closure__)
    function.__module__ = source.__module__
    function.__qualname__ = source.__qualname__
    function.__doc__ = source.__doc__
    for name in source.__code__.co_names:
        value: Any = names.get(name)
        feature = value.name if isinstance(value, Feature) else getattr(value, "feature", None)
        if feature is not None and feature not in parts:
            raise TypeError(f"{source.__name__} is composed without a value of {feature}")
        if hasattr(value, "feature") and not parts[value.feature]:
            names[name] = NOTHING[python_of(value).__code__.co_argcount]
        elif getattr(value, "is_template", False):
            if value not in made:
                made[value] = hook(_filled_in(cast(FunctionType, value), parts, made))
            names[name] = made[value]
    return function


class Packed:
    """Tables, a named tuple of arrays, in the form for compiled code: the address of a row of words for each
    array, its address, lengths and steps. Numba takes 6 us to read the tuple."""

    def __init__(self, tables: Any) -> None:
        self.tables = tables
        self._take([_words_of(each) for each in tables])

    def _take(self, rows: list[tuple[int, ...]]) -> None:
        self._rows, self._words = rows, np.array([*chain.from_iterable(rows)], dtype=np.int64)
        self.address = _address(self._words)

    @cached_property
    def kind(self) -> Any:
        """Their type for Numba, which takes milliseconds to find it."""
        key = _kind(self.tables)
        if key not in _kinds:
            _kinds[key] = packed_kind(self.tables)
        return _kinds[key]

    @cached_property
    def plain(self) -> Any:
        """The same tables in the form for Python code."""
        return quick(self.tables)

    def replaced(self, name: str, table: Any) -> "Packed":
        """Returns the same tables except one, which must have the same type."""
        other, rows = copy(self), self._rows.copy()
        vars(other).pop("plain", None)
        rows[self.tables._fields.index(name)] = _words_of(table)
        other.tables = self.tables._replace(**{name: table})
        other._take(rows)
        return other


_kinds: dict[tuple[Any, ...], Any] = {}


def bound(
    function: Callable[..., Any], *tables: Packed, given: Iterable[Any], compiled: bool
) -> Callable[..., Any]:
    """Returns a composed function of packed tables and other values as one of such values as ``given`` alone:
    its machine code, or Python. The caller keeps the tables."""
    made = cast(_Composed, function)
    if not compiled:
        return partial(made.as_python, *tables)
    entry = made.entry([*tables, *given])
    addresses = [each.address for each in tables]

    def run_bound(*given: Any) -> Any:  # a frame of this file: a crash in it is one in compiled code
        return entry(*addresses, *given)

    return run_bound


def _address(array: Any) -> int:
    return int(array.ctypes.data)


def _words_of(table: Any) -> tuple[int, ...]:
    plain = np.asarray(table)
    return _address(plain), *plain.shape, *plain.strides


class _Composed:
    """A composed function: Python, until compiling it pays. Its machine code is called without Numba's
    dispatcher, which derives the types of all arrays at each call.

    Attributes:
        spent: processor time that it has taken as Python.
        stays: whether it stays Python: its hooks cannot be compiled.
        meanwhile: the process that compiles it into the disk cache, or None; it ``runs`` or does not.
    """

    def __init__(self, python: FunctionType, label: str, state: type) -> None:
        self._python, self._state = python, state
        self._entries: dict[tuple[Any, ...], Any] = {}
        self.__qualname__ = f"{python.__name__}_{label}"
        self.spent = self._looks_at = 0.0
        self._is_there = False
        self.stays = NOTHING_IS_COMPILED
        self.meanwhile: Any = None

    def __call__(self, *given: Any) -> Any:
        taken = [_as_taken(each) for each in given]
        if not self.is_worth(taken):
            return self.as_python(*taken)
        try:
            entry = self.entry(taken)
        except Exception as error:  # Numba lets errors of all types through
            self.stay(complaint(error))
            return self.as_python(*taken)
        return entry(*[each.address if type(each) is Packed else each for each in taken])

    def as_python(self, *taken: Any) -> Any:
        """Calls the Python function with packed tables and other values."""
        began = time.thread_time()
        try:
            with np.errstate(all="ignore"):  # compiled, nothing warns
                return self._python(*[each.plain if type(each) is Packed else each for each in taken])
        finally:
            self.spent += time.thread_time() - began

    def stay(self, why: str) -> None:
        """Keeps the function as Python, with a warning."""
        self.stays = True
        logging.getLogger("kinetile").warning("kinetile: %s; it runs as Python", why)

    def is_worth(self, taken: Iterable[Any]) -> bool:
        """Returns True if machine code exists, or compiling it pays now."""
        if self.stays or self._entries or _default is not None:
            return not self.stays and _default is not False
        waits = self.spent < WORTH or (self.meanwhile is not None and self.meanwhile.runs)
        if waits and all(_is_small(each) for each in taken):
            if self.spent >= self._looks_at:
                self._looks_at = self.spent + WORTH / 10  # another process may have made it
                self._is_there = bool(is_cached(self))
            return self._is_there
        return True

    @cached_property
    def made(self) -> Any:
        """Numba's function, which compiles it, or loads it from the disk cache."""
        digest, modules = fingerprint(self._python, self._state)
        self._python.__qualname__ = f"{self.__qualname__}_{digest}"

        def quietly(compiles: Callable[[Any], Any], signature: Any) -> Any:
            with _compiling(), dropped_together(), warnings.catch_warnings():
                # A hook that takes a body has one form for discs and one, with more fields, for shapes. Numba
                # takes the right one, and warns that it has looked at the other.
                warnings.simplefilter("ignore", backend.NumbaExperimentalFeatureWarning)
                return compiles(signature)

        cache = None if "__main__" in modules else CheckedCache
        return backend.entry(self._python, cache, quietly)

    def entry(self, taken: list[Any]) -> Any:
        """Returns the machine code for such arguments."""
        key = tuple([each.kind._code if type(each) is Packed else _kind(each) for each in taken])
        if key not in self._entries:
            kinds = [each.kind if type(each) is Packed else backend.numba.typeof(each) for each in taken]
            self._entries[key] = self.made.compile(tuple(kinds))
        return self._entries[key]


def _is_small(given: Any) -> bool:
    clock = getattr(given.tables, "clock", None) if type(given) is Packed else None
    return clock is None or int(clock["present"][0]) <= FEW_BODIES


def _as_taken(given: Any) -> Any:
    is_tables = isinstance(given, tuple) and all(isinstance(each, np.ndarray) for each in given)
    return Packed(given) if is_tables else given


_spent = 0.0
_meanwhile: Callable[[], AbstractContextManager[Any]] = nullcontext


SLOW = 1.0
"""The least CPU seconds of a compilation that the log ``kinetile`` reports, at the level of information."""


@contextmanager
def _compiling() -> Iterator[None]:
    """Counts the processor time of compiling and loading within this context."""
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

    Raises NotCompiled if a hook cannot be compiled.
    """
    if NOTHING_IS_COMPILED:
        return
    with uncollected():
        try:
            cast(_Composed, function).entry([_as_taken(each) for each in arguments])
        except Exception as error:  # Numba lets errors of all types through
            raise NotCompiled(complaint(error)) from error


def _kind(argument: Any) -> tuple[Any, ...]:
    """Returns the part of an argument that the machine code depends on: types, and the layout of arrays."""
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
    """Returns True if all of a function's machine code is on the disk; None if nothing is compiled."""
    if NOTHING_IS_COMPILED:
        return None
    made = cast(_Composed, function).made
    files = [*Path(made.stats.cache_path or ".").glob(f"*{made.py_func.__qualname__}*.nb[ic]")]
    suffixes = {file.suffix for file in files}  # the index is written first
    return suffixes == {".nbi", ".nbc"} and all(f.is_file() and is_whole(f) for f in files)


FILE_AND_LINE = re.compile(r'^File "(?P<file>.*)", line (?P<line>\d+):$')
STEP = re.compile(r"^(Failed in nopython mode pipeline|During: |<source elided>|\s*\^)")
UNTYPED_NAME = re.compile(r"Untyped global name '(?P<name>\w+)': .* type of <class 'function'>")
RECORD = re.compile(r"Record\([^)]*\)")


def complaint(error: Exception) -> str:
    """Returns the compiler's message with the place; some of its errors have a place, but do not print it."""
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
    """Returns the file and line that the compiler was at: its innermost frame outside of Numba's own code."""
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
    """Returns the fault, the place and its line of code; the message itself if it has no place."""
    lines = message.strip().splitlines()
    places = [at for at, line in enumerate(lines) if FILE_AND_LINE.match(line)]
    if not places:
        return RECORD.sub("records", message)
    text = " ".join(line.strip() for line in lines[: places[0]] if line.strip() and not STEP.match(line))
    plain = UNTYPED_NAME.search(text)
    if plain is not None:
        text = f"{plain['name']} is a plain function, and hooks call only hooks: mark it with toolbox.hook"
    if "Cannot modify readonly array" in text:
        text = "a hook changes an array of its module, which is a constant for it: only state can change"
    text = printable(text.partition(" There are ")[0], 250)
    file, number = FILE_AND_LINE.findall(lines[places[0]])[0]
    return f"{RECORD.sub('records', text)} ({file}, line {number}){_code(lines[places[0] + 1 :])}"


def _code(lines: list[str]) -> str:
    """Returns the line of code above the first caret, after a colon; "" without a caret."""
    for above, line in pairwise(lines):
        if line.strip() == "^":
            return f": {printable(above.strip(), 80)}"
        if not above.strip():
            break
    return ""
