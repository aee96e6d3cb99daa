"""Which discs of a set overlap, in time proportional to the discs and the overlaps.

A static search, used to check scenes before they run. Discs are sorted into levels by the power of two above
their radius; a level's cells are twice that power wide, so that a disc can only overlap discs of its own or a
lower level that lie in its own cell or in one of the eight around it. Cells are kept as a sorted array of
hashed cell numbers, and whole arrays of discs are looked up at once. Where discs do not overlap, a cell holds
few of them and the search is linear; where they do, pairs come out in chunks of bounded size, and whoever has
seen enough stops.

The cell width is a power of two, so the division that finds the cell is exact: no rounding can put two
overlapping discs into cells that are not neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

__all__ = ["CHUNK", "distance", "overlapping_pairs"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

CHUNK = 1 << 20
"""How many pairs are compared at a time (a single disc may bring as many more as there are discs)."""

_STRIDES = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F], dtype=np.uint64)
_FARTHEST_CELL = 2.0**61  # beyond, cells merge: more to compare, never less
_SMALLEST, _LARGEST = -1000, 1000  # exponents; keeps every quantity below from over- and underflowing
_AROUND = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1)]
_HALF_AROUND = [(1, 0), (-1, 1), (0, 1), (1, 1)]


class _Cells(NamedTuple):
    """Discs in the order of their cells: numbers, places, radii, cells, and the cells' hashes."""

    disc: Ints
    position: Floats
    radius: Floats
    cell: Ints
    key: npt.NDArray[np.uint64]


def distance(apart: Floats) -> Floats:
    """Return the lengths of (n, 2) differences: the same bits everywhere, which np.hypot's are not."""
    exponent = np.frexp(np.abs(apart).max(axis=1))[1]
    scaled = np.ldexp(apart, -exponent[:, np.newaxis])  # so that no square over- or underflows
    return np.asarray(np.ldexp(np.sqrt(scaled[:, 0] * scaled[:, 0] + scaled[:, 1] * scaled[:, 1]), exponent))


def overlapping_pairs(position: Floats, radius: Floats, tolerance: float = 0.0) -> Iterator[Ints]:
    """Yield the pairs of discs whose distance is less than (1 - tolerance) times the sum of their radii.

    ``position`` is (n, 2) and ``radius`` (n,), all finite, radii > 0. Each yield is a (k, 2) array with
    a < b in each row, possibly empty, for at most about CHUNK + n compared pairs; each pair comes once, in no
    particular order.
    """
    exponent = np.maximum(np.frexp(radius)[1].astype(np.int64), _SMALLEST)
    if len(radius) and exponent.max() > _LARGEST:
        position, radius, exponent = position * 2.0**-30, radius * 2.0**-30, exponent - 30
    for level in np.unique(exponent):
        width = float(np.ldexp(1.0, int(level) + 1))
        own = _sorted_into_cells(position, radius, np.flatnonzero(exponent == level), width)
        rest = np.searchsorted(own.key, own.key, side="right")
        yield from _compare(own, own, np.arange(1, len(own.disc) + 1), rest, (0, 0), tolerance)
        for step in _HALF_AROUND:
            yield from _look_up(own, own, step, tolerance)
        smaller = _sorted_into_cells(position, radius, np.flatnonzero(exponent < level), width)
        for step in _AROUND:
            yield from _look_up(smaller, own, step, tolerance)


def _sorted_into_cells(position: Floats, radius: Floats, disc: Ints, width: float) -> _Cells:
    with np.errstate(over="ignore"):
        place = np.floor(position[disc] / width)
    cell = np.clip(place, -_FARTHEST_CELL, _FARTHEST_CELL).astype(np.int64)
    key = (cell.view(np.uint64) * _STRIDES).sum(axis=1, dtype=np.uint64)
    order = np.argsort(key, kind="stable")
    disc = disc[order]
    return _Cells(disc, position[disc], radius[disc], cell[order], key[order])


def _look_up(asking: _Cells, asked: _Cells, step: tuple[int, int], tolerance: float) -> Iterator[Ints]:
    """Compare each disc of ``asking`` with the discs of ``asked`` that are ``step`` cells away."""
    there = asking.key + (np.array(step).view(np.uint64) * _STRIDES).sum(dtype=np.uint64)
    begin = np.searchsorted(asked.key, there, side="left")
    end = np.searchsorted(asked.key, there, side="right")
    yield from _compare(asking, asked, begin, end, step, tolerance)


def _compare(
    asking: _Cells, asked: _Cells, begin: Ints, end: Ints, step: tuple[int, int], tolerance: float
) -> Iterator[Ints]:
    """Compare the i-th disc of ``asking`` with begin[i] to end[i] of ``asked``, a chunk at a time."""
    rows = np.flatnonzero(end > begin)
    count = (end - begin)[rows]
    total = np.cumsum(count)
    first = 0
    while first < len(rows):
        before = total[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(total, before + CHUNK, side="right")))
        part, size = rows[first:last], count[first:last]
        one = np.repeat(part, size)
        other = np.arange(len(one)) + np.repeat(begin[part] - (total[first:last] - size - before), size)
        with np.errstate(over="ignore"):
            apart = asking.position[one] - asked.position[other]
            reach = (asking.radius[one] + asked.radius[other]) * (1.0 - tolerance)
            close = np.flatnonzero(distance(apart) < reach)
        one, other = one[close], other[close]
        really = (asked.cell[other] - asking.cell[one] == step).all(axis=1)  # and not by a chance hash
        yield np.sort(np.stack([asking.disc[one[really]], asked.disc[other[really]]], axis=1), axis=1)
        first = last
