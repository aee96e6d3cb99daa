"""Runs to an end, chunk by chunk, or event by event; and the events that users see.

The compiled loop runs within one span of the clock at a time. This module joins the spans: an end in time is
in the present span or a later one, and between two spans the clock's base moves on.
"""

import logging
import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeAlias, cast

import numpy as np

from kinetile.errors import Refused
from kinetile.kernel.clock import LONGEST_UNIT, SPAN, TICKS, time_unit
from kinetile.kernel.compiled import python_of
from kinetile.kernel.images import BEAT
from kinetile.kernel.log import REANCHORED, WALLS
from kinetile.kernel.loop import COMMAND_DUE, CONTACTS_REACHED, TIME_REACHED, WATCHED
from kinetile.kernel.loop.bookkeeping import ANY_BEGIN, ENDS, SOME, flag_of
from kinetile.kernel.passings import row_of
from kinetile.kernel.tables import JAMS, NEVER, NOBODY, PAIR, PARTING, PASSING_BEGINS, STRUCTURAL, WALL
from kinetile.run.engine.engine import MOST_UNITS, UNLIMITED, Engine
from kinetile.run.engine.ledger import ContactRow
from kinetile.run.engine.spans import FEWEST_SPANS, move_base, skip
from kinetile.run.impact import impact_of
from kinetile.run.interrupts import Interruptible, let_signals_through
from kinetile.run.moment import Moment
from kinetile.scene.checks import WALL_KIND as WALL_KIND
from kinetile.scene.commands import COMMAND_KINDS, Does, doing
from kinetile.scene.responses import Kind

IDLE_SPANS = 1 << 12
"""A run without an end in time gives up after this number of empty spans of the clock."""

MANY, CONTACTS_A_SPAN = 128, 64
"""The number of passed spans, one by one or in a step, after which a unit is advised for a scene with fewer
contacts than would take as long."""

AS_DEAR, AS_DEAR_TURNS = 32, 2048
"""The numbers of bodies, without and with a torus, for which looking ahead costs as much as a span."""

MOST_ANCHORED = 10**9
"""The number of rows, for the clock alone, above which a recording is refused."""

EventKind: TypeAlias = Literal[
    "structural", "turn", "accelerate", "kind", "move", "insert", "remove", "wall", "disc", "pass", "part"
]

_COMMANDS = cast("dict[int, EventKind]", {each.code: each.event for each in COMMAND_KINDS})
_CODES = {kind: code for code, kind in _COMMANDS.items()}
_TAKES = {each.code for each in doing(Does.TAKES)}
_SIDES = {side: wall for wall, side in WALLS.items()}
_MEETINGS = ("wall", "disc", "pass")
_WAITED_FOR = (*_MEETINGS, "part")
"""Kinds of events that a step returns from the log."""

EVENT_KINDS: dict[int, EventKind] = {
    STRUCTURAL: "structural",
    WALL: "wall",
    PAIR: "disc",
    PASSING_BEGINS: "pass",
    PARTING: "part",
    **_COMMANDS,
}
"""The kinds of events by the loop's code of the next event (``kernel.tables.NEXT_EVENT``). A plan that is
only anchored again has no kind: users do not see it."""


class End(NamedTuple):
    """The end of a run: a time (``until``, and ``ticks`` since the start; None: no end in time), ``quota``
    contacts of that tick, or a total number of contacts or events."""

    until: float | None = None
    ticks: int | None = None
    quota: int = UNLIMITED
    contacts: int = UNLIMITED
    events: int = UNLIMITED

    def within(self, engine: Engine) -> tuple[int, int, bool]:
        """Returns the last tick of the kernel for a run of the present span of the clock, the number of
        contacts that this tick may have, and True if the end lies in the span."""
        rest = SPAN if self.ticks is None else engine.clock.relative(self.ticks)
        last = rest < SPAN
        return min(rest, SPAN - 1), self.quota if last else UNLIMITED, last


