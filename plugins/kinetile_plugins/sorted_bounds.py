"""Sorted bounds (``sweep_and_prune``): their audit, slow and from scratch, and drawing.

The distance from a body's place to its bound is the body's reach to that side (``reach_to``). A list of the
circles around bodies would be right as well, but has more pairs, the longer the bodies are.

Between two events the list of an axis has each bound once, and the ranks match the list. No bound is right of
its neighbour by more than rounding explains, unless a repair is due. Each bound is noted with the tick of
passing its neighbour, by the two plans, and each body is scheduled for the first tick of its bounds.
The candidate pairs overlap on every axis, and each is held once for every image of the overlap.

A drawn bound is attached to its body, and has the tick of passing the bound right of it. The first of these
certificates to fail is drawn as a line between the two bounds; its label says the effect ("meet" or "part").
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from kinetile.arrays import Floats, Integers
from kinetile.toolbox import (
    NEVER,
    At,
    Box,
    Coordinate,
    Entry,
    Item,
    Kernel,
    Plan,
    Point,
    Polygon,
    Records,
    Segment,
    falls_many,
    held_pairs,
    hook,
    pair_links,
    positions_after,
    positions_now,
    reach_to,
    reaches_of,
)

Whole = Integers
Lengths = Floats

ROWS = 1 << 9
"""Bodies compared with all others at a time."""


@hook
def offset(k: Kernel, body: Records, side: int) -> float:
    """Returns the offset of the bound of a body on a side, to the right of its place or above it. The sides
    are numbered as in ``reach_to``: L and R on x, L and R on y."""
    reach = reach_to(body, side, k.clock[0].limits.skin)
    return reach if side & 1 else -reach


def offsets(k: Kernel) -> Lengths:
    """Returns (n, 4) the values of ``offset`` for all bodies."""
    return np.asarray(reaches_of(k) * np.array([-1.0, 1.0, -1.0, 1.0]))


class Lists(NamedTuple):
    """The sorted bounds of m bodies in n slots; bound 2 * body is L of a body, 2 * body + 1 its R.

    On a periodic axis the order is one turn of an endless line of images. A bound's place on that line is for
    the image whose body is at the position of its plan.
    """

    names: tuple[str, ...]  # of the lines of the lists: "x", "y", or a direction
    shares: Lengths  # (lists, 2) of x and y in a place on the line
    away: Lengths  # (lists, 2n) the offset of each bound to the right of its body's place
    order: Whole  # (lists, 2m) the bounds from left to right
    place: Whole  # (lists, 2n) the position of each bound in the order, from 0
    due: Whole  # (lists, 2n) the tick of each bound to pass the one right of it


def audit_bounds(k: Kernel, lists: Lists) -> Iterator[str]:
    """Yields a sentence for each fault; O(n^2)."""
    names, _, _, order, place, due = lists
    there = np.flatnonzero(k.queue.number >= 0)
    bounds = np.sort(np.concatenate([2 * there, 2 * there + 1]))
    if not len(bounds) and not order.size:
        return
    for row, name in enumerate(names):
        if not np.array_equal(np.sort(order[row]), bounds):
            yield f"the list of {name} does not have each bound once"
            return
        slots = place[row][order[row]] % len(bounds) if _period(k, lists, row) else place[row][order[row]]
        if not np.array_equal(slots, np.arange(len(bounds))):
            yield f"the ranks of {name} are not those of its list"
            return
        for body in there[place[row][2 * there] > place[row][2 * there + 1]]:
            yield f"body {body} has its right bound left of its left one on {name}"
        yield from _order(k, lists, row)
    first = due.min(axis=0).reshape(-1, 2).min(axis=1)
    for body in there[k.queue.certificate[there] != first[there]]:
        queued = _tick(k.queue.certificate[body])
        yield f"body {body} is scheduled {queued}, but its bounds pass {_tick(first[body])}"
    yield from _pairs(k, place, there)


def _period(k: Kernel, lists: Lists, row: int) -> float:
    torus = k.clock[0].torus
    return float(lists.shares[row] @ (torus.x, torus.y))


def _along(shares: Lengths, x: Lengths, y: Lengths) -> Lengths:
    """Returns the shares of vectors along a line, by the operations of the hooks."""
    return np.asarray(shares[0] * x + shares[1] * y)


def _order(k: Kernel, lists: Lists, row: int) -> Iterator[str]:
    """Yields each two neighbours that are out of order, or noted with a wrong tick of passing."""
    bodies, clock = k.bodies, k.clock[0]
    name, shares, away = lists.names[row], lists.shares[row], lists.away[row]
    order, place, due = lists.order[row], lists.place[row], lists.due[row]
    period = _period(k, lists, row)
    left, right = (order, np.roll(order, -1)) if period else (order[:-1], order[1:])
    p, q = left >> 1, right >> 1
    behind = ((place[left] - place[right]) // len(order) + 1) * period
    speed = _along(shares, bodies.vx, bodies.vy)
    since = np.maximum(bodies.anchor[p], bodies.anchor[q])
    edges = []
    for body, bound in ((p, left), (q, right)):
        elapsed = (since - bodies.anchor[body]) * clock.per_tick
        places = positions_after(Plan.of(bodies[body]), elapsed)
        edges.append(_along(shares, *places.T) + away[bound])
    wanted = falls_many(k, since, edges[1] - edges[0] + behind, speed[q] - speed[p])
    noted = due[left]
    for gap in np.flatnonzero(noted != wanted):
        times = f"pass {_tick(wanted[gap])}, but are watched {_tick(noted[gap])}"
        yield f"{_names(left[gap], right[gap], name)} {times}"
    if not period and due[order[-1]] != NEVER:
        yield f"the last bound on {name} has no neighbour, but is watched {_tick(due[order[-1]])}"
    then = _along(shares, *positions_now(k).T) + speed * clock.per_tick  # events of this tick have happened
    by = (then[p] + away[left]) - (then[q] + away[right]) - behind
    for gap in np.flatnonzero((by > 2.0 * clock.limits.theta) & (noted > clock.now)):
        yield f"{_names(left[gap], right[gap], name)} are in the wrong order, by {by[gap]}"


def _tick(tick: int) -> str:
    return "never" if tick == NEVER else f"at tick {tick}"


def _names(left: int, right: int, name: str) -> str:
    one, two = (f"{'LR'[bound & 1]}({bound >> 1})" for bound in (int(left), int(right)))
    return f"bounds {one} and {two} on {name}"


def _overlaps(low: Whole, high: Whole, rows: slice) -> Whole:
    """Returns (rows, n) the number of images through which two intervals overlap, by their ends' places."""
    turn = 2 * len(low)
    return (high[rows, None] - low) // turn - (low[rows, None] - high) // turn


