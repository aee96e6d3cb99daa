"""Commands: changes from outside, each at its own tick, in the order of the calls.

A command turns, accelerates, moves, inserts or removes a body, or gives it another kind. The clock also
anchors old plans again, which moves no body. Commands run after the structural events of their tick and
before its contacts: a body is inserted into a structure that is in order, and a removed body has left the
structure before the next contact is computed. A command given at a stop between two contacts of one tick
stores the number of contacts before it (``after``), so that a repeated run carries it out at the same place.

A moved body is removed and inserted again in one step, with its number, velocity, size and kind, as if it had
met no other body yet.

An inserted body must have room: it may touch others and the walls of the arena, and overlap them by no more
than rounding explains (``ROOM`` of the radii). Otherwise the command is refused, and nothing has changed.
Another kind is refused, too, for a body that is passing through one that it would then meet (rule 11k).
"""

import math
from typing import Any

from kinetile.kernel.chords import lay, span_of
from kinetile.kernel.compiled import disowned, hook, larger, template, to_be_filled_in
from kinetile.kernel.features import (
    ACCELERATIONS,
    LIVING,
    PASSINGS,
    PERIODIC,
    RESTING,
    RULES,
    SHAPES,
    WALLED,
    only_with,
)
from kinetile.kernel.flight import (
    note_place,
    position_after,
    position_at,
    since_origin,
    square_of_speed,
    twice_energy,
)
from kinetile.kernel.images import anchor, near_zero, plan_of, restore_plan, wrap
from kinetile.kernel.log import (
    ACCELERATED,
    BOTTOM,
    HELD,
    INSERTED,
    LEFT,
    MOVED,
    OF_KIND,
    REANCHORED,
    REMOVED,
    RIGHT,
    TOP,
    TURNED,
)
from kinetile.kernel.loop import CROWDED, LOG_FULL, NO_REASON
from kinetile.kernel.loop.bookkeeping import log, log_is_full
from kinetile.kernel.loop.calendar import forget, move, refile
from kinetile.kernel.loop.responses import (
    ROOM,
    begin_with_all,
    crowded,
    end_all_passings,
    plan_partings,
    shapes_overlap,
)
from kinetile.kernel.pairs import follower
from kinetile.kernel.passings import MOST_IMAGES, lets_pass, row_of
from kinetile.kernel.rest import hangs, is_held_by, let_go, take_hold
from kinetile.kernel.tables import (
    LONG_AGO,
    NEVER,
    NOBODY,
    NOT_ASKED,
    Kernel,
    Records,
    elder,
    is_there,
    slot_of,
)

NO_BLOCKER = -(1 << 30)
"""The value of ``blocked_by`` if there is room."""

enter = leave = ledge = to_be_filled_in


@hook
def brings(code: int) -> bool:
    """Returns True if commands of a code insert a body."""
    return bool((code == INSERTED) | (code == MOVED))


@hook
def takes(code: int) -> bool:
    """Returns True if commands of a code remove their body."""
    return bool((code == REMOVED) | (code == MOVED))


@hook
def plan_changed(k: Kernel, body: int) -> None:
    """Invalidates the other entries' predictions for a body with a new plan."""
    k.stamps[body] += 1
    k.queue[body].wall = NOT_ASKED
    note_place(k, body)


@template
def renew_plan(k: Kernel, body: int) -> None:
    """Invalidates all that depends on a body's old plan: other entries' predictions, and its partings."""
    plan_changed(k, body)
    plan_partings(k, body)


@hook
def met_at(k: Kernel, tick: int) -> int:
    """Returns the number of contacts so far at a tick that is not in the past."""
    clock = k.clock[0]
    return int(clock.met_there if clock.met_tick == tick else 0)


@hook
def may_come(k: Kernel) -> bool:
    """Returns True if the contacts that the next command waits for have happened at its tick."""
    command = k.commands[k.clock[0].lists.command]
    return bool(command.after <= met_at(k, command.tick))


@hook
def window_of(bodies: int) -> int:
    """Returns the number of contacts between two tests of ``bodies`` bodies for a jam."""
    return 200 * bodies + 2000


