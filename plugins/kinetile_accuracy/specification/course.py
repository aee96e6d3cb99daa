"""The course of events: rules 7 to 9 of docs/specification.md, event by event, each decided exactly.

A heap holds what may come next, by tick, class and numbers, which is the order of rule 8:

- *bounds* (class 0, before whatever else is at their tick): no contact of two bodies comes before it; or,
  without a second body, no contact of one body with any that its entries do not name. At the head of the heap
  the first is replaced by the exact tick, the second by new bounds of the body with all others;
- anchorings by the clock, turns, walls and pairs, exact.

When a body's plan has changed, ``bounds.ContactBounds`` bounds its contacts with all others: the few that may
come first get an entry each, the rest one for all. So of each two bodies at least the one that changed last
has an entry that covers the other, and an entry that is older than the plan of one of its bodies is dropped.
That is O(n) a contact, and about one exact tick for each body in it.
"""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from kinetile.kernel.log import LEFT, REANCHORED, RIGHT, TURNED
from kinetile.scene import only_turns
from kinetile_accuracy.specification.arithmetic import (
    BEAT,
    HORIZON,
    SPAN,
    FlightPlan,
    Frame,
    Vector,
    Whole,
    exchanged,
    image_tick,
    pair_tick,
    tick_of,
    unit_bits,
    wall_tick,
)
from kinetile_accuracy.specification.bounds import ContactBounds

if TYPE_CHECKING:
    from kinetile import Scene


_BOUND, _ANCHORING, _TURN, _WALL, _PAIR = range(5)
_NOBODY = -1
_FEW = 4
"""Partners of a body that get an entry of their own: with more, more entries come to nothing; with fewer, the
bounds of the rest are computed more often."""


class CourseEvent(NamedTuple):
    """An event: its tick since the start, and its bodies as a log names them (``kinetile.kernel.log``)."""

    tick: int
    a: int
    b: int


class _Entry(NamedTuple):
    """What may come next: compared in this order, which is that of rule 8.

    ``b`` is a body, or ``_NOBODY``; at a wall its number, negated; at a turn its place in the list. The
    stamps say which plans of a and b are meant.
    """

    tick: int
    kind: int
    a: int
    b: int
    stamp: int = 0
    other_stamp: int = 0


