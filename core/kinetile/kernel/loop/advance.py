"""The main loop: take the next event, restore the proof, again (thesis, section 2).

``advance`` is a template. Its hooks (``build``, ``repair``, ``replan``, ``near``, ``enter``, ``leave`` of the
broad phase; ``meet``, ``soonest``, ``collide`` of the narrow phase for pairs; ``reach_wall``, ``bounce`` of
the one for walls; those of the responses that the scene's rules name) and its constants (``PAIRS``,
``BOUNDS``, ``WALLS``, ``COMMANDS``, ``LIVING``, ``RULES``, ``PASSING``) are filled in by
``kinetile.kernel.compiled.compose`` from what the scene names; what it does not name is not compiled.

Of one tick, structural events run first, then commands, then contacts with walls, then contacts of pairs, and
after each of them the head of the queue is taken anew. So at a contact's tick every structural event up to
and at that tick has been restored, and which broad phase did it cannot matter: a contact's time is a function
of the two flight plans alone, and the broad phase sees bodies fattened by a skin wide enough for all rounding
(docs/one-answer.md has the rule and its proof).

A guess at the head is no event: nothing happens at its tick but that a contact is asked for exactly. It moves
neither the clock nor a body, so when guesses are asked cannot matter either.

The loop cannot raise. It runs until something has to be done outside and returns a reason.
"""

from __future__ import annotations

from typing import Any

from kinetile.kernel.compiled import disowned, larger, smaller, to_be_filled_in
from kinetile.kernel.faults import BAD_COUNT, LATE_CONTACT, NOT_FINITE, STALLED, blame
from kinetile.kernel.flight import anchor_at, note_all_places
from kinetile.kernel.log import INSERTED, REMOVED
from kinetile.kernel.loop.calendar import file_all, head, runner_up
from kinetile.kernel.loop.commands import (
    FREE,
    FULL_LOG,
    blocked_by,
    has_vacancy,
    may_come,
    met_at,
    must_wait,
    obey,
    plan_changed,
)
from kinetile.kernel.loop.counting import count_contact
from kinetile.kernel.loop.log_rows import log, log_is_full
from kinetile.kernel.loop.passing import begin_passing, crowded, end_first_passing, plan_partings
from kinetile.kernel.loop.predictions import (
    ask_all_exactly,
    forget,
    look_at,
    meeting,
    settle,
    wall_is_before,
)
from kinetile.kernel.loop.presence import elder, is_there
from kinetile.kernel.loop.rules import answer, answer_wall, passes
from kinetile.kernel.loop.watching import holds_back
from kinetile.kernel.tables import (
    GUESS,
    NEVER,
    NOBODY,
    PARTING,
    SPARE,
    STRUCTURAL,
    WALL,
    Kernel,
)

__all__ = [
    "BLOCKED",
    "BUDGET_SPENT",
    "COMMAND_DUE",
    "CONTACTS_REACHED",
    "CROWDED",
    "FASTER",
    "FAULT",
    "LOG_FULL",
    "NO_ROOM",
    "TIME_REACHED",
    "WATCHED",
    "advance",
]

# Why the loop returned.
TIME_REACHED, CONTACTS_REACHED, BUDGET_SPENT, LOG_FULL, NO_ROOM, FAULT = range(6)
COMMAND_DUE = 6  # a body comes or goes for which the tables, or the structure, have to be laid out anew
BLOCKED = 7  # there is no room for a body that comes; the clock's fault_a and fault_b say who, and for whom

CROWDED = 8  # there is no room for more pairs that are passing through each other
FASTER = 9  # a response has made a body faster than what it reaches allows for
WATCHED = 10  # at a contact that somebody watches, before it or after

PAIRS = WALLS = COMMANDS = LIVING = RULES = PASSING = True

build = repair = replan = near = meet = collide = reach_wall = bounce = to_be_filled_in


