"""The state of a run at one moment, without the parts that are built from it, the broad phase's structure and
the queue. Tables of the kernel are made from it alone. It identifies bodies by their numbers: a slot is a
place in the tables of one engine."""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from kinetile.arrays import Array, Integers, Rows
from kinetile.kernel.clock import Clock
from kinetile.kernel.images import BEAT
from kinetile.kernel.log import CONTACT, Fingerprint
from kinetile.kernel.tables import (
    CARRIED_ROWS,
    NEGATIVE_PARTNERS,
    NEVER,
    NOBODY,
    Kernel,
    begun,
    copy_carried,
    slots_taken,
)
from kinetile.run.compose import CommandSupport
from kinetile.run.engine.bounds import Bounds
from kinetile.run.engine.commands import History, Planned, planned, waiting
from kinetile.run.engine.ledger import Entries
from kinetile.scene import Insert, Scene
from kinetile.scene.bodies import nearest_image, overlapping_images, whole_periods
from kinetile.scene.shapes import Shape


class Contents(NamedTuple):
    """The carried contents of tables, in records of the types ``CARRIED_ROWS``: (n,) flight plans in the
    order of numbers, each with its body's values; (m,) pairs that pass through each other, by numbers, in
    their order; the waiting commands; the counts; and the clock. Numbers of bodies replace slots in it."""

    plans: Array
    passings: Array
    commands: Rows
    counts: Array
    clock: Array


def contents_of(k: Kernel) -> Contents:
    """Returns the contents of tables, as copies."""
    taken, number = slots_taken(k), np.append(k.queue.view(np.ndarray)["number"], NEGATIVE_PARTNERS)
    plans, clock = begun(np.zeros(len(taken), CARRIED_ROWS["plans"])), np.zeros(1, CARRIED_ROWS["clock"])
    plans["mass"] = k.mass[taken]
    for table in (k.queue, k.bodies, k.traits, k.images):
        if len(table):
            copy_carried(table.view(np.ndarray).take(taken), plans, number)
    copy_carried(k.clock, clock, number)
    if not clock["fault.code"]:
        clock["fault.a"] = clock["fault.b"] = NOBODY
    return Contents(plans, passings_of(k), waiting(k).copy(), np.array(k.counts), clock)


def passings_of(k: Kernel) -> Array:
    """Returns the passings now, by the numbers of their bodies, in their order."""
    live = k.passings.view(np.ndarray)
    live = live[live["a"] >= 0]
    passings = np.zeros(len(live), CARRIED_ROWS["passings"])
    copy_carried(live, passings, np.append(k.queue.view(np.ndarray)["number"], NEGATIVE_PARTNERS))
    passings.sort(order=("a", "b", "m", "n"))
    return passings


def contents_at_start(scene: Scene) -> Contents:
    """Returns the contents at the begin of a scene's run; places are reduced by their periods."""
    plans, clock = (
        begun(np.zeros(len(scene), CARRIED_ROWS["plans"])),
        begun(np.zeros(1, CARRIED_ROWS["clock"])),
    )
    plans["number"] = np.arange(len(scene))
    place = nearest_image(scene.position, scene.periods)
    plans["x"], plans["y"] = place.T
    plans["vx"], plans["vy"] = scene.velocity.T
    plans["ax"], plans["ay"] = plans["whole_x"], plans["whole_y"] = scene.acceleration.T
    plans["radius"], plans["mass"], plans["kind"] = scene.radius, scene.mass, scene.kind_numbers
    plans["form"] = scene.shape
    if scene.periodic:
        plans["kx"], plans["ky"] = whole_periods(scene.position - place, scene.periods).T
    clock["torus.beat"] = BEAT if scene.periodic else NEVER
    empty = (
        np.zeros(0, CARRIED_ROWS["passings"]),
        np.zeros(0, CARRIED_ROWS["commands"]),
        np.zeros(1, CARRIED_ROWS["counts"]),
    )
    return Contents(plans, *empty, clock)


USED = ("cpu_seconds", "compile_seconds", "python_seconds", "python_events", "python_contacts")
"""Fields of a state with the costs of a run."""


@dataclass(frozen=True, eq=False)
class RunState:
    """The first state of an engine, and the saved state between two chunks.

    ``base`` is the clock's base; ``bounds`` are the bounds in force, without extent and skin, which follow
    from the positions of bodies. ``commands`` is the loop's support of commands, ``later`` has commands of
    later spans of the clock, ``history`` has the interactive ones so far. ``entries`` are the contents of the
    ledger; ``requested`` is the requested time if the run has ended at it. ``overlapping``, (m, 2), are pairs
    near each other at the start, before it is decided which begin to pass; ``shapes`` are shapes added by
    hand, and ``pull`` has the largest accelerations, if they differ.
    """

    contents: Contents
    base: int
    bounds: Bounds
    commands: CommandSupport
    later: Planned
    history: History
    entries: Entries
    requested: float | None
    overlapping: Integers
    shapes: tuple[Shape, ...] = ()
    pull: tuple[float, float] | None = None
    audits: int = 0
    cpu_seconds: float = 0.0
    compile_seconds: float = 0.0
    python_seconds: float = 0.0
    python_events: int = 0
    python_contacts: int = 0

    @classmethod
    def at_start(cls, scene: Scene, clock: Clock, keep_contacts: bool, keep_commands: bool) -> Self:
        """Returns the state at the begin of a scene's run."""
        return cls(
            contents=contents_at_start(scene),
            base=0,
            bounds=Bounds.at_start(scene),
            commands=CommandSupport.of(scene),
            later=planned(scene, clock),
            history=History(kept=keep_commands),
            entries=Entries(0, np.zeros(0, CONTACT) if keep_contacts else None, Fingerprint(), (), ()),
            requested=None,
            overlapping=overlapping(scene),
        )


def overlapping(scene: Scene) -> Integers:
    """Returns the pairs of bodies that may overlap at the start, (m, 2), the elder first, in their order;
    ``responses.begin_at_start`` decides which of them begin to pass."""
    if not any(response.passes for _, response in scene.responses):
        return np.zeros((0, 2), dtype=np.int64)
    overlaps = overlapping_images(scene.position, scene.radius, scene.periods)
    pairs = np.concatenate([*overlaps, np.zeros((0, 2), dtype=np.int64)])
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def numbers_of(scene: Scene, history: History) -> int:
    """Returns the number of body numbers in use, also for planned insertions."""
    coming = [command.body for command in scene.commands if isinstance(command, Insert)]
    return max([len(scene) - 1, *coming]) + 1 + sum(many for _, many in history.told.inserted)