class Event(NamedTuple):
    """One event of a run.

    Attributes:
        time: the time in the scene's unit; (epoch, tick) is the same exactly (``kinetile.kernel.log``).
        epoch: whole time units since the scene's start.
        tick: ticks of 2**-52 of a time unit after that.
        kind: "structural" (a certificate of the broad phase failed), "wall" (a body met a wall), "disc" (two
            bodies met), "pass" (two begin to pass through each other), "part" (such a passing ends), or a
            command's: "turn", "accelerate", "kind", "move", "insert" or "remove".
        bodies: the bodies of the event, in ascending order; () at a structural event.
        certificate: the body whose certificate fails at a structural event, else None.
        wall: "left", "right", "bottom" or "top" at a contact with a wall, else None.
        kinds: the kinds of ``bodies``, in their order; () without kinds in the scene.
        normal: (nx, ny), of length 1, from the first body to the second, or into the wall.
        closing_speed: the speed at which the two closed in along the normal, before the event.
        impulse: (jx, jy), the momentum that the second body, or the wall, received from the first; (0, 0) if
            they begin to pass, NaN if no mass is finite. It is computed from the lighter body, also if a
            response takes momentum from both, as ``stop`` does (of equal masses: the mean). Bodies pressed
            together have one at each hop, also with a closing speed of 0; what rests has no events.

    The last three are None for other events and for events to come, and if two overlap where their passing
    begins; ``normal`` and ``closing_speed`` also for a narrow phase without ``touch``. In functions of
    ``on_contact`` bodies are in the order of the key, and the vectors follow.
    """

    time: float
    epoch: int
    tick: int
    kind: EventKind
    bodies: tuple[int, ...] = ()
    certificate: int | None = None
    wall: str | None = None
    kinds: tuple[Kind, ...] = ()
    normal: tuple[float, float] | None = None
    closing_speed: float | None = None
    impulse: tuple[float, float] | None = None


class Ended(NamedTuple):
    """The reason why a run has ended; true if the run has reached its end in time, else false.

    Attributes:
        reason: "until"; or the argument that ended it before, "stop_at", "on_contact" (a function has
            returned True), "max_contacts" or "max_events"; or "idle", if a run without an end in time had no
            event for two million time units.
        event: the contact that stopped it by ``stop_at`` or ``on_contact``, else None.
    """

    reason: Literal["until", "stop_at", "on_contact", "max_contacts", "max_events", "idle"]
    event: Event | None = None

    def __bool__(self) -> bool:
        return self.reason == "until"


def advance(engine: Engine, end: End, audit: int | None, after_chunk: Callable[[], None] | None) -> Ended:
    """Runs to an end, with an audit after every ``audit`` contacts and at the end, unless it is None; returns
    the reason of the end, "stop_at" at any watched contact.

    ``after_chunk``, if given, is called after each chunk; an exception from it ends the run there.
    """
    ledger, stop = engine.ledger, None
    left: list[ContactRow] = []
    if end.ticks is not None and (ledger.records or end.ticks > MOST_UNITS * TICKS):
        _demand_feasible(engine, end, end.ticks)
    watching = engine.fields.stops.watching[0] and not engine.fields.stops.before[0]
    engine.fields.meeting.wanted[0] = watching
    if watching:
        engine.build()  # passings of the start begin
        stop, left = _first_watched(engine, ledger.pending_events or [])
        if stop is not None:
            ledger.pending_events = left
            return Ended("stop_at", stop)
    audited = 0 if audit is None else engine.contacts
    still: _Stillness | None = None
    ledger.pending_events = None
    try:
        while True:
            until, quota, last = end.within(engine)
            most = end.contacts if audit is None else min(end.contacts, audited + audit)
            events = UNLIMITED if end.events == UNLIMITED else end.events - engine.events
            reason = engine.chunk(until, most, events, quota)
            if reason == WATCHED:
                stop, left = _watched(engine)
            ended = None
            if reason == TIME_REACHED and last:
                ended = Ended("until")
                engine.arrive(end.until)
            let_signals_through()
            if after_chunk is not None:
                ledger.pending_events = left  # with the passings that end by its commands
                with Interruptible():
                    after_chunk()
                ledger.pending_events = None
                if stop is None:
                    stop, left = _first_watched(engine, left) if watching else (None, [])
            if stop is not None:
                ended = Ended("stop_at", stop)
            elif ended is None and (engine.contacts >= end.contacts or engine.events >= end.events):
                ended = Ended("max_contacts" if engine.contacts >= end.contacts else "max_events")
            if audit is not None and (ended is not None or reason == CONTACTS_REACHED):
                engine.audit()
                audited = engine.contacts
            if ended is not None:
                return ended
            if reason == TIME_REACHED:
                still = still or _Stillness()
                still.note_span(engine)
                if end.ticks is None and still.idle > IDLE_SPANS:
                    return Ended("idle")
                still.move_on(engine, end)
    finally:
        ledger.pending_events = left


