"""Audit of a run: a slow check, between two events, of every invariant, in O(n^2).

Every structure of the kernel is compared with its definition, every contact of two near bodies is computed
again, every two bodies that touch must be a candidate pair, and the broad phase checks its own invariants.
The first violation ends the run with an ``AuditError``, which is also a ``MissedContactError`` if a contact
would be missed.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.arrays import Integers
from kinetile.errors import AuditError, KinetileError, UnawaitedContactError
from kinetile.kernel.chords import as_seen
from kinetile.kernel.compiled import compose, disowned, python_of, smaller, to_be_filled_in
from kinetile.kernel.features import PAIRS, PASSINGS, PERIODIC, RESTING, UNEQUAL, WALLED
from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop.calendar import SOON, rank
from kinetile.kernel.loop.predictions import meeting
from kinetile.kernel.passings import is_passing, lets_pass
from kinetile.kernel.plan import Plan, positions_after, velocities_after
from kinetile.kernel.skin import box_gaps, reaches_of
from kinetile.kernel.tables import (
    CHORD,
    GUESS,
    NEVER,
    NOBODY,
    NOT_ASKED,
    PAIR,
    PARTING,
    SPARE,
    STRUCTURAL,
    WALL,
    Kernel,
    Records,
    elder,
    is_there,
)
from kinetile.plugin.calling import place_of
from kinetile.plugin.registry import sentence
from kinetile.run.candidates import named_near, pairs_of_named
from kinetile.run.compose import Composition

Pairs = npt.NDArray[np.int32]

OWN = "the phase's own audit: "
"""The begin of a sentence of the phase's own audit: its author reads it before any other."""

ROWS_AT_ONCE = 1 << 9
"""The number of bodies compared with all others at a time: it bounds the memory of an audit."""

BLOCK = 1 << 18
"""The number of places of the lookup at a time."""


