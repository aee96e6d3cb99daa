"""The dynamically sorted list: a kinetic data structure without collisions.

Points move on a line at constant speeds; their order from left to right is the attribute that the structure
maintains (thesis, section 2, figure 5). The proof is one certificate for each two neighbours, kept by the
left one: it is not right of the next. When it fails, the two change places, and the certificates around them
are made again.

This module is the whole structure. It uses the protocol of every broad phase: ``kinetile.toolbox`` and one
class.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import kinetile as kt
import numpy as np
from kinetile.toolbox import (
    NEVER,
    At,
    BroadPhaseParts,
    Item,
    Kernel,
    Records,
    Segment,
    falls,
    hook,
    position_at,
    positions_now,
    schedule,
)

__all__ = ["SortedList"]


class State(NamedTuple):
    """The attribute: ``order[i]`` is the i-th point from the left, ``rank[p]`` is the place of point p."""

    order: Records
    rank: Records


def arrange(k: Kernel, s: State) -> None:
    """Sorts the points at the start; if two share a place, the slower is left a moment later."""
    s.order[:] = np.lexsort((k.bodies.vx, positions_now(k)[:, 0]))
    s.rank[s.order] = np.arange(len(s.order))


@hook
def near(k: Kernel, s: State, point: int) -> int:
    """No body is near another: the points are on a line, but do not collide."""
    return 0


@hook
def assert_order(k: Kernel, s: State, point: int) -> None:
    """Schedules the failure of a point's certificate: it is not right of the next one."""
    right = s.rank[point] + 1
    if right == len(s.order):
        schedule(k, point, NEVER)
        return
    p = k.bodies[point]
    q = k.bodies[s.order[right]]
    since = max(p.anchor, q.anchor)
    gap = position_at(k, q, since)[0] - position_at(k, p, since)[0]
    schedule(k, point, falls(k, since, gap, q.vx - p.vx))


@hook
def build(k: Kernel, s: State) -> None:
    """Asserts the order of all neighbours."""
    for point in range(len(s.order)):
        assert_order(k, s, point)


@hook
def repair(k: Kernel, s: State, p: int) -> int:
    """Point p passes the next one, q: exchange them and assert the order around them."""
    rank = s.rank[p]
    q = s.order[rank + 1]
    s.order[rank], s.order[rank + 1] = q, p
    s.rank[q], s.rank[p] = rank, rank + 1
    for at in range(max(rank - 1, 0), rank + 2):
        assert_order(k, s, s.order[at])
    return 0


@hook
def replan(k: Kernel, s: State, point: int) -> None:
    """A point changed its speed: its own certificate and its left neighbour's depend on it."""
    for at in range(max(s.rank[point] - 1, 0), s.rank[point] + 1):
        assert_order(k, s, s.order[at])


def draw(k: Kernel, s: State) -> Iterator[Item]:
    """Draws the line, the foot of each point on it with its tick of passing the next point, and the two
    neighbours that pass first."""
    if not len(s.order):
        return
    place, own = positions_now(k), np.asarray(k.queue.certificate)
    foot = float(place[:, 1].min()) - 1.0
    yield Segment("axis", (float(place[:, 0].min()), foot), (float(place[:, 0].max()), foot), label="x")
    for rank, point in enumerate(s.order.tolist()):
        label = f"place {rank + 1} of {len(s.order)}"
        yield Segment("bound", (At(point), foot), (At(point), At(point)), int(own[point]), label)
    first = int(own.argmin())
    if own[first] != NEVER:
        other = int(s.order[s.rank[first] + 1])
        yield Segment("certificate", (At(first), foot), (At(other), foot), int(own[first]), "pass")


class SortedList:
    """Points on a line, kept in order while they move."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        """Returns the parts."""
        n = len(scene)
        state = State(order=np.zeros(n, dtype=np.int32), rank=np.zeros(n, dtype=np.int32))
        return BroadPhaseParts(near, state, build, repair, replan, arrange, draw=draw)


class Plugin:
    """The plugin that a package would export through its entry point."""

    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        """Registers the structure."""
        return [kt.BroadPhaseSpec("sorted-list", SortedList, "points on a line, kept in order")]


def main() -> None:
    """Follows six points for a while; one of them turns on the way."""
    if "sorted-list" not in kt.registry().names("broad phase"):
        kt.registry().add(Plugin())
    x = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    speed = np.array([2.0, -0.5, 1.0, 0.25, -1.0, -0.125])
    lanes = np.arange(6.0)  # each point on a lane of its own: a scene is made of disjoint bodies
    scene = kt.Scene(
        position=np.column_stack([x, lanes]), velocity=np.column_stack([speed, np.zeros(6)]), radius=0.25
    )
    points = kt.Simulation(scene, broad_phase="sorted-list", narrow_phases=[])
    for time in (0.5, 1.0, 2.0, 4.0):
        points.run(until=time)
        print(f"at {time:4}: {points.state.order.tolist()} after {points.readings.structural_events} events")
    points.set_velocity(0, (-4.0, 0.0))
    points.run(until=8.0)
    print(f"at  8.0: {points.state.order.tolist()} after {points.readings.structural_events} events")


if __name__ == "__main__":
    main()
