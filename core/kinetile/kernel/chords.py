"""Chords: straight plans in place of accelerated bodies' plans, for broad phases.

Contacts come from the exact plans, of degree 2, in ``k.bodies``. A broad phase reads the *shadow* of each
body, in ``k.shadows``: it flies straight along a chord, from its place to the place of the body ``span``
ticks later, with a reach that is longer by a *margin* (``limits.skin`` includes it). At the end of a chord,
and at each event of the body, the next chord is laid and the body is replanned. So every certificate is of
degree 1, and a broad phase needs no code for accelerations; chords are no part of the answer.

The shadow never jumps, because a phase may rely on the rule that a new plan does not move a body: a chord
begins at the end of the last one. docs/one-answer.md proves that the shadow never leaves the margin, whenever
a chord is cut short and another one is laid. A chord that was flown to its end has reached the plan except
for rounding, and the next one begins there exactly; so rounding does not add up. The shadow of a body without
acceleration has the body's own plan, after at most one chord to it.

A chord is faster than its body by |a| span at most: half of it by the bend, half by the way back to the plan.
``toolbox.reach`` has both bounds.
"""

from functools import cache
from typing import Any

import numpy as np

from kinetile.kernel.compiled import Hook, hook, is_checked, unchecked, with_numpy, with_shadows
from kinetile.kernel.flight import note_place, note_pull, plans_now, position_at, whole_pulls
from kinetile.kernel.images import near_zero
from kinetile.kernel.plan import MOST_SPAN, Plan, positions_after
from kinetile.kernel.tables import NEVER, Kernel


def as_seen(k: Kernel) -> Kernel:
    """Returns the same as ``with_shadows``, or the tables if no body is accelerated; not for hooks."""
    return k._replace(bodies=k.shadows, places=k.shadow_places) if len(k.shadows) else k


@hook
def lay(k: Kernel, number: int) -> None:
    """Lays the next chord of a body, from the present tick on."""
    clock = k.clock[0]
    tick = clock.now
    body = k.bodies[number]
    shadow = k.shadows[number]
    whole = body.end == tick or body.end == NEVER
    if whole and body.ax == 0.0 and body.ay == 0.0:
        shadow.x = body.x
        shadow.y = body.y
        shadow.vx = body.vx
        shadow.vy = body.vy
        shadow.anchor = body.anchor
        body.end = NEVER
    else:
        x, y = position_at(k, body, tick)
        if not whole:  # as far from it as before, without the periods taken off the body
            off_x, off_y = position_at(k, shadow, tick)
            x += near_zero(off_x - x, clock.torus.x)
            y += near_zero(off_y - y, clock.torus.y)
        end = tick + body.span
        there_x, there_y = position_at(k, body, end)
        time = float(body.span) * clock.per_tick
        shadow.x = x
        shadow.y = y
        shadow.vx = (there_x - x) / time
        shadow.vy = (there_y - y) / time
        shadow.anchor = tick
        body.end = end
    note_pull(body, k, number)
    note_place(with_shadows(k), number)


@hook
def span_of(ax: float, ay: float, margin: float, per_time: float) -> int:
    """Returns the ticks that a chord of this acceleration lasts, by the margin: |a| span^2 / 2 at most."""
    ticks = (2.0 * margin / (abs(ax) + abs(ay))) ** 0.5 * per_time * (1.0 - 2.0**-20)
    return int(ticks) if ticks < float(MOST_SPAN) else MOST_SPAN


def lay_all(k: Kernel, skin: float, margin: float) -> None:
    """Lays the chords of all bodies again, from the present tick on, at the places of their plans, and copies
    the other fields that broad phases read. Not for hooks. Before: there is no structure."""
    clock, bodies, shadows = k.clock[0], k.bodies.view(np.ndarray), k.shadows.view(np.ndarray)
    for name in shadows.dtype.names or ():
        shadows[name] = bodies[name]
    shadows["reach"] = bodies["radius"] + skin
    pull = abs(bodies["ax"]) + abs(bodies["ay"])
    whole = abs(whole_pulls(k, np.arange(len(bodies)))).sum(axis=1)
    accelerated = np.flatnonzero(whole)  # held bodies have no chord, and keep their span for later
    ticks = np.sqrt(2.0 * margin / whole[accelerated]) * float(clock.per_time) * (1.0 - 2.0**-20)
    bodies["span"][accelerated] = np.minimum(ticks, float(MOST_SPAN)).astype(np.int64)
    bodies["end"] = NEVER
    accelerated = np.flatnonzero(pull)
    bodies["end"][accelerated] = int(clock.now) + bodies["span"][accelerated]
    plans, elapsed = plans_now(k, accelerated)
    here, time = positions_after(plans, elapsed), bodies["span"][accelerated] * float(clock.per_tick)
    way = positions_after(plans, elapsed + time) - here
    for name, column in zip(Plan._fields, [*here.T, *(way.T / time)], strict=True):
        shadows[name][accelerated] = column
    shadows["anchor"][accelerated] = clock.now


@cache
def seeing(name: str, function: Hook) -> Hook:
    """Returns the hook of a broad phase, by its name in the loop, as the loop calls it if bodies are
    accelerated: it gets the tables with shadows, and the chord is laid before a body is replanned; the same
    one for the same hook."""
    given = with_numpy(function) if is_checked(function) else function

    @unchecked
    @hook
    def look(k: Kernel, *rest: Any) -> Any:
        return given(with_shadows(k), *rest)

    @unchecked
    @hook
    def plan_and_look(k: Kernel, s: Any, body: int) -> Any:
        lay(k, body)
        return given(with_shadows(k), s, body)

    return plan_and_look if name in ("replan", "enter") else look
