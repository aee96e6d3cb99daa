"""An array that is held apart: its bytes, its shape, and what its elements are, in words.

The words are compared and never followed. What elements an array has is known to whoever puts the bytes back;
so nothing is made of a file but numbers.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = ["Held", "elements", "fill", "hold"]


class Held(NamedTuple):
    """What an array held: ``elements`` in words, its ``shape``, its ``content`` byte by byte."""

    elements: str
    shape: tuple[int, ...]
    content: npt.NDArray[np.uint8]

    def same(self, other: Held) -> bool:
        """Whether another one holds the same bits."""
        return self[:2] == other[:2] and bool(np.array_equal(self.content, other.content))

    def fits(self, array: npt.NDArray[Any]) -> bool:
        """Whether these bytes can be an array like this one: the same elements in the same shape."""
        return self.shape == array.shape and self.elements == elements(array.dtype)


@cache
def elements(dtype: np.dtype[Any]) -> str:
    """Return in words what an element is: names, kinds, order of bytes, places in the record."""
    if dtype.hasobject:
        raise TypeError(f"arrays of Python objects ({dtype}) cannot be held: their bytes mean nothing")
    return f"{dtype.descr} in {dtype.itemsize}"


def hold(array: npt.NDArray[Any], *, empty: bool = False) -> Held:
    """Return a copy of what an array holds; ``empty``: only what it is, for one that holds nothing now."""
    said = elements(array.dtype)
    content = np.zeros(0, np.uint8) if empty else np.array(array, order="C").reshape(-1).view(np.uint8)
    return Held(said, array.shape, content)


def fill(array: npt.NDArray[Any], held: Held) -> None:
    """Put back what an array held; one that held nothing is left as it is."""
    if not len(held.content):
        return
    if array.flags.c_contiguous:
        array.reshape(-1).view(np.uint8)[:] = held.content
    else:
        array[...] = held.content.view(array.dtype).reshape(array.shape)
