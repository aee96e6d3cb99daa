"""The main loop: take the next event, restore the proof, repeat (thesis, section 2).

``advance`` is a template. ``kinetile.kernel.compiled.compose`` fills in its hooks, from phases and responses,
and its features (``kernel.features``), as the scene names them; nothing else is compiled. The loop cannot
raise. It runs until the caller has to act, and returns the reason.

The loop takes the head of the queue again after each event. So when a contact runs, every structural event up
to and at its tick has run, and the choice of the broad phase cannot matter (docs/one-answer.md has the rule
and its proof). A guess at the head is not an event: it moves neither the clock nor a body, so the moment of
its exact computation cannot matter either.

Each step leaves a task to ``restore``: the bodies whose entries in the queue are no longer true, and the
reason. All tasks go through this one place because a hook is inlined wherever it is called: a second call of
``soonest`` or ``replan`` would add the machine code of a whole broad phase, and seconds of compilation.

Order, and why the head is the next event
=========================================

The order is total: by tick; at equal ticks chord, structural, guess, command, wall, pair, parting; within one
kind by number, and pairs by their two numbers. A beat comes after the chords and the structural events of its
tick, and before all others. The order does not depend on the history of the queue.

Let the head be an exact contact of a pair at tick T, and let its partner's plan be unchanged. Let {c, d} be a
near pair that is not barred, and let c cover it (``predictions``). Then the contact of {c, d} is at or after
c's ``tick``, which is at or after c's ``key``, which is at or after T. If the contact is at T, c's key is T
and its kind is pair: everything else of that tick would be before the head. If c's partner is d, the order by
numbers decides between the two contacts, as required. If c's partner is another body e, c's ``guard`` is at T
too. A guess that became exact was before its guard, so c was computed exactly. If several of its contacts are
at one tick, c has the one with the smaller numbers: {c, e} is before {c, d}.

A guess that becomes exact at tick t *runs at once*, without being filed, if t is before everything else in
its slice of the calendar and before the slice's end, before the ``certificate`` of both bodies and the end of
their chords and passings, before the next command, the next beat and the end of the run, before the partner's
key (or, if that key is this same contact, before the partner's ``guard``), if neither body can be at a wall
by then, and if there is room in the log (``comes_next``). By the same reasoning all other contacts, failures
and walls are strictly later than t. ``Simulation(..., audit=N)`` checks this, slowly."""

from typing import Any

from kinetile.kernel.compiled import disowned, larger, smaller, template, to_be_filled_in, with_shadows
from kinetile.kernel.features import (
    ACCELERATIONS,
    AHEAD,
    BOUNDS,
    COMMANDS,
    LIVING,
    PAIRS,
    PASSINGS,
    PERIODIC,
    RESTING,
    RULES,
    UNEQUAL,
    WALLED,
)
from kinetile.kernel.flight import note_all_places
from kinetile.kernel.images import await_through
from kinetile.kernel.loop import (
    BUDGET_SPENT,
    CONTACTS_REACHED,
    FASTER,
    FAULT,
    LOG_FULL,
    NO_REASON,
    NO_ROOM,
    TIME_REACHED,
    WATCHED,
)
from kinetile.kernel.loop.ahead import fetch_ring, fetch_two, look_ahead
from kinetile.kernel.loop.bookkeeping import log_is_full
from kinetile.kernel.loop.calendar import file_all, forget, head, refile, runner_up, wall_may_be_before
from kinetile.kernel.loop.commands import free_from, free_slot, may_come, met_at, rows_to_free
from kinetile.kernel.loop.events import (
    NO_TASK,
    REFILE,
    REFRESH,
    REFRESH_ALL,
    RELAY,
    REPLAN,
    anchor_next,
    holds_back,
    leaves_support,
    run_command,
    run_contact,
    run_parting,
    run_structural,
    run_wall_contact,
)
from kinetile.kernel.loop.predictions import ask_all_exactly, look_at, meeting
from kinetile.kernel.loop.responses import crowded, find_leave, goes_through
from kinetile.kernel.passings import passes
from kinetile.kernel.tables import (
    BEAT_DUE,
    CHORD,
    COMMANDED,
    GUESS,
    NEVER,
    NOBODY,
    PAIR,
    PARTING,
    PASSING_BEGINS,
    STRUCTURAL,
    WALL,
    Kernel,
    elder,
    is_there,
)

build = replan = near = to_be_filled_in


