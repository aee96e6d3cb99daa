"""Events: the loop's actions at a structural failure, a command, a parting or a contact.

Each template runs one event at the head of the queue, at its tick. It returns the task for ``loop.restore``
and the bodies of that task. The loop has made sure that no other event is before this one.
"""

from typing import Any

from kinetile.kernel.compiled import larger, smaller, template, to_be_filled_in
from kinetile.kernel.features import (
    ACCELERATIONS,
    FOREIGN,
    LIVING,
    PASSINGS,
    PERIODIC,
    RESTING,
    RULES,
    UNEQUAL,
    WALLED,
)
from kinetile.kernel.flight import since_origin
from kinetile.kernel.images import anchor, come_together, next_to_anchor
from kinetile.kernel.log import HELD, INSERTED, MOVED, OF_KIND, REANCHORED
from kinetile.kernel.loop import BLOCKED, COMMAND_DUE, CROWDED, NO_REASON
from kinetile.kernel.loop.bookkeeping import count_contact, is_watched, log, note_meeting, stop_there
from kinetile.kernel.loop.commands import (
    NO_BLOCKER,
    blocked_by,
    brings,
    carry_out,
    caught_in,
    foresee_ledge,
    free_from,
    has_vacancy,
    must_wait,
    renew_plan,
    takes,
)
from kinetile.kernel.loop.responses import (
    answer,
    answer_wall,
    begin_passing,
    crowded,
    end_passing,
    find_leave,
    goes_through,
)
from kinetile.kernel.passings import passes
from kinetile.kernel.rest import take_hold
from kinetile.kernel.tables import (
    LATE_CONTACT,
    NOBODY,
    NOT_FINITE,
    PAIR,
    PARTING,
    STALLED,
    WALL,
    Kernel,
    blame,
    elder,
)

repair = collide = reach_wall = bounce = to_be_filled_in

NO_TASK, REFILE, RELAY, REFRESH, REPLAN, REFRESH_ALL = range(6)
"""Tasks that a step leaves to ``restore``, for one body or two:

``REFILE``: predict its contacts with newcomers, if any, and file it by the event that it awaits now;
``RELAY``: the same, after the broad phase has replanned it, because its chord has ended;
``REFRESH``: predict its contacts with all near bodies again;
``REPLAN``: the same, and the broad phase replans it;
``REFRESH_ALL``: as ``REFRESH``, for all bodies."""


@template
def run_structural(k: Kernel, s: Any, h: int, at: int) -> int:
    """Runs a structural event: the broad phase repairs its structure. Returns the number of newcomers in
    ``k.near``.

    Before: the structural certificate of h fails at ``at``. After: h has another certificate, and is to be
    filed. Between two such events neither time has to pass nor a contact to happen. So a broad phase that
    repairs nothing would never end: more than ``spin_limit`` of them are a fault.
    """
    clock = k.clock[0]
    jam = clock.jam
    if at > clock.now:
        clock.now = at
        jam.spins = 0
    jam.spins += 1
    if jam.spins > jam.spin_limit:
        blame(k, STALLED, h, NOBODY)
    k.counts[0].structural += 1
    clock.at_work = h
    count = repair(k, s, h)
    k.counts[0].newcomers += count
    return int(count)


@template
def run_command(k: Kernel, s: Any, at: int) -> tuple[int, int, int]:
    """Carries out the next command, or returns the reason to wait: (reason, task, body).

    With a reason no body has changed, and the command is still the next one.
    """
    clock = k.clock[0]
    command = k.commands[clock.lists.command]
    if PASSINGS or RESTING:
        reason = must_wait(k, command)
        if reason != NO_REASON:
            return reason, NO_TASK, NOBODY
    task = REPLAN
    blocker = NO_BLOCKER
    if (command.code == INSERTED and command.has_room == 0) or command.code == MOVED:
        blocker = blocked_by(k, command)
    if PASSINGS and command.code == OF_KIND:
        blocker = caught_in(k, command)
    if blocker != NO_BLOCKER:
        clock.fault.a = command.body
        clock.fault.b = blocker
        clock.now = larger(clock.now, at)  # else the time of the refusal would depend on the phase
        return BLOCKED, NO_TASK, NOBODY
    if brings(command.code) or takes(command.code):
        if not LIVING or (command.code == INSERTED and not has_vacancy(k, command)):
            return COMMAND_DUE, NO_TASK, NOBODY
        task = REFRESH  # enter and leave have updated the structure
    clock.now = larger(clock.now, at)
    return NO_REASON, task, carry_out(k, s)


@template
def anchor_next(k: Kernel, at: int) -> tuple[int, int]:
    """Anchors the next plan that is old at this beat; returns the task and the body, or NOBODY."""
    body = next_to_anchor(k)
    if body < 0:
        return NO_TASK, NOBODY
    k.clock[0].now = larger(k.clock[0].now, at)
    anchor(k, body, at)
    k.bodies[body].last = NOBODY
    foresee_ledge(k, body)
    renew_plan(k, body)
    log(k, at, body, REANCHORED)
    return REPLAN, body