class Course:
    """The events of a scene, one after the other.

    Attributes:
        plans: the present flight plans, by body.
        now: the tick up to which all is known.
        tick: how long a tick is.
    """

    def __init__(self, scene: Scene) -> None:
        only_turns(scene, "the certifier")
        bits = unit_bits(scene)
        self.frame = Frame(scene.arena, bits, scene.periods)
        self._periodic = any(scene.periods)
        self._span = BEAT if self._periodic else SPAN
        self.now = 0
        self.tick = 2.0**-self.frame.fine
        self._radius = scene.radius.tolist()
        masses = scene.mass.tolist()
        self._mass = None if len(set(masses)) <= 1 else masses
        self._velocities = [turn.velocity for turn in scene.turns]
        self._heap = [
            _Entry(tick_of(turn.time, scene.start, bits), _TURN, turn.body, index)
            for index, turn in enumerate(scene.turns)
        ]
        self._heap.append(_Entry(self._span, _ANCHORING, _NOBODY, _NOBODY))
        self._met = [_NOBODY] * len(scene)
        self._image: list[Whole] = [(0, 0)] * len(scene)
        self._stamp = [0] * len(scene)
        self._bounds = ContactBounds(scene.radius, self.frame.fine, scene.periods)
        self.plans = [
            FlightPlan(x, y, vx, vy, 0, radius, self.frame)
            for (x, y), (vx, vy), radius in zip(
                scene.position.tolist(), scene.velocity.tolist(), self._radius, strict=True
            )
        ]
        for body, plan in enumerate(self.plans):
            self._bounds.put(body, plan)
        for body in range(len(scene)):
            self._schedule([body])
        heapq.heapify(self._heap)

    def next(self, end: int) -> CourseEvent | None:
        """Returns the next event up to and at a tick, which has not happened yet; None: there is none."""
        heap = self._heap
        while heap and heap[0].tick <= end:
            entry = heap[0]
            tick, kind, a, b, _, _ = entry
            if not self._is_current(entry):
                heapq.heappop(heap)
            elif kind == _BOUND:
                heapq.heappop(heap)
                self.now = max(self.now, tick)
                self._replace_bound(a, b)
            elif kind == _ANCHORING and a == _NOBODY:
                heapq.heappop(heap)
                self._end_span(tick)
            elif kind == _ANCHORING:
                return CourseEvent(tick, a, REANCHORED)
            elif kind == _TURN:
                return CourseEvent(tick, a, TURNED)
            else:
                return CourseEvent(tick, a, b if kind == _PAIR else -b)
        return None

    def carry_out(self) -> None:
        """Carries out the event that ``next`` has returned last."""
        tick, kind, a, b, _, _ = heapq.heappop(self._heap)
        self.now = tick
        one = self._anchored(a)
        velocity = one.vx, one.vy
        image = (0, 0)
        if kind == _PAIR:
            met = self.meeting(a, b) if self._periodic else None
            image = image if met is None else met[1]
            two = self._anchored(b)
            masses = None if self._mass is None else (self._mass[a], self._mass[b])
            velocity, other = exchanged(
                ((one.x, one.y), (two.x, two.y)),
                (velocity, (two.vx, two.vy)),
                masses,
                self._away(one, two, image),
            )
            self._change(b, two, other)
        elif kind == _WALL:
            vx, vy = velocity
            velocity = (-vx, vy) if -b in (LEFT, RIGHT) else (vx, -vy)
        elif kind == _TURN:
            vx, vy = self._velocities[b]
            velocity = (vx, vy)
        self._change(a, one, velocity)
        if kind == _PAIR:
            self._met[a], self._met[b] = b, a
            self._image[a] = self._image[b] = image
        self._schedule([a, b] if kind == _PAIR else [a])
        # Entries of former plans go only when they come to the head: without this, a body that is to meet a
        # wall in the far future would leave one at each of its contacts.
        if len(self._heap) > 64 * len(self.plans) + 1024:
            self._heap = [entry for entry in self._heap if self._is_current(entry)]
            heapq.heapify(self._heap)

    def barred(self, a: int, b: int) -> bool:
        """Returns whether two bodies are barred from each other (rule 7)."""
        return self._met[a] == b and self._met[b] == a

    def meeting(self, a: int, b: int) -> tuple[int, Whole] | None:
        """Returns the tick of contact of two bodies a < b by their plans, and the image; None: none.

        Without periodic axes that is of two that may be barred; with them the barred image is left out.
        """
        if self._periodic:
            barred = self._image[a] if self.barred(a, b) else None
            return image_tick(self.plans[a], self.plans[b], self.frame, barred)
        tick = pair_tick(self.plans[a], self.plans[b])
        return None if tick is None else (tick, (0, 0))

    def _away(self, one: FlightPlan, two: FlightPlan, image: Whole) -> Vector:
        """Returns how far from its place the second body is met through an image (rule 9p)."""
        right, up = (float(image[axis] + two.turns[axis] - one.turns[axis]) for axis in range(2))
        return right * self.frame.periods[0], up * self.frame.periods[1]

    def _anchored(self, body: int) -> FlightPlan:
        """Returns a body's plan, anchored now."""
        plan = self.plans[body]
        x, y = plan.rounded_place(self.now, self.tick)
        return FlightPlan(x, y, plan.vx, plan.vy, self.now, self._radius[body], self.frame, plan.turns)

    def will_turn(self, body: int, tick: int) -> bool:
        """Returns whether the scene has a turn of a body at a tick, which has not happened yet."""
        return any(entry[:3] == (tick, _TURN, body) for entry in self._heap)

    def _is_current(self, entry: _Entry) -> bool:
        """Returns whether an entry is about the present plans of its bodies."""
        _, kind, a, b, stamp, other_stamp = entry
        if kind == _TURN or a == _NOBODY:
            return True
        if self._stamp[a] != stamp:
            return False
        return kind == _WALL or b == _NOBODY or self._stamp[b] == other_stamp

    def _change(self, body: int, plan: FlightPlan, velocity: Vector) -> None:
        """Gives a body another velocity on a plan that is anchored now, which ends its bars."""
        plan = FlightPlan(plan.x, plan.y, *velocity, self.now, self._radius[body], self.frame, plan.turns)
        self.plans[body] = plan
        self._bounds.put(body, plan)
        self._stamp[body] += 1
        self._met[body] = _NOBODY

    def _schedule(self, bodies: list[int]) -> None:
        """Enters what may come next of bodies with new plans."""
        for body in bodies:
            met = wall_tick(self.plans[body], self.frame)
            if met is not None:
                heapq.heappush(self._heap, _Entry(met[0], _WALL, body, -met[1], self._stamp[body]))
        self._bound(bodies)

    def _bound(self, bodies: list[int]) -> None:
        """Enters bounds with all others: the few that may come first get an entry each, the rest one."""
        for body, waits in zip(bodies, self._bounds.waits(bodies, self.now), strict=True):
            if not self._periodic and self._met[body] != _NOBODY and self.barred(body, self._met[body]):
                waits[self._met[body]] = np.inf
            stamp = self._stamp[body]
            rest = HORIZON
            if len(waits) > _FEW:
                enough = np.partition(waits, _FEW - 1)[_FEW - 1]
                few = np.flatnonzero(waits <= enough)
                if enough < HORIZON:
                    rest = int(waits[waits > enough].min(initial=HORIZON))
            else:
                few = np.arange(len(waits))
            for other in few.tolist():
                wait = waits[other]
                if wait < HORIZON:
                    entry = _Entry(self.now + int(wait), _BOUND, body, other, stamp, self._stamp[other])
                    heapq.heappush(self._heap, entry)
            if rest < HORIZON:
                heapq.heappush(self._heap, _Entry(self.now + rest, _BOUND, body, _NOBODY, stamp))

    def _replace_bound(self, a: int, b: int) -> None:
        """Enters the exact tick, or new bounds, in place of a bound that was at the head of the heap."""
        if b == _NOBODY:
            self._bound([a])
            return
        a, b = min(a, b), max(a, b)
        met = self.meeting(a, b)
        if met is not None:
            heapq.heappush(self._heap, _Entry(met[0], _PAIR, a, b, self._stamp[a], self._stamp[b]))

    def _end_span(self, tick: int) -> None:
        """Enters the anchorings at the end of a span of bodies with one plan for all of it (rule 8)."""
        self.now = tick
        self._bounds.rebase(tick)
        for body, plan in enumerate(self.plans):
            if plan.anchor < tick - self._span:
                heapq.heappush(self._heap, _Entry(tick, _ANCHORING, body, _NOBODY, self._stamp[body]))
        heapq.heappush(self._heap, _Entry(tick + self._span, _ANCHORING, _NOBODY, _NOBODY))
