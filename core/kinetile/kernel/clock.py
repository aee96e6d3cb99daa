"""The clock: integer ticks, so that time differences are exact, however late it is.

A tick is 2^-52 of the scene's time unit, a power of two: 1, or less if bodies are fast (``time_unit``), or
the value that the scene gives. The kernel counts in 64 bits from ``base``, a whole number of units since the
start. From time to time the base moves on by ``SPAN``: all anchors and failure times are then shifted by the
same integer, which changes nothing. Python's own integers hold the whole count.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

TICKS = 1 << 52
"""Ticks per unit."""

SPAN = 1 << 61
"""Ticks between shifts of the base, 512 units. Predictions reach 2 spans past an anchor; 64 bits hold 4."""


LONGEST_UNIT = 2.0**100
"""With this unit ``scene.checks.LARGEST`` as a speed, for two spans, squared, is still a double."""


def time_unit(extent: float, speed: float, most: float = 1.0) -> float:
    """Returns the power of two, at most ``most``, that a body of this speed needs to cross about this extent.

    At speed 1 in a unit box that is 1. If bodies are so fast that they would fly far in a tick of 2^-52, a
    smaller unit keeps the distance flown in a tick below the rounding of their coordinates. Commands may make
    slow bodies fast, so only the scene itself can choose a larger unit.
    """
    crossings = speed / extent * (1.0 - 2.0**-20)
    return min(most, math.ldexp(1.0, -min(max(math.frexp(crossings)[1], -100), 900)))


@dataclass
class Clock:
    """Converts between the user's time and ticks.

    Attributes:
        start: the user's time at tick 0 of base 0.
        unit: one unit, in the user's time; a power of two.
        base: whole units from the start to the kernel's tick 0.
    """

    start: float
    unit: float
    base: int = 0

    def ticks(self, time: float) -> int:
        """Returns a time as ticks since the start, rounded down."""
        a, b = time.as_integer_ratio()
        c, d = self.start.as_integer_ratio()
        e, f = self.unit.as_integer_ratio()
        return (a * d - c * b) * f * TICKS // (b * d * e)

    def tick_of(self, time: float, at: tuple[int, ...] | None) -> int:
        """Returns a time in ticks since the start, or the ticks of ``at``: (epoch, tick) and more."""
        return self.ticks(time) if at is None else at[0] * TICKS + at[1]

    def relative(self, ticks: int) -> int:
        """Returns ticks since the start as the kernel's ticks."""
        return ticks - self.base * TICKS

    def total(self, relative: int) -> int:
        """Returns a kernel's tick as ticks since the start."""
        return relative + self.base * TICKS

    def moment(self, ticks: int) -> tuple[float, int, int]:
        """Returns (time, epoch, tick) of ticks since the start: see ``kinetile.kernel.log``."""
        epoch, tick = divmod(ticks, TICKS)
        return float(self.rounded(epoch, tick)), epoch, tick

    def time(self, relative: int) -> float:
        """Returns a kernel's tick as time, rounded once."""
        (a, b), (c, d) = self.start.as_integer_ratio(), self.unit.as_integer_ratio()
        total = int(relative) + self.base * TICKS
        return (a * d * TICKS + total * c * b) / (b * d * TICKS)

    def before(self, ticks: int) -> float:
        """Returns the last time whose tick is before this one."""
        time = self.time(ticks - self.base * TICKS)
        return time if self.ticks(time) < ticks else math.nextafter(time, -math.inf)

    def split(self, relative: np.ndarray[Any, np.dtype[np.int64]]) -> tuple[Any, Any, Any]:
        """Returns (time, epoch, tick) of kernel ticks: see ``kinetile.kernel.log``."""
        epoch = (relative >> 52) + self.base
        tick = relative & (TICKS - 1)
        return self.rounded(epoch, tick), epoch, tick

    def rounded(self, epoch: Any, tick: Any) -> Any:
        """Returns times of (epoch, tick), for numbers and arrays alike."""
        return self.start + (epoch + tick * 2.0**-52) * self.unit
