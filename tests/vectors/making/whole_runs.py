"""Whole runs: rules 2, 7 to 9, 10 and 11 of docs/specification.md, with every pair asked, slowly, and those
of periodic axes.

What is asked is kept until the plan of one of the two bodies is another; rules 5 and 6 are functions of the
plans, so that is the same as asking all of it after each event.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator, Sequence
from math import inf
from typing import NamedTuple

from .rules import (
    FAR,
    WALLED,
    Arena,
    Image,
    Plan,
    Velocity,
    anchored,
    are_closer,
    exchange,
    first_image,
    given_back,
    has_room,
    meeting,
    off_wall,
    overlap_at_insertion,
    overlap_at_start,
    parting,
    tick_of,
    unit_exponent,
    wall_contact,
    wrapped,
)

__all__ = [
    "ANY",
    "BEGINNING",
    "BY_CLOCK",
    "CONTACTS",
    "INSERTION",
    "NO_ROOM",
    "OTHERWISE",
    "PAIR",
    "PARTING",
    "REMOVAL",
    "TURN",
    "WALL",
    "At",
    "Body",
    "Command",
    "Event",
    "Insert",
    "Remove",
    "Response",
    "Restitution",
    "Scene",
    "Turned",
    "are_commands",
    "digest",
    "events",
    "unit_of",
]

BY_CLOCK, TURN, WALL, PAIR, PARTING = 1, 2, 3, 4, 5
"""The classes of events."""

INSERTION, REMOVAL, BEGINNING, NO_ROOM = 6, 7, 8, 9
"""What an event of class 2 or 4 may be instead: these are no classes, and order nothing. The last is where an
answer ends, before an insertion."""

CONTACTS = (WALL, PAIR, PARTING, BEGINNING)
"""What stands in the answer, and counts among the contacts of a tick."""

SPAN, BEAT = 1 << 61, 1 << 53
"""Ticks between two looks of the clock at who has flown for long; the second where an axis is periodic."""

ANY, THE_WALL = "*", "wall"

Turn = tuple[float, Velocity]
At = tuple[int, int, int]


class Body(NamedTuple):
    """A disc at the start, or where it comes, and its turns: times and velocities."""

    position: tuple[float, float]
    velocity: Velocity
    radius: float
    mass: float = 1.0
    turns: tuple[Turn, ...] = ()
    kind: str | None = None


class Turned(NamedTuple):
    """A turn that stands among the commands."""

    time: float
    body: int
    velocity: Velocity
    at: At | None = None


class Insert(NamedTuple):
    """A body that comes; ``number``: None, if none is written."""

    time: float
    body: Body
    at: At | None = None
    number: int | None = None


class Remove(NamedTuple):
    """A body that goes."""

    time: float
    body: int
    at: At | None = None


Command = Turned | Insert | Remove
COMMANDS: dict[type, int] = {Turned: TURN, Insert: INSERTION, Remove: REMOVAL}


class Restitution(NamedTuple):
    """The response that gives back a share."""

    e: float
    contact_time: float


Response = str | Restitution


class Scene(NamedTuple):
    """What a run is a function of. ``unit``: the e that the scene says, where it says its unit; ``periodic``:
    the axes, "", "x", "y" or "xy"."""

    bodies: tuple[Body, ...]
    arena: Arena | None = None
    start: float = 0.0
    unit: int | None = None
    commands: tuple[Command, ...] = ()
    responses: tuple[tuple[tuple[str, str], Response], ...] = ()
    periodic: str = ""


class Event(NamedTuple):
    """What happens: ``b`` is the other body, the wall, or -1 at a turn, an insertion or a removal; where two
    part ``a`` is the younger. ``barred``: by rule 5 the two would meet again right away."""

    tick: int
    kind: int
    a: int
    b: int = -1
    barred: bool = False


OTHERWISE = (
    "a passing ends a bar",
    "a given unit is ignored",
    "commands of a tick come as they are written, whatever their k",
    "commands come by time, at or not",
    "passings do not count",
    "insertions count in L",
    "insertions do not count in S",
    "numbers in the order of time",
    "who has no room is left out",
    "distances are exact",
    "responses for any body are for walls as well",
    "the most general response counts first",
    "who is inserted without a kind is of kind 0",
    "an exact end is the end of its tick",
    "nothing turns an immovable body",
    "the first immovable body does not stop",
    "ticks between contacts are exact",
    "a bar is of all images",
    "the greatest image of a tick",
    "plans are kept for 512 units",
    "places are not wrapped",
    "images take no room",
)
"""Other readings of the rules, which the vectors of ``rules`` tell from them: names for ``otherwise``."""


def unit_of(scene: Scene, otherwise: Collection[str] = ()) -> int:
    """Return e, where the unit is 2^-e."""
    if scene.unit is not None and "a given unit is ignored" not in otherwise:
        return scene.unit
    coming = [command.body for command in scene.commands if isinstance(command, Insert)]
    turned = [command.velocity for command in scene.commands if isinstance(command, Turned)]
    fast = [] if "insertions do not count in S" in otherwise else coming
    long = [*scene.bodies, *(coming if "insertions count in L" in otherwise else ())]
    return unit_exponent(
        [body.position for body in long],
        [body.radius for body in long],
        [body.velocity for body in scene.bodies],
        [
            *(velocity for body in scene.bodies for _, velocity in body.turns),
            *(body.velocity for body in fast),
            *turned,
        ],
        scene.arena,
    )


def events(scene: Scene, end: At | None = None, otherwise: Collection[str] = ()) -> Iterator[Event]:
    """Yield the events of a scene, in order, with ``end`` up to that exact end. Otherwise there is no last
    one, unless there are no bodies, or no room for one that is inserted: then it is NO_ROOM."""
    run = _Run(scene, otherwise)
    yield from run.begin()
    while (event := run.next()) is not None:
        if end is not None:
            last = (end[0] << 52) + end[1]
            full = event.kind in (WALL, PAIR, PARTING) and event.tick == last and run.met_at(last) >= end[2]
            if event.tick > last or (full and "an exact end is the end of its tick" not in otherwise):
                return
        if event.kind == NO_ROOM:
            yield event
            return
        yield from run.happen(event)


def digest(contacts: Sequence[Event]) -> str:
    """Return the fingerprint of contacts (rule 10)."""
    whole = b""
    for number, contact in enumerate(contacts):
        if number and number % 4096 == 0:
            whole = hashlib.sha256(whole).digest()
        for value, size in zip(
            (*divmod(contact.tick, 1 << 52), contact.a, contact.b), (8, 8, 4, 4), strict=True
        ):
            whole += value.to_bytes(size, "little", signed=True)
    return hashlib.sha256(whole).hexdigest()


def _in_order(scene: Scene, e: int, otherwise: Collection[str]) -> list[tuple[int, int, int, Command]]:
    """Return the commands (rule 2): tick, k, the number of the body, and what is done."""
    turns = [
        Turned(time, body, velocity)
        for body, each in enumerate(scene.bodies)
        for time, velocity in each.turns
    ]
    turns.sort(key=lambda turn: (turn.time, turn.body))
    written: list[Command] = [*turns, *scene.commands]
    timed = [
        (tick_of(each.time, scene.start, e), 0, each)
        if each.at is None
        else ((each.at[0] << 52) + each.at[1], each.at[2], each)
        for each in written
    ]
    said = [each.number for each in written if isinstance(each, Insert) and each.number is not None]
    free = max([len(scene.bodies) - 1, *said]) + 1
    if "numbers in the order of time" in otherwise:
        timed.sort(key=lambda command: command[0])
    numbered = []
    for tick, k, each in timed:
        body = each.number if isinstance(each, Insert) else each.body
        if body is None:
            body, free = free, free + 1
        numbered.append((tick, k, body, each))
    if all(each.at is None for each in written) or "commands come by time, at or not" in otherwise:
        return sorted(numbered, key=lambda command: command[3].time)
    if "commands of a tick come as they are written, whatever their k" in otherwise:
        return sorted(numbered, key=lambda command: command[0])
    return sorted(numbered, key=lambda command: command[:2])


def are_commands(scene: Scene) -> bool:
    """Whether the commands of a scene are about bodies that there are, by numbers used once (rule 2)."""
    there, used = set(range(len(scene.bodies))), set(range(len(scene.bodies)))
    for _, _, body, command in _in_order(scene, unit_of(scene), ()):
        if (body in used) if isinstance(command, Insert) else (body not in there):
            return False
        used.add(body)
        there.add(body)
        if isinstance(command, Remove):
            there.remove(body)
    return True


class _Run:
    """A run at some moment: the plans, the commands to come, who is barred, who passes, and what is
    awaited."""

    def __init__(self, scene: Scene, otherwise: Collection[str] = ()) -> None:
        self.otherwise = otherwise
        self.e = e = unit_of(scene, otherwise)
        self.arena = scene.arena
        sides = scene.arena or WALLED
        self.periods = sides[0] * ("x" in scene.periodic), sides[1] * ("y" in scene.periodic)
        short = scene.periodic and "plans are kept for 512 units" not in otherwise
        self.span = BEAT if short else SPAN
        self.responses = dict(scene.responses)
        self.plans = {
            number: self._wrapped(Plan(*body.position, *body.velocity, body.radius, 0))
            for number, body in enumerate(scene.bodies)
        }
        self.bodies = dict(enumerate(scene.bodies))
        # The kind of who is inserted without one.
        inserted = [each.body.kind for each in scene.commands if isinstance(each, Insert) and each.body.kind]
        named = sorted({kind for pair, _ in scene.responses for kind in pair} - {ANY, THE_WALL})
        self.kind = scene.bodies[0].kind if scene.bodies else next(iter([*inserted, *named]), None)
        masses = [body.mass for body in scene.bodies]
        masses += [command.body.mass for command in scene.commands if isinstance(command, Insert)]
        self.equal = len(set(masses)) <= 1 and inf not in masses
        self.commands = _in_order(scene, e, otherwise)
        self.now = 0
        self.count = (0, 0)  # a tick, and the contacts that it has had
        self.last: dict[int, int] = {}  # the tick of the last contact of each body, where it did not pass
        self.met: dict[tuple[int, int], Image] = {}
        self.passing: dict[tuple[int, int], tuple[int, int | None]] = {}  # since when, and until when
        self.walls: dict[int, tuple[int, int]] = {}
        self.pairs: dict[tuple[int, int], tuple[int, Image]] = {}

    def _wrapped(self, plan: Plan) -> Plan:
        """Return a plan with its periods taken off."""
        return plan if "places are not wrapped" in self.otherwise else wrapped(plan, self.periods)

    def _meeting(self, a: int, b: int) -> tuple[int, Image] | None:
        """Return when two bodies meet, and through which image; the barred one is left out."""
        one, two, barred = self.plans[a], self.plans[b], self.met.get((a, b))
        if any(self.periods):
            if barred is not None and "a bar is of all images" in self.otherwise:
                return None
            low = "the greatest image of a tick" not in self.otherwise
            return first_image(one, two, self.e, self.periods, barred, low)
        tick = meeting(one, two, self.e)
        return None if tick is None or barred is not None else (tick, (0, 0))

    def begin(self) -> Iterator[Event]:
        """Begin, with the passings that there are at the start (rule 11)."""
        overlap = are_closer if "distances are exact" in self.otherwise else overlap_at_start
        for a in self.plans:
            for b in range(a + 1, len(self.plans)):
                if self._response(a, b) == "pass" and overlap(self.plans[a], self.plans[b], self.e):
                    yield self._pass(0, a, b)
        for body in self.plans:
            self._ask(body, range(body))

    def _response(self, a: int, b: int) -> Response:
        """Return what happens where two bodies meet, or a body and a wall (rule 11)."""
        return self._meets(self.bodies[a], self.bodies[b] if b >= 0 else None)

    def _meets(self, one: Body, two: Body | None) -> Response:
        a, b = one.kind or "", THE_WALL if two is None else two.kind or ""
        pairs = [(a, b), (b, a)]
        if two is not None or "responses for any body are for walls as well" in self.otherwise:
            pairs += [(a, ANY), (ANY, a), (b, ANY), (ANY, b), (ANY, ANY)]
        else:
            pairs += [(ANY, b), (b, ANY)]
        if "the most general response counts first" in self.otherwise:
            pairs.reverse()
        return next((self.responses[pair] for pair in pairs if pair in self.responses), "elastic")

    def met_at(self, tick: int) -> int:
        """Return how many contacts there have been at a tick."""
        return self.count[1] if self.count[0] == tick else 0

    def _count(self, event: Event) -> Event:
        """Count a contact among those of its tick."""
        if event.kind in (WALL, PAIR) or "passings do not count" not in self.otherwise:
            self.count = event.tick, self.met_at(event.tick) + 1
        return event

    def _ask(self, body: int, others: Iterable[int]) -> None:
        """Ask what a body will meet."""
        plan = self.plans[body]
        held = self.bodies[body].mass == inf and "nothing turns an immovable body" in self.otherwise
        if self.arena is not None and not held:
            wall = wall_contact(plan, self.arena, self.e, self.periods)
            self.walls.pop(body, None)
            if wall is not None:
                self.walls[body] = wall
        for other in others:
            if other != body:
                self._ask_pair(min(body, other), max(body, other))

    def _ask_pair(self, a: int, b: int) -> None:
        """Ask when two bodies meet, or part where they are passing."""
        one, two = self.plans[a], self.plans[b]
        self.pairs.pop((a, b), None)
        if (a, b) in self.passing:
            self.passing[a, b] = self.passing[a, b][0], parting(one, two, self.e)
            return
        met = self._meeting(a, b)
        if met is not None and (met[0] >= self.now or self._response(a, b) != "pass"):
            self.pairs[a, b] = met

    def next(self) -> Event | None:
        """Return the next event (rule 8)."""
        span = self.span
        due = [((plan.anchor // span + 2) * span, BY_CLOCK, body, -1) for body, plan in self.plans.items()]
        due += [(tick, WALL, body, wall) for body, (tick, wall) in self.walls.items()]
        due += [(tick, PAIR, a, b) for (a, b), (tick, _) in self.pairs.items()]
        due += [
            (max(since + 1, tick), PARTING, a, b)
            for (a, b), (since, tick) in self.passing.items()
            if tick is not None
        ]
        first = min(due, default=None)
        if self.commands:
            tick, k, body, command = self.commands[0]
            waits = first is not None and first[0] == tick and self.met_at(tick) < k
            if first is None or ((tick, TURN) < first[:2] and not waits):
                if isinstance(command, Insert) and not self._has_room(tick, self._of_a_kind(command.body)):
                    if "who has no room is left out" not in self.otherwise:
                        return Event(tick, NO_ROOM, body)
                    self.commands.pop(0)
                    return self.next()
                return Event(tick, COMMANDS[type(command)], body)
        return None if first is None else Event(*first)

    def _of_a_kind(self, new: Body) -> Body:
        """Return a body that is inserted with the kind that it is of (rule 11)."""
        if (
            new.kind is not None
            or not self.kind
            or "who is inserted without a kind is of kind 0" in self.otherwise
        ):
            return new
        return new._replace(kind=self.kind)

    def _has_room(self, tick: int, body: Body) -> bool:
        """Whether there is room for a body that is inserted (rule 9)."""
        new = Plan(*body.position, *body.velocity, body.radius, tick)
        solid = [
            plan for other, plan in self.plans.items() if self._meets(body, self.bodies[other]) != "pass"
        ]
        if "distances are exact" in self.otherwise:
            return not any(are_closer(new, plan, self.e) for plan in solid)
        if "images take no room" in self.otherwise:
            return has_room(new, None, solid, self.e)
        return has_room(new, self.arena, solid, self.e, self.periods)

    def happen(self, event: Event) -> Iterator[Event]:
        """Let an event happen (rules 9 and 11); yield what has happened, what is only known then included."""
        tick, kind, a, b, _ = event
        self.now = tick
        if kind == INSERTION:
            yield event
            yield from self._insert(tick, a)
        elif kind == REMOVAL:
            yield from self._remove(tick, a)
            yield event
        elif kind == PARTING:
            yield self._part(tick, a, b)
        elif kind == PAIR and self._response(a, b) == "pass":
            yield self._pass(tick, a, b)
        else:
            bodies = (a, b) if kind == PAIR else (a,)
            for body in bodies:
                self.plans[body] = self._wrapped(anchored(self.plans[body], tick, self.e))
            self._end_bars(*bodies)
            yield self._change(event)
            for body in bodies:
                self._ask(body, self.plans)

    def _change(self, event: Event) -> Event:
        """Give the bodies of an event their new velocities; they are anchored at it. Return the event."""
        _, kind, a, b, _ = event
        one = self.plans[a]
        back = self._given_back(event) if kind in (WALL, PAIR) else 1.0
        if kind == TURN:
            command = self.commands.pop(0)[3]
            assert isinstance(command, Turned)
            vx, vy = command.velocity
            self.plans[a] = one._replace(vx=vx, vy=vy)
        elif kind == WALL:
            self._count(event)
            if self._response(a, b) == "stop":
                self.plans[a] = one._replace(vx=0.0, vy=0.0)
            elif isinstance(self._response(a, b), Restitution):
                vx, vy = off_wall(one, b, back)
                self.plans[a] = one._replace(vx=vx, vy=vy)
            else:
                self.plans[a] = one._replace(vx=-one.vx) if b in (-1, -2) else one._replace(vy=-one.vy)
        elif kind == PAIR:
            self._count(event)
            two = self.plans[b]
            masses = self.bodies[a].mass, self.bodies[b].mass
            if self._response(a, b) == "stop":
                still = [plan for plan, mass in zip((one, two), masses, strict=True) if mass == inf]
                if "the first immovable body does not stop" in self.otherwise:
                    still = still[:1]
                vxa, vya = (still[0].vx, still[0].vy) if len(still) == 1 else (0.0, 0.0)
                vxb, vyb = vxa, vya
            else:
                image = self.pairs[a, b][1]
                (vxa, vya), (vxb, vyb) = exchange(
                    one, two, None if self.equal else masses, self.periods, image, back
                )
            self.plans[a], self.plans[b] = one._replace(vx=vxa, vy=vya), two._replace(vx=vxb, vy=vyb)
            image = self.met[a, b] = self.pairs[a, b][1]
            again = meeting(self.plans[a], self.plans[b], self.e, self.periods, image)
            return event._replace(barred=again is not None)
        return event

    def _given_back(self, event: Event) -> float:
        """Return the share of the closing speed that comes back (rule 11), and note the contact."""
        tick, _, a, b, _ = event
        response = self._response(a, b)
        waited = tick - max(self.last.get(body, -FAR) for body in (a, b))
        self.last |= {body: tick for body in (a, b) if body >= 0}
        exactly = "ticks between contacts are exact" in self.otherwise
        return given_back(*response, waited, self.e, exactly) if isinstance(response, Restitution) else 1.0

    def _end_bars(self, *bodies: int) -> None:
        """End the bars of bodies that get a new plan (rule 7)."""
        self.met = {pair: image for pair, image in self.met.items() if not set(pair) & set(bodies)}

    def _insert(self, tick: int, body: int) -> Iterator[Event]:
        """Have a body come, and yield the passings that begin (rule 11)."""
        command = self.commands.pop(0)[3]
        assert isinstance(command, Insert)
        new = self.bodies[body] = self._of_a_kind(command.body)
        plan = self._wrapped(Plan(*new.position, *new.velocity, new.radius, tick))
        others = sorted(self.plans)
        self.plans[body] = plan
        for other in others:
            overlap = overlap_at_insertion(plan, self.plans[other], self.e)
            if "distances are exact" in self.otherwise:
                overlap = are_closer(plan, self.plans[other], self.e)
            if overlap and self._response(other, body) == "pass":
                yield self._pass(tick, min(body, other), max(body, other))
        self._ask(body, others)

    def _remove(self, tick: int, body: int) -> Iterator[Event]:
        """Have a body go, and yield the passings that end."""
        self.commands.pop(0)
        for other in sorted(self.plans):
            pair = min(body, other), max(body, other)
            if pair in self.passing:
                yield self._part(tick, *pair, ask=False)
            self.pairs.pop(pair, None)
        self._end_bars(body)
        self.walls.pop(body, None)
        del self.plans[body]

    def _pass(self, tick: int, a: int, b: int) -> Event:
        """Two bodies a < b begin to pass."""
        if "a passing ends a bar" in self.otherwise:
            self._free(a, b)
        self.passing[a, b] = tick, None
        self._ask_pair(a, b)
        return self._count(Event(tick, BEGINNING, a, b))

    def _part(self, tick: int, a: int, b: int, ask: bool = True) -> Event:
        """Two bodies a < b end to pass."""
        del self.passing[a, b]
        if "a passing ends a bar" in self.otherwise:
            self._free(a, b)
        if ask:
            self._ask_pair(a, b)
        return self._count(Event(tick, PARTING, b, a))

    def _free(self, *bodies: int) -> None:
        """End the bars of bodies, and ask them all again."""
        self._end_bars(*bodies)
        for body in bodies:
            self._ask(body, self.plans)
