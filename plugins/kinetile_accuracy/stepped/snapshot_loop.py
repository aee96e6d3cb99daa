"""The compiled loop of the pseudo-dynamic method, and of the search for the deepest overlap.

Written as the kinetic kernel is: hooks that are forced inline, a template that ``compose`` fills in with the
way to find pairs, and one tuple of flat arrays that is viewed without its owners.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np

from kinetile.kernel.compiled import compose, disowned, hook, to_be_filled_in
from kinetile.kernel.log import BOTTOM, LEFT, RIGHT, TOP

__all__ = ["STEPPED", "Bodies", "Discs", "Finder", "deepest_loop", "snapshot_loop"]

Finder = Literal["sweep", "cells"]

STEPPED = np.dtype([("step", "i8"), ("a", "i4"), ("b", "i4"), ("acted", "?"), ("depth", "f8")])
"""An overlap found at a snapshot: its number (the start is 0), body ``a`` with body ``b`` > a or a wall
(``kinetile.kernel.log``), whether they approached, so that there was an impulse, and how deep they overlap,
in radii of the smaller body."""


class Bodies(NamedTuple):
    """Flat arrays, a row for each body; ``body`` is its number in the scene."""

    x: Any
    y: Any
    vx: Any
    vy: Any
    left: Any  # x - radius, by which ``sweep`` sorts
    radius: Any
    mass: Any
    body: Any
    head: Any  # the first row in each cell, or -1
    following: Any  # the next row in a row's cell, or -1
    log: Any
    logged: Any  # how many overlaps, also those for which the log has no room


@hook
def _write(s: Bodies, step: int, a: int, b: int, acted: bool, depth: float) -> None:
    """Log an overlap, where there is room."""
    k = s.logged[0]
    s.logged[0] = k + 1
    if k < len(s.log):
        s.log[k].step = step
        s.log[k].a = a
        s.log[k].b = b
        s.log[k].acted = acted
        s.log[k].depth = depth


@hook
def _meet(s: Bodies, i: int, j: int, step: int, parting: bool) -> None:
    """Give the rows i and j the elastic impulse, if they overlap and approach.

    With ``parting``, log them also if they overlap and do not.
    """
    dx = s.x[j] - s.x[i]
    dy = s.y[j] - s.y[i]
    square = dx * dx + dy * dy
    reach = s.radius[i] + s.radius[j]
    if square < reach * reach:
        approach = dx * (s.vx[j] - s.vx[i]) + dy * (s.vy[j] - s.vy[i])
        if approach < 0.0:
            to_i = s.mass[j] / (s.mass[i] + s.mass[j]) * 2.0 * approach / square
            to_j = s.mass[i] / (s.mass[i] + s.mass[j]) * 2.0 * approach / square
            s.vx[i] += to_i * dx
            s.vy[i] += to_i * dy
            s.vx[j] -= to_j * dx
            s.vy[j] -= to_j * dy
        if approach < 0.0 or parting:
            depth = (reach - math.sqrt(square)) / min(s.radius[i], s.radius[j])
            low, high = min(s.body[i], s.body[j]), max(s.body[i], s.body[j])
            _write(s, step, low, high, approach < 0.0, depth)


@hook
def _place(s: Bodies, to: int, x: float, y: float, vx: float, vy: float) -> None:
    """Write what changes from step to step into a row."""
    s.x[to] = x
    s.y[to] = y
    s.vx[to] = vx
    s.vy[to] = vy


@hook
def _sort(s: Bodies) -> None:
    """Sort the rows by their left bounds, by insertion: few have changed places since the last snapshot."""
    for i in range(1, len(s.x)):
        left = s.left[i]
        if left < s.left[i - 1]:
            x, y, vx, vy = s.x[i], s.y[i], s.vx[i], s.vy[i]
            radius, mass, body = s.radius[i], s.mass[i], s.body[i]
            to = i
            while to > 0 and left < s.left[to - 1]:
                _place(s, to, s.x[to - 1], s.y[to - 1], s.vx[to - 1], s.vy[to - 1])
                s.left[to] = s.left[to - 1]
                s.radius[to] = s.radius[to - 1]
                s.mass[to] = s.mass[to - 1]
                s.body[to] = s.body[to - 1]
                to -= 1
            _place(s, to, x, y, vx, vy)
            s.left[to], s.radius[to], s.mass[to], s.body[to] = left, radius, mass, body


@hook
def _sweep(s: Bodies, step: int, parting: bool, width: float, columns: int, rows: int) -> None:
    """Ask each pair of rows whose extents along x overlap whether it is a contact."""
    _sort(s)
    for i in range(len(s.x)):
        right = s.left[i] + 2.0 * s.radius[i]
        for j in range(i + 1, len(s.x)):
            if s.left[j] > right:
                break
            _meet(s, i, j, step, parting)


@hook
def _cells(s: Bodies, step: int, parting: bool, width: float, columns: int, rows: int) -> None:
    """Put the rows into their cells one by one, and ask each with those already in its cell and around it."""
    s.head[:] = -1
    for i in range(len(s.x)):
        column = min(max(int(s.x[i] / width), 0), columns - 1)
        row = min(max(int(s.y[i] / width), 0), rows - 1)
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(column - 1, 0), min(column + 2, columns)):
                j = s.head[r * columns + c]
                while j >= 0:
                    _meet(s, i, j, step, parting)
                    j = s.following[j]
        s.following[i] = s.head[row * columns + column]
        s.head[row * columns + column] = i


find: Callable[..., None] = to_be_filled_in
WALLED = True


def _run(
    s: Bodies,
    steps: int,
    dt: float,
    parting: bool,
    sides: tuple[float, float],
    cell: float,
    columns: int,
    rows: int,
) -> None:
    """Take so many steps: the template of the loop."""
    s = disowned(s)
    for step in range(1, steps + 1):
        for i in range(len(s.x)):
            s.x[i] += s.vx[i] * dt
            s.y[i] += s.vy[i] * dt
        if WALLED:
            for i in range(len(s.x)):
                radius = s.radius[i]
                if s.x[i] < radius and s.vx[i] < 0.0:
                    _write(s, step, s.body[i], LEFT, True, 1.0 - s.x[i] / radius)
                    s.x[i] = 2.0 * radius - s.x[i]
                    s.vx[i] = -s.vx[i]
                elif s.x[i] > sides[0] - radius and s.vx[i] > 0.0:
                    _write(s, step, s.body[i], RIGHT, True, 1.0 - (sides[0] - s.x[i]) / radius)
                    s.x[i] = 2.0 * (sides[0] - radius) - s.x[i]
                    s.vx[i] = -s.vx[i]
                if s.y[i] < radius and s.vy[i] < 0.0:
                    _write(s, step, s.body[i], BOTTOM, True, 1.0 - s.y[i] / radius)
                    s.y[i] = 2.0 * radius - s.y[i]
                    s.vy[i] = -s.vy[i]
                elif s.y[i] > sides[1] - radius and s.vy[i] > 0.0:
                    _write(s, step, s.body[i], TOP, True, 1.0 - (sides[1] - s.y[i]) / radius)
                    s.y[i] = 2.0 * (sides[1] - radius) - s.y[i]
                    s.vy[i] = -s.vy[i]
        for i in range(len(s.x)):
            s.left[i] = s.x[i] - s.radius[i]
        find(s, step, parting, cell, columns, rows)


class Discs(NamedTuple):
    """Flat arrays, a row for each body."""

    x: Any
    y: Any
    radius: Any


def _deepest(s: Discs) -> float:
    deepest = 0.0
    for i in range(len(s.x)):
        for j in range(i):
            dx = s.x[j] - s.x[i]
            dy = s.y[j] - s.y[i]
            reach = s.radius[i] + s.radius[j]
            square = dx * dx + dy * dy
            if square < reach * reach:
                depth = (reach - math.sqrt(square)) / min(s.radius[i], s.radius[j])
                deepest = max(deepest, depth)
    return deepest


@cache
def deepest_loop() -> Callable[..., float]:
    """Return the compiled search: called with ``Discs``, it gives the deepest overlap, in radii."""
    return compose(_deepest, {}, "discs", Discs)


@cache
def snapshot_loop(finder: Finder, walled: bool) -> Callable[..., None]:
    """Return the compiled loop: ``loop(bodies, steps, dt, parting, sides, cell, columns, rows)``."""
    parts = {"find": _sweep if finder == "sweep" else _cells, "WALLED": walled}
    return compose(_run, parts, f"{finder}_{'walled' if walled else 'open'}", Bodies)
