"""What a question is asked with, checked before it is: points, directions, boxes, lengths, counts.

Lengths and speeds are limited as a scene's are, so that squares of them are numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from kinetile.run.questions.places import Box, Point
from kinetile.scene.checks import LARGEST, is_finite, shown
from kinetile.scene.responses import Kind, no_kind

__all__ = [
    "read_box",
    "read_count",
    "read_direction",
    "read_disc",
    "read_kinds",
    "read_length",
    "read_point",
]

_SIZE = "at most 2**200 in size"


def read_point(value: object, name: str) -> Point:
    """Return a point, or a velocity; ValueError where it is none."""
    x, y = _read_numbers(value, 2, f"{name} is two finite numbers, {_SIZE}")
    return x, y


def read_direction(value: object) -> Point:
    """Return a direction; ValueError where it is none, or leads nowhere."""
    x, y = read_point(value, "a direction")
    if x == 0.0 and y == 0.0:
        raise ValueError("a direction is two finite numbers that are not both 0; found (0.0, 0.0)")
    return x, y


def read_box(value: object) -> Box:
    """Return a box; ValueError where it is none, or upside down."""
    what = "a box is (left, bottom, right, top), four finite numbers"
    left, bottom, right, top = _read_numbers(value, 4, f"{what}, {_SIZE}")
    if left > right or bottom > top:
        raise ValueError(f"{what}, left <= right and bottom <= top; found {shown(value)}")
    return left, bottom, right, top


def read_disc(value: object) -> tuple[Point, float]:
    """Return a disc's centre and radius; ValueError where it is none."""
    what = f"a disc is (x, y, radius), three finite numbers, {_SIZE}"
    x, y, radius = _read_numbers(value, 3, what)
    if radius < 0.0:
        raise ValueError(f"{what}, with a radius of at least 0; found {shown(value)}")
    return (x, y), radius


def read_length(value: Any, name: str) -> float:
    """Return a length; ValueError where it is none."""
    if not is_finite(value) or not 0.0 <= value <= LARGEST:
        raise ValueError(f"{name} is a finite number, from 0 to 2**200; found {shown(value)}")
    return float(value)


def read_count(value: Any, name: str) -> int:
    """Return how many bodies are wanted at most; ValueError where it is no number of bodies."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
        raise ValueError(f"{name} is a number of bodies, at least 0; found {shown(value)}")
    return int(value)


def read_kinds(value: Kind | Iterable[Kind], known: Sequence[Kind], where: str) -> list[Kind]:
    """Return one kind or several as a list; ValueError for one that is none of those that are known."""
    one = isinstance(value, str | int | np.integer)
    try:
        kinds: list[Any] = [value] if one else list(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{where}: kinds are given by a list of them; found {shown(value)}") from None
    for kind in kinds:
        if kind not in known:
            raise ValueError(f"{where}: {no_kind(kind, known)}")
    return kinds


def _read_numbers(value: Any, count: int, what: str) -> list[float]:
    """Return so many finite numbers; ValueError, saying what is expected, where they are not such."""
    parts = value.tolist() if isinstance(value, np.ndarray) else value
    fit = isinstance(parts, Sequence) and not isinstance(parts, str) and len(parts) == count
    if not fit or not all(is_finite(part) and abs(part) <= LARGEST for part in parts):
        raise ValueError(f"{what}; found {shown(value)}")
    return [float(part) for part in parts]
