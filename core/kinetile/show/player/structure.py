"""What a phase draws of its structure, as shapes with intervals of events: from when to when each is there.

A shape hangs on bodies and moves with them, so it is written down once, however long it stands. It is another
one when its certificate is another: with the tick at which it fails.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import TICKS
from kinetile.plugin.drawing import At, Box, Coordinate, Entry, Item, Link, Polygon, Segment
from kinetile.show.picture.looks import ORDER

__all__ = ["MOST_LOOKS", "SHAPES", "StructureLog"]

SHAPES = (Segment, Box, Polygon, Link, Entry)
"""Shapes by the number that a page has for them; roles go by their place in ``ORDER``."""

MOST_LOOKS = 4_000_000
"""Shapes that are looked at, each of them after each event, before a log is full: some twenty seconds."""


class StructureLog:
    """Which shapes there were after each number of events.

    ``full`` says whether so many shapes were looked at that no more are: after ``seen`` events.
    """

    def __init__(self) -> None:
        self.full = False
        self.seen = 0
        self._looks = 0
        self._open: dict[Item, int] = {}
        self._closed: list[tuple[int, int, Item]] = []
        self._again: set[tuple[int, Item]] = set()

    def see(self, done: int, items: Iterable[Item]) -> None:
        """Take in what there is to see after so many events."""
        self.seen = done
        before, now, come = self._open, {}, []
        for item in items:
            first = before.pop(item, None)
            if first is not None:
                now[item] = first
            elif item not in now:  # said twice, it is there once
                now[item] = done
                come.append(item)
        self._looks += len(now)
        self.full = self._looks > MOST_LOOKS
        self._closed += [(first, done, item) for item, first in before.items()]
        stood = set(map(_without_certificate, before))
        self._again.update((done, item) for item in come if _without_certificate(item) in stood)
        self._open = now

    def columns(self) -> dict[str, npt.NDArray[Any]] | None:
        """Return the log: of each shape its number in ``SHAPES``, role, label (a place in ``labels``), first
        number of events at which it is there and first at which it is not, (epoch, tick) at which its
        certificate fails (NaN: it does not), whether it is ``fresh`` then (1), or stood before with another
        certificate (0), and its coordinates, x before y, ``size`` of all the columns
        ``body`` (-1: fixed) and ``offset``. None where there is nothing to see."""
        spans = [*self._closed, *((first, self.seen + 1, item) for item, first in self._open.items())]
        if not spans:
            return None
        spans.sort(key=lambda span: (ORDER.index(span[2].role), span[0], span[1]))
        labels = self._labels(spans)
        points = [list(_coordinates(item)) for _, _, item in spans]
        flat = [each for coordinates in points for each in coordinates]
        fails = [(np.nan, np.nan) if item.fails is None else divmod(item.fails, TICKS) for *_, item in spans]
        whole: dict[str, list[int]] = {
            "first": [first for first, _, _ in spans],
            "last": [last for _, last, _ in spans],
            "shape": [SHAPES.index(type(item)) for *_, item in spans],
            "role": [ORDER.index(item.role) for *_, item in spans],
            "label": [labels.index(item.label) for *_, item in spans],
            "size": [len(coordinates) for coordinates in points],
            "body": [body for body, _ in flat],
        }
        columns: dict[str, npt.NDArray[Any]] = {
            name: np.array(values, np.int32) for name, values in whole.items()
        }
        fresh = [(first, item) not in self._again for first, _, item in spans]
        columns["fresh"] = np.array(fresh, np.uint8)
        for at, name in enumerate(("epoch", "tick")):
            columns[name] = np.array([each[at] for each in fails], np.float64)
        return columns | {"offset": np.array([offset for _, offset in flat], np.float64)}

    @property
    def labels(self) -> list[str]:
        """The labels of shapes, in the order in which ``columns`` numbers them."""
        return self._labels([*self._closed, *((0, 0, item) for item in self._open)])

    @staticmethod
    def _labels(spans: Iterable[tuple[int, int, Item]]) -> list[str]:
        return sorted({item.label for *_, item in spans})


def _without_certificate(item: Item) -> tuple[Any, ...]:
    """Return what a shape is but for when it fails, and of one with a place also but for its label."""
    return type(item), item.label if isinstance(item, Entry) else "", *_coordinates(item)


def _coordinates(item: Item) -> Iterator[tuple[int, float]]:
    """Yield the coordinates of a shape, x before y: with which body (-1: fixed), and how far from it."""
    points: Iterable[tuple[Coordinate, Coordinate]]
    if isinstance(item, Segment):
        points = (item.a, item.b)
    elif isinstance(item, Box):
        points = (item.low, item.high)
    elif isinstance(item, Polygon):
        points = item.corners
    else:
        points = ((At(item.a), At(item.a)), (At(item.b), At(item.b)))
    for point in points:
        for each in point:
            yield (each.body, each.offset) if isinstance(each, At) else (-1, each)
