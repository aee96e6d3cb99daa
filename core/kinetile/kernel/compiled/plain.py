"""The tables in the form for Python, and the counterparts of ``views`` there: called from Python, a function
of ``views`` is the function of the same name here."""

from functools import cache, partial
from operator import itemgetter
from typing import Any, TypeVar, cast

import numpy as np

T = TypeVar("T")

SEEN = {"bodies": "shadows", "places": "shadow_places"}
"""The tables that replace others for broad phases, if bodies are accelerated."""


def quick(tables: T) -> T:
    """Returns tables, or named tuples of them, with fields that are read ten times as fast as the fields of
    NumPy's records: these look each attribute up in Python, which is most of a hook's time as Python."""
    if isinstance(tables, tuple):
        return cast(T, cast(Any, tables)._make(map(quick, tables)))
    plain = np.asarray(tables)
    return cast(T, plain.view(*_properties(plain.dtype))) if type(tables) is np.recarray else tables


@cache
def _properties(dtype: np.dtype[Any]) -> tuple[np.dtype[Any], type]:
    """Returns the same fields as properties: a type of rows, and a type of tables of them."""
    known: Any = dtype.fields  # in any order
    fields = {name: known[name] for name in dtype.names or ()}
    inner = {
        name: _properties(each) if each.names else (each, np.ndarray) for name, (each, *_) in fields.items()
    }
    layout: Any = {
        "names": [*fields],
        "formats": [row for row, _ in inner.values()],
        "offsets": [offset for _, offset, *_ in fields.values()],
        "itemsize": dtype.itemsize,
    }
    row = {name: property(itemgetter(name), partial(_set, name)) for name in fields}
    table = {
        name: property(partial(_column, name, kind), partial(_set, name)) for name, (_, kind) in inner.items()
    }
    made = type("Row", (np.void,), {"__slots__": (), **row})
    return np.dtype((made, np.dtype(layout))), type("Table", (np.ndarray,), table)


def _column(name: str, kind: type, table: Any) -> Any:
    return table[name].view(kind)


def _set(name: str, where: Any, value: Any) -> None:
    where[name] = value


def disowned(tables: T) -> T:
    """Returns ``tables`` unchanged: Python code has no registers to hold them in."""
    return tables


def wrapping(given: T) -> T:
    """Returns its argument unchanged."""
    return given


def pointer(numbers: Any) -> Any:
    """Returns an array unchanged."""
    return numbers


def zeros(count: int) -> Any:
    """Returns whole numbers, all zero: a list, which is read and written faster than an array."""
    return [0] * count


def numbers_from(tables: Any, first: int) -> Any:
    """Returns the tables with ``numbers`` from an index on."""
    return tables._replace(numbers=tables.numbers[first:])


def with_shadows(tables: Any) -> Any:
    """Returns the tables for a broad phase (``SEEN``)."""
    return tables._replace(**{name: getattr(tables, other) for name, other in SEEN.items()})
