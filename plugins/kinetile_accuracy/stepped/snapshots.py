"""The pseudo-dynamic method (thesis, section 1), the baseline: every dt, the present overlaps get an impulse.

A step moves all discs by ``dt`` in straight lines, reflects the discs that went through a wall, finds the
pairs that overlap, and gives approaching pairs the elastic impulse. Pairs are found by ``sweep``, static
sweep-and-prune along x with discs (the rows themselves) that are kept sorted by insertion, or by ``cells`` as
wide as the largest disc, filled again at each snapshot.

An overlap is seen up to dt late, or not at all between two snapshots. If the only snapshot that sees it falls
into its second half, when the discs part, it gets no impulse. With S = v dt / (sum of radii), and all impact
parameters alike, S^2/6 of encounters pass without an impulse, as long as S is small. Walls are exact.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np

from kinetile import Scene
from kinetile.arrays import Floats, Rows
from kinetile.errors import Refused
from kinetile.instruments import compose, disowned, make_ready, to_be_filled_in
from kinetile.toolbox import BOTTOM, LEFT, RIGHT, TOP, hook

_ROOM = 1 << 14
_MOST_CELLS = 1 << 22

Finder = Literal["sweep", "cells"]

STEPPED = np.dtype([("step", "i8"), ("a", "i4"), ("b", "i4")])
"""A contact found at a snapshot: its number (the start is 0), body ``a`` with body ``b`` > a or a wall
(``kinetile.kernel.log``). Bodies that overlap and do not approach get no impulse, and have no contact."""


class Bodies(NamedTuple):
    """Flat arrays, a row for each body; ``body`` is its number in the scene."""

    x: Any
    y: Any
    vx: Any
    vy: Any
    left: Any  # x - radius, the key of ``sweep``
    radius: Any
    mass: Any
    body: Any
    head: Any  # the first row in each cell, or -1
    following: Any  # the next row in a row's cell, or -1
    log: Any
    logged: Any  # the number of contacts, also without room in the log
    deepest: Any  # the deepest overlap of two bodies so far, in radii of the smaller


# The loop has the form of the kinetic kernel: hooks that are forced inline, a template that ``compose`` fills
# in with the search for pairs, and one tuple of flat arrays that is viewed without its owners.


@hook
def _write(s: Bodies, step: int, a: int, b: int) -> None:
    k = s.logged[0]
    s.logged[0] = k + 1
    if k < len(s.log):
        s.log[k].step = step
        s.log[k].a = a
        s.log[k].b = b


@hook
def _meet(s: Bodies, i: int, j: int, step: int) -> None:
    """Gives the rows i and j the elastic impulse, if they overlap and approach."""
    dx = s.x[j] - s.x[i]
    dy = s.y[j] - s.y[i]
    square = dx * dx + dy * dy
    reach = s.radius[i] + s.radius[j]
    if square < reach * reach:
        depth = (reach - math.sqrt(square)) / min(s.radius[i], s.radius[j])
        s.deepest[0] = max(s.deepest[0], depth)
        approach = dx * (s.vx[j] - s.vx[i]) + dy * (s.vy[j] - s.vy[i])
        if approach < 0.0:
            to_i = s.mass[j] / (s.mass[i] + s.mass[j]) * 2.0 * approach / square
            to_j = s.mass[i] / (s.mass[i] + s.mass[j]) * 2.0 * approach / square
            s.vx[i] += to_i * dx
            s.vy[i] += to_i * dy
            s.vx[j] -= to_j * dx
            s.vy[j] -= to_j * dy
            _write(s, step, min(s.body[i], s.body[j]), max(s.body[i], s.body[j]))


@hook
def _place(s: Bodies, to: int, x: float, y: float, vx: float, vy: float) -> None:
    s.x[to] = x
    s.y[to] = y
    s.vx[to] = vx
    s.vy[to] = vy


@hook
def _sort(s: Bodies) -> None:
    """Sorts the rows by their left bounds, by insertion: few have changed places since the last snapshot."""
    for i in range(1, len(s.x)):
        left = s.left[i]
        if left < s.left[i - 1]:
            x, y, vx, vy = s.x[i], s.y[i], s.vx[i], s.vy[i]
            radius, mass, body = s.radius[i], s.mass[i], s.body[i]
            to = i
            while to > 0 and left < s.left[to - 1]:
                _place(s, to, s.x[to - 1], s.y[to - 1], s.vx[to - 1], s.vy[to - 1])
                s.left[to] = s.left[to - 1]
                s.radius[to] = s.radius[to - 1]
                s.mass[to] = s.mass[to - 1]
                s.body[to] = s.body[to - 1]
                to -= 1
            _place(s, to, x, y, vx, vy)
            s.left[to], s.radius[to], s.mass[to], s.body[to] = left, radius, mass, body


@hook
def _sweep(s: Bodies, step: int, width: float, columns: int, rows: int) -> None:
    """Treats each pair of rows whose extents along x overlap."""
    _sort(s)
    for i in range(len(s.x)):
        right = s.left[i] + 2.0 * s.radius[i]
        for j in range(i + 1, len(s.x)):
            if s.left[j] > right:
                break
            _meet(s, i, j, step)


@hook
def _cells(s: Bodies, step: int, width: float, columns: int, rows: int) -> None:
    """Puts the rows into cells one by one, each treated with the rows already in its cell and around it."""
    s.head[:] = -1
    for i in range(len(s.x)):
        column = min(max(int(s.x[i] / width), 0), columns - 1)
        row = min(max(int(s.y[i] / width), 0), rows - 1)
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(column - 1, 0), min(column + 2, columns)):
                j = s.head[r * columns + c]
                while j >= 0:
                    _meet(s, i, j, step)
                    j = s.following[j]
        s.following[i] = s.head[row * columns + column]
        s.head[row * columns + column] = i


@hook
def _reflect(s: Bodies, i: int, step: int, place: Any, speed: Any, side: float, low: int, high: int) -> None:
    """Moves a row that went through a wall of an axis to its reflected place."""
    radius = s.radius[i]
    if place[i] < radius and speed[i] < 0.0:
        _write(s, step, s.body[i], low)
        place[i] = 2.0 * radius - place[i]
        speed[i] = -speed[i]
    elif place[i] > side - radius and speed[i] > 0.0:
        _write(s, step, s.body[i], high)
        place[i] = 2.0 * (side - radius) - place[i]
        speed[i] = -speed[i]


find: Callable[..., None] = to_be_filled_in
WALLED = True


def _run(
    s: Bodies, steps: int, dt: float, sides: tuple[float, float], cell: float, columns: int, rows: int
) -> None:
    s = disowned(s)
    for step in range(1, steps + 1):
        for i in range(len(s.x)):
            s.x[i] += s.vx[i] * dt
            s.y[i] += s.vy[i] * dt
        if WALLED:
            for i in range(len(s.x)):
                _reflect(s, i, step, s.x, s.vx, sides[0], LEFT, RIGHT)
                _reflect(s, i, step, s.y, s.vy, sides[1], BOTTOM, TOP)
        for i in range(len(s.x)):
            s.left[i] = s.x[i] - s.radius[i]
        find(s, step, cell, columns, rows)


@cache
def snapshot_loop(finder: Finder, walled: bool) -> Callable[..., None]:
    """Returns the compiled loop: ``loop(bodies, steps, dt, sides, cell, columns, rows)``."""
    parts = {"find": _sweep if finder == "sweep" else _cells, "WALLED": walled}
    return compose(_run, parts, f"{finder}_{'walled' if walled else 'open'}", Bodies)


@dataclass(frozen=True)
class SteppedRun:
    """A run in steps of ``dt``: ``position`` and ``velocity``, (n, 2), at the end, in the scene's units and
    order; ``contacts``, dtype STEPPED; the ``deepest`` overlap of two discs at any snapshot, in radii of the
    smaller; and the processor time of the steps alone."""

    dt: float
    steps: int
    position: Floats
    velocity: Floats
    contacts: Rows
    deepest: float
    energy_drift: float
    cpu_seconds: float


def run_snapshots(scene: Scene, dt: float, until: float, *, finder: Finder = "sweep") -> SteppedRun:
    """Runs a scene in steps of ``dt`` to ``until``, or the first step after it; all contacts are elastic.
    Raises Refused for turns, or "cells" without an arena, and the errors of ``steps_until``."""
    if scene.commands:
        raise Refused("snapshots are taken of bodies without turns; run this scene with a Simulation")
    if finder == "cells" and scene.arena is None:
        raise Refused("cells need an arena; take the snapshots of this scene with finder='sweep'")
    dt = float(dt)
    steps = steps_until(scene, dt, until)
    loop = snapshot_loop(finder, scene.arena is not None)
    room = _ROOM
    while True:  # again, with room for all contacts, if the log was too short
        bodies, more = _lay_out(scene, finder, room)
        make_ready(loop, bodies, steps, dt, *more)
        began = time.thread_time()
        loop(bodies, steps, dt, *more)
        cpu_seconds = time.thread_time() - began
        room = int(bodies.logged[0])
        if room <= len(bodies.log):
            break
    order = np.argsort(bodies.body)
    position = np.column_stack([bodies.x, bodies.y])[order]
    velocity = np.column_stack([bodies.vx, bodies.vy])[order]
    contacts, deepest = np.array(bodies.log[:room]), float(bodies.deepest[0])
    drift = energy_drift(scene, velocity)
    return SteppedRun(dt, steps, position, velocity, contacts, deepest, drift, cpu_seconds)


def steps_until(scene: Scene, dt: float, until: float) -> int:
    """Returns the number of steps of ``dt`` to ``until``, or just beyond it. Raises ValueError for an invalid
    ``dt`` or ``until``, and Refused unless all bodies are discs that fly straight."""
    if scene.shapes or scene.accelerated:
        has = "bodies of other shapes" if scene.shapes else "accelerations"
        raise Refused(f"methods in steps need discs that fly straight, and this scene has {has}")
    if not (math.isfinite(dt) and dt > 0.0):
        raise ValueError(f"dt is a length of time, greater than 0; found {dt}")
    if not (math.isfinite(until) and until >= scene.start):
        raise ValueError(f"until={until} lies before the scene's start at {scene.start}")
    # 2.1 / 0.7 is above 3 in doubles: without the last factor there would be one more step.
    return math.ceil((until - scene.start) / dt * (1.0 - 1e-12))


def kinetic_energy(mass: Floats, velocity: Floats) -> float:
    """Returns the kinetic energy of bodies, summed exactly; ``mass`` is (n,), ``velocity`` (n, 2)."""
    return 0.5 * math.fsum(np.asarray(mass * (velocity[:, 0] ** 2 + velocity[:, 1] ** 2)))


def energy_drift(scene: Scene, velocity: Floats) -> float:
    """Returns the relative change of a scene's kinetic energy with these velocities; 0 without energy."""
    before = kinetic_energy(scene.mass, scene.velocity)
    return abs(kinetic_energy(scene.mass, velocity) - before) / before if before > 0.0 else 0.0


