"""Bodies of a scene as arrays: read from any given form, and checked against each other and the arena.

The search for overlaps takes time proportional to the numbers of discs and overlaps. Discs are sorted into
levels by the power of two above their radius; a level's cells are twice that power wide. So a disc can only
overlap discs of its own or a lower level in its own cell or one of the eight around it, and the division that
finds the cell is exact. Cells are a sorted array of hashed numbers; chunks of pairs have a bounded size.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Array, Flags, Floats, Integers
from kinetile.errors import Mistake
from kinetile.scene.checks import (
    FARTHEST,
    HEAVIEST,
    MOST_MISTAKES,
    PERIODIC_BODY,
    PERIODIC_SHAPE,
    TOLERANCE,
    Extent,
    shown,
)
from kinetile.scene.shapes import SEGMENTS, ShapeTable, overlapping_shapes
from kinetile.scene.values import VALUES

Coordinates: TypeAlias = Sequence[float] | Array
"""A point, a velocity, a disc or a box as given: a tuple, a list or an array."""


@dataclass(frozen=True)
class Bodies:
    """Bodies as arrays of n rows: position and velocity are (n, 2), radius and mass (n,). ``unknown`` maps
    each name to (n,), True for bodies whose value was reported as missing or wrong: checks that need it leave
    them out. ``table`` has the shapes, whose reach is their radius; None: discs."""

    position: Floats
    velocity: Floats
    radius: Floats
    mass: Floats
    unknown: Mapping[str, Flags]
    table: ShapeTable | None = None

    def __len__(self) -> int:
        return len(self.mass)

    def known(self, *names: str) -> Flags:
        """Returns (n,), True for bodies with all these fields known."""
        return np.asarray(~np.logical_or.reduce([self.unknown[name] for name in names]))


def read_arrays(given: Mapping[str, Any], unread: Mapping[str, Flags], mistakes: list[Mistake]) -> Bodies:
    """Copies the bodies' fields, by their names, to arrays of matching shapes; reports values that are no
    numbers, and marks them as unknown, like values that were not read from a file."""
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
    unknown: dict[str, Flags] = {}
    for name in given:
        array = read.get(name)
        if array is not None and array.ndim and len(array) != bodies:
            what = f"{len(array)} {'row' if array.ndim == 2 else 'number'}{'s' if len(array) != 1 else ''}"
            mistakes.append(Mistake(name, what, f"one for each of the {bodies} bodies"))
            array = None
        shape = (bodies, 2) if name in ("position", "velocity") else (bodies,)
        unknown[name] = unread.get(name, np.full(bodies, array is None))
        array = np.array(np.nan) if array is None else array
        read[name] = np.array(np.broadcast_to(array, shape), dtype=np.float64, order="C")
    return Bodies(read["position"], read["velocity"], read["radius"], read["mass"], unknown)


def _numbers(value: npt.ArrayLike) -> tuple[Floats | None, tuple[str, str]]:
    """Returns ``value`` as an array of float64, or None, and the texts "found" and "expected" for None."""
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
    return floats, ("", "")


def _is_masked(value: object) -> bool:
    if isinstance(value, (list, tuple)):
        return any(_is_masked(each) for each in value if isinstance(each, (list, tuple, np.ma.MaskedArray)))
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.is_masked(value))


def _first_rounded(array: Array, floats: Floats) -> str | None:
    """Returns the first number of a wider type that float64 does not hold exactly; None if it holds all."""
    if array.dtype.kind in "iu" and array.dtype.itemsize == 8:
        far = np.flatnonzero(np.abs(floats) >= 2.0**53)
        return next((str(n) for k in far if (n := int(array.flat[k])) != int(floats.flat[k])), None)
    if array.dtype.kind == "f" and array.dtype.itemsize > 8:
        other = np.flatnonzero((floats != array) & ~np.isnan(array))
        return str(array.flat[other[0]]) if len(other) else None
    return None


FIXED = "none: nothing moves a body of infinite mass"


def read_accelerations(given: Any, bodies: Bodies, unread: Flags | None, mistakes: list[Mistake]) -> Floats:
    """Returns (n, 2) the own accelerations of bodies, NaN for bodies without one; a given row of NaN means no
    own one. Reports invalid accelerations; ``unread`` ones have been reported."""
    found = np.full((len(bodies), 2), math.nan)
    array, wrong = _numbers(given)
    own = 0 if array is None or array.ndim != 2 else len(array)
    if array is None:
        mistakes.append(Mistake("acceleration", *wrong))
    elif array.shape not in ((2,), (own, 2)) or own > len(bodies):
        right = "an array of shape (n, 2), a row for each body, or (2,), one for all"
        mistakes.append(Mistake("acceleration", f"an array of shape {array.shape}", right))
    elif own:
        found[:own] = array
    else:
        found[np.isfinite(bodies.mass)] = array
    value, none = VALUES["acceleration"], np.isnan(found).all(axis=1)
    odd = np.array([bool(value.expected(each)) for each in found.tolist()], dtype=np.bool_) & ~none
    told = odd.copy()
    if unread is not None:
        told[: len(unread)] &= ~unread  # obstacles, which a file has elsewhere, follow its bodies
    mistakes += _spell_out(told, "acceleration", found, value.expected)
    fixed = ~odd & ~none & np.isinf(bodies.mass) & found.any(axis=1)
    mistakes += _spell_out(fixed, "acceleration", found, FIXED)
    found[odd] = math.nan
    return found


_ENOUGH_CHUNKS = 8  # chunks that still count overlaps after the first LIMIT

BODY_COLUMNS = ("position", "velocity", "radius", "mass")
"""The fields of a body that are numbers."""

Passing: TypeAlias = tuple[Integers, Flags]
"""(n,) the kinds of bodies, and (kinds, kinds), True if two pass through each other: they may overlap."""


def check_bodies(bodies: Bodies, extent: Extent | None, passing: Passing) -> list[Mistake]:
    """Checks bodies against each other and the arena; ``extent`` is None without an arena or a right one."""
    mistakes: list[Mistake] = []
    right: dict[str, Flags] = {}
    for name in BODY_COLUMNS:
        numbers = getattr(bodies, name)
        held = VALUES[name].holds(numbers)
        right[name] = np.asarray(held.all(axis=1) if held.ndim == 2 else held)
        mistakes += _spell_out(~right[name] & bodies.known(name), name, numbers, VALUES[name].expected)
    movable = np.asarray(right["mass"] & np.isfinite(bodies.mass))
    mistakes += _check_masses(bodies.mass, np.flatnonzero(movable & bodies.known("mass")))
    if bodies.table is not None:
        for i in np.flatnonzero(movable & bodies.table.hollow).tolist():
            mistakes.append(Mistake(f"bodies[{i}].shape", *SEGMENTS))
    placed = right["position"] & right["radius"] & bodies.known("position", "radius")
    periods = (0.0, 0.0)
    if extent is not None:
        periods = extent.periods
        mistakes += _check_inside(bodies, extent, placed)
        mistakes += _check_images(bodies, periods, placed)
        if mistakes and any(periods):
            return mistakes  # images cannot be compared
    return mistakes + _check_apart(bodies, np.flatnonzero(placed), passing, periods, movable)


def _check_masses(mass: Floats, bodies: npt.NDArray[np.intp]) -> list[Mistake]:
    if not len(bodies):
        return []
    light = int(bodies[np.argmin(mass[bodies])])
    heavy = int(bodies[np.argmax(mass[bodies])])
    if mass[heavy] / mass[light] <= HEAVIEST:
        return []
    found = f"{mass[light]:.6g} and {mass[heavy]:.6g}"
    expected = f"no body more than 2**100 ({HEAVIEST:.1e}) times as heavy as another"
    return [Mistake(f"bodies[{light}].mass and bodies[{heavy}].mass", found, expected)]


def _spell_out(
    wrong: Flags, field: str, found: Floats | Callable[[int], str], expected: str | Callable[[Any], str]
) -> list[Mistake]:
    """Returns the mistakes of a mask of wrong bodies, at most LIMIT and a last one that counts the others."""
    bodies = np.flatnonzero(wrong)
    mistakes = []
    for i in bodies[:MOST_MISTAKES].tolist():
        value = None if callable(found) else found[i].tolist()
        what = found(i) if callable(found) else shown(value)
        right = expected(value) if callable(expected) else expected
        mistakes.append(Mistake(f"bodies[{i}].{field}", what, right))
    if len(bodies) > MOST_MISTAKES:
        more = f"the same in {len(bodies) - MOST_MISTAKES:,} more bodies"
        mistakes.append(Mistake(f"bodies[...].{field}", more, mistakes[-1].expected))
    return mistakes


def _check_inside(bodies: Bodies, extent: Extent, placed: Flags) -> list[Mistake]:
    position, radius, table = bodies.position, bodies.radius, bodies.table
    left, right, down, up = (radius,) * 4 if table is None else table.reaches.T
    arena, walls_of = extent.sides, {"x": ("left", "right"), "y": ("bottom", "top")}
    walled = [wall for axis, walls in walls_of.items() if axis not in extent.periodic for wall in walls]
    allowed = TOLERANCE * radius
    with np.errstate(invalid="ignore", over="ignore"):
        beyond = {
            "left": left - position[:, 0],
            "right": (position[:, 0] - arena[0]) + right,
            "bottom": down - position[:, 1],
            "top": (position[:, 1] - arena[1]) + up,
        }
        outside = {wall: placed & (beyond[wall] > allowed) for wall in walled}
    if not walled:
        return []

    def found(i: int) -> str:
        walls = [f"{beyond[wall][i]:.6g} beyond the {wall} wall" for wall in walled if outside[wall][i]]
        size = f" with radius {radius[i]:.6g}" if table is None else ""
        return f"{shown(position[i].tolist())}{size}, which reaches {' and '.join(walls)}"

    what = "disc" if table is None else "body"
    expected = f"the whole {what} inside the arena, [0, {arena[0]!r}] x [0, {arena[1]!r}]"
    return _spell_out(np.logical_or.reduce(list(outside.values())), "position", found, expected)


def _check_images(bodies: Bodies, periods: tuple[float, float], placed: Flags) -> list[Mistake]:
    """Checks that no body would meet itself, that no two shapes would touch through two images at once, and
    that no body is too far away to count its periods."""
    position, radius = bodies.position, bodies.radius
    wide = 2.0 if bodies.table is None else 4.0
    wrong = np.zeros(len(radius), dtype=np.bool_)
    for place, period in zip(position.T, periods, strict=True):
        if period:
            wrong |= placed & ~((wide * radius < period) & (np.abs(place) <= FARTHEST * period))

    def found(i: int) -> str:
        what = "a disc of" if bodies.table is None else "a body that a circle holds of"
        return f"{what} radius {radius[i]:.6g} at {shown(position[i].tolist())}"

    right = PERIODIC_BODY if bodies.table is None else PERIODIC_SHAPE
    expected = f"{right} ({' and '.join(repr(period) for period in periods if period)})"
    return _spell_out(wrong, "radius" if bodies.table is None else "shape", found, expected)


def _check_apart(
    bodies: Bodies,
    placed: npt.NDArray[np.intp],
    passing: Passing,
    periods: tuple[float, float],
    movable: Flags,
) -> list[Mistake]:
    """Reports the first LIMIT pairs of ``placed`` bodies that must not overlap and do, and counts others."""
    (kind, passes), table = passing, bodies.table
    position, radius = bodies.position[placed], bodies.radius[placed]
    first: list[tuple[int, int]] = []
    count, counted_all = 0, True
    for chunk, found in enumerate(overlapping_images(position, radius, periods, TOLERANCE)):
        one, two = kind[placed[found]].T
        found = found[~passes[one, two]]
        if table is not None:
            found = found[movable[placed[found]].any(axis=1)]
            found = overlapping_shapes(position, table, placed, found, periods)
        count += len(found)
        if len(found):
            order = np.lexsort((found[:, 1], found[:, 0]))[:MOST_MISTAKES]
            first = sorted([*first, *((int(a), int(b)) for a, b in placed[found[order]])])[:MOST_MISTAKES]
        if count > MOST_MISTAKES and chunk >= _ENOUGH_CHUNKS:
            counted_all = False
            break
    expected = "discs that touch at most" if table is None else "bodies that touch at most"
    mistakes = []
    for a, b in first:
        what = _overlap(bodies, periods, a, b) if table is None else "an overlap"
        mistakes.append(Mistake(f"bodies[{a}] and bodies[{b}]", what, expected))
    if count > MOST_MISTAKES:
        more = f"{'' if counted_all else 'at least '}{count - MOST_MISTAKES:,} more pairs that overlap"
        mistakes.append(Mistake("bodies", more, expected))
    return mistakes


def _overlap(bodies: Bodies, periods: tuple[float, float], a: int, b: int) -> str:
    between = (bodies.position[b] - bodies.position[a])[np.newaxis]
    apart = math.hypot(*nearest_image(between, periods)[0].tolist())
    together = bodies.radius[a].item() + bodies.radius[b].item()
    return f"an overlap of {together - apart:.6g} (distance {apart:.6g}, sum of the radii {together:.6g})"


CHUNK = 1 << 20
"""The number of pairs compared at a time (a single disc may add as many as there are discs)."""

_STRIDES = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F], dtype=np.uint64)
_FARTHEST_CELL = 2.0**61  # beyond, cells merge: more to compare, never less
_SMALLEST, _LARGEST = -1000, 1000  # exponents; keeps every quantity below from over- and underflowing
_AROUND = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1)]
_HALF_AROUND = [(1, 0), (-1, 1), (0, 1), (1, 1)]


class _Cells(NamedTuple):
    """Discs in the order of their cells: numbers, places, radii, cells, and the cells' hashes."""

    disc: Integers
    position: Floats
    radius: Floats
    cell: Integers
    key: npt.NDArray[np.uint64]


