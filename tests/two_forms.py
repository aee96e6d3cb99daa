"""Hooks called from tests: in machine code, or in both forms that they have in one process, compared."""

import copy
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from kinetile.kernel.compiled import NOTHING_IS_COMPILED, compiled_by_default, composer, pointer, python_of


def compiled(asked: Callable[..., Any], first: str = "{}") -> Callable[..., Any]:
    """Returns a hook as a function that runs in machine code; ``first`` makes the hook's first argument."""
    names = [*inspect.signature(python_of(asked)).parameters]
    called = ", ".join([first.format(names[0]), *names[1:]])
    code = compile(f"lambda {', '.join(names)}: asked({called})", __file__, "eval")
    template = eval(code, {"pointer": pointer, "asked": asked, "__name__": __name__})
    if NOTHING_IS_COMPILED:
        return template
    made = composer._compose(template, {"asked": asked}, python_of(asked).__name__, tuple)
    return compiled_by_default(True)(made.__call__)


def both_ways(asked: Callable[..., Any], first: str = "{}") -> Callable[..., Any]:
    """Returns a hook as a function that compares its results and writes as Python and in machine code, bit
    for bit; NaNs are equal, and types are not compared."""
    machine = compiled(asked, first)

    def compared(*given: Any) -> Any:
        twin, (one, *rest) = copy.deepcopy(given), given
        with np.errstate(all="ignore"):
            found = asked(one[0] if first == "{}[0]" else one, *rest)
        assert _bits((machine(*twin), twin)) == _bits((found, given))
        return found

    return compared


def _bits(value: Any) -> Any:
    if isinstance(value, tuple):
        return [*map(_bits, value)]
    plain = np.asarray(value)
    if plain.dtype == np.float64:
        return np.where(np.isnan(plain), np.nan, plain).tobytes()
    return plain.tolist() if plain.dtype.names is None else plain.tobytes()
