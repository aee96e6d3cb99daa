"""Contacts to come, by the present flight plans.

The narrow phase computes them as in the loop, one pair after the other in compiled code: so each tick is the
contact's tick in the log, if no plan of the two changes before. A contact is *scheduled* if it is the first
contact of both of its bodies with any body or wall, and no command changes their plans before. For two bodies
that pass through each other, the next row is the end of the passing.
"""

import math
from collections.abc import Callable, Mapping
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Floats, Integers
from kinetile.kernel.certificates.plans import Plans, plans_of
from kinetile.kernel.certificates.shapes import enters
from kinetile.kernel.certificates.walls import reaches_edge
from kinetile.kernel.compiled import compose, disowned, hook, pointer, to_be_filled_in
from kinetile.kernel.features import PASSINGS, PERIODIC, UNEQUAL
from kinetile.kernel.images import discs_touch, first_image, first_image_of
from kinetile.kernel.loop.predictions import barred_with, meeting
from kinetile.kernel.loop.responses import overlap_now
from kinetile.kernel.passings import is_passing
from kinetile.kernel.tables import (
    ACCELERATED_BODY,
    ACCELERATED_SHAPED,
    BODY,
    IMAGE,
    NEVER,
    NOBODY,
    SHAPED,
    Kernel,
    elder,
    record_table,
)
from kinetile.run.questions.places import MOST_PERIODS, Point, Query, gaps_to
from kinetile.scene.bodies import nearest_image
from kinetile.toolbox.differences import DISC, Outline, circle_around, difference_row

Planned = Mapping[int, int]
"""By slots, the kernel's tick of a planned change of the body's plan."""


class NextContact(NamedTuple):
    """A contact to come, as the row of ``Simulation.contacts`` that it will be.

    Attributes:
        time: its time, in the scene's time; (epoch, tick) is the same exactly (``kinetile.kernel.log``).
        epoch, tick: whole time units since the scene's start, and ticks of 2**-52 of one after that.
        a, b: a body, and another one, b > a, or b < a if they end to pass through each other; or a wall:
            -1 left, -2 right, -3 bottom, -4 top.
    """

    time: float
    epoch: int
    tick: int
    a: int
    b: int


class CastHit(NamedTuple):
    """The first contact of a cast body: the ``body`` or the wall that it meets, its ``distance`` from its
    start then, and the time; numbers of walls, ``time``, ``epoch`` and ``tick`` as in ``NextContact``."""

    time: float
    epoch: int
    tick: int
    body: int
    distance: float


BEGUN, AT_WALL, OF_PAIR, OF_PARTING = range(4)
"""The kinds of a body's first event, in the order of one tick: a passing of the start that has no row yet, a
contact with a wall or a body, the end of a passing."""


class _First(NamedTuple):
    """The first event of a body: the kernel's tick, one of these kinds, and a slot or a wall."""

    tick: int
    kind: int
    other: int


def next_contact_of(
    query: Query, a: int, planned: Planned | None = None, among: Integers | None = None, walls: bool = True
) -> NextContact | None:
    """Returns the next contact of a slot, as ``Simulation.next_contact_of``: with bodies, ``among`` some or
    all, and ``walls``; with ``planned`` changes, only if nothing precedes it. Bodies are numbers."""
    first = _first_of(query, a, among, walls)
    if first is None or (planned is not None and not _is_first(query, a, first, planned)):
        return None
    one, other = int(query.k.queue.number[a]), first.other
    if other >= 0:
        one, other = sorted((one, int(query.k.queue.number[other])), reverse=first.kind == OF_PARTING)
    return NextContact(*query.clock.moment(query.clock.total(first.tick)), one, other)