def distance(apart: Floats) -> Floats:
    """Returns the lengths of (n, 2) differences: the same bits on every machine, unlike np.hypot's."""
    exponent = np.frexp(np.abs(apart).max(axis=1))[1]
    scaled = np.ldexp(apart, -exponent[:, np.newaxis])  # so that no square over- or underflows
    return np.asarray(np.ldexp(np.sqrt(scaled[:, 0] * scaled[:, 0] + scaled[:, 1] * scaled[:, 1]), exponent))


def nearest_image(apart: Floats, periods: tuple[float, float]) -> Floats:
    """Returns (n, 2) differences of places, along each periodic axis between the nearest images."""
    columns = [
        np.array([math.remainder(each, period) for each in column.tolist()]) if period else column
        for column, period in zip(apart.T, periods, strict=True)
    ]
    return np.column_stack(columns)


def whole_periods(apart: Floats, periods: tuple[float, float]) -> Floats:
    """Returns (n, 2) differences of places in periods, as whole numbers; 0 along other axes."""
    sides = np.array(periods)
    return np.asarray(np.rint(apart / np.where(sides > 0.0, sides, math.inf)))


def in_box(places: Floats, periods: tuple[float, float]) -> Floats:
    """Returns (n, 2) places as users see them: along a periodic axis from 0 to less than the period."""
    shown_at = np.array(places)
    for column, period in zip(shown_at.T, periods, strict=True):
        if period:
            column[:] = np.mod(column, period)
            column[column == period] = 0.0  # a little below 0, rounded
    return shown_at


