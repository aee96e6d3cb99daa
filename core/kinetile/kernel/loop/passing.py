"""Passing: pairs that go through each other, from the tick in which they touch to that in which they part.

Neither changes a plan, and a passing lasts for a tick at least: so a contact of two that pass, if it lies in
the past, has had its beginning and its end, and is none that is still to come (``predictions.meeting``). A
pair that has begun stands in the list of both its bodies (``k.passings``) with the tick at which it parts,
which is asked for exactly, and again whenever one of the two plans changes. The elder of the two is looked at
then: its *leave* is the first of those ticks, beside what else its entry in the queue awaits. A pair that is
passing is not asked for a contact.

Every beginning has its end: by parting, or because one of the two goes. Both are rows of the log, the elder
first where they begin, the younger first where they end.
"""

from __future__ import annotations

from typing import Any

from kinetile.kernel.compiled import disowned, hook, larger, smaller, template, to_be_filled_in
from kinetile.kernel.flight import since_anchor
from kinetile.kernel.loop.counting import count_row
from kinetile.kernel.loop.log_rows import log_passing
from kinetile.kernel.loop.predictions import settle
from kinetile.kernel.loop.presence import ROOM, elder, is_there
from kinetile.kernel.loop.rules import passes
from kinetile.kernel.pairs import follower, link, unlink
from kinetile.kernel.tables import NEVER, Kernel, Records

__all__ = [
    "begin_at_start",
    "begin_passing",
    "begin_with_all",
    "crowded",
    "end_all_passings",
    "end_first_passing",
    "find_leave",
    "plan_partings",
]

part = to_be_filled_in


@hook
def crowded(k: Kernel, pairs: int) -> bool:
    """Whether there is no room for so many pairs more."""
    return bool(len(k.passings) - k.clock[0].passings < pairs)


@template
def _parts(k: Kernel, record: Records) -> int:
    """Return when a pair parts: a tick after it has begun, at least."""
    return int(larger(part(k, record.a, record.b), record.begun + 1))


@template
def begin_passing(k: Kernel, a: int, b: int, tick: int) -> None:
    """Two bodies begin to pass through each other; there is room for them. ``a`` is the elder."""
    clock = k.clock[0]
    new = clock.passable
    record = k.passings[new]
    clock.passable = record.next_a
    record.a = a
    record.b = b
    link(k.passings, k.passers, new)
    record.begun = tick
    record.tick = _parts(k, record)
    k.traits[a].leave = smaller(k.traits[a].leave, record.tick)
    k.traits[a].inside += 1
    k.traits[b].inside += 1
    clock.passings += 1
    k.counts[0].passings += 1
    k.counts[0].contacts_disc += 1
    log_passing(k, tick, a, b)
    count_row(k, tick, a, b)


@hook
def find_leave(k: Kernel, body: int) -> int:
    """Look in a body's list for the first of the pairs that it is looked at for; return it, or -1."""
    table = k.passings
    found = -1
    k.traits[body].leave = NEVER
    pair = k.passers[body]
    while pair >= 0:
        record = table[pair]
        if record.a == body and record.tick != NEVER:
            sooner = record.tick < k.traits[body].leave
            if record.tick == k.traits[body].leave:
                sooner = elder(k, record.b, table[found].b) == record.b
            if sooner:
                found = pair
                k.traits[body].leave = record.tick
        pair = follower(table, body, pair)
    return int(found)


@hook
def end_passing(k: Kernel, pair: int, tick: int) -> None:
    """A pair ends; who looks for its next one is told by ``find_leave``."""
    clock = k.clock[0]
    record = k.passings[pair]
    a = record.a
    b = record.b
    k.counts[0].contacts_disc += 1
    log_passing(k, tick, b, a)
    count_row(k, tick, b, a)
    unlink(k.passings, k.passers, pair)
    record.a = -1
    record.next_a = clock.passable
    clock.passable = pair
    clock.passings -= 1
    k.traits[a].inside -= 1
    k.traits[b].inside -= 1


@hook
def end_first_passing(k: Kernel, body: int, tick: int) -> None:
    """The first of the pairs parts that a body is looked at for."""
    end_passing(k, find_leave(k, body), tick)
    find_leave(k, body)


@template
def plan_partings(k: Kernel, body: int) -> None:
    """A body's plan has changed: ask when it parts from all those that it is passing through."""
    pair = k.passers[body]
    while pair >= 0:
        record = k.passings[pair]
        record.tick = _parts(k, record)
        if record.a != body:
            find_leave(k, record.a)
            settle(k, record.a)
        pair = follower(k.passings, body, pair)
    find_leave(k, body)


@template
def begin_with_all(k: Kernel, body: int, tick: int) -> None:
    """A body has come: it begins to pass through all that it overlaps and passes, the eldest first."""
    clock = k.clock[0]
    new = k.bodies[body]
    before = -1
    while True:
        next_one = -1
        for other in range(clock.bodies):
            number = k.queue[other].number
            if other != body and is_there(k, other) and number > before and passes(k, other, body):
                one = k.bodies[other]
                elapsed = since_anchor(k, one, tick)
                dx = (one.x + one.vx * elapsed) - new.x
                dy = (one.y + one.vy * elapsed) - new.y
                reach = (one.radius + new.radius) * (1.0 - ROOM)
                if dx * dx + dy * dy < reach * reach and (next_one < 0 or number < k.queue[next_one].number):
                    next_one = other
        if next_one < 0:
            return
        before = k.queue[next_one].number
        first = elder(k, next_one, body)
        begin_passing(k, first, next_one + body - first, tick)
        settle(k, next_one)


@template
def end_all_passings(k: Kernel, body: int, tick: int) -> None:
    """A body goes: it ends to pass through others, the eldest first."""
    while k.passers[body] >= 0:
        pair = k.passers[body]
        found = pair
        while pair >= 0:
            one = k.passings[pair].a + k.passings[pair].b - body
            other = k.passings[found].a + k.passings[found].b - body
            if k.queue[one].number < k.queue[other].number:
                found = pair
            pair = follower(k.passings, body, pair)
        other = k.passings[found].a + k.passings[found].b - body
        end_passing(k, found, tick)
        find_leave(k, other)
        settle(k, other)
    k.traits[body].leave = NEVER


def begin_at_start(k: Kernel, pairs: Any) -> None:
    """Let pairs begin that overlap from the start, (m, 2) slots in their order; a template, as
    ``advance``."""
    k = disowned(k)
    for at in range(len(pairs)):
        begin_passing(k, pairs[at, 0], pairs[at, 1], 0)
