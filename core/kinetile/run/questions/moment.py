"""A moment of a run: the tables as they stand, and which bodies are asked about."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from kinetile.kernel.clock import Clock
from kinetile.kernel.flight import positions_now
from kinetile.kernel.tables import Kernel
from kinetile.run.composition import Composition

__all__ = ["Moment"]

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Moment:
    """What a question is asked about. It is out of date as soon as the run goes on.

    Attributes:
        k: the kernel's tables.
        slots: (n,) int64, the slots of the bodies that are asked about, in the order of the bodies' numbers:
            ties go by their place here.
        clock: what a tick is in the scene's time.
        composition: the phases; of them only the narrow ones are asked.
    """

    k: Kernel
    slots: Integers
    clock: Clock
    composition: Composition

    @property
    def now(self) -> int:
        """The present tick, as the kernel counts."""
        return int(self.k.clock[0].now)

    @cached_property
    def aside(self) -> Kernel:
        """The tables with a clock of their own: a narrow phase may blame, and here nobody is to hear it."""
        return self.k._replace(clock=self.k.clock.copy())

    @cached_property
    def places(self) -> Floats:
        """(n, 2) where the bodies are, to the bit as ``Simulation.positions`` has them."""
        return positions_now(self.k, self.slots)

    @cached_property
    def radii(self) -> Floats:
        """(n,) their radii."""
        return np.asarray(self.k.radii[self.slots])
