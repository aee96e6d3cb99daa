"""Auditing a run: between two events, check slowly everything that must hold.

Every structure of the kernel is compared with what it stands for, every contact time is asked anew, every two
bodies are looked at whether they are a candidate pair where they must be, and the broad phase is asked for
its own invariants. The first thing that does not hold ends the run with an ``AuditError``, close to the event
that broke it; where a contact would be missed it is a ``MissedContactError`` as well.

The cost is O(n^2) an audit; ``Simulation(..., audit=N)`` audits every N contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kinetile.errors import AuditError, KinetileError, UnawaitedContactError
from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.flight import positions_now
from kinetile.kernel.tables import NEVER, Kernel
from kinetile.plugin.calling import place_of
from kinetile.plugin.discovery import sentence
from kinetile.run.composition import Composition

__all__ = ["Complaint", "check_all", "complaints"]

Integers = npt.NDArray[np.int64]

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
    broad = composition.broad
    yield from map(Complaint, _queue(k))
    yield from map(Complaint, _pairs(k))
    yield from _contact_times(k, composition)
    if composition.pair is not None and not _repairs_are_due(k):
        yield from _candidates(k, delta)
    if broad.audit is not None:
        yield from map(Complaint, broad.audit(k, broad.state))


def _repairs_are_due(k: Kernel) -> bool:
    """Whether a structural certificate fails at this very tick and has not been repaired yet."""
    clock = k.clock[0]
    waiting = k.queue[: int(clock.queued)]
    return bool(((waiting.tick <= clock.now) & (waiting.certificate < clock.structural)).any())


def _queue(k: Kernel) -> Iterator[str]:
    """The queue is a heap in the order of events, and every certificate knows its place in it."""
    clock = k.clock[0]
    size = int(clock.queued)
    tick, certificate = k.queue.tick[:size], k.queue.certificate[:size]
    if size and (k.certificates.place[certificate] != np.arange(size)).any():
        yield "a certificate does not stand in the queue where it says it does"
    queued = int((k.certificates.place >= 0).sum())
    if queued != size:
        yield f"the queue has {size} entries, but {queued} certificates say that they are queued"
    bodies = int(clock.bodies)
    first_pair = int(clock.structural) + 1 + bodies
    a, b = k.certificates.a[certificate].astype(np.int64), k.certificates.b[certificate]
    rank = np.where(certificate < first_pair, certificate, first_pair + a * bodies + b)
    parent = (np.arange(1, size) - 1) >> 2
    late = (tick[1:] < tick[parent]) | ((tick[1:] == tick[parent]) & (rank[1:] < rank[parent]))
    if late.any():
        yield "the queue is out of order"


def _pairs(k: Kernel) -> Iterator[str]:
    """Every candidate pair stands once in the list of each of its bodies and once in the lookup, and all
    other records are free."""
    table = k.certificates
    live = np.flatnonzero(table.a >= 0)
    if len(live) != int(k.clock[0].pairs):
        yield f"there are {len(live)} candidate pairs, but the kernel counts {int(k.clock[0].pairs)}"
    if not np.array_equal(np.sort(k.lookup[k.lookup >= 0]), live):
        yield f"the lookup does not hold each of the {len(live)} candidate pairs once"
    ones, others = table.a.tolist(), table.b.tolist()
    next_a, next_b = table.next_a.tolist(), table.next_b.tolist()
    prev_a, prev_b = table.prev_a.tolist(), table.prev_b.tolist()
    listed = 0
    for body, at in enumerate(k.bodies.first.tolist()):
        before = -1
        while at >= 0 and listed <= 2 * len(live):
            if body not in (ones[at], others[at]):
                yield f"the list of body {body} has the pair ({ones[at]}, {others[at]}) in it"
                return
            listed += 1
            is_a = ones[at] == body
            if (prev_a if is_a else prev_b)[at] != before:
                yield f"the list of body {body} cannot be read backwards"
            before, at = at, (next_a if is_a else next_b)[at]
    if listed != 2 * len(live):
        yield f"the bodies' lists have {listed} entries for {len(live)} candidate pairs"
    free, at = 0, int(k.clock[0].free)
    room = len(table) - int(k.clock[0].structural) - 1 - len(k.bodies)
    while at >= 0 and free <= room:
        free, at = free + 1, next_a[at]
    if free + len(live) != room:
        yield f"of {room} records for pairs {len(live)} are taken and {free} free"


def _contact_times(k: Kernel, composition: Composition) -> Iterator[Complaint]:
    """Every wall and pair certificate fails when the narrow phases say now; they look at plans alone."""
    pair, wall = composition.pair, composition.wall
    parts: dict[str, Any] = {"PAIRS": pair is not None, "WALLS": wall is not None}
    if pair is not None:
        parts["meet"] = pair.meet
    if wall is not None:
        parts["reach_wall"] = wall.reach_wall
    wanted = np.full(len(k.certificates), NEVER)
    aside = k._replace(clock=k.clock.copy())  # a narrow phase may blame; here nobody is to hear it
    compose(ask_again, parts, "audit", Kernel)(aside, wanted)
    queued = np.full(len(k.certificates), NEVER)
    waiting = k.queue[: int(k.clock[0].queued)]
    queued[waiting.certificate] = waiting.tick
    first = int(k.clock[0].structural) + 1
    for certificate in np.flatnonzero(wanted[first:] != queued[first:]) + first:
        record = k.certificates[certificate]
        body = int(certificate) - first
        bodies = (body,) if body < len(k.bodies) else (int(record.a), int(record.b))
        who = f"body {body} and a wall" if len(bodies) == 1 else f"bodies {bodies[0]} and {bodies[1]}"
        ticks = f"{_tick(queued[certificate])}, but by their plans they meet {_tick(wanted[certificate])}"
        yield Complaint(f"the contact of {who} is awaited {ticks}", bodies)


def _tick(tick: int) -> str:
    return "never" if tick == NEVER else f"at tick {tick}"


PAIRS = WALLS = True
meet = reach_wall = to_be_filled_in


def ask_again(k: Kernel, ticks: Integers) -> None:
    """Write down when each wall and pair certificate fails; a template, as ``kernel.advance`` is."""
    k = disowned(k)
    bodies = k.bodies
    table = k.certificates
    first_wall = k.clock[0].structural + 1
    if WALLS:
        for body in range(len(bodies)):
            ticks[first_wall + body] = reach_wall(k, bodies[body])[0]
    if PAIRS:
        for certificate in range(first_wall + len(bodies), len(table)):
            record = table[certificate]
            if record.a >= 0 and (bodies[record.a].last != record.b or bodies[record.b].last != record.a):
                ticks[certificate] = meet(k, record.a, record.b)


def _candidates(k: Kernel, delta: float) -> Iterator[Complaint]:
    """Every two bodies closer than a skin are a candidate pair."""
    place: Any = positions_now(k)
    radius = np.asarray(k.bodies.radius)
    live = k.certificates[k.certificates.a >= 0]
    held = set(zip(live.a.tolist(), live.b.tolist(), strict=True))
    for first in range(0, len(place), ROWS):
        rows = slice(first, first + ROWS)
        apart = np.hypot(
            place[rows, 0, None] - place[None, :, 0], place[rows, 1, None] - place[None, :, 1]
        ) - (radius[rows, None] + radius[None, :])
        for a, b in np.argwhere(apart <= delta):
            one, two = int(a) + first, int(b)
            if one < two and (one, two) not in held:
                said = f"bodies {one} and {two} touch (gap {apart[a, b]:.3g}) and are not a candidate pair"
                yield Complaint(said, (one, two))