def _pairs(k: Kernel, place: Whole, there: Whole) -> Iterator[str]:
    """Yields each difference from the pairs that overlap on every axis, held once for every image."""
    live = k.pairs[k.pairs.a >= 0]
    held = dict(zip(zip(live.a.tolist(), live.b.tolist(), strict=True), live.holds.tolist(), strict=True))
    lower, upper = place[:, 2 * there], place[:, 2 * there + 1]
    found: dict[tuple[int, int], int] = {}
    for first in range(0, len(there), ROWS):
        rows = slice(first, first + ROWS)
        meet = np.prod([_overlaps(low, high, rows) for low, high in zip(lower, upper, strict=True)], axis=0)
        row, column = np.nonzero(meet)
        columns = there[row + first], there[column], meet[row, column]
        pairs = zip(*(each.tolist() for each in columns), strict=True)
        found |= {(a, b): times for a, b, times in pairs if a < b}
    for a, b in sorted(found.keys() - held):
        yield f"the intervals of bodies {a} and {b} overlap, and they are not a candidate pair"
    for a, b in sorted(held.keys() - found):
        yield f"bodies {a} and {b} are a candidate pair, and their intervals do not overlap"
    for a, b in sorted(held.keys() & found):
        if held[a, b] != found[a, b]:
            yield f"the pair ({a}, {b}) is held {held[a, b]} times, and overlaps {found[a, b]} times"


