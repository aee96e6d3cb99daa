"""Forms of the time of contact of two discs, compiled: the kernel's own, and the textbook's for comparison.

A form is a hook as a narrow phase has it: ``meet(k, a, b)`` returns the tick of the first contact of two
bodies, or ``NEVER``. All of them are called on the kernel's own tables, by one loop that differs
in nothing but the form, and all round down to the kernel's ticks. The kernel's own form is whatever the
narrow phase ``disc`` brings: the very hook that the main loop is composed with.

With d the separation, v the relative velocity and R the sum of the radii, a = v.v, b = d.v, c = d.d - R^2,
the textbook's contact comes after (-b - sqrt(b^2 - ac)) / a. Citardauq's c / (-b + sqrt(b^2 - ac)) does not
cancel where b is small. The cross product form takes b^2 - ac as R^2 a - (d x v)^2, and c as
(|d| - R)(|d| + R).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

import kinetile as kt
from kinetile.kernel.compiled import compose, disowned, to_be_filled_in
from kinetile.kernel.tables import allocate
from kinetile.toolbox import NEVER, Kernel, PairParts, hook, since_anchor, ticks_after
from kinetile_accuracy.contact_times.families import Queries
from kinetile_accuracy.specification.arithmetic import UNIT_TICKS

Floats = npt.NDArray[np.float64]
Ticks = npt.NDArray[np.int64]
Form = Callable[..., int]

KERNEL = "kernel"
"""The name of the form that the narrow phase ``disc`` brings."""


@hook
def encounter(k: Kernel, a: int, b: int) -> tuple[int, float, float, float, float, float]:
    """Returns the later of two anchors, separation and relative velocity there, and the sum of the radii."""
    one = k.bodies[a]
    two = k.bodies[b]
    since = max(one.anchor, two.anchor)
    one_time = since_anchor(k, one, since)
    two_time = since_anchor(k, two, since)
    dx = (two.x + two.vx * two_time) - (one.x + one.vx * one_time)
    dy = (two.y + two.vy * two_time) - (one.y + one.vy * one_time)
    vx = two.vx - one.vx
    vy = two.vy - one.vy
    reach = one.radius + two.radius
    return since, dx, dy, vx, vy, reach


@hook
def naive(k: Kernel, a: int, b: int) -> int:
    """Returns the tick by (-b - sqrt(b^2 - ac)) / a."""
    since, dx, dy, vx, vy, reach = encounter(k, a, b)
    approach = dx * vx + dy * vy
    speed2 = vx * vx + vy * vy
    root = approach * approach - speed2 * (dx * dx + dy * dy - reach * reach)
    if not approach < 0.0 or not root > 0.0:
        return NEVER
    return ticks_after(k, since, max((-approach - math.sqrt(root)) / speed2, 0.0))


@hook
def citardauq(k: Kernel, a: int, b: int) -> int:
    """Returns the tick by c / (-b + sqrt(b^2 - ac))."""
    since, dx, dy, vx, vy, reach = encounter(k, a, b)
    approach = dx * vx + dy * vy
    gap = dx * dx + dy * dy - reach * reach
    root = approach * approach - (vx * vx + vy * vy) * gap
    if not approach < 0.0 or not root > 0.0:
        return NEVER
    return ticks_after(k, since, max(gap / (math.sqrt(root) - approach), 0.0))


@hook
def cross_product(k: Kernel, a: int, b: int) -> int:
    """Returns the tick with the discriminant as R^2 v.v - (d x v)^2 and c as (|d| - R)(|d| + R)."""
    since, dx, dy, vx, vy, reach = encounter(k, a, b)
    approach = dx * vx + dy * vy
    cross = dx * vy - dy * vx
    distance = math.sqrt(dx * dx + dy * dy)
    root = reach * reach * (vx * vx + vy * vy) - cross * cross
    if not approach < 0.0 or not root > 0.0:
        return NEVER
    gap = (distance - reach) * (distance + reach)
    return ticks_after(k, since, max(gap / (math.sqrt(root) - approach), 0.0))


meet = to_be_filled_in


def ticks_of_all(k: Kernel, answers: Any, first: int, last: int) -> None:
    """Writes the ticks by ``meet`` of bodies 2i and 2i + 1, for every i from ``first`` to before ``last``."""
    k = disowned(k)
    for i in range(first, last):
        answers[i] = meet(k, 2 * i, 2 * i + 1)


def forms() -> dict[str, Form]:
    """Returns the forms by name, the kernel's own first."""
    return {KERNEL: _disc().meet, "naive": naive, "citardauq": citardauq, "cross product": cross_product}


def ticks_by(form: Form, queries: Queries) -> Ticks:
    """Returns (m,) the ticks that a form gives for m queries; NEVER for no contact.

    Raises RuntimeError where the form reports a fault of the bodies.
    """
    k = _tables(queries)
    answers = np.zeros(len(queries), dtype=np.int64)
    _compiled(form)(k, answers, 0, len(queries))
    if k.clock[0].fault.code:
        raise RuntimeError(f"fault {k.clock[0].fault.code} at the bodies of query {k.clock[0].fault.a // 2}")
    return answers


def batch_times(forms: Mapping[str, Form], queries: Queries, batch: int, least: int) -> dict[str, Floats]:
    """Returns for each form the CPU nanoseconds a query, in at least ``least`` batches of ``batch`` queries.

    The queries of a batch are one after another in memory. The forms take turns, so that a machine that slows
    down slows all of them. What a call itself costs is measured with empty batches and taken off.
    """
    k = _tables(queries)
    answers = np.zeros(len(queries), dtype=np.int64)
    compiled = {name: _compiled(form) for name, form in forms.items()}
    taken: dict[tuple[str, int], list[int]] = {(name, size): [] for name in forms for size in (0, batch)}
    starts = range(0, len(queries) - batch + 1, batch)
    for number in range(-2, max(least, len(starts))):
        first = starts[number % len(starts)]
        for (name, size), times in taken.items():
            began = time.thread_time_ns()
            compiled[name](k, answers, first, first + size)
            ended = time.thread_time_ns()
            if number >= 0:
                times.append(ended - began)
    empty = {name: float(np.median(taken[name, 0])) for name in forms}
    return {name: np.maximum(np.array(taken[name, batch]) - empty[name], 0.0) / batch for name in forms}


def _compiled(form: Form) -> Callable[..., None]:
    return compose(ticks_of_all, {"meet": form}, "ask", Kernel)


def _disc() -> PairParts:
    """Returns the parts of the narrow phase ``disc`` for bodies of different mass."""
    scene = kt.Scene([(0.0, 0.0), (3.0, 0.0)], [(0.0, 0.0), (0.0, 0.0)], 1.0, mass=[1.0, 2.0])
    parts: PairParts = kt.registry().narrow_phase("disc")().prepare(scene)
    return parts


def _tables(queries: Queries) -> Kernel:
    """Returns the kernel's tables with the discs of query i as bodies 2i and 2i + 1, a unit of time of 1."""
    k = allocate(2 * len(queries), near=0, log_rows=0)
    k.bodies.x, k.bodies.y = queries.position.reshape(-1, 2).T
    k.bodies.vx, k.bodies.vy = queries.velocity.reshape(-1, 2).T
    k.bodies.radius = queries.radius.ravel()
    k.bodies.anchor = queries.anchor.ravel()
    k.bodies.last = -1
    clock = k.clock[0]
    clock.tick, clock.per_time = 1.0 / UNIT_TICKS, float(UNIT_TICKS)
    return k
