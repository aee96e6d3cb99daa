"""How time moves on: chunk by chunk to an end, or event by event.

The compiled loop runs within one span of the clock at a time. Here the spans are put together: an end in time
lies in some span to come, and between two spans the clock's base moves on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np

from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.log import REANCHORED, WALLS
from kinetile.kernel.loop import CONTACTS_REACHED, TIME_REACHED
from kinetile.run.engine import UNLIMITED, Engine
from kinetile.run.interrupts import Unbroken

__all__ = ["End", "Event", "advance", "advance_one", "next_event"]

IDLE_SPANS = 1 << 12
"""A run without an end in time gives up after so many spans of the clock in which nothing happened."""


class End(NamedTuple):
    """When to stop: at a time (``until``, and ``ticks`` since the start; None: no end in time), or after so
    many contacts or events in all."""

    until: float | None = None
    ticks: int | None = None
    contacts: int = UNLIMITED
    events: int = UNLIMITED


class Event(NamedTuple):
    """One event of a run.

    Attributes:
        time: when, in the scene's time; (epoch, tick) is the same exactly (``kinetile.kernel.log``).
        epoch: whole time units since the scene's start.
        tick: ticks of 2**-52 of a time unit after that.
        kind: "structural" (a certificate of the broad phase failed), "turn", "wall" (a body met a wall) or
            "disc" (two bodies met).
        bodies: the bodies whose flight plans change, in ascending order; none at a structural event.
        certificate: the number of the broad phase's certificate at a structural event, else None.
        wall: "left", "right", "bottom" or "top" at a contact with a wall that has happened, else None.
    """

    time: float
    epoch: int
    tick: int
    kind: Literal["structural", "turn", "wall", "disc"]
    bodies: tuple[int, ...] = ()
    certificate: int | None = None
    wall: str | None = None


def advance(engine: Engine, end: End, audit: int | None, after_chunk: Callable[[], None]) -> None:
    """Run on to an end, with an audit every so many contacts and at the end, unless that is None.

    ``after_chunk`` is called when a chunk is done; whatever it raises ends the run there.
    """
    idle, seen, audited = 0, -1, engine.contacts
    while True:
        rest = SPAN if end.ticks is None else engine.clock.relative(end.ticks)
        stop = end.contacts if audit is None else min(end.contacts, audited + audit)
        reason = engine.chunk(min(rest, SPAN - 1), stop, most=end.events - engine.events)
        arrived = reason == TIME_REACHED and rest < SPAN
        if arrived:
            engine.asked = end.until
        after_chunk()
        finished = arrived or engine.contacts >= end.contacts or engine.events >= end.events
        if audit is not None and (finished or reason == CONTACTS_REACHED):
            engine.audit()
            audited = engine.contacts
        if finished:
            return
        if reason == TIME_REACHED:
            happened = engine.contacts + int(engine.k.counts[0].turns)
            idle = idle + 1 if happened == seen and engine.next_turn is None else 0
            seen = happened
            if end.ticks is None and idle > IDLE_SPANS:
                return
            with Unbroken():
                engine.move_base(end.ticks)


def advance_one(engine: Engine, end: End) -> Event | None:
    """Run the next event up to and at an end in time, and return it; None, at that end, where none comes."""
    for _ in range(IDLE_SPANS):
        engine.build()
        rest = SPAN if end.ticks is None else engine.clock.relative(end.ticks)
        place = _head(engine)
        if place is not None and int(engine.k.queue[place].tick) <= min(rest, SPAN - 1):
            event = _event_at(engine, place)
            engine.chunk(int(engine.k.queue[place].tick), UNLIMITED, most=1)
            engine.build()
            if event is not None:
                return event if event.kind != "wall" else event._replace(wall=_wall_met(engine))
        elif end.ticks is None and place is None and engine.next_turn is None:
            return None
        else:
            engine.chunk(min(rest, SPAN - 1), UNLIMITED)
            if rest < SPAN:
                engine.asked = end.until
                return None
            with Unbroken():
                engine.move_base(end.ticks)
    return None


def next_event(engine: Engine) -> Event | None:
    """Return the first event that is scheduled now; None where nothing is."""
    engine.build()
    place = _head(engine)
    event = None if place is None else _event_at(engine, place)
    if place is not None and event is None:  # a body is written down anew first: what comes after that?
        queue = engine.k.queue[1 : int(engine.k.clock[0].queued)]
        event = None if not len(queue) else _event_at(engine, 1 + int(np.argmin(queue.tick)))
    turn = engine.next_turn
    if turn is not None and (event is None or turn.ticks < event.epoch * TICKS + event.tick):
        return Event(*engine.clock.moment(turn.ticks), "turn", (turn.body,))
    return event


def _head(engine: Engine) -> int | None:
    """Return the place of the queue's head; None for an empty queue."""
    return 0 if int(engine.k.clock[0].queued) else None


def _event_at(engine: Engine, place: int) -> Event | None:
    """Return what is awaited at a place of the queue; None for what is no event to a user, a plan that is
    written down anew without a change."""
    k = engine.k
    clock = k.clock[0]
    certificate = int(k.queue[place].certificate)
    what: dict[str, Any]
    first_wall = int(clock.structural) + 1
    first_pair = first_wall + int(clock.bodies)
    if certificate < int(clock.structural):
        what = {"kind": "structural", "certificate": certificate}
    elif certificate < first_wall:
        turn = k.turns[int(clock.turn)]
        if int(turn.code) == REANCHORED:
            return None
        what = {"kind": "turn", "bodies": (int(turn.body),)}
    elif certificate < first_pair:
        what = {"kind": "wall", "bodies": (certificate - first_wall,)}
    else:
        pair = k.certificates[certificate]
        what = {"kind": "disc", "bodies": (int(pair.a), int(pair.b))}
    return Event(*engine.clock.moment(engine.clock.total(int(k.queue[place].tick))), **what)


def _wall_met(engine: Engine) -> str:
    """Return the wall of the contact that happened last: the log has it."""
    return WALLS[int(engine.k.log[0].b)]
