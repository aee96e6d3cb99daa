"""Who stands in the way of a ray, now.

With d from the origin to a centre, u the direction and r the radius, the ray meets a disc if it begins in it,
|d| <= r, or else if d.u > 0 and (d x u)^2 <= r^2 |u|^2: a ray that grazes meets. It enters after

    (d.u - sqrt(r^2 |u|^2 - (d x u)^2)) / |u|

A filter in floating point leaves those whom it cannot pass by with certainty, each with a bound below where
the ray can enter it. They are taken in the order of these bounds and asked exactly, until so many have been
met, as were wanted, before the bound of the next.
"""

from __future__ import annotations

import math
from bisect import insort
from functools import cmp_to_key
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.run.questions.exact import compare_roots, difference_of_roots, whole
from kinetile.run.questions.moment import Moment
from kinetile.run.questions.places import Point

__all__ = ["RayHit", "ray"]

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class RayHit(NamedTuple):
    """A body that a ray meets.

    Attributes:
        body: which.
        distance: how far from the ray's origin it is met, in the scene's unit, to the nearest double; 0.0
            where the ray begins in the body.
    """

    body: int
    distance: float


class _Entry(NamedTuple):
    """Where a ray enters a body: (dot - sqrt(d)) / |u|, that to the nearest double, and which body it is."""

    dot: int
    d: int
    distance: float
    at: int


def ray(moment: Moment, origin: Point, direction: Point, most: int | None = None) -> list[RayHit]:
    """Return the bodies that a ray meets, the nearest first, ties in the order of ``moment.slots``; not more
    than ``most``. The bodies of the hits are slots; the direction's length does not matter, and is not 0."""
    few, bounds = _in_the_way(moment, origin, direction)
    columns = (*moment.places[few].T, moment.radii[few])
    (ox, oy, *numbers), unit = whole([*origin, *np.concatenate(columns).tolist()])
    n = len(few)
    (ux, uy), _ = whole(direction)
    length2 = ux * ux + uy * uy
    met: list[_Entry] = []
    for place, at in enumerate(few.tolist()):
        if most is not None and len(met) >= most and (most == 0 or met[most - 1].distance < bounds[place]):
            break
        x, y, r = (numbers[place + i * n] for i in range(3))
        x, y = x - ox, y - oy
        if x * x + y * y <= r * r:
            insort(met, _Entry(0, 0, 0.0, at), key=_KEY)
            continue
        dot, d = x * ux + y * uy, r * r * length2 - (x * uy - y * ux) ** 2
        if dot > 0 and d >= 0:
            insort(met, _Entry(dot, d, difference_of_roots(dot, d, length2, unit), at), key=_KEY)
    return [RayHit(int(moment.slots[entry.at]), entry.distance) for entry in met[:most]]


def _compare(one: _Entry, two: _Entry) -> int:
    """Compare where two bodies are entered; where even the doubles are the same, exactly."""
    if one.distance != two.distance:
        return -1 if one.distance < two.distance else 1
    return compare_roots(two.d, one.d, two.dot - one.dot) or one.at - two.at


_KEY = cmp_to_key(_compare)


def _in_the_way(moment: Moment, origin: Point, direction: Point) -> tuple[Integers, list[float]]:
    """Return which bodies a ray may meet, and how far it can get before it does, in ascending order of this.

    With u scaled to between 1/2 and 2, a coordinate of u / |u| is off by 4 ULP of itself, one of d by one,
    and d.u / |u| and (d x u) / |u| by 8 ULP of |dx| + |dy| at most; the margin is twice that and more.
    """
    down = -math.frexp(max(map(abs, direction)))[1]
    ux, uy = (math.ldexp(part, down) for part in direction)  # what underflow takes is 2^-1074 of dx, dy
    length = math.sqrt(ux * ux + uy * uy)
    ux, uy = ux / length, uy / length
    with np.errstate(over="ignore", invalid="ignore"):
        dx, dy = moment.places[:, 0] - origin[0], moment.places[:, 1] - origin[1]
        radius = moment.radii
        margin = 2.0**-49 * ((np.abs(dx) + np.abs(dy)) + radius)
        along = dx * ux + dy * uy
        aside = np.abs(dx * uy - dy * ux)
        passed = (aside > radius + margin) | (along < -(radius + margin))
        few = np.flatnonzero(~passed)
        bound = (along - radius - margin)[few]
    bound[np.isnan(bound)] = -math.inf
    order = np.argsort(bound, kind="stable")
    return few[order], bound[order].tolist()
