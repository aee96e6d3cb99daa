"""Positions of the present moment: bodies in a box, near a point, on a ray.

A body is the set of points within its radius of its core (``kinetile.scene.shapes``); a disc's core is its
centre. So each question compares a place with a convex polygon: the core for a point or a ray, the difference
of box and core for a box. The circle around each body is tested first. All is computed in doubles.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Flags, Floats, Integers
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.flight import positions_now
from kinetile.kernel.images import FORESEEN
from kinetile.kernel.tables import NEVER, Kernel
from kinetile.run.compose import Composition
from kinetile.scene.bodies import in_box, nearest_image
from kinetile.scene.differences import core_difference
from kinetile.scene.shapes import Shape
from kinetile.toolbox.differences import DISC, Outline

Box = tuple[float, float, float, float]
"""left, bottom, right, top; left <= right and bottom <= top."""

Point = tuple[float, float]

MOST_PERIODS = 4096
"""Periods that a ray, a cast disc, or a body seen from another may cross: each image on its way is read."""

UNITS_AHEAD = 1000
"""The length, in units of the clock, of the search for contacts if axes are periodic."""

OLDEST = 4
"""Units of the clock: the largest age of a plan if axes are periodic."""


@dataclass(frozen=True)
class Query:
    """The present moment of a run, and the bodies in question; invalid as soon as the run continues.

    ``packed`` are the kernel's tables as compiled code takes them; ``slots``, (n,) int64, are the slots of
    the bodies in question, in the order of their numbers, which decides ties. Only the narrow phases of the
    ``composition`` are used. ``overlapping``, (m, 2) slots, are pairs of the start that may pass: undecided.
    """

    k: Kernel
    packed: Any
    slots: Integers
    clock: Clock
    composition: Composition
    shapes: tuple[Shape, ...] = ()
    overlapping: Integers = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))

    @property
    def now(self) -> int:
        """The present tick, as the kernel counts."""
        return int(self.k.clock[0].now)

    @property
    def periods(self) -> tuple[float, float]:
        """The periods of the axes; 0 for an axis that is not periodic."""
        torus = self.k.clock[0].torus
        return float(torus.x), float(torus.y)

    def ahead(self, velocity: Point = (0.0, 0.0)) -> int:
        """Returns the number of ticks, from now, of the search for contacts if axes are periodic, also for a
        body with this velocity: ``UNITS_AHEAD``, or until one crosses ``MOST_PERIODS`` for another."""
        bodies, unit = self.k.bodies.view(np.ndarray), float(self.k.clock[0].per_tick) * TICKS
        crossed = 1.0
        for name, own, period in zip(("vx", "vy"), velocity, self.periods, strict=True):
            if period:
                fastest = float(abs(bodies[name]).max(initial=abs(own)))
                crossed = max(crossed, 2.0 * fastest * unit / period)
        return max(min(int(MOST_PERIODS / crossed), UNITS_AHEAD) * TICKS, FORESEEN)

    @cached_property
    def until(self) -> int:
        """The end of the search for contacts: a contact at this tick or later is no answer."""
        return self.now + self.ahead() if any(self.periods) else NEVER

    @cached_property
    def aside(self) -> Any:
        """The packed tables with a clock of their own: a fault of a narrow phase must not end the run, which
        does not look as far ahead."""
        kept = self.k.clock
        clock = np.frombuffer(bytearray(kept.tobytes()), kept.dtype).view(type(kept))  # copy() goes by fields
        if any(self.periods):
            clock[0].torus.foreseen = self.until - self.now + OLDEST * TICKS
            clock[0].limits.fat += 2.0**-40 * MOST_PERIODS * sum(self.periods)  # as for a cast body
        return self.packed.replaced("clock", clock)

    @cached_property
    def places(self) -> Floats:
        """(n, 2) the positions of the bodies, bit for bit as in ``Simulation.positions``."""
        return in_box(positions_now(self.k, self.slots), self.periods)

    @cached_property
    def radii(self) -> Floats:
        """(n,) their radii; for shapes, the radii of the circles around them."""
        return np.asarray(self.k.radii[self.slots])

    @cached_property
    def forms(self) -> Integers:
        """(n,) the indices of their shapes; 0 if all are discs."""
        return self.k.bodies["form"][self.slots] if self.shapes else np.zeros(len(self.slots), np.int64)

    def cores(self, few: Integers, area: Sequence[Point] = ()) -> tuple[Floats, Floats]:
        """Returns the corners of the cores of a few bodies, (m, most, 2), with the last one repeated if there
        are fewer, and (m,) their radii; with an ``area``, the corners of the differences of area and core."""
        forms, which = np.unique(self.forms[few], return_inverse=True)
        shapes = [self.shapes[each] for each in forms.tolist()] if self.shapes else []
        cores: list[Sequence[tuple[Any, Any]]] = [each.core for each in shapes] or [DISC] * len(forms)
        cores = [core_difference(tuple(area), core) for core in cores] if area else cores
        most = max(map(len, cores), default=1)
        padded = [(*core, *[core[-1]] * (most - len(core))) for core in cores]
        radii = np.array([each.radius for each in shapes])[which] if shapes else self.radii[few]
        return np.array(padded, dtype=np.float64).reshape(-1, most, 2)[which], radii


def bodies_in(query: Query, box: Box, inside: bool = False, area: Outline | None = None) -> Integers:
    """Returns, in order, the slots of bodies with a point in a box or on its edges, or, if ``inside``, with
    all points in it. With an ``area``, which the box surrounds, the slots of bodies in the area."""
    held = np.zeros(len(query.slots), dtype=np.bool_)
    for shift in _shifts(box, query.periods, float(query.radii.max(initial=0.0))):
        held |= _in_box(query, query.places + shift, box, inside, area)
    return query.slots[held]


def _shifts(box: Box, periods: tuple[float, float], reach: float) -> Iterator[Floats]:
    """Yields the periods, (2,), to add to places from 0 to a period for all images that a box may touch. For
    a box longer than some periods, it yields enough to show every body."""
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


def _in_box(query: Query, places: Floats, box: Box, inside: bool, area: Outline | None) -> Flags:
    left, bottom, right, top = box
    low, high = np.array(box).reshape(2, 2)
    core, radius = area or (((left, bottom), (right, bottom), (right, top), (left, top)), 0.0)
    few = np.flatnonzero(np.maximum(*np.maximum(low - places, places - high).T) <= query.radii)
    if inside:
        corners, radii = query.cores(few)
        spots = places[few][:, None] + corners
        if area is None:
            beyond = np.maximum(low - spots, spots - high).max(axis=2)
        else:
            around = np.broadcast_to(core, (spots.size // 2, len(core), 2))
            beyond = gaps_to(around, np.array(radius), spots.reshape(-1, 2)).reshape(spots.shape[:2])
        held = beyond.max(axis=1) + radii <= 0.0
    else:
        held = gaps_to(*query.cores(few, core), places[few]) <= radius
    found = np.zeros(len(places), dtype=np.bool_)
    found[few[held]] = True
    return found


def gaps_to(corners: Floats, radii: Floats, points: Floats) -> Floats:
    """Returns the distances of points from the outlines of bodies, (m,), below 0 inside: the distance to the
    core, or inside of the core the negated distance to its outline, minus the radius."""
    sides, at = np.roll(corners, -1, axis=1) - corners, points[:, None] - corners
    squares = (sides * sides).sum(axis=2)  # 0 where a corner is repeated
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(squares > 0.0, np.clip((sides * at).sum(axis=2) / squares, 0.0, 1.0), 0.0)
    distance = np.hypot(*(at - along[:, :, None] * sides).transpose(2, 0, 1)).min(axis=1)
    inside = ((_cross(sides, at) > 0.0) | (squares == 0.0)).all(axis=1) & ((squares > 0.0).sum(axis=1) > 2)
    return np.asarray(np.where(inside, -distance, distance) - radii)


def _cross(one: Floats, other: Floats) -> Floats:
    """Returns cross products, above 0 if the second vector is to the left of the first."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def bodies_near(
    query: Query, point: Point, radius: float | None = None, count: int | None = None
) -> Integers:
    """Returns the bodies of ``Simulation.bodies_near`` as slots, ties as in ``query.slots``. If a shape is
    not around its position, the near image may differ from the image whose position is nearest."""
    apart = nearest_image(np.array(point) - query.places, query.periods)
    turns = [(0.0, -period, period) if period and query.shapes else (0.0,) for period in query.periods]
    limit = math.inf if radius is None else radius
    centre, reach = np.hypot(*apart.T), query.radii * (1.0 + 2.0**-40)
    nearest, farthest = centre * (1.0 - 2.0**-40) - reach, centre * (1.0 + 2.0**-40) + reach
    if count is not None and 0 < count < len(centre):
        limit = min(limit, float(np.partition(farthest, count - 1)[count - 1]))
    few = np.flatnonzero(nearest <= limit)  # by the circles around bodies
    corners, radii = query.cores(few)
    gaps = np.min([gaps_to(corners, radii, apart[few] + shift) for shift in product(*turns)], axis=0)
    order = np.argsort(gaps, kind="stable")
    if radius is not None:
        order = order[gaps[order] <= radius]
    return np.asarray(query.slots[few[order[:count]]])


