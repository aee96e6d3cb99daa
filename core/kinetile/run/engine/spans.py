"""From one span of the clock to the next: the base moves on, and all ticks are counted from there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.log import REANCHORED
from kinetile.kernel.loop.commands import LONG_AGO
from kinetile.kernel.tables import NEVER, NOBODY, NOT_ASKED
from kinetile.run.composition import Commands
from kinetile.run.engine.commands.agenda import Command

if TYPE_CHECKING:
    from kinetile.run.engine.engine import Engine

__all__ = ["move_base"]


def move_base(engine: Engine, end: int | None) -> None:
    """Move the clock's base on by a span and anchor anew what has flown for two: so under every phase.

    Where there is no body it moves on at once to the span of ``end``, in ticks since the start.
    """
    k = engine.k
    if not len(k.bodies) and end is not None and engine.next_command is None:
        engine.clock.base += max(engine.clock.relative(end) // SPAN, 1) * (SPAN // TICKS)
        k.clock[0].now = -1  # its epoch, which may be beyond 64 bits, is asked for by no contact
        return
    clock = k.clock[0]
    if not engine.walled and len(k.bodies) and engine.reach_of_flight(engine.speed, 2) > engine.extent:
        engine.lay_out(engine.speed)
        k, clock = engine.k, engine.k.clock[0]
    k.commands.tick -= SPAN
    k.bodies.anchor[k.queue.number == NOBODY] = 0
    k.bodies.anchor -= SPAN
    for ticks in (k.queue.key, k.queue.own, k.queue.tick, k.queue.guard, *engine.composition.broad.ticks):
        ticks[ticks != NEVER] -= SPAN
    k.queue.wall[(k.queue.wall != NEVER) & (k.queue.wall != NOT_ASKED)] -= SPAN
    for ticks in (k.traits.leave, k.passings.tick):
        ticks[ticks != NEVER] -= SPAN
    k.passings.begun -= SPAN
    k.traits.touched[:] = np.maximum(k.traits.touched - SPAN, LONG_AGO)
    clock.now -= SPAN
    clock.stop_tick = max(int(clock.stop_tick) - SPAN, -(2**62))
    clock.origin = max(int(clock.origin) - SPAN, -(2**62))
    clock.filed = 0
    clock.met_tick = max(int(clock.met_tick) - SPAN, -(2**62))
    clock.window_tick = max(int(clock.window_tick) - SPAN, -(2**62))
    engine.clock.base += SPAN // TICKS
    if len(k.bodies):
        clock.epoch = engine.clock.base
    old = k.queue.number[k.bodies.anchor < -SPAN]
    if len(old):
        engine.allow(Commands.TURNS)
        begin = engine.clock.base * TICKS
        engine.agenda.put(*(Command(begin, body, REANCHORED) for body in np.sort(old).tolist()))
    engine.k = engine.agenda.load(engine.k, engine.clock)
