"""Commands given by hand: they run at once, at the present tick.

They run after the structural events of that tick and after the contacts that have happened at it. Contacts
that are still pending at this tick stay pending: a command may avert one of them. A command that is refused,
by a phase, by the skin or for lack of room, leaves everything unchanged. A game may issue sixty commands a
frame, so the cost of one must depend as little as possible on the number of bodies. So ``bounds.squares``
bounds the energy from above, and the energy is summed again only if this bound would exceed the speed in
force; and the tables are copied only if more than the loop itself may refuse.
"""

from collections.abc import Sequence
from contextlib import nullcontext
from typing import NamedTuple

import numpy as np

from kinetile.arrays import Rows
from kinetile.errors import NoRoom, Refused
from kinetile.kernel.log import INSERTED, REMOVED
from kinetile.kernel.loop.commands import NO_BLOCKER
from kinetile.run.compose import CommandSupport
from kinetile.run.engine.bounds import Bounds, squares_of_bodies
from kinetile.run.engine.commands import COMMAND_ROWS, STILL, packed, squares_of
from kinetile.run.engine.engine import Engine
from kinetile.run.engine.failures import blocked
from kinetile.run.engine.kept import unchanged_if
from kinetile.scene import Scene
from kinetile.scene.commands import COME_OR_GO, OF_CODE, Does
from kinetile.toolbox.reach import fastest


def command_rows(
    engine: Engine, code: int, many: int = 1, body: int = 0, disc: Sequence[float] = STILL
) -> Rows:
    """Returns equal commands of the present moment, for one body, with place, velocity, radius and mass of
    ``STILL``; the caller fills in the other bodies of several commands, and other effects."""
    row = packed(engine.now, disc, body, code, engine.met_now)
    return np.frombuffer(bytearray(row * many), COMMAND_ROWS)


def carry_out(engine: Engine, code: int, rows: Rows, scene: Scene | None = None) -> None:
    """Runs commands of one code at the present tick, before any contact; in ``scene``, if it is given, which
    is widened for them. Raises Refused, with nothing changed, if a phase does not accept that, if the broad
    phase does not accept the skin, or if a body has no room."""
    engine.demand_a_run()
    if not len(rows):
        return
    if scene is not None and scene is not engine.scene:
        with unchanged_if(engine, Refused):
            engine.widen(scene)
            carry_out(engine, code, rows)
        return
    if code == INSERTED and len(rows) == 1 and not engine.due:
        (blocker,) = engine.blockers(rows).tolist()
        if blocker != NO_BLOCKER:
            raise blocked(engine.k, engine.clock, rows[0], blocker)
        rows["has_room"] = True
    need = _need_of(engine, code, rows)
    with nullcontext() if need.loop_alone else unchanged_if(engine, Refused):
        engine.fit(need.bounds, need.commands, need.speed)
        if code == INSERTED:
            engine.make_numbers(engine.numbers + len(rows))
        engine.run_first(rows)
        if code == INSERTED:
            engine.numbers += len(rows)
            _plan_ends(engine, rows)
        if code == REMOVED:
            engine.agenda.cancel(engine.k, engine.fields, int(rows["body"][0]))
        engine.history = engine.history.with_rows(rows, engine.clock.base)


def insert_those_with_room(engine: Engine, rows: Rows) -> dict[int, Refused]:
    """Inserts bodies now, one by one, and numbers them; returns the errors of bodies without room, by row.
    Raises Refused, with nothing changed, as ``carry_out``. Precondition: no command of the scene is due."""
    if not len(rows):
        return {}
    found = engine.blockers(rows)
    free = found == NO_BLOCKER
    rows["body"] = engine.numbers + np.cumsum(free) - free
    reasons = dict[int, Refused]()
    for at in np.flatnonzero(~free).tolist():
        among = NO_BLOCKER - 1 - int(found[at])
        if among >= 0:
            into = int(rows["body"][among])
            reasons[at] = NoRoom(f"there is no room: it reaches into body {into}, inserted with it")
        else:
            reasons[at] = blocked(engine.k, engine.clock, rows[at], int(found[at]))
    rows["has_room"] = free
    carry_out(engine, INSERTED, rows[free])
    return reasons


