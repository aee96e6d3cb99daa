"""The closest pair of moving points: a kinetic tournament of pairs, not a broad phase.

All pairs of points compete. Number v of the tournament's tree is the closer of the winners of 2 v and
2 v + 1, so number 1 is the closest of all pairs. The proof is one certificate for each comparison: the
winner's distance is not greater than the loser's. Squared distances are quadratic in time, and so is their
difference: the certificate is of degree 2 (``falls_bent``). There are more comparisons than points, so each
point keeps some of them, and awaits the first that fails (``set_due``).

    $ python docs/examples/closest_pair.py
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import kinetile as kt
from kinetile.toolbox import (
    NEVER,
    BroadPhaseParts,
    Kernel,
    Records,
    falls_bent,
    first_due,
    hook,
    no_dues,
    position_at,
    set_due,
)


class State(NamedTuple):
    """Pair i consists of ``one[i]`` and ``other[i]``. ``winner[v]`` is a pair; the last half are all pairs.
    ``due`` has the ticks of the certificates: of n points, point v % n keeps comparison v, as number v // n.
    """

    one: Records
    other: Records
    winner: Records
    due: Records


def arrange(k: Kernel, s: State) -> None:
    """Schedules nothing: no comparison is made yet."""
    s.due[:] = NEVER


@hook
def near(k: Kernel, s: State, point: int) -> int:
    """No body is near another: the points do not collide."""
    return 0


@hook
def square(k: Kernel, s: State, pair: int, since: int) -> tuple[float, float, float]:
    """Returns the square of a distance at a tick, with its first and second derivatives."""
    one = k.bodies[s.one[pair]]
    other = k.bodies[s.other[pair]]
    x, y = position_at(k, one, since)
    x2, y2 = position_at(k, other, since)
    x, y, vx, vy = x2 - x, y2 - y, other.vx - one.vx, other.vy - one.vy
    return x * x + y * y, 2.0 * (x * vx + y * vy), 2.0 * (vx * vx + vy * vy)


@hook
def anchored(k: Kernel, s: State, pair: int) -> int:
    """Returns the later anchor of the two points of a pair."""
    return max(k.bodies[s.one[pair]].anchor, k.bodies[s.other[pair]].anchor)


@hook
def compare(k: Kernel, s: State, v: int) -> None:
    """Decides a comparison, and schedules its failure. The winner of a tie stays."""
    won, lost = s.winner[2 * v], s.winner[2 * v + 1]
    if s.winner[v] == lost:
        won, lost = lost, won
    since = max(anchored(k, s, won), anchored(k, s, lost))
    gap, rate, bend = square(k, s, won, since)
    gap2, rate2, bend2 = square(k, s, lost, since)
    tick = falls_bent(k, since, gap2 - gap, rate2 - rate, bend2 - bend)
    if tick == k.clock[0].now:
        won = lost
        tick = falls_bent(k, since, gap - gap2, rate - rate2, bend - bend2)
    s.winner[v] = won
    points = len(s.due)
    set_due(k, s.due, v % points, v // points, tick)


@hook
def compare_up(k: Kernel, s: State, v: int) -> None:
    """Makes a comparison, and all others above it in the tree."""
    while v > 0:
        compare(k, s, v)
        v //= 2


@hook
def build(k: Kernel, s: State) -> None:
    """Makes all comparisons, from the pairs up."""
    for v in range(len(s.one) - 1, 0, -1):
        compare(k, s, v)


@hook
def repair(k: Kernel, s: State, point: int) -> int:
    """Repairs the first failing certificate of a point: its comparison has another winner."""
    compare_up(k, s, first_due(s.due, point) * len(s.due) + point)
    return 0


@hook
def replan(k: Kernel, s: State, point: int) -> None:
    """Makes all comparisons of a point's pairs again: it has another motion from now on."""
    for pair in range(len(s.one)):
        if s.one[pair] == point or s.other[pair] == point:
            compare_up(k, s, (len(s.one) + pair) // 2)


class ClosestPair:
    """The closest pair of points, kept while they move."""

    def prepare(self, scene: kt.Scene) -> BroadPhaseParts:
        """Returns the parts; all pairs are made here, once."""
        n = len(scene)
        if n < 2:
            raise kt.errors.Refused("the closest pair is one of at least two points")
        one, other = np.triu_indices(n, 1)
        pairs = np.arange(len(one))
        state = State(one, other, np.append(pairs, pairs), no_dues(n, len(one) // n + 1))
        return BroadPhaseParts(near, state, build, repair, replan, arrange, ticks=(state.due,))


class Plugin:
    """The plugin that a package would export through its entry point."""

    @kt.hookimpl
    def kinetile_broad_phases(self) -> list[kt.BroadPhaseSpec]:
        """Registers the structure."""
        return [kt.BroadPhaseSpec("closest-pair", ClosestPair, "the closest pair of moving points")]


def closest(points: kt.Simulation) -> tuple[int, int]:
    """Returns the closest pair."""
    s = points.state
    return int(s.one[s.winner[1]]), int(s.other[s.winner[1]])


def main() -> None:
    """Prints each closest pair of eight points; one of them turns on the way."""
    if "closest-pair" not in kt.registry().names("broad phase"):
        kt.registry().add(Plugin())
    rng = np.random.default_rng(2)
    scene = kt.Scene(
        position=rng.uniform(-4.0, 4.0, (8, 2)), velocity=rng.uniform(-1.0, 1.0, (8, 2)), radius=2.0**-10
    )
    points = kt.Simulation(scene, broad_phase="closest-pair", narrow_phases=[])
    pair = None
    for until in (0.0, 2.0, 6.0):
        while pair is None or points.time < until:
            points.run(until=until, max_events=1)
            if closest(points) != pair:
                pair = closest(points)
                print(f"{points.time:.6f}: {pair}")
        if until == 2.0:
            points.set_velocity(pair[0], (0.0, 0.0))
    print(f"{points.time:.6f}: {points.readings.structural_events} certificates have failed")


if __name__ == "__main__":
    main()
