"""Responses: the result of a contact of two bodies, or of a body and a wall, and the pairs that pass.

The table ``k.rules`` has a row for each two kinds and for each kind and a wall. Its response is
``IS_ELASTIC`` (the narrow phase's own), ``IS_PASS`` (nothing changes), or one of the hooks that are composed
into the loop. A loop for a scene without rules contains none of this.

A *passing* is a pair that goes through each other, from the tick at which they touch to the tick at which
they part, or one of them is removed. Where an axis is periodic, it goes through one image, and several may
last at a time. Neither event changes a plan, and a passing lasts for a tick at least: so a contact of two
that pass, if it lies in the past, has begun and ended, and does not lie ahead (``predictions.meeting``). A
pair that has begun is in the list of both its bodies (``k.passings``) with its exact tick of parting, which
is recomputed whenever one of the two plans changes. The elder of the two awaits the parting: its *leave* is
the first of those ticks. For a passing pair no contact is computed, except through other images.
"""

import math
from typing import Any

from kinetile.kernel.compiled import disowned, hook, larger, smaller, template, to_be_filled_in
from kinetile.kernel.features import (
    ACCELERATIONS,
    PASSINGS,
    PERIODIC,
    RESPONSES,
    RESTING,
    RULES,
    SHAPES,
    UNEQUAL,
    only_with,
)
from kinetile.kernel.flight import closing_speed, give, position_at, since_touched, square_of_speed
from kinetile.kernel.images import anchor, come_together, plan_of, remainder, restore_plan, turns_of
from kinetile.kernel.loop.bookkeeping import count_row, log_passing
from kinetile.kernel.loop.calendar import refile
from kinetile.kernel.pairs import follower, link, unlink
from kinetile.kernel.passings import FIRST, IS_ELASTIC, IS_PASS, is_passing, passes, rule_of
from kinetile.kernel.rest import ALONE, WITH_ANOTHER, let_go, pull_between, stands, without
from kinetile.kernel.tables import NEVER, Kernel, Records, elder, is_there

ROOM = 1e-12
"""The overlap allowed between two bodies, over the sum of their radii, or with a wall, over the radius: as in
a scene (``scene.checks.TOLERANCE``)."""

LASTING = 2.0**38
"""The least ticks of flight after a contact of two that their accelerations press together, if the response
has no time of its own: 2^-14 units (rule 11h)."""

ROUNDED = 2.0**-44
"""The part of two bodies' velocities that rounding may leave as closing speed (rule 11h)."""

LOADED = 128.0
"""The most that the load on a body multiplies its least parting speed by (rule 11h)."""

MOST_RESPONSES = 4
"""The most hooks of responses in a loop."""

respond_1 = respond_2 = respond_3 = respond_4 = to_be_filled_in
collide = touch = bounce = touch_wall = part = gap = ledge = to_be_filled_in


@template
def have_passed(k: Kernel, a: int, b: int) -> bool:
    """Returns True if two bodies overlap where their plans begin, in the past: the contact was before."""
    early = a if k.bodies[a].anchor < k.bodies[b].anchor else b
    one = k.bodies[early]
    two = k.bodies[a + b - early]
    if two.anchor >= k.clock[0].now:
        return False
    x, y = position_at(k, one, two.anchor)
    dx = two.x - x
    dy = two.y - y
    if SHAPES:
        return bool(gap(k, one.form, two.form, dx, dy) < -1e-10 * (one.radius + two.radius))
    reach = (one.radius + two.radius) * (1.0 - 1e-10)
    return bool(dx * dx + dy * dy < reach * reach)


@template
def shapes_overlap(k: Kernel, form: int, other: int, dx: float, dy: float, reach: float) -> bool:
    """Returns True if two shapes overlap, by more than rounding explains, if the other is (dx, dy) away;
    ``reach`` is the sum of the radii of the circles around them."""
    if dx * dx + dy * dy >= reach * reach:  # the circles do not meet, and ROOM is wider than rounding
        return False
    return bool(gap(k, form, other, dx, dy) < -(ROOM * reach))


