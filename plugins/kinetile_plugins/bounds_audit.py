"""The audit of sorted bounds, which both kinds of sweep-and-prune share: slow, and from scratch.

Between two events the list of an axis must have each bound once and the ranks that belong to it; no bound may
stand right of its neighbour by more than rounding explains, unless that is about to be put right; each
certificate must be queued for the tick at which the two plans say that its bounds pass; and the candidate
pairs are those whose intervals overlap on every axis, each held once.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.toolbox import NEVER, Kernel, Records, falls_many, positions_now

__all__ = ["audit_bounds"]

Truths = npt.NDArray[np.bool_]

ROWS = 1 << 9
"""Bodies compared with all others at a time."""


def audit_bounds(k: Kernel, order: Records, rank: Records, axes: tuple[int, ...]) -> Iterator[str]:
    """Yield a sentence for everything that does not hold.

    Args:
        k: the kernel's tables.
        order: (axes, 2n), the bounds of each axis from left to right; 2 * body is L, 2 * body + 1 R.
        rank: (axes, 2n), where each bound stands.
        axes: 0 for x, 1 for y; their certificates are numbered one axis after the other.
    """
    bounds = order.shape[1]
    if bounds == 0:
        return
    for row, axis in enumerate(axes):
        name = "xy"[axis]
        if not np.array_equal(np.sort(order[row]), np.arange(bounds)):
            yield f"the list of {name} does not have each bound once"
            return
        if not np.array_equal(rank[row][order[row]], np.arange(bounds)):
            yield f"the ranks of {name} are not those of its list"
            return
        for body in np.flatnonzero(rank[row][0::2] > rank[row][1::2]):
            yield f"body {body} has its right bound left of its left one on {name}"
        yield from _order(k, order[row].astype(np.int64), axis, row * (bounds - 1))
    yield from _pairs(k, rank)


def _order(k: Kernel, order: Any, axis: int, first: int) -> Iterator[str]:
    """Neighbours are in order, and their certificates queued for the tick at which they pass."""
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
    place = k.certificates.place[first : first + len(left)]
    queued = np.where(place >= 0, k.queue.tick[place], NEVER)
    for gap in np.flatnonzero(queued != wanted):
        times = [("never" if tick == NEVER else f"at tick {tick}") for tick in (wanted[gap], queued[gap])]
        yield f"{_names(left[gap], right[gap], axis)} pass {times[0]}, but are watched {times[1]}"
    then = positions_now(k)[:, axis] + speed * clock.tick  # events of this tick have happened, to its end
    edge = then[order >> 1] + np.where(order & 1, bodies.reach[order >> 1], -bodies.reach[order >> 1])
    wrong = (np.diff(edge) < -2.0 * clock.theta) & (queued > clock.now)
    for gap in np.flatnonzero(wrong):
        by = edge[gap] - edge[gap + 1]
        yield f"{_names(left[gap], right[gap], axis)} stand in the wrong order, by {by}"


def _names(left: int, right: int, axis: int) -> str:
    one, two = (f"{'LR'[bound & 1]}({bound >> 1})" for bound in (int(left), int(right)))
    return f"bounds {one} and {two} on {'xy'[axis]}"


def _pairs(k: Kernel, rank: Records) -> Iterator[str]:
    """The candidate pairs are the bodies whose intervals overlap on every axis, each held once."""
    live = k.certificates[k.certificates.a >= 0]
    for a, b in live[live.holds != 1][["a", "b"]].tolist():
        yield f"the pair ({a}, {b}) is held more than once"
    held = set(zip(live.a.tolist(), live.b.tolist(), strict=True))
    lower, upper = rank[:, 0::2], rank[:, 1::2]
    found = set()
    for first in range(0, lower.shape[1], ROWS):
        rows = slice(first, first + ROWS)
        meet: Truths = np.ones((lower[:, rows].shape[1], lower.shape[1]), dtype=bool)
        for low, high in zip(lower, upper, strict=True):
            meet &= (low[rows, None] < high[None, :]) & (low[None, :] < high[rows, None])
        a, b = np.nonzero(meet)
        found |= {(x, y) for x, y in zip((a + first).tolist(), b.tolist(), strict=True) if x < y}
    for a, b in sorted(found - held):
        yield f"the intervals of bodies {a} and {b} overlap, and they are not a candidate pair"
    for a, b in sorted(held - found):
        yield f"bodies {a} and {b} are a candidate pair, and their intervals do not overlap"
