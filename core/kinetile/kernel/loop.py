"""The main loop: take the next event, restore the proof, again (thesis, section 2).

``advance`` is a template. Its hooks (``build``, ``repair``, ``replan`` of the broad phase; ``meet``,
``collide`` of the narrow phase for pairs; ``reach_wall``, ``bounce`` of the one for walls) and its constants
(``PAIRS``, ``WALLS``, ``TURNS``) are filled in by
``kinetile.kernel.compiled.compose`` from what the scene names; what it does not name is not compiled.

Of one tick, structural events run first, then turns, then contacts with walls, then contacts of pairs, and
after each of them the head of the queue is taken anew. So at a contact's tick every structural event up to
and at that tick has been restored, and which broad phase did it cannot matter: a contact's time is a function
of the two flight plans alone, and the broad phase sees bodies fattened by a skin wide enough for all rounding
(docs/one-answer.md has the rule and its proof).

The loop cannot raise. It runs until something has to be done outside and returns a reason.
"""

from __future__ import annotations

from typing import Any

from kinetile.kernel.compiled import disowned, hook, to_be_filled_in
from kinetile.kernel.faults import JAMMED, LATE_CONTACT, NOT_FINITE, STALLED, TOO_DEEP, blame
from kinetile.kernel.flight import anchor_at
from kinetile.kernel.log import TURNED
from kinetile.kernel.queue import schedule
from kinetile.kernel.tables import NEVER, NOBODY, Kernel

__all__ = [
    "BUDGET_SPENT",
    "CONTACTS_REACHED",
    "FAULT",
    "LOG_FULL",
    "NO_ROOM",
    "TIME_REACHED",
    "advance",
]

# Why the loop returned.
TIME_REACHED, CONTACTS_REACHED, BUDGET_SPENT, LOG_FULL, NO_ROOM, FAULT = range(6)

PAIRS = WALLS = TURNS = True


build = repair = replan = meet = collide = reach_wall = bounce = to_be_filled_in


@hook
def _write(k: Kernel, tick: int, a: int, b: int) -> None:
    """Log an event: body a's anchor, and b's where b is a body."""
    clock = k.clock[0]
    row = k.log[clock.logged]
    clock.logged += 1
    row.tick = tick
    row.a = a
    row.b = b
    one = k.bodies[a]
    row.ax = one.x
    row.ay = one.y
    row.avx = one.vx
    row.avy = one.vy
    if b >= 0:
        two = k.bodies[b]
        row.bx = two.x
        row.by = two.y
        row.bvx = two.vx
        row.bvy = two.vy


@hook
def _count_contact(k: Kernel, tick: int, a: int, b: int, depth: float, radius: float, slack: float) -> None:
    """Keep the readings of a contact and look for jams and for overlaps that rounding does not explain."""
    clock = k.clock[0]
    counts = k.counts[0]
    counts.pairs_sum += clock.pairs
    counts.deepest = max(counts.deepest, depth / radius)
    if not depth <= clock.tolerance + 1e-9 * slack:
        blame(k, TOO_DEEP if depth > 0.0 else NOT_FINITE, a, b)
    clock.spins = 0
    clock.window += 1
    if clock.window >= clock.window_size:
        if tick - clock.window_tick <= clock.window_ticks:
            blame(k, JAMMED, a, b)
        clock.window = 0
        clock.window_tick = tick


