"""Values of a parameter: one, a list, or a range.

A range is a table: ``{ from = 10, to = 50, step = 10 }``, or ``{ from = 100, to = 10000, count = 5, scale =
"log" }``. Its numbers are worked out from how they are written, so that 0.1 to 0.5 by 0.1 has 0.3 in it and
no neighbour of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from kinetile.errors import Mistake, one_of
from kinetile.scene.checks import is_finite, shown

__all__ = ["MOST", "values_of"]

MOST = 100_000
"""How many values a list or range may have."""

_KEYS = ("from", "to", "step", "count", "scale")
_FORM = "{ from, to, step } or { from, to, count, scale }"


def values_of(given: Any, where: str, mistakes: list[Mistake], *, whole: bool = False) -> list[Any]:
    """Return the values that were given for a parameter; append what is wrong with them.

    ``whole``: numbers of a logarithmic range are rounded to whole ones.
    """
    if isinstance(given, Mapping):
        return _range(given, where, mistakes, whole)
    if not isinstance(given, list):
        return [given]
    if not given:
        mistakes.append(Mistake(where, "an empty list", f"a value, a list of values, or a range {_FORM}"))
    if len(given) > MOST:
        mistakes.append(Mistake(where, f"{len(given):,} values", f"at most {MOST:,}"))
        return []
    kept = list({(type(each), repr(each)): each for each in given}.values())
    if len(kept) < len(given):
        mistakes.append(Mistake(where, "a value that is there twice", "each value once"))
    return kept


def _range(given: Mapping[str, Any], where: str, mistakes: list[Mistake], whole: bool) -> list[Any]:
    known = len(mistakes)
    for key in given:
        if key not in _KEYS:
            mistakes.append(Mistake(f"{where}.{key}", "a key that is not known here", one_of(key, _KEYS)))
    for key in ("from", "to", "step"):
        if key in given and not is_finite(given[key]):
            mistakes.append(Mistake(f"{where}.{key}", shown(given[key]), "a finite number"))
        elif key not in given and key != "step":
            mistakes.append(Mistake(f"{where}.{key}", "nothing", f"a finite number, as in {_FORM}"))
    count: Any = given.get("count")
    scale = given.get("scale", "linear")
    if count is not None and (isinstance(count, bool) or not isinstance(count, int) or not 1 < count <= MOST):
        mistakes.append(Mistake(f"{where}.count", shown(count), f"a whole number from 2 to {MOST:,}"))
    if scale not in ("linear", "log"):
        mistakes.append(Mistake(f"{where}.scale", shown(scale), '"linear" or "log"'))
    if "step" in given and ("count" in given or "scale" in given):
        mistakes.append(Mistake(where, "step beside count or scale", f"one of {_FORM}"))
    if len(mistakes) > known:
        return []
    first, last = Fraction(repr(given["from"])), Fraction(repr(given["to"]))
    if first >= last or (scale == "log" and first <= 0):
        expected = "from below to" + (", both above 0" if scale == "log" else "")
        mistakes.append(Mistake(where, f"from {given['from']!r} to {given['to']!r}", expected))
        return []
    if scale == "log" and count is None:
        mistakes.append(Mistake(f"{where}.count", "nothing", "a whole number: how many values there are"))
        return []
    if scale == "log":
        ratio = float(last) / float(first)
        if not math.isfinite(ratio):
            found = f"from {given['from']!r} to {given['to']!r}"
            mistakes.append(Mistake(where, found, "numbers whose ratio is at most 1.8e308"))
            return []
        numbers = [float(first) * math.pow(ratio, k / (count - 1)) for k in range(count)]
        numbers[-1] = float(last)
        return list(dict.fromkeys(map(round, numbers))) if whole else numbers
    step = Fraction(repr(given.get("step", 1)))
    if count is not None:
        step = (last - first) / (count - 1)
    if step <= 0 or (last - first) / step >= MOST:
        mistakes.append(Mistake(f"{where}.step", shown(given.get("step")), f"at most {MOST:,} steps upwards"))
        return []
    exact = [first + k * step for k in range(math.floor((last - first) / step) + 1)]
    integers = all(isinstance(given.get(key, 1), int) for key in ("from", "to", "step"))
    return [int(each) if integers and each.denominator == 1 else float(each) for each in exact]
