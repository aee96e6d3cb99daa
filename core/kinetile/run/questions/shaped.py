"""Positions of the present moment in a scene with shapes: bodies in a box, near a point, on a ray.

A body is all that is within its radius of its core (``kinetile.scene.shapes``). So each question is one of a
place and a convex polygon: for a point or a ray that is the core, for a box the difference of box and core.
The circle around each shape comes first, then bounds in floating point, and what these leave open is decided
in rationals.
"""

from __future__ import annotations

import math
from bisect import insort
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import chain

import numpy as np

from kinetile.run.questions.exact import Floats, Truths, compare_roots, difference_of_roots, in_order, whole
from kinetile.run.questions.places import (
    BY_ENTRY,
    Box,
    EntryOfRay,
    Integers,
    Moment,
    Point,
    RayHit,
    in_the_way,
)
from kinetile.scene.differences import Number, core_difference, cross, dot, exact, less
from kinetile.scene.shapes import Shape

ROUNDING = 2.0**-47
"""What the bounds allow for, as a part of all lengths in question: 64 ULP, several times what they need.

Each coordinate is a sum of three or four of these lengths. The distance from a side is that from some point
of it, whatever rounding does to which point; so its error has the same size.
"""

LARGE = 2.0**400
"""From here on squares of squares may overflow, and the bounds settle nothing."""


def bodies_in(moment: Moment, box: Box, inside: bool = False) -> Integers:
    """Returns the slots of the bodies that have a point in common with a box, including edges, or, with
    ``inside``, that lie in it completely. In the order of ``moment.slots``."""
    low, high = np.array(box).reshape(2, 2)
    # rounding a difference keeps its order to a double: no circle that touches the box is left out
    circles = np.maximum(low - moment.places, moment.places - high).max(axis=1)
    few = np.flatnonzero(circles <= moment.radii)
    corners, radii = _cores(moment, few)
    spots = moment.places[few][:, None] + corners
    out = np.maximum(low - spots, spots - high)  # (m, corners, 2), above 0 outside
    margin = ROUNDING * (np.abs(spots).max(axis=(1, 2)) + np.abs(moment.places[few]).max(axis=1))
    margin += ROUNDING * (radii + np.abs(box).max())
    if inside:
        farthest = out.max(axis=(1, 2)) + radii
        held, unsure = farthest <= -margin, np.abs(farthest) < margin
    else:
        depth = np.minimum(out.max(axis=2), 0.0)
        nearest = (np.hypot(*np.maximum(out, 0.0).transpose(2, 0, 1)) + depth).min(axis=1)
        aside = np.maximum(low - spots.max(axis=1), spots.min(axis=1) - high).max(axis=1)
        held = nearest - radii <= -margin
        unsure = ~held & (aside - radii < margin)
    for i in np.flatnonzero(unsure).tolist():
        held[i] = _is_in(*_shape_and_place(moment, int(few[i])), box, inside)
    return np.asarray(moment.slots[few[held]])


def _shape_and_place(moment: Moment, at: int) -> tuple[Shape, Point]:
    x, y = moment.places[at].tolist()
    return moment.shapes[int(moment.forms[at])], (x, y)


def _cores(moment: Moment, few: Integers) -> tuple[Floats, Floats]:
    """Returns the corners of the cores of a few bodies, (m, most, 2), the last one repeated where there are
    fewer, and (m,) their radii."""
    forms, which = np.unique(moment.forms[few], return_inverse=True)
    shapes = [moment.shapes[form] for form in forms.tolist()]
    most = max((len(shape.core) for shape in shapes), default=1)
    cores = [(*shape.core, *[shape.core[-1]] * (most - len(shape.core))) for shape in shapes]
    return np.array(cores).reshape(-1, most, 2)[which], np.array([shape.radius for shape in shapes])[which]