def advance(k: Kernel, s: Any, until: int, budget: int, contacts: int) -> int:
    """Run the events up to and at tick ``until``; return the reason for stopping.

    ``s`` is the broad phase's state, ``budget`` how many events may run, ``contacts`` how many contacts. At
    the first call after ``tables.clear`` the broad phase's certificates are built.
    """
    k = disowned(k)
    s = disowned(s)
    clock = k.clock[0]
    counts = k.counts[0]
    bodies = k.bodies
    table = k.certificates
    queue = k.queue
    turn_certificate = clock.structural
    first_wall = turn_certificate + 1
    first_pair = first_wall + clock.bodies

    if clock.built == 0:
        clock.built = 1
        build(k, s)
        if WALLS:
            for body in range(clock.bodies):
                schedule(k, first_wall + body, reach_wall(k, bodies[body])[0])
    if TURNS and clock.turn < clock.turns:
        schedule(k, turn_certificate, k.turns[clock.turn].tick)

    a = NOBODY
    b = NOBODY
    while True:
        while a >= 0:  # a flight plan changed: the certificates that hang on it are asked again
            replan(k, s, a)
            if WALLS:
                schedule(k, first_wall + a, reach_wall(k, bodies[a])[0])
            if PAIRS:
                pair = bodies[a].first
                while pair >= 0:
                    record = table[pair]
                    tick = NEVER
                    if bodies[record.a].last != record.b or bodies[record.b].last != record.a:
                        tick = meet(k, record.a, record.b)
                    schedule(k, pair, tick)
                    pair = record.next_a if record.a == a else record.next_b
            a = b
            b = NOBODY
        if PAIRS:
            while clock.fresh > 0:
                clock.fresh -= 1
                new = k.fresh[clock.fresh]
                record = table[new]
                if record.a >= 0 and not (
                    bodies[record.a].last == record.b and bodies[record.b].last == record.a
                ):
                    schedule(k, new, meet(k, record.a, record.b))

        if clock.fault != 0:
            return FAULT
        if clock.wanted > 0:
            return NO_ROOM
        if counts.contacts_disc + counts.contacts_wall >= contacts:
            return CONTACTS_REACHED
        if clock.queued == 0 or queue[0].tick > until:
            clock.now = max(clock.now, until)
            return TIME_REACHED
        if budget <= 0:
            return BUDGET_SPENT
        budget -= 1
        tick = queue[0].tick
        certificate = queue[0].certificate

        if certificate < turn_certificate:
            if tick > clock.now:
                clock.now = tick
                clock.spins = 0
            clock.spins += 1
            if clock.spins > clock.spin_limit:
                blame(k, STALLED, certificate, NOBODY)
            counts.structural += 1
            repair(k, s, certificate)
            continue

        if clock.logged >= len(k.log):
            return LOG_FULL
        if TURNS and certificate == turn_certificate:
            turn = k.turns[clock.turn]
            clock.turn += 1
            if clock.turn < clock.turns:
                schedule(k, turn_certificate, k.turns[clock.turn].tick)
            else:
                schedule(k, turn_certificate, NEVER)
            clock.now = max(clock.now, tick)
            a = turn.body
            body = bodies[a]
            anchor_at(k, body, tick)
            if turn.code == TURNED:
                counts.turns += 1
                gained = turn.vx * turn.vx + turn.vy * turn.vy - (body.vx * body.vx + body.vy * body.vy)
                counts.turned_energy += 0.5 * k.mass[a] * gained
                body.vx = turn.vx
                body.vy = turn.vy
            body.last = NOBODY
            _write(k, tick, a, turn.code)
            continue

        if WALLS and certificate < first_pair:
            a = certificate - first_wall
            if tick < clock.now:
                blame(k, LATE_CONTACT, a, NOBODY)
                a = NOBODY
                continue
            clock.now = tick
            body = bodies[a]
            wall = reach_wall(k, body)[1]
            anchor_at(k, body, tick)
            depth = bounce(k, body, wall)
            body.last = NOBODY
            counts.contacts_wall += 1
            _write(k, tick, a, wall)
            _count_contact(k, tick, a, wall, depth, body.radius, body.radius)
            continue

        if PAIRS:
            a = table[certificate].a
            b = table[certificate].b
            if tick < clock.now:
                blame(k, LATE_CONTACT, a, b)
                a = NOBODY
                b = NOBODY
                continue
            clock.now = tick
            one = bodies[a]
            two = bodies[b]
            anchor_at(k, one, tick)
            anchor_at(k, two, tick)
            depth = collide(k, a, b)
            one.last = b
            two.last = a
            counts.contacts_disc += 1
            _write(k, tick, a, b)
            _count_contact(k, tick, a, b, depth, min(one.radius, two.radius), one.radius + two.radius)
