"""How a run went over time, as lines of small bars: what ``run`` and ``resume`` print on a terminal.

The run is done in slices, and after each the counts that the loop keeps anyway are read. Nothing is added to
the loop, and a run in slices is the same run: it stops between two events and goes on. To enter the loop
takes some fifty microseconds, so the time that the first slice takes decides how many there are.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from kinetile.run.simulation import Simulation

__all__ = ["LEAST", "MOST", "Course", "bars"]

MOST, LEAST = 40, 8
"""Slices of a run, and bars of a line."""

_SLICE = 1e-3
"""CPU seconds that a slice takes at least, unless there are the fewest."""

_A_BAR = 10
"""Events that a bar stands for on average; fewer would show chance alone."""

_WORDS = len("  100,000 to 100,000 structural a time unit")

_BLOCKS = " ▁▂▃▄▅▆▇█"
_LETTERS = " .:-=+*#@"  # no heights, but more and more ink

Run = Callable[[float | None, int | None], object]


class _Point(NamedTuple):
    """So much had happened at a time."""

    time: float
    contacts: int
    structural: int


class Course:
    """The course of a run from now on: how many contacts and structural events there had been, and when."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        found = simulation.readings
        contacts = found.contacts_disc + found.contacts_wall
        self._points = [_Point(simulation.time, contacts, found.structural_events)]

    def follow(self, run: Run, until: float | None, max_contacts: int | None) -> None:
        """Run in slices: ``run`` is called with the end of each, a time and a number of further contacts."""
        begin, left = self._points[0].time, max_contacts
        if (until is None and not left) or (until is not None and until <= begin):
            run(until, left)
            return
        done, slices, spent = 0.0, MOST, self._simulation.readings.cpu_seconds
        while done < 1.0:
            done = min(done + (1.0 - done) / slices, 1.0) if slices > 1 else 1.0
            most = left if until is not None or left is None else max(left // slices, 1)
            stop = until if until is None or slices == 1 else begin + (until - begin) * done
            run(stop, most)
            met = self._see()
            if left is not None:
                left -= met
            if left == 0 or (until is None and met != most):
                return
            if slices == MOST:
                took = self._simulation.readings.cpu_seconds - spent
                slices = min(max(int((MOST - 1) * took / _SLICE), LEAST), MOST - 1)
            else:
                slices -= 1

    def _see(self) -> int:
        """Take down how far the run is; return how many contacts are new."""
        last, counts = self._points[-1], self._simulation.tables.counts[0]
        contacts = int(counts.contacts_disc) + int(counts.contacts_wall)
        now = _Point(self._simulation.time, contacts, int(counts.structural))
        if now.time <= last.time:
            self._points.pop()
        self._points.append(now)
        return contacts - last.contacts

    def lines(self, wide: int, encoding: str) -> list[str]:
        """Return a line of contacts and one of structural events, each in at most so many columns, in what an
        encoding can say; nothing of which there are too few events to tell anything."""
        kinds = {
            "contacts": [point.contacts for point in self._points],
            "structural": [point.structural for point in self._points],
        }
        told = {what: (counts[-1] - counts[0]) // _A_BAR for what, counts in kinds.items()}
        begin = self._points[0].time
        since = "" if begin == self._simulation.scene.start else f", from {begin:.4g} on"
        room = wide - _WORDS - len(since)
        count = min([MOST, len(self._points) - 1, room, *(n for n in told.values() if n >= LEAST)])
        found = []
        for what in (what for what in kinds if count >= LEAST and told[what] >= LEAST):
            rates = self._rates(kinds[what], count)
            low, high = _number(min(rates)), _number(max(rates))
            span = low if low == high else f"{low} to {high}"
            found.append(f"{bars(rates, encoding)}  {span} {what} a time unit{since}")
        return found

    def _rates(self, counts: Sequence[int], bins: int) -> list[float]:
        """Return how many there were a time unit, in each of so many equal parts of the time."""
        times = [point.time for point in self._points]
        begin, length = times[0], times[-1] - times[0]

        def by(time: float) -> float:
            after = min(max(bisect_left(times, time), 1), len(times) - 1)
            share = (time - times[after - 1]) / (times[after] - times[after - 1])
            return counts[after - 1] + share * (counts[after] - counts[after - 1])

        done = [by(begin + length * (k / bins)) for k in range(bins)] + [float(counts[-1])]
        return [(now - before) * bins / length for before, now in pairwise(done)]


def bars(values: Sequence[float], encoding: str) -> str:
    """Return a bar for each value, the highest for the largest, a blank for 0; blocks where an encoding has
    them, else letters."""
    try:
        _BLOCKS.encode(encoding)
        ramp = _BLOCKS
    except (UnicodeEncodeError, LookupError):
        ramp = _LETTERS
    most = max(values, default=0.0)
    steps = len(ramp) - 1
    return "".join(ramp[max(round(steps * value / most), 1) if value > 0.0 else 0] for value in values)


def _number(rate: float) -> str:
    return f"{rate:,.0f}" if 10.0 <= rate < 1e6 else f"{rate:.3g}"
