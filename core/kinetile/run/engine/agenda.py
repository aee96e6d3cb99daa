"""What is still to turn: scheduled turns, in exact ticks since the start, handed to the kernel a span at a
time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from kinetile.kernel.clock import SPAN, TICKS, Clock
from kinetile.kernel.log import REANCHORED, TURNED
from kinetile.scene import Turn

__all__ = ["Agenda", "Planned"]


class Planned(NamedTuple):
    """One change of flight plan, at ``ticks`` since the start."""

    ticks: int
    body: int
    vx: float
    vy: float
    code: int


class Agenda:
    """Planned changes in the order in which they happen: by time, re-anchorings first, then by body, then as
    given."""

    def __init__(self, turns: Sequence[Turn], clock: Clock) -> None:
        self._planned = [Planned(clock.ticks(t.time), t.body, *t.velocity, TURNED) for t in turns]
        self._sort()

    def _sort(self) -> None:
        self._planned.sort(key=lambda p: (p.ticks, p.code != REANCHORED, p.body))

    def put(self, *changes: Planned) -> None:
        """Add changes."""
        self._planned.extend(changes)
        self._sort()

    def due(self, clock: Clock) -> list[Planned]:
        """Return the changes before the next shift of the clock's base."""
        end = clock.base * TICKS + SPAN
        return [planned for planned in self._planned if planned.ticks < end]

    def next_turn(self, made: int) -> Planned | None:
        """Return the first turn still to come, where ``made`` changes have happened and are not forgotten."""
        return next((planned for planned in self._planned[made:] if planned.code == TURNED), None)

    def squares(self, mass: Any) -> float:
        """Return the sum of mass * speed^2 over all changes: twice the energy they could bring in."""
        return math.fsum(float(mass[p.body]) * (p.vx * p.vx + p.vy * p.vy) for p in self._planned)

    def done(self, count: int) -> None:
        """Forget the first ``count`` changes: they have happened."""
        del self._planned[:count]