def of_calendar(k: Kernel) -> Iterator[str]:
    """Every body with an event is once in the list of its slice, and no other body is; entries of the slice
    that the calendar has reached come first, in order."""
    clock = k.clock[0]
    keys, days = k.queue.key.tolist(), (k.queue.key >> clock.calendar.shift).tolist()
    after, before, marks = k.links.next.tolist(), k.links.prev.tolist(), k.marks.tolist()
    bodies, rings = len(k.bodies), k.rings.tolist()
    columns = (k.queue.number, k.queue.key, k.queue.kind, k.queue.number[k.queue.partner])
    ranks = [rank(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
    found, reached = 0, int(clock.calendar.slice)
    for at, body in enumerate(rings):
        previous = ~at
        if bool(marks[at >> 6] >> (at & 63) & 1) != (body < bodies):
            yield f"the mark of slice {at} of the calendar is not true"
        while body < bodies and found <= bodies:
            if before[body] != previous:
                yield f"the list of slice {at} of the calendar cannot be read backwards at body {body}"
                return
            if days[body] % len(rings) != at or keys[body] == NEVER:
                yield f"body {body} is in slice {at} of the calendar, where it does not belong"
            if previous >= 0 and days[body] == reached and ranks[body] < ranks[previous]:
                yield f"slice {at} of the calendar is out of order: body {previous} is before body {body}"
            previous, body, found = body, after[body], found + 1
        if body != bodies:
            yield f"the list of slice {at} of the calendar does not end"
            return
    waiting = [body for body, key in enumerate(keys) if key != NEVER]
    await_something, counted = len(waiting), k.counts[0].queued
    if not found == await_something == counted:
        text = f"{found} bodies are in the calendar, and {await_something} await something"
        yield f"{text}; {counted} are counted"
    if waiting and min(days[body] for body in waiting) < clock.calendar.slice:
        yield "a body is filed before the slice in which the head is sought"


def of_entries(k: Kernel) -> Iterator[str]:
    """Each body is filed under the first event of its entry."""
    queue = k.queue
    contact = np.where(queue.exact == 1, PAIR, GUESS)
    known = queue.wall != NOT_ASKED
    leave = k.traits.leave if len(k.traits) else np.full_like(queue.certificate, NEVER)
    choices: list[Any] = [queue.certificate, queue.tick, np.where(known, queue.wall, NEVER), leave]
    constant: list[Any] = [STRUCTURAL, contact, WALL, PARTING]
    if len(k.shadows):
        choices.append(k.bodies.end)
        constant.append(CHORD)
    kinds = np.stack([np.broadcast_to(kind, contact.shape) for kind in constant])
    key = np.min(choices, axis=0)
    kind = np.where(choices == key, kinds, PARTING + 1).min(axis=0)
    for body in np.flatnonzero(queue.key != key):
        filed, wanted = said_tick(queue.key[body]), said_tick(key[body])
        yield f"body {body} is filed {filed}, but what it awaits comes {wanted}"
    for body in np.flatnonzero((queue.kind != kind) & (key != NEVER)):
        yield f"what awaits body {body} is filed as of kind {queue.kind[body]}, and is of kind {kind[body]}"
    for body in np.flatnonzero(queue.guard < queue.tick):
        yield f"body {body} has a contact before its first one"


def of_places(k: Kernel) -> Iterator[str]:
    """The rows of positions at the common clock agree with the plans."""
    clock = k.clock[0]
    back = (clock.origin - k.bodies.anchor) * clock.per_tick
    plans = Plan.of(k.bodies)
    for after, vector in (positions_after, ("x", "y")), (velocities_after, ("vx", "vy")):
        wrong = after(plans, back) != np.stack([k.places[name] for name in vector], axis=-1)
        for body in np.flatnonzero(wrong.any(axis=1)):
            yield f"the place of body {body} at the common clock is not that of its plan"


def of_lookup(k: Kernel) -> Iterator[str]:
    """Every pair is there once, at the end of its search: no place from its home on is empty."""
    lookup, live = k.lookup, k.pairs.a >= 0
    held = np.zeros(len(live), dtype=np.bool_)
    held[lookup[lookup >= 0]] = True
    if not np.array_equal(held, live) or (lookup >= 0).sum() != live.sum():
        yield f"the lookup does not hold each of the {live.sum()} pairs of the pair set once"
        return
    a, b, mask = k.pairs.a[live], k.pairs.b[live], len(lookup) - 1
    ranks = np.sort(a * np.int64(len(k.bodies)) + b)  # np.unique takes a minute for 20 million
    if (a >= b).any() or (ranks[1:] == ranks[:-1]).any():
        yield "a pair is in the pair set twice, or in no order"
    empty = int(np.flatnonzero(lookup < 0)[-1]) - len(lookup) if len(lookup) else 0
    for first in range(0, len(lookup), BLOCK):
        some = lookup[first : first + BLOCK]
        place = np.arange(first, first + len(some))
        before = np.maximum.accumulate(np.where(some < 0, place, empty))
        taken, empty = some >= 0, int(before[-1])
        a, b = (of[some[taken]].astype(np.int64) for of in (k.pairs.a, k.pairs.b))
        mixed = (a * 73856093) ^ (b * 19349663)
        home = (mixed ^ (mixed >> 15)) & mask
        if ((place[taken] - home) & mask >= place[taken] - before[taken]).any():
            yield "a pair of the pair set cannot be found"


def of_lists(table: Any, firsts: Any, what: str, counted: int, first_free: int) -> Iterator[str]:
    """Every pair of a table is once in the list of each of its bodies; all other records are free. The check
    follows all lists together, a step at a time: there may be millions of pairs."""
    a, b = table.a, table.b
    live = np.flatnonzero(a >= 0)
    if len(live) != int(counted):
        yield f"there are {len(live)} pairs in {what}, but the kernel counts {int(counted)}"
    if ((b[live] < 0) | (a[live] == b[live])).any():
        yield f"a pair in {what} is not of two bodies"
    body = np.flatnonzero(firsts >= 0)
    at, before, listed = firsts[body], np.full(len(body), NOBODY), 0
    while len(at) and listed <= 2 * len(live):
        is_a = a[at] == body
        odd = ~is_a & (b[at] != body)
        if odd.any():
            wrong = at[odd][0]
            yield f"the list of body {body[odd][0]} has the pair ({a[wrong]}, {b[wrong]}) in it"
            return
        back = np.where(is_a, table.prev_a[at], table.prev_b[at]) != before
        if back.any():
            yield f"the list of body {body[back][0]} cannot be read backwards"
        listed += len(at)
        before, at = at, np.where(is_a, table.next_a[at], table.next_b[at])
        goes_on = at >= 0
        body, before, at = body[goes_on], before[goes_on], at[goes_on]
    if listed != 2 * len(live):
        yield f"the bodies' lists have {listed} entries for {len(live)} pairs"
    free = len(followed(table.next_a.tolist(), int(first_free), len(table)))
    if free + len(live) != len(table):
        yield f"of {len(table)} records of {what} {len(live)} are taken and {free} free"


def followed(after: list[int], at: int, most: int) -> set[int]:
    """Returns at most ``most`` elements of a list that is linked through a column."""
    seen: set[int] = set()
    while at >= 0 and at not in seen and len(seen) <= most:
        seen.add(at)
        at = after[at]
    return seen


def said_tick(tick: int) -> str:
    """Returns a tick in words."""
    return "never" if tick == NEVER else f"at tick {tick}"


part = gap = to_be_filled_in


def compute_partings(k: Kernel, pairs: Records, parting: Any) -> None:
    """Template, as in ``kernel.loop``: writes the tick of each pair's parting."""
    k = disowned(k)
    for at in range(len(pairs)):
        if PERIODIC:
            k.clock[0].torus.m = pairs[at].m
            k.clock[0].torus.n = pairs[at].n
        parting[at] = part(k, pairs[at].a, pairs[at].b)


def of_passings(k: Kernel, tables: Any, composition: Composition, place: Any) -> Iterator[str]:
    """The passing pairs are the pairs that overlap and may pass; each parts at the tick of its plans."""
    if composition.pair is None or not composition.passing:
        return
    table, lists = k.passings, k.clock[0].lists
    yield from of_lists(table, k.passers, "the passings", lists.passings, lists.free_passing)
    live = np.flatnonzero(table.a >= 0)
    passings, parting = table[live], np.full(len(live), NEVER)
    compose(compute_partings, composition.parts(), "parting", Kernel)(tables, passings, parting)
    due = np.maximum(parting, table.begun[live] + 1)
    number, traits = k.queue.number, k.traits
    for at in np.flatnonzero(table.tick[live] != due).tolist():
        a, b = int(number[passings.a[at]]), int(number[passings.b[at]])
        text = f"bodies {a} and {b} part {said_tick(table.tick[live][at])} as noted"
        yield f"{text}, but by their plans {said_tick(due[at])}"
    leave = np.full(len(number), NEVER)
    np.minimum.at(leave, table.a[live], table.tick[live])
    for body in np.flatnonzero((leave != traits.leave) & (number != NOBODY)).tolist():
        yield f"body {number[body]} waits for a parting {said_tick(traits.leave[body])}, and none is due then"
    inside = np.bincount(np.append(table.a[live], table.b[live]), minlength=len(number))
    for body in np.flatnonzero((inside != traits.inside) & (number != NOBODY)).tolist():
        text = f"body {number[body]} is counted to pass {traits.inside[body]} others"
        yield f"{text}, and passes {inside[body]}"
    between = _gaps(tables, composition)
    yield from _overlapping(k, between, place, set(passings[["a", "b", "m", "n"]].tolist()))


def gap_between(k: Kernel, a: int, b: int, dx: float, dy: float) -> float:
    """Template, as ``advance``: returns the distance of two shapes."""
    k = disowned(k)
    return float(gap(k, k.bodies[a].form, k.bodies[b].form, dx, dy))


def _gaps(tables: Any, composition: Composition) -> Callable[..., float] | None:
    gap = composition.gap
    return None if gap is None else partial(compose(gap_between, {"gap": gap}, "gap", Kernel), tables)


def _overlapping(
    k: Kernel, between: Callable[..., float] | None, place: Any, passing: set[tuple[int, int, int, int]]
) -> Iterator[str]:
    """Two bodies that overlap by more than rounding, through an image, and may pass, pass through it; for
    shapes ``between`` computes the overlap."""
    kinds, kind, radius, number = k.clock[0].kinds, k.traits.kind, k.bodies.radius, k.queue.number
    passes = np.array([bool(python_of(lets_pass)(rule)) for rule in k.rules])
    periods = np.array([k.clock[0].torus.x, k.clock[0].torus.y])
    turns = np.column_stack([k.images.kx, k.images.ky]) if len(k.images) else np.zeros((len(place), 2), "i8")
    steps = np.array(list(product(*(range(-1, 2) if period else range(1) for period in periods))))
    for a in np.flatnonzero(number >= 0).tolist():
        later = np.flatnonzero(passes[kind[a] * (kinds + 1) + kind] & (number > number[a]))
        if not len(later):
            continue  # in most scenes with rules few bodies are of kinds that pass
        away = place[later] - place[a]
        image = steps[:, None] - np.rint(away / np.where(periods > 0.0, periods, math.inf))
        away, reach = away + image * periods, radius[later] + radius[a]
        for step, at in np.argwhere(np.hypot(*away.transpose(2, 0, 1)) - reach < -1e-9 * reach).tolist():
            b = int(later[at])
            if between is not None:
                meet = math.isfinite(k.mass[a]) or math.isfinite(k.mass[b])
                if not meet or not between(a, b, *away[step, at].tolist()) < -1e-9 * reach[at]:
                    continue
            if (a, b, *(image[step, at] - turns[b] + turns[a]).astype(np.int64).tolist()) not in passing:
                yield f"bodies {number[a]} and {number[b]} overlap and are not passing each other"


class Complaint(NamedTuple):
    """A violation, and the bodies whose contact it would miss."""

    text: str
    bodies: tuple[int, ...] = ()


def check_all(
    k: Kernel, tables: Any, composition: Composition, delta: float, time: float, events: int
) -> None:
    """Raises AuditError for the first violation, UnawaitedContactError if a contact would be missed;
    ``tables`` are the packed ``k``."""
    when = f"at time {time!r}, after {events} events under broad phase {composition.broad_phase!r}"
    try:
        for text, bodies in complaints(k, tables, composition, delta):
            if bodies:
                raise UnawaitedContactError(f"{when}: {text}", time=time, bodies=bodies)
            raise AuditError(f"{when}: {text}")
    except (KinetileError, KeyboardInterrupt):
        raise
    except (Exception, SystemExit) as error:  # corrupt tables, or the phase's own audit
        text = f"the audit cannot be finished: {sentence(error)}{place_of(error)}"
        raise AuditError(f"{when}: {text}") from error


def complaints(k: Kernel, tables: Any, composition: Composition, delta: float) -> Iterator[Complaint]:
    """Yields all present violations; ``delta`` is the skin. The phase's own audit precedes its consequences:
    it gives the reason why a body is not near another."""
    broad = composition.broad
    lists = k.clock[0].lists
    for check in (of_calendar, of_entries, of_places, of_lookup):
        yield from map(Complaint, check(k))
    yield from map(Complaint, of_lists(k.pairs, k.firsts, "the pair set", lists.pairs, lists.free_pair))
    if broad.audit is not None:
        yield from (Complaint(f"{OWN}{text}") for text in broad.audit(as_seen(k), broad.state))
    near = np.zeros((0, 2), dtype=np.int32)
    if composition.pair is not None:
        named = named_near(k, composition, tables)
        yield from map(Complaint, _near(k, named))
        near = pairs_of_named(named)
    yield from _contact_times(k, tables, composition, near)
    repaired = bool((k.queue.certificate > k.clock[0].now).all())  # no certificate fails at this tick
    if composition.pair is not None and repaired:
        between = _gaps(tables, composition) if broad.outlines else None
        yield from _touching(k, near, delta, composition.prepared.periods, between)
    yield from map(Complaint, of_passings(k, tables, composition, positions_now(k)))


def _near(k: Kernel, named: Pairs) -> Iterator[str]:
    """``near`` names present bodies, and is symmetric, and there is room for the output."""
    n, room = len(k.bodies), len(k.near) - SPARE
    wrong = (named[:, 1] < 0) | (named[:, 1] >= n)
    wrong[~wrong] = k.queue.number[named[~wrong, 1]] < 0
    for body, other in named[wrong].tolist():
        yield f"near names {other} for body {body}, and there is no such body"
    number = np.bincount(named[:, 0], minlength=n)
    for body in np.flatnonzero(number > room):
        yield f"near names {number[body]} bodies for body {body}, and there is room for {room}"
    code = named[:, 0].astype(np.int64) * n + named[:, 1]
    back = named[:, 1].astype(np.int64) * n + named[:, 0]
    for body, other in named[~np.isin(code, back)].tolist():
        yield f"body {other} is near body {body}, but body {body} is not near body {other}"


def _contact_times(k: Kernel, tables: Any, composition: Composition, near: Pairs) -> Iterator[Complaint]:
    """The predictions of the entries are true: all contacts are computed again, and exactly."""
    queue, partner = k.queue, k.queue.partner
    known = np.flatnonzero(partner >= 0)
    known = known[queue.seen[known] == k.stamps[partner[known]]]
    expected = np.sort(np.column_stack([known, partner[known]]).astype(np.int32), axis=1)
    every = np.concatenate([near, expected])
    meetings, images, walls = _computed_again(k, tables, composition, every)
    yield from _of_walls(k, walls)
    yield from _of_partners(k, known, meetings[len(near) :], images[len(near) :])
    meetings = meetings[: len(near)]
    if composition.mixed:  # bounds do not cover the time after the end of a chord
        meetings = np.where(meetings < k.bodies.end[near].min(axis=1, initial=NEVER), meetings, NEVER)
    yield from _of_near(k, near, meetings)


def _computed_again(
    k: Kernel, tables: Any, composition: Composition, pairs: Pairs
) -> tuple[Integers, Integers, Integers]:
    """Returns the ticks of the pairs' contacts by their plans, NEVER if barred, the images, (n, 2), of these
    contacts, and the ticks of the bodies' contacts with walls."""
    meetings, walls = np.full(len(pairs), NEVER), np.full(len(k.bodies), NEVER)
    images = np.zeros((len(pairs), 2), np.int64)
    aside = tables.replaced("clock", k.clock.copy())  # a fault of a narrow phase must not end the run
    compose(compute_again, composition.parts(), "audit", Kernel)(aside, pairs, meetings, images, walls)
    return meetings, images, walls


def _of_walls(k: Kernel, walls: Integers) -> Iterator[Complaint]:
    """No body reaches a wall before its wall is computed, nor soon after; computed wall ticks are right."""
    key, kind, known = k.queue.key, k.queue.kind, k.queue.wall
    late = (walls < key) | ((walls == key) & (kind == PAIR) & (key != NEVER))
    late |= (known == NOT_ASKED) & (walls != NEVER) & (walls - SOON <= key)
    for body in np.flatnonzero(late).tolist():
        text = f"body {body} is looked at {said_tick(key[body])} at the earliest"
        yield Complaint(f"{text}, but by its plan it meets a wall {said_tick(walls[body])}", (body,))
    for body in np.flatnonzero((known != NOT_ASKED) & (known != walls)).tolist():
        text = f"the contact of body {body} and a wall is awaited {said_tick(known[body])}"
        yield Complaint(f"{text}, but by its plan they meet {said_tick(walls[body])}", (body,))


def _of_partners(k: Kernel, known: Integers, meetings: Integers, images: Integers) -> Iterator[Complaint]:
    """A body meets its partner at the tick of its entry, or not before it if that is a guess; a contact with
    an exact tick is awaited through the right image."""
    tick, exact = k.queue.tick[known], k.queue.exact[known] == 1
    pairs = np.sort(np.column_stack([known, k.queue.partner[known]]), axis=1).tolist()
    for at in np.flatnonzero(np.where(exact, meetings != tick, meetings < tick)).tolist():
        a, b = pairs[at]
        text = f"the contact of bodies {a} and {b} is awaited {said_tick(tick[at])}"
        text += "" if exact[at] else " at the earliest"
        yield Complaint(f"{text}, but by their plans they meet {said_tick(meetings[at])}", (a, b))
    found = np.column_stack([k.images.m, k.images.n])[known] if len(k.images) else images
    for at in np.flatnonzero(exact & (tick != NEVER) & (found != images).any(axis=1)).tolist():
        a, b = pairs[at]
        text = f"the contact of bodies {a} and {b} is awaited through the image {found[at].tolist()}"
        yield Complaint(f"{text}, but by their plans it is through {images[at].tolist()}", (a, b))


def _of_near(k: Kernel, near: Pairs, meetings: Integers) -> Iterator[Complaint]:
    """Coverage: in every near pair, the body whose prediction included the other last has a bound not after
    their contact: ``tick`` for its partner, while that keeps its plan, and ``guard`` for all others. If its
    entry is due at the contact's tick, it precedes the pair's turn."""
    queue, number = k.queue, k.queue.number.astype(np.int64)
    stamp, n = k.stamps, int(number.max(initial=0)) + 1
    places = np.sort(number[near], axis=1)
    rank = places[:, 0] * n + places[:, 1]
    covered, earliest = np.zeros(len(near), dtype=bool), np.full(len(near), NEVER)
    for body, other in (near.T, near.T[::-1]):
        partner = queue.partner[body]
        knows = (partner == other) & (queue.seen[body] == stamp[other])
        bound = np.where(knows, queue.tick[body], queue.guard[body])
        one, two = number[body], number[partner]
        first, second = np.minimum(one, two), np.maximum(one, two)
        key = queue.key[body]
        in_time = (key < meetings) | (queue.kind[body] < PAIR) | (first * n + second <= rank)
        covered |= (bound <= meetings) & (key <= meetings) & in_time
        earliest = np.minimum(earliest, bound)
    for number in np.flatnonzero(~covered & (meetings != NEVER)).tolist():
        a, b = near[number].tolist()
        text = f"the contact of bodies {a} and {b} is awaited {said_tick(earliest[number])} at the earliest"
        if earliest[number] <= meetings[number]:
            text = f"bodies {a} and {b} are looked at too late"
        yield Complaint(f"{text}, but by their plans they meet {said_tick(meetings[number])}", (a, b))


reach_wall = to_be_filled_in


def compute_again(k: Kernel, pairs: Pairs, meetings: Integers, images: Integers, walls: Integers) -> None:
    """Template, as in ``kernel.loop``: writes the ticks of contacts of pairs, and of bodies and walls."""
    k = disowned(k)
    bodies = k.bodies
    if WALLED:
        for body in range(len(bodies)):
            if not is_there(k, body):  # with gravity, bodies without velocity reach walls, too
                continue
            walls[body] = reach_wall(k, bodies[body])[0]
            if RESTING:
                walls[body] = smaller(walls[body], bodies[body].ledge)
    if PAIRS:
        for pair in range(len(pairs)):
            a = pairs[pair, 0]
            b = pairs[pair, 1]
            past = not (PERIODIC or UNEQUAL) and bodies[a].last == b and bodies[b].last == a
            if PASSINGS and not PERIODIC:
                past = past or is_passing(k, a, b, 0, 0)
            if not past:
                first = elder(k, a, b)
                meetings[pair] = meeting(k, first, a + b - first)
                if PERIODIC:
                    images[pair, 0] = k.clock[0].torus.m
                    images[pair, 1] = k.clock[0].torus.n


def _touching(
    k: Kernel,
    near: Pairs,
    delta: float,
    periods: tuple[float, float],
    between_shapes: Callable[..., float] | None,
) -> Iterator[Complaint]:
    """Every two bodies whose circles and boxes are closer than a skin, through any image, are a pair; for a
    phase with ``outlines``, only if their outlines are closer."""
    n = len(k.bodies)
    held = near[:, 0].astype(np.int64) * n + near[:, 1]
    slots = np.flatnonzero(k.queue.number >= 0)
    place, radius, sides = positions_now(k, slots), k.bodies.radius[slots], reaches_of(k)[slots]
    for first in range(0, len(place), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        between = [place[rows, axis, None] - place[None, :, axis] for axis in range(2)]
        for each, period in zip(between, periods, strict=True):
            if period:
                each -= period * np.rint(each / period)
        apart = np.hypot(*between) - (radius[rows, None] + radius[None, :])
        apart = np.maximum(apart, box_gaps(between, sides[rows], sides) + 2.0 * delta)
        at, other = np.nonzero(apart <= delta)
        a, b = slots[at + first], slots[other]
        for missed in np.flatnonzero((a < b) & ~np.isin(a * n + b, held)).tolist():
            one, two, gap = int(a[missed]), int(b[missed]), apart[at[missed], other[missed]]
            if between_shapes is not None:
                gap = between_shapes(two, one, *(float(each[at[missed], other[missed]]) for each in between))
                if gap > delta:
                    continue
            text = f"bodies {one} and {two} touch (gap {gap:.3g}) and are not a candidate pair"
            yield Complaint(text, (one, two))