class RayHit(NamedTuple):
    """A body that a ray meets, and its distance from the ray's origin: 0.0 if the origin is in the body."""

    body: int
    distance: float


def ray(
    query: Query, origin: Point, direction: Point, most: int | None = None, within: float | None = None
) -> list[RayHit]:
    """Returns the hits of ``Simulation.ray`` as slots, ties as in ``query.slots``; the direction is not 0."""
    images: Iterable[tuple[int, int]] = [(0, 0)]
    down = -math.frexp(max(map(abs, direction)))[1]
    u = np.array([math.ldexp(part, down) for part in direction])  # so that no square of it underflows
    size = float(np.hypot(*u))
    if any(query.periods):
        assert within is not None
        if most is not None and within > 2.0 * max(query.periods):  # the first are mostly near the origin
            hits = ray(query, origin, direction, most, 0.25 * within)
            if len(hits) == most:
                return hits
        x, y = (math.remainder(at, p) if p else at for at, p in zip(origin, query.periods, strict=True))
        origin, flight = (x, y), (within * float(u[0]) / size, within * float(u[1]) / size)
        images = _images_near(origin, flight, query.periods, float(query.radii.max(initial=0.0)))
    found = np.full(len(query.slots), math.inf)
    for image in images:
        start = (np.array(origin) - np.array(image) * np.array(query.periods)) - query.places
        x, y = start.T
        reach = size * (query.radii * (1.0 + 2.0**-40) + 2.0**-40 * np.abs(start).max(initial=0.0))
        few = np.flatnonzero((np.abs(x * u[1] - y * u[0]) <= reach) & (x * u[0] + y * u[1] <= reach))
        if len(few):
            found[few] = np.minimum(found[few], _entries(*query.cores(few), start[few], u))
    met = np.flatnonzero(found <= (np.finfo(float).max if within is None else within))
    order = met[np.argsort(found[met], kind="stable")][:most]
    return [RayHit(int(query.slots[at]), float(found[at])) for at in order.tolist()]


