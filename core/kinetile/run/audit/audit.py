"""Auditing a run: between two events, check slowly everything that must hold.

Every structure of the kernel is compared with what it stands for, every contact of two bodies that are near
is asked anew and held against what the queue says of it, every two bodies are looked at whether they are a
candidate pair where they must be, and the broad phase is asked for its own invariants. The first thing that
does not hold ends the run with an ``AuditError``, close to the event that broke it; where a contact would be
missed it is a ``MissedContactError`` as well.

The cost is O(n^2) an audit; ``Simulation(..., audit=N)`` audits every N contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.errors import AuditError, KinetileError, UnawaitedContactError
from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop.predictions import meeting
from kinetile.kernel.loop.presence import elder
from kinetile.kernel.loop.rules import is_passing
from kinetile.kernel.tables import NEVER, NOT_ASKED, PAIR, SPARE, Kernel, Records
from kinetile.plugin.calling import place_of
from kinetile.plugin.discovery import sentence
from kinetile.run.audit.passings import of_passings
from kinetile.run.audit.tables import of_calendar, of_entries, of_pair_set, of_places, said_tick
from kinetile.run.composition import Composition
from kinetile.run.questions.candidates import named_near, pairs_of_named

__all__ = ["Complaint", "check_all", "complaints"]

Integers = npt.NDArray[np.int64]
Pairs = npt.NDArray[np.int32]

ROWS = 1 << 9
"""Bodies compared with all others at a time: bounds the memory of an audit."""


class Complaint(NamedTuple):
    """Something that must hold and does not, and the bodies whose contact would be missed by it."""

    said: str
    bodies: tuple[int, ...] = ()


def check_all(k: Kernel, composition: Composition, delta: float, time: float, events: int) -> None:
    """Raise AuditError for the first thing that does not hold now, at a time and after so many events; an
    UnawaitedContactError where it would make a contact be missed. ``delta`` is the skin."""
    who = f"at time {time!r}, after {events} events under broad phase {composition.broad_phase!r}"
    try:
        for said, bodies in complaints(k, composition, delta):
            if bodies:
                raise UnawaitedContactError(f"{who}: {said}", time=time, bodies=bodies)
            raise AuditError(f"{who}: {said}")
    except (KinetileError, KeyboardInterrupt):
        raise
    except (Exception, SystemExit) as error:  # tables that are not what they were, or the phase's audit
        said = f"the audit cannot be finished: {sentence(error)}{place_of(error)}"
        raise AuditError(f"{who}: {said}") from error


def complaints(k: Kernel, composition: Composition, delta: float) -> Iterator[Complaint]:
    """Yield everything that does not hold now; ``delta`` is the skin."""
    broad, columns = composition.broad, _columns(k)
    yield from map(Complaint, of_calendar(columns))
    yield from map(Complaint, of_entries(columns))
    yield from map(Complaint, of_places(columns))
    yield from map(Complaint, of_pair_set(columns))
    near = np.zeros((0, 2), dtype=np.int32)
    if composition.pair is not None:
        named = named_near(k, composition)
        yield from map(Complaint, _near(columns, named))
        near = pairs_of_named(named)
    yield from _contact_times(k, columns, composition, near)
    if composition.pair is not None and not _repairs_are_due(columns):
        yield from _touching(columns, positions_now(k), near, delta)
    yield from map(Complaint, of_passings(k, columns, composition, positions_now(k)))
    if broad.audit is not None:
        yield from map(Complaint, broad.audit(k, broad.state))


class _Columns:
    """A table's columns as attributes, at once: each time that a record array is asked for one it looks it
    up, which would be most of an audit's time."""

    def __init__(self, table: Records) -> None:
        self._length = len(table)
        plain = table.view(np.ndarray)
        for name in plain.dtype.names or ():
            setattr(self, name, plain[name])

    def __len__(self) -> int:
        return self._length

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)  # for whoever checks types: the columns are set in the constructor


def _columns(k: Kernel) -> Any:
    """Return the tables with columns as attributes; those of one record with their numbers."""
    tables: dict[str, Any] = {}
    for name, table in zip(k._fields, k, strict=True):
        names = table.dtype.names
        if names is None:
            tables[name] = table
        elif name in ("clock", "counts"):
            tables[name] = SimpleNamespace(**dict(zip(names, table[0].item(), strict=True)))
        else:
            tables[name] = _Columns(table)
    return SimpleNamespace(**tables)


def _repairs_are_due(k: Any) -> bool:
    """Whether a structural certificate fails at this very tick and has not been repaired yet."""
    return bool((k.queue.own <= k.clock.now).any())


def _near(k: Any, named: Pairs) -> Iterator[str]:
    """Whoever is near a body is a body, which has that one near it; and there is room for the answer."""
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


def _contact_times(k: Kernel, columns: Any, composition: Composition, near: Pairs) -> Iterator[Complaint]:
    """What the entries say of contacts is true, when all of them are asked anew and exactly."""
    queue, bodies = columns.queue, columns.bodies
    partner = queue.partner
    known = np.flatnonzero(partner >= 0)
    known = known[queue.seen[known] == bodies.stamp[partner[known]]]
    expected = np.sort(np.column_stack([known, partner[known]]).astype(np.int32), axis=1)
    meetings, walls = _asked_anew(k, composition, np.concatenate([near, expected]))
    yield from _of_walls(columns, walls)
    yield from _of_partners(columns, known, meetings[len(near) :])
    yield from _of_near(columns, near, meetings[: len(near)])


