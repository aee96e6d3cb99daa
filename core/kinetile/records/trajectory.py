"""Trajectories: the position of every body at any time, from the rows of an event file.

From one row that names it to the next, a body has one flight plan. So its place follows from its last row at
or before a time, and from its acceleration (``kernel.plan``), which the scene, its insertion, or the last row
with one gives. Elapsed time is counted in whole ticks of 2**-52 time units, as in the kernel, and rounded
once, so the positions are equal to the run's, to the last bit.
"""

import math
import os
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kinetile.arrays import Array, Floats, Integers
from kinetile.errors import RecordError, answering
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.log import INSERTED, LOG, MOVED, REANCHORED, REMOVED, TURNED
from kinetile.kernel.plan import AcceleratedPlan, Plan, positions_after, velocities_after
from kinetile.records.bounded import ticks_of
from kinetile.records.reading import EventFile, read_with_scene
from kinetile.run.flights import Flights
from kinetile.scene import Insert, Scene
from kinetile.scene.bodies import in_box, nearest_image, whole_periods
from kinetile.scene.checks import is_finite, read_count, shown
from kinetile.scene.reader import pull_of
from kinetile.scene.scene import kind_of_each
from kinetile.scene.values import body_numbers


class PlansAt(NamedTuple):
    """Flight plans at a time: the bodies (n,), their plans, the time since their anchors (n,), the periods
    taken off the anchors (n, 2), and the accelerations (n, 2)."""

    bodies: Integers
    plan: Plan | AcceleratedPlan
    elapsed: Floats
    images: Floats
    acceleration: Floats

    @property
    def places(self) -> Floats:
        """The positions of the bodies, (n, 2)."""
        return positions_after(self.plan, self.elapsed)


_FARTHEST = 2.0**500
"""All numbers of a flight are smaller, so no square of one overflows."""

_AT_ONCE = 1 << 16
"""The number of flights checked at once: all of a long run would take three times its rows' memory."""


def first_accelerations(scene: Scene, numbers: int) -> Floats:
    """Returns the first accelerations of bodies, (numbers, 2), by their numbers; gravity for a body that is
    neither in the scene nor in one of its planned insertions."""
    found = np.tile(np.array(scene.gravity), (numbers, 1))
    found[: len(scene)] = scene.acceleration
    for each in scene.commands:
        if isinstance(each, Insert) and each.body < numbers:
            found[each.body] = pull_of(each, scene.gravity)
    return found