def advance(k: Kernel, s: Any, until: int, budget: int, contacts: int, quota: int) -> int:
    """Run the events up to and at tick ``until``; return the reason for stopping.

    ``s`` is the broad phase's state, ``budget`` how many events may run, ``contacts`` how many contacts there
    may be in all, ``quota`` how many at tick ``until``: the others of that tick stay pending.
    With a budget of 0 nothing moves, not even the clock, but guesses are asked until an event is at the head.
    At the first call after ``tables.clear`` the structure is built and every body asked.
    """
    k = disowned(k)
    s = disowned(s)
    clock = k.clock[0]
    counts = k.counts[0]
    bodies = k.bodies
    queue = k.queue

    if clock.filed == 0:
        file_all(k)
    moving = budget > 0
    at = clock.now  # the tick of the head: no contact can be before it
    a = NOBODY  # the next bodies to ask all that is near them
    b = NOBODY
    replanned = False  # whether because their plans changed
    everyone = False  # whether after a all others
    body = NOBODY  # one that is to be settled, when
    count = 0  # it has looked at so many newcomers
    waiting = NOBODY  # another that is to be settled then
    if clock.built == 0:
        clock.built = 1
        note_all_places(k, at)
        clock.hand = NOBODY
        build(k, s)
        clock.offered = len(k.offers) + 1

    while True:
        while True:  # what hangs on a change of plan or of structure is asked again
            if body < 0:
                if a >= 0:
                    body = a
                    if PAIRS and (not LIVING or is_there(k, a)):
                        forget(k, a)
                        counts.asks += 1
                        count = near(k, s, a)
                    if replanned:
                        clock.hand = a
                        replan(k, s, a)
                    a = b
                    b = NOBODY
                    if everyone:
                        a = body + 1 if body + 1 < clock.bodies else NOBODY
                        everyone = a >= 0
                elif clock.offered > len(k.offers):
                    clock.offered = 0
                    replanned = False
                    everyone = clock.bodies > 0
                    a = 0 if everyone else NOBODY
                    continue
                elif clock.offered > 0:
                    clock.offered -= 1
                    body = k.offers[clock.offered].a
                    if k.offers[clock.offered].b >= 0:
                        k.near[0] = k.offers[clock.offered].b
                        count = 1
                        counts.newcomers += 1
                else:
                    break
            if count < 0 or count > len(k.near) - SPARE:
                blame(k, BAD_COUNT, body, count)
            elif PAIRS and count > 0:
                look_at(k, body, count, at)
            count = 0
            if a >= 0 and not everyone:
                waiting = body
                body = NOBODY
                continue
            while body >= 0:
                settle(k, body)
                body = waiting
                waiting = NOBODY

        if clock.fault != 0:
            return FAULT
        if clock.wanted > 0:
            return NO_ROOM
        if RULES and clock.faster != 0:
            return FASTER
        if clock.stopped != 0:
            clock.stopped = 0
            return WATCHED
        if counts.contacts_disc + counts.contacts_wall >= contacts:
            return CONTACTS_REACHED
        h = head(k)
        at = queue[h].key if h >= 0 else NEVER
        kind = queue[h].kind if h >= 0 else STRUCTURAL
        commanded = False
        if COMMANDS and clock.command < clock.commands:
            tick = k.commands[clock.command].tick
            if tick < at or (tick == at and kind >= WALL and may_come(k)):
                commanded = True
                at = tick
        # The last tick may end between two of its contacts: where a command by hand was given, or where a
        # recording stopped. Structural events and commands of that place have happened then.
        over = at > until or (h < 0 and not commanded)
        if at == until and not commanded and kind >= WALL:
            over = over or met_at(k, at) >= quota
        if over:
            if moving:
                clock.now = larger(clock.now, until)
            return TIME_REACHED
        if abs(at - clock.origin) > clock.span:  # before it, where guesses ran ahead and a body is turned
            note_all_places(k, at)

        if PAIRS and not commanded and kind != STRUCTURAL and kind != WALL and kind != PARTING:
            entry = queue[h]
            other = entry.partner
            if entry.seen != bodies[other].stamp:
                a = h
                replanned = False
                continue
            if kind == GUESS:
                counts.exact += 1
                first = elder(k, h, other)
                tick = meeting(k, first, h + other - first)
                if tick >= entry.guard and entry.guard != NEVER:
                    ask_all_exactly(k, s, h)
                    body = h
                    continue
                entry.tick = tick
                entry.exact = 1
                twin = queue[other]
                rival = smaller(entry.own, twin.key)
                if twin.partner == h and twin.kind == GUESS and twin.seen == bodies[h].stamp:
                    rival = smaller(
                        entry.own, smaller(twin.own, twin.guard)
                    )  # the same guess, seen from there
                if COMMANDS and clock.command < clock.commands:
                    rival = smaller(rival, k.commands[clock.command].tick)
                if PASSING:
                    rival = smaller(rival, smaller(k.traits[h].leave, k.traits[other].leave))
                if (
                    tick >= rival
                    or tick >= runner_up(k, h, other)
                    or tick >= until
                    or tick < clock.now
                    or budget <= 0
                    or log_is_full(k, 1)
                    or (WALLS and (wall_is_before(k, h, tick) or wall_is_before(k, other, tick)))
                ):
                    body = h
                    continue
                at = tick  # nothing comes before it: it runs at once
        if budget <= 0:
            return BUDGET_SPENT
        budget -= 1

        if kind == STRUCTURAL and not commanded:
            if at > clock.now:
                clock.now = at
                clock.spins = 0
            clock.spins += 1
            if clock.spins > clock.spin_limit:
                blame(k, STALLED, h, NOBODY)
            counts.structural += 1
            clock.hand = h
            body = h
            count = repair(k, s, h)
            counts.newcomers += count
            continue

        if log_is_full(k, 1):
            return LOG_FULL
        replanned = True
        if COMMANDS and commanded:
            command = k.commands[clock.command]
            if PASSING:
                waits = must_wait(k, command)
                if waits > 0:
                    return LOG_FULL if waits == FULL_LOG else CROWDED
            if command.code == INSERTED or command.code == REMOVED:
                if command.code == INSERTED:
                    clock.fault_a = command.body
                    clock.fault_b = blocked_by(k, command)
                    if clock.fault_b != FREE:
                        return BLOCKED
                if not LIVING or (command.code == INSERTED and not has_vacancy(k, command)):
                    return COMMAND_DUE
                replanned = False
            clock.now = larger(clock.now, at)
            a = obey(k, s)
            continue

        if holds_back(k, h, kind, at):
            clock.stopped = 0
            clock.now = larger(clock.now, at)
            return WATCHED

        if PASSING and kind == PARTING:
            clock.now = larger(clock.now, at)
            end_first_passing(k, h, at)
            body = h
            continue

        if WALLS and kind == WALL:
            if at < clock.now:
                blame(k, LATE_CONTACT, h, NOBODY)
                continue
            clock.now = at
            a = h
            bounced = bodies[a]
            wall = reach_wall(k, bounced)[1]
            anchor_at(k, bounced, at)
            depth = answer_wall(k, a, wall, at) if RULES else bounce(k, bounced, wall)
            bounced.last = NOBODY
            counts.contacts_wall += 1
            plan_changed(k, a)
            if PASSING:
                plan_partings(k, a)
            log(k, at, a, wall)
            count_contact(k, at, a, wall, depth, bounced.radius, bounced.radius)
            continue

        if PAIRS:
            a = elder(k, h, queue[h].partner)
            b = h + queue[h].partner - a
            if at < clock.now:
                blame(k, LATE_CONTACT, a, b)
                a = NOBODY
                b = NOBODY
                continue
            if PASSING and passes(k, a, b):
                if crowded(k, 1):
                    return CROWDED
                clock.now = at
                begin_passing(k, a, b, at)
                replanned = False
                continue
            clock.now = at
            one = bodies[a]
            two = bodies[b]
            anchor_at(k, one, at)
            anchor_at(k, two, at)
            depth = answer(k, a, b, at) if RULES else collide(k, a, b)
            if depth != depth:  # not a number: two centres on one place, and no line between them
                blame(k, NOT_FINITE, a, b)
                a = NOBODY
                b = NOBODY
                continue
            one.last = b
            two.last = a
            counts.contacts_disc += 1
            plan_changed(k, a)
            plan_changed(k, b)
            if PASSING:
                plan_partings(k, a)
                plan_partings(k, b)
            log(k, at, a, b)
            count_contact(k, at, a, b, depth, smaller(one.radius, two.radius), one.radius + two.radius)
