"""Commands given while a run stands still: they are carried out at once, at the tick where it stands.

Such a command comes after the structural events of that tick and after the contacts that have happened at it.
Contacts that are still pending at it stay pending: a command may be given to avert one of them.

A game may issue sixty commands a frame, so the cost of one must not depend on the number of bodies more than
it has to. The skin is thick enough up to a speed that no body can exceed, which follows from the energy that
there is. Here ``engine.squares`` bounds it from above: what a command brings in is added, what it takes away
is not; and only when that bound would be passed is the energy summed up anew.
"""

from __future__ import annotations

import math
from contextlib import nullcontext
from typing import TYPE_CHECKING

import numpy as np

from kinetile.errors import ZenoError
from kinetile.kernel.flight import positions_now
from kinetile.kernel.log import BOTTOM, INSERTED, LEFT, REMOVED, RIGHT, TOP, TURNED
from kinetile.kernel.loop import TIME_REACHED
from kinetile.kernel.loop.presence import ROOM
from kinetile.kernel.loop.rules import PASS
from kinetile.kernel.tables import COMMAND, Kernel
from kinetile.run.composition import Commands
from kinetile.run.engine.commands.agenda import Rows, is_due, squares_of, to_the_front
from kinetile.run.engine.failures import blocked
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
    """Carry out commands of one code, of the present tick, now. No contact happens meanwhile.

    Raises Refused, with nothing changed, where the broad phase cannot bear the skin that they ask for, or
    where there is no room for a body that is to come.
    """
    engine.demand_sound()
    if not len(rows):
        return
    exchanged = code != TURNED
    wanted = Commands.ALL if exchanged else Commands.TURNS
    lightest, smallest = engine.lightest, engine.smallest
    if code == INSERTED:
        lightest = min(lightest, float(rows["mass"].min()))
        smallest = min(smallest, float(rows["radius"].min()))
    gained = squares_of(rows)
    squares = engine.squares
    if not _fastest(squares + gained, lightest) <= engine.speed:
        squares = _squares(engine.k) + engine.agenda.squares(engine.k)
    needed = _fastest(squares + gained, lightest)
    if needed > engine.speed:
        engine.skin_for(2.0 * needed)  # refused here, if at all: nothing has changed yet
    others_first = is_due(engine.k, engine.dial)  # commands of the scene, which stopped before them
    if code == INSERTED and not others_first:
        _demand_room(engine, rows)
    # From here on a command is refused only where tables are laid out anew, or other commands come first:
    # these are worth a copy of the tables, to go back to.
    plain = engine.commands >= wanted and needed <= engine.speed and not others_first
    if exchanged:
        plain = plain and engine.composition.living
    if code == INSERTED:
        plain = plain and engine.has_slot(float(rows["radius"][0]))
    with Unbroken(), nullcontext() if plain else engine.unchanged_if_refused():
        engine.allow(wanted)
        engine.compile()
        engine.lightest, engine.smallest = lightest, smallest
        engine.squares = squares + gained
        if needed > engine.speed:
            engine.lay_out(2.0 * needed)
        if code == INSERTED:
            engine.number(engine.numbers + 1)
        engine.k = to_the_front(engine.k, engine.dial, rows)
        engine.ledger.aside = True
        try:
            _run_commands(engine)
        finally:
            engine.ledger.aside = False
        if code == INSERTED:
            engine.numbers += 1
        if code == REMOVED:
            engine.agenda.cancel(engine.k, engine.dial, int(rows["body"][0]))


def _run_commands(engine: Engine) -> None:
    """Run what comes before the next contact at the present tick."""
    quota = engine.met_now
    while True:
        try:
            if engine.chunk(engine.now, UNLIMITED, quota=quota) == TIME_REACHED:
                return
        except ZenoError:  # passings begin and end by a command, and may fill a window of contacts
            if not is_due(engine.k, engine.dial):
                return  # all is carried out; the next run reports the jam


def _demand_room(engine: Engine, rows: Rows) -> None:
    """Raise Refused where the body that a command has come would reach into another, or beyond a wall; by the
    arithmetic of ``kernel.loop.commands.blocked_by``."""
    k, command = engine.k, rows[0]
    x, y, radius = (command[name].item() for name in ("x", "y", "radius"))
    if engine.walled:
        width, height = engine.dial.width[0], engine.dial.height[0]
        least = radius - ROOM * radius
        for wall, gap in ((LEFT, x), (RIGHT, width - x), (BOTTOM, y), (TOP, height - y)):
            if gap < least:
                raise blocked(k, engine.clock, command, wall)
    bodies = k.bodies.view(np.ndarray).take(engine.taken)
    apart = positions_now(k, engine.taken) - (x, y)
    both = radius + bodies["radius"]
    reach = both - ROOM * both
    hit = apart[:, 0] * apart[:, 0] + apart[:, 1] * apart[:, 1] < reach * reach
    if len(k.rules) and engine.composition.pair is not None:
        rules = k.rules.view(np.ndarray)["response"].reshape(-1, engine.dial.kinds[0] + 1)
        hit &= rules[k.traits.view(np.ndarray)["kind"][engine.taken], int(command["kind"])] != PASS
    if hit.any():
        raise blocked(k, engine.clock, command, int(engine.taken[np.argmax(hit)]))  # the eldest


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
