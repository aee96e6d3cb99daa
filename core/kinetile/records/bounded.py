"""Rows of a run in memory, up to a number. A limit of contacts does not bound the rows of a run: the clock
anchors plans again, and each is a row."""

import math

import numpy as np

from kinetile.arrays import Array
from kinetile.errors import KinetileError
from kinetile.kernel.clock import TICKS, Clock
from kinetile.kernel.log import LOG
from kinetile.scene import Scene


class TooManyRows(KinetileError):
    """A run has more rows than the limit."""


def ticks_of(rows: Array) -> Array:
    """Returns the times of rows as ticks since the start: Python's integers, which have no limit."""
    return np.asarray(rows["epoch"].astype(object) * TICKS + rows["tick"].astype(object))


def _whole_until(rows: Array, limit: int, clock: Clock) -> tuple[int, float]:
    """Returns the largest number of rows, at most ``limit``, that are all rows up to some time, and that
    time. Simultaneous events are all in it, or none is, unless the first ``limit`` rows are of one moment."""
    ticks = ticks_of(rows[: limit + 1])
    over = ticks[-1]
    whole = int(np.searchsorted(ticks, over))
    time = float(rows["time"][max(whole - 1, 0)])
    if not ticks[whole - 1] <= clock.ticks(time) < over:  # a rounded time is not between the two ticks
        time = clock.before(over)
    whole = int(np.searchsorted(ticks, clock.ticks(time), "right"))
    return (whole, time) if whole else (limit, float(rows["time"][limit]))


class BoundedRows:
    """A recorder that keeps the first ``limit`` rows of a run, and ends the run with TooManyRows after them.
    It keeps the rows of whole moments (``_whole_until``), up to the time ``end``."""

    def __init__(self, limit: int, scene: Scene) -> None:
        self.limit, self.clock = limit, Clock(scene.start, scene.time_unit)
        self.end = math.inf
        self._parts: list[Array] = [np.zeros(0, LOG)]
        self._count = 0

    def __call__(self, rows: Array) -> None:
        """Receives the next rows; raises TooManyRows if they exceed the limit."""
        self._parts.append(np.array(rows[: self.limit + 1 - self._count]))
        self._count += len(rows)
        if self._count > self.limit:
            whole, self.end = _whole_until(self.rows, self.limit, self.clock)
            self._parts, self._count = [self.rows[:whole]], self.limit
            raise TooManyRows(
                f"the run has more than {self.limit:,} events and plans that the clock anchors again, which "
                f"is the limit here; the first of them go up to time {self.end!r}: end there"
            )

    @property
    def rows(self) -> Array:
        """The rows so far (dtype LOG); they are joined once, not at each reading."""
        if len(self._parts) > 1:
            self._parts = [np.concatenate(self._parts)]
        return self._parts[0]