def _is_in(shape: Shape, place: Point, box: Box, inside: bool) -> bool:
    """Whether a body has a point in common with a box, or is ``inside`` it completely."""
    left, bottom, right, top = box
    if not inside:
        sides = core_difference(((left, bottom), (right, bottom), (right, top), (left, top)), shape.core)
        return _signed_square(sides, exact(place)) <= Fraction(shape.radius) ** 2
    r, axes = Fraction(shape.radius), zip(*map(exact, shape.core), strict=True)
    return all(
        low <= at + min(axis) - r and at + max(axis) + r <= high
        for axis, at, low, high in zip(axes, exact(place), box[:2], box[2:], strict=True)
    )


def _signed_square(corners: Sequence[tuple[Number, Number]], place: tuple[Number, Number]) -> Fraction:
    """Returns the square of the distance of a place from the outline of a convex polygon, negative inside."""
    squares, inside = [], len(corners) > 2
    for k, corner in enumerate(corners):
        side, at = less(corners[(k + 1) % len(corners)], corner), less(place, corner)
        length, along, depth = dot(side, side), dot(side, at), cross(side, at)
        inside &= depth > 0
        squares.append(Fraction(depth * depth, length) if 0 < along < length else Fraction(dot(at, at)))
    return -min(squares) if inside else min(squares)


def bodies_near(
    moment: Moment, point: Point, radius: float | None = None, count: int | None = None
) -> Integers:
    """Returns the slots of the bodies that are near a point, the nearest first, ties in the order of
    ``moment.slots``.

    How far a body is from a point is the distance to its outline, below 0 where the point is within: that to
    the core, or within the core that to the outline of the core, negated, less the radius.
    """
    limit = math.inf if radius is None else radius
    centre = np.hypot(*(moment.places - np.array(point)).T)
    reach = moment.radii + ROUNDING * (centre + moment.radii)
    few = np.flatnonzero(_may_be_first(centre - reach, centre + reach, count) & (centre - reach <= limit))
    lower, upper = _bounds(moment, few, point)
    held = _may_be_first(lower, upper, count) & (lower <= limit)
    few, lower, upper = few[held], lower[held], upper[held]

    @cache
    def distance(i: int) -> tuple[Fraction, Fraction]:
        shape, place = _shape_and_place(moment, int(few[i]))
        square = _signed_square([exact(c) for c in shape.core], less(exact(point), exact(place)))
        return square, Fraction(shape.radius)

    def compare(i: int, j: int) -> int:
        (one, r), (other, s) = distance(i), distance(j)
        return _compare_distances(one, other, r - s)

    def is_near(i: int) -> bool:
        return bool(upper[i] <= limit) or distance(i)[0] <= (distance(i)[1] + Fraction(limit)) ** 2

    nearest = in_order(lower, upper, compare)[:count]
    return np.asarray(moment.slots[few[[i for i in nearest if is_near(i)]]])


def _may_be_first(lower: Floats, upper: Floats, count: int | None) -> Truths:
    """Returns which of n values between bounds may be among the ``count`` smallest."""
    if count is None or count >= len(lower):
        return np.ones(len(lower), dtype=np.bool_)
    return lower <= (np.partition(upper, count - 1)[count - 1] if count else -np.inf)


def _bounds(moment: Moment, few: Integers, point: Point) -> tuple[Floats, Floats]:
    """Returns bounds of the distances of a few bodies from a point."""
    corners, radii = _cores(moment, few)
    place = np.array(point) - moment.places[few]
    size = np.abs(place).sum(axis=1) + np.abs(corners).sum(axis=2).max(axis=1) + radii
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        sides, at = np.roll(corners, -1, axis=1) - corners, place[:, None] - corners
        squares = (sides * sides).sum(axis=2)  # 0 where a corner is repeated
        along = np.where(squares > 0.0, np.clip((sides * at).sum(axis=2) / squares, 0.0, 1.0), 0.0)
        distance = np.hypot(*(at - along[:, :, None] * sides).transpose(2, 0, 1)).min(axis=1)
        turns = sides[:, :, 0] * at[:, :, 1] - sides[:, :, 1] * at[:, :, 0]
        depth = np.where(squares > 0.0, turns / np.sqrt(squares), np.inf).min(axis=1)
    margin = ROUNDING * size
    solid = (squares > 0.0).sum(axis=1) > 2
    outside, inside = ~solid | (depth < -margin), solid & (depth > margin)
    lower = np.where(outside, distance, -distance) - radii - margin
    upper = np.where(inside, -distance, distance) - radii + margin
    return np.where(size < LARGE, lower, -np.inf), np.where(size < LARGE, upper, np.inf)