@template
def has_vacancy(k: Kernel, command: Records) -> bool:
    """Returns True if a slot is free and the broad phase is prepared for the new body's radius and shape."""
    clock = k.clock[0]
    limits = clock.limits
    room = clock.lists.vacant >= 0 or clock.bodies < len(k.bodies)
    if SHAPES:
        room = room and k.forms[command.form].prepared != 0
    return bool(room and limits.least <= command.radius and command.radius <= limits.widest)


@template
def reaches_into(
    k: Kernel, command: Records, dx: float, dy: float, other: Records, mass: float, kind: int
) -> bool:
    """Returns True if an inserted body would overlap another, given by its record or command, (dx, dy)
    away."""
    clock = k.clock[0]
    if PASSINGS and lets_pass(k.rules[row_of(clock.kinds, kind, command.kind)]):
        return False
    dx, dy = as_anchored(k, dx, dy)  # the nearest image
    reach = command.radius + other.radius
    if SHAPES:
        meets = not (math.isinf(command.mass) and math.isinf(mass))
        return bool(meets and shapes_overlap(k, command.form, other.form, dx, dy, reach))
    reach -= ROOM * reach
    return bool(dx * dx + dy * dy < reach * reach)


@hook
def place_error(k: Kernel, tick: int) -> float:
    """Returns the error of rows of places: infinite if they are not noted, or if bodies are accelerated."""
    clock = k.clock[0]
    noted = len(k.shadows) == 0 and clock.built != 0 and abs(tick - clock.origin) <= clock.limits.span
    return float(clock.limits.fat if noted else math.inf)


@template
def is_far(k: Kernel, x: float, y: float, radius: float, other: int, elapsed: float, loose: float) -> bool:
    """Returns True if a body is out of reach of an inserted one, by its row of places: these are close
    together, and most bodies are far. ``elapsed`` is the time since their origin, ``loose`` their error."""
    place = k.places[other]
    there_x, there_y = position_after(place, elapsed)
    dx, dy = as_anchored(k, there_x - x, there_y - y)
    reach = radius + k.radii[other] + loose
    return bool(dx * dx + dy * dy > reach * reach)


@template
def wall_beyond(k: Kernel, command: Records) -> int:
    """Returns the wall that an inserted body would reach beyond, or NO_BLOCKER."""
    clock = k.clock[0]
    limits = clock.limits
    torus = clock.torus
    radius = command.radius
    x = command.x
    y = command.y
    if WALLED and limits.width > 0.0:  # else there is no arena
        left = right = down = up = radius
        if SHAPES:
            form = k.forms[command.form]
            left = form.left
            right = form.right
            down = form.down
            up = form.up
        allowed = ROOM * radius
        if not PERIODIC or torus.x == 0.0:
            if x < left - allowed:
                return LEFT
            if limits.width - x < right - allowed:
                return RIGHT
        if not PERIODIC or torus.y == 0.0:
            if y < down - allowed:
                return BOTTOM
            if limits.height - y < up - allowed:
                return TOP
    return NO_BLOCKER


@template
def as_anchored(k: Kernel, x: float, y: float) -> tuple[float, float]:
    """Returns a place as an anchored plan has it."""
    torus = k.clock[0].torus
    if PERIODIC:
        return near_zero(x, torus.x), near_zero(y, torus.y)
    return x, y


@template
def fill_move(k: Kernel, command: Records) -> int:
    """Writes all values of a body except its place into the command that moves it; returns its slot."""
    body = slot_of(k, command.body)
    plan = k.bodies[body]
    command.vx = plan.vx
    command.vy = plan.vy
    command.x, command.y = as_anchored(k, command.x, command.y)
    command.radius = plan.radius
    command.mass = k.mass[body]
    if SHAPES:
        command.form = plan.form
    if ACCELERATIONS:
        command.ax = plan.ax
        command.ay = plan.ay
    if RESTING:
        command.ax = plan.whole_x
        command.ay = plan.whole_y
    if RULES:
        command.kind = k.traits[body].kind
    return int(body)


