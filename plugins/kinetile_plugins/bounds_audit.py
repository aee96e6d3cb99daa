"""The audit of sorted bounds, which both kinds of sweep-and-prune share: slow, and from scratch.

Between two events the list of an axis must have each bound once and the ranks that belong to it; no bound may
stand right of its neighbour by more than rounding explains, unless that is about to be put right; each bound
must be noted with the tick at which the two plans say that it passes its neighbour, and each body scheduled
for the first tick of its bounds; and the candidate pairs are those whose intervals overlap on every axis,
each held once.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import NEVER, Kernel, falls_many, positions_now

__all__ = ["audit_bounds"]

Truths = npt.NDArray[np.bool_]
Whole = npt.NDArray[np.int64]

ROWS = 1 << 9
"""Bodies compared with all others at a time."""


def audit_bounds(k: Kernel, order: Whole, rank: Whole, due: Whole, axes: tuple[int, ...]) -> Iterator[str]:
    """Yield a sentence for everything that does not hold.

    Args:
        k: the kernel's tables. order: (axes, 2m), the bounds of the m bodies that there are on each axis,
        from left to right; 2 * body
            is L, 2 * body + 1 R.
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
    wrong = (np.diff(edge) < -2.0 * clock.theta) & (noted > clock.now)
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
