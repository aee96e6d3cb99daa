"""Holding back: the loop stops before a contact that somebody watches (``counting`` stops after it).

A contact that has been held back happens when the loop goes on, if it still
comes: commands may have changed that.
"""

from __future__ import annotations

from kinetile.kernel.compiled import template, to_be_filled_in
from kinetile.kernel.loop.counting import is_watched, stop_there
from kinetile.kernel.loop.passing import find_leave
from kinetile.kernel.loop.presence import elder
from kinetile.kernel.tables import NOBODY, PARTING, WALL, Kernel

__all__ = ["holds_back"]

WALLS = PASSING = True
reach_wall = to_be_filled_in


@template
def holds_back(k: Kernel, h: int, kind: int, tick: int) -> bool:
    """Whether to stop before what awaits a body, at a tick; it is not held back twice."""
    clock = k.clock[0]
    if len(k.watch) == 0 or clock.before == 0:
        return False
    a = h
    b = NOBODY
    if WALLS and kind == WALL:
        b = reach_wall(k, k.bodies[h])[1]
    elif PASSING and kind == PARTING:
        pair = find_leave(k, h)
        a = k.passings[pair].b
        b = k.passings[pair].a
    else:
        a = elder(k, h, k.queue[h].partner)
        b = h + k.queue[h].partner - a
    if not is_watched(k, a, b):
        return False
    two = k.queue[b].number if b >= 0 else b
    if clock.stop_tick == tick and clock.stop_a == k.queue[a].number and clock.stop_b == two:
        return False
    stop_there(k, tick, a, b)
    return True
