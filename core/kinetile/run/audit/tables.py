"""What must hold of the kernel's own tables: the calendar, the bodies' entries, places, and the pair set."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from kinetile.kernel.loop.calendar import rank
from kinetile.kernel.tables import GUESS, NEVER, NOT_ASKED, PAIR, PARTING, WALL

__all__ = ["of_calendar", "of_entries", "of_lists", "of_pair_set", "of_places", "said_tick"]


def of_calendar(k: Any) -> Iterator[str]:
    """Every body that awaits something stands once in the list of its slice, in order, and nobody else."""
    clock = k.clock
    keys, days = k.queue.key.tolist(), (k.queue.key >> clock.shift).tolist()
    after, before, marks = k.links.next.tolist(), k.links.prev.tolist(), k.marks.tolist()
    bodies = len(k.bodies)
    ranks = _ranks(k)
    slices, found = len(after) - bodies, 0
    for at in range(slices):
        previous, body = bodies + at, after[bodies + at]
        if bool(marks[at >> 6] >> (at & 63) & 1) != (body < bodies):
            yield f"the mark of slice {at} of the calendar is not true"
        while body < bodies and found <= bodies:
            if before[body] != previous:
                yield f"the list of slice {at} of the calendar cannot be read backwards at body {body}"
                return
            if days[body] % slices != at or keys[body] == NEVER:
                yield f"body {body} stands in slice {at} of the calendar, where it does not belong"
            if previous < bodies and ranks[body] < ranks[previous]:
                yield f"slice {at} of the calendar is out of order: body {previous} stands before body {body}"
            previous, body, found = body, after[body], found + 1
        if body != bodies + at or before[body] != previous:
            yield f"the list of slice {at} of the calendar does not come back to where it began"
            return
    waiting = [body for body, key in enumerate(keys) if key != NEVER]
    await_something, counted = len(waiting), k.counts.queued
    if not found == await_something == counted:
        said = f"{found} bodies stand in the calendar, and {await_something} await something"
        yield f"{said}; {counted} are counted"
    if waiting and min(days[body] for body in waiting) < clock.slice:
        yield "a body is filed before the slice in which the head is sought"


def _ranks(k: Any) -> list[tuple[int, ...]]:
    """Return for each body where what awaits it stands in the order of events (``calendar.rank``)."""
    queue = k.queue
    columns = (queue.number, queue.key, queue.kind, queue.number[queue.partner])
    return [rank(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]


def of_entries(k: Any) -> Iterator[str]:
    """Each body is filed under the first of what it knows awaits it."""
    queue = k.queue
    contact = np.where(queue.exact == 1, PAIR, GUESS)
    asked = queue.wall != NOT_ASKED
    leave = k.traits.leave if len(k.traits) else np.full_like(queue.own, NEVER)
    choices = np.stack([queue.own, queue.tick, np.where(asked, queue.wall, NEVER), leave])
    kinds = np.stack(
        [np.zeros_like(contact), contact, np.full_like(contact, WALL), np.full_like(contact, PARTING)]
    )
    key = choices.min(axis=0)
    kind = np.where(choices == key, kinds, PARTING + 1).min(axis=0)
    for body in np.flatnonzero(queue.key != key):
        filed, wanted = said_tick(queue.key[body]), said_tick(key[body])
        yield f"body {body} is filed {filed}, but what it awaits comes {wanted}"
    for body in np.flatnonzero((queue.kind != kind) & (key != NEVER)):
        yield f"what awaits body {body} is filed as of kind {queue.kind[body]}, and is of kind {kind[body]}"
    for body in np.flatnonzero(queue.guard < queue.tick):
        yield f"body {body} has a contact before its first one"


def of_places(k: Any) -> Iterator[str]:
    """The rows of places at the common clock are those of the plans."""
    clock = k.clock
    back = (clock.origin - k.bodies.anchor) * clock.tick
    bodies, places = k.bodies, k.places
    for at, speed, there, flies in (
        (bodies.x, bodies.vx, places.x, places.vx),
        (bodies.y, bodies.vy, places.y, places.vy),
    ):
        wrong = (there != at + speed * back) | (flies != speed)
        for body in np.flatnonzero(wrong):
            yield f"the place of body {body} at the common clock is not that of its plan"


def of_pair_set(k: Any) -> Iterator[str]:
    """Every pair of the pair set stands once in the list of each of its bodies and once in the lookup, and
    all other records are free."""
    table = k.pairs
    live = np.flatnonzero(table.a >= 0)
    if not np.array_equal(np.sort(k.lookup[k.lookup >= 0]), live):
        yield f"the lookup does not hold each of the {len(live)} pairs of the pair set once"
    yield from of_lists(table, k.firsts, "the pair set", k.clock.pairs, k.clock.free)


def of_lists(table: Any, firsts: Any, what: str, counted: int, first_free: int) -> Iterator[str]:
    """Every pair of a table stands once in the list of each of its bodies; all other records are free."""
    live = np.flatnonzero(table.a >= 0)
    if len(live) != int(counted):
        yield f"there are {len(live)} pairs in {what}, but the kernel counts {int(counted)}"
    ones, others = table.a.tolist(), table.b.tolist()
    next_a, next_b = table.next_a.tolist(), table.next_b.tolist()
    prev_a, prev_b = table.prev_a.tolist(), table.prev_b.tolist()
    listed = 0
    for body, at in enumerate(firsts.tolist()):
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
        yield f"the bodies' lists have {listed} entries for {len(live)} pairs"
    free, at = 0, int(first_free)
    while at >= 0 and free <= len(table):
        free, at = free + 1, next_a[at]
    if free + len(live) != len(table):
        yield f"of {len(table)} records of {what} {len(live)} are taken and {free} free"


def said_tick(tick: int) -> str:
    """Return a tick in words."""
    return "never" if tick == NEVER else f"at tick {tick}"
