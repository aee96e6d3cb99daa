"""A question: the flight plans of two discs. Many of them are asked at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile_accuracy.queries.truth import Plan

__all__ = ["Queries"]

Floats = npt.NDArray[np.float64]
Ticks = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Queries:
    """The flight plans of m pairs of discs.

    Attributes:
        position, velocity: (m, 2, 2), by query, disc and axis; the position is that at the disc's anchor.
        radius: (m, 2).
        anchor: (m, 2), in ticks of 2^-52.
        tied: so many queries, one after the other, have exactly the same time of contact.
    """

    position: Floats
    velocity: Floats
    radius: Floats
    anchor: Ticks
    tied: int = 1

    def __len__(self) -> int:
        return len(self.radius)

    def some(self, which: Any) -> Queries:
        """Return those that an index of an array selects: a slice, a mask."""
        return Queries(self.position[which], self.velocity[which], self.radius[which], self.anchor[which])

    def swapped(self) -> Queries:
        """Return the same questions with the bodies of each in the other order."""
        return Queries(
            self.position[:, ::-1],
            self.velocity[:, ::-1],
            self.radius[:, ::-1],
            self.anchor[:, ::-1],
            self.tied,
        )

    def replaced(self, **fields: Any) -> Queries:
        """Return a copy with other arrays in place of some."""
        return replace(self, **fields)

    def plans(self) -> list[tuple[Plan, Plan]]:
        """Return the plans of every pair, as Python's own numbers."""
        columns = (
            *self.position.transpose(2, 0, 1),
            *self.velocity.transpose(2, 0, 1),
            self.anchor,
            self.radius,
        )
        both = zip(*(column.tolist() for column in columns), strict=True)
        return [(Plan(*(pair[0] for pair in q)), Plan(*(pair[1] for pair in q))) for q in both]
