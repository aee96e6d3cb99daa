"""Pairs of plans, drawn by their encounter."""

from __future__ import annotations

from math import ldexp
from typing import NamedTuple

from .draws import TRIPLES, Draws
from .rules import Plan

__all__ = ["Question", "aimed", "anchors", "exactly", "flown_back", "scaled", "swapped"]


class Question(NamedTuple):
    """When do two bodies meet? The unit is 2^-e."""

    e: int
    one: Plan
    two: Plan


def aimed(
    d: Draws, radii: tuple[float, float], run: float, miss: float, speed: float = 1.0, drift: float = 0.7
) -> tuple[Plan, Plan]:
    """Return two plans anchored at 0: the second is nearest to the first after a way of ``run``, and would
    then pass at a distance of ``miss``, nearly; ``speed`` is their relative one, ``drift`` about that of the
    first.
    """
    ux, uy = d.direction()
    x, y = d.uniform(-0.5, 0.5), d.uniform(-0.5, 0.5)
    vx, vy = d.uniform(-drift, drift), d.uniform(-drift, drift)
    one = Plan(x, y, vx, vy, radii[0], 0)
    two = Plan(
        x - miss * uy - run * ux, y + miss * ux - run * uy, vx + speed * ux, vy + speed * uy, radii[1], 0
    )
    return one, two


def exactly(
    d: Draws, scale: float, ahead: float, speed: float, behind: float = 0.0, corner: bool = True
) -> tuple[Plan, Plan]:
    """Return two plans anchored at 0 that touch after a way of ``ahead + behind`` along an axis, exactly.

    At the touch the line of centres is (a, b) times ``scale``, of a Pythagorean triple; all numbers must be
    short enough that sums of them are doubles. ``behind`` may be tiny: it is a coordinate of its own.
    """
    a, b, c = d.pick(TRIPLES) if corner else (1, 0, 1)
    if a and b and d.below(2):
        a, b = b, a
    half = d.pick((0.5, 0.25, 0.75))
    b *= d.sign()
    one = (-behind, 0.0, 0.0, 0.0, c * scale * half)
    two = (a * scale + ahead, b * scale, -speed, 0.0, c * scale * (1.0 - half))
    x_sign, y_sign, across = d.sign(), d.sign(), d.below(2)

    def laid(x: float, y: float, vx: float, vy: float, radius: float) -> Plan:
        place, velocity = (x_sign * x, y_sign * y), (x_sign * vx, y_sign * vy)
        return Plan(*(place[::-1] + velocity[::-1] if across else place + velocity), radius, 0)

    return laid(*one), laid(*two)


def flown_back(plan: Plan, ticks: int, e: int) -> Plan:
    """Return a plan that is anchored so many ticks earlier and is, but for rounding, the same."""
    delay = float(ticks) * ldexp(1.0, -52 - e)
    return plan._replace(x=plan.x - plan.vx * delay, y=plan.y - plan.vy * delay, anchor=plan.anchor - ticks)


def anchors(d: Draws, one: Plan, two: Plan, e: int = 0, apart: int = 50, base: int = 60) -> tuple[Plan, Plan]:
    """Return plans with anchors up to 2^apart ticks apart, 2^base or less from 0; often
    equal."""
    first = d.whole(-(1 << base), 1 << base)
    one, two = one._replace(anchor=first), two._replace(anchor=first)
    ticks = d.below(1 << d.whole(1, apart))
    which = d.below(3)
    if which == 1:
        one = flown_back(one, ticks, e)
    if which == 2:
        two = flown_back(two, ticks, e)
    return one, two


def scaled(plan: Plan, length: int, speed: int) -> Plan:
    """Return a plan with lengths times 2^length and velocities times 2^speed."""
    return Plan(
        ldexp(plan.x, length),
        ldexp(plan.y, length),
        ldexp(plan.vx, speed),
        ldexp(plan.vy, speed),
        ldexp(plan.radius, length),
        plan.anchor,
    )


def swapped(d: Draws, e: int, one: Plan, two: Plan) -> Question:
    """Return the question with the bodies in either order."""
    return Question(e, two, one) if d.below(2) else Question(e, one, two)
