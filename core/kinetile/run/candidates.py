"""The structure of a broad phase, read from outside: its candidate pairs, and the shapes that it draws.
``near`` and ``draw`` are foreign code: here ``near`` writes into a separate table, ``draw`` receives
read-only tables, and every returned shape is checked."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import PhaseError
from kinetile.kernel.chords import as_seen
from kinetile.kernel.clock import Clock
from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.tables import NEVER, Kernel, is_there, read_only
from kinetile.plugin.calling import calling, described
from kinetile.plugin.drawing import At, Coordinate, Entry, Item, Link, Point, points_of, with_points
from kinetile.run.compose import Composition

near = to_be_filled_in


def list_near(k: Kernel, s: Any, found: npt.NDArray[np.int32]) -> int:
    """Template: writes (body, other) for bodies near each body, while there is room; returns their count."""
    k = disowned(k)
    s = disowned(s)
    count = 0
    for body in range(k.clock[0].bodies):
        if is_there(k, body):
            for i in range(near(k, s, body)):
                if count < len(found):
                    found[count, 0] = body
                    found[count, 1] = k.near[i]
                count += 1
    return count


def named_near(k: Kernel, composition: Composition, tables: Any) -> npt.NDArray[np.int32]:
    """Returns (body, other), (m, 2), for all bodies that the broad phase names near each body, except itself.
    ``near`` has its own table here: another thread may run with ``k.near``. ``tables``: ``k``, packed."""
    broad, seen, aside = composition.broad, as_seen(k), np.zeros_like(k.near)
    given = tables.replaced("near", aside) if seen is k else seen._replace(near=aside)
    listing = compose(list_near, {"near": broad.near}, composition.label, type(broad.state))
    found = np.zeros((8 * len(k.bodies) + 64, 2), dtype=np.int32)
    count = int(listing(given, broad.state, found))
    if count > len(found):
        found = np.zeros((count, 2), dtype=np.int32)
        listing(given, broad.state, found)
    return np.asarray(found[:count][found[:count, 0] != found[:count, 1]])


def pairs_of_named(named: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Returns the sorted pairs (a, b), a < b, (m, 2), where one is near the other. They are sorted as one
    integer each, which takes NumPy half as long as rows."""
    low, high = named.min(axis=1).astype(np.int64), named.max(axis=1)
    pairs = np.unique(low << 32 | high)
    return np.column_stack([pairs >> 32, pairs & 0xFFFFFFFF]).astype(named.dtype)


def by_number(k: Kernel, named: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Returns pairs of slots as pairs of the numbers of the bodies in them."""
    return np.asarray(k.queue["number"])[named]


def drawn(k: Kernel, composition: Composition, clock: Clock) -> tuple[Item, ...]:
    """Returns the present drawing, if any; PhaseError if ``draw`` raises, or returns an invalid shape."""
    parts, name = composition.broad, composition.broad_phase
    if parts.draw is None:
        return ()
    with calling("broad phase", name, "draw"):
        items = list(parts.draw(read_only(as_seen(k)), read_only(parts.state)))
    numbers, images = np.asarray(k.queue["number"]).tolist(), np.asarray(k.images)
    taken_off = (images["kx"].tolist(), images["ky"].tolist()) if len(images) else None
    shapes = map(_Reader(name, numbers, clock, taken_off).read, items)
    still = {number for number, mass in zip(numbers, k.mass.tolist(), strict=True) if mass == math.inf}
    # Two immovable bodies never meet: their pair is not drawn.
    return tuple(
        each
        for each in shapes
        if not (isinstance(each, Link) and each.role == "pair" and {each.a, each.b} <= still)
    )


@dataclass
class _Reader:
    """Reads shapes of slots as shapes of bodies, and the kernel's ticks as ticks since the start."""

    phase: str
    numbers: list[int]
    clock: Clock
    taken_off: tuple[list[int], list[int]] | None
    """The numbers of periods taken off the body in each slot, along x and y; None: no axis is periodic."""

    def _wrong(self, text: str) -> PhaseError:
        return PhaseError(f"{described('broad phase', self.phase)}: draw returned {text}")

    def read(self, item: Any) -> Item:
        """Returns a shape with the numbers of bodies; itself if they equal the slots, the usual case."""
        if not isinstance(item, Item):
            wanted = "expected shapes: Segment, Box, Polygon, Link, Entry of kinetile.toolbox"
            raise self._wrong(f"{item!r}; {wanted}")
        fails = item.fails
        if fails is not None:
            fails = None if fails == NEVER else self.clock.total(int(fails))
        if isinstance(item, Link | Entry):
            a, b = self._body(item, item.a), self._body(item, item.b)
            same = a == item.a and b == item.b and fails == item.fails
            return item if same else type(item)(item.role, a, b, fails, item.label)
        points = [self._point(item, point) for point in points_of(item)]
        if self.taken_off is not None:
            x, y = (_whole(column) for column in zip(*points, strict=True))
            points = list(zip(x, y, strict=True))
        return with_points(item, points, fails)

    def _point(self, item: Item, point: Point) -> Point:
        if not isinstance(point, tuple) or len(point) != 2:
            raise self._wrong(f"{item!r}, and {point!r} is no point; expected two coordinates")
        x, y = point
        return self._coordinate(item, x, 0), self._coordinate(item, y, 1)

    def _coordinate(self, item: Item, value: Coordinate, axis: int) -> Coordinate:
        at, turns = (value.offset, value.turns) if isinstance(value, At) else (value, 0)
        fit = type(at) is float or isinstance(at, int | float | np.integer | np.floating)
        if not (fit and math.isfinite(at) and (type(turns) is int or isinstance(turns, np.integer))):
            wanted = "expected a finite number or At(slot, ...)"
            raise self._wrong(f"{item!r}, and {value!r} is no coordinate; {wanted}")
        if not isinstance(value, At):
            return float(at)
        number = self._body(item, value.body)
        if self.taken_off is not None:
            return At(number, float(at), int(turns) - self.taken_off[axis][value.body])
        same = number == value.body and type(at) is float and turns == 0  # the usual case
        return value if same else At(number, float(at))

    def _body(self, item: Item, slot: int) -> int:
        fit = isinstance(slot, int | np.integer) and 0 <= slot < len(self.numbers)
        if not fit or self.numbers[slot] < 0:
            raise self._wrong(f"{item!r}, and there is no body in slot {slot!r}")
        return self.numbers[slot]


def _whole(column: tuple[Coordinate, ...]) -> list[Coordinate]:
    """Returns a shape's coordinates on an axis, with turns from its first body; 0 beside a fixed number."""
    first, *_ = turns = [each.turns for each in column if isinstance(each, At)] or [0]
    fixed = len(turns) < len(column)
    return [
        At(each.body, each.offset, 0 if fixed else each.turns - first) if isinstance(each, At) else each
        for each in column
    ]
