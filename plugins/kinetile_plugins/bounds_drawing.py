"""What there is to see of sorted bounds, for both kinds of sweep-and-prune.

Bounds are numbered as in ``bounds_audit``: 2 * body is L, 2 * body + 1 R. A bound hangs on its body, and is
drawn with the tick at which it passes the one right of it. Of all these certificates the first to fail is
drawn beside them: a line from one bound to the other, with what happens when they pass.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import At, Box, Entry, Item, Kernel, Point, Segment, held_pairs, positions_now

__all__ = ["draw_boxes", "draw_line"]

Whole = npt.NDArray[np.int64]

IN_MATRIX = 64
"""The most bodies of which a matrix is drawn: nobody reads a larger one."""


def draw_line(k: Kernel, order: Whole, due: Whole, axis: int) -> Iterator[Item]:
    """Yield the axis, at the edge of the arena or of where bodies are, and each bound as a line to it.

    Args:
        k: the kernel's tables.
        order: (2m,) the bounds of the m bodies from left to right.
        due: (2n,) the tick at which each bound passes the next one.
        axis: 0 for x, 1 for y.
    """
    if not len(order):
        return
    there = np.sort(order[order & 1 == 0] >> 1)
    place, reach = positions_now(k)[there], k.bodies.reach[there][:, None]
    size = (float(k.clock[0].width), float(k.clock[0].height))
    low, high = (place - reach).min(axis=0), (place + reach).max(axis=0)
    if size[axis]:  # who touches a wall reaches a skin beyond it, and only for a moment
        low, high = np.zeros(2), np.array(size)
    foot = float(low[1 - axis])
    yield Segment(
        "axis", _point(float(low[axis]), foot, axis), _point(float(high[axis]), foot, axis), label="xy"[axis]
    )
    for bound in order.tolist():
        body = bound >> 1
        edge = _edge(k, bound)
        yield Segment(
            "bound", _point(edge, foot, axis), _point(edge, At(body), axis), int(due[bound]), "LR"[bound & 1]
        )
    at = int(np.argmin(due[order]))
    if at + 1 < len(order):
        first, other = int(order[at]), int(order[at + 1])
        one, two = _point(_edge(k, first), foot, axis), _point(_edge(k, other), foot, axis)
        yield Segment("certificate", one, two, int(due[first]), _outcome(first, other))


def draw_boxes(k: Kernel, order: Whole, due: Whole) -> Iterator[Item]:
    """Yield each body's box, with the tick of the first of its bounds to pass, the pairs, and the matrix.

    Args:
        k: the kernel's tables.
        order: (2, 2m) the bounds on x and on y from left to right.
        due: (2, 2n) the tick at which each bound passes the next one.
    """
    for body in np.sort(order[0][order[0] & 1 == 0] >> 1).tolist():
        reach = float(k.bodies.reach[body])
        low, high = At(body, -reach), At(body, reach)
        yield Box("bound", (low, low), (high, high), int(due[:, 2 * body : 2 * body + 2].min()))
    yield from held_pairs(k)
    if not order.size:
        return
    yield from _entries(order, due.shape[1])
    axis = int(np.argmin([due[row, order[row]].min() for row in range(2)]))
    at = int(np.argmin(due[axis, order[axis]]))
    if at + 1 < order.shape[1]:
        first, other = int(order[axis, at]), int(order[axis, at + 1])
        one, two = (_point(_edge(k, bound), At(bound >> 1), axis) for bound in (first, other))
        yield Segment("certificate", one, two, int(due[axis, first]), _outcome(first, other))


def _entries(order: Whole, bounds: int) -> Iterator[Item]:
    """Yield what stands in the matrix: on which axes two bodies overlap, if any; read off the order."""
    there = np.sort(order[0][order[0] & 1 == 0] >> 1)
    if len(there) > IN_MATRIX:
        return
    place = np.zeros((2, bounds), np.int64)
    for axis in range(2):
        place[axis, order[axis]] = np.arange(order.shape[1])
    low, high = place[:, 2 * there], place[:, 2 * there + 1]
    over = (low[:, :, None] < high[:, None, :]) & (low[:, None, :] < high[:, :, None])
    for a, b in zip(*np.nonzero(np.triu(over.any(axis=0), 1)), strict=True):
        x, y = over[:, a, b].tolist()
        label = "both" if x and y else "x" if x else "y"
        yield Entry("pair" if label == "both" else "bound", int(there[a]), int(there[b]), label=label)


def _edge(k: Kernel, bound: int) -> At:
    """Return where a bound is on its axis."""
    reach = float(k.bodies.reach[bound >> 1])
    return At(bound >> 1, reach if bound & 1 else -reach)


def _point(along: float | At, across: float | At, axis: int) -> Point:
    """Return a point by its coordinates along an axis and across it."""
    return (along, across) if axis == 0 else (across, along)


def _outcome(left: int, right: int) -> str:
    """Return what it means when two bounds pass each other."""
    if left & 1 == right & 1:
        return "pass"
    return "meet" if left & 1 else "part"
