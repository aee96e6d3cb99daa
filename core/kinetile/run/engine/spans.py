"""Spans of the clock: ticks counted from a later base, and spans in which nothing can happen.

A span costs about a tenth of a millisecond of Python. In a scene that is slow for its size millions of spans
pass between two contacts, so those in which provably nothing happens pass in one step (``Engine.skip``). What
has to be done in them is to anchor plans anew, every second span for each body, because its rounding is part
of the answer (docs/specification.md, rule 8).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import SPAN
from kinetile.kernel.compiled import disowned
from kinetile.kernel.flight import anchor_at, positions_now
from kinetile.kernel.loop.commands import LONG_AGO
from kinetile.kernel.tables import NEVER, NOBODY, NOT_ASKED, Kernel

FEWEST_SPANS, MOST_SPANS = 64, 1 << 20
"""How many spans are skipped in one step: for fewer it is not worth building the structure anew, and more
would keep signals waiting."""

MOST_BODIES = 128
"""For more bodies, looking at all pairs costs more than the spans it may save."""


def count_from_next(k: Kernel, of_phase: Iterable[Any]) -> None:
    """Counts all ticks of the tables, and those ``of_phase``, from the start of the next span."""
    clock = k.clock[0]
    jam, stops = clock.jam, clock.stops
    k.commands.tick -= SPAN
    k.bodies.anchor[k.queue.number == NOBODY] = 0
    k.bodies.anchor -= SPAN
    awaited = (k.queue.key, k.queue.own, k.queue.tick, k.queue.guard, k.traits.leave, k.passings.tick)
    for ticks in (*awaited, *of_phase):
        ticks[ticks != NEVER] -= SPAN
    k.queue.wall[(k.queue.wall != NEVER) & (k.queue.wall != NOT_ASKED)] -= SPAN
    k.passings.begun -= SPAN
    k.traits.touched[:] = np.maximum(k.traits.touched - SPAN, LONG_AGO)
    clock.now -= SPAN
    if len(k.images):
        clock.torus.beat -= SPAN
    stops.tick = max(int(stops.tick) - SPAN, LONG_AGO)
    clock.origin = max(int(clock.origin) - SPAN, LONG_AGO)
    clock.met_tick = max(int(clock.met_tick) - SPAN, LONG_AGO)
    jam.window_tick = max(int(jam.window_tick) - SPAN, LONG_AGO)
    clock.calendar.filed = 0


def quiet_spans(k: Kernel, taken: npt.NDArray[np.intp], arena: tuple[float, float] | None, most: int) -> int:
    """Returns for how many spans from now, ``most`` at most, the bodies in some slots can have no contact.

    No contact can come while each pair is further apart than its relative velocity carries it, and each body
    further from the wall ahead (of an ``arena`` with walls) than its velocity does, with room for the
    rounding of new anchors.
    """
    bodies = k.bodies.view(np.ndarray).take(taken)
    place, radius = positions_now(k, taken), bodies["radius"]
    velocity = np.column_stack([bodies["vx"], bodies["vy"]])
    span = float(SPAN) * float(k.clock[0].tick) * (1.0 + 1e-9)  # room for a tick, and for these roundings
    far = max(arena) if arena else np.abs(place).max() + most * span * np.abs(velocity).max()
    rounding = far * 2.0**-52  # how far a new anchor may be off, of which there is one in two spans
    a, b = np.triu_indices(len(taken), 1)
    apart = np.hypot(*(place[a] - place[b]).T) - (radius[a] + radius[b])
    closing = np.hypot(*(velocity[a] - velocity[b]).T)
    gaps, speeds = [apart[closing > 0.0]], [closing[closing > 0.0]]
    if arena:
        ahead = np.where(velocity < 0.0, place, np.array(arena) - place) - radius[:, None]
        gaps.append(ahead[velocity != 0.0])
        speeds.append(np.abs(velocity[velocity != 0.0]))
    gap, speed = np.concatenate(gaps), np.concatenate(speeds)
    quiet = (gap - 4.0 * rounding) * (1.0 - 1e-9) / (speed * span + 2.0 * rounding)
    return max(int(quiet.min(initial=float(most))), 0)


def pass_spans(k: Kernel, spans: int) -> None:
    """Counts ticks from so many spans later, and anchor anew what has flown for two, at the start of each; a
    template, as ``kernel.loop`` has."""
    k = disowned(k)
    for body in range(k.clock[0].bodies):
        plan = k.bodies[body]
        if k.queue[body].number >= 0:
            for _ in range(spans):
                plan.anchor -= SPAN
                if plan.anchor < -SPAN:
                    anchor_at(k, plan, 0)
                    plan.last = NOBODY
