"""Differences of convex cores, in rationals. The *difference* of two cores is the hull of all p - q, with p a
corner of the first core and q of the second. Let d be the second reference point minus the first: the bodies
touch if d is as far from the difference as the sum of their radii. So the test needs a point and one polygon.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import TypeVar

Place = tuple[float, float]
Exact = tuple[Fraction, Fraction]
Number = TypeVar("Number", int, Fraction)
Vector = tuple[Number, Number]


@lru_cache(maxsize=4096)
def core_difference(one: tuple[Place, ...], other: tuple[Place, ...]) -> tuple[Exact, ...]:
    """Returns the exact corners of the difference of two cores: anticlockwise from the one with the smallest
    x, then y, no three in one line; two are a line, one is a point."""
    unit = max(c.as_integer_ratio()[1] for core in (one, other) for place in core for c in place)
    first, second = ([(int(x * unit), int(y * unit)) for x, y in map(exact, each)] for each in (one, other))
    places = sorted({less(a, b) for a in first for b in second})  # whole numbers: rationals take far longer
    hull = places if len(places) == 1 else _hull(places)
    return tuple([(Fraction(x, unit), Fraction(y, unit)) for x, y in hull])


def _hull(places: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Returns the corners of the hull of several places in order, as ``core_difference`` has them."""
    hull: list[tuple[int, int]] = []
    for side in (places, places[::-1]):  # below the line from the first to the last, then above
        first = len(hull)
        for place in side:
            while len(hull) > first + 1 and cross(less(hull[-1], hull[-2]), less(place, hull[-1])) <= 0:
                hull.pop()
            hull.append(place)
        hull.pop()
    return hull


def is_closer(corners: Sequence[Exact], place: Exact, distance: Fraction) -> bool:
    """Returns True if a place is closer to a convex polygon than a distance; below 0: deeper inside."""
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
    """Returns the vector from the second place to the first."""
    return one[0] - other[0], one[1] - other[1]


def cross(one: Vector[Number], other: Vector[Number]) -> Number:
    """Returns the cross product: above 0 if the second vector is to the left of the first."""
    return one[0] * other[1] - one[1] * other[0]


def dot(one: Vector[Number], other: Vector[Number]) -> Number:
    """Returns the scalar product."""
    return one[0] * other[0] + one[1] * other[1]
