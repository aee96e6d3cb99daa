"""The phases prepared anew in the middle of a run, and the tables laid out for them: because somebody comes
for whom there is no slot, or because the broad phase takes nobody in and lets nobody go.

Everything here is made aside: where a phase refuses, what there was goes on.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from kinetile.kernel.flight import positions_now
from kinetile.kernel.log import INSERTED
from kinetile.kernel.loop.presence import slots_taken
from kinetile.kernel.tables import Kernel, Records
from kinetile.run.composition import Composition
from kinetile.run.engine.layout import moved
from kinetile.scene import Scene, standing
from kinetile.scene.variants import LEAST

__all__ = ["Renewed", "carried_out", "renewed"]


class Renewed(NamedTuple):
    """What a run goes on with: phases, and tables for them."""

    composition: Composition
    k: Kernel


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
    return Renewed(composition, moved(k, taken, stands, composition))


def carried_out(k: Kernel, scene: Scene, composition: Composition) -> Renewed:
    """Carry out the next command, by which a body comes or goes, and prepare the phases for who is there
    then.

    Raises Refused where a phase cannot do that.
    """
    command = k.commands[int(k.clock[0].command)]
    taken = slots_taken(k)
    if int(command.code) == INSERTED:
        stands = _standing(k, scene, taken, 0, command)
        composition = composition.prepared_for(stands)
        new = moved(k, taken, stands, composition)  # with an empty slot
        composition.obeying()(new, composition.broad.state)
        return Renewed(composition, new)
    obeying, state = composition.obeying(), composition.broad.state
    stays = taken[taken != int(k.slots[command.body])]
    stands = _standing(k, scene, stays, 0, None)
    composition = composition.prepared_for(stands)
    aside = Kernel(*(table.copy() for table in k))._replace(met=k.met, log=k.log)
    obeying(aside, state)
    return Renewed(composition, moved(aside, stays, stands, composition))


def _standing(k: Kernel, scene: Scene, taken: Any, capacity: int, coming: Records | None) -> Scene:
    """Return the scene as it stands now, with the bodies in these slots and perhaps one more."""
    bodies = k.bodies[taken]
    columns = {
        "position": positions_now(k, taken),
        "velocity": np.column_stack([bodies.vx, bodies.vy]),
        "radius": k.radii[taken],
        "mass": k.mass[taken],
        "kind_numbers": k.traits.kind[taken].astype(np.int64)
        if len(k.rules)
        else np.zeros(len(taken), np.int64),
    }
    if coming is not None:
        new = {
            "position": (coming.x, coming.y),
            "velocity": (coming.vx, coming.vy),
            "radius": coming.radius,
            "mass": coming.mass,
            "kind_numbers": coming.kind,
        }
        columns = {name: np.concatenate([column, [new[name]]]) for name, column in columns.items()}
    return standing(scene, columns, max(capacity, len(columns["radius"])))
