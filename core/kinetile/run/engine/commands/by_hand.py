"""Commands given while a run stands still: they are carried out at once, at the tick where it stands.

A game gives some sixty of them a frame, so what is looked at for a command must not grow with the bodies. The
skin is thick enough up to a speed that no body can exceed, which follows from the energy that there is. Here
``engine.squares`` bounds it from above: what a command brings in is added, what it takes away is not; and
only when that bound would be passed is the energy summed up anew.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from kinetile.errors import Refused
from kinetile.kernel.log import INSERTED, TURNED
from kinetile.kernel.loop import TIME_REACHED
from kinetile.kernel.tables import COMMAND, Kernel
from kinetile.run.composition import Commands
from kinetile.run.engine.commands.agenda import Rows, squares_of, take_back, to_the_front
from kinetile.run.interrupts import Unbroken

if TYPE_CHECKING:
    from kinetile.run.engine.engine import Engine

UNLIMITED = 2**62

__all__ = ["UNLIMITED", "carry_out", "command_rows"]


def command_rows(engine: Engine, code: int, many: int = 1) -> Rows:
    """Return so many commands of the present tick, after the contacts that it has had; what they do to whom
    is to be filled in."""
    rows = np.zeros(many, COMMAND)
    rows["code"] = code
    rows["tick"] = engine.now
    rows["after"] = engine.met_now
    return rows


def carry_out(engine: Engine, code: int, rows: Rows) -> None:
    """Carry out commands of one code, of the present tick, now; events of this very tick run as well.

    Raises Refused, with nothing changed, where the broad phase cannot bear the skin that they ask for, or
    where there is no room for a body that is to come: then that one and those after it are left out.
    """
    lightest, smallest = engine.lightest, engine.smallest
    if code == INSERTED:
        lightest = min(lightest, float(rows["mass"].min()))
        smallest = min(smallest, float(rows["radius"].min()))
    gained = squares_of(rows)
    if not _fastest(engine.squares + gained, lightest) <= engine.speed:
        engine.squares = _squares(engine.k) + engine.agenda.squares(engine.k)
    needed = _fastest(engine.squares + gained, lightest)
    if needed > engine.speed:
        engine.skin_for(2.0 * needed)  # refused here, if at all: nothing has changed yet
    engine.allow(Commands.TURNS if code == TURNED else Commands.ALL)
    engine.compile()
    before = engine.lightest, engine.smallest
    with Unbroken():
        engine.lightest, engine.smallest = lightest, smallest
        engine.squares += gained
        if needed > engine.speed:
            engine.lay_out(2.0 * needed)
        engine.k, behind = to_the_front(engine.k, engine.dial, rows)
        engine.ledger.aside = True
        try:
            while engine.chunk(engine.now, UNLIMITED) != TIME_REACHED:
                pass
        except Refused:
            take_back(engine.k, engine.dial, len(rows), behind)
            engine.lightest, engine.smallest = before
            raise
        finally:
            engine.ledger.aside = False


def _fastest(squares: float, lightest: float) -> float:
    """Return the speed of the lightest body if it had all the energy, to a rounding."""
    return math.sqrt(squares / lightest) * (1.0 + 2.0**-20)


def _squares(k: Kernel) -> float:
    """Return the sum of mass * speed^2 of all bodies, rounded once: in which slots they are, and how many
    slots are empty, is the phase's business, and may not show."""
    bodies = k.bodies.view(np.ndarray)
    vx, vy = bodies["vx"], bodies["vy"]
    mass = np.where(np.isinf(k.mass), 0.0, k.mass)
    return math.fsum((mass * (vx * vx + vy * vy)).tolist())
