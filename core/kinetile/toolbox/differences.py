"""The differences of shapes, as rows of doubles for the kernel's certificate of convex bodies.

For each two shapes of two bodies, the corners and faces of the first core less the second are computed in
rationals, once (``kinetile.scene.differences``). A difference of two doubles is exactly the sum of two
doubles, so the corners are stored exactly; and each face is along an edge of one of the cores.
"""

import math
from collections.abc import Iterable
from fractions import Fraction
from functools import lru_cache

import numpy as np

from kinetile.arrays import Floats
from kinetile.errors import Refused
from kinetile.kernel.certificates.shapes_exactly import FIRST_CORNER, WIDE
from kinetile.scene.differences import Exact, Place, core_difference, cross, dot, exact, less
from kinetile.scene.shapes import Shape

Outline = tuple[tuple[Place, ...], float]
"""A core and a radius."""

DISC = ((0.0, 0.0),)
"""The core of a disc."""


def circle_around(outline: Outline) -> float:
    """Returns the radius of a circle around the reference point that contains an outline."""
    core, radius = outline
    return radius + max(math.hypot(*corner) for corner in core) * (1.0 + 2.0**-40)


MOST = 40_000
"""The most differences of a scene: some seconds, and 100 MB."""


def difference_table(shapes: tuple[Shape, ...], pairs: Iterable[tuple[int, int]]) -> Floats:
    """Returns the table for pairs of shapes, by their numbers: the number of shapes; the first index of the
    row of shape i less shape j, at 1 + i len(shapes) + j, or 0 without one; and the rows
    (``kinetile.kernel.certificates.shapes_exactly``)."""
    wanted = sorted(set(pairs))
    if len(wanted) > MOST:
        raise Refused(
            f"this scene has {len(wanted):,} pairs of shapes that can meet, of {len(shapes):,} shapes, and "
            f"up to {MOST:,} are worked out beforehand: give more bodies the same shape"
        )
    return _table(shapes, tuple(wanted)).copy()


@lru_cache(maxsize=2)  # a scene is prepared for a run, then for each growth of its tables and each copy of it
def _table(shapes: tuple[Shape, ...], wanted: tuple[tuple[int, int], ...]) -> Floats:
    index = np.zeros(1 + len(shapes) ** 2)
    index[0] = len(shapes)
    rows, end = [index], len(index)
    for i, j in wanted:
        index[1 + i * len(shapes) + j] = end
        rows.append(difference_row((shapes[i].core, shapes[i].radius), (shapes[j].core, shapes[j].radius)))
        end += len(rows[-1])
    return np.concatenate(rows)


@lru_cache(maxsize=4096)
def difference_row(one: Outline, other: Outline) -> Floats:
    """Returns the row of a difference, from the cores and radii of two shapes."""
    corners = core_difference(one[0], other[0])
    radius = Fraction(one[1]) + Fraction(other[1])
    edges = [*_edges(one[0]), *_edges(other[0])]
    count = len(corners)
    ways = [less(corners[(k + 1) % count], corner) for k, corner in enumerate(corners)]
    ranks = _ranks([(y, -x) for x, y in ways]) if count > 1 else [0]
    flush = 2.0**-39 * (_extent(one) + _extent(other)) if count > 1 else 0.0
    exactly = [*_parts(radius), flush]
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
        flush,
    ]
    assert len(head) == FIRST_CORNER
    assert len(body) == WIDE * count
    row = np.array([*head, *body])
    row.flags.writeable = False
    return row


def _extent(outline: Outline) -> float:
    """Returns the size of an outline, for the width of a strip (rule 5s)."""
    core, radius = outline
    return radius + max(abs(c) for corner in core for c in corner)


def _edges(core: tuple[Place, ...]) -> list[Exact]:
    """Returns the vectors from corner to corner of a core, forwards and, for a line, backwards."""
    corners = list(map(exact, core))
    if len(corners) == 1:
        return []
    return [less(corners[(k + 1) % len(corners)], corner) for k, corner in enumerate(corners)]


def _in_parts(way: Exact, edges: list[Exact]) -> Exact:
    """Returns a vector of sums of two doubles along a way: the way itself, or a core's edge beside it."""
    x, y = way
    if x == 0 or y == 0:  # a vector of length 1: products with it are not rounded
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
    """Returns a number as the sum of two doubles, as nearly as possible."""
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
