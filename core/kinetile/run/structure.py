"""The structure of a broad phase, read from outside: its candidate pairs, and the shapes that it draws.

A phase's ``near`` and ``draw`` are foreign code. ``near`` writes into a table of its own here, so
that a run in another thread is not disturbed. ``draw`` receives read-only tables, and every shape
that it returns is checked, so that viewers can rely on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import PhaseError
from kinetile.kernel.clock import Clock
from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.tables import NEVER, Kernel, is_there, read_only
from kinetile.plugin.calling import calling, described
from kinetile.plugin.drawing import At, Box, Coordinate, Entry, Item, Link, Point, Polygon, Segment
from kinetile.run.compose import Composition

near = to_be_filled_in


def list_near(k: Kernel, s: Any, found: npt.NDArray[np.int32]) -> int:
    """Writes (body, other) for all bodies near each body, while there is room; returns how many there are.

    A template, as ``kernel.loop.advance`` is.
    """
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


def named_near(k: Kernel, composition: Composition) -> npt.NDArray[np.int32]:
    """Returns (body, other) for all bodies that the broad phase names near each body, itself apart; (m, 2).

    The answers are written aside: a run in another thread has its own in ``k.near``.
    """
    broad, k = composition.broad, k._replace(near=np.zeros_like(k.near))
    listing = compose(list_near, {"near": broad.near}, composition.label, type(broad.state))
    found = np.zeros((8 * len(k.bodies) + 64, 2), dtype=np.int32)
    count = int(listing(k, broad.state, found))
    if count > len(found):
        found = np.zeros((count, 2), dtype=np.int32)
        listing(k, broad.state, found)
    return np.asarray(found[:count][found[:count, 0] != found[:count, 1]])


def pairs_of_named(named: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Returns the pairs (a, b), a < b, of which one is near the other, sorted; (m, 2)."""
    return np.asarray(np.unique(np.sort(named, axis=1), axis=0))


def candidates(k: Kernel, composition: Composition) -> npt.NDArray[np.int32]:
    """Returns the candidate pairs (a, b), a < b, by the numbers of the bodies, sorted; (m, 2)."""
    return pairs_of_named(by_number(k, named_near(k, composition)))


def by_number(k: Kernel, named: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Returns pairs of slots as pairs of the numbers of the bodies in them."""
    return np.asarray(k.queue["number"])[named]


def drawn(k: Kernel, composition: Composition, clock: Clock) -> tuple[Item, ...]:
    """Returns the present drawing; nothing if the phase draws nothing.

    Raises PhaseError where ``draw`` raises, or returns what is no shape, or names a slot that is empty.
    """
    parts, name = composition.broad, composition.broad_phase
    if parts.draw is None:
        return ()
    with calling("broad phase", name, "draw"):
        items = list(parts.draw(read_only(k), read_only(parts.state)))
    return tuple(map(_Reader(name, np.asarray(k.queue["number"]).tolist(), clock).read, items))


@dataclass
class _Reader:
    """Reads shapes of slots as shapes of bodies, and the kernel's ticks as ticks since the start."""

    phase: str
    numbers: list[int]
    clock: Clock

    def _wrong(self, said: str) -> PhaseError:
        return PhaseError(f"{described('broad phase', self.phase)}: draw returned {said}")

    def read(self, item: Any) -> Item:
        """Returns a shape with the numbers of bodies; itself where they are the slots, as mostly."""
        if not isinstance(item, Segment | Box | Polygon | Link | Entry):
            wanted = "expected shapes: Segment, Box, Polygon, Link, Entry of kinetile.toolbox"
            raise self._wrong(f"{item!r}; {wanted}")
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
            raise self._wrong(f"{item!r}, and {point!r} is no point; expected two coordinates")
        x, y = point
        return self._coordinate(item, x), self._coordinate(item, y)

    def _coordinate(self, item: Item, value: Coordinate) -> Coordinate:
        if type(value) is At and type(value.offset) is float and math.isfinite(value.offset):  # as mostly
            number = self._body(item, value.body)
            return value if number == value.body else At(number, value.offset)
        at = value.offset if isinstance(value, At) else value
        if not isinstance(at, int | float | np.integer | np.floating) or not math.isfinite(at):
            wanted = "expected a finite number or At(slot, ...)"
            raise self._wrong(f"{item!r}, and {value!r} is no coordinate; {wanted}")
        return At(self._body(item, value.body), float(at)) if isinstance(value, At) else float(at)

    def _body(self, item: Item, slot: int) -> int:
        fit = isinstance(slot, int | np.integer) and 0 <= slot < len(self.numbers)
        if not fit or self.numbers[slot] < 0:
            raise self._wrong(f"{item!r}, and there is no body in slot {slot!r}")
        return self.numbers[slot]
