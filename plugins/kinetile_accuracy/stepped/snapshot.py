"""The pseudo-dynamic method (thesis, section 1): look at the discs every dt, and see which of them overlap.

It is the method that most simulations use, and what the kinetic methods are measured against, so it is made
as fast as it can fairly be. A step moves all discs by ``dt`` in straight lines, puts those that went through
a wall back to where the reflection has them, finds the pairs that overlap, and gives those that approach each
other the elastic impulse. Two ways to find the pairs:

- ``sweep``: static sweep-and-prune along x, the discs kept sorted by insertion from one snapshot to the next
  (the rows themselves are moved, so that the sweep reads the memory in order);
- ``cells``: a grid of cells as wide as the largest disc, filled anew at each snapshot.

What it gets wrong is no rounding. An overlap is seen up to dt late, or not at all if it begins and ends
between two snapshots; and where the only snapshot that sees it falls into its second half, in which the discs
part, there is nothing to do any more. With S = v dt / (sum of radii), and all impact parameters alike, S^2/24
of encounters are not seen, and S^2/6 pass without an impulse, as long as S is small. Walls are exact, so that
all of its error is the discs'. The loop is compiled by the same means as the kinetic ones, and its processor
time is taken in the same way.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import Refused
from kinetile.kernel.compiled import make_ready
from kinetile.scene import Scene
from kinetile_accuracy.stepped.snapshot_loop import (
    STEPPED,
    Bodies,
    Discs,
    Finder,
    deepest_loop,
    snapshot_loop,
)

__all__ = [
    "STEPPED",
    "Finder",
    "Stepped",
    "deepest_overlap",
    "kinetic_energy",
    "run_snapshots",
    "steps_until",
]

Floats = npt.NDArray[np.float64]
_ROOM = 1 << 14
_MOST_CELLS = 1 << 22


@dataclass(frozen=True)
class Stepped:
    """A run in steps of ``dt``.

    Attributes:
        dt, steps: the step and how many were taken.
        position, velocity: (n, 2), after the last step, in the scene's units and order.
        overlaps: dtype STEPPED, in the order of steps; what is in it depends on what was asked for.
        deepest: the deepest overlap of two discs among them, in radii of the smaller.
        energy_drift: relative change of the kinetic energy.
        cpu_seconds: processor time of the steps, set-up and compilation apart.
    """

    dt: float
    steps: int
    position: Floats
    velocity: Floats
    overlaps: npt.NDArray[np.void]
    deepest: float
    energy_drift: float
    cpu_seconds: float

    @property
    def contacts(self) -> npt.NDArray[np.void]:
        """The overlaps with an impulse."""
        acted: npt.NDArray[np.void] = self.overlaps[self.overlaps["acted"]]
        return acted

    @property
    def median_depth(self) -> float:
        """How deep two discs overlap at their contacts, in radii of the smaller: the median."""
        depths = self.contacts["depth"][self.contacts["b"] >= 0]
        return float(np.median(depths)) if len(depths) else 0.0


def run_snapshots(
    scene: Scene, dt: float, until: float, *, finder: Finder = "sweep", parting: bool = False
) -> Stepped:
    """Run a scene in steps of ``dt`` to ``until``, or to the first step after it.

    All contacts are elastic. ``finder`` is how overlapping pairs are found (see the module). With
    ``parting``, the result has all overlaps, also those at which the discs do not approach; without, the
    contacts alone.

    Raises:
        Refused: the scene has turns; or it has no arena, and ``finder`` is "cells".
        ValueError: ``dt`` is not a number greater than 0, or ``until`` lies before the scene's start.
    """
    if scene.commands:
        raise Refused("snapshots are taken of bodies without turns; run this scene with a Simulation")
    if finder == "cells" and scene.arena is None:
        raise Refused("cells need an arena; take the snapshots of this scene with finder='sweep'")
    dt = float(dt)
    steps = steps_until(scene, dt, until)
    loop = snapshot_loop(finder, scene.arena is not None)
    room = _ROOM
    while True:  # again, with room for all, where the log was too short
        bodies, more = _lay_out(scene, finder, room)
        make_ready(loop, bodies, steps, dt, parting, *more)
        began = time.thread_time()
        loop(bodies, steps, dt, parting, *more)
        cpu_seconds = time.thread_time() - began
        room = int(bodies.logged[0])
        if room <= len(bodies.log):
            break
    order = np.argsort(bodies.body)
    position = np.column_stack([bodies.x, bodies.y])[order]
    velocity = np.column_stack([bodies.vx, bodies.vy])[order]
    overlaps = np.array(bodies.log[:room])
    depths = overlaps["depth"][overlaps["b"] >= 0]
    before = kinetic_energy(scene.mass, scene.velocity)
    after = kinetic_energy(scene.mass, velocity)
    return Stepped(
        dt=dt,
        steps=steps,
        position=position,
        velocity=velocity,
        overlaps=overlaps,
        deepest=float(depths.max(initial=0.0)),
        energy_drift=abs(after - before) / before if before > 0.0 else 0.0,
        cpu_seconds=cpu_seconds,
    )


def steps_until(scene: Scene, dt: float, until: float) -> int:
    """Return how many steps of ``dt`` lead to ``until``, or just beyond it.

    Raises ValueError where ``dt`` is not greater than 0, or ``until`` lies before the scene's start.
    """
    if not (math.isfinite(dt) and dt > 0.0):
        raise ValueError(f"dt is a length of time, greater than 0; found {dt}")
    if not (math.isfinite(until) and until >= scene.start):
        raise ValueError(f"until={until} lies before the scene's start at {scene.start}")
    return math.ceil((until - scene.start) / dt * (1.0 - 1e-12))


def kinetic_energy(mass: Floats, velocity: Floats) -> float:
    """Return the kinetic energy of bodies, summed exactly; ``mass`` is (n,), ``velocity`` (n, 2)."""
    return 0.5 * math.fsum(np.asarray(mass * (velocity[:, 0] ** 2 + velocity[:, 1] ** 2)))


def deepest_overlap(position: Floats, radius: Floats) -> float:
    """Return how deep any two discs overlap, in radii of the smaller; 0 where none do.

    ``position`` is (n, 2), ``radius`` (n,). All pairs are looked at.
    """
    return float(deepest_loop()(Discs(position[:, 0].copy(), position[:, 1].copy(), np.array(radius))))


def _lay_out(scene: Scene, finder: Finder, room: int) -> tuple[Bodies, tuple[Any, ...]]:
    """Return the bodies sorted along x, and the arena's sides and cells."""
    n = len(scene)
    sides = scene.arena or (0.0, 0.0)
    cell, columns, rows = 1.0, 0, 0
    if finder == "cells":
        cell = max(2.0 * float(scene.radius.max(initial=0.0)), math.sqrt(sides[0] * sides[1] / _MOST_CELLS))
        columns, rows = max(int(sides[0] / cell), 1), max(int(sides[1] / cell), 1)
    order = np.argsort(scene.position[:, 0] - scene.radius, kind="stable")
    x, y = (np.array(scene.position[order, axis]) for axis in (0, 1))
    vx, vy = (np.array(scene.velocity[order, axis]) for axis in (0, 1))
    bodies = Bodies(
        x=x,
        y=y,
        vx=vx,
        vy=vy,
        left=x - scene.radius[order],
        radius=scene.radius[order],
        mass=scene.mass[order],
        body=order.astype(np.int32),
        head=np.empty(columns * rows, np.int32),
        following=np.empty(n, np.int32),
        log=np.zeros(room, STEPPED).view(np.recarray),
        logged=np.zeros(1, np.int64),
    )
    return bodies, (sides, cell, columns, rows)
