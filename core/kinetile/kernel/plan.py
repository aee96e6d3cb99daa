"""A flight plan: its numbers, and the position of its body.

A body's position is its place at its anchor, plus its velocity times the time since; if it is accelerated,
plus half its acceleration times the square of that time (rule 4a). Only these functions compute it:
``kernel.flight`` makes hooks of them, and the player's page has its own in ``run/plan.mjs``. (The
specification and the oracle are implementations of their own.)
"""

import math
from typing import Any, NamedTuple, Self

import numpy as np

from kinetile.arrays import Floats
from kinetile.kernel.clock import TICKS


class Plan(NamedTuple):
    """Place and velocity at the anchor: numbers, arrays or lanes. Records with these fields are plans."""

    x: Any
    y: Any
    vx: Any
    vy: Any

    @staticmethod
    def of(rows: Any) -> "Plan | AcceleratedPlan":
        """Returns the plans in rows with these fields, or with the fields of an ``AcceleratedPlan``."""
        kind = AcceleratedPlan if "ax" in rows.dtype.names else Plan
        return kind(*(rows[name] for name in kind._fields))

    @classmethod
    def of_vectors(cls, place: Any, velocity: Any) -> Self:
        """Returns the plans of places and velocities (..., 2)."""
        return cls(place[..., 0], place[..., 1], velocity[..., 0], velocity[..., 1])


class AcceleratedPlan(NamedTuple):
    """The same with an acceleration."""

    x: Any
    y: Any
    vx: Any
    vy: Any
    ax: Any
    ay: Any


FIELDS = " ".join(Plan._fields)
FIELDS_OF_TWO = " ".join(side + name for side in "ab" for name in Plan._fields)
"""The fields of a plan in a record, and the fields of two plans, a and b, in a row."""


def position_after(plan: Any, elapsed: Any) -> tuple[Any, Any]:
    """Returns the position of a plan's body, a time after its anchor."""
    return plan.x + plan.vx * elapsed, plan.y + plan.vy * elapsed


def velocity_after(plan: Any, elapsed: Any) -> tuple[Any, Any]:
    """Returns the velocity of a plan's body, a time after its anchor."""
    return plan.vx, plan.vy


def accelerated_position_after(plan: Any, elapsed: Any) -> tuple[Any, Any]:
    """Returns the same for a plan with an acceleration."""
    square = elapsed * elapsed
    x = plan.x + (plan.vx * elapsed + (0.5 * plan.ax) * square)
    return x, plan.y + (plan.vy * elapsed + (0.5 * plan.ay) * square)


def accelerated_velocity_after(plan: Any, elapsed: Any) -> tuple[Any, Any]:
    """Returns the same for a plan with an acceleration."""
    return plan.vx + plan.ax * elapsed, plan.vy + plan.ay * elapsed


def positions_after(plans: Plan | AcceleratedPlan, elapsed: Any) -> Floats:
    """Returns (..., 2) positions of plans' bodies, times (...) after their anchors; not for hooks."""
    after = accelerated_position_after if isinstance(plans, AcceleratedPlan) else position_after
    return _stacked(*after(plans, elapsed))


def velocities_after(plans: Plan | AcceleratedPlan, elapsed: Any) -> Floats:
    """Returns (..., 2) velocities by plans, times (...) after their anchors; not for hooks."""
    after = accelerated_velocity_after if isinstance(plans, AcceleratedPlan) else velocity_after
    return _stacked(*after(plans, elapsed))


def _stacked(x: Any, y: Any) -> Floats:
    """Returns the same as NumPy's stack, without its overhead in Python."""
    both = np.empty((*np.shape(x), 2))
    both[..., 0], both[..., 1] = x, y
    return both


LEAST_SPAN = 1 << 10
"""Ticks. A scene whose chords would be shorter is refused: they would end at every tick."""

SHARE = 2.0**-3
"""The margin as a part of the smallest radius, if the phase accepts a skin of twice as much: with less there
are more chords, with more, more bodies near each other. Contacts are the same with any."""

MOST_SPAN = 1 << 58
"""The most ticks that a chord lasts."""


def shortest(pull: tuple[float, float], margin: float, unit: float) -> float:
    """Returns the ticks of the shortest chord, by the largest accelerations, in a clock's ``unit``."""
    return math.sqrt(2.0 * margin / sum(pull)) * (TICKS / unit)
