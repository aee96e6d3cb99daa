"""The main loop: take the next event, restore the proof, again (thesis, section 2).

``advance`` is a template. Its hooks, of phases and responses, and its features (``kernel.features``)
are filled in by ``kinetile.kernel.compiled.compose`` from what the scene names; what it does not name is not
compiled. The loop cannot raise. It runs until something has to be done outside and returns a reason.

After each event the head of the queue is taken again. So at a contact's tick every structural event up to and
at that tick has been restored, and which broad phase did it cannot matter (docs/one-answer.md has the rule
and its proof). A guess at the head is no event: it moves neither the clock nor a body, so when its contact is
computed exactly cannot matter either.

Each step leaves a task to ``restore``: the bodies whose entries in the queue are not true any more, and why.
All tasks go through this one place because a hook is inlined wherever it is called: a second call of
``soonest`` or ``replan`` would be the machine code of a whole broad phase again, and seconds of compilation.

Order, and why the head is the next event
=========================================

The order is total: by tick; at equal ticks chord, structural, guess, command, wall, pair, parting; in one
kind by number, and pairs by their two bodies. A beat comes after the chords and the structural events of its
tick, and before all others. The order does not depend on the history of the queue.

Let the head be a contact of a pair at tick T, exact, and its partner's plan unchanged. Let {c, d} be a near
pair, not barred, and c a body that covers it. Then its contact is at or after c's ``tick``, that is at or
after c's ``key``, that is at or after T. If it is at T, c's key is T and of kind pair: everything else of
that tick would be before the head. If c's partner is d, the order by numbers decides between the two
contacts, as it should. If it is another, e, then c's ``guard`` is at T too; a guess that became exact was
before its guard, so c was computed exactly, and of several contacts at one tick has that of the smaller
numbers: {c, e} is before {c, d}.

A guess that becomes exact at tick t *runs at once*, without being filed, if t is before everything else in
its slice of the calendar and before the slice's end, before ``own`` of both bodies, before the next command
and the end of the run, before the partner's key (or, if that is this same contact in the partner's entry,
before its ``guard``), and if neither body can be at a wall by then. By the same reasoning all other contacts,
failures and walls are later than t, with no tie. ``Simulation(..., audit=N)`` checks all of it, slowly."""

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
from kinetile.kernel.loop.commands import free_slot, may_come, met_at
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
from kinetile.kernel.loop.responses import crowded, find_leave
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

    ``s`` is the broad phase's state, ``budget`` how many events may run, ``contacts`` how many contacts there
    may be in all, ``quota`` how many at tick ``until``: the others of that tick stay pending.
    With a budget of 0 nothing moves, not even the clock, but guesses are resolved until an event is at the
    head. At the first call after ``tables.clear`` the structure is built and every body refreshed.
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
    turn = 0  # of the scout
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
        # ``at`` is before the origin where guesses ran ahead and a body is turned.
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
def run_event(k: Kernel, s: Any, h: int, kind: int, at: int) -> tuple[int, int, int, int, int]:
    """Runs what comes next at tick ``at``: returns (NO_REASON, task, body, another, newcomers) for
    ``restore``.

    Before: it is no guess, and nothing is before it. After: it has happened; or there is a reason to stop
    before it, or behind what is watched, and it is still at the head.
    """
    clock = k.clock[0]
    reason, task, a, b = NO_REASON, REFILE, h, NOBODY
    if kind == STRUCTURAL:
        return reason, task, a, b, run_structural(k, s, h, at)
    if ACCELERATIONS and kind == CHORD:
        clock.now = larger(clock.now, at)
        k.counts[0].structural += 1
        return reason, REPLAN if UNEQUAL and BOUNDS else RELAY, a, b, 0
    if log_is_full(k, 3 if RESTING else 1):
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
        task = REPLAN
    elif WALLED and kind == WALL:
        task = run_wall_contact(k, h, at)
    elif PAIRS:
        reason, task, a, b = run_contact(k, h, at)
    return reason, task, a, b, 0


@template
def note_origin(k: Kernel, tick: int) -> None:
    """Makes a tick the origin from which rows of places count."""
    note_all_places(k, tick)
    if ACCELERATIONS:
        note_all_places(with_shadows(k), tick)


@template
def start(k: Kernel, s: Any) -> None:
    """Have the broad phase build its structure, and leave all bodies to be refreshed.

    Before: the tables are clear. After: more is offered than the table of offers holds: all bodies.
    """
    clock = k.clock[0]
    clock.built = 1
    note_origin(k, clock.now)
    clock.at_work = NOBODY
    build(k, s)
    clock.lists.offered = len(k.offers) + 1


