"""The phases prepared anew in the middle of a run, and the tables laid out for them: because somebody comes
for whom there is no slot, or because the broad phase takes nobody in and lets nobody go.

Everything here is made aside: where a phase refuses, what there was goes on.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from kinetile.kernel.flight import positions_now
from kinetile.kernel.log import INSERTED, REMOVED
from kinetile.kernel.loop.commands import window_of
from kinetile.kernel.loop.presence import slots_taken
from kinetile.kernel.tables import NOBODY, Kernel, Records
from kinetile.run.composition import Composition
from kinetile.run.engine.layout import moved
from kinetile.scene import Scene, standing
from kinetile.scene.scene import LEAST

__all__ = ["Renewed", "carried_out", "renewed"]


class Renewed(NamedTuple):
    """What a run goes on with: phases, tables, and the scene for which the phases were prepared."""

    composition: Composition
    k: Kernel
    scene: Scene


def renewed(
    k: Kernel, scene: Scene, composition: Composition, coming: Records | None = None, roomy: bool = False
) -> Renewed:
    """Prepare the phases for the bodies that there are, and one that a command has come, if it is given; with
    slots for twice as many where they are all taken, or where it is to be ``roomy``.

    Raises Refused where a phase cannot do that.
    """
    taken, slots = slots_taken(k), len(k.bodies)
    full = coming is not None and len(taken) == slots
    capacity = max(2 * slots, LEAST) if roomy or full else slots
    stands = _standing(k, scene, taken, capacity, coming)
    composition = composition.prepared_for(stands)
    return Renewed(composition, moved(k, taken, stands, composition), stands)


def carried_out(k: Kernel, scene: Scene, composition: Composition) -> Renewed:
    """Carry out the next command, by which a body comes or goes, and prepare the phases for who is there
    then.

    Raises Refused where a phase cannot do that.
    """
    command = k.commands[int(k.clock[0].command)]
    comes = int(command.code) == INSERTED
    taken = slots_taken(k)
    slot = NOBODY if comes else int(k.slots[command.body])
    stays = taken[taken != slot]
    stands = _standing(k, scene, stays, 0, command if comes else None)
    composition = composition.prepared_for(stands)
    new = moved(k, stays, stands, composition)
    clock, counts = new.clock[0], new.counts[0]
    clock.now = max(int(clock.now), int(command.tick))
    clock.command += 1
    if comes:
        _put(new, len(stays), command)
        counts.inserted += 1
        squares, mass = float(command.vx) ** 2 + float(command.vy) ** 2, float(command.mass)
        _log(new, int(command.tick), int(command.body), new.bodies[len(stays)], INSERTED)
    else:
        gone = k.bodies[slot].copy()
        elapsed = (int(command.tick) - int(gone.anchor)) * float(clock.tick)
        gone.x += gone.vx * elapsed
        gone.y += gone.vy * elapsed
        counts.removed += 1
        squares, mass = float(gone.vx) ** 2 + float(gone.vy) ** 2, -float(k.mass[slot])
        _log(new, int(command.tick), int(command.body), gone, REMOVED)
    counts.commanded_energy += 0.5 * mass * squares
    return Renewed(composition, new, stands)


def _standing(k: Kernel, scene: Scene, taken: Any, capacity: int, coming: Records | None) -> Scene:
    """Return the scene as it stands now, with the bodies in these slots and perhaps one more."""
    bodies = k.bodies[taken]
    columns = {
        "position": positions_now(k, taken),
        "velocity": np.column_stack([bodies.vx, bodies.vy]),
        "radius": k.radii[taken],
        "mass": k.mass[taken],
    }
    if coming is not None:
        new = {
            "position": (coming.x, coming.y),
            "velocity": (coming.vx, coming.vy),
            "radius": coming.radius,
            "mass": coming.mass,
        }
        columns = {name: np.concatenate([column, [new[name]]]) for name, column in columns.items()}
    return standing(scene, columns, max(capacity, len(columns["radius"])))


def _put(k: Kernel, slot: int, command: Records) -> None:
    """Put a body that comes into a slot that is made for it."""
    new, clock = k.bodies[slot], k.clock[0]
    for name in ("x", "y", "vx", "vy", "radius"):
        new[name] = command[name]
    new.anchor, new.last = command.tick, NOBODY
    k.radii[slot], k.mass[slot] = command.radius, command.mass
    k.queue.number[slot] = command.body
    k.slots[command.body] = slot
    clock.bodies = clock.present = slot + 1
    clock.window_size = getattr(window_of, "py_func", window_of)(slot + 1)


def _log(k: Kernel, tick: int, number: int, plan: Records, code: int) -> None:
    """Write the row of a command, as ``kernel.loop.log_rows`` does."""
    k.counts[0].logged += 1
    if len(k.log):
        row = k.log[int(k.clock[0].written)]
        k.clock[0].written += 1
        row.tick, row.a, row.b = tick, number, code
        row.ax, row.ay, row.avx, row.avy = plan.x, plan.y, plan.vx, plan.vy
