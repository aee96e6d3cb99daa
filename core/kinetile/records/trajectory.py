"""Trajectories: where every body was, at any time, from the rows of an event file.

A body flies straight from one row that names it to the next, so its state is ``anchor + velocity * elapsed``
with the anchor of its last row at or before that time. Elapsed time is counted in whole ticks of 2**-52 time
units, as the kernel counts it, and rounded once, so the positions are those of the run itself, to the last
bit.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import RecordError
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.log import INSERTED, LOG, REMOVED
from kinetile.records.reading import EventFile, read_with_scene
from kinetile.scene.bodies import in_box, nearest_image

if TYPE_CHECKING:
    from kinetile.scene import Scene


class Trajectory:
    """The whole motion of a scene: rows (dtype LOG, in the order of events) of a run that began with it, to
    the time ``end``, by default that of the last row.

    A row that was not recorded is not known: after the last event of a file that was cut short, bodies fly
    on.
    """

    def __init__(self, rows: NDArray[Any], scene: Scene, end: float | None = None) -> None:
        self.end = float(max(rows["time"], default=scene.start)) if end is None else end
        self.rows = np.asarray(rows, dtype=LOG)
        self.scene = scene
        self._clock = Clock(scene.start, scene.time_unit)
        # Every row twice, as seen by a and by b; sorted by body, those of one body in the order of events.
        self._span = 2 * len(self.rows) + 1
        bodies = np.stack([self.rows["a"], self.rows["b"]], axis=1).ravel().astype(np.int64)
        self._numbers = max(len(scene), int(bodies.max(initial=-1)) + 1)
        planned = np.repeat(~np.isnan(self.rows["ax"]), 2)  # who passes another flies on
        seen = np.flatnonzero((bodies >= 0) & planned)
        self._keys = np.sort(bodies[seen] * self._span + seen)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Trajectory:
        """Reads an event file with the scene in it.

        Raises MissingExtra and RecordError as ``read_events``, and RecordError for a file that has not all
        rows of its run up to its last one: without them the positions are unknown.
        """
        path = Path(path)
        found, scene = _whole(path)
        trajectory = cls(found.rows, scene, found.metadata["time"])
        trajectory._check_continuity(path)
        return trajectory

    def positions(self, time: float) -> NDArray[np.float64]:
        """Returns the positions (n, 2) of all bodies that there are at ``time``, finite and not before the
        scene's start, in the order of ``bodies``; along a periodic axis from 0 to less than the period.

        Raises ValueError for another time.
        """
        _, anchor, velocity, elapsed = self._flight_plans(time)
        return in_box(anchor + velocity * elapsed[:, None], self.scene.periods)

    def bodies(self, time: float) -> NDArray[np.int64]:
        """Returns the numbers of the bodies that there are at ``time``, (n,), ascending."""
        return self._flight_plans(time)[0]

    def velocities(self, time: float) -> NDArray[np.float64]:
        """Returns the velocities (n, 2) of all bodies at ``time``, after the events of that very time."""
        return self._flight_plans(time)[2]

    def _check_continuity(self, path: Path) -> None:
        """Raises RecordError unless each body flies, from row to row, to where the next row says it is."""
        body, seen = np.divmod(self._keys, self._span)
        rows, place, velocity = self._plans(seen)
        unit, first = self._clock.unit, np.append(True, body[1:] != body[:-1])[: len(body)]
        time = (rows["epoch"] + rows["tick"] * 2.0**-52) * unit
        since = np.where(first, 0.0, np.roll(time, 1))
        came = rows["b"] == INSERTED  # it does not exist before
        begins, flies = place.copy(), np.zeros_like(place)
        starts = ~came & first & (body < len(self.scene))
        begins[starts], flies[starts] = self.scene.position[body[starts]], self.scene.velocity[body[starts]]
        before = np.where(first[:, None], begins, np.roll(place, 1, axis=0))
        flown = np.where(first[:, None], flies, np.roll(velocity, 1, axis=0))
        astray = before + flown * (time - since)[:, None] - place
        astray = np.abs(nearest_image(astray, self.scene.periods))
        size = np.abs(before) + np.abs(place) + np.abs(flown) * (np.abs(time) + unit)[:, None]
        wrong = np.flatnonzero((astray > 1e-9 * size).any(axis=1))
        if len(wrong):
            at = int(wrong[np.argmin(seen[wrong])])
            time_there = float(rows["time"][at])
            raise RecordError(
                f"{path} is no whole trajectory: at time {time_there!r}, in row {seen[at] // 2}, body "
                f"{body[at]} is not where the scene and the rows before have sent it; expected every event "
                "from the scene's start on, as the recorder gets them if it is there in each run"
            )

    def _plans(self, seen: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Returns rows, 2 k as its a sees row k and 2 k + 1 as its b, with position and velocity of that."""
        rows, is_b = self.rows[seen // 2], (seen % 2).astype(bool)[:, None]
        place = np.where(is_b, _columns(rows, "bx", "by"), _columns(rows, "ax", "ay"))
        return rows, place, np.where(is_b, _columns(rows, "bvx", "bvy"), _columns(rows, "avx", "avy"))

    def _flight_plans(
        self, time: float
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Returns the plans in force at a time: of which bodies (n,), anchors and velocities (n, 2), time
        since the anchor (n,)."""
        time = float(time)
        if not self.scene.start <= time < math.inf:
            raise ValueError(
                f"time is {time!r}; expected {self.scene.start!r}, the scene's start, or later, and finite"
            )
        now = self._clock.ticks(time)
        epoch, tick = divmod(now, TICKS)
        first, last = np.searchsorted(self.rows["epoch"], [epoch, epoch + 1])
        done = int(first + np.searchsorted(self.rows["tick"][first:last], tick, side="right"))
        bodies, n = np.arange(self._numbers, dtype=np.int64), len(self.scene)
        index = np.searchsorted(self._keys, bodies * self._span + 2 * done) - 1
        moved = bodies[index >= 0]
        moved = moved[self._keys[index[moved]] // self._span == moved]
        anchor, velocity = np.zeros((2, self._numbers, 2))
        anchor[:n] = nearest_image(self.scene.position, self.scene.periods)
        velocity[:n] = self.scene.velocity
        rows, anchor[moved], velocity[moved] = self._plans(self._keys[index[moved]] % self._span)
        ticks = np.full(self._numbers, now, dtype=object)
        ticks[moved] -= rows["epoch"].astype(object) * TICKS + rows["tick"].astype(object)
        there = bodies < n
        there[moved] = rows["b"] != REMOVED
        elapsed = ticks[there].astype(np.float64) * (self._clock.unit / TICKS)
        return bodies[there], anchor[there], velocity[there], elapsed


def positions_at(
    source: str | os.PathLike[str] | NDArray[Any], scene: Scene | None, time: float
) -> NDArray[np.float64]:
    """Returns the positions (n, 2) of all bodies at ``time``, from an event file or from rows (dtype LOG).

    ``scene`` may be None for a file, which has its own. For many times, make one Trajectory.
    """
    if isinstance(source, (str, os.PathLike)):
        path = Path(source)
        trajectory = Trajectory.read(path) if scene is None else Trajectory(_whole(path)[0].rows, scene)
        return trajectory.positions(time)
    if scene is None:
        raise TypeError("rows alone do not say where the bodies began: positions_at needs their scene")
    return Trajectory(source, scene).positions(time)


def _whole(path: Path) -> tuple[EventFile, Scene]:
    """Reads an event file; raises RecordError if it says that rows are missing from it."""
    found, scene = read_with_scene(path)
    missing = found.metadata["missing"]
    if missing:
        raise RecordError(
            f"{path} is no whole trajectory: {missing:,} events of the run were not given to its recorder, "
            "which has to be there from the start of the first run and in every run after it"
        )
    return found, scene


def _columns(rows: NDArray[Any], x: str, y: str) -> NDArray[np.float64]:
    return np.stack([rows[x], rows[y]], axis=1)