@template
def _reach_into(k: Kernel, a: int, b: int, dx: float, dy: float) -> bool:
    """Returns True if two bodies that pass, ``a`` the elder, overlap at this distance (rules 11 and 11s)."""
    one = k.bodies[a]
    two = k.bodies[b]
    reach = one.radius + two.radius
    if SHAPES:
        meet = not (math.isinf(k.mass[a]) and math.isinf(k.mass[b]))
        return bool(meet and shapes_overlap(k, one.form, two.form, dx, dy, reach))
    reach *= 1.0 - ROOM
    return bool(dx * dx + dy * dy < reach * reach)


@hook
def leaves_out(k: Kernel, body: int, count: int) -> int:
    """Removes from ``k.near[:count]`` the bodies that a body is passing through; returns the number that
    stay. Not for periodic axes: there they may meet through other images."""
    if k.traits[body].inside == 0:
        return count
    kept = 0
    for i in range(count):
        other = k.near[i]
        if other == body or not is_passing(k, body, other, 0, 0):
            k.near[kept] = other
            kept += 1
    return kept


@template
def _energy(k: Kernel, body: int) -> float:
    """Returns the kinetic energy, in the room, of an anchored body; 0 for one of infinite mass."""
    mass = k.mass[body]
    return 0.5 * mass * square_of_speed(k.bodies[body]) if mass < math.inf else 0.0


@template
def _note(k: Kernel, body: int, other: int, tick: int) -> None:
    """Notes a body's contact, and whether the body is now too fast for its reach. An immovable body notes
    only walls and immovable bodies (rule 11)."""
    if RULES and (other < 0 or k.mass[body] < math.inf or k.mass[other] == math.inf):
        k.traits[body].touched = tick
    plan = k.bodies[body]
    if not plan.vx * plan.vx + plan.vy * plan.vy <= k.clock[0].limits.speed2:
        k.clock[0].limits.faster = 1


@only_with(RESTING)
@template
def consider(k: Kernel, a: int, b: int, nx: float, ny: float) -> None:
    """Decides whether one of two bodies that meet, or a body at a wall, may settle on the other (rule 9r),
    and when it would leave that support alone."""
    body = a
    support = b
    mx = -nx
    my = -ny
    if b >= 0 and (k.mass[a] == math.inf or (k.mass[b] < math.inf and stands(k, a, nx, ny))):
        body = b
        support = a
        mx = nx
        my = ny
    plan = k.bodies[body]
    if k.mass[body] == math.inf:
        return
    ax = plan.ax
    ay = plan.ay
    dx, dy = without(ax, ay, mx, my)
    alone = ax * mx + ay * my < 0.0
    if PERIODIC:
        torus = k.clock[0].torus
        alone = alone and (torus.x == 0.0 or dx == 0.0) and (torus.y == 0.0 or dy == 0.0)
    tick = NEVER
    if b >= 0:
        if k.mass[support] < math.inf and not stands(k, support, mx, my):
            return
        under = k.bodies[support]
        vx = plan.vx
        vy = plan.vy
        wx, wy = without(vx - under.vx, vy - under.vy, mx, my)
        plan.vx = under.vx + wx
        plan.vy = under.vy + wy
        plan.ax = dx
        plan.ay = dy
        tick = ledge(k, body, support, mx, my, True)
        plan.vx = vx
        plan.vy = vy
        plan.ax = ax
        plan.ay = ay
        if tick < plan.anchor:  # no face
            return
    plan.may = ALONE if alone and tick > plan.anchor else WITH_ANOTHER
    plan.ledge = tick