def advance(k: Kernel, s: Any, until: int, budget: int, contacts: int, quota: int) -> int:
    """Runs the events up to and at tick ``until``; returns the reason for stopping.

    ``s`` is the broad phase's state, ``budget`` the number of events that may run, ``contacts`` the number of
    contacts allowed in all, ``quota`` the number allowed at tick ``until``: the others of that tick stay
    pending. With a budget of 0 nothing moves, not even the clock, but guesses are resolved until an event is
    at the head. The first call after ``tables.clear`` builds the structure and refreshes every body.
    """
    k = disowned(k)
    s = disowned(s)
    clock = k.clock[0]
    if clock.calendar.filed == 0:
        file_all(k)
    if clock.built == 0:
        start(k, s)
    moving = budget > 0
    at = clock.now  # the tick of the head: no contact can be before it
    seen = scout = clock.calendar.slice
    turn = 0  # the number of bodies that the scout has found
    task, a, b, newcomers = NO_TASK, NOBODY, NOBODY, 0

    while True:
        restore(k, s, task, a, b, newcomers, at)
        reason = must_return(k, contacts)
        if reason != NO_REASON:
            return reason

        h, kind, at = next_event(k)
        if AHEAD:
            seen, scout, turn = look_ahead(k, s, seen, scout, turn)
        if is_over(k, kind, at, until, quota):
            if moving:
                clock.now = larger(clock.now, until)
            return TIME_REACHED
        # ``at`` is before the origin if a body is turned after guesses ran ahead.
        if abs(at - clock.origin) > clock.limits.span:
            note_origin(k, at)

        task, a, b, newcomers = NO_TASK, h, NOBODY, 0
        if PAIRS and (kind == GUESS or kind == PAIR):  # noqa: SIM109 - compared without making a tuple
            task, at = resolve(k, s, h, kind, at, until, budget)
            if task != NO_TASK:
                continue
        if budget <= 0:
            note_next(k, h, kind, at)
            return BUDGET_SPENT
        budget -= 1
        reason, task, a, b, newcomers = run_event(k, s, h, kind, at)
        if reason != NO_REASON:
            return reason


@template
def most_rows(k: Kernel, a: int, b: int) -> int:
    """Returns the largest number of rows of the log that an event of one body or two takes."""
    if RESTING:
        return 3 + rows_to_free(k, a, b)
    return 1


@template
def run_event(k: Kernel, s: Any, h: int, kind: int, at: int) -> tuple[int, int, int, int, int]:
    """Runs the next event, at tick ``at``; returns (NO_REASON, task, body, another, newcomers) for
    ``restore``.

    Before: the event is not a guess, and nothing is before it. After: the event has happened; or there is a
    reason to stop before it, or after a watched contact, and the event is still at the head.
    """
    clock = k.clock[0]
    reason, task, a, b = NO_REASON, REFILE, h, NOBODY
    if kind == STRUCTURAL:
        return reason, task, a, b, run_structural(k, s, h, at)
    if ACCELERATIONS and kind == CHORD:
        clock.now = larger(clock.now, at)
        k.counts[0].structural += 1
        return reason, REPLAN if UNEQUAL and BOUNDS else RELAY, a, b, 0
    if log_is_full(k, most_rows(k, h, k.queue[h].partner if kind == PAIR else NOBODY)):
        return LOG_FULL, task, a, b, 0
    if PERIODIC and kind == BEAT_DUE:
        task, a = anchor_next(k, at)
    elif COMMANDS and kind == COMMANDED:
        reason, task, a = run_command(k, s, at)
    elif holds_back(k, h, kind, at):
        pass
    elif PASSINGS and kind == PARTING:
        task, b = run_parting(k, h, at)
    elif RESTING and kind == WALL and leaves_support(k, h):
        clock.now = larger(clock.now, at)
        k.counts[0].structural += 1
        free_slot(k, h, at)
        free_from(k, h, at)
        task = REPLAN
    elif WALLED and kind == WALL:
        task = run_wall_contact(k, h, at)
    elif PAIRS:
        reason, task, a, b = run_contact(k, h, at)
    return reason, task, a, b, 0


@template
def note_origin(k: Kernel, tick: int) -> None:
    """Makes a tick the origin of the rows of places."""
    note_all_places(k, tick)
    if ACCELERATIONS:
        note_all_places(with_shadows(k), tick)


@template
def start(k: Kernel, s: Any) -> None:
    """Has the broad phase build its structure; leaves all bodies to be refreshed.

    Before: the tables are clear. After: the count of offers exceeds their table: this means all bodies.
    """
    clock = k.clock[0]
    clock.built = 1
    note_origin(k, clock.now)
    clock.at_work = NOBODY
    build(k, s)
    clock.lists.offered = len(k.offers) + 1