class Trajectory:
    """The whole motion of a scene: rows (dtype LOG, in the order of events) of a run that began with it, to
    the time ``end``, by default the end of a scene from ``Simulation.recorded``, or the last row; after it
    bodies fly on. Raises RecordError if rows are missing, as after a run without a recorder."""

    @answering
    def __init__(self, rows: Array, scene: Scene, end: float | None = None) -> None:
        if getattr(rows, "dtype", None) != LOG:
            raise TypeError(f"Trajectory: rows is {shown(rows)}; expected an array of the dtype kinetile.LOG")
        if end is not None and not is_finite(end):
            raise ValueError(f"Trajectory: end is {shown(end)}; expected a finite time")
        last = float(rows["time"].max()) if len(rows) else scene.start
        recorded = scene.settings.until if "contacts" in scene.origin else None
        self.end = end if end is not None else last if recorded is None else max(recorded, last)
        self.rows = np.asarray(rows, dtype=LOG)
        self.scene = scene
        self._clock = Clock(scene.start, scene.time_unit)
        # For the search of flights that have begun by a row: sorted by body, then by row.
        self._flights = flights = Flights.of(self.rows)
        self._span = len(self.rows) + 1
        last = max(int(self.rows[name].max(initial=-1)) for name in ("a", "b"))
        self._numbers = max(len(scene), last + 1)
        known = max(kind_of_each(scene), default=-1) + 1 + int((self.rows["b"] == INSERTED).sum())
        if self._numbers > known:  # else a wrong number would set the length of arrays
            raise RecordError(
                f"a row is of body {last}, and there are {known} with all that were inserted: "
                "these rows are no whole trajectory"
            )
        self._parts = [slice(at, at + _AT_ONCE) for at in range(0, len(flights.row) or 1, _AT_ONCE)]
        self._keys = (flights.body * self._span + flights.row)[flights.by_body]
        self._check_continuity()

    @classmethod
    @answering
    def read(cls, path: str | os.PathLike[str]) -> "Trajectory":
        """Reads an event file with the scene in it. Raises MissingExtra and RecordError as ``read_events``,
        and RecordError for a file that lacks a row before its last one."""
        path = Path(path)
        found, scene = _whole(path)
        try:
            return cls(found.rows, scene, found.metadata["time"])
        except (RecordError, ValueError) as error:
            raise RecordError(f"{path} is no whole trajectory: {error}") from error

    def positions(self, time: float) -> Floats:
        """Returns the positions (n, 2) of all bodies present at ``time``, in the order of ``bodies``; along a
        periodic axis from 0 to less than the period. Raises ValueError unless the time is finite and not
        before the start."""
        return in_box(self.flight_plans(time).places, self.scene.periods)

    def unwrapped(self, time: float) -> Floats:
        """Returns the positions (n, 2) as if no axis were periodic: each body's first position plus its whole
        flight. In a scene without a periodic axis these are ``positions``."""
        plans = self.flight_plans(time)
        return np.asarray(plans.places + plans.images * self.scene.periods)

    def bodies(self, time: float) -> Integers:
        """Returns the numbers of the bodies present at ``time``, (n,), ascending."""
        return self.flight_plans(time).bodies

    def velocities(self, time: float) -> Floats:
        """Returns the velocities (n, 2) of all bodies at ``time``, after its events."""
        plans = self.flight_plans(time)
        return velocities_after(plans.plan, plans.elapsed)

    def accelerations(self, time: float) -> Floats:
        """Returns the accelerations (n, 2) of all bodies at ``time``, after its events."""
        return self.flight_plans(time).acceleration

    @cached_property
    def _accelerations(self) -> tuple[Floats, Floats]:
        """The first accelerations of bodies, (numbers, 2), and those in force from each flight on, (m, 2)."""
        begin = first_accelerations(self.scene, self._numbers)
        return begin, self._flights.accelerations(begin)

    def _plan(self, place: Any, velocity: Any, acceleration: Any) -> Plan | AcceleratedPlan:
        plan = Plan.of_vectors(place, velocity)
        return AcceleratedPlan(*plan, *acceleration.T) if acceleration.any() else plan

    @cached_property
    def _images(self) -> Floats:
        """(m, 2) the number of periods taken off the body of each flight since its first place."""
        order, parts = self._flights.by_body, (self._strayed(part)[0] for part in self._parts)
        off = whole_periods(np.concatenate([*parts]), self.scene.periods)
        body, off = self._flights.body[order], off[order]
        sums = np.cumsum(off, axis=0)
        begins = self.rows["b"][self._flights.row[order]] == MOVED  # then the count restarts from 0
        begins |= np.append(True, body[1:] != body[:-1])[: len(body)]
        found = np.empty_like(sums)
        found[order] = sums - (sums - off)[np.maximum.accumulate(np.where(begins, np.arange(len(body)), 0))]
        return found

    def _strayed(self, which: slice) -> tuple[Floats, Floats]:
        """Returns (m, 2), for each flight, the place that the body reaches before its row minus the place in
        the row; and the size of its numbers, for the rounding."""
        flights, rows, (begin, later) = self._flights, self.rows, self._accelerations
        body, row, last = flights.body[which], flights.row[which], flights.before[which]
        place, velocity = flights.value("x", "y", which=which), flights.value("vx", "vy", which=which)
        numbers = np.hstack([place, velocity, later[which]])
        for k in np.flatnonzero(~(np.abs(numbers) < _FARTHEST).all(axis=1))[:1].tolist():
            raise RecordError(
                f"in row {row[k]} body {body[k]} is not where the scene and the rows before have sent it, or "
                f"has no such velocity: {numbers[k].tolist()}"
            )
        first, second, unit = last < 0, rows["b"][row], self._clock.unit
        moments = (rows["epoch"][at] + rows["tick"][at] * 2.0**-52 for at in (row, flights.row[last]))
        time, since = (each * unit for each in moments)
        came, moved = second == INSERTED, second == MOVED  # it did not exist before, or was elsewhere
        begins, flies = place.copy(), np.zeros_like(place)
        starts = ~came & ~moved & first & (body < len(self.scene))
        begins[starts], flies[starts] = self.scene.position[body[starts]], self.scene.velocity[body[starts]]
        coming = {each.body: each.position for each in self.scene.commands if isinstance(each, Insert)}
        for k in np.flatnonzero(came).tolist():
            begins[k] = coming.get(int(body[k]), begins[k])
        before = np.where((first | moved)[:, None], begins, flights.value("x", "y", which=last))
        flies = np.where(first[:, None], flies, flights.value("vx", "vy", which=last))
        size = np.abs(before) + np.abs(place) + np.abs(flies) * (np.abs(time) + unit)[:, None]
        time = np.where(came | moved, 0.0, time - np.where(first, 0.0, since))
        pull = np.where(first[:, None], begin[body], later[last])
        flown = positions_after(self._plan(before, flies, pull), time)
        return flown - place, size + np.abs(pull) * (0.5 * time * time)[:, None]

    def _check_continuity(self) -> None:
        """Raises RecordError unless each body flies from row to row to the place in the next row, and each
        command of the scene has its row."""
        flights, rows = self._flights, self.rows
        for part in self._parts:
            with np.errstate(all="ignore"):
                astray, size = self._strayed(part)
                astray = np.where(np.isfinite(astray), astray, math.nan)
                astray = np.abs(nearest_image(astray, self.scene.periods))
            for at in (part.start + np.flatnonzero((~(astray <= 1e-9 * size)).any(axis=1))[:1]).tolist():
                row, before = flights.row[at], flights.before[at]
                what = f"body {flights.body[at]} is not where the scene and the rows before have sent it"
                raise gap(self, flights.row[before] if before >= 0 else -1, row, f"{what} in row {row}")
        own = rows[(rows["b"] <= TURNED) & (rows["b"] != REANCHORED)]
        done = {*zip(ticks_of(own).tolist(), own["a"].tolist(), strict=True)}
        gone = {*own["a"][own["b"] == REMOVED].tolist()}  # the scene's plans for them are void
        for each in self.scene.commands:
            ticks = self._clock.tick_of(each.time, each.at)
            after = int(np.searchsorted(rows["time"], each.time, side="right"))
            came = each.body in gone or (ticks, each.body) in done
            if not came and (after < len(rows) or each.time < self.end):
                raise gap(self, after - 1, after, f"the scene's command for body {each.body} is not in them")
        met, all_met = int((rows["b"] > TURNED).sum()), self.scene.origin.get("contacts", 0)
        if met < all_met and self.end >= (self.scene.settings.until or 0.0):
            raise gap(self, -1, len(rows), f"{met:,} of {all_met:,} contacts are in them")

    def flight_plans(self, time: float) -> PlansAt:
        """Returns the plans of all bodies present at ``time``; raises ValueError as ``positions``."""
        if not is_finite(time) or time < self.scene.start:
            raise ValueError(
                f"time is {shown(time)}; expected {self.scene.start!r}, the scene's start, or later, and "
                "finite"
            )
        now = self._clock.ticks(float(time))
        epoch, tick = divmod(now, TICKS)
        first, last = np.searchsorted(self.rows["epoch"], [epoch, epoch + 1])
        done = int(first + np.searchsorted(self.rows["tick"][first:last], tick, side="right"))
        return self._plans(np.arange(self._numbers, dtype=np.int64), done, now)

    def plans_after(self, row: int, bodies: Sequence[int]) -> PlansAt:
        """Returns the plans of some bodies right after a row of ``rows``, at its exact time. IndexError
        without such a row, TypeError for values that are no numbers of bodies."""
        if read_count(row, "row", "rows") >= len(self.rows):
            raise IndexError(
                f"row is {shown(row)}; expected less than the number of rows, {len(self.rows):,}"
            )
        numbers = np.ravel(body_numbers(bodies))
        (now,) = ticks_of(self.rows[row : row + 1]).tolist()
        return self._plans(numbers[(numbers >= 0) & (numbers < self._numbers)], row + 1, now)

    def _plans(self, bodies: Integers, done: int, now: int) -> PlansAt:
        """Returns the plans of the bodies in ``bodies`` that are present at a tick, after so many rows."""
        begun, n = bodies < len(self.scene), len(bodies)
        index = np.searchsorted(self._keys, bodies * self._span + done) - 1
        moved = np.flatnonzero(index >= 0)
        moved = moved[self._keys[index[moved]] // self._span == bodies[moved]]
        began, periods = self.scene.position[bodies[begun]], self.scene.periods
        anchor, velocity, images = np.zeros((3, n, 2))
        anchor[begun] = nearest_image(began, periods)
        velocity[begun] = self.scene.velocity[bodies[begun]]
        begin, later = self._accelerations
        flights, which = self._flights, self._flights.by_body[index[moved]]
        anchor[moved] = flights.value("x", "y", which=which)
        velocity[moved] = flights.value("vx", "vy", which=which)
        acceleration = begin[bodies]
        acceleration[moved] = later[which]
        if self.scene.periodic:
            images[begun] = whole_periods(began - anchor[begun], periods)
            images[moved] = self._images[which]
        rows = self.rows[flights.row[which]]
        ticks = np.full(n, now, dtype=object)
        ticks[moved] -= ticks_of(rows)
        there = begun.copy()
        there[moved] = rows["b"] != REMOVED
        elapsed = (ticks[there] / int(TICKS / self._clock.unit)).astype(np.float64)  # for any age
        plan = self._plan(anchor[there], velocity[there], acceleration[there])
        return PlansAt(bodies[there], plan, elapsed, images[there], acceleration[there])


def gap(trajectory: Trajectory, before: int, after: int, what: str) -> RecordError:
    """Returns the error for rows that are missing between two; -1 is the start, and after all the end."""
    times = [trajectory.scene.start, *trajectory.rows["time"].tolist(), trajectory.end]
    return RecordError(
        f"rows are missing between time {times[before + 1]!r} and time {times[after + 1]!r}: {what}; "
        "expected every event from the scene's start on, as a recorder gets them that is there in each run"
    )


def positions_at(source: str | os.PathLike[str] | Array, scene: Scene | None, time: float) -> Floats:
    """Returns the positions (n, 2) of all bodies at ``time``, from rows (dtype LOG) of a scene, or an event
    file, which has its own (None). For many times, make one Trajectory."""
    if isinstance(source, (str, os.PathLike)):
        if scene is None:
            return Trajectory.read(source).positions(time)
        source = _whole(Path(source))[0].rows
    if scene is None:
        raise TypeError("rows alone do not say where the bodies began: positions_at needs their scene")
    return Trajectory(source, scene).positions(time)


def _whole(path: Path) -> tuple[EventFile, Scene]:
    found, scene = read_with_scene(path)
    missing = found.metadata["missing"]
    if missing:
        raise RecordError(
            f"{path} is no whole trajectory: {missing:,} events of the run were not given to its recorder, "
            "which has to be there from the start of the first run and in every run after it"
        )
    return found, scene
