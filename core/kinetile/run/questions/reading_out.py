"""What a simulation shows of itself now: who is there, where and how fast, and who is near whom."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from kinetile.kernel.flight import positions_now
from kinetile.kernel.loop.presence import slots_taken
from kinetile.run.composition import Composition
from kinetile.run.engine import Engine
from kinetile.run.questions.candidates import by_number, candidates, named_near

__all__ = ["ReadsOut"]


class ReadsOut:
    """What of a simulation can be read off its tables."""

    _engine: Engine

    @property
    def composition(self) -> Composition:
        """The phases and their parts."""
        return self._engine.composition

    def build(self) -> None:
        """Build the broad phase's structure, where that is still to be done."""
        raise NotImplementedError

    @property
    def bodies(self) -> npt.NDArray[np.int32]:
        """The numbers of the bodies that are there now, (n,), ascending: whose the rows of ``positions``
        are."""
        k = self._engine.k
        numbers: npt.NDArray[np.int32] = k.queue["number"][slots_taken(k)]
        return numbers

    def positions(self) -> npt.NDArray[np.float64]:
        """Return the positions now, (n, 2), in the order of ``bodies``."""
        found: npt.NDArray[np.float64] = positions_now(self._engine.k, slots_taken(self._engine.k))
        return found

    def velocities(self) -> npt.NDArray[np.float64]:
        """Return the velocities now, (n, 2), in the order of ``bodies``."""
        k = self._engine.k
        return np.column_stack([k.bodies["vx"], k.bodies["vy"]])[slots_taken(k)]

    def candidate_pairs(self) -> npt.NDArray[np.int32]:
        """Return the candidate pairs now, (k, 2), a < b, sorted."""
        self.build()
        return candidates(self._engine.k, self.composition)

    def near(self) -> npt.NDArray[np.int32]:
        """Return who is near whom now: (a, b) wherever the broad phase names b as near a; (k, 2)."""
        self.build()
        return by_number(self._engine.k, named_near(self._engine.k, self.composition))
