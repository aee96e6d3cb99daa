"""Who is in a box, and who is near a point, now."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt

from kinetile.run.questions.exact import compare_roots, compare_squares, in_order, whole
from kinetile.run.questions.moment import Moment

__all__ = ["Box", "Point", "bodies_in", "bodies_near"]

Box = tuple[float, float, float, float]
"""left, bottom, right, top; left <= right and bottom <= top."""

Point = tuple[float, float]

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Truths = npt.NDArray[np.bool_]


def bodies_in(moment: Moment, box: Box, inside: bool = False) -> Integers:
    """Return the slots of the bodies that have a point in common with a box, edges and all; of those that are
    ``inside``, with all of their points, where that is asked. In the order of ``moment.slots``."""
    x, y = moment.places.T
    left, bottom, right, top = box
    with np.errstate(over="ignore", invalid="ignore"):
        if inside:
            r = moment.radii
            held = (
                _apart_by(x, left, r)
                & _apart_by(right, x, r)
                & _apart_by(y, bottom, r)
                & _apart_by(top, y, r)
            )
        else:
            held = _touching_box(x, y, moment.radii, box)
    return moment.slots[held]


def bodies_near(
    moment: Moment, point: Point, radius: float | None = None, count: int | None = None
) -> Integers:
    """Return the slots of the bodies that are near a point, the nearest first, ties in the order of
    ``moment.slots``.

    How far a body is from a point is the distance to its centre less its radius: below 0 where the point is
    within. Near are bodies not further than ``radius``, and not more than ``count`` of them.
    """
    x, y = moment.places.T
    with np.errstate(over="ignore", invalid="ignore"):
        squares = _square(x - point[0]) + _square(y - point[1])
        centre = np.sqrt(squares)
        # the root is off by 3.5 ULP of itself and the difference by one more of what is less than both
        margin = 2.0**-50 * (centre + moment.radii)
        known = squares < 2.0**1000
        lower = np.where(known, (centre - moment.radii) - margin, -np.inf)
        upper = np.where(known, (centre - moment.radii) + margin, np.inf)
        held = np.ones(len(lower), dtype=np.bool_)
        if radius is not None:
            held = _within(moment, squares, point, radius)
    few = np.flatnonzero(held)
    if count is not None and count < len(few):
        if count == 0:
            return moment.slots[:0]
        last = np.partition(upper[few], count - 1)[count - 1]  # so many are not further than this
        few = few[lower[few] <= last]

    @cache
    def exact() -> tuple[list[int], list[int]]:
        return _exact_distances(moment, few, point)

    def compare(i: int, j: int) -> int:
        squared, radii = exact()
        return compare_roots(squared[i], squared[j], radii[i] - radii[j])

    order = in_order(lower[few], upper[few], compare)
    return moment.slots[few[order[:count]]]


def _square(a: Floats) -> Floats:
    return a * a


def _apart_by(far: Floats | float, near: Floats | float, radius: Floats) -> Truths:
    """Return where far - near >= radius.

    Rounding a difference keeps its order to a double: only where it rounds to the radius itself does what
    rounding took decide, and that is known (Knuth's sum).
    """
    apart = np.asarray(far - near)
    part = apart - far
    lost = (far - (apart - part)) - (near + part)
    return np.asarray((apart > radius) | ((apart == radius) & (lost >= 0.0)))


def _touching_box(x: Floats, y: Floats, radius: Floats, box: Box) -> Truths:
    """Return which discs have a point in common with a box: their centres are a radius from it, or less."""
    left, bottom, right, top = box
    dx = np.maximum(np.maximum(left - x, x - right), 0.0)
    dy = np.maximum(np.maximum(bottom - y, y - top), 0.0)
    held, unsure = compare_squares(_square(dx) + _square(dy), _square(radius))
    for i in np.flatnonzero(unsure).tolist():
        (a, b, r, l_, b_, r_, t_), _ = whole([x[i], y[i], radius[i], *box])
        held[i] = max(l_ - a, a - r_, 0) ** 2 + max(b_ - b, b - t_, 0) ** 2 <= r * r
    return held


def _within(moment: Moment, squares: Floats, point: Point, radius: float) -> Truths:
    """Return whose centre is ``radius`` and its own radius from a point, or less."""
    held, unsure = compare_squares(squares, _square(radius + moment.radii))
    for i in np.flatnonzero(unsure).tolist():
        (x, y, r, px, py, reach), _ = whole([*moment.places[i], moment.radii[i], *point, radius])
        held[i] = (x - px) ** 2 + (y - py) ** 2 <= (r + reach) ** 2
    return held


def _exact_distances(moment: Moment, few: Integers, point: Point) -> tuple[list[int], list[int]]:
    """Return squares of distances to centres, and radii, as whole numbers of one unit, and of its square."""
    n = len(few)
    columns = (*moment.places[few].T, moment.radii[few])
    (px, py, *numbers), _ = whole([*point, *np.concatenate(columns).tolist()])
    x, y, radii = numbers[:n], numbers[n : 2 * n], numbers[2 * n :]
    return [(a - px) ** 2 + (b - py) ** 2 for a, b in zip(x, y, strict=True)], radii
