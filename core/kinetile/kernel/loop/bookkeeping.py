"""Bookkeeping: the rows that the loop writes for an event, and the checks that follow.

A contact has a row for the digest; in a recorded run every event has a row with the plans after it. Rows name
bodies by their numbers. Each contact is counted, and the loop stops at a watched contact. Jams, and overlaps
that rounding does not explain, are reported as faults.
"""

import math

from kinetile.kernel.clock import SPAN
from kinetile.kernel.compiled import hook, larger, smaller, with_accelerations
from kinetile.kernel.flight import square_of_speed
from kinetile.kernel.log import LEFT, TURNED
from kinetile.kernel.passings import rule_of
from kinetile.kernel.tables import JAMMED, NOBODY, NOT_FINITE, SQUEEZED, TOO_DEEP, Kernel, Records, blame


@hook
def _note_pull(body: Records, row: Records) -> None:
    row.bx = body.ax
    row.by = body.ay


@with_accelerations(_note_pull)
@hook
def note_pull(body: Records, row: Records) -> None:
    """Writes a body's acceleration into a row, in place of the second body's position."""


@hook
def log(k: Kernel, tick: int, a: int, b: int) -> None:
    """Logs an event of the body in slot a and the body in slot b; for b below 0 see ``kernel.log``."""
    first = k.queue[a].number
    second = k.queue[b].number if b >= 0 else b
    k.counts[0].logged += 1
    if b > TURNED:
        _log_contact(k, tick, first, second)
    if k.clock[0].lists.rows > 0:
        row = _next_row(k, tick, first, second)
        one = k.bodies[a]
        row.ax = one.x
        row.ay = one.y
        row.avx = one.vx
        row.avy = one.vy
        note_pull(one, row)
        if b >= 0:
            two = k.bodies[b]
            row.bx = two.x
            row.by = two.y
            row.bvx = two.vx
            row.bvy = two.vy


@hook
def note_meeting(k: Kernel, a: int, b: int) -> None:
    """Keeps the velocities of two bodies at their contact, or of a body at a wall, if they are wanted."""
    meeting = k.clock[0].meeting
    if meeting.wanted == 0:
        return
    one = k.bodies[a]
    meeting.avx = one.vx
    meeting.avy = one.vy
    if b >= 0:
        two = k.bodies[b]
        meeting.bvx = two.vx
        meeting.bvy = two.vy


@hook
def log_passing(k: Kernel, tick: int, a: int, b: int) -> None:
    """Logs that the bodies in two slots begin to pass through each other, the elder given first, or stop, the
    younger given first. No plan changes, so the long row holds no plan."""
    first = k.queue[a].number
    second = k.queue[b].number
    k.counts[0].logged += 1
    _log_contact(k, tick, first, second)
    if k.clock[0].lists.rows > 0:
        row = _next_row(k, tick, first, second)
        row.ax = row.ay = row.avx = row.avy = math.nan
        row.bx = row.by = row.bvx = row.bvy = math.nan


@hook
def _next_row(k: Kernel, tick: int, first: int, second: int) -> Records:
    """Begins a row of the log of events: the tick and two numbers."""
    lists = k.clock[0].lists
    row = k.log[lists.written]
    lists.written += 1
    row.tick = tick
    row.a = first
    row.b = second
    return row


@hook
def _log_contact(k: Kernel, tick: int, first: int, second: int) -> None:
    """Writes the row of a contact for the digest: the bodies, by numbers, and the tick."""
    clock = k.clock[0]
    lists = clock.lists
    met = k.met[lists.logged]
    lists.logged += 1
    met.epoch = clock.epoch + (tick >> 52)
    met.tick = tick & ((1 << 52) - 1)
    met.a = first
    met.b = second


@hook
def log_is_full(k: Kernel, rows: int) -> bool:
    """Returns True if there is no room for ``rows`` more rows."""
    lists = k.clock[0].lists
    room = len(k.met) - lists.logged
    return bool(room < rows or (lists.rows > 0 and lists.rows - lists.written < rows))


ANY_BEGIN, SOME, ENDS = 1, 2, 4
"""Flags of ``k.watch``: a body is watched at every contact; it is in a pair of ``k.watched``; the ends of its
passings are watched, too. In ``k.watched_kinds`` ANY_BEGIN is the beginning of a contact, ENDS the end of a
passing; a wall has one flag for each side, from the left one on."""


@hook
def flag_of(first: int, second: int) -> int:
    """Returns the flag of a contact of two numbers in the order of the log: at the end of a passing the
    younger body is first."""
    if second < 0:
        return int(1 << (LEFT - second))
    return ANY_BEGIN if first < second else ENDS


@hook
def is_watched(k: Kernel, a: int, b: int) -> bool:
    """Returns True if a contact of the bodies in two slots, or of a body and a wall (b below 0), is watched.
    At the end of a passing the younger body is given first."""
    kinds = rule_of(k, a, b) if len(k.traits) > 0 else int(b < 0)  # without rules there is one kind
    one = k.queue[a].number
    two = k.queue[b].number if b >= 0 else b
    flag = flag_of(one, two)
    if (k.watched_kinds[kinds] & flag) != 0:
        return True
    either = both = k.watch[one]
    if b >= 0:
        either = either | k.watch[two]
        both = both & k.watch[two]
        if flag == ENDS and (either & ENDS) == 0:
            return False
    else:
        two = NOBODY
    if (either & ANY_BEGIN) != 0:
        return True
    if (both & SOME) != 0:
        for at in range(len(k.watched)):
            pair = k.watched[at]
            if (pair.a == one and pair.b == two) or (pair.a == two and pair.b == one):
                return True
    return False


