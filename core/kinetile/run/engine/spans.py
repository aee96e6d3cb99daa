"""From one span of the clock to the next: the base moves on, and all ticks are counted from there.

A span costs about a tenth of a millisecond of Python. In a scene that is slow for its size millions of spans
pass between two contacts, so those in which provably nothing happens pass in one step (``skip``). What has to
be done in them is to anchor plans anew, every second span for each body, because its rounding is part of the
answer (docs/specification.md, rule 8).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kinetile.errors import Refused
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.compiled import compose, disowned
from kinetile.kernel.flight import anchor_at, positions_now
from kinetile.kernel.log import REANCHORED
from kinetile.kernel.loop.commands import LONG_AGO
from kinetile.kernel.tables import NEVER, NOBODY, NOT_ASKED, Kernel
from kinetile.run.composition import Commands
from kinetile.run.engine.commands.agenda import Command

if TYPE_CHECKING:
    from kinetile.run.engine.engine import Engine

__all__ = ["move_base", "skip"]

FEWEST_SPANS, MOST_SPANS = 64, 1 << 20
"""How many spans are skipped in one step: for fewer it is not worth building the structure anew, and more
would keep signals waiting."""

MOST_BODIES = 128
"""For more bodies, looking at all pairs costs more than the spans it may save."""


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


def skip(engine: Engine, end: int | None, most: int) -> int:
    """Let so many spans pass in one step, ``most`` at most, in which nothing happens up to ``end`` (in ticks
    since the start); return how many. The simulation stands at the end of a span before and after it.

    No contact can come while each pair is further apart than its relative velocity carries it, and each body
    further from the wall ahead than its velocity does, with room for the rounding of new anchors. Where rows
    are recorded nothing is skipped: anchors are rows.
    """
    k, clock = engine.k, engine.k.clock[0]
    if engine.ledger.reads or not 0 < len(engine.taken) <= MOST_BODIES or clock.passings:
        return 0
    for ticks in (end, None if engine.next_command is None else engine.next_command.ticks):
        if ticks is not None:
            most = min(most, engine.clock.relative(ticks) // SPAN - 1)
    spans = _quiet_spans(engine, min(most, MOST_SPANS))
    if spans < FEWEST_SPANS:
        return 0
    try:
        with engine.unchanged_if_refused():
            engine.clock.base += spans * (SPAN // TICKS)
            compose(pass_spans, {}, "pass_spans", Kernel)(k, spans)
            k.traits.touched[:] = LONG_AGO
            for name in ("stop_tick", "met_tick", "window_tick"):
                clock[name] = -(2**62)
            engine.lay_out(engine.speed)
    except Refused:  # in an open plane, by a skin for bodies that are far away: the next spans will tell
        engine.clock.base -= spans * (SPAN // TICKS)
        return 0
    return spans


def _quiet_spans(engine: Engine, most: int) -> int:
    """Return for how many spans from now there can be no contact; at most so many."""
    k, taken = engine.k, engine.taken
    bodies = k.bodies.view(np.ndarray).take(taken)
    place, radius = positions_now(k, taken), bodies["radius"]
    velocity = np.column_stack([bodies["vx"], bodies["vy"]])
    span = float(SPAN) * engine.dial.tick[0] * (1.0 + 1e-9)  # with room for a tick, and for these roundings
    arena = engine.scene.arena
    far = (
        max(arena) if engine.walled and arena else np.abs(place).max() + most * span * np.abs(velocity).max()
    )
    rounding = far * 2.0**-52  # how far a new anchor may be off, of which there is one in two spans
    a, b = np.triu_indices(len(taken), 1)
    apart = np.hypot(*(place[a] - place[b]).T) - (radius[a] + radius[b])
    closing = np.hypot(*(velocity[a] - velocity[b]).T)
    gaps, speeds = [apart[closing > 0.0]], [closing[closing > 0.0]]
    if engine.walled and arena:
        ahead = np.where(velocity < 0.0, place, np.array(arena) - place) - radius[:, None]
        gaps.append(ahead[velocity != 0.0])
        speeds.append(np.abs(velocity[velocity != 0.0]))
    gap, speed = np.concatenate(gaps), np.concatenate(speeds)
    quiet = (gap - 4.0 * rounding) * (1.0 - 1e-9) / (speed * span + 2.0 * rounding)
    return max(int(quiet.min(initial=float(most))), 0)


def pass_spans(k: Kernel, spans: int) -> None:
    """Count ticks from so many spans later, and anchor anew what has flown for two, at the start of each; a
    template, as ``advance``."""
    k = disowned(k)
    for body in range(k.clock[0].bodies):
        plan = k.bodies[body]
        if k.queue[body].number >= 0:
            for _ in range(spans):
                plan.anchor -= SPAN
                if plan.anchor < -SPAN:
                    anchor_at(k, plan, 0)
                    plan.last = NOBODY
