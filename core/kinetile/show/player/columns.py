"""Columns as text in a page: the bytes of a column by significance, deflated, in base64.

The first bytes of all numbers come first, then all second bytes, and so on: neighbours are alike then, and
compress. The page decodes this with the browser's own ``DecompressionStream`` (``script/columns.mjs``).
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["decode", "encode"]

_TYPES = ("f8", "u8", "i4", "u1")
"""Types of columns; all little-endian."""


def encode(columns: Mapping[str, npt.NDArray[Any]]) -> dict[str, Any]:
    """Return columns (one-dimensional, of types f8, u8, i4, u1) as plain data for JSON: ``columns``, a list
    of [name, type, length], and ``text``. Raises TypeError for another type."""
    table, parts = [], []
    for name, column in columns.items():
        kind = column.dtype.str[1:]
        if kind not in _TYPES or column.ndim != 1:
            raise TypeError(f"column {name!r} is {column.dtype} {column.shape}; expected one of {_TYPES}")
        table.append([name, kind, len(column)])
        plain = np.ascontiguousarray(column, f"<{kind}")
        parts.append(plain.view(np.uint8).reshape(len(column), int(kind[1:])).T.tobytes())
    return {"columns": table, "text": base64.b64encode(zlib.compress(b"".join(parts), 9)).decode()}


def decode(coded: Mapping[str, Any]) -> dict[str, npt.NDArray[Any]]:
    """Return the columns that ``encode`` has made text of."""
    content = zlib.decompress(base64.b64decode(coded["text"]))
    columns, at = {}, 0
    for name, kind, length in coded["columns"]:
        size = int(kind[1:])
        planes = np.frombuffer(content, np.uint8, size * length, at).reshape(size, length)
        columns[name] = np.ascontiguousarray(planes.T).reshape(-1).view(f"<{kind}")
        at += size * length
    return columns
