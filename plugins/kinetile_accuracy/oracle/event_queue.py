"""The queue of events of an attempt of the oracle, and which of them is next for certain.

Events have numbers, which are their order within one moment (docs/one-answer.md): 0 the next command, 1 an
end before the contacts of its time, then body by body the walls (left, right, bottom, top), then the pairs by
their bodies, then the ends of passings, and last the end after all of its time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from kinetile_accuracy.oracle.flights import EventTime, same

COMMAND, END_BEFORE = 0, 1

_Place = tuple[int, int]
"""Where an event is in the queue: its number, and which of its images."""


class Undecided(Exception):
    """A comparison that does not come out: what it is about, about when, and the bodies concerned."""

    def __init__(self, what: str, time: float, bodies: tuple[int, ...]) -> None:
        super().__init__(what)
        self.what, self.time, self.bodies = what, time, bodies

    def __reduce__(self) -> tuple[Any, ...]:
        return Undecided, (self.what, self.time, self.bodies), self.__dict__


Image = tuple[int, int]
"""Periods along x and y by which the second of two bodies is taken to be elsewhere; 0 of a walled axis."""

ORIGIN: Image = (0, 0)


class PossibleEvent(NamedTuple):
    """An event that is to come.

    ``root`` is the ball of -d.v of two discs when they touch, or of d.v when they part. ``doubt`` says what
    is not known about an event that may come, and not before its moment's ``low``. ``late`` is whether the
    bodies overlap already. ``image`` is the one through which two discs meet; None: no contact, but the time
    up to which all contacts of the two are known.
    """

    moment: EventTime
    root: arb | None = None
    doubt: str | None = None
    late: bool = False
    image: Image | None = ORIGIN


class EventQueue:
    """The events that are to come, by their numbers; of two bodies several, in the order of their images.

    Args:
        bodies: one more than their largest number.
        passing: whether some of them may pass through each other.

    Attributes:
        end: the number of the end after all events of its time.
        commanded: the body of the next command.
    """

    def __init__(self, bodies: int, passing: bool = False) -> None:
        self._n = bodies
        self._first_pair = self.wall(bodies, 0)
        self._first_parting = self.pair(bodies, 0)
        self._partings = bodies * bodies if passing else 0
        self.end = self._first_parting + self._partings
        self.commanded = -1
        self._low = np.full(self.end + 1, math.inf)
        self._high = np.full(self.end + 1, math.inf)
        self._events: dict[int, list[PossibleEvent]] = {}

    def wall(self, body: int, wall: int) -> int:
        """Returns the number of a body's contact with a wall: 0 left, 1 right, 2 bottom, 3 top."""
        return 2 + 4 * body + wall

    def pair(self, a: int, b: int) -> int:
        """Returns the number of the contact of two bodies, a < b."""
        return self._first_pair + a * self._n + b

    def parting(self, a: int, b: int) -> int:
        """Returns the number of the end of the passing of two bodies, a < b."""
        return self.pair(a, b) + self._partings

    def is_parting(self, event: int) -> bool:
        """Returns whether an event is the end of a passing."""
        return self._first_parting <= event < self.end

    def wall_of(self, event: int) -> tuple[int, int] | None:
        """Returns the body and the wall of a contact with a wall; None for other events."""
        return divmod(event - 2, 4) if END_BEFORE < event < self._first_pair else None

    def bodies_of(self, event: int) -> tuple[int, ...]:
        """Returns the bodies of an event."""
        if event == COMMAND:
            return (self.commanded,)
        if event in (END_BEFORE, self.end):
            return ()
        if event < self._first_pair:
            return ((event - 2) // 4,)
        first = self._first_parting if self.is_parting(event) else self._first_pair
        return divmod(event - first, self._n)

    def name_of(self, event: int) -> str:
        """Returns what an event is, in words."""
        bodies = self.bodies_of(event)
        if event == COMMAND:
            return f"the command for disc {bodies[0]}"
        if not bodies:
            return "the end"
        if event < self._first_pair:
            wall = ("left", "right", "bottom", "top")[(event - 2) % 4]
            return f"disc {bodies[0]} and the {wall} wall"
        parting = "the parting of " if self.is_parting(event) else ""
        return f"{parting}discs {bodies[0]} and {bodies[1]}"

    def get(self, event: int) -> Sequence[PossibleEvent]:
        """Returns the known part of an event, through each image; empty: it is not to come."""
        return self._events.get(event, ())

    def put(self, event: int, *coming: PossibleEvent) -> None:
        """Sets when an event is to come, through each image; none: not at all."""
        if coming:
            self._events[event] = list(coming)
            self._low[event] = min([each.moment.low for each in coming])
            self._high[event] = min([math.inf if each.doubt else each.moment.high for each in coming])
        elif self._events.pop(event, None) is not None:
            self._low[event] = self._high[event] = math.inf

    def next(self) -> tuple[int, PossibleEvent] | None:
        """Returns the next event; None: there is none. Raises Undecided where it is not certain which."""
        # Every other event is certain to come after one of these. An event in doubt has no upper bound: it is
        # among them from the moment on at which it could come.
        bound = self._high.min()
        near: list[_Place] = []
        for event in np.flatnonzero(self._low <= bound).tolist():
            images = enumerate(self._events.get(event, ()))
            near += [(event, index) for index, coming in images if coming.moment.low <= bound]
        if not near:
            return None
        for event, index in near:
            doubt = self._events[event][index].doubt
            if doubt is not None:
                raise self._undecided(doubt, (event, index))
        first = near[0]
        for place in near[1:]:
            order = self._compare(place, first)
            if order < 0:
                first = place
            elif order == 0:  # one moment for both: from now on they compare without arithmetic
                event, index = place
                coming = self._events[event][index]
                self._events[event][index] = coming._replace(moment=self._moment(first))
        return first[0], self._events[first[0]][first[1]]

    def _moment(self, place: _Place) -> EventTime:
        return self._events[place[0]][place[1]].moment

    def _compare(self, one: _Place, two: _Place) -> int:
        """Returns -1, 0 or 1: whether an event is before another, with it, or after it."""
        moment, other = self._moment(one), self._moment(two)
        if moment is other:
            return 0
        if moment.ball < other.ball:
            return -1
        if moment.ball > other.ball:
            return 1
        if moment.root is not None and other.root is not None and same(moment.root, other.root):
            return 0
        raise self._undecided(f"tie of {self.name_of(two[0])} and {self.name_of(one[0])}", two, one)

    def _undecided(self, what: str, *places: _Place) -> Undecided:
        bodies = {body for event, _ in places for body in self.bodies_of(event)}
        return Undecided(what, max(self._moment(places[0]).low, 0.0), tuple(sorted(bodies)))
