"""The fingerprint of compiled code: its name in the cache, so that any change in the code is a new name.

Numba's own cache compares one file's date only, and would serve old machine code after a change in a phase.
"""

import hashlib
import os
import sys
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

APART: dict[str, Callable[[], None]] = {}
"""Loaders of the functions that machine code calls by their names, which end with their fingerprints."""


def fingerprint(function: Callable[..., Any], state: type) -> tuple[str, set[str]]:
    """Returns a digest of a function and of everything that it reaches, also through a module (bytecode,
    constants, hooks, values of globals, Numba's options), and the modules that this was found in."""
    found = _Found()
    found.visit(function)
    found.visit(state)
    return found.digest.hexdigest()[:16], found.modules


class _Found:
    """The values that a function reaches, as found so far, each value once, in the order of the code."""

    def __init__(self) -> None:
        self.digest = hashlib.sha256(repr((sys.version, np.__version__, API, _options())).encode())
        self.digest.update(_sources())
        self.seen: set[int] = set()
        self.modules: set[str] = set()

    def visit(self, value: Any) -> None:
        # An intrinsic's code is within its builder, except the code of functions marked ``apart``.
        if hasattr(value, "_defn") and not hasattr(value, "known"):
            value = value._defn
        if hasattr(value, "py_func"):
            self.digest.update(type(value).__name__.encode())  # inlined or called: other machine code
            value = value.py_func
        if isinstance(value, FunctionType | type):
            self.modules.add(value.__module__)
            self.digest.update(f"{value.__module__}.{value.__qualname__}".encode())
            self.digest.update(
                repr((getattr(value, "_fields", ()), getattr(value, "__members__", ()))).encode()
            )
        if isinstance(value, FunctionType):
            if id(value) in self.seen:
                return
            self.seen.add(id(value))
            documented = value.__doc__ is not None and value.__code__.co_consts[:1] == (value.__doc__,)
            self.code(value.__code__, value.__globals__, documented)
            for cell in value.__closure__ or ():
                self.visit(cell.cell_contents)
            self.visit(value.__defaults__)
        elif isinstance(value, ModuleType):
            self.digest.update(value.__name__.encode())
        elif isinstance(value, tuple | list):
            self.digest.update(f"{len(value)}(".encode())
            for item in value:
                self.visit(item)
        elif isinstance(value, np.ndarray):
            self.digest.update(repr((value.dtype, value.shape)).encode() + value.tobytes())
        elif callable(value):
            self.digest.update(getattr(value, "__name__", type(value).__name__).encode())
        else:
            self.digest.update(repr(value).encode())

    def code(self, block: CodeType, names: Mapping[str, Any], documented: bool = False) -> None:
        self.digest.update(block.co_code)
        self.digest.update(repr(block.co_varnames).encode())
        # A docstring is the first constant, and makes no machine code: new words compile nothing again.
        for constant in block.co_consts[1:] if documented else block.co_consts:
            if isinstance(constant, CodeType):
                self.code(constant, names)
            else:
                self.digest.update(repr(constant).encode())
        modules: list[ModuleType] = []
        # If pytest has rewritten an assertion, names with "@" lead to objects of its own.
        own = [name for name in block.co_names if not name.startswith("@")]
        for name in own:  # in the order of the code: package, module in it, function in that
            for value in (names.get(name), *(getattr(module, name, None) for module in modules)):
                if isinstance(value, ModuleType) and value not in modules and not _foreign(value):
                    modules.append(value)
        for name in own:
            self.digest.update(name.encode())
            if name in names:
                self.visit(names[name])
            for module in modules:
                if hasattr(module, name):
                    self.visit(getattr(module, name))


def _options() -> list[tuple[str, str]]:
    """Returns the options of Numba in the environment, except those on places or threads."""
    others = "NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS"
    given = os.environ.items()
    return sorted(each for each in given if each[0].startswith("NUMBA_") and each[0] not in others)


@cache
def _sources() -> bytes:
    """Returns a digest of the files that control Numba's compilation, without being named in a hook."""
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for source in ("backend.py", "hooks.py", "views.py", "../vectors/intrinsics.py"):
        digest.update((here / source).read_bytes())
    return digest.digest()


def _foreign(module: ModuleType) -> bool:
    """Returns True if a module changes only with versions: Python's, NumPy's, Numba's, llvmlite's."""
    root = module.__name__.partition(".")[0]
    return root in sys.stdlib_module_names or root in ("numpy", "numba", "llvmlite")


API = 3
"""Raised when the kernel's tables change in a way that bytecode does not show, or the cache's files do."""