@template
def blocked_by(k: Kernel, command: Records) -> int:
    """Returns the slot of the eldest body, or the wall, that an inserted or moved body would overlap; or
    NO_BLOCKER."""
    own = NOBODY
    if command.code == MOVED:
        own = fill_move(k, command)
    found = wall_beyond(k, command)
    if found != NO_BLOCKER:
        return found
    x, y = as_anchored(k, command.x, command.y)
    elapsed = since_origin(k, command.tick)
    loose = place_error(k, command.tick)
    for other in range(k.clock[0].bodies):
        if other == own or is_far(k, x, y, command.radius, other, elapsed, loose):
            continue
        if is_there(k, other):
            body = k.bodies[other]
            there_x, there_y = position_at(k, body, command.tick)
            there_x, there_y = as_anchored(k, there_x, there_y)
            kind = 0
            if PASSINGS:
                kind = k.traits[other].kind
            if reaches_into(k, command, there_x - x, there_y - y, body, k.mass[other], kind):
                found = other if found < 0 else elder(k, found, other)
    return found


@hook
def caught_in(k: Kernel, command: Records) -> int:
    """Returns the slot of the eldest body that a body passes through, but would meet if it had the kind of a
    command; or NO_BLOCKER."""
    found = NO_BLOCKER
    body = slot_of(k, command.body)
    pair = k.passers[body]
    while pair >= 0:
        other = k.passings[pair].a + k.passings[pair].b - body
        if not lets_pass(k.rules[row_of(k.clock[0].kinds, command.kind, k.traits[other].kind)]):
            found = other if found < 0 else elder(k, found, other)
        pair = follower(k.passings, body, pair)
    return int(found)


def find_blockers(k: Kernel, commands: Records, found: Any) -> None:
    """Writes the blockers of commands of one tick; a template, as ``advance``."""
    k = disowned(k)
    for i in range(len(commands)):
        command = commands[i]
        found[i] = blocked_by(k, command)
        x, y = as_anchored(k, command.x, command.y)
        for j in range(i):
            new = commands[j]
            if found[i] == NO_BLOCKER and found[j] == NO_BLOCKER:
                new_x, new_y = as_anchored(k, new.x, new.y)
                if reaches_into(k, command, new_x - x, new_y - y, new, new.mass, new.kind):
                    found[i] = NO_BLOCKER - 1 - j


@hook
def take_slot(k: Kernel, number: int) -> int:
    """Gives a vacant slot to the body with a number. Before: a slot is vacant."""
    clock = k.clock[0]
    lists = clock.lists
    body = lists.vacant
    if body >= 0:
        lists.vacant = k.bodies[body].last
    else:
        body = clock.bodies
        clock.bodies += 1
    clock.present += 1
    clock.jam.window_size = window_of(clock.present)
    k.slots[number] = body
    k.queue[body].number = number
    return int(body)


@hook
def reach_as(row: Records, form: Records) -> None:
    """Writes a shape's reach to each side into a row."""
    row.left = form.left
    row.right = form.right
    row.down = form.down
    row.up = form.up


@template
def insert_body(k: Kernel, command: Records) -> int:
    """Inserts a body; returns its slot. Its entry awaits nothing yet."""
    body = take_slot(k, command.body)
    new = k.bodies[body]
    new.x = command.x
    new.y = command.y
    new.vx = command.vx
    new.vy = command.vy
    new.anchor = command.tick
    new.radius = command.radius
    new.reach = command.radius + k.clock[0].limits.skin
    new.last = NOBODY
    if RESTING:
        new.whole_x = command.ax
        new.whole_y = command.ay
    if ACCELERATIONS:
        accelerate(k, body, command)
        shadow = k.shadows[body]
        shadow.radius = new.radius
        shadow.reach = new.reach
    if PERIODIC:
        image = k.images[body]
        image.kx = 0
        image.ky = 0
        image.last_m = 0
        image.last_n = 0
        wrap(k, body)
    k.radii[body] = command.radius
    k.mass[body] = command.mass
    if SHAPES:
        form = k.forms[command.form]
        new.form = command.form
        reach_as(new, form)
        reach_as(k.sides[body], form)
        if ACCELERATIONS:
            k.shadows[body].form = command.form
            reach_as(k.shadows[body], form)
    entry = k.queue[body]
    entry.key = NEVER
    entry.certificate = NEVER
    forget(k, body)
    plan_changed(k, body)
    if RULES:
        trait = k.traits[body]
        trait.kind = command.kind
        trait.leave = NEVER
        trait.touched = LONG_AGO
        trait.inside = 0
    _account(k, command.mass, twice_energy(new))
    return body