def cast(
    query: Query, centre: Point, outline: Outline, velocity: Point, pull: Point, walls: bool = False
) -> CastHit | None:
    """Returns the hit of ``Simulation.cast``: its body is a slot, or with ``walls`` a wall."""
    ticks = np.full(len(query.slots), NEVER)
    discs = not query.shapes and outline[0] == DISC
    accelerated = query.composition.prepared.accelerated or any(pull)
    k = _with_body(query, centre, outline, velocity, pull if accelerated else None)
    meet = first_disc if discs else first_shape
    if any(query.periods):
        meet = first_image if discs else first_shape_image
    _composed(ticks_of_cast, meet=meet)(k, query.slots, len(k.bodies) - 1, ticks)
    ticks[_overlapping(query, centre, outline)] = query.now
    at = int(ticks.argmin()) if len(ticks) else 0
    found = _walls(query, centre, outline, velocity, pull) if walls else []
    found += [(int(ticks[at]), int(query.slots[at]))] if len(ticks) else []
    tick, met = min(found, key=itemgetter(0), default=(NEVER, NOBODY))
    if tick == NEVER:
        return None
    t = (tick - query.now) * float(query.k.clock[0].per_tick)
    flown = math.hypot(*((v + 0.5 * a * t) * t for v, a in zip(velocity, pull, strict=True)))
    return CastHit(*query.clock.moment(query.clock.total(tick)), met, flown)


def _walls(
    query: Query, centre: Point, outline: Outline, velocity: Point, pull: Point
) -> list[tuple[int, int]]:
    """Returns the contacts (tick, wall) of a cast body, as far ahead as with bodies; walls of x first."""
    clock, (core, r), walls, gaps = query.k.clock[0], outline, list[int](), list[Floats]()
    for axis, side in enumerate((clock.limits.width, clock.limits.height)):
        at, v, a, spots = centre[axis], velocity[axis], pull[axis], [corner[axis] for corner in core]
        ends = (-1, at, 0.0, r - min(spots), 1.0), (-2, side, at, r + max(spots), -1.0)
        for wall, *gap, way in ends if side and not query.periods[axis] else ():
            if a or way * v < 0.0:
                walls.append(wall - 2 * axis)
                gaps.append(np.array([*gap, way * v, way * a]))
    ticks, rows = np.full(len(walls), NEVER), np.array(gaps, dtype=np.float64).reshape(-1, 5)
    _composed(ticks_of_gaps)(query.packed, rows, ticks)
    last = query.now + query.ahead(velocity) if any(query.periods) else NEVER
    return [(tick, wall) for tick, wall in zip(ticks.tolist(), walls, strict=True) if tick < last]


def _theirs(query: Query) -> tuple[list[Outline], Integers]:
    if query.shapes:
        kinds, which = np.unique(query.forms, return_inverse=True)
        return [(query.shapes[each].core, query.shapes[each].radius) for each in kinds.tolist()], which
    radii, which = np.unique(query.radii, return_inverse=True)
    return [(DISC, radius) for radius in radii.tolist()], which


def _overlapping(query: Query, centre: Point, outline: Outline) -> Integers:
    """Returns the bodies that overlap a body around a place now, by more than rounding."""
    apart, reach = nearest_image(query.places - centre, query.periods), query.radii + circle_around(outline)
    few = np.flatnonzero(np.hypot(*apart.T) < reach)
    return few[gaps_to(*query.cores(few, outline[0]), apart[few]) < outline[1] - 1e-12 * reach[few]]


def _with_body(query: Query, centre: Point, outline: Outline, velocity: Point, pull: Point | None) -> Kernel:
    """Returns the tables that ``meet`` reads, with a body in a last row: anchored now, younger than all,
    without a contact so far, and of no kind; with a copy of the clock, which gets faults of overlaps."""
    k, n, periods = query.k, len(query.k.bodies), query.periods
    shaped = bool(query.shapes) or outline[0] != DISC
    accelerated_row, row = (ACCELERATED_SHAPED, SHAPED) if shaped else (ACCELERATED_BODY, BODY)
    bodies = record_table(row if pull is None else accelerated_row, n + 1)
    images, clock = record_table(IMAGE, n + 1 if any(periods) else 0), k.clock.copy()
    images[: len(k.images)] = k.images
    for name in {*k.bodies.dtype.names} & {*bodies.dtype.names}:  # supports are not needed
        bodies[name][:n] = k.bodies[name]
    x, y = (math.remainder(at, p) if p else at for at, p in zip(centre, periods, strict=True))
    body, limits = bodies[n], clock[0].limits
    body.x, body.y, body.vx, body.vy, body.radius = x, y, *velocity, circle_around(outline)
    body.anchor, body.last = query.now, NOBODY
    if pull is not None:
        body.ax, body.ay = pull
    # The search is right if ``fat`` is more than its rounding, and this body may fly further than any other.
    # # A period is enough: its speed has no limit only along an axis with walls, which has no images.
    clock[0].torus.foreseen = ahead = query.ahead(velocity) if any(periods) else 0
    flown = (abs(velocity[0]) + abs(velocity[1])) * (ahead * float(clock[0].per_tick))
    far = flown + MOST_PERIODS * sum(periods) + float(body.radius)
    limits.fat += min(2.0**-40 * far, max(periods))
    k = k._replace(bodies=bodies, images=images, clock=clock, rules=k.rules[:0])
    return _with_differences(query, k, outline) if shaped else k