@template
def restore(k: Kernel, s: Any, task: int, a: int, b: int, newcomers: int, at: int) -> None:
    """Makes the queue true again after a step, and after all offers that hooks leave meanwhile.

    Before: every entry is true and filed, except the entries of ``a`` and ``b`` (or NOBODY), for which
    ``task`` and the first ``newcomers`` of ``k.near`` remain, and the entries of bodies that are offered. No
    contact is before ``at``. After: every entry is true and filed, and no offer is left; or there is a fault,
    or too little room for pairs. Each body takes this path::

        take --stale--> refresh --> look --the last of its task--> file it and the waiting one --> take
         |--newcomers alone---------> |
         |                            `--another is stale--> wait --> take
         `--nothing is left--> done

    The bodies of ``task`` are taken first, then those from ``next_task``. After ``look`` an entry is true,
    and is filed once. Both bodies of a contact are refreshed before either is filed: ``replan`` of the second
    may set the certificate of the first again, and the first would then move in the calendar twice.
    """
    body = waiting = NOBODY
    if task == NO_TASK:
        a = NOBODY
    while True:
        if a < 0:
            task, a, newcomers = next_task(k)
            if a < 0:
                return
        body = a
        count = newcomers if task == REFILE else refresh(k, s, body, task)
        if PAIRS and count > 0:
            look_at(k, body, count, at)
        fetch_ring(k, body)
        a = b
        b = NOBODY
        if task == REFRESH_ALL:
            a = body + 1 if body + 1 < k.clock[0].bodies else NOBODY
        elif a >= 0:
            waiting = body
            continue
        if AHEAD and waiting >= 0:  # its ring may have been loaded by now
            last = body
            body = waiting
            waiting = last
        while body >= 0:
            refile(k, body)
            body = waiting
            waiting = NOBODY


@template
def next_task(k: Kernel) -> tuple[int, int, int]:
    """Takes a task that hooks have left; returns (task, body, newcomers), or (NO_TASK, NOBODY, 0).

    Bodies that their support has freed come first, then offers. An offer has one newcomer or no newcomer.
    """
    clock = k.clock[0]
    lists = clock.lists
    if RESTING and lists.freed >= 0:
        body = lists.freed
        lists.freed = k.bodies[body].freed
        return REPLAN, body, 0
    if lists.offered > len(k.offers):  # some offers are lost, and it is unknown which
        lists.offered = 0
        return REFRESH_ALL, 0 if clock.bodies > 0 else NOBODY, 0
    if lists.offered == 0:
        return NO_TASK, NOBODY, 0
    lists.offered -= 1
    offer = k.offers[lists.offered]
    if offer.b < 0:
        return REFILE, offer.a, 0
    k.near[0] = offer.b
    k.counts[0].newcomers += 1
    return REFILE, offer.a, 1


@template
def refresh(k: Kernel, s: Any, body: int, task: int) -> int:
    """Clears the contacts of an entry; returns the number of bodies in ``k.near`` to predict contacts with.

    With ``REPLAN`` it calls the hook ``replan`` too, after ``near``: ``near`` may read the old structure,
    because a new plan does not move the body.
    """
    count = 0
    if PAIRS and (not ACCELERATIONS or task != RELAY) and (not LIVING or is_there(k, body)):
        forget(k, body)
        k.counts[0].asks += 1
        count = near(k, s, body)
    if task == REPLAN or (ACCELERATIONS and task == RELAY):
        k.clock[0].at_work = body
        replan(k, s, body)
    return count


@template
def must_return(k: Kernel, contacts: int) -> int:
    """Returns the reason that stops the loop now, or NO_REASON.

    The order of the tests matters: after a fault nothing else in the tables is reliable.
    """
    clock = k.clock[0]
    counts = k.counts[0]
    stops = clock.stops
    if clock.fault.code != 0:
        return FAULT
    if clock.lists.wanted > 0:
        return NO_ROOM
    if (RULES or ACCELERATIONS) and clock.limits.faster != 0:
        return FASTER
    if stops.due != 0:
        stops.due = 0
        return WATCHED
    if counts.contacts_disc + counts.contacts_wall >= contacts:
        return CONTACTS_REACHED
    return NO_REASON


@template
def next_event(k: Kernel) -> tuple[int, int, int]:
    """Returns the next event: the head of the queue (or NOBODY), the kind and the tick.

    Before: every entry is true and filed. ``COMMANDED`` means the next command, whatever the head is.
    """
    lists = k.clock[0].lists
    h = head(k)
    kind = k.queue[h].kind if h >= 0 else STRUCTURAL
    at = k.queue[h].key if h >= 0 else NEVER
    if COMMANDS and lists.command < lists.commands:
        tick = k.commands[lists.command].tick
        if tick < at or (tick == at and kind >= WALL and may_come(k)):
            kind = COMMANDED
            at = tick
    if PERIODIC:
        beat = k.clock[0].torus.beat
        if beat < at or (beat == at and kind > STRUCTURAL):
            return h, BEAT_DUE, beat
    return h, kind, at