@template
def holds_back(k: Kernel, h: int, kind: int, at: int) -> bool:
    """Returns True if the loop stops before the contact at the head because it is watched. The contact stays
    filed, although ``loop.resolve`` may have computed it exactly without filing it. The loop stops only once:
    when the run continues, the contact happens, unless commands have changed that."""
    clock = k.clock[0]
    stops = clock.stops
    if stops.watching == 0 or stops.before == 0:
        return False
    if RESTING and kind == WALL and leaves_support(k, h):
        return False
    a = h
    b = NOBODY
    if WALLED and kind == WALL:
        b = reach_wall(k, k.bodies[h])[1]
    elif PASSINGS and kind == PARTING:
        pair = find_leave(k, h)
        a = k.passings[pair].b
        b = k.passings[pair].a
    else:
        a = elder(k, h, k.queue[h].partner)
        b = h + k.queue[h].partner - a
    if not is_watched(k, a, b):
        return False
    two = k.queue[b].number if b >= 0 else b
    if stops.tick == at and stops.a == k.queue[a].number and stops.b == two:
        return False
    stop_there(k, at, a, b)
    if PASSINGS and kind == PAIR:
        stops.passes = int(passes(k, a, b) and goes_through(k, a, b, h, at))
    clock.now = larger(clock.now, at)
    return True


@template
def leaves_support(k: Kernel, h: int) -> bool:
    """Returns True if a body that awaits a wall, or to leave its support, leaves the support first."""
    return bool(k.bodies[h].ledge < reach_wall(k, k.bodies[h])[0])


@template
def run_wall_contact(k: Kernel, h: int, at: int) -> int:
    """Runs the contact of the head with a wall; returns the task for the body.

    Before: the body is at a wall at ``at``, and nothing is before that. After: it has its plan from ``at``
    on, and the contact is logged and counted.
    """
    clock = k.clock[0]
    if at < clock.now:
        blame(k, LATE_CONTACT, h, NOBODY)
        return NO_TASK
    clock.now = at
    body = k.bodies[h]
    wall = reach_wall(k, body)[1]
    anchor(k, h, at)
    note_meeting(k, h, wall)
    depth = answer_wall(k, h, wall, at) if RULES or ACCELERATIONS else bounce(k, body, wall)
    if FOREIGN and clock.fault.code != 0:
        return NO_TASK
    body.last = NOBODY
    k.counts[0].contacts_wall += 1
    changed = take_hold(k, h)
    foresee_ledge(k, h)
    renew_plan(k, h)
    log(k, at, h, wall)
    if RESTING and changed:
        log(k, at, h, HELD)
    free_from(k, h, at)
    count_contact(k, at, h, wall, depth, body.radius, body.radius)
    return REPLAN


@template
def put_back(k: Kernel, body: int) -> None:
    """Restores a body's velocity before a contact that cannot be resolved; nearly, if accelerated."""
    before = k.places[body]
    plan = k.bodies[body]
    plan.vx = before.vx
    plan.vy = before.vy
    if ACCELERATIONS:
        since = since_origin(k, plan.anchor)
        plan.vx += plan.ax * since
        plan.vy += plan.ay * since


@template
def run_parting(k: Kernel, h: int, at: int) -> tuple[int, int]:
    """Ends the passing whose end the head awaits; returns the task, and the other body or NOBODY."""
    k.clock[0].now = larger(k.clock[0].now, at)
    pair = find_leave(k, h)
    other = k.passings[pair].b
    end_passing(k, pair, at)
    find_leave(k, h)
    if UNEQUAL:  # they may meet again by the same plans
        return REFRESH, other
    return REFILE, NOBODY


@template
def run_contact(k: Kernel, h: int, at: int) -> tuple[int, int, int, int]:
    """Runs the contact of the head with its partner; returns (reason, task, the elder, the younger).

    Before: they touch at ``at`` exactly, and nothing is before that. After: both have their plans from ``at``
    on, or have begun to pass through each other, and this is logged and counted. With a reason (CROWDED)
    nothing has changed.
    """
    clock = k.clock[0]
    a = elder(k, h, k.queue[h].partner)
    b = h + k.queue[h].partner - a
    if at < clock.now:
        blame(k, LATE_CONTACT, a, b)
        return NO_REASON, NO_TASK, NOBODY, NOBODY
    if PASSINGS and passes(k, a, b) and goes_through(k, a, b, h, at):
        if crowded(k, 1):
            return CROWDED, NO_TASK, NOBODY, NOBODY
        clock.now = at
        begin_passing(k, a, b, at, k.images[h].m if PERIODIC else 0, k.images[h].n if PERIODIC else 0)
        return NO_REASON, REFRESH, a, b
    clock.now = at
    one = k.bodies[a]
    two = k.bodies[b]
    anchor(k, a, at)
    anchor(k, b, at)
    come_together(k, a, b, h)
    note_meeting(k, a, b)
    depth = answer(k, a, b, at) if RULES or UNEQUAL else collide(k, a, b)
    if FOREIGN and clock.fault.code != 0:  # after the response they still close in
        return NO_REASON, NO_TASK, NOBODY, NOBODY
    if depth != depth:  # not a number: the centres coincide, so no line joins them
        blame(k, NOT_FINITE, a, b)
        put_back(k, a)
        put_back(k, b)
        return NO_REASON, NO_TASK, NOBODY, NOBODY
    one.last = b
    two.last = a
    k.counts[0].contacts_disc += 1
    one_changed = take_hold(k, a)
    two_changed = take_hold(k, b)
    foresee_ledge(k, a)
    foresee_ledge(k, b)
    renew_plan(k, a)
    renew_plan(k, b)
    log(k, at, a, b)
    if RESTING and one_changed:
        log(k, at, a, HELD)
    if RESTING and two_changed:
        log(k, at, b, HELD)
    count_contact(k, at, a, b, depth, smaller(one.radius, two.radius), one.radius + two.radius)
    return NO_REASON, REPLAN, a, b