def _with_differences(query: Query, k: Kernel, outline: Outline) -> Kernel:
    """Returns tables with a body of an outline in the last row, and its ``difference_table`` with all."""
    theirs, k.bodies["form"][query.slots] = _theirs(query)
    own = len(theirs)
    k.bodies["form"][-1] = own
    rows = [difference_row(each, outline) for each in theirs]
    rows += [difference_row(outline, each) for each in theirs]
    index = np.zeros((own + 1, own + 1))
    begins = 1 + index.size + np.cumsum([0, *map(len, rows)])[:-1]
    index[:own, own], index[own, :own] = begins[:own], begins[own:]
    return k._replace(numbers=np.concatenate([[own + 1], index.ravel(), *rows]))


def _is_first(query: Query, a: int, first: _First, planned: Planned) -> bool:
    """Returns True if nothing precedes a body's first event, for any of its bodies. Changes of plans precede
    contacts, except beginnings of passings at the start."""
    bodies = [(a, first.other)] if first.other < 0 else [(a, first.other), (first.other, a)]
    if first.kind != BEGUN and any(_turns(query, one, planned) <= first.tick for one, _ in bodies):
        return False
    return all(_first_of(query, one) == first._replace(other=two) for one, two in bodies)


def _turns(query: Query, body: int, planned: Planned) -> int:
    """Returns the tick at which a body's plan changes without a contact: by a command, at the edge of the
    support that it rests on or slides along, or when a command or a wall changes that support."""
    turn = planned.get(body, NEVER)
    if not query.composition.prepared.resting:
        return turn
    plan = query.k.bodies[body]
    turns = [planned.get(int(by), NEVER) for by in (plan.support, plan.second)]
    if query.composition.wall is not None:
        turns += [wall_of(query, int(by))[0] for by in (plan.support, plan.second) if by >= 0]
    return min(turn, int(plan.ledge), *turns)


def _first_of(query: Query, a: int, among: Integers | None = None, walls: bool = True) -> _First | None:
    others = query.slots if among is None else among
    found = [_First(NEVER, OF_PARTING, a)]
    if len(others):  # in one tick, the first by number
        ticks_of_kinds = _ticks_with(query, a, others).items()
        found += [_First(int(each.min()), kind, int(others[each.argmin()])) for kind, each in ticks_of_kinds]
    if walls and query.composition.wall is not None:
        tick, wall = wall_of(query, a)
        found.append(_First(tick, AT_WALL, wall))
    first = min(found, key=lambda each: (each.tick, each.kind))
    return first if first.tick < query.until else None


def _ticks_with(query: Query, a: int, others: Integers) -> dict[int, Integers]:
    """Returns, by the kind of event, the kernel's ticks of a body's contacts with each of others, and of
    begins and ends of their passings; NEVER without one, or if it is past."""
    pair, passing, k = query.composition.pair, query.composition.passing, query.k
    if pair is None:
        return {}
    meets = np.full(len(others), NEVER)
    _composed(ticks_of_partners, **query.composition.parts())(query.aside, a, others, meets)
    meets[meets < query.now] = NEVER
    if not passing:
        return {OF_PAIR: meets}
    ends = np.full(len(k.bodies), NEVER)
    for one, other in ((k.passings.a, k.passings.b), (k.passings.b, k.passings.a)):
        due = (one == a) & (k.passings.a >= 0)
        np.minimum.at(ends, other[due], k.passings.tick[due])
    begins = np.full(len(others), NEVER)
    pairs = query.overlapping[(query.overlapping == a).any(axis=1)]
    near = np.flatnonzero(np.isin(others, pairs.sum(axis=1) - a))
    if len(near):
        _begin(query, a, others, near, begins)
    return {BEGUN: begins, OF_PAIR: meets, OF_PARTING: ends[others]}