def overlapping_images(
    position: Floats, radius: Floats, periods: tuple[float, float], tolerance: float = 0.0
) -> Iterator[Integers]:
    """Yields ``overlapping_pairs``, each once, also through images: bodies near a border are repeated."""
    if not any(periods) or not len(radius):
        yield from overlapping_pairs(position, radius, tolerance)
        return
    place, disc = nearest_image(position, periods), np.arange(len(radius))
    own = len(radius)
    for axis, period in enumerate(periods):
        if period:
            margin = 0.5 * period - 2.0 * float(radius.max())
            step = np.where(np.arange(2) == axis, period, 0.0)
            low, high = place[:, axis] < -margin, place[:, axis] > margin
            place = np.concatenate([place, place[low] + step, place[high] - step])
            disc = np.concatenate([disc, disc[low], disc[high]])
    seen: set[tuple[int, int]] = set()
    for found in overlapping_pairs(place, radius[disc], tolerance):
        pairs = np.sort(disc[found[(found < own).any(axis=1)]], axis=1)
        fresh = {(a, b) for a, b in pairs.tolist() if a != b} - seen
        seen |= fresh
        yield np.array(sorted(fresh), dtype=np.int64).reshape(-1, 2)


def overlapping_pairs(position: Floats, radius: Floats, tolerance: float = 0.0) -> Iterator[Integers]:
    """Yields the pairs of discs whose distance is less than (1 - tolerance) times the sum of their radii.
    ``position`` is (n, 2) and ``radius`` (n,), all finite, radii > 0. Each yield is a (k, 2) array with a <
    b, possibly empty, for at most about CHUNK + n compared pairs; each pair once, in no order."""
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


