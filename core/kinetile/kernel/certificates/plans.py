"""The flight plans of two bodies, in the form for certificates: one value, with one part an axis.

Numbers that travel together are one value. A named tuple costs nothing in a loop: its fields are registers,
and a field that is a constant is still one after inlining, so a loop without periodic axes has no code for
images, and one without accelerated bodies has no code for accelerations.
"""

from typing import NamedTuple

from kinetile.kernel.compiled import hook, with_accelerations
from kinetile.kernel.tables import Kernel, Records


class Axis(NamedTuple):
    """The plans of two bodies along an axis.

    Place ``x``, velocity ``v`` and acceleration ``a`` of the first body at its own anchor, and of the second
    one at the later anchor, its own. The second is displaced by ``turns`` periods: a whole number, below 2^32
    in size; 0 and a period of 0 without an image. ``corner + corner_low`` is subtracted from its place: a
    corner of the difference of two shapes, or 0.
    """

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


class Plans(NamedTuple):
    """The plans of two bodies: along both axes, the ticks from the first body's anchor to the second's (0 to
    2^62), the length of a tick, a power of two, and its inverse."""

    x: Axis
    y: Axis
    elapsed: int
    per_tick: float
    per_time: float


@hook
def _own(body: Records) -> tuple[float, float]:
    return body.ax, body.ay


@with_accelerations(_own)
@hook
def acceleration_of(body: Records) -> tuple[float, float]:
    """Returns the acceleration of a body's plan: 0 if the scene has no accelerations."""
    return 0.0, 0.0


@hook
def _are(body: Records) -> bool:
    return True


@with_accelerations(_are)
@hook
def are_accelerated(body: Records) -> bool:
    """Returns True if bodies of this scene may be accelerated."""
    return False


@hook
def plans_between(
    k: Kernel, one: Records, two: Records, right: float, up: float, x: float, y: float
) -> Plans:
    """Returns the plans of two bodies, the second displaced by ``right`` and ``up`` periods ``x`` and
    ``y``."""
    ax, ay = acceleration_of(one)
    ax2, ay2 = acceleration_of(two)
    along = Axis(one.x, one.vx, ax, two.x, two.vx, ax2, right, x, 0.0, 0.0)
    across = Axis(one.y, one.vy, ay, two.y, two.vy, ay2, up, y, 0.0, 0.0)
    return Plans(along, across, two.anchor - one.anchor, k.clock[0].per_tick, k.clock[0].per_time)


@hook
def plans_of(k: Kernel, one: Records, two: Records) -> Plans:
    """Returns the plans of two bodies, by their records; the first is anchored no later than the second."""
    return plans_between(k, one, two, 0.0, 0.0, 0.0, 0.0)


@hook
def plans_through(k: Kernel, one: Records, two: Records, right: float, up: float) -> Plans:
    """Returns the plans of two bodies, the second as its image ``right`` and ``up`` periods away."""
    torus = k.clock[0].torus
    return plans_between(k, one, two, right, up, torus.x, torus.y)