def _compare_distances(one: Fraction, other: Fraction, more: Fraction) -> int:
    """Returns the sign of the distance with one signed square, less that with another, less ``more``."""
    if one >= 0 and other >= 0:
        return compare_roots(one, other, more)
    if one < 0 and other < 0:
        return compare_roots(-other, -one, more)
    if one < 0:
        return -_compare_distances(other, one, -more)
    if more <= 0:
        return 1  # as sqrt(one) + sqrt(-other) is above 0
    return compare_roots(-4 * one * other, Fraction(0), more * more - one + other)


def ray(
    moment: Moment, origin: Point, direction: Point, most: int | None = None, within: float | None = None
) -> list[RayHit]:
    """Returns the bodies that a ray meets, the nearest first, ties in the order of ``moment.slots``; not more
    than ``most``, and none further than ``within``. The bodies of the hits are slots; the direction's length
    does not matter, and is not 0."""
    few, _, bounds = in_the_way(moment, origin, direction, within)
    (ux, uy), _ = whole(direction)
    met: list[EntryOfRay] = []
    for at, bound in zip(few.tolist(), bounds, strict=True):
        if most is not None and len(met) >= most and (most == 0 or met[most - 1].distance < bound):
            break
        entry = _entry(moment, at, origin, (ux, uy), within)
        if entry is not None:
            insort(met, entry, key=BY_ENTRY)
    return [RayHit(int(moment.slots[entry.at]), entry.distance) for entry in met[:most]]


def _entry(
    moment: Moment, at: int, origin: Point, u: tuple[int, int], within: float | None
) -> EntryOfRay | None:
    """Returns where a ray enters a body; None: it does not, or not as near as ``within``.

    It enters over a side of the core, or in the disc around a corner: the first of the discs that it meets.
    """
    shape, place = _shape_and_place(moment, at)
    (ox, oy, x, y, r, *core), unit = whole([*origin, *place, shape.radius, *chain(*shape.core)])
    corners, start, n = list(zip(core[::2], core[1::2], strict=True)), (ox - x, oy - y), dot(u, u)
    if _signed_square(corners, start) <= r * r:
        return EntryOfRay(0, 0, 0.0, at)
    over = disc = None  # (p, q, w): it enters after (p - sqrt(q)) / w times u
    for k, corner in enumerate(corners):
        side, away = less(corners[(k + 1) % len(corners)], corner), less(corner, start)
        ahead, d = dot(away, u), r * r * n - cross(away, u) ** 2
        if ahead > 0 and d >= 0 and (not disc or compare_roots(disc[1], d, disc[0] - ahead) < 0):
            disc = ahead, d, n
        # the gap to the line through a side, times its length, falls by ``fall`` in each u, to sqrt(q)
        gap, fall, length = cross(side, away), cross(side, u), dot(side, side)
        q, drift = r * r * length, dot(side, u)
        if fall > 0 and gap >= 0 and gap * gap >= q:
            begin = drift * gap - fall * dot(side, away)  # along the side (begin - drift sqrt(q)) / fall
            if _is_above(begin, -drift, q) and _is_above(length * fall - begin, drift, q):
                over = gap, q, fall
    entry = over or disc
    if entry is None:
        return None
    p, q, w = entry[0] * n, entry[1] * n * n, entry[2] * unit  # of a way: (p - sqrt(q)) / (w sqrt(n))
    if within is not None and compare_roots(p * p * n, q * n, Fraction(within) * w * n) > 0:
        return None
    return EntryOfRay(Fraction(p, w), Fraction(q, w * w), difference_of_roots(p, q, n, w), at)


def _is_above(c: int, b: int, q: int) -> bool:
    """Whether c + b sqrt(q) >= 0."""
    return compare_roots(b * b * q, 0, -c) >= 0 if b > 0 else compare_roots(b * b * q, 0, c) <= 0
