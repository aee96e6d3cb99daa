"""An attempt of the oracle: an event-driven simulation in rational numbers and balls, at one precision.

A ball is an interval that certainly holds the true number. Each comparison that decides an event or its order
must have the same result for every choice of numbers from the balls. Otherwise ``Undecided`` is raised, and
the oracle tries again with more bits. A doubt about an event is left open until that event can be the next
one. Two things keep the balls small. A plan is anchored at an exact number, the lower end of the ball of the
time when it was made, so the doubt about a time enters only through the change of velocity; and a wall
mirrors a plan without a new anchor.

Events of one moment are in the order of docs/one-answer.md. Nothing here is from the kernel. All times
count from the scene's start. Needs python-flint; the precision is the caller's (``flint.ctx``).
"""

import math
from collections.abc import Iterator
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np
from flint import arb, fmpq

from kinetile import Scene
from kinetile_accuracy.oracle import times
from kinetile_accuracy.oracle.times import ZERO, EventTime, Number, OraclePlan, Pair, exact

NARROW = 80
"""The required precision of a contact's time in bits, relative to the time since the start."""

LONGEST = 4096
"""The most bits of a numerator or denominator that is kept."""

LEAST = 2.0**-1000
SURE = 1.0 - 2.0**-40
"""A factor that makes bounds in doubles less than the exact values."""

CROWDED = 1e-9
"""Bodies are jammed if from contact to contact the fastest flies less than this part of the smallest radius,
divided by the number of bodies, for very many contacts."""

SIDES = ("left", "right", "bottom", "top")

TURN, WALL, PAIR, END = range(4)

Key = tuple[int, int, int]
"""An event by its kind and its subjects, a body and a wall (0 left, 1 right, 2 bottom, 3 top) or two bodies.
Sorted keys put events of one moment in their order."""


class Undecided(Exception):
    """A comparison that is not certain: its subject, its approximate time, and the bodies concerned."""

    def __init__(self, what: str, time: float, bodies: tuple[int, ...]) -> None:
        super().__init__(what, time, bodies)
        self.what, self.time, self.bodies = what, time, bodies


class PossibleEvent(NamedTuple):
    """A possible event: ``root`` is the ball of -d.v of two discs when they touch, ``doubt`` names the open
    question of an event that may come, not before ``moment.low``, ``late`` is True if the bodies overlap."""

    moment: EventTime
    root: arb | None = None
    doubt: str | None = None
    late: bool = False


class BallContact(NamedTuple):
    """A contact: the ball of the time since the start, the body and the other or -1 - wall, True if it is at
    the time of the contact before it, and the head-on part of the relative velocity."""

    ball: arb
    a: int
    b: int
    tied: bool
    head_on: float


