"""The queue of events of an attempt of the oracle, and which of them is next for certain.

Events have numbers, which are their order within one moment (docs/one-answer.md): 0 the next turn, then body
by body the walls (left, right, bottom, top), then the pairs by their bodies, and last the end.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from kinetile_accuracy.oracle.flights import EventTime, same

TURN = 0


class Undecided(Exception):
    """A comparison that does not come out: what it is about, about when, and the bodies concerned."""

    def __init__(self, what: str, time: float, bodies: tuple[int, ...]) -> None:
        super().__init__(what)
        self.what, self.time, self.bodies = what, time, bodies

    def __reduce__(self) -> tuple[Any, ...]:
        return Undecided, (self.what, self.time, self.bodies), self.__dict__


class PossibleEvent(NamedTuple):
    """An event that is to come.

    ``root`` is the ball of -d.v of two discs when they touch. ``doubt`` says what is not known about an event
    that may come, and not before its moment's ``low``. ``late`` is whether the bodies overlap already.
    """

    moment: EventTime
    root: arb | None = None
    doubt: str | None = None
    late: bool = False


class EventQueue:
    """The events that are to come, by their numbers.

    Attributes:
        end: the number of the end.
        turning: the body of the next turn.
    """

    def __init__(self, bodies: int) -> None:
        self._n = bodies
        self._first_pair = self.wall(bodies, 0)
        self.end = self.pair(bodies, 0)
        self.turning = -1
        self._low = np.full(self.end + 1, math.inf)
        self._high = np.full(self.end + 1, math.inf)
        self._events: dict[int, PossibleEvent] = {}

    def wall(self, body: int, wall: int) -> int:
        """Returns the number of a body's contact with a wall: 0 left, 1 right, 2 bottom, 3 top."""
        return 1 + 4 * body + wall

    def pair(self, a: int, b: int) -> int:
        """Returns the number of the contact of two bodies, a < b."""
        return self._first_pair + a * self._n + b

    def wall_of(self, event: int) -> tuple[int, int] | None:
        """Returns the body and the wall of a contact with a wall; None for other events."""
        return divmod(event - 1, 4) if TURN < event < self._first_pair else None

    def bodies_of(self, event: int) -> tuple[int, ...]:
        """Returns the bodies of an event."""
        if event == TURN:
            return (self.turning,)
        if event < self._first_pair:
            return ((event - 1) // 4,)
        return () if event == self.end else divmod(event - self._first_pair, self._n)

    def name_of(self, event: int) -> str:
        """Returns what an event is, in words."""
        bodies = self.bodies_of(event)
        if event == TURN:
            return f"the turn of disc {bodies[0]}"
        if event < self._first_pair:
            wall = ("left", "right", "bottom", "top")[(event - 1) % 4]
            return f"disc {bodies[0]} and the {wall} wall"
        return f"discs {bodies[0]} and {bodies[1]}" if bodies else "the end"

    def get(self, event: int) -> PossibleEvent | None:
        """Returns the known part of an event; None: it is not to come."""
        return self._events.get(event)

    def put(self, event: int, coming: PossibleEvent | None) -> None:
        """Sets when an event is to come; None: not at all."""
        if coming is not None:
            self._events[event] = coming
            self._low[event] = coming.moment.low
            self._high[event] = math.inf if coming.doubt else coming.moment.high
        elif self._events.pop(event, None) is not None:
            self._low[event] = self._high[event] = math.inf

    def next(self) -> int | None:
        """Returns the next event; None: there is none. Raises Undecided where it is not certain which."""
        # Every other event is certain to come after one of these. An event in doubt has no upper bound: it is
        # among them from the moment on at which it could come.
        near: list[int] = np.flatnonzero(self._low <= self._high.min()).tolist()
        near = [event for event in near if event in self._events]
        if not near:
            return None
        for event in near:
            doubt = self._events[event].doubt
            if doubt is not None:
                raise self._undecided(doubt, event)
        first = near[0]
        for event in near[1:]:
            order = self._compare(event, first)
            if order < 0:
                first = event
            elif order == 0:  # one moment for both: from now on they compare without arithmetic
                self._events[event] = self._events[event]._replace(moment=self._events[first].moment)
        return first

    def _compare(self, one: int, two: int) -> int:
        """Returns -1, 0 or 1: whether an event is before another, with it, or after it."""
        moment, other = self._events[one].moment, self._events[two].moment
        if moment is other:
            return 0
        if moment.ball < other.ball:
            return -1
        if moment.ball > other.ball:
            return 1
        if moment.root is not None and other.root is not None and same(moment.root, other.root):
            return 0
        raise self._undecided(f"tie of {self.name_of(two)} and {self.name_of(one)}", two, one)

    def _undecided(self, what: str, *events: int) -> Undecided:
        bodies = {body for event in events for body in self.bodies_of(event)}
        return Undecided(what, max(self._events[events[0]].moment.low, 0.0), tuple(sorted(bodies)))
