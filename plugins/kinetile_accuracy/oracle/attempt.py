"""An attempt of the oracle: an event-driven simulation in ball arithmetic at one precision.

Every number is a ball, an interval that certainly holds the true number. Events are found one after another
by computing all pairs and all walls; each comparison that decides an event or its order must have the same
result for every choice of numbers from the balls. If it has not, the discs concerned may still fly
on rational lines, which decide (``flights``); else ``Undecided`` is raised, and the oracle tries again with
more bits. A doubt about an event that cannot be the next one is left open until it can.

Two things keep the balls small. A plan is anchored at an exact number, the lower end of the ball of the time
at which it was made, so that the doubt about a time enters only through the change of velocity; and a wall
mirrors a plan without anchoring it anew.

Nothing here comes from the kernel. All times count from the scene's start. Needs python-flint; the precision
is the caller's (``flint.ctx``).
"""

from __future__ import annotations

import math
from functools import partial
from typing import NamedTuple

import numpy as np
from flint import arb, fmpq

from kinetile.scene import Scene, only_turns
from kinetile_accuracy.oracle.event_queue import TURN, EventQueue, PossibleEvent, Undecided
from kinetile_accuracy.oracle.flights import (
    ZERO,
    BallPlan,
    EventTime,
    Line,
    exact,
    exchange,
    first_contact,
    first_root,
)

NARROW = 80
"""Bits to which the time of a contact must be known, relative to the time since the start."""

LEAST = 2.0**-1000
SURE = 1.0 - 2.0**-40
"""A factor by which bounds in doubles are less than what they are computed from."""


class BallContact(NamedTuple):
    """A contact: ball of the time since the start, the bodies, whether the one before was at the same time,
    and which part of the relative velocity is along the line of centres, or across the wall."""

    ball: arb
    a: int
    b: int
    tied: bool
    head_on: float


