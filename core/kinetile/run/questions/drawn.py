"""What a broad phase says there is to see, with the numbers of the bodies and ticks since the start.

A phase's ``draw`` is somebody else's code: what it gets can only be read, and what it returns is looked
through, so that whoever shows it may rely on it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kinetile.errors import PhaseError
from kinetile.kernel.clock import Clock
from kinetile.kernel.tables import NEVER, Kernel, read_only
from kinetile.plugin.calling import calling, described
from kinetile.plugin.drawing import At, Box, Coordinate, Entry, Item, Link, Point, Polygon, Segment
from kinetile.run.composition import Composition

__all__ = ["drawn"]


def drawn(k: Kernel, composition: Composition, clock: Clock) -> tuple[Item, ...]:
    """Return what there is to see now; nothing where the phase draws nothing.

    Raises PhaseError where ``draw`` raises, or returns what is no shape, or names a slot that is empty.
    """
    parts, name = composition.broad, composition.broad_phase
    if parts.draw is None:
        return ()
    with calling("broad phase", name, "draw"):
        items = list(parts.draw(read_only(k), read_only(parts.state)))
    reader = _Reader(np.asarray(k.queue["number"]).tolist(), clock)
    try:
        return tuple(map(reader.read, items))
    except _Wrong as wrong:
        raise PhaseError(f"{described('broad phase', name)}: draw returned {wrong}") from None


class _Wrong(Exception):
    """What is wrong with a shape."""


class _Reader:
    """Reads shapes of slots as shapes of bodies, and the kernel's ticks as ticks since the start."""

    def __init__(self, numbers: list[int], clock: Clock) -> None:
        self.numbers = numbers
        self.clock = clock

    def read(self, item: Any) -> Item:
        """Return a shape as others know it: mostly it is the same, and then itself."""
        if not isinstance(item, Segment | Box | Polygon | Link | Entry):
            wanted = "expected shapes: Segment, Box, Polygon, Link, Entry of kinetile.toolbox"
            raise _Wrong(f"{item!r}; {wanted}")
        fails = item.fails
        if fails is not None:
            fails = None if fails == NEVER else self.clock.total(int(fails))
        if isinstance(item, Link | Entry):
            a, b = self._body(item, item.a), self._body(item, item.b)
            same = a == item.a and b == item.b and fails == item.fails
            return item if same else type(item)(item.role, a, b, fails, item.label)
        point = self._point
        if isinstance(item, Segment):
            return Segment(item.role, point(item, item.a), point(item, item.b), fails, item.label)
        if isinstance(item, Box):
            return Box(item.role, point(item, item.low), point(item, item.high), fails, item.label)
        corners = tuple(point(item, corner) for corner in item.corners)
        return Polygon(item.role, corners, fails, item.label)

    def _point(self, item: Item, point: Point) -> Point:
        if not isinstance(point, tuple) or len(point) != 2:
            raise _Wrong(f"{item!r}, and {point!r} is no point; expected two coordinates")
        x, y = point
        return self._coordinate(item, x), self._coordinate(item, y)

    def _coordinate(self, item: Item, value: Coordinate) -> Coordinate:
        if type(value) is At and type(value.offset) is float and math.isfinite(value.offset):  # as mostly
            number = self._body(item, value.body)
            return value if number == value.body else At(number, value.offset)
        at = value.offset if isinstance(value, At) else value
        if not isinstance(at, int | float | np.integer | np.floating) or not math.isfinite(at):
            wanted = "expected a finite number or At(slot, ...)"
            raise _Wrong(f"{item!r}, and {value!r} is no coordinate; {wanted}")
        return At(self._body(item, value.body), float(at)) if isinstance(value, At) else float(at)

    def _body(self, item: Item, slot: int) -> int:
        fit = isinstance(slot, int | np.integer) and 0 <= slot < len(self.numbers)
        if not fit or self.numbers[slot] < 0:
            raise _Wrong(f"{item!r}, and there is no body in slot {slot!r}")
        return self.numbers[slot]
