"""The course of events: rules 7 to 11 and 8r to 9r of docs/specification.md, each event decided exactly.

A heap holds the possible next events, by tick, class and numbers, the order of rule 8:

- *bounds* (class 0, before all else at their tick): no contact of two bodies comes before it; or, without a
  second body, no contact of one body with any body that its entries do not name. At the head of the heap the
  first kind is replaced by the exact tick, the second by new bounds of the body with all others;
- anchorings by the clock, walls and pairs, exact.

The commands of the scene, class 2, are in a list of their own: each comes before the walls and pairs of its
tick, or after its number of contacts. After a change of a body's plan, ``bounds.ContactBounds`` bounds its
contacts with all others: the few that may come first get an entry each, the rest one for all. So for any two
bodies, at least the one that changed last has an entry that covers the other, and an entry that is older than
a plan of its bodies is dropped. This takes O(n) a contact, with some two exact ticks.
"""

import heapq
import itertools
import math
from collections.abc import Iterable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from kinetile import Accelerate, Insert, Move, Remove, Scene, SetKind, Shape, Turn
from kinetile.arrays import Floats
from kinetile.instruments import ACCELERATED, HELD, INSERTED, MOVED, OF_KIND, REANCHORED, REMOVED, TURNED
from kinetile_accuracy.specification import arithmetic, shapes
from kinetile_accuracy.specification.answers import LONG_AGO, OUT, Answers, Support, across, both_hold, part
from kinetile_accuracy.specification.arithmetic import (
    BEAT,
    HORIZON,
    SPAN,
    FlightPlan,
    Frame,
    Separation,
    Vector,
    Whole,
)
from kinetile_accuracy.specification.bounds import ContactBounds
from kinetile_accuracy.specification.shapes import Difference, Face
from kinetile_accuracy.specification.touching import parting_tick, touching_tick

_BOUND, _ANCHORING, _WALL, _PAIR, _PARTING = range(5)
_NOBODY = -1
_FEW = 4
"""Partners of a body with their own entries: with more partners, more entries are discarded."""


EVENTS = {Turn: TURNED, Accelerate: ACCELERATED, SetKind: OF_KIND, Move: MOVED}
EVENTS |= {Insert: INSERTED, Remove: REMOVED}
"""The commands as named in logs."""

LEAVING = HELD
"""The name in logs of a body that leaves its support (rule 8r)."""

Command = Turn | Accelerate | SetKind | Move | Insert | Remove


def _stands(held: tuple["Support", ...], pull: Vector, support: "Support") -> bool:
    """Returns True if a movable body that had these supports and acceleration may be a support (rule 9r)."""
    return len(held) == 1 and pull == (0.0, 0.0) and held[0].out == support.out


class CourseEvent(NamedTuple):
    """An event: its tick since the start, and its bodies as a log names them (``kinetile.kernel.log``)."""

    tick: int
    a: int
    b: int


class _Entry(NamedTuple):
    """A possible next event, compared in this order, the order of rule 8. ``b`` is a body, or ``_NOBODY``; at
    a wall its number, negated, or ``-LEAVING``. The stamps identify the plans of a and b."""

    tick: int
    kind: int
    a: int
    b: int
    stamp: int = 0
    other_stamp: int = 0
    image: Whole = (0, 0)


class _Passing(NamedTuple):
    """Two bodies a < b that pass through each other, and their image (rule 11p)."""

    a: int
    b: int
    image: Whole


class _Planned(NamedTuple):
    """A command of the scene: its tick, the number of contacts of that tick before it, and the command."""

    tick: int
    after: int
    command: Command

    @property
    def event(self) -> CourseEvent:
        return CourseEvent(self.tick, self.command.body, EVENTS[type(self.command)])


