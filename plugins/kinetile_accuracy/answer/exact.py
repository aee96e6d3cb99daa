"""What is decided exactly: rules 3 to 6 of docs/specification.md, in integers.

A double is an integer over a power of two, and so is the length of a tick. So a plan is written once as
integers of one fineness: its coordinates, and how far it flies in a tick, in units of 2^-bits of the length.
Where two bodies are at some tick, and the coefficients of the quadratic for the distance of their centres,
are then integers too, with the time counted in ticks::

    a T^2 + 2 b T + c,   a = |v|^2,  b = d . v,  c = |d|^2 - R^2

The first root is (-b - sqrt(D)) / a with D = b^2 - a c. Its floor is the floor of floor(-b - sqrt(D)) / a,
and floor(-b - sqrt(D)) is -b - r with the integer square root r of D, or one less where D is no square. So
one ``isqrt`` and one division give the tick of contact, and nothing is rounded before.

Nothing here is shared with the kernel, and nothing of it with ``kinetile_accuracy.queries.truth`` but the
idea.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

from kinetile.kernel.log import BOTTOM, LEFT, RIGHT, TOP

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["HORIZON", "UNIT_BITS", "Frame", "Plan", "pair_tick", "tick_of", "unit_bits", "wall_tick"]

UNIT_BITS = 52
"""A unit has 2^52 ticks."""

HORIZON = 1 << 62
"""Nothing is met so many ticks after the later anchor, or later (rules 5 and 6)."""


def unit_bits(scene: Scene) -> int:
    """Return e of the time unit 2^-e of a scene (rule 3)."""
    if len(scene) == 0:
        return 0
    velocities = [*scene.velocity.tolist(), *(turn.velocity for turn in scene.turns)]
    largest = max(vx * vx + vy * vy for vx, vy in velocities)
    if scene.arena is not None:
        extent = max(scene.arena)
    else:
        farthest = max(abs(place) for row in scene.position.tolist() for place in row)
        extent = farthest + max(scene.radius.tolist())
    crossings = math.sqrt(largest) / extent * (1.0 - 2.0**-20)
    return next((e for e in range(900) if crossings < 2.0**e), 900)


def tick_of(time: float, start: float, bits: int) -> int:
    """Return the tick of a time (rule 3), where the unit is 2^-bits."""
    return math.floor((Fraction(time) - Fraction(start)) * (1 << (UNIT_BITS + bits)))


class Frame:
    """What all plans of a scene have in common: the arena (width, height) or None, and the unit 2^-bits."""

    def __init__(self, arena: tuple[float, float] | None, bits: int) -> None:
        self.arena = arena and tuple(map(_ratio, arena))
        self.fine = UNIT_BITS + bits
        self.finest = max((fine for _, fine in self.arena or ()), default=0)


class Plan:
    """A flight plan (rule 4) of a disc, as doubles and as integers.

    Attributes:
        x, y, vx, vy: the doubles.
        anchor: the tick at which the body is at (x, y).
        bits: how fine the integers are: they count 2^-bits of the length.
        place, step, radius: x and y, the way of a tick along each axis, and the radius, as integers.
    """

    __slots__ = ("anchor", "bits", "place", "radius", "step", "vx", "vy", "x", "y")

    def __init__(
        self, x: float, y: float, vx: float, vy: float, anchor: int, radius: float, frame: Frame
    ) -> None:
        self.x, self.y, self.vx, self.vy, self.anchor = x, y, vx, vy, anchor
        lengths = [_ratio(x), _ratio(y), _ratio(radius)]
        speeds = [(number, fine + frame.fine) for number, fine in (_ratio(vx), _ratio(vy))]
        self.bits = bits = max(frame.finest, *(fine for _, fine in lengths), *(fine for _, fine in speeds))
        px, py, self.radius = (number << (bits - fine) for number, fine in lengths)
        wx, wy = (number << (bits - fine) for number, fine in speeds)
        self.place = px, py
        self.step = wx, wy

    def moved_to(self, tick: int, bits: int) -> tuple[int, int]:
        """Return where the body is at a tick, exactly, at a fineness of at least its own."""
        (x, y), (wx, wy) = self.place, self.step
        elapsed, finer = tick - self.anchor, bits - self.bits
        return (x + wx * elapsed) << finer, (y + wy * elapsed) << finer


def pair_tick(one: Plan, two: Plan) -> int | None:
    """Return the tick of contact of two bodies by their plans (rule 5); None: none."""
    since = max(one.anchor, two.anchor)
    bits = max(one.bits, two.bits)
    x, y = one.moved_to(since, bits)
    other_x, other_y = two.moved_to(since, bits)
    dx, dy = other_x - x, other_y - y
    finer, other_finer = bits - one.bits, bits - two.bits
    vx = (two.step[0] << other_finer) - (one.step[0] << finer)
    vy = (two.step[1] << other_finer) - (one.step[1] << finer)
    b = dx * vx + dy * vy
    if b >= 0:
        return None
    reach = (one.radius << finer) + (two.radius << other_finer)
    c = dx * dx + dy * dy - reach * reach
    if c <= 0:
        return since
    a = vx * vx + vy * vy
    discriminant = b * b - a * c
    if discriminant <= 0:
        return None
    root = math.isqrt(discriminant)
    wait = (-b - root - (root * root != discriminant)) // a
    return since + wait if wait < HORIZON else None


def wall_tick(plan: Plan, frame: Frame) -> tuple[int, int] | None:
    """Return (tick, wall) of the contact of a body with a wall by its plan (rule 6); None: none."""
    if frame.arena is None:
        return None
    first: tuple[int, int] | None = None
    sides = ((LEFT, RIGHT), (BOTTOM, TOP))
    for place, step, (extent, fine), (low, high) in zip(
        plan.place, plan.step, frame.arena, sides, strict=True
    ):
        if step == 0:
            continue
        gap = place if step < 0 else (extent << (plan.bits - fine)) - place
        gap -= plan.radius
        wait = 0 if gap <= 0 else gap // abs(step)
        if wait < HORIZON and (first is None or plan.anchor + wait < first[0]):
            first = plan.anchor + wait, low if step < 0 else high
    return first


def _ratio(number: float) -> tuple[int, int]:
    """Return a double as (n, k), which is n 2^-k."""
    numerator, denominator = number.as_integer_ratio()
    return numerator, denominator.bit_length() - 1