def _sorted_into_cells(position: Floats, radius: Floats, disc: Integers, width: float) -> _Cells:
    with np.errstate(over="ignore"):
        place = np.floor(position[disc] / width)
    cell = np.clip(place, -_FARTHEST_CELL, _FARTHEST_CELL).astype(np.int64)
    key = (cell.view(np.uint64) * _STRIDES).sum(axis=1, dtype=np.uint64)
    order = np.argsort(key, kind="stable")
    disc = disc[order]
    return _Cells(disc, position[disc], radius[disc], cell[order], key[order])


def _look_up(discs: _Cells, others: _Cells, step: tuple[int, int], tolerance: float) -> Iterator[Integers]:
    there = discs.key + (np.array(step).view(np.uint64) * _STRIDES).sum(dtype=np.uint64)
    begin = np.searchsorted(others.key, there, side="left")
    end = np.searchsorted(others.key, there, side="right")
    yield from _compare(discs, others, begin, end, step, tolerance)


def _compare(
    discs: _Cells, others: _Cells, begin: Integers, end: Integers, step: tuple[int, int], tolerance: float
) -> Iterator[Integers]:
    """Compares the i-th disc of ``discs`` with begin[i] to end[i] of ``others``, a chunk at a time."""
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
            apart = discs.position[one] - others.position[other]
            reach = (discs.radius[one] + others.radius[other]) * (1.0 - tolerance)
            close = np.flatnonzero(distance(apart) < reach)
        one, other = one[close], other[close]
        really = (others.cell[other] - discs.cell[one] == step).all(axis=1)  # no equal hash by chance
        yield np.sort(np.stack([discs.disc[one[really]], others.disc[other[really]]], axis=1), axis=1)
        first = last
