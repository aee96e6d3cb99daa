"""What a run leaves in the kernel's tables, as far as it may not depend on the broad phase.

Contacts and places are what a user sees. A phase that tampers with a count, with a body's ``last`` or with
the tolerance can leave both as they should be, and do its harm in another scene. So runs are compared by all
that is a function of the scene alone.

What is left out, because phases differ in it and may: how often somebody was asked and structural events
happened, the calendar and the pair set, and since when places hold on the common clock. The skin and what
follows from it is a function of the scene within walls; without them it is worked out anew, from how far
bodies have flown, whenever a phase's pair set grows. There it is compared with the bodies' reach alone.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError
from kinetile.kernel.loop.presence import slots_taken
from kinetile.kernel.tables import NOBODY
from kinetile.run.simulation import Simulation

__all__ = ["left_behind", "left_otherwise"]

Left = Mapping[str, npt.NDArray[np.generic]]

BODIES = ("x", "y", "vx", "vy", "anchor", "radius")
CLOCK = (
    *("now", "tick", "per_time", "width", "height", "present", "epoch"),
    *("window", "window_size", "window_tick", "fault"),
)
OF_THE_SKIN = ("skin", "theta", "tolerance", "span", "fat")
COUNTS = (
    *("contacts_disc", "contacts_wall", "turns", "inserted", "removed"),
    *("logged", "deepest", "commanded_energy"),
)


def left_behind(sim: Simulation) -> Left:
    """Return copies of all that a run has left, by name: an array with a place for each body, or of one
    number. Empty where the tables cannot be read."""
    try:
        k = sim.tables
    except KinetileError:
        return {}
    clock = k.clock[0]
    walled = sim.scene.arena is not None and sim.composition.wall is not None
    lives = bool(k.counts[0].inserted + k.counts[0].removed)
    there = slots_taken(k)
    full = not lives and len(there) == len(k.bodies)  # a phase without `enter` has no slots to spare
    same_skin = walled and full  # which depends on how many slots there are
    bodies, number = k.bodies[there], np.append(k.queue["number"], NOBODY)
    left = {f"bodies.{name}": np.array(bodies[name]) for name in BODIES}
    met = bodies.last
    if lives:  # a slot that somebody has left and another has taken counts for nobody: it does not name back
        met = np.where((met >= 0) & (k.bodies.last[met] == there), met, NOBODY)
    left["bodies.last"] = number[met]
    left["mass"] = np.array(k.mass[there])
    left["radii"] = np.array(k.radii[there])
    left["bodies.reach is radius and skin"] = np.array(bodies.reach == bodies.radius + clock.skin)
    if not lives:
        left["bodies.stamp"] = np.array(bodies.stamp)  # else it depends on who had the slot before
    if full:
        left["clock.spin_limit"] = np.array([clock.spin_limit])  # so does this on how many slots there are
    if same_skin:
        left["bodies.reach"] = np.array(bodies.reach)
    for name in (*CLOCK, *(OF_THE_SKIN if same_skin else ())):
        left[f"clock.{name}"] = np.array([clock[name]])
    return left | {f"counts.{name}": np.array([k.counts[0][name]]) for name in COUNTS}


def left_otherwise(found: Left, expected: Left) -> str | None:
    """Return the first thing that one run has left otherwise than another, in a sentence; None: nothing."""
    for name in expected:
        if name not in found or found[name].tobytes() == expected[name].tobytes():
            continue
        mine, right = found[name], expected[name]
        parted = np.flatnonzero(mine != right)
        at = int(parted[0]) if len(parted) else 0
        whose = f" of body {at}" if len(right) > 1 or not name.startswith(("clock", "counts")) else ""
        return f"at the end {name}{whose} is {mine[at].item()!r}, not {right[at].item()!r}"
    return None
