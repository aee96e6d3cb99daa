"""The dynamically sorted list: a kinetic data structure that has nothing to do with collisions.

Points move on a line at constant speeds, and their order from left to right is to be known at any time
(thesis, section 2, figure 5). The attribute is the order. The proof is one certificate for each two
neighbours: the left point is not right of the right one. When it fails, the two change places, and the
certificates around them are made anew.

This is the whole of it, written against the same protocol as every broad phase: ``kinetile.toolbox`` and one
class.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import BroadPhaseParts, Kernel, Records, falls, hook, positions_now, schedule


class State(NamedTuple):
    """The attribute: ``order[i]`` is the i-th point from the left, ``rank[p]`` is where point p stands."""

    order: Records
    rank: Records


def arrange(k: Kernel, s: State) -> None:
    """Sort the points once, at the start; of two points at one place, the slower is left a moment later."""
    s.order[:] = np.lexsort((k.bodies.vx, positions_now(k)[:, 0]))
    s.rank[s.order] = np.arange(len(s.order))


@hook
def assert_order(k: Kernel, s: State, c: int) -> None:
    """Certificate c says that the c-th point from the left is not right of the next; say when that fails."""
    p = k.bodies[s.order[c]]
    q = k.bodies[s.order[c + 1]]
    since = max(p.anchor, q.anchor)
    tick = k.clock[0].tick
    gap = (q.x + q.vx * ((since - q.anchor) * tick)) - (p.x + p.vx * ((since - p.anchor) * tick))
    schedule(k, c, falls(k, since, gap, q.vx - p.vx))


@hook
def build(k: Kernel, s: State) -> None:
    """Assert the order of all neighbours."""
    for c in range(len(s.order) - 1):
        assert_order(k, s, c)


@hook
def repair(k: Kernel, s: State, c: int) -> None:
    """Point p passes point q: exchange them and assert the order around them."""
    p, q = s.order[c], s.order[c + 1]
    s.order[c], s.order[c + 1] = q, p
    s.rank[q], s.rank[p] = c, c + 1
    for near in range(max(c - 1, 0), min(c + 2, len(s.order) - 1)):
        assert_order(k, s, near)


@hook
def replan(k: Kernel, s: State, point: int) -> None:
    """A point changed its speed: only the certificates with its two neighbours depend on it."""
    for c in range(max(s.rank[point] - 1, 0), min(s.rank[point] + 1, len(s.order) - 1)):
        assert_order(k, s, c)


class SortedList:
    """Points on a line, kept in order while they move."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        """Return the parts: n points, n - 1 certificates."""
        n = len(scene)
        state = State(order=np.zeros(n, dtype=np.int32), rank=np.zeros(n, dtype=np.int32))
        return BroadPhaseParts(state, max(n - 1, 0), build, repair, replan, arrange)


class Plugin:
    """What a package would export through its entry point."""

    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        """Name the structure."""
        return [kt.BroadPhaseSpec("sorted-list", SortedList, "points on a line, kept in order")]


def main() -> None:
    """Follow six points for a while; one of them turns on the way."""
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
