"""An attempt of the oracle: an event-driven simulation in ball arithmetic at one precision.

Every number is a ball, an interval that certainly holds the true number. Events are found one after another
by computing all pairs and all walls; each comparison that decides an event or its order must have the same
result for every choice of numbers from the balls. If it has not, the discs concerned may still fly
on rational lines, which decide (``flights``); else ``Undecided`` is raised, and the oracle tries again with
more bits. A doubt about an event that cannot be the next one is left open until it can.

Two things keep the balls small. A plan is anchored at an exact number, the lower end of the ball of the time
at which it was made, so that the doubt about a time enters only through the change of velocity; and a wall
mirrors a plan without anchoring it anew.

Two bodies that pass through each other keep their plans; until they part, their images that pass are no
contacts. Bodies that touch at relative rest, such as two that a contact has stopped, still touch at the next
moment: no arithmetic could tell.

Where axes are periodic two bodies meet through images: the second of them, whole periods from where it is.
Places are never wrapped, so an image has one number for good. The contacts of two bodies are known up to a
time, before which they fly about half a period towards each other: few images are reached so soon. At that
time the next ones are computed, unless one of the two has a new plan by then.

Nothing here comes from the kernel. All times count from the scene's start. Needs python-flint; the precision
is the caller's (``flint.ctx``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import partial
from itertools import combinations, product
from typing import Literal, NamedTuple

import numpy as np
from flint import arb, fmpq

from kinetile.scene import Insert, Remove, Response, Scene
from kinetile_accuracy.oracle.event_queue import (
    COMMAND,
    END_BEFORE,
    ORIGIN,
    EventQueue,
    Image,
    PossibleEvent,
    Undecided,
)
from kinetile_accuracy.oracle.flights import (
    ZERO,
    BallPlan,
    EventTime,
    Line,
    exact,
    exchange,
    first_contact,
    first_root,
    last_root,
    quadratic,
    same,
    with_axis,
)
from kinetile_accuracy.oracle.rules import DEEP, Rules

NARROW = 80
"""Bits to which the time of a contact must be known, relative to the time since the start."""

RESTING = BallPlan.along(Line((ZERO, ZERO), (ZERO, ZERO)))
AT_REST = RESTING.velocity

LEAST = 2.0**-1000
SURE = 1.0 - 2.0**-40
"""A factor by which bounds in doubles are less than what they are computed from."""

FLIGHT = 0.4877
"""Periods that two bodies fly towards each other before their next images are computed. No simple fraction:
on a lattice contacts would tie with that."""


CROWDED = 1e-9
"""Bodies are jammed if from contact to contact the fastest flies less than this part of the smallest radius,
divided by the number of bodies, for very many contacts; or for some, if each stops one body: against a wall
that stops it, a push by a heavier one has no end."""


class BallContact(NamedTuple):
    """A contact, or the end of a passing (a > b): ball of the time since the start, the bodies, whether the
    one before was at the same time, which part of the relative velocity is along the line of centres, or
    across the wall, the relative speed, and the image."""

    ball: arb
    a: int
    b: int
    tied: bool
    head_on: float
    speed: float
    image: Image


class Attempt:
    """A run of a scene at the present precision.

    Args:
        scene: the scene.
        rules: the same scene's.
        end: when the end is, and whether before the contacts of its time; None: never.
        discs, walls: which contacts there are.

    Attributes:
        met: the contacts, all certain.
        ended: why the run is over, when it is.
        idle: how often images were computed since the last contact.
    """

    def __init__(
        self, scene: Scene, rules: Rules, end: tuple[fmpq, bool] | None, discs: bool, walls: bool
    ) -> None:
        self.met: list[BallContact] = []
        self.ended: Literal["until", "quiet", "jammed", "crowded"] | None = None
        self.idle = 0
        self._rules = rules
        self._discs = discs
        self._exact_radius = rules.radius
        self._radius = [arb(r) for r in rules.radius]
        self._sides = None if scene.arena is None or not walls else tuple(map(exact, scene.arena))
        self._periods, self._periodic = scene.periods, any(scene.periods)
        self._walled = tuple(axis for axis in (0, 1) if self._sides is not None and not self._periods[axis])
        self._commands = rules.commands[::-1]
        self._plans: dict[int, BallPlan] = {}
        self._passing: dict[tuple[int, int], list[Image]] = {}
        self._last: dict[int, EventTime] = {}  # when a body last had a contact that was not a passing
        self._touched: set[tuple[int, Image]] = set()
        self._queue = EventQueue(rules.count, rules.passing)
        self._advance_to(EventTime.at(ZERO))
        self._windows: dict[int, tuple[int, arb]] = {}
        if end is not None:
            event = END_BEFORE if end[1] else self._queue.end
            self._queue.put(event, PossibleEvent(EventTime.at(end[0])))
        self._enter_command()
        for body, (x, y, vx, vy) in enumerate(np.column_stack([scene.position, scene.velocity]).tolist()):
            self._plans[body] = BallPlan.along(Line((exact(x), exact(y)), (exact(vx), exact(vy))))
        for a, b in combinations(self._plans, 2):
            self._begin_overlapping(a, b)
        for body in self._plans:
            self._enter_walls(body, (0, 1))
        for a, b in combinations(self._plans, 2):
            self._enter_pair(a, b)

    def step(self) -> None:
        """Runs the next event.

        Raises Undecided where it is not certain which that is, or what it does.
        """
        found = self._queue.next()
        if found is None or found[0] in (END_BEFORE, self._queue.end):
            self.ended = "quiet" if found is None else "until"
            return
        event, coming = found
        if coming.moment is not self._now:
            self._advance_to(coming.moment)
        if event == COMMAND:
            self._queue.put(event)
            self._carry_out_command()
            return
        wall = self._queue.wall_of(event)
        a, b = wall or self._queue.bodies_of(event)
        meeting = event if wall is not None else self._queue.pair(a, b)
        due = (each.image for each in self._queue.get(event) if self._is_due(each))
        self._touched.update((meeting, image) for image in due if image is not None)
        self._queue.put(event)
        if wall is not None:
            self._bounce(a, b, coming)
        elif coming.image is None:
            self.idle += 1
            self._enter_pair(a, b)
        elif self._queue.is_parting(event):
            self._pass(a, b, coming.image, coming.root, ends=True)
        elif self._rules.passes(a, b):
            self._pass(a, b, coming.image, coming.root)
        else:
            self._collide(a, b, coming, coming.image)

    # When bodies meet

    def _advance_to(self, now: EventTime) -> None:
        """Makes a moment the present one; its ball's lower end is the exact time at which all plans are
        evaluated."""
        self._now = now
        self._reference = now.ball.lower()
        self._delay = now.ball - self._reference
        self._where: dict[int, tuple[arb, arb]] = {}
        self._touched = {meeting for meeting in self._touched if self._rests(meeting[0])}
        self._crowd = 0

    def _rests(self, event: int) -> bool:
        """Returns whether bodies that touch certainly still touch later, by their present plans."""
        plans = [self._plans.get(body, RESTING) for body in self._queue.bodies_of(event)]
        wall = self._queue.wall_of(event)
        return plans[0].beside(plans[1]) if wall is None else plans[0].velocity[wall[1] // 2] == 0

    def _at(self, body: int) -> tuple[arb, arb]:
        """Returns where a body's plan is at the reference."""
        found = self._where.get(body)
        if found is None:
            found = self._where[body] = self._plans[body].at(self._reference)
        return found

    def _apart(self, a: int, b: int, image: Image = ORIGIN) -> tuple[tuple[arb, arb], tuple[arb, arb]]:
        """Returns the separation of two bodies at the reference, and their relative velocity."""
        (ax, ay), (bx, by) = self._at(a), self._at(b)
        one, two = self._plans[a], self._plans[b]
        dx, dy = bx - ax, by - ay
        if image != ORIGIN:
            dx, dy = (d + arb(far) for d, far in zip((dx, dy), self._shift(image), strict=True))
        if one.beside(two):
            return (dx, dy), AT_REST
        (avx, avy), (bvx, bvy) = one.velocity, two.velocity
        return (dx, dy), (bvx - avx, bvy - avy)

    def _shift(self, image: Image) -> tuple[fmpq, fmpq]:
        """Returns how far an image is from its body."""
        x, y = (number * exact(period) for number, period in zip(image, self._periods, strict=True))
        return x, y

    def _lines(self, a: int, b: int, image: Image) -> tuple[Line, Line] | None:
        """Returns the lines of a body and of an image of another; None where one of them flies on none."""
        one, two = self._plans[a].line, self._plans[b].line
        if one is None or two is None:
            return None
        return one, two if image == ORIGIN else two.moved(self._shift(image))

    def _is_due(self, coming: PossibleEvent) -> bool:
        """Returns whether bodies that are about to meet touch now for certain."""
        return coming.moment is self._now and not (coming.doubt or coming.late)

    def _touches(self, event: int, image: Image = ORIGIN) -> bool:
        """Returns whether bodies touch now for certain: they rest there, have met, or are to meet or part."""
        if (event, image) in self._touched:
            return True
        due = [*self._queue.get(event)]
        if self._passing and self._queue.wall_of(event) is None:
            due += self._queue.get(self._queue.parting(*self._queue.bodies_of(event)))
        return any(each.image == image and self._is_due(each) for each in due)

    def _enter_pairs(self, body: int, partner: int = -1) -> None:
        """Enters when a body with a new plan meets each other body; not a partner that it has just left."""
        for other in self._plans:
            if other not in (body, partner):
                self._enter_pair(min(body, other), max(body, other))

    def _enter_pair(self, a: int, b: int, left: Image | None = None) -> None:
        """Enters when two bodies meet; not through an image through which they have just met."""
        if self._discs:
            event = self._queue.pair(a, b)
            self._queue.put(event, *self._pair(a, b, event, left))
            if (a, b) in self._passing:
                ends = (self._parting(a, b, event, image) for image in self._passing[a, b])
                self._queue.put(self._queue.parting(a, b), *(end for end in ends if end is not None))

    def _pair(self, a: int, b: int, event: int, left: Image | None) -> Iterator[PossibleEvent]:
        """Yields contacts of two bodies up to a time, the next one among them, and that time."""
        span, known = arb(0), self._known_until(a, b) if self._periodic else None
        if known is not None:
            span = span.union(known.ball - self._reference)
        without = [left, *self._passing.get((a, b), ())]
        for image in self._images(a, b, span):
            coming = self._through(a, b, event, image) if image not in without else None
            if coming is not None:
                yield coming if image == ORIGIN else coming._replace(image=image)
        if known is not None:
            yield PossibleEvent(known, image=None)

    def _known_until(self, a: int, b: int) -> EventTime | None:
        """Returns up to which time contacts of two bodies are computed; None: whenever they come."""
        _, velocity = self._apart(a, b)
        flights = [
            FLIGHT * period / max(float(speed.abs_upper()), LEAST)
            for speed, period in zip(velocity, self._periods, strict=True)
            if period and speed != 0
        ]
        if not flights:
            return None
        end = float(self._reference) + min(*flights, 1e300)
        known = EventTime.at(exact(end))
        if not known.ball > self._now.ball:
            raise Undecided(f"the images that discs {a} and {b} reach next", end, (a, b))
        return known

    def _images(self, a: int, b: int, span: arb) -> Iterable[Image]:
        """Returns the images through which two bodies may touch within a span of time from the reference."""
        if not self._periodic:
            return (ORIGIN,)
        reach = arb(0, (self._radius[a] + self._radius[b]).upper())
        numbers = []
        for place, speed, period in zip(*self._apart(a, b), self._periods, strict=True):
            ends = (reach - place - speed * span) / period if period else arb(0)
            # A whole number that is no less than a bound is no less than the double nearest to that bound.
            numbers.append(range(math.ceil(float(ends.lower())), math.floor(float(ends.upper())) + 1))
        along_x, along_y = numbers
        return product(along_x, along_y)

    def _through(self, a: int, b: int, event: int, image: Image) -> PossibleEvent | None:
        """Returns the next contact of two bodies through an image; one of them has a new plan."""
        (dx, dy), (vx, vy) = self._apart(a, b, image)
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
        touches = self._touches(event, image)
        if touches or gap <= 0:
            # The reference is a little before the moment: d.v has grown by |v|^2 times the delay since.
            closing = approach + speed2 * self._delay
            if closing < 0:
                # Of many contacts at one moment each is slower, and the root alone would lose all its bits.
                root = root2.sqrt().intersection(-closing) if touches and root2 > 0 else None
                return PossibleEvent(self._now, root, late=not touches)
        elif gap > 0 and root2 > 0 and approach < 0:
            root = root2.sqrt()
            ball = self._reference + gap / (root - approach)
            if ball > self._now.ball:
                lines = self._lines(a, b, image)
                # computed only if there is a tie to settle
                form = None if lines is None else partial(first_root, *lines, self._exact_reach(a, b))
                return PossibleEvent(EventTime(ball, form), root)
        apart = math.hypot(float(dx.abs_lower()), float(dy.abs_lower())) * SURE - float(reach.upper())
        fast = math.hypot(float(vx.abs_upper()), float(vy.abs_upper()))
        return self._decide_exactly(a, b, image, apart, fast)

    def _decide_exactly(self, a: int, b: int, image: Image, far: float, fast: float) -> PossibleEvent | None:
        """Decides in rational numbers whether two bodies meet; or leaves it open while that is safe."""
        lines, now = self._lines(a, b, image), self._now.rational
        if lines is not None and now is not None:
            one, two = lines
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

    def _parting(self, a: int, b: int, event: int, image: Image) -> PossibleEvent | None:
        """Returns when two bodies that pass through each other part, through an image; None: never."""
        (dx, dy), velocity = self._apart(a, b, image)
        if velocity is AT_REST:
            return None
        vx, vy = velocity
        approach, speed2 = dx * vx + dy * vy, vx * vx + vy * vy
        reach, cross = self._radius[a] + self._radius[b], dx * vy - dy * vx
        root2 = reach * reach * speed2 - cross * cross
        root = root2.sqrt() if root2 > 0 else None
        if self._touches(event, image) and approach + speed2 * self._delay >= 0:
            return PossibleEvent(self._now, root, image=image)
        lines, now = self._lines(a, b, image), self._now.rational
        if root is not None and speed2 > 0:
            ball = self._reference + (root - approach) / speed2
            if ball > self._now.ball:
                form = None if lines is None else partial(last_root, *lines, self._exact_reach(a, b))
                return PossibleEvent(EventTime(ball, form), root, image=image)
        if lines is not None and now is not None:
            _, exact_approach, gap = quadratic(*lines, self._exact_reach(a, b), now)
            if gap >= 0 and exact_approach >= 0:
                return PossibleEvent(self._now, root, image=image)
        return self._open(f"when discs {a} and {b} part", 0.0, 0.0)._replace(image=image)

    def _overlapping(self, a: int, b: int) -> list[Image]:
        """Returns the images through which two bodies overlap now, by more than may be rounding."""
        found = []
        reach, now = self._exact_reach(a, b) * DEEP, self._now.rational
        for image in self._images(a, b, self._delay):
            (dx, dy), (vx, vy) = self._apart(a, b, image)
            dx, dy = dx + vx * self._delay, dy + vy * self._delay
            gap: arb | fmpq = dx * dx + dy * dy - arb(reach * reach)
            lines = self._lines(a, b, image)
            if lines is not None and now is not None:
                gap = quadratic(*lines, reach, now)[2]
            elif not (gap < 0 or gap >= 0):
                raise Undecided(f"whether discs {a} and {b} overlap", float(self._now.ball), (a, b))
            if gap < 0:
                found.append(image)
        return found

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
        for axis in self._walled:
            for wall in (2 * axis, 2 * axis + 1) if axis in axes else ():
                event = self._queue.wall(body, wall)
                coming = self._wall(body, wall, event)
                self._queue.put(event, *(() if coming is None else (coming,)))

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

    def _record(
        self, a: int, b: int, part: arb | None, velocity: tuple[arb, arb], image: Image = ORIGIN
    ) -> None:
        """Records a contact; ``part`` is that of the velocity that is head-on."""
        ball = self._now.ball
        if not ball.is_exact() and ball.rel_accuracy_bits() < NARROW:
            what = f"the time of contact {len(self.met)}, to {NARROW} bits"
            raise Undecided(what, float(ball), (a, b) if b >= 0 else (a,))
        vx, vy = velocity  # in doubles, those of a jam would be 0 before its end
        speed = (vx * vx + vy * vy).sqrt()
        share = 1.0 if part is None else float(abs(part) / speed)
        self.met.append(BallContact(ball, a, b, self._crowd > 0, share, float(speed), image))
        self._crowd += 1
        self.idle = 0
        self._look_for_jams(-1, 200 * self._rules.count + 2000)

    def _look_for_jams(self, body: int, many: int) -> None:
        """Counts a contact, of a body or of all, and ends the run where so many took hardly any time."""
        count, since = self._windows.get(body, (0, self._now.ball))
        self._windows[body] = count + 1, since
        if count + 1 >= many:
            del self._windows[body]
            fastest = max(math.hypot(*map(float, plan.velocity)) for plan in self._plans.values())
            smallest = min(float(self._radius[each]) for each in self._plans)
            if float(self._now.ball - since) * fastest <= many * CROWDED * smallest / len(self._plans):
                self.ended = "jammed"

    def _enter_command(self) -> None:
        """Enters the next command of the scene."""
        if self._commands:
            time, command = self._commands[-1]
            self._queue.commanded = command.body
            now = time == self._now.rational
            self._queue.put(COMMAND, PossibleEvent(self._now if now else EventTime.at(time)))

    def _carry_out_command(self) -> None:
        """Carries out the next command of the scene."""
        now, command = self._commands.pop()
        self._enter_command()
        body = command.body
        if isinstance(command, Remove):
            self._remove(body)
            return
        vx, vy = map(exact, command.velocity)
        if isinstance(command, Insert):
            x, y = map(exact, command.position)
            self._plans[body] = BallPlan.along(Line((x - vx * now, y - vy * now), (vx, vy)))
            others = sorted(self._plans.keys() - {body})
            solid = [other for other in others if not self._rules.passes(body, other)]
            if any(self._overlapping(body, other) for other in solid):
                self.ended = "crowded"
                return
            for other in others:
                self._begin_overlapping(min(body, other), max(body, other))
        else:
            line = self._plans[body].line
            self._fly(body, (arb(vx), arb(vy)), None if line is None else line.turned((vx, vy), now))
        self._enter_walls(body, (0, 1))
        self._enter_pairs(body)

    def _remove(self, body: int) -> None:
        """Removes a body, after its passings have ended."""
        for a, b in sorted(pair for pair in self._passing if body in pair):
            for image in self._passing.pop((a, b)):
                self._record(b, a, None, AT_REST, image)
            self._queue.put(self._queue.parting(a, b))
        del self._plans[body]
        for wall in range(4):
            self._queue.put(self._queue.wall(body, wall))
        for other in self._plans:
            self._queue.put(self._queue.pair(min(body, other), max(body, other)))

    def _begin_overlapping(self, a: int, b: int) -> None:
        """Begins the passings of two bodies that overlap where they are put."""
        if self._discs and self._rules.passes(a, b):
            for image in self._overlapping(a, b):
                self._pass(a, b, image)

    def _pass(self, a: int, b: int, image: Image, root: arb | None = None, ends: bool = False) -> None:
        """Begins or ends a passing: no plan changes."""
        one, two = (b, a) if ends else (a, b)
        part = None if root is None else root / (self._radius[a] + self._radius[b])
        self._record(one, two, part, self._apart(a, b)[1], image)
        images = self._passing.setdefault((a, b), [])
        (images.remove if ends else images.append)(image)
        self._enter_pair(a, b, image)

    def _given_back(self, bodies: tuple[int, ...], response: Response) -> fmpq:
        """Returns which share of the closing speed comes back: all of it soon after a contact of a body."""
        if response.name != "restitution":
            return fmpq(1)
        within, now = exact(response.options.get("contact_time") or 0.0), self._now
        lasts = [self._last[body] for body in bodies if body in self._last]
        rests = [now.ball - last.ball - arb(within) for last in lasts]
        if now in lasts or any(rest <= 0 for rest in rests):
            return fmpq(1)
        for last, rest in zip(lasts, rests, strict=True):
            if not rest > 0:
                if now.root and last.root and same(now.root._replace(p=now.root.p - within), last.root):
                    return fmpq(1)
                raise Undecided("whether a contact comes within contact_time", float(now.ball), bodies)
        return exact(response.options["e"])

    def _bounce(self, body: int, wall: int, coming: PossibleEvent) -> None:
        """Mirrors a body's plan at a wall, or makes it slower; one in the wall turns back where it is."""
        old, axis = self._plans[body], wall // 2
        response = self._rules.response(body, -1 - wall)
        back = self._given_back((body,), response)
        self._record(body, -1 - wall, old.velocity[axis], old.velocity)
        self._last[body] = self._now
        if response.name == "stop":
            self._stop(body)
        elif back != 1:
            line, now = old.line, self._now.rational
            if line is not None:
                slower = with_axis(line.velocity, axis, -back * line.velocity[axis])
                line = None if now is None else line.turned(slower, now)
            self._fly(body, with_axis(old.velocity, axis, -arb(back) * old.velocity[axis]), line)
        elif coming.late:
            self._change(body, old.turned_back(axis, self._now))
        else:
            self._change(body, old.mirrored(axis, self._place(body, wall)))
        self._enter_walls(body, (0, 1) if response.name == "stop" else (axis,))
        self._enter_pairs(body)

    def _stop(self, body: int, beside: int | None = None) -> None:
        """Stops a body; beside another one, it flies on with that one's velocity."""
        self._look_for_jams(body, 20 * self._rules.count + 100)
        leader = RESTING if beside is None else self._plans[beside]
        line, now = self._plans[body].line, self._now.rational
        if line is not None:
            line = None if leader.line is None or now is None else line.turned(leader.line.velocity, now)
        self._fly(body, leader.velocity, line)

    def _collide(self, a: int, b: int, coming: PossibleEvent, image: Image) -> None:
        """Exchanges momentum along the line of centres, of the second body's image, or stops both.

        Where the discs touch, the square of their distance is that of the sum of their radii, and d.v is
        -root. Where they overlapped before they approached, both are as they are.
        """
        one, two = self._plans[a], self._plans[b]
        (dx, dy), (vx, vy) = self._apart(a, b, image)
        dx, dy = dx + vx * self._delay, dy + vy * self._delay
        reach = self._radius[a] + self._radius[b]
        distance2 = dx * dx + dy * dy if coming.late else reach * reach
        closing = -coming.root if coming.root is not None else dx * vx + dy * vy
        response = self._rules.response(a, b)
        gains = self._rules.gains(a, b, self._given_back((a, b), response))
        self._record(a, b, closing / distance2.sqrt(), (vx, vy), image)
        self._last[a] = self._last[b] = self._now
        # An immovable body keeps its plan, and its line where it has one.
        still = self._rules.immovable_of(a, b)
        changed = [(body, partner) for body, partner in ((a, b), (b, a)) if body != still]
        if response.name == "stop":
            for body, _ in changed:
                self._stop(body, still)
        else:
            lines: tuple[Line | None, Line | None] = (None, None)
            now = self._now.rational
            if one.line is not None and two.line is not None and now is not None:
                lines = exchange(one.line, two.line, gains, now, self._shift(image))
            share = closing / distance2
            for body, old, part, line in (a, one, gains[0], lines[0]), (b, two, -gains[1], lines[1]):
                if body != still:
                    x, y = old.velocity
                    self._fly(body, (x + share * part * dx, y + share * part * dy), line)
        for body, partner in changed:
            self._enter_walls(body, (0, 1))
            self._enter_pairs(body, partner)
        self._enter_pair(a, b, image)

    def _fly(self, body: int, velocity: tuple[arb, arb], line: Line | None) -> None:
        """Gives a body another velocity now: on a line, or on a plan that is anchored at the reference."""
        if line is not None:
            self._change(body, BallPlan.along(line))
            return
        (x, y), (vx, vy) = self._at(body), self._plans[body].velocity
        place = x + (vx - velocity[0]) * self._delay, y + (vy - velocity[1]) * self._delay
        self._change(body, BallPlan(place, velocity, self._reference, line))

    def _change(self, body: int, plan: BallPlan) -> None:
        """Gives a body a new plan, and notes what it rested against until now: it touches that."""
        line = self._plans[body].line
        if line is not None:
            for axis in self._walled:
                for wall in (2 * axis, 2 * axis + 1):
                    if line.velocity[axis] == 0 and line.place[axis] == self._place(body, wall):
                        self._touched.add((self._queue.wall(body, wall), ORIGIN))
            for other, its in self._plans.items():
                if its.line is not None and body != other and line.velocity == its.line.velocity:
                    a, b = min(body, other), max(body, other)
                    for image in self._images(a, b, arb(0)):
                        shift = self._shift(image) if body == a else self._shift((-image[0], -image[1]))
                        dx, dy = (
                            p - q - s for p, q, s in zip(line.place, its.line.place, shift, strict=True)
                        )
                        if dx * dx + dy * dy == self._exact_reach(a, b) ** 2:
                            self._touched.add((self._queue.pair(a, b), image))
        self._plans[body] = plan
        self._where.pop(body, None)
