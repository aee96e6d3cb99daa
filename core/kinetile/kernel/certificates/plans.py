"""The flight plans of two bodies, as certificates take them: one value, with one part an axis.

Numbers that travel together are one value. A named tuple costs nothing in a loop: its fields are registers,
and a field that is a constant there is one after inlining, so what is not periodic has no code for images.
"""

from __future__ import annotations

from typing import NamedTuple

from kinetile.kernel.compiled import hook
from kinetile.kernel.tables import Kernel, Records


class Axis(NamedTuple):
    """The plans of two bodies along an axis.

    The first body was at ``x`` at its own anchor, the second is at ``x2`` at the later one, and is seen
    ``turns`` periods further on: a whole number, below 2^32 in size; 0 and a period of 0 where no image is
    meant.
    """

    x: float
    v: float
    x2: float
    v2: float
    turns: float
    period: float


class Plans(NamedTuple):
    """The plans of two bodies: along both axes, how many ticks before the second one's anchor that of the
    first is (0 to 2^62), the length of a tick, a power of two, and its inverse."""

    x: Axis
    y: Axis
    elapsed: int
    tick: float
    per_time: float


class BentAxis(NamedTuple):
    """The plans of two bodies along an axis: place, velocity and acceleration of the first at its own anchor,
    and of the second at the later one, its own; how many periods further on the second is seen, as in
    ``Axis``; and what is taken off its place, a sum of two: a corner of the difference of two shapes."""

    x: float
    v: float
    a: float
    x2: float
    v2: float
    a2: float
    turns: float
    period: float
    corner: float
    corner_low: float


class BentPlans(NamedTuple):
    """The plans of two bodies: along both axes, how many ticks before the second one's anchor that of the
    first is (0 to 2^62), the length of a tick, a power of two, and its inverse."""

    x: BentAxis
    y: BentAxis
    elapsed: int
    tick: float
    per_time: float


@hook
def plans_of(k: Kernel, one: Records, two: Records) -> Plans:
    """Return the plans of two bodies, by their records; that of the first is anchored earlier, or as late."""
    x = Axis(one.x, one.vx, two.x, two.vx, 0.0, 0.0)
    y = Axis(one.y, one.vy, two.y, two.vy, 0.0, 0.0)
    return Plans(x, y, two.anchor - one.anchor, k.clock[0].tick, k.clock[0].per_time)


@hook
def bent_plans_of(k: Kernel, one: Records, two: Records) -> BentPlans:
    """Return the same of bodies with accelerations."""
    x = BentAxis(one.x, one.vx, one.ax, two.x, two.vx, two.ax, 0.0, 0.0, 0.0, 0.0)
    y = BentAxis(one.y, one.vy, one.ay, two.y, two.vy, two.ay, 0.0, 0.0, 0.0, 0.0)
    return BentPlans(x, y, two.anchor - one.anchor, k.clock[0].tick, k.clock[0].per_time)


@hook
def plans_through(k: Kernel, one: Records, two: Records, right: float, up: float) -> Plans:
    """Return the plans of two bodies, the second as its image ``right`` and ``up`` periods away."""
    torus = k.clock[0].torus
    x = Axis(one.x, one.vx, two.x, two.vx, right, torus.x)
    y = Axis(one.y, one.vy, two.y, two.vy, up, torus.y)
    return Plans(x, y, two.anchor - one.anchor, k.clock[0].tick, k.clock[0].per_time)


@hook
def bent_plans_through(k: Kernel, one: Records, two: Records, right: float, up: float) -> BentPlans:
    """Return the same of bodies with accelerations."""
    torus = k.clock[0].torus
    x = BentAxis(one.x, one.vx, one.ax, two.x, two.vx, two.ax, right, torus.x, 0.0, 0.0)
    y = BentAxis(one.y, one.vy, one.ay, two.y, two.vy, two.ay, up, torus.y, 0.0, 0.0)
    return BentPlans(x, y, two.anchor - one.anchor, k.clock[0].tick, k.clock[0].per_time)
