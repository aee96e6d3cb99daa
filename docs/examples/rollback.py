"""Rollback: when late orders arrive, the game goes back and ends with the same bits.

``python docs/examples/rollback.py --frames 10000`` plays one game under several phases, once with all orders
in time, once with orders up to eight frames late, and compares the fingerprints.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from statistics import median
from typing import Any

import kinetile as kt
from kinetile.errors import Refused

Order = tuple[Any, ...]
"""A call on a simulation: the name of a method, and its arguments."""

FRAME = 1 / 60
LATEST = 8
"""The greatest delay of orders, in frames."""


class Game:
    """A simulation, and the orders of all frames so far that have arrived."""

    def __init__(self, scene: kt.Scene, phase: str) -> None:
        self.sim = kt.Simulation(scene, phase, live=True, keep_contacts=False)
        self.orders: list[Sequence[Order]] = []
        self.before: deque[kt.Snapshot] = deque(maxlen=LATEST + 1)

    def play(self, orders: Sequence[Order]) -> None:
        """Plays the next frame."""
        self.before.append(self.sim.snapshot())
        self.orders.append(orders)
        for method, *arguments in orders:
            with suppress(Refused):  # no room for an inserted body, on any machine
                getattr(self.sim, method)(*arguments)
        self.sim.run(until=len(self.orders) * FRAME)

    def correct(self, frame: int, orders: Sequence[Order]) -> None:
        """Gives an earlier frame its orders, and replays it and all later frames."""
        again = [orders, *self.orders[frame + 1 :]]
        self.sim.restore(self.before[-len(again)])
        for _ in again:
            self.before.pop()
            self.orders.pop()
        for each in again:
            self.play(each)


def draw_orders(scene: kt.Scene, frames: int, seed: int) -> list[list[Order]]:
    """Returns the orders of each frame: they turn and remove initial bodies, and insert others."""
    rng = random.Random(seed)
    there: list[int] = list(range(len(scene)))
    width, height = scene.arena or (1.0, 1.0)
    drawn: list[list[Order]] = []
    for _ in range(frames):
        orders: list[Order] = []
        for _ in range(rng.randrange(3)):
            orders.append(("set_velocity", rng.choice(there), (rng.uniform(-1, 1), rng.uniform(-1, 1))))
        if rng.random() < 0.1 and len(there) > len(scene) // 2:
            orders.append(("remove", there.pop(rng.randrange(len(there)))))
        if rng.random() < 0.1:
            place = (rng.uniform(0.1, 0.9) * width, rng.uniform(0.1, 0.9) * height)
            orders.append(("insert", place, (rng.uniform(-1, 1), 0.0), 0.5 * float(scene.radius.min())))
        drawn.append(orders)
    return drawn


def play_late(game: Game, drawn: Sequence[Sequence[Order]], seed: int) -> int:
    """Plays a game with late orders; returns the number of times it went back."""
    rng = random.Random(seed)
    coming: dict[int, list[int]] = {}
    for frame, orders in enumerate(drawn):
        if orders:
            late = min(frame + rng.randrange(LATEST + 1), len(drawn) - 1)
            coming.setdefault(late, []).append(frame)
    back = 0
    for now in range(len(drawn)):
        come = coming.get(now, [])
        for frame in come:
            if frame < now:
                game.correct(frame, drawn[frame])
                back += 1
        game.play(drawn[now] if now in come else [])
    return back


def microseconds(call: Any, times: int = 301) -> float:
    """Returns the median CPU time of a call."""
    taken = []
    for _ in range(times):
        before = time.process_time_ns()
        call()
        taken.append(time.process_time_ns() - before)
    return median(taken) / 1000.0


def main(words: list[str] | None = None) -> int:
    """Plays the game under each phase with and without delay; returns 1 if a fingerprint differs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=600)
    parser.add_argument("--bodies", type=int, default=100)
    parser.add_argument("--phases", default="cells,sap-1d,sweep-tiling")
    parser.add_argument("--seed", type=int, default=1)
    wish = parser.parse_args(words)
    scene = kt.make_scene("random", bodies=wish.bodies, density=0.2, seed=wish.seed)
    drawn = draw_orders(scene, wish.frames, wish.seed)
    found = set()
    for phase in wish.phases.split(","):
        in_time, late = Game(scene, phase), Game(scene, phase)
        for orders in drawn:
            in_time.play(orders)
        back = play_late(late, drawn, wish.seed)
        found |= {in_time.sim.fingerprint, late.sim.fingerprint}
        there = late.sim.snapshot()
        print(
            f"{phase:13} {wish.frames} frames, {back} times back: {late.sim.fingerprint[:16]}, in time "
            f"{in_time.sim.fingerprint[:16]}; snapshot {microseconds(late.sim.snapshot):.0f} us, restore "
            f"{microseconds(lambda: late.sim.restore(there)):.0f} us"  # noqa: B023
        )
    print("one fingerprint" if len(found) == 1 else f"DIFFERENT: {', '.join(sorted(found))}")
    return int(len(found) != 1)


if __name__ == "__main__":
    sys.exit(main())