@template
def restore(k: Kernel, s: Any, task: int, a: int, b: int, newcomers: int, at: int) -> None:
    """Makes the queue true again after a step, and after all that hooks offer on the way.

    Before: every entry is true and filed but those of ``a`` and ``b`` (or NOBODY), for which ``task`` says
    what is to be done, with the first ``newcomers`` of ``k.near``, and those of bodies that are offered. No
    contact is before ``at``. After: every entry is true and filed, and nothing is offered; or there is a
    fault, or too little room for pairs. Each body goes this way::

        take --stale--> refresh --> look --the last of its task--> file, and who waits --> take
         |--newcomers alone---------> |
         |                            `--another is stale--> wait --> take
         `--nothing is left--> done

    Taken are the bodies of ``task``, then what ``next_task`` returns. After ``look`` an entry is true, and is
    filed by that once. Both bodies of a contact are refreshed before either is filed: replan of the second
    may set the certificate of the first again, which would then be moved in the calendar twice.
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
        if AHEAD and waiting >= 0:  # the memory of its ring may have come by now
            last = body
            body = waiting
            waiting = last
        while body >= 0:
            refile(k, body)
            body = waiting
            waiting = NOBODY


@template
def next_task(k: Kernel) -> tuple[int, int, int]:
    """Takes a task that hooks have left: returns (task, body, newcomers), or (NO_TASK, NOBODY, 0).

    A body that its support has freed comes first; an offer then has one newcomer, or none.
    """
    clock = k.clock[0]
    lists = clock.lists
    if RESTING and lists.freed >= 0:
        body = lists.freed
        lists.freed = k.bodies[body].freed
        return REPLAN, body, 0
    if lists.offered > len(k.offers):  # some are lost, and it is not known which
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
    """Clears what an entry says of contacts, and returns how many bodies of ``k.near`` it has to look at.

    With ``REPLAN`` the hook ``replan`` is called too, after ``near``: ``near`` may read the structure as it
    was, because a new plan does not move the body.
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
    """Returns why the loop cannot take another event, or NO_REASON.

    The order counts: after a fault nothing else in the tables can be relied on.
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
    """Returns what comes next: the head of the queue (or NOBODY), the kind and the tick.

    Before: every entry is true and filed. Of kind ``COMMANDED`` it is the next command, whatever the head is.
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
    """Writes down what comes next, of which nothing is run."""
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
            coming.kind = PASSING_BEGINS


@template
def is_over(k: Kernel, kind: int, at: int, until: int, quota: int) -> bool:
    """Whether what comes next is behind the end, which may be between two contacts of the last tick: where a
    command was given between two runs, or a recording stopped."""
    if at < until:
        return False
    return bool(at > until or at == NEVER or (kind >= WALL and met_at(k, at) >= quota))


@template
def resolve(k: Kernel, s: Any, h: int, kind: int, at: int, until: int, budget: int) -> tuple[int, int]:
    """Makes sure of the contact at the head: returns (NO_TASK, its tick) if it runs now, else (task, ``at``).

    Before: h is the head, its entry a guess or a contact, and true but for what its partner did since. After
    NO_TASK: the contact of h and its partner is exact, and no event is before it. After another task: h still
    awaits something, which may be the same contact, and is to be filed by that.
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
    if tick >= entry.guard and entry.guard != NEVER:  # another of those near h may come first
        ask_all_exactly(k, s, h, other, tick, at)
        return REFILE, at
    entry.tick = tick
    entry.exact = 1
    if comes_next(k, h, other, tick, until, budget):
        return NO_TASK, tick  # most contacts: they need not be filed to be at the head again at once
    return REFILE, at


@template
def comes_next(k: Kernel, h: int, other: int, tick: int, until: int, budget: int) -> bool:
    """Whether the contact of the head and its partner, at an exact tick, can run without being filed.

    It may say no where it could; the contact is then filed, and runs as the head.
    """
    clock = k.clock[0]
    lists = clock.lists
    entry = k.queue[h]
    twin = k.queue[other]
    rival = smaller(entry.certificate, twin.key)
    if twin.partner == h and twin.kind == GUESS and twin.seen == k.stamps[h]:
        rival = smaller(
            entry.certificate, smaller(twin.certificate, twin.guard)
        )  # the same guess, seen from there
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
        or log_is_full(k, 3 if RESTING else 1)
        or (PASSINGS and crowded(k, 1))
        or (WALLED and (wall_may_be_before(k, h, tick) or wall_may_be_before(k, other, tick)))
    )