class _Need(NamedTuple):
    """The needs of commands: ``bounds`` with their energy and places, ``commands`` in the loop, and a
    ``speed`` for a new layout of the tables, or None. ``loop_alone``: all three are in force, and no other
    command comes first, so only the loop itself may refuse a command, and then it changes nothing."""

    bounds: Bounds
    commands: CommandSupport
    speed: float | None
    loop_alone: bool


def _need_of(engine: Engine, code: int, rows: Rows) -> _Need:
    commands = CommandSupport.ALL if OF_CODE[code] in COME_OR_GO else CommandSupport.TURNS
    bounds, speed = engine.bounds, None
    if Does.FASTER in OF_CODE[code].does:
        bounds, needed = _bounds_with(engine, rows, code)
        if needed > engine.speed:
            speed = 2.0 * needed
            engine.bounds_for(speed)  # a refusal must come here: nothing has changed yet
        elif bounds.extent > engine.bounds.extent:
            speed = engine.speed
    same = engine.is_ready and speed is None and not engine.due
    return _Need(bounds, commands, speed, same and _has_place_for(engine, code, rows, commands))


def _bounds_with(engine: Engine, rows: Rows, code: int) -> tuple[Bounds, float]:
    """Returns the bounds with the energy and the places of commands of one code, and the largest speed of a
    body then."""
    lightest, smallest, squares, speed, extent, skin = engine.bounds
    if Does.BRINGS in OF_CODE[code].does and not engine.bounded:
        far = max(map(abs, (*rows["x"].tolist(), *rows["y"].tolist())))
        extent = extent if far <= extent else 2.0 * far
    if code == INSERTED:
        lightest = min(lightest, *rows["mass"].tolist())
        smallest = min(smallest, *rows["radius"].tolist())
    (drop, drift), room = engine.fall_bounds, 1.0 + 2.0**-20
    gained = squares_of(rows, drop)
    needed = fastest(engine.scene, squares + gained, lightest) * room + drift
    if not needed <= speed:
        squares = squares_of_bodies(engine.k) + engine.agenda.squares(engine.k, drop)
        mass = engine.k.mass[engine.taken]
        squares += drop * float(mass[np.isfinite(mass)].sum()) if drop else 0.0
        needed = fastest(engine.scene, squares + gained, lightest) * room + drift
    return Bounds(lightest, smallest, squares + gained, speed, extent, skin), needed


def _has_place_for(engine: Engine, code: int, rows: Rows, commands: CommandSupport) -> bool:
    """Returns True if commands can run without preparing the phases again: they are compiled into the loop,
    the phase inserts and removes bodies, and an inserted body has a slot (``has_vacancy`` of the kernel)."""
    if engine.commands < commands or (commands == CommandSupport.ALL and not engine.composition.living):
        return False
    if code != INSERTED:
        return True
    k, fields, radii = engine.k, engine.fields, rows["radius"].tolist()
    vacant = fields.present[0] + len(rows) <= len(k.bodies)
    if len(k.forms):
        vacant = vacant and k.forms.view(np.ndarray)["prepared"][rows["form"]].all()
    limits = fields.limits
    return bool(vacant and limits.least[0] <= min(radii) and max(radii) <= limits.widest[0])


def _plan_ends(engine: Engine, rows: Rows) -> None:
    """Plans the removals of bodies inserted now that have a lifetime."""
    for row in rows[rows["lifetime"] > 0.0]:
        time = engine.clock.moment(engine.total)[0] + float(row["lifetime"])
        engine.agenda.plan_removal(engine, engine.clock, int(row["body"]), engine.clock.ticks(time))