@template
def note_next(k: Kernel, h: int, kind: int, at: int) -> None:
    """Writes the next event to the clock, without running anything."""
    coming = k.clock[0].next
    coming.tick = at
    coming.kind = kind
    coming.b = NOBODY
    if COMMANDS and kind == COMMANDED:
        command = k.commands[k.clock[0].lists.command]
        coming.kind = command.code
        coming.a = command.body
    elif kind >= STRUCTURAL or (ACCELERATIONS and kind == CHORD):
        coming.kind = larger(kind, STRUCTURAL)
        if RESTING and kind == WALL and leaves_support(k, h):
            coming.kind = STRUCTURAL
        coming.a = k.queue[h].number
        other = k.queue[h].partner
        if PASSINGS and kind == PARTING:
            other = k.passings[find_leave(k, h)].b
        if kind >= PAIR:
            coming.b = k.queue[other].number
        if PASSINGS and kind == PAIR and passes(k, h, other):
            first = elder(k, h, other)
            if goes_through(k, first, h + other - first, h, at):
                coming.kind = PASSING_BEGINS


@template
def is_over(k: Kernel, kind: int, at: int, until: int, quota: int) -> bool:
    """Returns True if the next event is after the end of the run. The end may be between two contacts of the
    last tick, if a command was given there between two runs, or a recording stopped there."""
    if at < until:
        return False
    return bool(at > until or at == NEVER or (kind >= WALL and met_at(k, at) >= quota))


@template
def resolve(k: Kernel, s: Any, h: int, kind: int, at: int, until: int, budget: int) -> tuple[int, int]:
    """Verifies the contact at the head; returns (NO_TASK, its tick) if it runs now, else (task, ``at``).

    Before: h is the head; its entry is a guess or a contact, and true unless its partner's plan has changed.
    After NO_TASK: the contact of h and its partner is exact, and no event is before it. After another task: h
    is still to be filed, by the event that it awaits then, which may be the same contact.
    """
    entry = k.queue[h]
    other = entry.partner
    fetch_two(k, s, h, other)
    if entry.seen != k.stamps[other]:
        return REFRESH, at
    if kind != GUESS:
        return NO_TASK, at
    k.counts[0].exact += 1
    first = elder(k, h, other)
    k.clock[0].contact_guess = entry.tick
    tick = meeting(k, first, h + other - first)
    k.clock[0].contact_guess = NEVER
    await_through(k, h)
    if tick >= entry.guard and entry.guard != NEVER:  # another body near h may come first
        ask_all_exactly(k, s, h, other, tick, at)
        return REFILE, at
    entry.tick = tick
    entry.exact = 1
    if comes_next(k, h, other, tick, until, budget):
        return NO_TASK, tick  # most contacts: filed, they would be at the head again at once
    return REFILE, at


@template
def comes_next(k: Kernel, h: int, other: int, tick: int, until: int, budget: int) -> bool:
    """Returns True if the contact of the head and its partner, at an exact tick, can run without being filed.

    False is always safe: the contact is then filed, and runs as the head.
    """
    clock = k.clock[0]
    lists = clock.lists
    entry = k.queue[h]
    twin = k.queue[other]
    rival = smaller(entry.certificate, twin.key)
    if twin.partner == h and twin.kind == GUESS and twin.seen == k.stamps[h]:
        rival = smaller(
            entry.certificate, smaller(twin.certificate, twin.guard)
        )  # the same guess in the partner's entry
    if COMMANDS and lists.command < lists.commands:
        rival = smaller(rival, k.commands[lists.command].tick)
    if PERIODIC:
        rival = smaller(rival, clock.torus.beat)
    if ACCELERATIONS:
        rival = smaller(rival, smaller(k.bodies[h].end, k.bodies[other].end))
    if PASSINGS:
        rival = smaller(rival, smaller(k.traits[h].leave, k.traits[other].leave))
    return not (
        tick >= smaller(smaller(rival, until), runner_up(k, h, other))
        or budget <= 0
        or log_is_full(k, most_rows(k, h, other))
        or (PASSINGS and crowded(k, 1))
        or (WALLED and (wall_may_be_before(k, h, tick) or wall_may_be_before(k, other, tick)))
    )
