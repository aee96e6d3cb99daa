"""A body goes and another comes, by hand, in the middle of a run whose memory is watched: so ``leave`` and
``enter`` are watched too, and a phase that has neither is built anew before one's eyes."""

from __future__ import annotations

import contextlib

from kinetile.errors import KinetileError
from kinetile.kernel.flight import positions_now
from kinetile.kernel.log import INSERTED, REMOVED
from kinetile.run.arguments import read_insertion, read_removal
from kinetile.run.engine import Engine, carry_out

__all__ = ["exchange"]


def exchange(engine: Engine, body: int, velocity: tuple[float, float]) -> None:
    """Have a body go that is there, and another of its size come where it was, since there is room for it.

    Does nothing where the body has gone already. Where the phase refuses who comes, it stays away.
    """
    if not 0 <= body < engine.numbers or engine.k.slots[body] < 0:
        return
    slot = engine.k.slots[body : body + 1]
    x, y = positions_now(engine.k, slot)[0].tolist()
    radius, mass = float(engine.k.bodies["radius"][slot[0]]), float(engine.k.mass[slot[0]])
    carry_out(engine, REMOVED, read_removal(engine, body))
    with contextlib.suppress(KinetileError, ValueError):
        rows = read_insertion(engine, (x, y), velocity, radius, mass, None)
        carry_out(engine, INSERTED, rows)