@hook
def accelerate(k: Kernel, body: int, command: Records) -> None:
    """Gives a body the acceleration of a command; the rest of its chord stays."""
    clock = k.clock[0]
    plan = k.bodies[body]
    plan.ax = command.ax
    plan.ay = command.ay
    if plan.ax != 0.0 or plan.ay != 0.0:
        plan.span = span_of(plan.ax, plan.ay, clock.limits.margin, clock.per_time)


@hook
def _account(k: Kernel, mass: float, squares: float) -> None:
    """Adds the energy of a mass and a squared speed to the energy added by commands; 0 for infinite mass."""
    if abs(mass) < math.inf:
        k.counts[0].commanded_energy += 0.5 * mass * squares


@template
def remove_body(k: Kernel, body: int) -> None:
    """Removes the body in a slot; the broad phase's structure has removed it already.

    A body that awaits a contact with it is refreshed when that contact is at the head. The calendar orders
    contacts of one tick by numbers, and this number is gone: so those contacts become guesses.
    """
    clock = k.clock[0]
    lists = clock.lists
    gone = k.bodies[body]
    let_go(k, body)
    take_hold(k, body)
    _account(k, -k.mass[body], twice_energy(gone))
    entry = k.queue[body]
    entry.certificate = NEVER
    forget(k, body)
    move(k, body, NEVER)
    for other in range(clock.bodies):
        awaiting = k.queue[other]
        if awaiting.partner == body and awaiting.exact == 1:
            awaiting.exact = 0
            refile(k, other)
    k.slots[entry.number] = NOBODY
    entry.number = NOBODY
    entry.wall = NEVER
    gone.vx = 0.0
    gone.vy = 0.0
    gone.radius = 0.0
    gone.reach = 0.0
    if ACCELERATIONS:
        gone.ax = 0.0
        gone.ay = 0.0
        gone.end = NEVER
        lay(k, body)
        k.shadows[body].reach = 0.0
    k.stamps[body] += 1
    note_place(k, body)
    gone.last = lists.vacant
    lists.vacant = body
    clock.present -= 1
    clock.jam.window_size = window_of(clock.present)


@hook
def rows_to_free(k: Kernel, a: int, b: int) -> int:
    """Returns the largest number of bodies that an event of one or two can free: 0 if they hold none, else
    all that are held; below 0 for no body. A contact of two frees nothing that immovable ones hold."""
    carries = k.bodies[a].carries if a >= 0 and (b < 0 or k.mass[a] < math.inf) else 0
    carries += k.bodies[b].carries if b >= 0 and k.mass[b] < math.inf else 0
    held = 0
    for body in range(k.clock[0].bodies if carries > 0 else 0):
        held += int(k.bodies[body].supports > 0)
    return held


@template
def must_wait(k: Kernel, command: Records) -> int:
    """Returns the reason that makes a command wait, LOG_FULL or CROWDED, or NO_REASON."""
    rows = 1
    if PASSINGS and brings(command.code):
        most = k.clock[0].present * (MOST_IMAGES if PERIODIC else 1)
        rows += most
        if crowded(k, most):
            return CROWDED
    if PASSINGS and takes(command.code):
        rows += k.traits[slot_of(k, command.body)].inside
    if RESTING:
        rows += 1 + rows_to_free(k, slot_of(k, command.body), NOBODY)
    return LOG_FULL if log_is_full(k, rows) else NO_REASON


@only_with(RESTING)
@template
def foresee_ledge(k: Kernel, body: int) -> None:
    """Recomputes the tick of a body's departure from its support, both as if anchored at its anchor."""
    plan = k.bodies[body]
    if plan.supports == 1 and plan.support >= 0:
        kept = plan_of(k, plan.support)
        anchor(k, plan.support, plan.anchor)
        if PERIODIC:
            torus = k.clock[0].torus
            one = elder(k, body, plan.support)
            seen = k.images[body + plan.support - one]
            image = k.images[body]
            torus.right = float(image.last_m + seen.kx - k.images[one].kx) * torus.x
            torus.up = float(image.last_n + seen.ky - k.images[one].ky) * torus.y
        plan.ledge = ledge(k, body, plan.support, plan.side_x, plan.side_y, False)
        restore_plan(k, plan.support, kept)


