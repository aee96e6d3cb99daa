"""Sorted bounds, as both kinds of sweep-and-prune have them: their audit, slow and from scratch, and drawing.

Bound 2 * body is L of a body, 2 * body + 1 its R. ``order`` are the bounds of an axis from left to right,
``rank`` is the place of each bound in it, and ``due`` the tick at which each bound passes the one right of
it. The two phases store the same numbers side by side in cache lines of their own, and unpack them for these
functions; hooks are written for one storage each.

Between two events the list of an axis must have each bound once and the ranks that belong to it; no bound may
stand right of its neighbour by more than rounding explains, unless that is about to be put right; each bound
must be noted with the tick at which the two plans say that it passes its neighbour, and each body scheduled
for the first tick of its bounds; and the candidate pairs are those whose intervals overlap on every axis,
each held once.

A drawn bound hangs on its body, and has the tick at which it passes the one right of it. The first of all
these certificates to fail is drawn as a line from one bound to the other, with what happens when they pass.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import (
    NEVER,
    At,
    Box,
    Entry,
    Item,
    Kernel,
    Point,
    Segment,
    falls_many,
    held_pairs,
    positions_now,
)

Truths = npt.NDArray[np.bool_]
Whole = npt.NDArray[np.int64]

ROWS = 1 << 9
"""Bodies compared with all others at a time."""


def audit_bounds(k: Kernel, order: Whole, rank: Whole, due: Whole, axes: tuple[int, ...]) -> Iterator[str]:
    """Yields a sentence for everything that does not hold.

    Args:
        k: the kernel's tables.
        order: (axes, 2m), the bounds of the m bodies that there are on each axis, from left to right.
        rank: (axes, 2n), where each bound of n slots stands, from 0.
        due: (axes, 2n), the tick at which each bound passes the one right of it.
        axes: 0 for x, 1 for y.
    """
    there = np.flatnonzero(k.queue.number >= 0)
    bounds = np.sort(np.concatenate([2 * there, 2 * there + 1]))
    if not len(bounds) and not order.size:
        return
    for row, axis in enumerate(axes):
        name = "xy"[axis]
        if not np.array_equal(np.sort(order[row]), bounds):
            yield f"the list of {name} does not have each bound once"
            return
        if not np.array_equal(rank[row][order[row]], np.arange(len(bounds))):
            yield f"the ranks of {name} are not those of its list"
            return
        for body in there[rank[row][2 * there] > rank[row][2 * there + 1]]:
            yield f"body {body} has its right bound left of its left one on {name}"
        yield from _order(k, order[row], due[row], axis)
    first = due.min(axis=0).reshape(-1, 2).min(axis=1)
    for body in there[k.queue.own[there] != first[there]]:
        yield f"body {body} is scheduled {_tick(k.queue.own[body])}, but its bounds pass {_tick(first[body])}"
    yield from _pairs(k, rank, there)


def _order(k: Kernel, order: Whole, due: Whole, axis: int) -> Iterator[str]:
    """Neighbours are in order, and noted with the tick at which they pass."""
    bodies, clock = k.bodies, k.clock[0]
    left, right = order[:-1], order[1:]
    p, q = left >> 1, right >> 1
    at, speed = (bodies.x, bodies.vx) if axis == 0 else (bodies.y, bodies.vy)
    since = np.maximum(bodies.anchor[p], bodies.anchor[q])
    edges = [
        at[body]
        + speed[body] * ((since - bodies.anchor[body]) * clock.tick)
        + np.where(bound & 1, bodies.reach[body], -bodies.reach[body])
        for body, bound in ((p, left), (q, right))
    ]
    wanted = falls_many(k, since, edges[1] - edges[0], speed[q] - speed[p])
    noted = due[left]
    for gap in np.flatnonzero(noted != wanted):
        times = f"pass {_tick(wanted[gap])}, but are watched {_tick(noted[gap])}"
        yield f"{_names(left[gap], right[gap], axis)} {times}"
    if due[order[-1]] != NEVER:
        yield f"the last bound on {'xy'[axis]} has no neighbour, but is watched {_tick(due[order[-1]])}"
    then = positions_now(k)[:, axis] + speed * clock.tick  # events of this tick have happened, to its end
    edge = then[order >> 1] + np.where(order & 1, bodies.reach[order >> 1], -bodies.reach[order >> 1])
    wrong = (np.diff(edge) < -2.0 * clock.limits.theta) & (noted > clock.now)
    for gap in np.flatnonzero(wrong):
        by = edge[gap] - edge[gap + 1]
        yield f"{_names(left[gap], right[gap], axis)} stand in the wrong order, by {by}"


def _tick(tick: int) -> str:
    return "never" if tick == NEVER else f"at tick {tick}"


def _names(left: int, right: int, axis: int) -> str:
    one, two = (f"{'LR'[bound & 1]}({bound >> 1})" for bound in (int(left), int(right)))
    return f"bounds {one} and {two} on {'xy'[axis]}"


def _pairs(k: Kernel, rank: Whole, there: Whole) -> Iterator[str]:
    """The candidate pairs are the bodies whose intervals overlap on every axis, each held once."""
    live = k.pairs[k.pairs.a >= 0]
    for a, b in live[live.holds != 1][["a", "b"]].tolist():
        yield f"the pair ({a}, {b}) is held more than once"
    held = set(zip(live.a.tolist(), live.b.tolist(), strict=True))
    lower, upper = rank[:, 2 * there], rank[:, 2 * there + 1]
    found = set()
    for first in range(0, lower.shape[1], ROWS):
        rows = slice(first, first + ROWS)
        meet: Truths = np.ones((lower[:, rows].shape[1], lower.shape[1]), dtype=bool)
        for low, high in zip(lower, upper, strict=True):
            meet &= (low[rows, None] < high[None, :]) & (low[None, :] < high[rows, None])
        a, b = np.nonzero(meet)
        found |= {(x, y) for x, y in zip(there[a + first].tolist(), there[b].tolist(), strict=True) if x < y}
    for a, b in sorted(found - held):
        yield f"the intervals of bodies {a} and {b} overlap, and they are not a candidate pair"
    for a, b in sorted(held - found):
        yield f"bodies {a} and {b} are a candidate pair, and their intervals do not overlap"


IN_MATRIX = 64
"""The most bodies of a drawn matrix: a larger one is unreadable."""


def draw_line(k: Kernel, order: Whole, due: Whole, axis: int) -> Iterator[Item]:
    """Yields the axis, at the edge of the arena or of where bodies are, and each bound as a line to it.

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
    size = (float(k.clock[0].limits.width), float(k.clock[0].limits.height))
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
    """Yields each body's box, with the tick of the first of its bounds to pass, the pairs, and the matrix.

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
    """Yields what stands in the matrix: on which axes two bodies overlap, if any; read off the order."""
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
    """Returns where a bound is on its axis."""
    reach = float(k.bodies.reach[bound >> 1])
    return At(bound >> 1, reach if bound & 1 else -reach)


def _point(along: float | At, across: float | At, axis: int) -> Point:
    """Returns a point by its coordinates along an axis and across it."""
    return (along, across) if axis == 0 else (across, along)


def _outcome(left: int, right: int) -> str:
    """Returns what it means when two bounds pass each other."""
    if left & 1 == right & 1:
        return "pass"
    return "meet" if left & 1 else "part"