IN_MATRIX = 64
"""The most bodies of a drawn matrix: a larger one is unreadable."""


def draw_bounds(k: Kernel, lists: Lists) -> Iterator[Item]:
    """Draws one line with the bounds on it, or the boxes or polygons of bodies with the overlapping pairs;
    and the two bounds that pass next."""
    if not lists.order.size:
        return
    along_axes, several = not lists.shares.all(axis=1).any(), len(lists.names) > 1
    if several:
        yield from _boxes(lists) if along_axes else _polygons(lists)
        yield from pair_links(held_pairs(k))
        yield from _entries(lists)
        row = int(np.argmin([lists.due[row, order].min() for row, order in enumerate(lists.order)]))
        yield from _certificate(k, lists, row)
    else:
        yield from _line(k, lists) if along_axes else _slanted_line(k, lists)


def _line(k: Kernel, lists: Lists) -> Iterator[Item]:
    """Yields the axis, at the edge of the arena or of the bodies, and each bound as a line to it."""
    order, axis = lists.order[0], int(lists.names[0] == "y")
    there = np.sort(order[order & 1 == 0] >> 1)
    now, away = positions_now(k)[there], offsets(k)[there]
    corners = np.array([[0.0, 0.0], [k.clock[0].limits.width, k.clock[0].limits.height]])
    low, high = (now + away[:, ::2]).min(axis=0), (now + away[:, 1::2]).max(axis=0)
    if corners[0, axis] < corners[1, axis]:  # a body at a wall reaches a skin beyond it, for a moment
        low, high = corners
    foot = float(low[1 - axis])
    begin, end = (_point(float(each[axis]), foot, axis) for each in (low, high))
    yield Segment("axis", begin, end, label="xy"[axis])
    for bound in order.tolist():
        body, due = bound >> 1, int(lists.due[0, bound])
        edge = _edge(lists, 0, bound)
        yield Segment("bound", _point(edge, foot, axis), _point(edge, At(body), axis), due, "LR"[bound & 1])
    yield from _certificate(k, lists, 0, foot)


def _slanted_line(k: Kernel, lists: Lists) -> Iterator[Item]:
    """Yields the line, through the middle of the arena or of the bodies, and a piece of each tangent."""
    share, order = lists.shares[0] / (lists.shares[0] @ lists.shares[0]), lists.order[0]
    corners = np.array([[0.0, 0.0], [k.clock[0].limits.width, k.clock[0].limits.height]])
    size = corners[1] - corners[0]
    if size.all():
        middle, half = 0.5 * corners.sum(axis=0), 0.5 * float(np.abs(lists.shares[0]) @ size)
        far = -half, half
    else:
        there = np.sort(order[order & 1 == 0] >> 1)
        now = positions_now(k)[there]
        middle = 0.5 * (now.min(axis=0) + now.max(axis=0))
        from_it = (now - middle) @ lists.shares[0]
        far = (from_it + lists.away[0, 2 * there]).min(), (from_it + lists.away[0, 2 * there + 1]).max()
    low, high = ((float(x), float(y)) for x, y in (middle + np.outer(far, share)).tolist())
    yield Segment("axis", low, high, label=lists.names[0])
    for bound in order.tolist():
        begin, end = (_rim(lists, 0, bound, to) for to in (-1.0, 1.0))
        yield Segment("bound", begin, end, int(lists.due[0, bound]), "LR"[bound & 1])
    yield from _certificate(k, lists, 0)


def _boxes(lists: Lists) -> Iterator[Item]:
    """Yields each body's box, with the tick of the first of its bounds to pass."""
    for body, due in _present(lists):
        (left, right), (low, high) = (
            [_edge(lists, axis, 2 * body + upper) for upper in (0, 1)] for axis in (0, 1)
        )
        yield Box("bound", (left, low), (right, high), due)


