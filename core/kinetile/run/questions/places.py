"""Positions of the present moment: bodies in a box, near a point, on a ray."""

from __future__ import annotations

import math
from bisect import insort
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, cached_property, cmp_to_key
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import Clock
from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop.responses import ROOM
from kinetile.kernel.tables import Kernel
from kinetile.run.compose import Composition
from kinetile.run.questions.exact import compare_roots, compare_squares, difference_of_roots, in_order, whole
from kinetile.scene.bodies import in_box, nearest_image
from kinetile.scene.shapes import Shape

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Moment:
    """The present moment of a run, and the bodies in question. It is out of date as soon as the run goes on.

    Attributes:
        k: the kernel's tables.
        slots: (n,) int64, the slots of the bodies in question, in the order of the bodies' numbers:
            ties go by their place here.
        clock: what a tick is in the scene's time.
        composition: the phases; of them only the narrow ones are used.
        shapes: the shapes of a scene that has some: for ``questions.shaped``.
        shape: int64, the index of each body's shape by the body's number, where there are shapes.
        overlapping: (m, 2) slots, the pairs that overlap at the start and have not begun to pass yet.
    """

    k: Kernel
    slots: Integers
    clock: Clock
    composition: Composition
    shapes: tuple[Shape, ...] = ()
    shape: Integers = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    overlapping: Integers = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))

    @property
    def now(self) -> int:
        """The present tick, as the kernel counts."""
        return int(self.k.clock[0].now)

    @property
    def periods(self) -> tuple[float, float]:
        """The periods of the axes; 0 for one that is not periodic."""
        torus = self.k.clock[0].torus
        return float(torus.x), float(torus.y)

    @cached_property
    def aside(self) -> Kernel:
        """The tables with a clock of their own: a narrow phase may report a fault, which is not to end the
        run."""
        return self.k._replace(clock=self.k.clock.copy())

    def begins_with(self, body: int) -> Integers:
        """Returns the slots of the bodies with which a body begins to pass at once, because they overlap at
        the start; where an axis is periodic their nearest images."""
        pairs, k = self.overlapping[(self.overlapping == body).any(axis=1)], self.k
        others = np.asarray(pairs.sum(axis=1) - body)
        if not any(self.periods):
            return others
        apart = positions_now(k, others) - positions_now(k, np.full(len(others), body))
        apart = nearest_image(apart, self.periods)
        return np.asarray(others[np.hypot(*apart.T) < (k.radii[others] + k.radii[body]) * (1.0 - ROOM)])

    @cached_property
    def places(self) -> Floats:
        """(n, 2) where the bodies are, to the bit as ``Simulation.positions`` has them."""
        return in_box(positions_now(self.k, self.slots), self.periods)

    @cached_property
    def radii(self) -> Floats:
        """(n,) their radii; of shapes those of the circles around them."""
        return np.asarray(self.k.radii[self.slots])

    @cached_property
    def forms(self) -> Integers:
        """(n,) the indices of their shapes."""
        return np.asarray(self.shape[self.k.queue["number"][self.slots]])


Box = tuple[float, float, float, float]
"""left, bottom, right, top; left <= right and bottom <= top."""

Point = tuple[float, float]
Truths = npt.NDArray[np.bool_]


def bodies_in(moment: Moment, box: Box, inside: bool = False) -> Integers:
    """Returns the slots of the bodies that have a point in common with a box, including edges, or, with
    ``inside``, that lie in it completely. In the order of ``moment.slots``."""
    periods, radii = moment.periods, moment.radii
    held = np.zeros(len(radii), dtype=np.bool_)
    for shift in _shifts(box, periods, float(radii.max(initial=0.0))):
        held |= _in_box(moment.places + shift, radii, box, inside)
    return moment.slots[held]


def _shifts(box: Box, periods: tuple[float, float], reach: float) -> Iterator[Floats]:
    """Yields the periods, (2,), to be added to places from 0 to a period so that all images come that a box
    may touch: of one that is longer than some periods, as many as show everybody."""
    ranges = []
    for low, high, period in zip(box[:2], box[2:], periods, strict=True):
        if not period:
            ranges.append([0.0])
            continue
        first = math.floor((low - reach) / period) - 1
        last = min(math.floor((high + reach) / period) + 1, first + 6)
        ranges.append([turn * period for turn in range(first, last + 1)])
    for right, up in product(*ranges):
        yield np.array([right, up])


def _in_box(places: Floats, r: Floats, box: Box, inside: bool) -> Truths:
    """Returns which discs are in a box."""
    x, y = places.T
    left, bottom, right, top = box
    with np.errstate(over="ignore", invalid="ignore"):
        if inside:
            return (
                _apart_by(x, left, r)
                & _apart_by(right, x, r)
                & _apart_by(y, bottom, r)
                & _apart_by(top, y, r)
            )
        return _touching_box(x, y, r, box)


