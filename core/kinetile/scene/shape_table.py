"""Shapes of a scene's bodies: a table of them, the index of each body, and which bodies overlap."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import Mistake
from kinetile.scene.checks import TOLERANCE, shown
from kinetile.scene.differences import Exact, core_difference, is_closer
from kinetile.scene.shapes import Shape

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Table:
    """The shapes of a scene's bodies: the table, (n,) the index of each body, and (n,) which are unknown."""

    shapes: tuple[Shape, ...]
    index: npt.NDArray[np.int64]
    unknown: npt.NDArray[np.bool_]

    @property
    def discs(self) -> bool:
        """Whether the bodies are discs, all of them."""
        known = np.unique(self.index[~self.unknown]).tolist()
        return not self.unknown.any() and all(self.shapes[each].is_disc for each in known)

    @property
    def radius(self) -> npt.NDArray[np.float64]:
        """(n,) the reach of each body's shape; NaN where it is unknown."""
        return np.append([each.reach for each in self.shapes], math.nan)[self._known]

    @property
    def reaches(self) -> npt.NDArray[np.float64]:
        """(n, 4) how far each body reaches to the left, right, bottom and top; NaN where it is unknown."""
        return np.array([*(each.reaches for each in self.shapes), (math.nan,) * 4])[self._known]

    @property
    def hollow(self) -> npt.NDArray[np.bool_]:
        """(n,) whose shapes have no interior; False where they are unknown."""
        return np.array([*(not each.is_solid for each in self.shapes), False])[self._known]

    @property
    def _known(self) -> npt.NDArray[np.int64]:
        return np.where(self.unknown, len(self.shapes), self.index)


def read_table(
    shape: Any, shapes: Any, bodies: int, mistakes: list[Mistake], unread: npt.NDArray[np.bool_] | None = None
) -> Table:
    """Returns the shapes of bodies as they are given to a scene, and appends their mistakes, except those of
    (n,) bodies whose numbers were not read."""
    nothing, everything = np.zeros(bodies, dtype=np.int64), np.ones(bodies, dtype=np.bool_)
    if isinstance(shape, Shape):
        if shapes:
            mistakes.append(Mistake("shape", "a shape beside the table of shapes", "its number in the table"))
        shape, shapes = 0, (shape,)
    table = tuple(shapes) if isinstance(shapes, tuple | list) else ()
    if not all(isinstance(each, Shape) for each in table) or not (table or unread is not None):
        mistakes.append(Mistake("shapes", shown(shapes), "a list of shapes: kt.box(...), kt.disc(...), ..."))
        return Table((), nothing, everything)
    given = np.asarray(shape)
    if (given.dtype.kind not in "iu" and given.size) or given.shape not in ((), (bodies,)):
        right = f"the number of a shape for each of the {bodies} bodies, or one for all"
        mistakes.append(Mistake("shape", "nothing" if shape is None else shown(shape), right))
        return Table(table, nothing, everything)
    index = np.array(np.broadcast_to(given, (bodies,)), dtype=np.int64)
    known = everything if unread is None else ~unread
    there = (index >= 0) & (index < len(table))
    right = f"the number of a shape, 0 to {len(table) - 1}" if table else "a table [[shapes]] to count in"
    for i in np.flatnonzero(known & ~there).tolist():
        mistakes.append(Mistake(f"bodies[{i}].shape", str(index[i]), right))
    return Table(table, index, ~(known & there))


def are_given(shape: object, shapes: object) -> bool:
    """Whether arguments of a scene have shapes; -1 for every body, beside no table, are discs."""
    if not isinstance(shapes, tuple | list) or shapes:
        return True
    discs = shape is None or (isinstance(shape, np.ndarray) and bool((shape == -1).all()))
    return not discs


def overlapping_shapes(position: Floats, table: Table, bodies: npt.NDArray[np.intp], pairs: Ints) -> Ints:
    """Returns those of (k, 2) pairs whose shapes overlap; the circles around them do.

    Most are apart along an axis by more than rounding explains, or touch there. The others are decided
    exactly.
    """
    reaches, shape = table.reaches[bodies], table.index[bodies]
    a, b = pairs.T
    apart = position[b] - position[a]
    deep = np.minimum(reaches[a, 1::2] + reaches[b, ::2] - apart, reaches[a, ::2] + reaches[b, 1::2] + apart)
    size = table.radius[bodies]
    rounding = 2.0**-50 * (np.abs(position[a]) + np.abs(position[b]) + (size[a] + size[b])[:, np.newaxis])
    open_pairs = np.flatnonzero(
        (deep + rounding > TOLERANCE * (size[a] + size[b])[:, np.newaxis]).all(axis=1)
    )
    kept = []
    for k in open_pairs.tolist():
        (x, y), (other_x, other_y) = position[pairs[k]].tolist()
        one, other = (table.shapes[each] for each in shape[pairs[k]].tolist())
        if overlap(one, other, (Fraction(other_x) - Fraction(x), Fraction(other_y) - Fraction(y))):
            kept.append(k)
    return pairs[kept]


def overlap(one: Shape, other: Shape, apart: Exact) -> bool:
    """Whether two bodies whose reference points are so far apart overlap, by more than the tolerance: 1e-12
    of the sum of their reaches."""
    allowed = Fraction(TOLERANCE) * (Fraction(one.reach) + Fraction(other.reach))
    radii = Fraction(one.radius) + Fraction(other.radius)
    return is_closer(core_difference(one.core, other.core), apart, radii - allowed)