class Attempt:
    """A run of a scene at the present precision.

    Args:
        scene: the scene.
        until: when the end is; None: never.
        discs, walls: which contacts there are.

    Attributes:
        met: the contacts, all certain.
        ended: "until" or "quiet" when the run is over.
        crowd: contacts at the present moment.
    """

    def __init__(self, scene: Scene, until: fmpq | None, discs: bool, walls: bool) -> None:
        self.met: list[BallContact] = []
        self.ended: str | None = None
        self.crowd = 0
        only_turns(scene, "the oracle")
        self._n = len(scene)
        self._discs = discs
        self._radius = [arb(r) for r in scene.radius.tolist()]
        self._exact_radius = [exact(r) for r in scene.radius.tolist()]
        self._mass = [exact(m) for m in scene.mass.tolist()]
        self._sides = None if scene.arena is None or not walls else tuple(map(exact, scene.arena))
        self._start = exact(scene.start)
        self._turns = list(scene.turns[::-1])
        self._plans = []
        for x, y, vx, vy in np.column_stack([scene.position, scene.velocity]).tolist():
            self._plans.append(BallPlan.along(Line((exact(x), exact(y)), (exact(vx), exact(vy)))))
        self._queue = EventQueue(self._n)
        self._advance_to(EventTime.at(ZERO))
        if until is not None:
            self._queue.put(self._queue.end, PossibleEvent(EventTime.at(until)))
        self._enter_turn()
        for body in range(self._n):
            self._enter_walls(body, (0, 1))
            for other in range(body + 1, self._n):
                self._enter_pair(body, other)

    def step(self) -> None:
        """Runs the next event.

        Raises Undecided where it is not certain which that is, or what it does.
        """
        event = self._queue.next()
        coming = None if event is None else self._queue.get(event)
        if event is None or coming is None or event == self._queue.end:
            self.ended = "quiet" if event is None else "until"
            return
        if coming.moment is not self._now:
            self._advance_to(coming.moment)
        self._queue.put(event, None)
        if not coming.late:
            self._touched.add(event)
        wall = self._queue.wall_of(event)
        if event == TURN:
            self._turn()
        elif wall is not None:
            self._bounce(*wall, coming)
        else:
            a, b = self._queue.bodies_of(event)
            self._collide(a, b, coming)

    # When bodies meet

    def _advance_to(self, now: EventTime) -> None:
        """Makes a moment the present one; its ball's lower end is the exact time at which all plans are
        evaluated."""
        self._now = now
        self._reference = now.ball.lower()
        self._delay = now.ball - self._reference
        self._where: dict[int, tuple[arb, arb]] = {}
        self._touched: set[int] = set()
        self.crowd = 0

    def _at(self, body: int) -> tuple[arb, arb]:
        """Returns where a body's plan is at the reference."""
        found = self._where.get(body)
        if found is None:
            found = self._where[body] = self._plans[body].at(self._reference)
        return found

    def _apart(self, a: int, b: int) -> tuple[tuple[arb, arb], tuple[arb, arb]]:
        """Returns the separation of two bodies at the reference, and their relative velocity."""
        (ax, ay), (bx, by) = self._at(a), self._at(b)
        (avx, avy), (bvx, bvy) = self._plans[a].velocity, self._plans[b].velocity
        return (bx - ax, by - ay), (bvx - avx, bvy - avy)

    def _touches(self, event: int) -> bool:
        """Returns whether bodies touch now for certain: they rested there, met now, or were about to."""
        coming = self._queue.get(event)
        due = coming is not None and coming.moment is self._now
        return event in self._touched or (coming is not None and due and not (coming.doubt or coming.late))

    def _enter_pairs(self, body: int, partner: int = -1) -> None:
        """Enters when a body with a new plan meets each other body; not a partner that it has just left."""
        for other in range(self._n):
            if other not in (body, partner):
                self._enter_pair(min(body, other), max(body, other))

    def _enter_pair(self, a: int, b: int) -> None:
        """Enters when two bodies meet."""
        if self._discs:
            event = self._queue.pair(a, b)
            self._queue.put(event, self._pair(a, b, event))

    def _pair(self, a: int, b: int, event: int) -> PossibleEvent | None:
        """Returns the next contact of two bodies, one of which has a new plan."""
        one, two = self._plans[a], self._plans[b]
        (dx, dy), (vx, vy) = self._apart(a, b)
        # A comparison of balls is true only if it is so for every choice of numbers from them. So each return
        # below is certain, and what none of them takes is left to rational numbers.
        approach = dx * vx + dy * vy
        if approach >= 0:
            return None
        reach = self._radius[a] + self._radius[b]
        speed2 = vx * vx + vy * vy
        cross = dx * vy - dy * vx
        root2 = reach * reach * speed2 - cross * cross
        if root2 < 0:
            return None
        gap = dx * dx + dy * dy - reach * reach
        touches = self._touches(event)
        if touches or gap <= 0:
            # The reference is a little before the moment: d.v has grown by |v|^2 times the delay since.
            if approach + speed2 * self._delay < 0:
                root = root2.sqrt() if touches and root2 > 0 else None
                return PossibleEvent(self._now, root, late=not touches)
        elif gap > 0 and root2 > 0 and approach < 0:
            root = root2.sqrt()
            ball = self._reference + gap / (root - approach)
            if ball > self._now.ball:
                form = None  # computed only if there is a tie to settle
                if one.line is not None and two.line is not None:
                    form = partial(first_root, one.line, two.line, self._exact_reach(a, b))
                return PossibleEvent(EventTime(ball, form), root)
        apart = math.hypot(float(dx.abs_lower()), float(dy.abs_lower())) * SURE - float(reach.upper())
        return self._decide_exactly(a, b, apart, math.hypot(float(vx.abs_upper()), float(vy.abs_upper())))

    def _decide_exactly(self, a: int, b: int, far: float, fast: float) -> PossibleEvent | None:
        """Decides in rational numbers whether two bodies meet; or leaves it open while that is safe."""
        one, two, now = self._plans[a].line, self._plans[b].line, self._now.rational
        if one is not None and two is not None and now is not None:
            root = first_contact(one, two, self._exact_reach(a, b), now)
            if root is None:
                return None
            if root == (now, ZERO):
                return PossibleEvent(self._now, late=True)
            ball = arb(root.p) - arb(root.q).sqrt()
            if ball > self._now.ball:
                vx, vy = (w - v for v, w in zip(one.velocity, two.velocity, strict=True))
                return PossibleEvent(EventTime(ball, root=root), arb(root.q).sqrt() * arb(vx * vx + vy * vy))
        return self._open(f"graze or contact at a standstill of discs {a} and {b}", far, fast)

    def _open(self, doubt: str, far: float, fast: float) -> PossibleEvent:
        """Returns an event that may come, of bodies that far apart that come nearer no faster than that."""
        moment = EventTime(self._now.ball)
        moment.low = self._now.low
        if far > 0.0:
            moment.low = min(self._now.low + far * SURE / max(fast, LEAST) * SURE, 1e300)
        return PossibleEvent(moment, doubt=doubt)

    def _exact_reach(self, a: int, b: int) -> fmpq:
        return self._exact_radius[a] + self._exact_radius[b]

    def _enter_walls(self, body: int, axes: tuple[int, ...]) -> None:
        """Enters when a body whose velocity changed along these axes meets their walls."""
        if self._sides is not None:
            for wall in (wall for axis in axes for wall in (2 * axis, 2 * axis + 1)):
                event = self._queue.wall(body, wall)
                self._queue.put(event, self._wall(body, wall, event))

    def _wall(self, body: int, wall: int, event: int) -> PossibleEvent | None:
        """Returns the next contact of a body with a wall."""
        plan, axis, place = self._plans[body], wall // 2, self._place(body, wall)
        velocity, line, now = plan.velocity[axis], plan.line, self._now.rational
        outward = velocity if wall % 2 else -velocity
        if outward <= 0:
            return None
        if outward > 0:
            if self._touches(event):
                return PossibleEvent(self._now)
            moment = EventTime(plan.anchor + (arb(place) - plan.place[axis]) / velocity)
            if line is not None:
                moment = EventTime.at((place - line.place[axis]) / line.velocity[axis])
            if moment.ball > self._now.ball:
                return PossibleEvent(moment)
            if moment.ball <= self._now.ball:
                return PossibleEvent(self._now, late=moment.ball < self._now.ball)
            if moment.rational is not None and now is not None and moment.rational <= now:
                return PossibleEvent(self._now, late=moment.rational < now)
        far = float((self._at(body)[axis] - arb(place)).abs_lower())
        return self._open(f"whether {self._queue.name_of(event)} meet", far, float(velocity.abs_upper()))

    def _place(self, body: int, wall: int) -> fmpq:
        """Returns where a body's centre is, on the wall's axis, when it touches the wall."""
        assert self._sides is not None
        radius = self._exact_radius[body]
        return self._sides[wall // 2] - radius if wall % 2 else radius

    # What happens

    def _record(self, a: int, b: int, part: arb, velocity: tuple[arb, arb]) -> None:
        """Records a contact; ``part`` is that of the velocity that is head-on."""
        ball = self._now.ball
        if not ball.is_exact() and ball.rel_accuracy_bits() < NARROW:
            what = f"the time of contact {len(self.met)}, to {NARROW} bits"
            raise Undecided(what, float(ball), (a, b) if b >= 0 else (a,))
        share = abs(float(part)) / math.hypot(*map(float, velocity))
        self.met.append(BallContact(ball, a, b, self.crowd > 0, share))
        self.crowd += 1

    def _enter_turn(self) -> None:
        """Enters the next turn of the scene."""
        if self._turns:
            self._queue.turning = self._turns[-1].body
            self._queue.put(TURN, PossibleEvent(EventTime.at(exact(self._turns[-1].time) - self._start)))

    def _turn(self) -> None:
        """Gives a body the velocity of its turn."""
        turn = self._turns.pop()
        now = exact(turn.time) - self._start
        line = self._plans[turn.body].line
        if line is not None:
            line = line.turned((exact(turn.velocity[0]), exact(turn.velocity[1])), now)
        self._fly(turn.body, (arb(turn.velocity[0]), arb(turn.velocity[1])), line)
        self._enter_turn()
        self._enter_walls(turn.body, (0, 1))
        self._enter_pairs(turn.body)

    def _bounce(self, body: int, wall: int, coming: PossibleEvent) -> None:
        """Mirrors a body's plan at a wall; one that is in the wall already turns back where it is."""
        old, axis = self._plans[body], wall // 2
        self._record(body, -1 - wall, old.velocity[axis], old.velocity)
        new = old.turned_back(axis, self._now) if coming.late else old.mirrored(axis, self._place(body, wall))
        self._change(body, new)
        self._enter_walls(body, (axis,))
        self._enter_pairs(body)

    def _collide(self, a: int, b: int, coming: PossibleEvent) -> None:
        """Exchanges momentum along the line of centres.

        Where the discs touch, the square of their distance is that of the sum of their radii, and d.v is
        -root. Where they overlapped before they approached, both are as they are.
        """
        one, two = self._plans[a], self._plans[b]
        (dx, dy), (vx, vy) = self._apart(a, b)
        dx, dy = dx + vx * self._delay, dy + vy * self._delay
        reach = self._radius[a] + self._radius[b]
        distance2 = dx * dx + dy * dy if coming.late else reach * reach
        closing = -coming.root if coming.root is not None else dx * vx + dy * vy
        self._record(a, b, closing / distance2.sqrt(), (vx, vy))
        both = self._mass[a] + self._mass[b]
        share = closing / distance2
        to_one, to_two = share * arb(2 * self._mass[b] / both), -share * arb(2 * self._mass[a] / both)
        lines: tuple[Line | None, Line | None] = (None, None)
        if one.line is not None and two.line is not None:
            now = self._now.rational
            if now is not None:
                lines = exchange(one.line, two.line, (self._mass[a], self._mass[b]), now)
        for body, old, gain, line in ((a, one, to_one, lines[0]), (b, two, to_two, lines[1])):
            self._fly(body, (old.velocity[0] + gain * dx, old.velocity[1] + gain * dy), line)
        for body, partner in ((a, b), (b, a)):
            self._enter_walls(body, (0, 1))
            self._enter_pairs(body, partner)

    def _fly(self, body: int, velocity: tuple[arb, arb], line: Line | None) -> None:
        """Gives a body another velocity now: on a line, or on a plan that is anchored at the reference."""
        if line is not None:
            self._change(body, BallPlan.along(line))
            return
        (x, y), (vx, vy) = self._at(body), self._plans[body].velocity
        place = x + (vx - velocity[0]) * self._delay, y + (vy - velocity[1]) * self._delay
        self._change(body, BallPlan(place, velocity, self._reference, line))

    def _change(self, body: int, plan: BallPlan) -> None:
        """Gives a body a new plan, and note what it rested against until now: it touches that."""
        line = self._plans[body].line
        if line is not None:
            for wall in range(4 if self._sides is not None else 0):
                axis = wall // 2
                if line.velocity[axis] == 0 and line.place[axis] == self._place(body, wall):
                    self._touched.add(self._queue.wall(body, wall))
            for other, its in enumerate(self._plans):
                if its.line is not None and body != other and line.velocity == its.line.velocity:
                    dx, dy = (p - q for p, q in zip(line.place, its.line.place, strict=True))
                    if dx * dx + dy * dy == self._exact_reach(body, other) ** 2:
                        self._touched.add(self._queue.pair(min(body, other), max(body, other)))
        self._plans[body] = plan
        self._where.pop(body, None)