def bodies_near(
    moment: Moment, point: Point, radius: float | None = None, count: int | None = None
) -> Integers:
    """Returns the slots of the bodies that are near a point, the nearest first, ties in the order of
    ``moment.slots``.

    How far a body is from a point is the distance to its centre less its radius: below 0 where the point is
    within. Near are bodies not further than ``radius``, and not more than ``count`` of them. Where axes are
    periodic that is the distance of the nearest image, at its rounded place.
    """
    periods = moment.periods
    if any(periods):
        moment = replace(moment)
        moment.__dict__["places"] = np.array(point) + nearest_image(moment.places - np.array(point), periods)
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
        last = np.partition(upper[few], count - 1)[count - 1]  # ``count`` bodies are not further than this
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
    """Returns where far - near >= radius.

    Rounding a difference keeps its order to a double: only where it rounds to the radius itself does what
    rounding took decide, and that is known (Knuth's sum).
    """
    apart = np.asarray(far - near)
    part = apart - far
    lost = (far - (apart - part)) - (near + part)
    return np.asarray((apart > radius) | ((apart == radius) & (lost >= 0.0)))


def _touching_box(x: Floats, y: Floats, radius: Floats, box: Box) -> Truths:
    """Returns which discs have a point in common with a box: their centres are a radius from it, or less."""
    left, bottom, right, top = box
    dx = np.maximum(np.maximum(left - x, x - right), 0.0)
    dy = np.maximum(np.maximum(bottom - y, y - top), 0.0)
    held, unsure = compare_squares(_square(dx) + _square(dy), _square(radius))
    for i in np.flatnonzero(unsure).tolist():
        (a, b, r, l_, b_, r_, t_), _ = whole([x[i], y[i], radius[i], *box])
        held[i] = max(l_ - a, a - r_, 0) ** 2 + max(b_ - b, b - t_, 0) ** 2 <= r * r
    return held


def _within(moment: Moment, squares: Floats, point: Point, radius: float) -> Truths:
    """Returns bodies whose centre is ``radius`` and its own radius from a point, or less."""
    held, unsure = compare_squares(squares, _square(radius + moment.radii))
    for i in np.flatnonzero(unsure).tolist():
        (x, y, r, px, py, reach), _ = whole([*moment.places[i], moment.radii[i], *point, radius])
        held[i] = (x - px) ** 2 + (y - py) ** 2 <= (r + reach) ** 2
    return held


def _exact_distances(moment: Moment, few: Integers, point: Point) -> tuple[list[int], list[int]]:
    """Returns squares of distances to centres, and radii, as whole numbers of one unit, and of its square."""
    n = len(few)
    columns = (*moment.places[few].T, moment.radii[few])
    (px, py, *numbers), _ = whole([*point, *np.concatenate(columns).tolist()])
    x, y, radii = numbers[:n], numbers[n : 2 * n], numbers[2 * n :]
    return [(a - px) ** 2 + (b - py) ** 2 for a, b in zip(x, y, strict=True)], radii


class RayHit(NamedTuple):
    """A body that a ray meets.

    Attributes:
        body: which.
        distance: how far from the ray's origin it is met, in the scene's unit, to the nearest double; 0.0
            where the ray begins in the body.
    """

    body: int
    distance: float


class EntryOfRay(NamedTuple):
    """Where a ray enters a body: (dot - sqrt(d)) / |u|, that to the nearest double, and which body it is."""

    dot: int | Fraction
    d: int | Fraction
    distance: float
    at: int


def ray(
    moment: Moment, origin: Point, direction: Point, most: int | None = None, within: float | None = None
) -> list[RayHit]:
    """Returns the bodies that a ray meets, the nearest first, ties in the order of ``moment.slots``; not more
    than ``most``, and none further than ``within``. The bodies of the hits are slots; the direction's length
    does not matter, and is not 0. Where axes are periodic ``within`` is needed, and a body is met where the
    ray first enters one of its images, at exactly whole periods from its place."""
    periods = moment.periods
    if any(periods):
        assert within is not None
        if most is not None and within > 2.0 * max(periods):  # the first are mostly found near the origin
            hits = ray(moment, origin, direction, most, 0.25 * within)
            if len(hits) == most:
                return hits
        # the remainder of doubles is a double: so images have small numbers, and nothing is rounded
        x, y = (math.remainder(at, p) if p else at for at, p in zip(origin, periods, strict=True))
        origin = x, y
    few, images, bounds = in_the_way(moment, origin, direction, within)
    columns = (*moment.places[few].T, moment.radii[few])
    numbers, unit = whole([*origin, *periods, within or 0.0, *np.concatenate(columns).tolist()])
    ox, oy, width, height, reach = numbers[:5]
    n = len(few)
    (ux, uy), _ = whole(direction)
    length2 = ux * ux + uy * uy
    met: list[EntryOfRay] = []
    first: dict[int, EntryOfRay] = {}  # of those in ``met``, by body
    for place, at in enumerate(few.tolist()):
        if most is not None and len(met) >= most and (most == 0 or met[most - 1].distance < bounds[place]):
            break
        if at in first and first[at].distance < bounds[place]:
            continue
        x, y, r = (numbers[5 + place + i * n] for i in range(3))
        x, y = x - ox + images[place][0] * width, y - oy + images[place][1] * height
        beyond = x * x + y * y - r * r
        entry = EntryOfRay(0, 0, 0.0, at)
        if beyond > 0:
            dot, d = x * ux + y * uy, r * r * length2 - (x * uy - y * ux) ** 2
            if dot <= 0 or d < 0 or not (within is None or _is_within(reach, dot, beyond, length2)):
                continue
            entry = EntryOfRay(dot, d, difference_of_roots(dot, d, length2, unit), at)
        if at in first:
            if _compare(first[at], entry) <= 0:
                continue
            met.remove(first[at])
        first[at] = entry
        insort(met, entry, key=BY_ENTRY)
    return [RayHit(int(moment.slots[entry.at]), entry.distance) for entry in met[:most]]


