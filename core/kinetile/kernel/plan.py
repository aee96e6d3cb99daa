"""A flight plan: its numbers, and where it has a body.

A body is where it was at its anchor, plus its velocity times the time since. Only these functions compute
that: ``kernel.flight`` makes hooks of them, and the player's page has its own in ``run/plan.mjs``. (The
specification and the oracle are implementations of their own.)
"""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt


class Plan(NamedTuple):
    """Place and velocity at the anchor: numbers, arrays or lanes. Records with these fields are plans."""

    x: Any
    y: Any
    vx: Any
    vy: Any

    @classmethod
    def of(cls, rows: Any) -> Self:
        """Returns the plans in rows with these fields."""
        return cls(*(rows[name] for name in cls._fields))

    @classmethod
    def of_vectors(cls, place: Any, velocity: Any) -> Self:
        """Returns the plans of places and velocities (..., 2)."""
        return cls(place[..., 0], place[..., 1], velocity[..., 0], velocity[..., 1])


FIELDS = " ".join(Plan._fields)
FIELDS_OF_TWO = " ".join(side + name for side in "ab" for name in Plan._fields)
"""The fields of a plan in a record, and of those of a and b in a row."""


def position_after(plan: Any, elapsed: Any) -> tuple[Any, Any]:
    """Returns where a plan has its body, a time after its anchor."""
    return plan.x + plan.vx * elapsed, plan.y + plan.vy * elapsed


def velocity_after(plan: Any, elapsed: Any) -> tuple[Any, Any]:
    """Returns the velocity that a plan gives its body, a time after its anchor."""
    return plan.vx, plan.vy


def positions_after(plans: Plan, elapsed: Any) -> npt.NDArray[np.float64]:
    """Returns (..., 2) where plans have their bodies, times (...) after their anchors; not for hooks."""
    return np.stack(position_after(plans, elapsed), axis=-1)


def velocities_after(plans: Plan, elapsed: Any) -> npt.NDArray[np.float64]:
    """Returns (..., 2) velocities by plans, times (...) after their anchors; not for hooks."""
    return np.stack(velocity_after(plans, elapsed), axis=-1)
