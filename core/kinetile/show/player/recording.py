"""What a page shows of a run: all rows of a window of time, and the structural events where it was stepped.

A run is made twice. The first time it runs freely, and its rows are recorded: they are the same under every
broad phase. The second time it is stepped event by event, which costs a hundred times as much, to see what
the broad phase does between the rows; so this is done only for as many events as ``MOST_STEPS``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import KinetileError
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.log import LOG, REANCHORED
from kinetile.kernel.tables import NEVER
from kinetile.run.simulation import Simulation
from kinetile.scene import Scene
from kinetile.show.player.plans import Plans
from kinetile.show.player.structure import StructureLog

__all__ = ["MOST_ROWS", "MOST_STEPS", "Recording", "Stepped", "record", "shortened", "window_of"]

MOST_ROWS = 200_000
"""Rows of a page, some 30 bytes each; a run of more is shown up to there."""

MOST_STEPS = 5_000
"""Events of a run that is stepped; beyond, a page has rows alone."""


@dataclass(frozen=True)
class Stepped:
    """What stepping has shown: structural events, (m,) each: exact time, the body whose certificate failed,
    and after how many rows of the window it came; how many bodies were queued after each number of events,
    (k,); and the structure that the phase draws."""

    epoch: npt.NDArray[np.int64]
    tick: npt.NDArray[np.int64]
    body: npt.NDArray[np.int64]
    after: npt.NDArray[np.int64]
    queue: npt.NDArray[np.int64]
    structure: StructureLog


@dataclass(frozen=True)
class Recording:
    """A window of a run: plans at its beginning, rows (dtype LOG) in it, and from when to when it goes, in
    ticks since the scene's start.

    ``notes`` are sentences that a reader should see: how it ended, and what is left out.
    """

    label: str
    plans: Plans
    rows: npt.NDArray[Any]
    begin: int
    end: int
    stepped: Stepped | None = None
    notes: tuple[str, ...] = ()


def record(
    scene: Scene,
    simulation: Simulation,
    again: Simulation | None,
    label: str,
    begin: float,
    until: float,
    max_contacts: int | None = None,
) -> Recording:
    """Run a simulation that has not begun, and return its window from ``begin`` to ``until``, or to so many
    contacts; None: as many as fit.

    ``again`` is another such, to be stepped; None: nothing is. A fault ends the recording with a note.
    """
    rows: list[npt.NDArray[Any]] = [np.zeros(0, LOG)]
    notes: list[str] = []
    clock = Clock(scene.start, scene.time_unit)
    first = clock.ticks(begin)
    try:
        if begin > scene.start:
            simulation.run(begin, recorder=rows.append)
        most = MOST_ROWS if max_contacts is None else max_contacts
        simulation.run(until, max_contacts=most, recorder=rows.append)
    except KinetileError as error:
        notes.append(f"The run ended with a fault, {type(error).__name__}: {error}")
    found = np.concatenate(rows)
    last = max(_ticks(found[-1:]).max(initial=first), _now(simulation, clock) if not notes else first)
    if not notes and max_contacts is None and simulation.time < until:
        notes.append(shortened(begin, simulation.time, until))
    recording = window_of(scene, found, label, first, int(last), tuple(notes))
    return recording if again is None else _with_steps(recording, again, clock, begin)


def shortened(begin: float, shown: float, until: float) -> str:
    """Return the sentence that a page has not all of a window."""
    return (
        f"Shown up to {shown!r} of {begin!r} to {until!r}: {MOST_ROWS:,} events are as many as a page takes. "
        f"The next window: --from {shown!r}"
    )


def window_of(
    scene: Scene, rows: npt.NDArray[Any], label: str, begin: int, end: int, notes: tuple[str, ...] = ()
) -> Recording:
    """Return the window from tick ``begin`` to ``end`` of a run whose rows are all there."""
    done = int((_ticks(rows) <= begin).sum()) if len(rows) and begin > 0 else 0
    plans = Plans.of(scene, rows).after(rows[:done])
    return Recording(label, plans, rows[done:], begin, end, None, notes)


def _with_steps(recording: Recording, again: Simulation, clock: Clock, begin: float) -> Recording:
    """Step a simulation through a window, and return the recording with what was seen."""
    events = np.append(-1, np.flatnonzero(recording.rows["b"] != REANCHORED)) + 1
    seen: list[tuple[int, int, int, int]] = []
    met = 0
    log, queue, notes = StructureLog(), [], recording.notes
    until = math.nextafter(clock.moment(recording.end)[0], math.inf)
    try:
        if begin > again.time:
            again.run(begin)
        log.see(0, again.drawing())
        queue.append(_queued(again))
        for number, event in enumerate(again.steps(until), 1):
            if event.epoch * TICKS + event.tick > recording.end:
                break
            if event.kind == "structural":
                seen.append((event.epoch, event.tick, int(event.certificate or 0), int(events[met])))
            else:
                met = min(met + 1, len(events) - 1)
            queue.append(_queued(again))
            if not log.full:
                log.see(number, again.drawing())
            if number >= MOST_STEPS:
                most = f"a page has those of {MOST_STEPS:,} steps"
                notes += (f"Structural events are shown up to time {event.time:.10g}: {most}.",)
                break
    except KinetileError as error:
        if not recording.notes:  # the free run has said which
            notes += (f"Stepping ended with a fault, {type(error).__name__}: {error}",)
    if log.full:
        notes += (f"The structure is shown up to event {log.seen}: there is too much of it for a page.",)
    epoch, tick, body, after = np.array(seen, np.int64).reshape(-1, 4).T
    stepped = Stepped(epoch, tick, body, after, np.array(queue, np.int64), log)
    return replace(recording, stepped=stepped, notes=notes)


def _queued(simulation: Simulation) -> int:
    """Return how many bodies have something scheduled."""
    return int(np.count_nonzero(np.asarray(simulation.tables.queue["key"]) != NEVER))


def _ticks(rows: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the times of rows as ticks since the start: Python's integers, which have no end."""
    ticks: npt.NDArray[Any] = rows["epoch"].astype(object) * TICKS + rows["tick"].astype(object)
    return ticks


def _now(simulation: Simulation, clock: Clock) -> int:
    epoch, tick = simulation.exact_time
    return max(epoch * TICKS + tick, clock.ticks(simulation.time))
