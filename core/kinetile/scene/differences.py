"""Differences of convex cores, in rationals: where two bodies touch that do not rotate.

Where the reference point of the second body is d from that of the first, the two touch if d is as far from
the *difference* of their cores, the hull of all corners of the first less all of the second, as the sum of
their radii. So the question of two convex bodies is that of a point and one convex polygon.

For the kernel's certificate the difference of two shapes is a row of doubles
(``kinetile.kernel.certificates.convex_integers`` has its columns), worked out once in rationals. A difference
of two doubles is the sum of two doubles, exactly, so corners are; and a face is along an edge of one of the
cores.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import numpy.typing as npt

from kinetile.errors import Refused

if TYPE_CHECKING:
    from kinetile.scene.shapes import Shape

Place = tuple[float, float]
Exact = tuple[Fraction, Fraction]
Number = TypeVar("Number", int, Fraction)
Vector = tuple[Number, Number]


@lru_cache(maxsize=4096)
def core_difference(one: tuple[Place, ...], other: tuple[Place, ...]) -> tuple[Exact, ...]:
    """Returns the corners of the difference of two cores, exactly.

    They are anticlockwise from the one with the smallest x, of those the smallest y, and no three are in one
    line: two are a line, one is a point.
    """
    places = sorted({less(exact(a), exact(b)) for a in one for b in other})
    if len(places) == 1:
        return tuple(places)
    hull: list[Exact] = []
    for side in (places, places[::-1]):  # what is below the line from the first to the last, then above
        first = len(hull)
        for place in side:
            while len(hull) > first + 1 and cross(less(hull[-1], hull[-2]), less(place, hull[-1])) <= 0:
                hull.pop()
            hull.append(place)
        hull.pop()
    return tuple(hull)


def is_closer(corners: Sequence[Exact], place: Exact, distance: Fraction) -> bool:
    """Whether a place is closer to a convex polygon than a distance; where that is negative, whether it is
    deeper inside than that."""
    within = distance * distance
    inside = len(corners) > 2
    for k, corner in enumerate(corners):
        side, at = less(corners[(k + 1) % len(corners)], corner), less(place, corner)
        length, along, depth = dot(side, side), dot(side, at), cross(side, at)
        near = depth * depth < within * length
        if distance > 0 and (dot(at, at) < within or (0 < along < length and near)):
            return True
        inside &= depth > 0 and (distance >= 0 or depth * depth > within * length)
    return inside


def exact(place: Place) -> Exact:
    """Returns a place in rationals."""
    return Fraction(place[0]), Fraction(place[1])


def less(one: Vector[Number], other: Vector[Number]) -> Vector[Number]:
    """Returns the way from the second place to the first."""
    return one[0] - other[0], one[1] - other[1]


def cross(one: Vector[Number], other: Vector[Number]) -> Number:
    """Returns the cross product: above 0 where the second vector is to the left of the first."""
    return one[0] * other[1] - one[1] * other[0]


def dot(one: Vector[Number], other: Vector[Number]) -> Number:
    """Returns the scalar product."""
    return one[0] * other[0] + one[1] * other[1]


Outline = tuple[tuple[Place, ...], float]
"""A core and a radius."""

DISC = ((0.0, 0.0),)
"""The core of a disc."""

MOST = 40_000
"""Differences that a scene can have: some seconds, and 100 MB."""


def difference_table(shapes: tuple[Shape, ...], pairs: Iterable[tuple[int, int]]) -> npt.NDArray[np.float64]:
    """Returns the table for pairs of shapes, by their numbers: how many shapes there are, where the row of
    the difference of shape i less shape j begins, at 1 + i len(shapes) + j, or 0 where there is none, and the
    rows (``kinetile.kernel.certificates.convex_integers``)."""
    wanted = sorted(set(pairs))
    if len(wanted) > MOST:
        raise Refused(
            f"this scene has {len(wanted):,} pairs of shapes that can meet, of {len(shapes):,} shapes, and "
            f"up to {MOST:,} are worked out beforehand: give more bodies the same shape"
        )
    index = np.zeros(1 + len(shapes) ** 2)
    index[0] = len(shapes)
    rows: list[float] = []
    for i, j in wanted:
        index[1 + i * len(shapes) + j] = len(index) + len(rows)
        rows += difference_row((shapes[i].core, shapes[i].radius), (shapes[j].core, shapes[j].radius))
    return np.concatenate([index, rows])


@lru_cache(maxsize=4096)
def difference_row(one: Outline, other: Outline) -> tuple[float, ...]:
    """Returns the row of a difference, of the cores and radii of two shapes."""
    corners = core_difference(one[0], other[0])
    radius = Fraction(one[1]) + Fraction(other[1])
    edges = [*_edges(one[0]), *_edges(other[0])]
    count = len(corners)
    ways = [less(corners[(k + 1) % count], corner) for k, corner in enumerate(corners)]
    ranks = _ranks([(y, -x) for x, y in ways]) if count > 1 else [0]
    exactly = [*_parts(radius)]
    body: list[float] = []
    for corner, way, rank in zip(corners, ways, ranks, strict=True):
        along = _in_parts(way, edges)
        normal = (along[1], -along[0])
        length = _root(dot(normal, normal))
        out = dot(normal, corner) + radius * length
        columns = [*map(float, corner), *(part for c in corner for part in _parts(c)[1:])]
        columns += [*map(float, along), *(part for c in along for part in _parts(c)[1:])]
        exactly += columns
        tx, ty = map(float, way)
        long = math.sqrt(tx * tx + ty * ty)
        nx, ny = (ty / long, -tx / long) if count > 1 else (0.0, 0.0)
        body += [*columns, *_parts(out), nx, ny, float(out / length) if count > 1 else 0.0, float(rank)]
    sizes = [abs(number) for number in exactly if number]
    size = float(radius) + 2.0 * max((abs(float(c)) for corner in corners for c in corner), default=0.0)
    x, y = zip(*corners, strict=True)
    upright = radius == 0 and count == 4 and len({*x}) == len({*y}) == 2
    head = [
        float(count),
        *_parts(radius),
        max([2.0 * size, *sizes]),
        min(sizes, default=0.0),
        float(upright or (count == 1 and not any(corners[0]))),
    ]
    return (*head, *body)


def _edges(core: tuple[Place, ...]) -> list[Exact]:
    """Returns the ways from corner to corner of a core, forwards and, for a line, backwards."""
    corners = list(map(exact, core))
    if len(corners) == 1:
        return []
    return [less(corners[(k + 1) % len(corners)], corner) for k, corner in enumerate(corners)]


def _in_parts(way: Exact, edges: list[Exact]) -> Exact:
    """Returns a vector along a way that is sums of two doubles: itself, or the edge of a core beside it."""
    x, y = way
    if x == 0 or y == 0:  # one of length 1: products with it round nothing off
        return Fraction((x > 0) - (x < 0)), Fraction((y > 0) - (y < 0))
    for each in (way, *edges, *((-x, -y) for x, y in edges)):
        if (
            cross(each, way) == 0
            and dot(each, way) >= 0
            and all(sum(map(Fraction, _parts(c))) == c for c in each)
        ):
            return each
    raise AssertionError("a face of a difference is along an edge of one of the cores")


def _parts(number: Fraction) -> tuple[float, float]:
    """Returns a number as the sum of two doubles, as nearly as can be."""
    high = float(number)
    return high, float(number - Fraction(high))


def _root(square: Fraction) -> Fraction:
    """Returns the root of a rational, to 2**-160 of it."""
    if square == 0:
        return square
    bits = 2 * max(0, 160 - (square.numerator.bit_length() - square.denominator.bit_length()) // 2)
    return Fraction(math.isqrt((square.numerator << bits) // square.denominator), 1 << (bits // 2))


def _ranks(normals: list[Exact]) -> list[int]:
    """Returns the number of each face, by its normal (rule 5s)."""

    def angle(normal: Exact) -> tuple[bool, Fraction, bool]:
        x, y = normal
        return y != 0, Fraction(0) if y == 0 else -x / y, y < 0 or (y == 0 and x < 0)

    order = sorted(range(len(normals)), key=lambda k: angle(normals[k]))
    return [order.index(k) for k in range(len(normals))]