class Course:
    """The events of a scene, one after the other; ``last`` is an exact end (rule 8): tick, contacts.

    ``plans`` are the present flight plans, by body: the last plan of a removed body, any plan of a later one.
    ``held`` are the supports of each body (rule 9r), ``present`` is True for present bodies, all events up to
    the tick ``now`` are known, and ``tick`` is the length of a tick.
    """

    def __init__(self, scene: Scene, last: tuple[int, int] | None = None) -> None:
        bits = arithmetic.unit_bits(scene)
        self._last = last
        self.frame = Frame(scene.arena, bits, scene.periods)
        self._gravity = scene.gravity
        self.accelerated = any(arithmetic.largest_pull(scene))
        self._arena = scene.arena or ()
        self._periodic = any(scene.periods)
        self._span = BEAT if self._periodic else SPAN
        self.now = 0
        self.tick = 2.0**-self.frame.fine
        commands = [_Planned(*_moment(each, scene.start, bits), each) for each in scene.commands]
        self._commands = commands[::-1]  # the next one is the last
        inserted = [each for each in scene.commands if isinstance(each, Insert)]
        count = max([len(scene) - 1, *(each.body for each in inserted)]) + 1
        self._radius = scene.radius.tolist() + [0.0] * (count - len(scene))
        for each in inserted:
            self._radius[each.body] = each.radius
        self._answers = Answers(scene, count, self.tick)
        self._shapes = dict(enumerate(scene.shapes[each] for each in scene.shape.tolist() if each >= 0))
        self._shapes |= {each.body: each.shape for each in inserted if isinstance(each.shape, Shape)}
        self._difference_of = cache(Difference)
        self._passing: dict[_Passing, int] = {}  # each with its first tick
        self._at_once: list[_Passing] = []  # the passings that begin now, before all else
        self._heap = [_Entry(self._span, _ANCHORING, _NOBODY, _NOBODY)]
        self._contacts = _NOBODY, 0  # the tick of the last contact, and the number there
        self._met = [_NOBODY] * count  # the body that each has just met (rule 7), and the image
        self._image: list[Whole] = [(0, 0)] * count
        self._stamp = [0] * count
        self._whole: list[Vector] = [(0.0, 0.0)] * count  # accelerations, also of held bodies
        self.held: list[tuple[Support, ...]] = [()] * count
        radius, shaped = np.array(self._radius), bool(scene.shapes)
        self._bounds = ContactBounds(radius, self.frame.fine, scene.periods, shaped, self.accelerated)
        self.present = [False] * count
        self.plans = [FlightPlan(0.0, 0.0, 0.0, 0.0, 0, 0.0, self.frame)] * count
        states = (column.tolist() for column in (scene.position, scene.velocity, scene.acceleration))
        for body, (place, velocity, pull) in enumerate(zip(*states, strict=True)):
            self._enter(body, tuple(place), tuple(velocity), tuple(pull))
        if self._answers.passing:
            self._at_once = self._overlaps(itertools.combinations(range(len(scene)), 2))
        for body in range(len(scene)):
            self._schedule([body])
        heapq.heapify(self._heap)

    def next(self, end: int) -> CourseEvent | None:
        """Returns the next event up to and at a tick, which has not happened yet, or None."""
        heap = self._heap
        if self._at_once:
            return CourseEvent(self.now, *self._at_once[0][:2])
        while heap and min(heap[0].tick, self._commands[-1].tick if self._commands else math.inf) <= end:
            entry = heap[0]
            tick, kind, a, b = entry[:4]
            if not self._is_current(entry) or (kind == _PAIR and self._has_begun(a, b, tick)):
                heapq.heappop(heap)  # a pair has an entry for each of the two: the second is void
            elif self._is_command_next():
                planned = self._commands[-1]
                self.now = max(self.now, planned.tick)
                if not self._has_room(planned.command):
                    return None
                ending = self._ends_with(planned.command)
                return planned.event if ending is None else CourseEvent(self.now, ending.b, ending.a)
            elif kind >= _WALL and self._last is not None and self._last <= (tick, self._so_far(tick)):
                return None
            elif kind == _BOUND:
                heapq.heappop(heap)
                self.now = max(self.now, tick)
                self._replace_bound(a, b)
            elif kind == _ANCHORING and a == _NOBODY:
                heapq.heappop(heap)
                self._end_span(tick)
            elif kind == _ANCHORING:
                return CourseEvent(tick, a, REANCHORED)
            elif kind == _PARTING:
                return CourseEvent(tick, b, a)
            else:
                return CourseEvent(tick, a, b if kind == _PAIR else -b)
        return None

    def _is_command_next(self) -> bool:
        """Returns True if a command comes before the head of the heap (rule 8)."""
        if not self._commands:
            return False
        (tick, after, _), head = self._commands[-1], self._heap[0]
        if head.tick != tick or head.kind < _WALL:
            return tick < head.tick
        return after <= self._so_far(tick)

    def _so_far(self, tick: int) -> int:
        return self._contacts[1] if self._contacts[0] == tick else 0

    def _has_room(self, command: Command) -> bool:
        """Returns True if a body that is inserted or moved now has room (rules 9 and 11m), or if a body with
        a new kind still passes through its present partners (rule 11k); always for another command."""
        if isinstance(command, SetKind):
            body = command.body
            through = {a + b - body for a, b, _ in self._passing if body in (a, b)}
            return all(self._answers.passes_as(command.kind, other) for other in through)
        if not isinstance(command, Insert | Move):
            return True
        r = self._radius[command.body]
        x, y = command.position
        reaches = self._shapes[command.body].reaches if self._shapes else (r, r, r, r)
        axes = zip((x, y), self._arena, self.frame.periods, (reaches[:2], reaches[2:]), strict=False)
        for place, side, period, (low, high) in axes:
            if not period and (place < low - 1e-12 * r or side - place < high - 1e-12 * r):
                return False
        plan = FlightPlan(x, y, 0.0, 0.0, self.now, r, self.frame)
        centre = plan.x, plan.y
        for other in self._there():
            if other == command.body or self._answers.passes(command.body, other):
                continue
            its = self._anchored(other)
            dx, dy = (
                math.remainder(there - here, period) if period else there - here
                for here, there, period in zip(centre, (its.x, its.y), self.frame.periods, strict=True)
            )
            both_radii = r + self._radius[other]
            if self._overlap(command.body, other, (dx, dy), both_radii - 1e-12 * both_radii):
                return False
        return True

    def _ends_with(self, command: Command) -> _Passing | None:
        """Returns the first passing that ends before a command that takes its body away; or None."""
        if not isinstance(command, Remove | Move):
            return None
        return min((each for each in self._passing if command.body in each[:2]), default=None)

    def _overlaps(self, pairs: Iterable[tuple[int, int]]) -> list[_Passing]:
        """Returns the passings that begin at once, because bodies overlap (rules 11 and 11p)."""
        found = []
        for a, b in pairs:
            if not self._answers.passes(a, b):
                continue
            one, two = self._anchored(a), self._anchored(b)
            reach = (self._radius[a] + self._radius[b]) * (1.0 - 1e-12)
            # A reach is less than a period, and places are within half a period of 0.
            sides = ((-1, 0, 1) if period else (0,) for period in self.frame.periods)
            for side in itertools.product(*sides):
                image = side[0] + one.turns[0] - two.turns[0], side[1] + one.turns[1] - two.turns[1]
                if self._overlap(a, b, self._apart(one, two, image), reach):
                    found.append(_Passing(a, b, image))
        return found

    def _overlap(self, a: int, b: int, apart: Vector, reach: float) -> bool:
        """Returns True if two bodies at a difference ``apart`` overlap: discs nearer than a reach, and shapes
        deeper than the same share of their radii, unless both are immovable (rules 9 and 9s)."""
        m = self._difference(a, b)
        if m is None:
            return apart[0] * apart[0] + apart[1] * apart[1] < reach * reach
        deep = 1e-12 * (self._radius[a] + self._radius[b])
        return not self._both_immovable(a, b) and shapes.room(m, apart) < -deep

    def _there(self) -> Iterable[int]:
        return (body for body, present in enumerate(self.present) if present)

    def carry_out(self) -> None:
        """Carries out the event that ``next`` has returned last."""
        self._passed = True
        if self._at_once:
            self._begin_passing(self._at_once.pop(0))
            return
        if self._is_command_next():
            ending = self._ends_with(self._commands[-1].command)
            if ending is None:
                self._carry_out_command(self._commands.pop())
            else:
                self._count(self.now)
                del self._passing[ending]
            return
        tick, kind, a, b, _, _, image = heapq.heappop(self._heap)
        self.now = tick
        if kind == _PARTING:
            self._count(tick)
            del self._passing[_Passing(a, b, image)]
            self._replace_bound(a, b)
            return
        if kind == _PAIR and self._answers.passes(a, b):
            met = self.meeting(a, b)
            assert met is not None  # it was known when it came to the head
            if not self._answers.meets(a, b, self._normal(a, b, met[1])[0]):
                self._begin_passing(_Passing(a, b, met[1]))
                self._replace_bound(a, b)
                return
        self._passed = False
        bodies = [a, b] if kind == _PAIR else [a]
        before = [(self.plans[body].vx, self.plans[body].vy) for body in bodies]
        if kind == _ANCHORING:
            plan = self._anchored(a)
            self._change(a, plan, (plan.vx, plan.vy))
        elif (kind, b) == (_WALL, -LEAVING):
            self._let_go(a)
        else:
            self._count(tick)
            if kind == _PAIR:
                met = self.meeting(a, b) if self._periodic else None
                image = image if met is None else met[1]
                self._meet(a, b, image)
                self._met[a], self._met[b] = b, a
                self._image[a] = self._image[b] = image
            else:
                self._meet_wall(a, -b)
        self._schedule(bodies)
        for body, velocity in zip(bodies, before, strict=True):
            if math.isinf(self._answers.masses[body]):
                frees = velocity != (self.plans[body].vx, self.plans[body].vy)
            else:
                frees = kind != _ANCHORING and not any(self._holds(body, other) for other in bodies)
            if frees:
                self._let_go_of(body)
        self._drop_former()

    def _drop_former(self) -> None:
        """Drops entries of former plans, which are else removed only at the head of the heap: a body that is
        to meet a wall in the far future would leave one at each of its contacts."""
        if len(self._heap) > 64 * len(self.plans) + 1024:
            self._heap = [entry for entry in self._heap if self._is_current(entry)]
            heapq.heapify(self._heap)

    def _meet_wall(self, body: int, wall: int) -> None:
        """Gives a body at a wall its new plan (rules 9, 9r and 11)."""
        held, pull = self.held[body], self.plans[body].pull
        plan = self._let_go(body)
        (nx, ny), w = OUT[wall], self._answers.settle(body, wall)
        slow = w and plan.vx * nx + plan.vy * ny <= w
        if slow and self._settles(body, plan, Support(wall, (-nx, -ny)), held):
            self._answers.touch((body,), self.now)
        else:
            self._change(body, plan, self._answers.at_wall(body, wall, plan, pull))

    def _meet(self, a: int, b: int, image: Whole) -> None:
        """Gives two bodies that meet through an image their new plans (rules 9, 9r and 11)."""
        held = self.held[a], self.held[b]
        pulls = self.plans[a].pull, self.plans[b].pull
        out, face = self._normal(a, b, image)
        plans = one, two = self._let_go(a), self._let_go(b)
        w = self._answers.settle(a, b)
        if w and arithmetic.speed_along(out, ((one.vx, one.vy), (two.vx, two.vy))) >= -w:
            for body, plan, support, until in (
                (a, one, Support(b, (-out[0], -out[1]), image, face), held[0]),
                (b, two, Support(a, out, image, face), held[1]),
            ):
                other = int(body == a)
                if self._settles(body, plan, support, until, _stands(held[other], pulls[other], support)):
                    if self._answers.masses[support.number] < math.inf:
                        under = self.plans[support.number]
                        self._change(support.number, under, (under.vx, under.vy), (0.0, 0.0))
                        self.held[support.number] = held[other]
                    self._answers.touch((a, b), self.now)
                    return
        velocities = self._answers.of_pair((a, b), plans, out, pulls)
        for body, plan, velocity in zip((a, b), plans, velocities, strict=True):
            self._change(body, plan, velocity)

    def _normal(self, a: int, b: int, image: Whole) -> tuple[Vector, Face | None]:
        """Returns the normal of two bodies that meet now through an image, and its face (rules 9 and 9s)."""
        one, two = self._anchored(a), self._anchored(b)
        return self._answers.normal(one, two, self._apart(one, two, image), self._difference(a, b))

    def _settles(
        self, body: int, plan: FlightPlan, support: Support, held: tuple[Support, ...], stood: bool = False
    ) -> bool:
        """Gives a body its plan on a support, if it settles there (rule 9r); ``held``: its old supports;
        ``stood``: whether a movable support may hold it."""
        whole, other = self._whole[body], support.number
        if other >= 0:
            fixed = math.isinf(self._answers.masses[other]) or stood
            if not fixed or support.face is None or math.isinf(self._answers.masses[body]):
                return False
        (ux, uy), w = self._velocity(other), self._answers.settle(body, other)
        vx, vy = plan.vx - ux, plan.vy - uy
        slow = vx * vx + vy * vy <= w * w
        if (
            len(held) == 1
            and slow
            and self._velocity(held[0].number) == (ux, uy)
            and both_hold(whole, held[0], support)
        ):
            self._change(body, plan, (ux, uy), (0.0, 0.0))
            self.held[body] = held[0], support
            return True
        pull, (wx, wy) = across(whole, support.out), across((vx, vy), support.out)
        velocity = ux + wx, uy + wy
        along = [speed for speed, period in zip(pull, self.frame.periods, strict=True) if period]
        if not part(whole, support.out) < 0 or any(along):
            return False
        self._change(body, plan, velocity, pull)
        self.held[body] = (support,)
        leaves = self._leaving(body)
        if leaves is not None and leaves <= self.now:
            self.held[body] = ()
            return False
        self._change(body, plan, self._answers.settled(body, support, velocity, (ux, uy)), pull)
        return True

    def _velocity(self, support: int) -> Vector:
        return (self.plans[support].vx, self.plans[support].vy) if support >= 0 else (0.0, 0.0)

    def _leaving(self, body: int) -> int | None:
        """Returns the tick at which a body leaves its support (rule 8r); None: never, or no support."""
        if len(self.held[body]) != 1 or self.held[body][0].face is None:
            return None
        ((other, _, image, face),) = self.held[body]
        a, b = min(body, other), max(body, other)
        m = self._difference(a, b)
        assert m is not None
        assert face is not None
        one, two, plan = self._anchored(a), self._anchored(b), self.plans[body]
        sign = 1.0 if body == b else -1.0
        ux, uy = self._velocity(other)
        v, pull = (sign * (plan.vx - ux), sign * (plan.vy - uy)), (sign * plan.pull[0], sign * plan.pull[1])
        wait = shapes.ledge(m, face, self._apart(one, two, image), v, pull, self.tick)
        return None if wait is None else plan.anchor + wait

    def _let_go(self, body: int) -> FlightPlan:
        """Releases a body, anchored now, from its supports, and returns its plan (rule 9h)."""
        plan = self._anchored(body)
        self._change(body, plan, (plan.vx, plan.vy), self._whole[body])
        self.held[body] = ()
        return self.plans[body]

    def _let_go_of(self, support: int) -> None:
        """Releases all that a body holds (rule 9h)."""
        for body, held in enumerate(self.held):
            if held and self._holds(support, body):
                self._let_go(body)
                self._schedule([body])
                self._let_go_of(body)

    def _holds(self, support: int, body: int) -> bool:
        return any(each.number == support for each in self.held[body])

    def _count(self, tick: int) -> None:
        self._contacts = tick, self._so_far(tick) + 1

    def _begin_passing(self, passing: _Passing) -> None:
        self._count(self.now)
        self._passing[passing] = self.now
        self._await_parting(passing)

    def _await_parting(self, passing: _Passing) -> None:
        """Enters the end of a passing, if it has one by the present plans."""
        a, b, image = passing
        m = self._difference(a, b)
        flight, begun = Separation(self.plans[a], self.plans[b], self.frame, image), self._passing[passing]
        tick = parting_tick(m, flight, begun)
        if tick is not None:
            tick = max(tick, begun + 1)
            heapq.heappush(self._heap, _Entry(tick, _PARTING, a, b, self._stamp[a], self._stamp[b], image))

    def _carry_out_command(self, planned: _Planned) -> None:
        self.now, _, command = planned
        body = command.body
        if isinstance(command, Remove | Move):
            self.plans[body] = self._anchored(body)
            self.present[body] = False
            self._bounds.remove(body)
            self._stamp[body] += 1
            self._met[body] = _NOBODY
            self._answers.touch((body,), LONG_AGO)
            self.held[body] = ()
            self._let_go_of(body)
            if isinstance(command, Remove):
                return
        if isinstance(command, Insert | Move):
            pull, flies = self._whole[body], (self.plans[body].vx, self.plans[body].vy)
            if isinstance(command, Insert):
                pull, flies = arithmetic.pull_of(command, self._gravity), _two(command.velocity)
            self._enter(body, _two(command.position), flies, pull)
            others = (other for other in self._there() if other != body)
            self._at_once = self._overlaps((min(body, other), max(body, other)) for other in others)
        else:
            plan = self._let_go(body)
            if isinstance(command, Turn):
                self._change(body, plan, _two(command.velocity))
            elif isinstance(command, SetKind):
                self._answers.set_kind(body, command.kind)
                self._change(body, plan, (plan.vx, plan.vy))
            else:
                self._whole[body] = _two(command.acceleration)
                self._change(body, plan, (plan.vx, plan.vy), self._whole[body])
        self._schedule([body])
        if isinstance(command, Turn | SetKind) or self._answers.masses[body] < math.inf:
            self._let_go_of(body)

    def _enter(self, body: int, place: Vector, velocity: Vector, pull: Vector) -> None:
        plan = FlightPlan(*place, *velocity, self.now, self._radius[body], self.frame, pull=pull)
        self.present[body] = True
        self._whole[body] = pull
        self.plans[body] = plan
        self._bounds.put(body, plan)

    def have_just_met(self, a: int, b: int) -> bool:
        """Returns True if two bodies have just met each other (rule 7)."""
        return self._met[a] == b and self._met[b] == a

    def meeting(self, a: int, b: int) -> tuple[int, Whole] | None:
        """Returns the tick of contact of bodies a < b, and the image; None: no contact."""
        m, one, two = self._difference(a, b), self.plans[a], self.plans[b]
        met = self._image[a] if self.have_just_met(a, b) else None
        held = [each.image for each in self.held[a] if each.number == b]
        held += [each.image for each in self.held[b] if each.number == a]
        earliest = self.now if self._answers.passes(a, b) else 0
        if m is not None and self._both_immovable(a, b):
            return None  # rule 7s

        def tick_through(image: Whole) -> int | None:
            return touching_tick(m, Separation(one, two, self.frame, image), image == met, earliest)

        if self._periodic:
            left_out = held + [each.image for each in self._passing if each[:2] == (a, b)]
            return arithmetic.image_tick(one, two, self.frame, left_out, earliest, tick_through)
        tick = None if held else tick_through((0, 0))
        return None if tick is None else (tick, (0, 0))

    def wall(self, body: int) -> tuple[int, int] | None:
        """Returns the tick of contact of a body with a wall by its plan, and the wall; None: no contact."""
        plan = self.plans[body]
        if not self._shapes:
            return arithmetic.wall_tick(plan, self.frame)
        return shapes.wall_tick(self._shapes[body], plan, self.frame)

    def _both_immovable(self, a: int, b: int) -> bool:
        return math.isinf(self._answers.masses[a]) and math.isinf(self._answers.masses[b])

    def _difference(self, a: int, b: int) -> Difference | None:
        return self._difference_of(self._shapes[a], self._shapes[b]) if self._shapes else None

    def _apart(self, one: FlightPlan, two: FlightPlan, image: Whole) -> Vector:
        """Returns the difference from the first of two anchored bodies to the second, through an image (rule
        9p)."""
        right, up = (float(image[axis] + two.turns[axis] - one.turns[axis]) for axis in range(2))
        width, height = self.frame.periods
        return (two.x - one.x) + right * width, (two.y - one.y) + up * height

    def _anchored(self, body: int) -> FlightPlan:
        plan = self.plans[body]
        place, velocity = plan.moved(self.now, self.tick)
        more = plan.turns, plan.pull
        return FlightPlan(*place, *velocity, self.now, self._radius[body], self.frame, *more)

    def has_changed_plans(self, event: CourseEvent) -> bool:
        """Returns True if the last event has given plans to its bodies: all but passings do."""
        return event.b < 0 or not self._passed

    def ends(self, a: int, b: int) -> bool:
        """Returns True if bodies a < b pass through each other, so that they have to part."""
        return any(each[:2] == (a, b) for each in self._passing)

    def _has_begun(self, a: int, b: int, tick: int) -> bool:
        """Returns True if an entry of a tick of contact belongs to a passing that has begun by now."""
        if not self._periodic or not self.ends(a, b):
            return self.ends(a, b)
        met = self.meeting(a, b)
        return met is None or met[0] != tick

    def is_planned(self, event: CourseEvent) -> bool:
        """Returns True if the scene has this command at its tick, and it has not happened yet."""
        return any(planned.event == event for planned in self._commands)

    def _is_current(self, entry: _Entry) -> bool:
        _, kind, a, b, stamp, other_stamp, _ = entry
        fits = kind == _WALL or b == _NOBODY or self._stamp[b] == other_stamp
        return a == _NOBODY or (self._stamp[a] == stamp and fits)

    def _change(self, body: int, plan: FlightPlan, velocity: Vector, pull: Vector | None = None) -> None:
        """Gives a body another velocity, and perhaps acceleration, on a plan anchored now."""
        more = plan.turns, plan.pull if pull is None else pull
        plan = FlightPlan(plan.x, plan.y, *velocity, self.now, self._radius[body], self.frame, *more)
        self.plans[body] = plan
        self._bounds.put(body, plan)
        self._stamp[body] += 1
        self._met[body] = _NOBODY

    def _schedule(self, bodies: list[int]) -> None:
        for body in bodies:
            met = self.wall(body)
            if met is not None:
                heapq.heappush(self._heap, _Entry(met[0], _WALL, body, -met[1], self._stamp[body]))
            leaves = self._leaving(body)
            if leaves is not None:
                heapq.heappush(self._heap, _Entry(leaves, _WALL, body, -LEAVING, self._stamp[body]))
        for passing in [each for each in self._passing if each.a in bodies or each.b in bodies]:
            self._await_parting(passing)
        self._bound(bodies)

    def _bound(self, bodies: list[int]) -> None:
        """Enters bounds with all others: the few that may come first get an entry each, the rest one."""
        for body, waits in zip(bodies, self._bounds.waits(bodies, self.now), strict=True):
            other = self._met[body]
            met = not self._periodic and other != _NOBODY and self.have_just_met(body, other)
            if met and self.plans[body].pull == self.plans[other].pull:
                waits[other] = np.inf  # they do not meet again
            for a, b, _ in () if self._periodic else self._passing:  # bounded again at their parting
                if body in (a, b):
                    waits[a + b - body] = np.inf
            stamp, last = self._stamp[body], min(_FEW, len(waits)) - 1
            # Waits of a tick at most too: their bound would be renewed again and again.
            enough = max(np.partition(waits, last)[last], 1.0)
            for other in np.flatnonzero((waits <= enough) & (waits < HORIZON)).tolist():
                tick = self.now + int(waits[other])
                heapq.heappush(self._heap, _Entry(tick, _BOUND, body, other, stamp, self._stamp[other]))
            rest = int(waits[waits > enough].min(initial=HORIZON))
            if rest < HORIZON:
                heapq.heappush(self._heap, _Entry(self.now + rest, _BOUND, body, _NOBODY, stamp))

    def _replace_bound(self, a: int, b: int) -> None:
        """Enters the exact tick, or new bounds, in place of a bound that was at the head of the heap."""
        if b == _NOBODY:
            self._bound([a])
            return
        a, b = min(a, b), max(a, b)
        if not self._periodic and self.ends(a, b):
            return
        met = self.meeting(a, b)
        if met is not None and not (met[0] < self.now and self._answers.passes(a, b)):
            heapq.heappush(self._heap, _Entry(met[0], _PAIR, a, b, self._stamp[a], self._stamp[b]))

    def _end_span(self, tick: int) -> None:
        """Enters the anchorings at the end of a span (rule 8)."""
        self.now = tick
        self._bounds.rebase(tick)
        for body in self._there():
            if self.plans[body].anchor < tick - self._span:
                heapq.heappush(self._heap, _Entry(tick, _ANCHORING, body, _NOBODY, self._stamp[body]))
        heapq.heappush(self._heap, _Entry(tick + self._span, _ANCHORING, _NOBODY, _NOBODY))


def _two(numbers: Sequence[float] | Floats) -> Vector:
    x, y = numbers
    return float(x), float(y)


def _moment(command: Command, start: float, bits: int) -> tuple[int, int]:
    """Returns the tick of a command, and the number of contacts of that tick before it (rule 2)."""
    if command.at is None:
        return arithmetic.tick_of(command.time, start, bits), 0
    epoch, tick, after = command.at
    return (epoch << arithmetic.UNIT_BITS) + tick, after
