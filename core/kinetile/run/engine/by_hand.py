"""Commands given while a run stands still: they are carried out at once, at the tick where it stands."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from kinetile.errors import Refused
from kinetile.kernel.log import INSERTED, TURNED
from kinetile.kernel.loop import TIME_REACHED
from kinetile.kernel.tables import Kernel
from kinetile.run.composition import Commands
from kinetile.run.engine.agenda import Command
from kinetile.run.interrupts import Unbroken

if TYPE_CHECKING:
    from kinetile.run.engine.engine import Engine

UNLIMITED = 2**62

__all__ = ["carry_out"]


def carry_out(engine: Engine, *commands: Command) -> None:
    """Carry out commands now; events of this very tick run as well.

    Raises Refused, with nothing changed, where the broad phase cannot bear the skin that they ask for, or
    where there is no room for a body that is to come: then that one and those after it are left out.
    """
    k = engine.k
    lightest = min([engine.lightest, *(each.mass for each in commands if each.code == INSERTED)])
    squares = _squares(k) + engine.agenda.squares() + sum(each.squares for each in commands)
    needed = math.sqrt(squares / lightest) * (1.0 + 2.0**-20)
    if needed > engine.speed:
        engine.skin_for(2.0 * needed)  # refused here, if at all: nothing has changed yet
    turns = all(each.code == TURNED for each in commands)
    engine.allow(Commands.TURNS if turns else Commands.ALL)
    engine.compile()
    before = engine.lightest, engine.smallest
    with Unbroken():
        engine.lightest = lightest
        engine.smallest = min([engine.smallest, *(each.radius for each in commands if each.code == INSERTED)])
        if needed > engine.speed:
            engine.lay_out(2.0 * needed)
        engine.forget_commands()
        engine.agenda.put(*commands)
        engine.load_commands()
        recorder = engine.ledger.recorder
        engine.ledger.recorder = recorder or engine.ledger.unrecorded.append
        try:
            while engine.chunk(engine.now, UNLIMITED) != TIME_REACHED:
                pass
        except Refused:
            engine.forget_commands()
            engine.agenda.take_back(*commands)
            engine.load_commands()
            engine.lightest, engine.smallest = before
            raise
        finally:
            engine.ledger.recorder = recorder


def _squares(k: Kernel) -> float:
    """Return the sum of mass * speed^2 of all bodies, to a rounding."""
    vx, vy = k.bodies["vx"], k.bodies["vy"]
    return float(np.dot(k.mass, vx * vx) + np.dot(k.mass, vy * vy))
