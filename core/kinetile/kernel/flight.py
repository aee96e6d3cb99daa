"""Flight plans: a body is where it was at its anchor, plus its velocity times the time since.

The time since an anchor is a difference of integer ticks, hence exact however late the clock is. A plan is
anchored anew by a contact or a turn, never by a structural event, so that a trajectory is a function of the
scene alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kinetile.kernel.compiled import hook
from kinetile.kernel.tables import Kernel, Records
from kinetile.kernel.vectors import put_place

__all__ = ["anchor_at", "note_all_places", "note_place", "positions_now", "since_anchor", "since_origin"]


@hook
def since_anchor(k: Kernel, body: Records, tick: int) -> float:
    """Return the time from a body's anchor to a tick, in the scene's unit."""
    return float((tick - body.anchor) * k.clock[0].tick)


@hook
def anchor_at(k: Kernel, body: Records, tick: int) -> None:
    """Anchor a body's plan at a tick, without changing its velocity."""
    elapsed = since_anchor(k, body, tick)
    body.x += body.vx * elapsed
    body.y += body.vy * elapsed
    body.anchor = tick


@hook
def since_origin(k: Kernel, tick: int) -> float:
    """Return the time from the common clock's origin to a tick, in the scene's unit."""
    clock = k.clock[0]
    return float((tick - clock.origin) * clock.tick)


@hook
def note_place(k: Kernel, number: int) -> None:
    """Write a body's row of ``k.places``: where its plan has it at the origin of the common clock.

    Rounded once more than its plan, hence only good for bounds.
    """
    body = k.bodies[number]
    back = since_anchor(k, body, k.clock[0].origin)
    put_place(k.places, number, body.x + body.vx * back, body.y + body.vy * back, body.vx, body.vy)


@hook
def note_all_places(k: Kernel, tick: int) -> None:
    """Move the origin of the common clock to a tick."""
    k.clock[0].origin = tick
    for body in range(k.clock[0].bodies):
        note_place(k, body)


def positions_now(
    k: Kernel, slots: np.ndarray[Any, np.dtype[np.int64]] | None = None
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return (n, 2) positions at the kernel's present tick, of all bodies or of those in the slots given; for
    set-up and read-out, not for hooks."""
    clock, bodies = k.clock.view(np.ndarray)[0], k.bodies.view(np.ndarray)
    if slots is not None:
        bodies = bodies.take(slots)
    elapsed = (clock["now"] - bodies["anchor"]) * clock["tick"]
    places = np.empty((len(bodies), 2))
    places[:, 0] = bodies["x"] + bodies["vx"] * elapsed
    places[:, 1] = bodies["y"] + bodies["vy"] * elapsed
    return places