def _demand_feasible(engine: Engine, end: End, ticks: int) -> None:
    """Raises Refused for a run to a time that is too many units of the clock away, or that needs more rows,
    for plans that the clock anchors again, than a recording can have."""
    units, records = ticks // TICKS, engine.ledger.records
    bodies, unit = len(engine.taken), engine.clock.unit
    if not bodies or min(end.contacts, end.events) < UNLIMITED:
        return
    if units > MOST_UNITS:
        raise Refused(
            f"until={end.until!r} is more than 2**{units.bit_length() - 1} units of this scene's clock after "
            f"its start, and a run has at most 2**62: expected at most "
            f"{engine.clock.start + MOST_UNITS * unit:.6g}, or a scene with a unit above {unit:.3g}"
        )
    beat = (BEAT if engine.scene.periodic else SPAN) // TICKS
    rows = bodies * (units - engine.clock.base) // (6 * beat)  # a contact has one for two bodies
    if records and rows > MOST_ANCHORED:
        raise Refused(
            f"a recording until {end.until!r} has {float(rows):.3g} rows or more: the clock counts in units "
            f"of {unit:.3g}, and each body has a row every {3 * beat:,} of them at least. Expected at most "
            f"{MOST_ANCHORED:,} rows: end sooner, give the scene a larger unit, or run it without a recorder"
        )


class _Stillness:
    """Counts spans of the clock without an event, and skips spans that cannot have one.

    Attributes:
        quiet: spans in a row without a contact or a command; structural events do not count.
        idle: the number of these after which no command comes either: the waiting time of a run without end.
    """

    def __init__(self) -> None:
        self.quiet = self.idle = 0
        self._seen, self._wait = -1, 0

    def note_span(self, engine: Engine) -> None:
        happened = engine.events - engine.count.structural[0]
        self.quiet = self.quiet + 1 if happened == self._seen else 0
        self._wait -= 1
        self.idle = self.idle + 1 if self.quiet and engine.next_command is None else 0
        self._seen = happened

    def move_on(self, engine: Engine, end: End) -> None:
        """Moves on to the next span of the clock that may have an event.

        Looking ahead costs as much as some spans do, and may be useless: so that many spans pass before the
        next try, with or without contacts.
        """
        if self.quiet and self._wait < 0:
            most = IDLE_SPANS - self.idle if end.ticks is None else UNLIMITED
            skipped = skip(engine, end.ticks, most)
            self.quiet += skipped
            self.idle += skipped if self.idle else 0
            self._wait = len(engine.taken) // (AS_DEAR_TURNS if engine.scene.periodic else AS_DEAR)
            self._wait += 0 if skipped else FEWEST_SPANS
        move_base(engine, end.ticks)
        engine.passed += 1
        if engine.passed == MANY and engine.contacts < MANY * CONTACTS_A_SPAN:
            _advise_unit(engine)


def _advise_unit(engine: Engine) -> None:
    """Logs a better unit if bodies are slow in the scene's unit. Raises Refused if they are so slow that
    anchoring a plan loses their flight to rounding, so no run would end."""
    unit, scene, speed = engine.clock.unit, engine.scene, engine.speed
    far = float(np.abs(scene.position).max(initial=0.0) + scene.radius.max(initial=0.0))
    size = max(scene.arena or (far or 1.0,))
    longer = time_unit(size, speed, LONGEST_UNIT)
    if not speed or longer <= unit:
        return
    units, spacing = 2 * (BEAT if scene.periodic else SPAN) // TICKS, 2.0 * math.ulp(size)
    advice = f"unit=2.0**{math.frexp(longer)[1] - 1}"
    if speed * units * unit < spacing:
        raise Refused(
            f"the bodies are too slow for the scene's unit, {unit:.6g}: their places are rounded every "
            f"{units} units, in which none flies {spacing:.3g}. Expected a larger unit, such as {advice}"
        )
    logging.getLogger("kinetile").warning(
        "kinetile: %d spans of 512 units of the clock had %d contacts, and each takes as long as some %d: "
        "the unit, %.6g, is short for bodies that are no faster than %.3g. Give the scene %s, and it runs as "
        "fast as others; its contacts then differ by rounding",
        *(engine.passed, engine.contacts, CONTACTS_A_SPAN, unit, speed, advice),
    )


