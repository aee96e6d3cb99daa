"""The requirements of each value of a scene, by its name: its type, its range, and the sentence about both;
for arguments of ``Scene``, scene files, commands, calls of a simulation, and saved runs. Other modules, which
have several values, check their relations."""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kinetile.arrays import Integers
from kinetile.errors import Mistake
from kinetile.kernel.clock import LONGEST_UNIT, TICKS
from kinetile.scene.checks import (
    LARGEST,
    RANGE,
    REACH,
    SMALLEST,
    as_kind,
    is_finite,
    is_kind,
    is_number,
    shown,
)


def is_float(value: Any) -> bool:
    """Returns True if a value of a file is a number of float64's range, or nan."""
    return isinstance(value, float) or (type(value) is int and value.bit_length() < 1024)


def is_whole(value: Any) -> bool:
    """Returns True if a value of a file is a whole number that arrays can hold."""
    return type(value) is int and abs(value) <= 2**62


def is_list(value: Any, form: Callable[[Any], bool] | None = None, length: int | None = None) -> bool:
    """Returns True if a value of a file is a list, of ``length`` values of this form."""
    right = isinstance(value, list) and length in (None, len(value))
    return right and (form is None or all(map(form, value)))


def is_pair(value: Any) -> bool:
    """Returns True if a value of a file is two numbers."""
    return is_list(value, is_float, 2)


@dataclass(frozen=True)
class Value:
    """A value: ``what`` it is in words, its ``form`` in files, which further reading needs, and the test
    ``fit``; a number from ``least`` to ``most``, or 2**200, in words ``within``."""

    what: str
    form: type | Callable[[Any], bool] = is_float
    fit: Callable[[Any], bool] = is_finite
    plain: Callable[[Any], Any] = float
    within: str = ""
    least: float = -LARGEST
    most: float = LARGEST

    def has_form(self, value: Any) -> bool:
        """Returns True if a value of a file is of this type."""
        return isinstance(value, self.form) if isinstance(self.form, type) else self.form(value)

    def holds(self, numbers: Any) -> Any:
        """Returns True if a number is in the range; elementwise for an array."""
        return (numbers >= self.least) & ((numbers <= LARGEST) | (numbers == self.most))

    def expected(self, value: Any) -> str:
        """Returns the text after "expected" for a wrong value; "" if it is right."""
        if not self.fit(value):
            return self.what
        each = value if self.within and hasattr(value, "__iter__") else [value]
        return self.within if self.within and not all(map(self.holds, each)) else ""

    def mistakes(self, value: Any, where: str) -> list[Mistake]:
        """Returns the mistake of a value at a place, if it is wrong."""
        expected = self.expected(value)
        found = list(value) if isinstance(value, tuple) and self.form is is_pair else value  # as in files
        return [Mistake(where, shown(found), expected)] if expected else []


def body_numbers(bodies: Any) -> Integers:
    """Returns the numbers of bodies, -1 for numbers below 0; TypeError for anything else."""
    try:
        numbers = np.asarray(bodies)
    except ValueError:  # rows of different lengths
        numbers = np.array([None])
    if (numbers.dtype.kind not in "iu" and numbers.size) or isinstance(bodies, bytearray):
        raise TypeError(f"bodies go by their numbers; found {shown(bodies)}")
    return np.where(numbers < 0, -1, numbers).astype(np.int64)


def _is_moment(moment: Any) -> bool:
    try:
        epoch, tick, contacts = map(operator.index, moment)
    except (TypeError, ValueError):
        return False
    return epoch >= 0 and contacts >= 0 and 0 <= tick < TICKS


def _is_index(value: Any, least: int = 0) -> bool:
    try:
        return not isinstance(value, bool) and least <= operator.index(value) < 2**31
    except TypeError:
        return False


def _are_names(names: Any) -> bool:
    return isinstance(names, list | tuple) and all(isinstance(name, str) for name in names)


def _is_size(value: Any) -> bool:
    return is_finite(value) and value > 0


