"""Positions of the present moment: bodies in a box, near a point, on a ray.

A body is all that is within its radius of its core (``kinetile.scene.shapes``); that of a disc is its centre.
So each question is one of a place and a convex polygon: for a point or a ray that is the core, for a box the
difference of box and core. The circle around each body comes first, then bounds in floating point, and what
these leave open is decided in rationals.

Where axes are periodic the nearest image is that of rounded places, and a ray meets images at exactly whole
periods from a place.
"""

from __future__ import annotations

import math
from bisect import insort
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache, cached_property, cmp_to_key
from itertools import chain, product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import Clock
from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop.responses import ROOM
from kinetile.kernel.tables import Kernel
from kinetile.run.compose import Composition
from kinetile.run.questions.exact import Truths, compare_roots, difference_of_roots, in_order, whole
from kinetile.scene.bodies import in_box, nearest_image
from kinetile.scene.differences import DISC, Number, Outline, core_difference, cross, dot, exact, less
from kinetile.scene.shapes import Shape

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Query:
    """The present moment of a run, and the bodies in question. It is out of date as soon as the run goes on.

    Attributes:
        k: the kernel's tables.
        slots: (n,) int64, the slots of the bodies in question, in the order of the bodies' numbers:
            ties go by their place here.
        clock: what a tick is in the scene's time.
        composition: the phases; of them only the narrow ones are used.
        shapes: the shapes of a scene that has some.
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

    def outline(self, at: int) -> Outline:
        """Returns the core and the radius of a body, by its place in ``slots``."""
        if not self.shapes:
            return DISC, float(self.radii[at])
        shape = self.shapes[int(self.forms[at])]
        return shape.core, shape.radius

    def cores(self, few: Integers) -> tuple[Floats, Floats]:
        """Returns the corners of the cores of a few bodies, (m, most, 2), the last one repeated where there
        are fewer, and (m,) their radii."""
        if not self.shapes:
            return np.zeros((len(few), 1, 2)), self.radii[few]
        forms, which = np.unique(self.forms[few], return_inverse=True)
        shapes = [self.shapes[form] for form in forms.tolist()]
        most = max((len(shape.core) for shape in shapes), default=1)
        cores = [(*shape.core, *[shape.core[-1]] * (most - len(shape.core))) for shape in shapes]
        return np.array(cores).reshape(-1, most, 2)[which], np.array([shape.radius for shape in shapes])[
            which
        ]


Box = tuple[float, float, float, float]
"""left, bottom, right, top; left <= right and bottom <= top."""

Point = tuple[float, float]

ROUNDING = 2.0**-47
"""What the bounds allow for, as a part of all lengths in question: 64 ULP, several times what they need.