def advance_one(engine: Engine, end: End) -> Event | None:
    """Runs the next event up to and at an end in time, and returns it, or None at that end."""
    still = _Stillness()
    pending_events = engine.ledger.pending_events
    assert pending_events is not None  # no run is under way
    engine.fields.meeting.wanted[0] = True
    has_met = False  # the first of these is a contact of this step
    while end.ticks is not None or still.quiet < IDLE_SPANS - 1:
        let_signals_through()
        engine.build()
        if pending_events:
            first = _event_of_row(engine, pending_events.pop(0))
            return _with_impact(engine, first) if has_met else first
        until, quota, last = end.within(engine)
        head = _look(engine, until, quota)
        if head is not None:
            event = _event_of(engine, head)
            if engine.chunk(head.tick, UNLIMITED, most=1) == COMMAND_DUE:
                continue  # no event has run yet: in tables that have grown another one may be the next
            engine.build()
            if event is not None and _CODES.get(event.kind) in _TAKES:  # after the passings that it ends
                ended = sum(a > b for *_, a, b in pending_events)
                pending_events.insert(ended, (event.epoch, event.tick, event.bodies[0], _CODES[event.kind]))
            elif event is not None and event.kind not in _WAITED_FOR:
                return event
            has_met = event is not None and event.kind in _MEETINGS
        elif end.ticks is None and engine.next_command is None and engine.rests:
            return None
        else:
            engine.chunk(until, UNLIMITED, quota=quota)
            if last:
                engine.arrive(end.until)
                return None
            still.note_span(engine)
            still.move_on(engine, end)
    return None


def next_event(engine: Engine) -> Event | None:
    """Returns the first event that is scheduled now, or None. A jam does not prevent it."""
    engine.build()
    if engine.ledger.pending_events:
        return _event_of_row(engine, engine.ledger.pending_events[0])
    k, fields = engine.k, engine.fields
    clock, lists = k.clock[0], k.clock[0].lists
    command, fault, beat = int(lists.command), fields.fault.code[0], fields.torus.beat[0]
    fields.fault.code[0] = 0 if fault in JAMS else fault
    fields.torus.beat[0] = NEVER
    try:  # anchoring a plan again is no event: the next one is returned
        while lists.command < lists.commands and int(k.commands[int(lists.command)].code) == REANCHORED:
            lists.command += 1
        head = _look(engine, int(clock.now) + 2 * SPAN)
        event = None if head is None else _event_of(engine, head)
    finally:
        lists.command, fields.fault.code[0], fields.torus.beat[0] = command, fault, beat
    planned = engine.next_command
    if planned is not None and (event is None or planned.ticks < event.epoch * TICKS + event.tick):
        event = Event(*engine.clock.moment(planned.ticks), _COMMANDS[planned.code], (planned.body,))
    return _first_parting(engine, event) if event is not None and _CODES.get(event.kind) in _TAKES else event


def _first_parting(engine: Engine, removal: Event) -> Event:
    """Returns the first event of a removal, or a move: the first passing that it ends, or itself."""
    k, number = engine.k, removal.bodies[0]
    slot = int(k.slots[number])
    pairs = k.passings[(k.passings.a == slot) | ((k.passings.a >= 0) & (k.passings.b == slot))]
    if not len(pairs):
        return removal
    other = int(k.queue.number[pairs.a + pairs.b - slot].min())
    return removal._replace(kind="part", bodies=(min(number, other), max(number, other)))


class _Next(NamedTuple):
    """The next event, as in ``kernel.tables.NEXT_EVENT``."""

    tick: int
    kind: int
    a: int
    b: int


def _look(engine: Engine, until: int, quota: int = UNLIMITED) -> _Next | None:
    """Returns the next event, up to and at a tick that may have ``quota`` contacts, or None. It changes
    nothing except that guesses are computed exactly."""
    if engine.chunk(until, UNLIMITED, 0, quota) == TIME_REACHED:
        return None
    found = engine.fields.next
    return _Next(found.tick[0], found.kind[0], found.a[0], found.b[0])


