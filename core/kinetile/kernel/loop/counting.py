"""Contacts counted, and looked at: for those that somebody watches, after which the loop stops, and for what
cannot be, jams and overlaps that rounding does not explain."""

from __future__ import annotations

import math

from kinetile.kernel.clock import SPAN
from kinetile.kernel.compiled import hook, larger, smaller
from kinetile.kernel.faults import JAMMED, NOT_FINITE, TOO_DEEP, blame
from kinetile.kernel.tables import NOBODY, Kernel

__all__ = ["ANY", "SOME", "count_contact", "count_row", "is_watched", "stop_there"]


ANY, SOME = 1, 2
"""Flags of ``k.watch``: a body is watched at every contact; it is in a pair of ``k.watched``."""


@hook
def is_watched(k: Kernel, a: int, b: int) -> bool:
    """Whether a contact of the bodies in two slots, or of one and a wall (b below 0), is watched."""
    one = k.queue[a].number
    flags = k.watch[one]
    two = NOBODY
    if b >= 0:
        two = k.queue[b].number
        if (k.watch[two] & ANY) != 0:
            return True
        flags = flags & (k.watch[two] | ANY)
    if (flags & ANY) != 0:
        return True
    if (flags & SOME) != 0:
        for at in range(len(k.watched)):
            pair = k.watched[at]
            if (pair.a == one and pair.b == two) or (pair.a == two and pair.b == one):
                return True
    return False


@hook
def stop_there(k: Kernel, tick: int, a: int, b: int) -> None:
    """Write down at what the loop stops: by numbers, the younger first where a passing ends."""
    clock = k.clock[0]
    clock.stopped = 1
    clock.stop_tick = tick
    clock.stop_a = k.queue[a].number
    clock.stop_b = k.queue[b].number if b >= 0 else b


@hook
def _note_watched(k: Kernel, tick: int, a: int, b: int) -> None:
    """A contact has happened: stop after it where it is watched."""
    if len(k.watch) > 0 and k.clock[0].before == 0 and is_watched(k, a, b):
        stop_there(k, tick, a, b)


@hook
def _ticks_of_a_jam(k: Kernel) -> float:
    """Return in how many ticks a window of contacts shows a jam: less than 1e-13 of the smallest radius of
    flight each, at the speed of the fastest body.

    Both are those of the bodies as they are now, not bounds that hold for all time: those know the commands
    of a scene beforehand, so a run with commands by hand and its recording would be jammed at different
    contacts.
    """
    clock = k.clock[0]
    radius = math.inf
    squares = 0.0
    for slot in range(clock.bodies):
        if k.queue[slot].number >= 0:
            body = k.bodies[slot]
            radius = smaller(radius, body.radius)
            squares = larger(squares, body.vx * body.vx + body.vy * body.vy)
    if squares == 0.0:
        return 0.0
    flight = 1e-13 * radius / math.sqrt(squares) * clock.per_time
    return float(smaller(clock.window_size * flight, float(SPAN)))


@hook
def count_row(k: Kernel, tick: int, a: int, b: int) -> None:
    """Count what has happened at a tick, see whether it is watched, and look for jams."""
    clock = k.clock[0]
    _note_watched(k, tick, a, b)
    clock.met_there = clock.met_there + 1 if clock.met_tick == tick else 1
    clock.met_tick = tick
    clock.spins = 0
    clock.window += 1
    if clock.window >= clock.window_size:
        if tick - clock.window_tick <= _ticks_of_a_jam(k):
            blame(k, JAMMED, a, b)
        clock.window = 0
        clock.window_tick = tick


@hook
def count_contact(k: Kernel, tick: int, a: int, b: int, depth: float, radius: float, slack: float) -> None:
    """Keep the readings of a contact and look for jams and for overlaps that rounding does not explain."""
    clock = k.clock[0]
    counts = k.counts[0]
    counts.deepest = larger(counts.deepest, depth / radius)
    if not depth <= clock.tolerance + 1e-9 * slack:
        blame(k, TOO_DEEP if depth > 0.0 else NOT_FINITE, a, b)
    count_row(k, tick, a, b)
