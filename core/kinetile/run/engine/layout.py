"""Bodies laid out as the kernel's tables, at their start or in the middle of a run, and the limits that a
speed sets."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kinetile.errors import PhaseError
from kinetile.kernel.clock import SPAN, TICKS
from kinetile.kernel.loop.commands import LONG_AGO, window_of
from kinetile.kernel.skin import Skin
from kinetile.kernel.tables import (
    NEVER,
    NOBODY,
    PASSING,
    TRAIT,
    Kernel,
    allocate,
    pair_set,
    record_table,
)
from kinetile.plugin.calling import described
from kinetile.run.composition import Composition
from kinetile.run.composition.rules import Rules
from kinetile.scene import Scene

__all__ = ["more_passings", "moved", "set_limits", "tables_of"]

LOG_ROWS = 1 << 14


def tables_of(scene: Scene, composition: Composition, unit: float) -> Kernel:
    """Return tables for a scene under its phases; ``unit`` is that of the clock.

    Raises PhaseError where there is no memory for what the broad phase asks for.
    """
    n = len(scene)
    k = _allocated(n, scene, composition)
    bodies = k.bodies[:n]
    bodies.x, bodies.y = scene.position.T
    bodies.vx, bodies.vy = scene.velocity.T
    bodies.radius = k.radii[:n] = scene.radius
    bodies.last = NOBODY
    k.mass[:n] = scene.mass
    if len(k.rules):
        k.traits.kind[:n] = scene.kind_numbers
    clock = k.clock[0]
    clock.tick = unit / TICKS
    clock.per_time = TICKS / unit
    if scene.arena is not None:
        clock.width, clock.height = scene.arena
    clock.window_tick = clock.met_tick = clock.stop_tick = -(2**62)
    return k


def moved(old: Kernel, taken: Any, scene: Scene, composition: Composition) -> Kernel:
    """Return tables for the bodies in some slots of others, in this order and without a gap between them;
    clock, counts, commands and log go on. ``scene`` has these bodies, or one more that is to come.

    Raises PhaseError as ``tables_of`` does.
    """
    n = len(taken)
    k = _allocated(n, scene, composition)._replace(
        slots=np.full_like(old.slots, NOBODY),
        commands=old.commands,
        met=old.met,
        log=old.log,
        watch=old.watch,
        watched=old.watched,
    )
    new_slot = np.full(len(old.bodies) + 1, NOBODY)  # with one more, for NOBODY
    new_slot[taken] = np.arange(n)
    k.bodies[:n] = old.bodies[taken]
    k.bodies[:n].last = new_slot[old.bodies.last[taken]]
    k.radii[:n], k.mass[:n] = old.radii[taken], old.mass[taken]
    if len(k.rules):
        k.traits[:n] = old.traits[taken]
        k = _with_passings(k, old, new_slot)
    k.queue.number[:n] = old.queue.number[taken]
    k.slots[old.queue.number[taken]] = np.arange(n)
    k.counts[0] = old.counts[0]
    kept = {name: k.clock[0][name] for name in ("bodies", "present", "vacant", "spin_limit", "window_size")}
    k.clock[0] = old.clock[0]
    for name, value in kept.items():
        k.clock[0][name] = value
    return k


def _allocated(bodies: int, scene: Scene, composition: Composition) -> Kernel:
    """Return tables for so many bodies in the first slots, and for as many more as the phases made room
    for."""
    slots = scene.capacity if composition.living else len(scene)
    pairs, room = int(composition.broad.pairs), max(int(composition.broad.room), slots)
    try:
        k = allocate(slots, room, max(LOG_ROWS, 2 * slots))
        if pairs:
            k = pair_set(k, pairs)
        if composition.rules is not None:
            k = _with_rules(k, composition.rules)
    except MemoryError as error:
        who = described("broad phase", composition.broad_phase)
        said = f"there is no memory for its {pairs} pairs and for {room} bodies near one"
        raise PhaseError(f"{who}: {said}") from error
    k.queue.number[bodies:] = k.slots[bodies:] = NOBODY
    clock = k.clock[0]
    clock.bodies = clock.present = bodies
    clock.spin_limit = 2 * (2 * slots + 2) ** 2 + 1000
    clock.window_size = window_of(bodies)
    return k


def _with_rules(k: Kernel, rules: Rules) -> Kernel:
    """Return the tables with what responses need."""
    slots = len(k.bodies)
    traits = record_table(TRAIT, slots)
    traits.leave, traits.touched = NEVER, LONG_AGO
    k.clock[0].kinds = rules.kinds
    k.clock[0].passable = NOBODY
    return k._replace(traits=traits, rules=rules.table, passers=np.full(slots, -1, dtype=np.int32))


def more_passings(k: Kernel, room: int) -> Kernel:
    """Return the tables with room for so many pairs that pass through each other; those that do stay."""
    old, clock = k.passings, k.clock[0]
    new = record_table(PASSING, max(room, len(old)))
    new[: len(old)] = old
    new.a[len(old) :] = NOBODY
    new.next_a[len(old) :] = [*range(len(old) + 1, len(new)), int(clock.passable)][: len(new) - len(old)]
    if len(new) > len(old):
        clock.passable = len(old)
    return k._replace(passings=new)


def _with_passings(k: Kernel, old: Kernel, new_slot: Any) -> Kernel:
    """Return tables in which the pairs pass that do in others, by their new slots."""
    passings = record_table(PASSING, len(old.passings))
    passings[:] = old.passings
    live = passings.a >= 0
    passings.a[live], passings.b[live] = new_slot[old.passings.a[live]], new_slot[old.passings.b[live]]
    k.passers[: len(new_slot)] = -1
    heads = new_slot[:-1]
    k.passers[heads[heads >= 0]] = old.passers[heads >= 0]
    return k._replace(passings=passings)


def set_limits(k: Kernel, skin: Skin, extent: float, speed: float, prepared: Scene) -> None:
    """Write down what follows from a skin, for bodies within an extent of the origin and never faster than a
    speed: their reach, and for how long and how well the common clock holds; and for which radii the phases
    have been ``prepared``."""
    clock = k.clock[0]
    clock.least = prepared.radius.min(initial=math.inf)
    clock.widest = prepared.radius.max(initial=0.0)
    k.bodies.reach = k.bodies.radius + skin.delta
    clock.speed2, clock.faster = speed * speed, 0
    clock.skin, clock.theta, clock.tolerance = skin.delta, skin.theta, skin.tolerance
    span = SPAN // 2
    if speed > 0.0:
        span = int(min(4.0 * extent / speed * float(clock.per_time), float(span)))
    clock.span = span
    clock.fat = skin.fat(extent + 2.0 * speed * (span * float(clock.tick)))