def _event_of(engine: Engine, head: _Next) -> Event | None:
    """Returns the next event, or None for one that users do not see."""
    kind = EVENT_KINDS.get(head.kind)
    if kind is None:
        return None
    when = engine.clock.moment(engine.clock.total(head.tick))
    if head.kind == STRUCTURAL:
        return Event(*when, kind, certificate=head.a)
    return Event(*when, kind, tuple(sorted(each for each in (head.a, head.b) if each != NOBODY)))


def _watched(engine: Engine) -> tuple[Event, list[ContactRow]]:
    """Returns the contact that stopped the loop, and the contacts that follow it in the log."""
    stops = engine.fields.stops
    if not stops.before[0]:
        first, *left = np.asarray(engine.k.met)[stops.row[0] : engine.ledger.latest].tolist()
        return _with_impact(engine, _event_of_row(engine, first)), left
    epoch, tick = divmod(engine.clock.total(stops.tick[0]), TICKS)
    event = _event_of_row(engine, (epoch, tick, stops.a[0], stops.b[0]))
    return (event._replace(kind="pass") if event.kind == "disc" and stops.passes[0] else event), []


def _first_watched(engine: Engine, rows: list[ContactRow]) -> tuple[Event | None, list[ContactRow]]:
    """Returns the first watched contact of some that have happened, or None, and the contacts after it."""
    for at, row in enumerate(rows):
        if _is_watched(engine, *row[2:]):
            return _event_of_row(engine, row), rows[at + 1 :]
    return None, []


def _is_watched(engine: Engine, a: int, b: int) -> bool:
    """True if a contact of two numbers, even of removed bodies, is watched (``bookkeeping.is_watched``)."""
    if b in _COMMANDS:
        return False
    k, kinds = engine.k, engine.scene.kinds
    one, two = map((*kinds, WALL_KIND).index, Moment(engine.scene, engine).kinds_of([a, b]))
    flag = python_of(flag_of)(a, b)
    if k.watched_kinds[row_of(len(kinds), one, two)] & flag:
        return True
    flags = [int(k.watch[each]) for each in (a, b) if each >= 0]
    pair = {a, b if b >= 0 else NOBODY}
    if 0 <= b < a and not any(each & ENDS for each in flags):
        return False
    return any(each & ANY_BEGIN for each in flags) or (
        all(each & SOME for each in flags) and any({int(row.a), int(row.b)} == pair for row in k.watched)
    )


def _with_impact(engine: Engine, event: Event) -> Event:
    """Returns the last event with its normal, closing speed and impulse, if two have just met."""
    if event.kind not in _MEETINGS:
        return event
    a, b = (int(engine.k.slots[body]) for body in (*event.bodies, *event.bodies)[:2])
    b = b if event.wall is None else _SIDES[event.wall]
    return Event(*event[:8], *impact_of(engine, a, b, event.kind == "pass"))


def _event_of_row(engine: Engine, row: ContactRow) -> Event:
    epoch, tick, a, b = row
    k, when = engine.k, engine.clock.moment(epoch * TICKS + tick)
    if b in _TAKES:
        return Event(*when, _COMMANDS[b], (a,))
    if b < 0:
        return Event(*when, "wall", (a,), wall=WALLS[b])
    if b < a:
        return Event(*when, "part", (b, a))
    one, other = int(k.slots[a]), int(k.slots[b])
    meets = not engine.composition.passing or (
        one >= 0 and other >= 0 and not _has_begun(k, one, other, engine.clock.relative(epoch * TICKS + tick))
    )  # only passings wait until a body is removed
    return Event(*when, "disc" if meets else "pass", (a, b))


def _has_begun(k: Any, one: int, other: int, tick: int) -> bool:
    """Returns True if a passing of two bodies has begun at a tick of the kernel."""
    pairs = k.passings.view(np.ndarray)
    of_both = np.minimum(pairs["a"], pairs["b"]) == min(one, other)
    of_both &= np.maximum(pairs["a"], pairs["b"]) == max(one, other)
    return bool((of_both & (pairs["begun"] == tick)).any())
