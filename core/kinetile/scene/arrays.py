"""The bodies' fields as arrays of float64 that fit together, from whatever was given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.errors import Mistake
from kinetile.scene.checks import shown

__all__ = ["Numbers", "read_arrays"]

Floats = npt.NDArray[np.float64]

Numbers: TypeAlias = Sequence[float] | npt.NDArray[Any]
"""A point, a velocity, a disc or a box as it is given: a tuple, a list or an array."""


def read_arrays(
    position: npt.ArrayLike,
    velocity: npt.ArrayLike,
    radius: npt.ArrayLike,
    mass: npt.ArrayLike,
    mistakes: list[Mistake],
) -> tuple[tuple[Floats, Floats, Floats, Floats], dict[str, npt.NDArray[np.bool_]]]:
    """Copy the bodies' fields to arrays that fit together; report and mark as unknown what cannot be read."""
    given = {"position": position, "velocity": velocity, "radius": radius, "mass": mass}
    read: dict[str, Floats] = {}
    for name, value in given.items():
        array, wrong = _numbers(value)
        vectors = name in ("position", "velocity")
        if array is None:
            mistakes.append(Mistake(name, *wrong))
        elif vectors and array.shape == (0,):
            read[name] = array.reshape(0, 2)
        elif (array.ndim != 2 or array.shape[1] != 2) if vectors else array.ndim > 1:
            right = "(n, 2), a row for each body" if vectors else "(n,), or one number for all"
            mistakes.append(Mistake(name, f"an array of shape {array.shape}", f"an array of shape {right}"))
        else:
            read[name] = array
    sized = [len(array) for array in read.values() if array.ndim]
    bodies = sized[0] if sized else 0
    unknown: dict[str, npt.NDArray[np.bool_]] = {}
    for name in given:
        array = read.get(name)
        if array is not None and array.ndim and len(array) != bodies:
            what = f"{len(array)} {'row' if array.ndim == 2 else 'number'}{'s' if len(array) != 1 else ''}"
            mistakes.append(Mistake(name, what, f"one for each of the {bodies} bodies"))
            array = None
        shape = (bodies, 2) if name in ("position", "velocity") else (bodies,)
        if array is None:
            unknown[name] = np.ones(bodies, dtype=np.bool_)
            array = np.array(np.nan)
        read[name] = np.array(np.broadcast_to(array, shape), dtype=np.float64, order="C")
    return (read["position"], read["velocity"], read["radius"], read["mass"]), unknown


def _numbers(value: npt.ArrayLike) -> tuple[Floats | None, tuple[str, str]]:
    """Return ``value`` as an array of float64, or None where it is none; then what was found and expected."""
    nothing = "", ""
    if _is_masked(value):
        return None, ("a masked array, some of whose numbers are not to be used", "numbers without a mask")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):
        array = np.array(None)
    if array.dtype.kind not in "fiu":
        what = shown(value) if array.dtype.kind == "O" else f"{shown(value)}, of the type {array.dtype}"
        return None, (what, "an array of numbers")
    with np.errstate(over="ignore", invalid="ignore"):
        floats = array.astype(np.float64)
    changed = _first_rounded(array, floats)
    if changed is not None:
        return None, (f"{changed}, of the type {array.dtype}", "numbers that float64 holds without rounding")
    return floats, nothing


def _is_masked(value: object) -> bool:
    """Say whether numbers are masked in an array, or in one of the rows of which a sequence consists."""
    if isinstance(value, (list, tuple)):
        return any(_is_masked(each) for each in value if isinstance(each, (list, tuple, np.ma.MaskedArray)))
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.is_masked(value))


def _first_rounded(array: npt.NDArray[Any], floats: Floats) -> str | None:
    """Return the first number of an array of a wider type that is not the same as float64; None: all are."""
    if array.dtype.kind in "iu" and array.dtype.itemsize == 8:
        far = np.flatnonzero(np.abs(floats) >= 2.0**53)
        return next((str(n) for k in far if (n := int(array.flat[k])) != int(floats.flat[k])), None)
    if array.dtype.kind == "f" and array.dtype.itemsize > 8:
        other = np.flatnonzero((floats != array) & ~np.isnan(array))
        return str(array.flat[other[0]]) if len(other) else None
    return None