def _asked_anew(k: Kernel, composition: Composition, pairs: Pairs) -> tuple[Integers, Integers]:
    """Return when each pair, and each body and a wall, meet by their plans; NEVER for who have just met."""
    pair, wall = composition.pair, composition.wall
    passing = pair is not None and composition.rules is not None and composition.rules.passing
    parts: dict[str, Any] = {"PAIRS": pair is not None, "WALLS": wall is not None, "PASSING": passing}
    if pair is not None:
        parts["meet"] = pair.meet
    if wall is not None:
        parts["reach_wall"] = wall.reach_wall
    meetings, walls = np.full(len(pairs), NEVER), np.full(len(k.bodies), NEVER)
    aside = k._replace(clock=k.clock.copy())  # a narrow phase may blame; here nobody is to hear it
    compose(ask_again, parts, "audit", Kernel)(aside, pairs, meetings, walls)
    return meetings, walls


def _of_walls(k: Any, walls: Integers) -> Iterator[Complaint]:
    """No body is at a wall before it is looked at, and what is known of a wall is so."""
    key, kind, known = k.queue.key, k.queue.kind, k.queue.wall
    for body in np.flatnonzero((walls < key) | ((walls == key) & (kind == PAIR) & (key != NEVER))).tolist():
        said = f"body {body} is looked at {said_tick(key[body])} at the earliest"
        yield Complaint(f"{said}, but by its plan it meets a wall {said_tick(walls[body])}", (body,))
    for body in np.flatnonzero((known != NOT_ASKED) & (known != walls)).tolist():
        said = f"the contact of body {body} and a wall is awaited {said_tick(known[body])}"
        yield Complaint(f"{said}, but by its plan they meet {said_tick(walls[body])}", (body,))


def _of_partners(k: Any, known: Integers, meetings: Integers) -> Iterator[Complaint]:
    """A body meets its partner at the tick of its entry, or not before where that is a guess."""
    tick, exact = k.queue.tick[known], k.queue.exact[known] == 1
    for at in np.flatnonzero(np.where(exact, meetings != tick, meetings < tick)).tolist():
        a, b = sorted((int(known[at]), int(k.queue.partner[known[at]])))
        said = f"the contact of bodies {a} and {b} is awaited {said_tick(tick[at])}"
        said += "" if exact[at] else " at the earliest"
        yield Complaint(f"{said}, but by their plans they meet {said_tick(meetings[at])}", (a, b))


def _of_near(k: Any, near: Pairs, meetings: Integers) -> Iterator[Complaint]:
    """Coverage: of every near pair one body knows when they meet at the earliest, and is looked at by then.

    That is the body that looked at the other last. It knows its partner by ``tick``, as long as the partner
    has the plan that it had then, and everybody else by ``guard``. At the very tick of the contact it is
    looked at before the pair's turn comes: as something that precedes pairs, or as a pair that precedes this.
    """
    queue, number = k.queue, k.queue.number.astype(np.int64)
    stamp, n = k.bodies.stamp, int(number.max(initial=0)) + 1
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
        said = f"the contact of bodies {a} and {b} is awaited {said_tick(earliest[number])} at the earliest"
        if earliest[number] <= meetings[number]:
            said = f"bodies {a} and {b} are looked at too late"
        yield Complaint(f"{said}, but by their plans they meet {said_tick(meetings[number])}", (a, b))


PAIRS = WALLS = PASSING = True
reach_wall = to_be_filled_in


def ask_again(k: Kernel, pairs: Pairs, meetings: Integers, walls: Integers) -> None:
    """Write down when each pair, and each body and a wall, meet; a template, as ``kernel.loop`` has."""
    k = disowned(k)
    bodies = k.bodies
    if WALLS:
        for body in range(len(bodies)):
            walls[body] = reach_wall(k, bodies[body])[0]
    if PAIRS:
        for pair in range(len(pairs)):
            a = pairs[pair, 0]
            b = pairs[pair, 1]
            past = bodies[a].last == b and bodies[b].last == a
            if PASSING:
                past = past or is_passing(k, a, b)
            if not past:
                first = elder(k, a, b)
                meetings[pair] = meeting(k, first, a + b - first)


def _touching(k: Any, place: Any, near: Pairs, delta: float) -> Iterator[Complaint]:
    """Every two bodies closer than a skin are a candidate pair."""
    radius = k.bodies.radius
    held = set(map(tuple, near.tolist()))
    slots = np.flatnonzero(k.queue.number >= 0)
    place, radius = place[slots], radius[slots]
    for first in range(0, len(place), ROWS):
        rows = slice(first, first + ROWS)
        apart = np.hypot(
            place[rows, 0, None] - place[None, :, 0], place[rows, 1, None] - place[None, :, 1]
        ) - (radius[rows, None] + radius[None, :])
        for a, b in np.argwhere(apart <= delta):
            one, two = int(slots[int(a) + first]), int(slots[b])
            if one < two and (one, two) not in held:
                said = f"bodies {one} and {two} touch (gap {apart[a, b]:.3g}) and are not a candidate pair"
                yield Complaint(said, (one, two))