@template
def _respond(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
    """Calls the hook of a rule's response."""
    consider(k, a, b, nx, ny)
    if RESPONSES > 0 and rule.response == FIRST:
        respond_1(k, a, b, nx, ny, rule)
    if RESPONSES > 1 and rule.response == FIRST + 1:
        respond_2(k, a, b, nx, ny, rule)
    if RESPONSES > 2 and rule.response == FIRST + 2:
        respond_3(k, a, b, nx, ny, rule)
    if RESPONSES > 3 and rule.response == FIRST + 3:
        respond_4(k, a, b, nx, ny, rule)


@only_with(ACCELERATIONS)
@template
def separate(k: Kernel, a: int, b: int, nx: float, ny: float, closing: float) -> None:
    """Makes two bodies that are pressed together, or a body and a wall (b below 0), part so fast that they
    meet again after about the rule's own time, or the default, at the least (rule 11h). They have met at the
    speed ``closing``.

    Without this, a body pressed on a curved or moving one comes back after ever shorter flights, and at last
    after no flight: the run would end as if it was jammed. So it would if two close in by a rounding that no
    exchange can reverse, as a disc between a floor and a body that rolls over it: two part by at least that.

    The lowest body of a heap carries the others, which strike it during its flight, so that it comes back
    sooner. It parts faster by as much, but twice as fast as before at most, and up to ``LOADED`` times the
    least speed. So what carries a heap has no more contacts than one body; what moves the bodies of the heap
    comes from there. Where bodies may settle, the floor holds the lowest instead.
    """
    one = k.bodies[a]
    if RESTING:
        held = one.holds
        if b >= 0:
            held += k.bodies[b].holds
        if held > 0:
            return
    x, y = pull_between(k, a, b)
    if not RESTING and x == 0.0 and y == 0.0:
        return
    lasting = k.rules[rule_of(k, a, b)].contact_time if RULES else 0.0
    own = lasting > 0.0
    if not own:
        lasting = k.clock[0].per_tick * LASTING
    least = 0.5 * lasting * -(x * nx + y * ny)
    if own and least > 0.0 and not RESTING:
        since = since_touched(k, a, b)
        if since <= lasting:
            loaded = smaller(LOADED * least, 2.0 * closing)
            if loaded * since > closing * lasting:
                loaded = closing * lasting / since
            least = larger(least, loaded)
    if b < 0:
        out = one.vx * nx + one.vy * ny
        if not (least > 0.0 and -out < least):
            return
        out += least
        one.vx -= out * nx
        one.vy -= out * ny
        return
    two = k.bodies[b]
    size = ((abs(one.vx) + abs(one.vy)) + (abs(two.vx) + abs(two.vy))) + lasting * (abs(x) + abs(y))
    least = larger(least, ROUNDED * size)
    speed = closing_speed(one, two, nx, ny)
    if speed < least:
        give(k, a, b, nx, ny, 0.5 * (speed - least))


@template
def answer(k: Kernel, a: int, b: int, tick: int) -> float:
    """Answers a contact of two bodies, both anchored at it, by their rule; returns their overlap."""
    before = _energy(k, a) + _energy(k, b)
    elastic = True
    if RULES:
        rule = k.rules[rule_of(k, a, b)]
        elastic = RESPONSES == 0 or rule.response == IS_ELASTIC
    nx = ny = depth = 0.0
    if UNEQUAL or not elastic:  # elastic contacts of bodies that fall alike need no ``touch``
        nx, ny, depth = touch(k, a, b)
    closing = -closing_speed(k.bodies[a], k.bodies[b], nx, ny) if UNEQUAL else 0.0
    if elastic:
        depth = collide(k, a, b)
    let_go(k, a)
    let_go(k, b)
    if RESPONSES > 0 and not elastic:
        _respond(k, a, b, nx, ny, rule)
    if UNEQUAL and depth == depth:
        separate(k, a, b, nx, ny, closing)
    if depth == depth:  # else there is no answer: the loop ends with both unchanged
        k.counts[0].answered_energy += (_energy(k, a) + _energy(k, b)) - before
        _note(k, a, b, tick)
        _note(k, b, a, tick)
    return float(depth)


@template
def answer_wall(k: Kernel, a: int, wall: int, tick: int) -> float:
    """Answers a contact of a body, anchored at it, and a wall by its rule; returns the overlap."""
    before = _energy(k, a)
    elastic = True
    if RULES:
        rule = k.rules[rule_of(k, a, wall)]
        elastic = RESPONSES == 0 or rule.response == IS_ELASTIC
    nx = ny = depth = 0.0
    if ACCELERATIONS or not elastic:
        nx, ny, depth = touch_wall(k, k.bodies[a], wall)
    closing = k.bodies[a].vx * nx + k.bodies[a].vy * ny
    if elastic:
        depth = bounce(k, k.bodies[a], wall)
    let_go(k, a)
    if RESPONSES > 0 and not elastic:
        _respond(k, a, wall, nx, ny, rule)
    separate(k, a, wall, nx, ny, closing)
    k.counts[0].answered_energy += _energy(k, a) - before
    _note(k, a, wall, tick)
    return float(depth)


@template
def goes_through(k: Kernel, a: int, b: int, h: int, tick: int) -> bool:
    """Returns True if two bodies that may pass, ``a`` the elder, pass at the contact that the entry of h
    awaits, at this tick; with a rule for one side, False if the movable one meets the other from there."""
    rule = k.rules[rule_of(k, a, b)]
    alike = (k.mass[a] == math.inf) == (k.mass[b] == math.inf)
    if RESPONSES == 0 or rule.response == IS_PASS or alike:
        return True
    one = plan_of(k, a)
    two = plan_of(k, b)
    anchor(k, a, tick)
    anchor(k, b, tick)
    come_together(k, a, b, h)
    nx, ny, _ = touch(k, a, b)
    restore_plan(k, a, one)
    restore_plan(k, b, two)
    met = nx * rule.way_x + ny * rule.way_y
    return not (met > 0.0 if k.mass[a] == math.inf else met < 0.0)


@hook
def crowded(k: Kernel, pairs: int) -> bool:
    """Returns True if there is no room for ``pairs`` more pairs."""
    return bool(len(k.passings) - k.clock[0].lists.passings < pairs)


@template
def _parts(k: Kernel, record: Records) -> int:
    """Returns the tick of a pair's parting: at least a tick after its begin."""
    if PERIODIC:
        torus = k.clock[0].torus
        torus.m = record.m
        torus.n = record.n
    return int(larger(part(k, record.a, record.b), record.begun + 1))


@template
def begin_passing(k: Kernel, a: int, b: int, tick: int, m: int, n: int) -> None:
    """Begins a passing of two bodies, ``a`` the elder, through an image. Before: the table has room."""
    lists = k.clock[0].lists
    new = lists.free_passing
    record = k.passings[new]
    lists.free_passing = record.next_a
    record.a = a
    record.b = b
    record.m = m
    record.n = n
    link(k.passings, k.passers, new)
    record.begun = tick
    record.tick = _parts(k, record)
    k.traits[a].leave = smaller(k.traits[a].leave, record.tick)
    k.traits[a].inside += 1
    k.traits[b].inside += 1
    lists.passings += 1
    k.counts[0].passings += 1
    k.counts[0].contacts_disc += 1
    log_passing(k, tick, a, b)
    count_row(k, tick, a, b)


@hook
def find_leave(k: Kernel, body: int) -> int:
    """Returns the first pair to part among those with a body as the elder, or -1; notes its tick."""
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
    """Ends a passing. The caller finds the body's next one by ``find_leave``."""
    lists = k.clock[0].lists
    record = k.passings[pair]
    a = record.a
    b = record.b
    k.counts[0].contacts_disc += 1
    log_passing(k, tick, b, a)
    count_row(k, tick, b, a)
    unlink(k.passings, k.passers, pair)
    record.a = -1
    record.next_a = lists.free_passing
    lists.free_passing = pair
    lists.passings -= 1
    k.traits[a].inside -= 1
    k.traits[b].inside -= 1


@only_with(PASSINGS)
@template
def plan_partings(k: Kernel, body: int) -> None:
    """Recomputes the ticks of a body's partings, with a new plan, from those that it is passing through."""
    pair = k.passers[body]
    while pair >= 0:
        record = k.passings[pair]
        record.tick = _parts(k, record)
        if record.a != body:
            find_leave(k, record.a)
            refile(k, record.a)
        pair = follower(k.passings, body, pair)
    find_leave(k, body)


@template
def overlap_through(k: Kernel, a: int, b: int, tick: int, right: int, up: int) -> tuple[bool, int, int]:
    """Returns True if a passing of two bodies, ``a`` the elder, begins at the start or with a new body,
    because they overlap at a tick, by their places as if anchored there, the second some periods away; and
    the image."""
    x, y = position_at(k, k.bodies[a], tick)
    x2, y2 = position_at(k, k.bodies[b], tick)
    if not PERIODIC:
        return _reach_into(k, a, b, x2 - x, y2 - y), 0, 0
    torus = k.clock[0].torus
    kx = turns_of(x, torus.x)
    ky = turns_of(y, torus.y)
    kx2 = turns_of(x2, torus.x)
    ky2 = turns_of(y2, torus.y)
    dx = remainder(x2, torus.x, kx2) - remainder(x, torus.x, kx) + float(right) * torus.x
    dy = remainder(y2, torus.y, ky2) - remainder(y, torus.y, ky) + float(up) * torus.y
    m = right + int(kx - kx2) + k.images[a].kx - k.images[b].kx
    n = up + int(ky - ky2) + k.images[a].ky - k.images[b].ky
    return _reach_into(k, a, b, dx, dy), m, n


@template
def periods_around(k: Kernel) -> tuple[int, int]:
    """Returns the numbers of periods, along x and y, to the images of a body to be tested."""
    if PERIODIC:
        return 1 if k.clock[0].torus.x > 0.0 else 0, 1 if k.clock[0].torus.y > 0.0 else 0
    return 0, 0


@template
def overlap_now(k: Kernel, one: int, two: int, tick: int) -> bool:
    """Returns True if a passing of two bodies begins at a tick with a new body, or at the start."""
    a = elder(k, one, two)
    if not passes(k, one, two):
        return False
    across, upwards = periods_around(k)
    for right in range(-across, across + 1):
        for up in range(-upwards, upwards + 1):
            begins, _, _ = overlap_through(k, a, one + two - a, tick, right, up)
            if begins:
                return True
    return False


@template
def begin_overlap(k: Kernel, a: int, b: int, tick: int) -> None:
    """Begins the passings of two bodies that pass, ``a`` the elder, through each image with an overlap at a
    tick. Their order cannot be observed."""
    across, upwards = periods_around(k)
    for right in range(-across, across + 1):
        for up in range(-upwards, upwards + 1):
            begins, m, n = overlap_through(k, a, b, tick, right, up)
            if begins:
                begin_passing(k, a, b, tick, m, n)


@only_with(PASSINGS)
@template
def begin_with_all(k: Kernel, body: int, tick: int) -> None:
    """Begins the passings of a new body with all bodies that it overlaps and passes, the eldest first."""
    before = -1
    while True:
        next_one = -1
        for other in range(k.clock[0].bodies):
            number = k.queue[other].number
            sooner = number > before and (next_one < 0 or number < k.queue[next_one].number)
            if sooner and other != body and is_there(k, other) and overlap_now(k, other, body, tick):
                next_one = other
        if next_one < 0:
            return
        before = k.queue[next_one].number
        first = elder(k, next_one, body)
        begin_overlap(k, first, next_one + body - first, tick)
        refile(k, next_one)


@only_with(PASSINGS)
@template
def end_all_passings(k: Kernel, body: int, tick: int) -> None:
    """Ends the passings of a body that is being removed, the eldest first."""
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
        refile(k, other)
    k.traits[body].leave = NEVER


def begin_at_start(k: Kernel, pairs: Any) -> None:
    """Begins the passings of those pairs, (m, 2) slots, that overlap and pass at the start; a template."""
    k = disowned(k)
    for at in range(len(pairs)):
        if passes(k, pairs[at, 0], pairs[at, 1]):
            begin_overlap(k, pairs[at, 0], pairs[at, 1], 0)
