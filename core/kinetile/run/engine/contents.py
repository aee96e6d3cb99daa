"""The state of a run at one moment, without what is built from it: the structure of the broad phase and the
queue.

Tables of the kernel are made from such contents alone: at the start, when phases are prepared again during a
run, and where a saved run goes on. Building cannot change a contact (docs/one-answer.md), so a snapshot needs
no more. Bodies go by their numbers: a slot is a place in the tables of one engine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import Clock
from kinetile.kernel.images import BEAT
from kinetile.kernel.log import CONTACT, Fingerprint
from kinetile.kernel.loop.commands import LONG_AGO
from kinetile.kernel.plan import Plan
from kinetile.kernel.tables import (
    BODY,
    COMMAND,
    COUNTS,
    IMAGE,
    NOBODY,
    PASSING,
    TRAIT,
    Kernel,
    column,
    slots_taken,
)
from kinetile.run.compose import Commands
from kinetile.run.engine.agenda import Command, History, Rows, planned, waiting
from kinetile.run.engine.bounds import Bounds
from kinetile.run.engine.ledger import Entries
from kinetile.scene import Insert, Scene
from kinetile.scene.bodies import nearest_image, overlapping_images, whole_periods
from kinetile.scene.shapes import Shape

OF_BODIES = (*Plan._fields, "anchor", "radius")
OF_TRAITS = ("kind", "touched")
OF_IMAGES = ("kx", "ky", "last_m", "last_n")
OF_PASSINGS = ("a", "b", "m", "n", "begun", "tick")

PLAN = np.dtype(
    [
        ("number", "i4"),
        ("last", "i4"),  # the number of the partner of the contact that made this plan, or NOBODY
        ("mass", "f8"),
        *((name, BODY[name]) for name in OF_BODIES),
        ("form", "i4"),  # its shape; -1 where all bodies are discs. Before the kind, so that no byte is spare
        *((name, TRAIT[name]) for name in OF_TRAITS),  # 0 and LONG_AGO in a scene without rules
        *((name, IMAGE[name]) for name in OF_IMAGES),  # 0 where no axis is periodic
    ],
    align=True,
)
"""The flight plan of a body, and what belongs to it."""

PASSED = np.dtype([(name, PASSING[name]) for name in OF_PASSINGS])
"""A pair that passes through each other, by numbers, ``a`` the elder."""

CARRIED = (
    *("now", "met_tick", "met_there", "jam.window", "jam.window_tick", "torus.beat", "torus.number"),
    *("stops.tick", "stops.a", "stops.b", "fault.code", "fault.a", "fault.b"),
)
"""Fields of the clock that follow neither from the scene nor from the bodies; ``a`` and ``b`` by numbers."""

COSTS = (
    *("structural", "asks", "asked", "newcomers", "exact", "updated", "queued", "queue_max", "pairs_max"),
    "late",
)
"""Counts that depend on the structure: in a run that was resumed they may be others."""


class Contents(NamedTuple):
    """Contents of tables: (n,) plans in the order of numbers, (m,) passings in the order of pairs, the
    commands that wait, the counts, and by name the fields of the clock in ``CARRIED``."""

    plans: npt.NDArray[Any]
    passings: npt.NDArray[Any]
    commands: Rows
    counts: npt.NDArray[Any]
    clock: Mapping[str, int]


def contents_of(k: Kernel) -> Contents:
    """Returns the contents of tables, as copies."""
    taken, number = slots_taken(k), np.append(k.queue.view(np.ndarray)["number"], np.int32(NOBODY))
    bodies = k.bodies.view(np.ndarray).take(taken)
    plans = np.zeros(len(taken), PLAN)
    plans["touched"] = LONG_AGO
    plans["number"], plans["mass"] = number[taken], k.mass[taken]
    plans["last"] = number[bodies["last"]]
    plans["form"] = bodies["form"] if len(k.sides) else -1
    sources: list[tuple[Any, tuple[str, ...]]] = [(bodies, OF_BODIES)]
    if len(k.traits):
        sources.append((k.traits.view(np.ndarray).take(taken), OF_TRAITS))
    if len(k.images):
        sources.append((k.images.view(np.ndarray).take(taken), OF_IMAGES))
    for table, names in sources:
        for name in names:
            plans[name] = table[name]
    live = k.passings.view(np.ndarray)
    live = live[live["a"] >= 0]
    passings = np.zeros(len(live), PASSED)
    for name in OF_PASSINGS:
        passings[name] = number[live[name]] if name in ("a", "b") else live[name]
    passings.sort(order=OF_PASSINGS)
    clock = {name: int(column(k.clock, name)[0]) for name in CARRIED}
    for name in ("fault.a", "fault.b"):  # in tables they are slots, or a wall
        slot = clock[name] if clock["fault.code"] else NOBODY
        clock[name] = int(number[slot]) if slot >= 0 else slot
    return Contents(plans, passings, waiting(k).copy(), np.array(k.counts), clock)


def contents_at_start(scene: Scene) -> Contents:
    """Returns the contents with which the run of a scene begins; the periods are taken off its places."""
    plans = np.zeros(len(scene), PLAN)
    plans["number"], plans["last"], plans["touched"] = np.arange(len(scene)), NOBODY, LONG_AGO
    place = nearest_image(scene.position, scene.periods)
    plans["x"], plans["y"] = place.T
    plans["vx"], plans["vy"] = scene.velocity.T
    plans["radius"], plans["mass"], plans["kind"] = scene.radius, scene.mass, scene.kind_numbers
    plans["form"] = scene.shape
    if scene.periodic:
        plans["kx"], plans["ky"] = whole_periods(scene.position - place, scene.periods).T
    clock = dict.fromkeys(CARRIED, 0)
    clock |= dict.fromkeys(("met_tick", "jam.window_tick", "stops.tick"), LONG_AGO) | {"torus.beat": BEAT}
    clock |= dict.fromkeys(("fault.a", "fault.b"), NOBODY)
    empty = np.zeros(0, PASSED), np.zeros(0, COMMAND), np.zeros(1, COUNTS)
    return Contents(plans, *empty, clock)


@dataclass(frozen=True, eq=False)
class RunState:
    """What an engine begins with, and what is saved of it between two chunks.

    Attributes:
        contents: the contents of the tables.
        base: that of the clock.
        bounds: those in force, without the extent and the skin, which follow from where bodies are.
        commands: which commands the loop is composed with.
        later: the commands of later spans of the clock.
        history: the interactive commands so far.
        entries: the contents of the ledger.
        requested: the requested time, if the run has ended at it.
        overlapping: (m, 2) pairs near each other at the start, before it is decided which begin to pass.
        shapes: the shapes that were added by hand, after those of the scene.
        audits: the number of audits; ``cpu_seconds`` and ``compile_seconds`` as of the engine.
    """

    contents: Contents
    base: int
    bounds: Bounds
    commands: Commands
    later: tuple[Command, ...]
    history: History
    entries: Entries
    requested: float | None
    overlapping: npt.NDArray[np.int64]
    shapes: tuple[Shape, ...] = ()
    audits: int = 0
    cpu_seconds: float = 0.0
    compile_seconds: float = 0.0

    @classmethod
    def at_start(cls, scene: Scene, clock: Clock, keep_contacts: bool) -> Self:
        """Returns the state with which the run of a scene begins."""
        return cls(
            contents=contents_at_start(scene),
            base=0,
            bounds=Bounds.at_start(scene),
            commands=Commands.of(scene),
            later=tuple(planned(scene, clock)),
            history=History(),
            entries=Entries(0, np.zeros(0, CONTACT) if keep_contacts else None, Fingerprint(), (), ()),
            requested=None,
            overlapping=overlapping(scene),
        )


def overlapping(scene: Scene) -> npt.NDArray[np.int64]:
    """Returns (m, 2) the bodies that may overlap at the start, the elder first, in their order: which of them
    begin to pass is decided where that is done (``responses.begin_at_start``)."""
    if all(response.name != "pass" for _, response in scene.responses):
        return np.zeros((0, 2), dtype=np.int64)
    overlaps = overlapping_images(scene.position, scene.radius, scene.periods)
    pairs = np.concatenate([*overlaps, np.zeros((0, 2), dtype=np.int64)])
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def numbers_of(scene: Scene, history: History) -> int:
    """Returns how many numbers bodies have been given, those of planned insertions among them."""
    coming = [command.body for command in scene.commands if isinstance(command, Insert)]
    return max([len(scene) - 1, *coming]) + 1 + len(history.inserted)