def deepest_overlap(position: Floats, radius: Floats) -> float:
    """Returns the deepest overlap of any two discs, in radii of the smaller; 0 without an overlap.
    ``position`` is (n, 2), ``radius`` (n,). By left ends, each is compared with the next within reach."""
    order = np.argsort(position[:, 0] - radius)
    (x, y), r = position[order].T, radius[order]
    deepest = 0.0
    for step in range(1, len(r)):
        reach = r[step:] + r[:-step]
        if not (x[step:] - x[:-step] < reach).any():
            break
        apart = np.hypot(x[step:] - x[:-step], y[step:] - y[:-step])
        deepest = max(deepest, float(((reach - apart) / np.minimum(r[step:], r[:-step])).max()))
    return deepest


def _lay_out(scene: Scene, finder: Finder, room: int) -> tuple[Bodies, tuple[Any, ...]]:
    """Returns the bodies sorted along x, and the arena's sides and cells."""
    n = len(scene)
    sides = scene.arena or (0.0, 0.0)
    cell, columns, rows = 1.0, 0, 0
    if finder == "cells":
        cell = max(2.0 * float(scene.radius.max(initial=0.0)), math.sqrt(sides[0] * sides[1] / _MOST_CELLS))
        columns, rows = max(int(sides[0] / cell), 1), max(int(sides[1] / cell), 1)
    order = np.argsort(scene.position[:, 0] - scene.radius, kind="stable")
    x, y, vx, vy = map(np.array, (*scene.position[order].T, *scene.velocity[order].T))
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
        deepest=np.zeros(1),
    )
    return bodies, (sides, cell, columns, rows)