def _are_two(value: Any, right: Callable[[Any], bool] = is_finite) -> bool:
    several = isinstance(value, Sequence) or (isinstance(value, np.ndarray) and value.ndim > 0)
    return several and len(value) == 2 and all(map(right, value))


def _pair(axes: str) -> Value:
    what, within = f"{axes}, two finite numbers", f"{axes}, each {REACH} in size"
    return Value(what, is_pair, _are_two, lambda pair: tuple(map(float, pair)), within)


def _is_pull(value: Any) -> bool:
    return is_finite(value) and (value == 0.0 or SMALLEST <= abs(value) <= LARGEST)


def _pull(axes: str) -> Value:
    what = f"{axes}, two numbers, each 0 or {RANGE} in size"
    return Value(what, is_pair, lambda pair: _are_two(pair, _is_pull), lambda pair: tuple(map(float, pair)))


_TIME = Value("a finite number")
_MOMENT = Value(
    "[epoch, tick, contacts], three whole numbers, none below 0, tick < 2**52",
    lambda moment: is_list(moment, is_whole, 3),
    _is_moment,
    lambda moment: tuple(map(int, moment)),
)
_BODY = Value("the number of a body", lambda body: is_whole(body) or isinstance(body, str), _is_index, int)
_PLACE = _pair("[x, y]")

SIZE_VALUE = Value("a finite number greater than 0", fit=_is_size, within=f"a number {RANGE}", least=SMALLEST)

VALUES: Mapping[str, Value] = {
    "position": _PLACE,
    "velocity": _pair("[vx, vy]"),
    "radius": SIZE_VALUE,
    "mass": replace(
        SIZE_VALUE,
        what="a number greater than 0, or inf",
        fit=lambda mass: is_number(mass) and (mass == math.inf or _is_size(mass)),
        most=math.inf,
    ),
    "width": SIZE_VALUE,
    "height": SIZE_VALUE,
    "from": _PLACE,
    "to": _PLACE,
    "gravity": _pull("[gx, gy]"),
    "acceleration": _pull("[ax, ay]"),
    "arena": Value(
        "[width, height], two finite numbers greater than 0",
        is_pair,
        lambda sides: _are_two(sides, _is_size),
        within=f"[width, height], each {RANGE}",
        least=SMALLEST,
    ),
    **dict.fromkeys(("time", "start", "until"), _TIME),
    "lifetime": SIZE_VALUE,
    **dict.fromkeys(("at", "end"), _MOMENT),
    "broad-phase": Value(
        "the name of a broad phase; options are in [options.NAME]", str, lambda name: isinstance(name, str)
    ),
    "narrow-phases": Value(
        "a list of names of narrow phases; options are in [options.NAME]", _are_names, _are_names
    ),
    "options": Value(
        "a table of options for each phase, such as {'sap-1d': {'axis': 'y'}} or [options.sap-1d]",
        dict,
        lambda them: isinstance(them, Mapping) and all(isinstance(each, Mapping) for each in them.values()),
    ),
    "unit": Value(
        "a power of two from 2**-900 to 2**100, or none",
        fit=lambda unit: is_finite(unit) and 2.0**-900 <= unit <= LONGEST_UNIT and math.frexp(unit)[0] == 0.5,
    ),
    "periodic": Value(
        '"x", "y" or "xy", or nothing',
        str,
        lambda axes: isinstance(axes, str) and axes in ("", "x", "y", "xy"),
    ),
    "kind": Value("the name of a kind, not 'wall' or '*', or a number below 2**31", object, is_kind, as_kind),
    "body": _BODY,
    "name": Value("a name of its own, text", str, lambda name: isinstance(name, str) and bool(name), str),
    "new body": replace(_BODY, form=is_whole, fit=lambda body: _is_index(body, -1)),
    "shape": Value("the number of one of [[shapes]], from 0", is_whole, _is_index),
}
"""The requirements of each value by its name, for every entrance."""