class Attempt:
    """A run of a scene at the present precision, up to a time or to its last contact."""

    def __init__(self, scene: Scene, end: fmpq | None) -> None:
        self.ended: Literal["until", "quiet", "jammed"] | None = None
        self._radius = [exact(radius) for radius in scene.radius.tolist()]
        self._mass = [exact(mass) for mass in scene.mass.tolist()]
        self._sides = None if scene.arena is None else tuple(map(exact, scene.arena))
        start = exact(scene.start)
        self._turns = [(exact(each.time) - start, each) for each in scene.turns[::-1]]
        self._plans = [
            OraclePlan((exact(x), exact(y)), (exact(vx), exact(vy)), ZERO)
            for x, y, vx, vy in np.column_stack([scene.position, scene.velocity]).tolist()
        ]
        self._events: dict[Key, PossibleEvent] = {}
        self._touched: set[Key] = set()
        self._count, self._window = 0, arb(0)
        self._advance_to(EventTime(ZERO))
        if end is not None:
            self._events[END, 0, 0] = PossibleEvent(EventTime(end))
        self._enter_turn()
        for body in range(len(scene)):
            self._enter_walls(body)
        for pair in combinations(range(len(scene)), 2):
            self._enter((PAIR, *pair))

    def contacts(self) -> Iterator[BallContact]:
        """Yields the contacts, all certain; raises Undecided if the next one is not certain."""
        while (key := self._next()) is not None and key[0] != END and self.ended is None:
            coming = self._events[key]
            if coming.moment is not self._now:
                self._advance_to(coming.moment)
            if self._touches(key):
                self._touched.add(key)
            del self._events[key]
            kind, a, b = key
            if kind == TURN:
                _, turn = self._turns.pop()
                self._enter_turn()
                self._fly(turn.body, (exact(turn.velocity[0]), exact(turn.velocity[1])))
                self._enter_all(turn.body)
            else:
                yield self._bounce(a, b, coming) if kind == WALL else self._collide(a, b, coming)
                self._look_for_a_jam()
        self.ended = self.ended or ("quiet" if key is None else "until")

    # The next event

    def _next(self) -> Key | None:
        """Returns the next event, or None. Raises Undecided if it is not certain."""
        # Every other event certainly comes after one of these. An event in doubt has no upper bound: it is
        # among them from its first possible moment on.
        events = self._events
        bound = min([each.moment.high for each in events.values() if not each.doubt], default=math.inf)
        near = sorted(key for key, each in events.items() if each.moment.low <= bound)
        for key in near:
            doubt = events[key].doubt
            if doubt is not None:
                raise self._undecided(doubt, key)
        first = near[0] if near else None
        for key in near[1:]:
            assert first is not None
            order = events[key].moment.compare(events[first].moment)
            if order is None:
                raise self._undecided(f"tie of {_name(first)} and {_name(key)}", first, key)
            if order < 0:
                first = key
            elif order == 0:  # one moment for both: from now on they compare without arithmetic
                events[key] = events[key]._replace(moment=events[first].moment)
        return first

    def _undecided(self, what: str, *keys: Key) -> Undecided:
        bodies = {a for kind, a, _ in keys if kind != END} | {b for kind, _, b in keys if kind == PAIR}
        return Undecided(what, max(self._events[keys[0]].moment.low, 0.0), tuple(sorted(bodies)))

    def _advance_to(self, now: EventTime) -> None:
        """Makes a moment the present one; all plans are evaluated at its lower end."""
        self._now = now
        self._reference: fmpq = now.number if isinstance(now.number, fmpq) else times.lower_end(now.ball)
        self._delay = now.number - self._reference
        self._where: dict[int, Pair] = {}
        self._touched.clear()
        self._crowd = 0

    # Contact times

    def _at(self, body: int) -> Pair:
        if body not in self._where:
            self._where[body] = self._plans[body].at(self._reference)
        return self._where[body]

    def _apart(self, a: int, b: int) -> tuple[Number, Number, Number, Number]:
        (ax, ay), (bx, by) = self._at(a), self._at(b)
        (avx, avy), (bvx, bvy) = self._plans[a].velocity, self._plans[b].velocity
        return bx - ax, by - ay, bvx - avx, bvy - avy

    def _touches(self, key: Key) -> bool:
        """Returns True if bodies certainly touch now: they rested there, have met, or are to meet now."""
        coming = self._events.get(key)
        due = coming is not None and coming.moment is self._now and not (coming.doubt or coming.late)
        return due or key in self._touched

    def _enter(self, key: Key) -> None:
        coming = self._wall(key) if key[0] == WALL else self._pair(key)
        if coming is None:
            self._events.pop(key, None)
        else:
            self._events[key] = coming

    def _enter_walls(self, body: int) -> None:
        for wall in range(4) if self._sides else ():
            self._enter((WALL, body, wall))

    def _enter_all(self, body: int, partner: int = -1) -> None:
        """Enters the contacts of a body with a new plan, except with a partner that it has just left."""
        self._enter_walls(body)
        for other in range(len(self._plans)):
            if other not in (body, partner):
                self._enter((PAIR, min(body, other), max(body, other)))

    def _pair(self, key: Key) -> PossibleEvent | None:
        _, a, b = key
        dx, dy, vx, vy = self._apart(a, b)
        # A comparison of balls is true only if it is true for all numbers in them. So each return below is
        # certain, and all other cases are left open. A contact needs approach; a tangency is not a contact.
        approach = dx * vx + dy * vy
        if approach >= 0:
            return None
        reach = self._radius[a] + self._radius[b]
        speed2 = vx * vx + vy * vy
        cross = dx * vy - dy * vx
        root2 = reach * reach * speed2 - cross * cross
        if root2 <= 0:
            return None
        gap = dx * dx + dy * dy - reach * reach
        touches = self._touches(key)
        if touches or gap <= 0:
            # The reference is a little before the moment: d.v has grown by |v|^2 times the delay since.
            closing = approach + speed2 * self._delay
            if closing < 0:
                # In many contacts at one moment each is slower, and the root alone would lose all its bits.
                root = None
                if touches and root2 > 0 and isinstance(closing, arb):
                    root = arb(root2).sqrt().intersection(-closing)
                return PossibleEvent(self._now, root, late=not touches)
        elif gap > 0 and root2 > 0 and approach < 0:
            root = arb(root2).sqrt()
            moment = EventTime(self._reference + gap / (root - approach))
            if isinstance(root2, fmpq) and isinstance(approach, fmpq) and isinstance(speed2, fmpq):
                p_q = times.Root(self._reference - approach / speed2, root2 / (speed2 * speed2))
                moment = EventTime(moment.number if p_q.rational is None else p_q.rational, p_q)
            if moment.ball > self._now.ball:
                return PossibleEvent(moment, root if isinstance(moment.number, arb) else None)
        far = math.hypot(_least(dx), _least(dy)) * SURE - float(arb(reach).upper())
        doubt = f"graze or contact at a standstill of discs {a} and {b}"
        return self._open(doubt, far, math.hypot(_most(vx), _most(vy)))

    def _wall(self, key: Key) -> PossibleEvent | None:
        _, body, wall = key
        plan, axis, place = self._plans[body], wall // 2, self._place(body, wall)
        velocity = plan.velocity[axis]
        outward = velocity if wall % 2 else -velocity
        if outward <= 0:
            return None
        if outward > 0:
            if self._touches(key):
                return PossibleEvent(self._now)
            moment = EventTime(plan.anchor + (place - plan.place[axis]) / velocity)
            if moment.number > self._now.number:
                return PossibleEvent(moment)
            if moment.number <= self._now.number:
                return PossibleEvent(self._now, late=bool(moment.number < self._now.number))
        far = _least(self._at(body)[axis] - place)
        return self._open(f"whether {_name(key)} meet", far, _most(velocity))

    def _open(self, doubt: str, far: float, fast: float) -> PossibleEvent:
        """Returns an event in doubt, of bodies at distance ``far`` that approach no faster than ``fast``."""
        moment = EventTime(self._now.ball)
        moment.low = self._now.low
        if far > 0.0:
            moment.low = min(self._now.low + far * SURE / max(fast, LEAST) * SURE, 1e300)
        return PossibleEvent(moment, doubt=doubt)

    def _place(self, body: int, wall: int) -> fmpq:
        """Returns the coordinate of a body's centre on the wall's axis when it touches the wall."""
        assert self._sides is not None
        radius = self._radius[body]
        return self._sides[wall // 2] - radius if wall % 2 else radius

    # Events

    def _contact(self, a: int, b: int, part: Number, velocity: Pair) -> BallContact:
        """Returns a contact now; ``part`` is the head-on part of the velocity."""
        ball = self._now.ball
        if isinstance(self._now.number, arb) and ball.rel_accuracy_bits() < NARROW:
            what = f"the time of contact {self._count}, to {NARROW} bits"
            raise Undecided(what, float(ball), (a, b) if b >= 0 else (a,))
        speed = arb(velocity[0] * velocity[0] + velocity[1] * velocity[1]).sqrt()
        tied, self._crowd = self._crowd > 0, self._crowd + 1
        return BallContact(ball, a, b, tied, float(abs(arb(part)) / speed))

    def _look_for_a_jam(self) -> None:
        """Ends the run if very many contacts took hardly any time."""
        many = 200 * len(self._plans) + 2000
        self._count += 1
        if self._count % many == 0:
            fastest = max(math.hypot(*map(_most, plan.velocity)) for plan in self._plans)
            flight = float(self._now.ball - self._window) * fastest
            if flight <= many * CROWDED * float(arb(min(self._radius))) / len(self._plans):
                self.ended = "jammed"
            self._window = self._now.ball

    def _enter_turn(self) -> None:
        if self._turns:
            time, turn = self._turns[-1]
            now = self._now if time == self._now.number else EventTime(time)
            self._events[TURN, turn.body, 0] = PossibleEvent(now)

    def _bounce(self, body: int, wall: int, coming: PossibleEvent) -> BallContact:
        """Mirrors a body's plan at a wall; a body inside the wall turns back at its place."""
        old, axis = self._plans[body], wall // 2
        met = self._contact(body, -1 - wall, old.velocity[axis], old.velocity)
        if coming.late:
            self._fly(body, times.with_axis(old.velocity, axis, -old.velocity[axis]))
        else:
            self._change(body, old.mirrored(axis, self._place(body, wall)))
        self._enter_all(body)
        return met

    def _collide(self, a: int, b: int, coming: PossibleEvent) -> BallContact:
        """Exchanges momentum along the line of centres. If the discs touch, their distance is the sum of
        their radii, and d.v is -root; if they overlapped before, both have their present values."""
        dx, dy, vx, vy = self._apart(a, b)
        dx, dy = dx + vx * self._delay, dy + vy * self._delay
        reach = self._radius[a] + self._radius[b]
        distance2 = dx * dx + dy * dy if coming.late else reach * reach
        closing = -coming.root if coming.root is not None else dx * vx + dy * vy
        met = self._contact(a, b, arb(closing) / arb(distance2).sqrt(), (vx, vy))
        kick = 2 * closing / distance2 / (self._mass[a] + self._mass[b])
        for body, its in (a, kick * self._mass[b]), (b, -kick * self._mass[a]):
            x, y = self._plans[body].velocity
            self._fly(body, (x + its * dx, y + its * dy))
        self._enter_all(a, b)
        self._enter_all(b, a)
        return met

    def _fly(self, body: int, velocity: Pair) -> None:
        (x, y), (vx, vy) = self._at(body), self._plans[body].velocity
        place = x + (vx - velocity[0]) * self._delay, y + (vy - velocity[1]) * self._delay
        self._change(body, OraclePlan(_short(place), _short(velocity), self._reference))

    def _change(self, body: int, plan: OraclePlan) -> None:
        """Gives a body a new plan, and notes the walls and bodies that it touched at rest until now."""
        for wall in range(4) if self._sides else ():
            axis = wall // 2
            if self._plans[body].velocity[axis] == 0 and self._at(body)[axis] == self._place(body, wall):
                self._touched.add((WALL, body, wall))
        for other in range(len(self._plans)):
            a, b = min(body, other), max(body, other)
            dx, dy, vx, vy = self._apart(a, b)
            reach = self._radius[a] + self._radius[b]
            if a != b and vx == 0 and vy == 0 and dx * dx + dy * dy == reach * reach:
                self._touched.add((PAIR, a, b))
        self._plans[body] = plan
        self._where.pop(body, None)


def _name(key: Key) -> str:
    kind, a, b = key
    wall = SIDES[b] if kind == WALL else ""
    names = {TURN: f"the turn of disc {a}", WALL: f"disc {a} and the {wall} wall", PAIR: f"discs {a} and {b}"}
    return names.get(kind, "the end")


def _short(pair: Pair) -> Pair:
    """Returns two numbers; a rational one that is too long to keep becomes a ball."""
    x, y = (arb(each) if isinstance(each, fmpq) and each.height_bits() > LONGEST else each for each in pair)
    return x, y


def _least(number: Number) -> float:
    return float(arb(number).abs_lower())


def _most(number: Number) -> float:
    return float(arb(number).abs_upper())