def _polygons(lists: Lists) -> Iterator[Item]:
    """Yields the polygon of each body's bounds, with the tick of the first of its bounds to pass."""
    normals = np.concatenate([-lists.shares, lists.shares])
    around = np.argsort(np.arctan2(*normals.T[::-1]))
    sides = np.stack([normals, np.roll(normals[around], -1, axis=0)[np.argsort(around)]], axis=1)[around]
    for body, due in _present(lists):
        away = np.abs(lists.away[:, 2 * body : 2 * body + 2]).T.ravel()[around]
        corners = np.linalg.solve(sides, np.stack([away, np.roll(away, -1)], axis=1)[:, :, None])[:, :, 0]
        yield Polygon("bound", tuple((At(body, x), At(body, y)) for x, y in corners.tolist()), due)


def _present(lists: Lists) -> Iterator[tuple[int, int]]:
    """Yields the bodies, each with the tick of the first of its bounds to pass."""
    order = lists.order[0]
    for body in np.sort(order[order & 1 == 0] >> 1).tolist():
        yield body, int(lists.due[:, 2 * body : 2 * body + 2].min())


def _certificate(k: Kernel, lists: Lists, row: int, foot: float | None = None) -> Iterator[Segment]:
    """Yields the first certificate of a list to fail: a line between two bounds, at a height or from body to
    body. On a periodic axis the line ends at the watched image, along the other axis at the nearest image."""
    order, place, due = lists.order[row], lists.place[row], lists.due[row]
    at = int(np.argmin(due[order]))
    period = _period(k, lists, row)
    if at + 1 == len(order) and not period:
        return
    first, other = int(order[at]), int(order[(at + 1) % len(order)])
    passing = "pass" if first & 1 == other & 1 else "meet" if first & 1 else "part"
    failing = int(due[first]), passing
    if lists.shares[row].all():
        yield Segment("certificate", _rim(lists, row, first), _rim(lists, row, other), *failing)
        return
    axis = int(lists.names[row] == "y")
    one, two = _edge(lists, row, first), _edge(lists, row, other)
    if period:
        two = At(two.body, two.offset, int((place[first] - place[other]) // len(order)) + 1)
    heights: list[Coordinate] = [At(one.body), At(two.body)] if foot is None else [foot, foot]
    if foot is None and (across := float((k.clock[0].torus.y, k.clock[0].torus.x)[axis])):
        low, high = positions_now(k, np.array([one.body, two.body]))[:, 1 - axis].tolist()
        heights[1] = At(two.body, turns=round((low - high) / across))
    begin, end = (_point(edge, height, axis) for edge, height in zip((one, two), heights, strict=True))
    yield Segment("certificate", begin, end, *failing)


def _entries(lists: Lists) -> Iterator[Item]:
    """Yields the entries of the matrix: for each two bodies the lists with an overlap, if any."""
    there = np.array([body for body, _ in _present(lists)])
    if len(there) > IN_MATRIX:
        return
    lower, upper = lists.place[:, 2 * there], lists.place[:, 2 * there + 1]
    over = np.stack([_overlaps(low, high, slice(None)) > 0 for low, high in zip(lower, upper, strict=True)])
    names = np.array(lists.names)
    for a, b in zip(*np.nonzero(np.triu(over.any(axis=0), 1)), strict=True):
        every = bool(over[:, a, b].all())
        label = ("both" if len(names) == 2 else "all") if every else " ".join(names[over[:, a, b]])
        yield Entry("pair" if every else "bound", int(there[a]), int(there[b]), label=label)


def _edge(lists: Lists, row: int, bound: int) -> At:
    return At(bound >> 1, float(lists.away[row, bound]))


def _rim(lists: Lists, row: int, bound: int, along: float = 0.0) -> Point:
    """Returns the common point of a slanted bound and its body, moved along the bound by some reaches."""
    x, y = (lists.shares[row] * (lists.away[row, bound] / (lists.shares[row] @ lists.shares[row]))).tolist()
    return At(bound >> 1, x - along * y), At(bound >> 1, y + along * x)


def _point(along: Coordinate, across: Coordinate, axis: int) -> Point:
    return (along, across) if axis == 0 else (across, along)