@template
def free_slot(k: Kernel, body: int, at: int) -> None:
    """Frees a body that is held, with no event of its own."""
    plan = k.bodies[body]
    anchor(k, body, at)
    let_go(k, body)
    take_hold(k, body)
    plan.last = NOBODY
    renew_plan(k, body)
    log(k, at, body, HELD)


@only_with(RESTING)
@template
def free_from(k: Kernel, support: int, at: int) -> None:
    """Frees all bodies that a support holds, and what these hold; ``loop.restore`` replans them."""
    lists = k.clock[0].lists
    again = k.bodies[support].carries > 0
    while again:
        again = False
        for number in range(len(k.slots)):
            body = k.slots[number]
            if body >= 0 and (is_held_by(k, body, support) or hangs(k, body)):
                free_slot(k, body, at)
                k.bodies[body].freed = lists.freed
                lists.freed = body
                again = True


@template
def take_out(k: Kernel, s: Any, command: Records) -> None:
    """Removes the body of a command that removes or moves it: first from its passings, then from the broad
    phase's structure, which reads its plan, then from the tables."""
    body = slot_of(k, command.body)
    anchor(k, body, command.tick)
    end_all_passings(k, body, command.tick)
    if command.code == REMOVED:
        log(k, command.tick, body, REMOVED)
        k.counts[0].removed += 1
    else:
        fill_move(k, command)
    k.clock[0].at_work = body
    leave(k, s, body)
    remove_body(k, body)
    if command.code == REMOVED:
        free_from(k, body, command.tick)


@template
def bring_in(k: Kernel, s: Any, command: Records) -> int:
    """Inserts the body of a command that inserts or moves it, and logs it before its passings begin; returns
    its slot: a vacant one, which a moved body has just left."""
    body = insert_body(k, command)
    log(k, command.tick, body, command.code)
    if command.code == INSERTED:
        k.counts[0].inserted += 1
    else:
        k.counts[0].turns += 1
        free_from(k, body, command.tick)
    k.clock[0].at_work = body
    enter(k, s, body)
    begin_with_all(k, body, command.tick)
    return body


@template
def change(k: Kernel, body: int, command: Records) -> None:
    """Gives an anchored body the velocity, acceleration or kind of a command, and accounts for the energy."""
    plan = k.bodies[body]
    if command.code != REANCHORED:
        k.counts[0].turns += 1
    if command.code == TURNED:
        gained = command.vx * command.vx + command.vy * command.vy - square_of_speed(plan)
        _account(k, k.mass[body], gained)
        plan.vx = command.vx
        plan.vy = command.vy
    if ACCELERATIONS and command.code == ACCELERATED:
        before = twice_energy(plan)
        if RESTING:
            plan.whole_x = command.ax
            plan.whole_y = command.ay
        accelerate(k, body, command)
        _account(k, k.mass[body], twice_energy(plan) - before)
    if RULES and command.code == OF_KIND:
        k.traits[body].kind = command.kind


@template
def carry_out(k: Kernel, s: Any) -> int:
    """Carries out the next command, at its tick; returns the slot of the body to be refreshed, or NOBODY.
    With ``LIVING``, there is room for a new body."""
    lists = k.clock[0].lists
    command = k.commands[lists.command]
    lists.command += 1
    if LIVING and takes(command.code):
        take_out(k, s, command)
        if command.code == REMOVED:
            return NOBODY
    if LIVING and brings(command.code):
        return bring_in(k, s, command)
    at = command.tick
    body = slot_of(k, command.body)
    anchor(k, body, at)
    if command.code != REANCHORED:
        let_go(k, body)
    change(k, body, command)
    k.bodies[body].last = NOBODY
    changed = False
    if RESTING and command.code == REANCHORED:
        foresee_ledge(k, body)
    elif RESTING:
        changed = take_hold(k, body)
    renew_plan(k, body)
    log(k, at, body, command.code)
    if RESTING and changed and command.code != ACCELERATED:
        log(k, at, body, HELD)
    if command.code != REANCHORED and (command.code != ACCELERATED or k.mass[body] < math.inf):
        free_from(k, body, at)
    return body


def run_one_command(k: Kernel, s: Any) -> None:
    """Carries out the next command in tables whose structure is built after it; a template."""
    k = disowned(k)
    s = disowned(s)
    command = k.commands[k.clock[0].lists.command]
    k.clock[0].now = larger(k.clock[0].now, command.tick)
    carry_out(k, s)