def waiting(query: Query) -> Integers:
    """Returns the pairs of slots, (m, 2), that begin to pass at the start and have no row yet."""
    pairs = query.overlapping if query.composition.passing else query.overlapping[:0]
    begins = np.full(len(pairs), NEVER)
    for a in np.unique(pairs[:, 0]).tolist():
        _begin(query, a, pairs[:, 1], np.flatnonzero(pairs[:, 0] == a), begins)
    return pairs[begins < NEVER]


def _begin(query: Query, a: int, others: Integers, near: Integers, begins: Integers) -> None:
    _composed(beginnings, **query.composition.parts())(query.aside, a, others, near, begins)


def wall_of(query: Query, a: int) -> tuple[int, int]:
    """Returns the tick of a body's contact with a wall, and the wall; NEVER without one."""
    wall = query.composition.wall
    assert wall is not None
    answer = np.zeros(2, dtype=np.int64)
    _composed(tick_of_wall, reach_wall=wall.reach_wall)(query.aside, a, answer)
    return int(answer[0]), int(answer[1])


def _composed(template: Callable[..., Any], **hooks: Any) -> Callable[..., Any]:
    return compose(template, hooks, "questions", Kernel)


reach_wall = to_be_filled_in


def ticks_of_partners(k: Kernel, body: int, others: Integers, ticks: Integers) -> None:
    """Template (``kernel.loop``): writes the ticks of a body's contacts with each of others."""
    k = disowned(k)
    barred = NOBODY if PERIODIC or UNEQUAL else barred_with(k, body)
    for i in range(len(others)):
        other = others[i]
        if other != body and other != barred:
            if PASSINGS and not PERIODIC and is_passing(k, body, other, 0, 0):
                continue
            first = elder(k, body, other)
            ticks[i] = meeting(k, first, body + other - first)


def beginnings(k: Kernel, body: int, others: Integers, near: Integers, ticks: Integers) -> None:
    """Template: writes the present tick for others that overlap a body at the start and pass it at once."""
    k = disowned(k)
    now = k.clock[0].now
    for i in range(len(near)):
        if overlap_now(k, body, others[near[i]], now):
            ticks[near[i]] = now


def tick_of_wall(k: Kernel, body: int, answer: Integers) -> None:
    """Template: writes the tick of a body's contact with a wall, and the wall."""
    k = disowned(k)
    answer[0], answer[1] = reach_wall(k, k.bodies[body])


def ticks_of_gaps(k: Kernel, gaps: Floats, ticks: Integers) -> None:
    """Template: writes the closing ticks of gaps, each far - near - radius with its slope and its pull."""
    k = disowned(k)
    clock = k.clock[0]
    for i in range(len(gaps)):
        far, near, radius, slope, pull = gaps[i]
        delay = reaches_edge(far, near, radius, slope, pull, clock.per_tick, clock.per_time)
        if delay != NEVER:
            ticks[i] = clock.now + delay


@hook
def shapes_touch(k: Kernel, early: int, late: int, plans: Plans) -> int:
    """Returns the ticks from the later anchor until a body and the cast one touch, or ``NEVER``."""
    row = int(k.numbers[1 + k.bodies[early].form * int(k.numbers[0]) + k.bodies[late].form])
    return int(enters(pointer(k.numbers), row, plans, 0, 0))


@hook
def overlaps(_: Kernel, early: int, late: int, dx: float, dy: float) -> float:
    """Returns 0: a body may be cast from the place of others."""
    return 0.0


def _first_of_two(touches: Callable[[Kernel, int, int, Plans], int]) -> Callable[[Kernel, int, int], int]:
    """Returns the hook ``meet`` of a body and one that is anchored now, without images."""

    @hook
    def first(k: Kernel, body: int, thrown: int) -> int:
        two = k.bodies[thrown]
        delay = touches(k, body, thrown, plans_of(k, k.bodies[body], two))
        return int(two.anchor + delay) if delay != NEVER else NEVER

    return first


first_disc, first_shape = _first_of_two(discs_touch), _first_of_two(shapes_touch)
first_shape_image = first_image_of(shapes_touch, overlaps)
meet = to_be_filled_in


def ticks_of_cast(k: Kernel, others: Integers, body: int, ticks: Integers) -> None:
    """Template: writes the ticks of contacts of a body in a row of the tables with each of others."""
    k = disowned(k)
    for i in range(len(others)):
        ticks[i] = meet(k, others[i], body)