def _is_within(reach: int, dot: int, beyond: int, length2: int) -> bool:
    """Whether a ray has entered a disc on its way after a length ``reach``: then it has come to where it is
    nearest to the centre, or it ends in the disc. ``beyond`` is |d|^2 - r^2, above 0."""
    far = reach * reach
    return dot * dot <= far * length2 or (far + beyond) ** 2 * length2 <= 4 * far * dot * dot


def _compare(one: EntryOfRay, two: EntryOfRay) -> int:
    """Compares where two bodies are entered; where even the doubles are the same, exactly."""
    if one.distance != two.distance:
        return -1 if one.distance < two.distance else 1
    return compare_roots(two.d, one.d, two.dot - one.dot) or one.at - two.at


BY_ENTRY = cmp_to_key(_compare)


def in_the_way(
    moment: Moment, origin: Point, direction: Point, within: float | None
) -> tuple[Integers, list[list[int]], list[float]]:
    """Returns which bodies a ray may meet, through which images, and how far it can get before it does, in
    ascending order of this.

    With u scaled to between 1/2 and 2, a coordinate of u / |u| is off by 4 ULP of itself, and one of d, with
    the periods added to it, by 3 of what it is made of. So d.u / |u| and (d x u) / |u| are off by 9 ULP of
    the sum of that at most; the margin has 16.
    """
    down = -math.frexp(max(map(abs, direction)))[1]
    ux, uy = (math.ldexp(part, down) for part in direction)  # what underflow takes is 2^-1074 of dx, dy
    length = math.sqrt(ux * ux + uy * uy)
    ux, uy = ux / length, uy / length
    radius, (width, height) = moment.radii, moment.periods
    images: Iterable[tuple[int, int]] = [(0, 0)]
    if within is not None and (width or height):
        flight = within * ux, within * uy
        images = _images_near(origin, flight, (width, height), float(radius.max(initial=0.0)))
    found: list[tuple[Integers, Integers, Floats]] = []
    with np.errstate(over="ignore", invalid="ignore"):
        x, y = moment.places[:, 0] - origin[0], moment.places[:, 1] - origin[1]
        size = np.abs(x) + np.abs(y)
        for m, n in images:
            dx, dy = x + m * width, y + n * height
            margin = 2.0**-49 * ((size + (abs(m) * width + abs(n) * height)) + radius)
            along = dx * ux + dy * uy
            aside = np.abs(dx * uy - dy * ux)
            bound = along - radius - margin
            passed = (aside > radius + margin) | (along < -(radius + margin))
            if within is not None:
                passed |= bound > within
            few = np.flatnonzero(~passed)
            found.append((few, np.full((len(few), 2), (m, n)), bound[few]))
    bodies, through, bounds = (np.concatenate(part) for part in zip(*found, strict=True))
    bounds[np.isnan(bounds)] = -math.inf
    order = np.argsort(bounds, kind="stable")
    return bodies[order], through[order].tolist(), bounds[order].tolist()


def _images_near(
    origin: Point, flight: Point, periods: tuple[float, float], radius: float
) -> Iterator[tuple[int, int]]:
    """Yields the images, (m, n), of the box from 0 to a period of which a ray comes as near as ``radius``.

    Column by column, and in each the rows beside that part of the ray which is near it. Along each axis they
    are near each other within more than all rounding.
    """
    near = [
        radius + 2.0**-40 * (abs(at) + abs(way) + period + radius)
        for at, way, period in zip(origin, flight, periods, strict=True)
    ]

    def numbers(axis: int, begin: float, end: float) -> range:
        period = periods[axis]
        if not period:
            return range(1)
        low, high = sorted(origin[axis] + part * flight[axis] for part in (begin, end))
        return range(math.floor((low - near[axis]) / period), math.floor((high + near[axis]) / period) + 1)

    for m in numbers(0, 0.0, 1.0):
        begin, end = 0.0, 1.0
        if periods[0] and flight[0]:
            sides = (m * periods[0] - near[0] - origin[0], (m + 1) * periods[0] + near[0] - origin[0])
            begin, end = sorted(min(max(side / flight[0], 0.0), 1.0) for side in sides)
        for n in numbers(1, begin, end):
            yield m, n
