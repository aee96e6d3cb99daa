"""Checks around hooks that are not marked ``unchecked``, and around responses of other plugins.

The counts and numbers of bodies that hooks return are compared with their limits, because the loop reads its
tables there, and does not check the index (``kernel.compiled.views``): one out of range is a fault that names
the phase, and not a read of other memory.

Two bodies that have met are barred from each other until one of them has another plan, lest rounding repeat
their contact. So after a response that leaves them closing in they would pass through each other.
"""

import math
from functools import cache
from typing import Any

import numpy as np

from kinetile.kernel.compiled import Hook, hook, is_checked, larger, smaller, unchecked, with_numpy
from kinetile.kernel.flight import closing_speed
from kinetile.kernel.tables import (
    ADDED_ENERGY,
    BAD_COUNT,
    BAD_NAME,
    BAD_PARTNER,
    BAD_RESPONSE,
    NOBODY,
    SPARE,
    Kernel,
    Records,
    blame,
)


@cache
def checked(name: str, function: Hook) -> Hook:
    """Returns a hook as the loop calls it, by its name in the loop; the same one for the same hook."""
    if name in ("near", "repair"):
        return _naming(function)
    return _bounding(function) if name == "soonest" else function


def _naming(function: Hook) -> Hook:
    given = with_numpy(function)

    @unchecked
    @hook
    def call(k: Kernel, s: Any, body: int) -> int:
        count = given(k, s, body)
        if count < 0 or count > len(k.near) - SPARE:
            blame(k, BAD_COUNT, body, count)
            return 0
        lowest = np.int32(0)  # as short as slots are: the compiler compares eight at a time
        highest = np.int32(0)
        for i in range(count):
            lowest = smaller(lowest, k.near[i])
            highest = larger(highest, k.near[i])
        if lowest < 0 or highest >= k.clock[0].bodies:
            blame(k, BAD_NAME, body, int(lowest if lowest < 0 else highest))
            return 0
        return int(count)

    return call


def _bounding(function: Hook) -> Hook:
    given = with_numpy(function)

    @unchecked
    @hook
    def call(k: Kernel, body: int, count: int, barred: int, at: int) -> tuple[float, float, int]:
        first, second, who = given(k, body, count, barred, at)
        if first < math.inf and (who < 0 or who >= k.clock[0].bodies):
            blame(k, BAD_PARTNER, body, who)
            return math.inf, math.inf, NOBODY
        return float(first), float(second), int(who)

    return call


ROUNDED = 2.0**-50
"""The part of all speeds, before and after a contact, that may remain as closing speed by rounding. A
response without a rebound leaves up to half of this, of either sign: with an exact sign every second contact
would be a fault. At this speed two bodies reach no deeper into each other than ``limits.tolerance`` in twenty
units of the clock, while the fastest cross the scene in one."""


@hook
def _size(k: Kernel, body: int) -> float:
    """Returns the sum of the absolute values of a body's velocity along x and y."""
    return float(abs(k.bodies[body].vx) + abs(k.bodies[body].vy))


@hook
def _refuse(k: Kernel, fault: int, a: int, b: int) -> None:
    """Blames a response, and exchanges velocities with ``k.places``, which has those before the contact."""
    blame(k, fault, a, b)
    for body in (a, b):
        if body >= 0:
            plan = k.bodies[body]
            place = k.places[body]
            plan.vx, place.vx = place.vx, plan.vx
            plan.vy, place.vy = place.vy, plan.vy


@cache
def refusing_approach(function: Hook) -> Hook:
    """Returns the hook of a response as the loop calls it: it is a fault if the two still close in after it,
    for two bodies by more than rounding explains, for a body and a wall, which are not barred, at all."""
    given = with_numpy(function) if is_checked(function) else function

    @unchecked
    @hook
    def call(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
        other = b if b >= 0 else a
        size = _size(k, a) + _size(k, other)
        given(k, a, b, nx, ny, rule)
        size += _size(k, a) + _size(k, other)
        one = k.bodies[a]
        closing = one.vx * nx + one.vy * ny
        if b >= 0:
            closing = -closing_speed(one, k.bodies[b], nx, ny) - ROUNDED * size
        if closing > 0.0:
            _refuse(k, BAD_RESPONSE, a, b)

    return call


@hook
def _energy(k: Kernel, a: int, b: int, x: float, y: float) -> float:
    """Returns twice the energy of two bodies of finite mass in the frame that moves with (x, y)."""
    found = 0.0
    for body in (a, b):
        if k.mass[body] < math.inf:
            found += k.mass[body] * ((k.bodies[body].vx - x) ** 2 + (k.bodies[body].vy - y) ** 2)
    return float(found)


@cache
def dissipating(function: Hook) -> Hook:
    """Returns the hook of a dissipative response as the loop calls it: as ``refusing_approach``, and it is a
    fault if it adds energy, in the frame of an immovable body of the two."""
    given = refusing_approach(function)

    @unchecked
    @hook
    def call(k: Kernel, a: int, b: int, nx: float, ny: float, rule: Records) -> None:
        other = b if b >= 0 else a  # before a wall the body counts twice, before and after
        heavy = k.bodies[a if k.mass[a] == math.inf else other]
        fixed = larger(k.mass[a], k.mass[other]) == math.inf
        x, y = (heavy.vx, heavy.vy) if fixed else (0.0, 0.0)
        had = _energy(k, a, other, x, y)
        given(k, a, b, nx, ny, rule)
        has = _energy(k, a, other, x, y)
        frame = 8.0 * smaller(k.mass[a], k.mass[other]) * (x * x + y * y)
        if has > had + 2.0**-44 * (had + has + frame):  # by more than rounding adds
            _refuse(k, ADDED_ENERGY, a, b)

    return call
