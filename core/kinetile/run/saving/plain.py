"""Values as JSON says them, and back: numbers, text, lists, tables, tuples, arrays of numbers, and the few
classes that are named here. Nothing else comes out, whatever a file says.

Floats come back to the bit, as Python writes them; arrays are kept apart, byte by byte.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import RecordError
from kinetile.run.engine import Command
from kinetile.scene import Insert, Remove, Response, Settings, Turn
from kinetile.scene.checks import shown

__all__ = ["Arrays", "from_plain", "to_plain"]

Arrays = list[npt.NDArray[Any]]

_CLASSES: tuple[Any, ...] = (Command, Insert, Remove, Settings, Turn)
_NAMED: dict[str, Any] = {each.__name__: each for each in _CLASSES}
_NAMED["Response"] = lambda name, options: Response(name, **options)
_DTYPES = {"<f8", "<i8", "<i4", "|b1", "|u1"}


def to_plain(value: Any, arrays: Arrays, where: str) -> Any:
    """Return a value as JSON can say it, and append its arrays; RecordError, which says ``where``, for what
    is none of what can be said."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or type(value) in (bool, int, float, str):
        return value
    if type(value).__name__ in _NAMED and type(value) in _CLASSES:
        content = [getattr(value, each.name) for each in fields(value)] if is_dataclass(value) else value
        return {type(value).__name__: [to_plain(each, arrays, where) for each in content]}
    if isinstance(value, Response):
        return {"Response": [value.name, to_plain(dict(value.options), arrays, where)]}
    if type(value) is list:
        return [to_plain(each, arrays, where) for each in value]
    if type(value) is tuple:
        return {"tuple": [to_plain(each, arrays, where) for each in value]}
    if isinstance(value, Mapping):
        return {
            "table": [
                [to_plain(key, arrays, where), to_plain(each, arrays, where)] for key, each in value.items()
            ]
        }
    if isinstance(value, np.ndarray) and value.dtype.str in _DTYPES:
        arrays.append(np.array(value, order="C"))
        return {"array": [len(arrays) - 1, value.dtype.str, list(value.shape)]}
    raise RecordError(
        f"{where} has {shown(value)} in it, which cannot be saved: expected numbers, text, lists, tables or "
        "arrays of numbers"
    )


def from_plain(said: Any, arrays: list[npt.NDArray[np.uint8]]) -> Any:
    """Return the value that was said; TypeError, ValueError or LookupError for what none of it can be."""
    if isinstance(said, list):
        return [from_plain(each, arrays) for each in said]
    if not isinstance(said, dict):
        return said
    ((kind, content),) = said.items()
    if kind == "array":
        number, dtype, shape = content
        if dtype not in _DTYPES:
            raise ValueError(f"an array of {dtype}")
        return arrays[number].view(dtype).reshape(shape)
    found = [from_plain(each, arrays) for each in content]
    if kind == "tuple":
        return tuple(found)
    if kind == "table":
        return dict(found)
    return _NAMED[kind](*found)