Each coordinate is a sum of three or four of these lengths. The distance from a side is that from some point
of it, whatever rounding does to which point; so its error has the same size.
"""

LARGE = 2.0**400
"""From here on squares of squares may overflow, and the bounds settle nothing."""


def bodies_in(query: Query, box: Box, inside: bool = False) -> Integers:
    """Returns the slots of the bodies that have a point in common with a box, including edges, or, with
    ``inside``, that lie in it completely. In the order of ``query.slots``."""
    held = np.zeros(len(query.slots), dtype=np.bool_)
    for shift in _shifts(box, query.periods, float(query.radii.max(initial=0.0))):
        held |= _in_box(query, query.places + shift, box, inside)
    return query.slots[held]


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


def _in_box(query: Query, places: Floats, box: Box, inside: bool) -> Truths:
    """Returns which bodies at these places are in a box."""
    low, high = np.array(box).reshape(2, 2)
    # rounding a difference keeps its order to a double: no circle that touches the box is left out
    circles = np.maximum(low - places, places - high).max(axis=1)
    few = np.flatnonzero(circles <= query.radii)
    corners, radii = query.cores(few)
    spots = places[few][:, None] + corners
    out = np.maximum(low - spots, spots - high)  # (m, corners, 2), above 0 outside
    margin = ROUNDING * (np.abs(spots).max(axis=(1, 2)) + np.abs(places[few]).max(axis=1))
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
        at = int(few[i])
        held[i] = _is_in(query.outline(at), (float(places[at, 0]), float(places[at, 1])), box, inside)
    found = np.zeros(len(places), dtype=np.bool_)
    found[few[held]] = True
    return found


def _is_in(outline: Outline, place: Point, box: Box, inside: bool) -> bool:
    """Whether a body has a point in common with a box, or is ``inside`` it completely."""
    left, bottom, right, top = box
    core, radius = outline
    if not inside:
        sides = core_difference(((left, bottom), (right, bottom), (right, top), (left, top)), core)
        return _signed_square(sides, exact(place)) <= Fraction(radius) ** 2
    r, axes = Fraction(radius), zip(*map(exact, core), strict=True)
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
    query: Query, point: Point, radius: float | None = None, count: int | None = None
) -> Integers:
    """Returns the slots of the bodies that are near a point, the nearest first, ties in the order of
    ``query.slots``.

    How far a body is from a point is the distance to its outline, below 0 where the point is within: that to
    the core, or within the core that to the outline of the core, negated, less the radius. Where axes are
    periodic it is that of the nearest image, at its rounded place.
    """
    places = query.places
    if any(query.periods):
        places = np.array(point) + nearest_image(places - np.array(point), query.periods)
    limit = math.inf if radius is None else radius
    centre = np.hypot(*(places - np.array(point)).T)
    reach = query.radii + ROUNDING * (centre + query.radii)
    few = np.flatnonzero(_may_be_first(centre - reach, centre + reach, count) & (centre - reach <= limit))
    lower, upper = _bounds(query, few, np.array(point) - places[few])
    held = _may_be_first(lower, upper, count) & (lower <= limit)
    few, lower, upper = few[held], lower[held], upper[held]

    @cache
    def distance(i: int) -> tuple[Fraction, Fraction]:
        core, own = query.outline(int(few[i]))
        x, y = places[few[i]].tolist()
        square = _signed_square([exact(c) for c in core], less(exact(point), exact((x, y))))
        return square, Fraction(own)

    def compare(i: int, j: int) -> int:
        (one, r), (other, s) = distance(i), distance(j)
        return _compare_distances(one, other, r - s)

    def is_near(i: int) -> bool:
        return bool(upper[i] <= limit) or distance(i)[0] <= (distance(i)[1] + Fraction(limit)) ** 2

    nearest = in_order(lower, upper, compare)[:count]
    return np.asarray(query.slots[few[[i for i in nearest if is_near(i)]]])


def _may_be_first(lower: Floats, upper: Floats, count: int | None) -> Truths:
    """Returns which of n values between bounds may be among the ``count`` smallest."""
    if count is None or count >= len(lower):
        return np.ones(len(lower), dtype=np.bool_)
    return lower <= (np.partition(upper, count - 1)[count - 1] if count else -np.inf)


def _bounds(query: Query, few: Integers, place: Floats) -> tuple[Floats, Floats]:
    """Returns bounds of the distances of a few bodies from a point, seen from each at a ``place``."""
    corners, radii = query.cores(few)
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
    query: Query, origin: Point, direction: Point, most: int | None = None, within: float | None = None
) -> list[RayHit]:
    """Returns the bodies that a ray meets, the nearest first, ties in the order of ``query.slots``; not more
    than ``most``, and none further than ``within``. The bodies of the hits are slots; the direction's length
    does not matter, and is not 0. Where axes are periodic ``within`` is needed, and a body is met where the
    ray first enters one of its images, at exactly whole periods from its place."""
    periods = query.periods
    if any(periods):
        assert within is not None
        if most is not None and within > 2.0 * max(periods):  # the first are mostly found near the origin
            hits = ray(query, origin, direction, most, 0.25 * within)
            if len(hits) == most:
                return hits
        # the remainder of doubles is a double: so images have small numbers, and nothing is rounded
        x, y = (math.remainder(at, p) if p else at for at, p in zip(origin, periods, strict=True))
        origin = x, y
    (ux, uy), _ = whole(direction)
    met: list[EntryOfRay] = []
    first: dict[int, EntryOfRay] = {}  # of those in ``met``, by body
    for at, image, bound in zip(*in_the_way(query, origin, direction, within), strict=True):
        if most is not None and len(met) >= most and (most == 0 or met[most - 1].distance < bound):
            break
        if at in first and first[at].distance < bound:
            continue
        entry = _entry(query, at, image, origin, (ux, uy), within)
        if entry is None:
            continue
        if at in first:
            if _compare(first[at], entry) <= 0:
                continue
            met.remove(first[at])
        first[at] = entry
        insort(met, entry, key=BY_ENTRY)
    return [RayHit(int(query.slots[entry.at]), entry.distance) for entry in met[:most]]


def _entry(
    query: Query, at: int, image: list[int], origin: Point, u: tuple[int, int], within: float | None
) -> EntryOfRay | None:
    """Returns where a ray enters an image of a body; None: it does not, or not as near as ``within``.

    It enters over a side of the core, or in the disc around a corner: the first of the discs that it meets.
    """
    corners_of, radius = query.outline(at)
    numbers = [*origin, *query.places[at].tolist(), *query.periods, radius, *chain(*corners_of)]
    (ox, oy, x, y, width, height, r, *core), unit = whole(numbers)
    start, n = (ox - x - image[0] * width, oy - y - image[1] * height), dot(u, u)
    corners = list(zip(core[::2], core[1::2], strict=True))
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


def _compare(one: EntryOfRay, two: EntryOfRay) -> int:
    """Compares where two bodies are entered; where even the doubles are the same, exactly."""
    if one.distance != two.distance:
        return -1 if one.distance < two.distance else 1
    return compare_roots(two.d, one.d, two.dot - one.dot) or one.at - two.at


BY_ENTRY = cmp_to_key(_compare)


def in_the_way(
    query: Query, origin: Point, direction: Point, within: float | None
) -> tuple[list[int], list[list[int]], list[float]]:
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
    radius, (width, height) = query.radii, query.periods
    images: Iterable[tuple[int, int]] = [(0, 0)]
    if within is not None and (width or height):
        flight = within * ux, within * uy
        images = _images_near(origin, flight, (width, height), float(radius.max(initial=0.0)))
    found: list[tuple[Integers, Integers, Floats]] = []
    with np.errstate(over="ignore", invalid="ignore"):
        x, y = query.places[:, 0] - origin[0], query.places[:, 1] - origin[1]
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
    return bodies[order].tolist(), through[order].tolist(), bounds[order].tolist()


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