def _entries(corners: Floats, radii: Floats, start: Floats, u: Floats) -> Floats:
    """Returns the lengths, (m,), of a ray before it enters bodies, or inf; ``start``, (m, 2), is its origin
    seen from each. It enters over a side of the core, or in the disc around a corner, whichever is first."""
    sides, at = np.roll(corners, -1, axis=1) - corners, start[:, None] - corners
    n, squares, r = float(u @ u), (sides * sides).sum(axis=2), radii[:, None]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        ahead, root = -(at @ u), r * r * n - _cross(at, u) ** 2
        discs = np.where((ahead > 0.0) & (root >= 0.0), (ahead - np.sqrt(root)) / n, math.inf)
        lengths = np.sqrt(squares)
        fall, gap = _cross(sides, u) / lengths, -_cross(sides, at) / lengths - r
        after = gap / fall
        part = ((sides * at).sum(axis=2) + after * (sides @ u)) / squares
        beside = np.abs(part - 0.5) <= 0.5 + 2.0**-50  # so that no ray goes between two sides
        over = (fall > 0.0) & (gap >= 0.0) & beside
        found = np.minimum(discs, np.where(over, after, math.inf)).min(axis=1) * math.sqrt(n)
    found[gaps_to(corners, radii, start) <= 0.0] = 0.0
    return np.asarray(found)


def _images_near(
    origin: Point, flight: Point, periods: tuple[float, float], radius: float
) -> Iterator[tuple[int, int]]:
    """Yields the images (m, n) of the box from 0 to a period that a ray approaches to ``radius``: column by
    column, the rows beside the part of the ray near the column, within more than all rounding."""
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