@hook
def stop_there(k: Kernel, tick: int, a: int, b: int) -> None:
    """Writes the contact that stops the loop: by numbers, the younger first at the end of a passing."""
    stops = k.clock[0].stops
    stops.due = 1
    stops.row = k.clock[0].lists.logged - 1
    stops.tick = tick
    stops.a = k.queue[a].number
    stops.b = k.queue[b].number if b >= 0 else b


SQUEEZED_BY, SQUEEZED_TO, PRESSED_TO = 1000.0, 0.03, 1e-8
"""The least ratio of a squeezed body's speed to its pushers' speed; its longest flight between two contacts,
over its radius; and the same for the fastest body, where the pressed one is slow, as by losses."""


@hook
def _pull(plan: Records) -> float:
    return float(abs(plan.ax) + abs(plan.ay))


@with_accelerations(_pull)
@hook
def _pull_on(plan: Records) -> float:
    """Returns a bound of the present acceleration of a body."""
    return 0.0


@hook
def _blame_a_jam(k: Kernel, ticks: int, a: int, b: int) -> bool:
    """Reports a jam if a window of contacts, the last one of a and b, took at most so few ticks; a squeeze if
    one of the two shows it, which the fault names first. Returns True to test the next contact too.

    In a jam each contact takes less than 1e-13 of the smallest radius of flight, at the speed of the fastest
    body. In a squeeze, between immovable bodies that close in, or one and a wall, flights become short much
    later, after as many contacts as the body's speed is a multiple of theirs. So a squeeze is identified by
    the speed: a thousand times that of the fastest pusher, with 10^4 times the energy that the start and
    commands have given to all, and still gaining: a body between two that separate again is as fast, and
    loses. With losses it stays slow, and rounding keeps its flights from ending, which a fast body elsewhere
    hides: so a contact with a pusher ends the run earlier. Only present bodies count: bounds for all time
    include a scene's commands, and a run with commands by hand and its recording would jam differently.
    """
    clock = k.clock[0]
    radius = math.inf
    squares = pushing = energy = 0.0
    for slot in range(clock.bodies):
        if k.queue[slot].number >= 0:
            body = k.bodies[slot]
            square = square_of_speed(body)
            radius = smaller(radius, body.radius)
            squares = larger(squares, square)
            if k.mass[slot] < math.inf:
                energy += 0.5 * k.mass[slot] * square
            else:
                pushing = larger(pushing, square)
    fault, flight, squeezed = JAMMED, 0.0, a
    if squares > 0.0:
        flight = 1e-13 * radius / math.sqrt(squares)
    given = larger(energy - k.counts[0].answered_energy, 0.0)
    gains, still = k.counts[0].answered_energy > clock.jam.answered, 0.0
    for slot, other in ((a, b), (b, a)):
        if slot >= 0 and pushing > 0.0 and k.mass[slot] < math.inf:
            body = k.bodies[slot]
            square = square_of_speed(body)
            falls = 2.0 * _pull_on(body) * body.radius
            still = PRESSED_TO * radius / math.sqrt(larger(squares, falls)) / clock.present
            if other >= 0 and k.mass[other] == math.inf and square_of_speed(k.bodies[other]) > 0.0:
                flight = larger(flight, still)
            fast = square > SQUEEZED_BY**2 * larger(pushing, falls)
            if fast and gains and 0.5 * k.mass[slot] * square > 1e4 * given:
                flight = SQUEEZED_TO * body.radius / math.sqrt(square) / clock.present
                fault, squeezed = SQUEEZED, slot
    size = clock.jam.window_size
    if ticks <= smaller(size * flight * clock.per_time, float(SPAN)):
        blame(k, fault, squeezed, a + b - squeezed)
        return False
    return bool(ticks <= size * still * clock.per_time and clock.jam.window < size + clock.present)


@hook
def _has_command(k: Kernel, tick: int) -> bool:
    """Returns True if a command is due after the contacts that a tick has had: in the run that this run
    repeats, the command may have ended this jam."""
    clock = k.clock[0]
    if clock.lists.command >= clock.lists.commands:
        return False
    command = k.commands[clock.lists.command]
    return bool(command.tick == tick and command.after <= clock.met_there)


@hook
def count_row(k: Kernel, tick: int, a: int, b: int) -> None:
    """Counts an event at a tick, stops if it is the first watched one, and tests for jams."""
    clock = k.clock[0]
    jam = clock.jam
    stops = clock.stops
    if stops.watching != 0 and stops.before == 0 and stops.due == 0 and is_watched(k, a, b):
        stop_there(k, tick, a, b)
    clock.met_there = clock.met_there + 1 if clock.met_tick == tick else 1
    clock.met_tick = tick
    jam.spins = 0
    jam.window += 1
    full = jam.window >= jam.window_size
    if full and (_has_command(k, tick) or not _blame_a_jam(k, tick - jam.window_tick, a, b)):
        jam.window = 0
        jam.window_tick = tick
        jam.answered = k.counts[0].answered_energy


@hook
def count_contact(k: Kernel, tick: int, a: int, b: int, depth: float, radius: float, slack: float) -> None:
    """Keeps the readings of a contact; tests for jams, and for overlaps that rounding does not explain."""
    counts = k.counts[0]
    counts.deepest = larger(counts.deepest, depth / radius)
    if not depth <= k.clock[0].limits.tolerance + 1e-9 * slack:
        blame(k, TOO_DEEP if depth > 0.0 else NOT_FINITE, a, b)
    count_row(k, tick, a, b)
