"""A game without graphics: 1,000 discs and boxes in a level of polygons, bullets, coins, debris, and rewind.

``python docs/examples/game.py`` plays 600 frames under two phases and compares the fingerprints. A hero heads
for the nearest coin, which disappears at a touch, and shoots: bullets pass through balls, and end at rocks
and crates; crates burst. Sensors of four shapes report the bodies in them, and for how long. Every hundred
frames the game goes back by twenty frames and plays them again, to the same contacts.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
from collections import Counter, deque
from contextlib import suppress
from typing import Any

import numpy as np

import kinetile as kt
from kinetile.errors import Refused

FRAME, WIDTH, HEIGHT = 1 / 60, 48, 30
BULLET, BALL, COIN, CRATE = kt.disc(0.0625), kt.disc(0.25), kt.disc(0.125), kt.box(0.5, 0.375)
PIECES = [kt.box(0.125, 0.0625), kt.polygon([(-0.0625, -0.0625), (0.0625, -0.0625), (0.0, 0.0625)])]
AROUND = np.array([(x, y) for x in (-0.1875, -0.0625, 0.0625, 0.1875) for y in (-0.09375, 0.09375)])
ROCK = kt.polygon([(0.8, 0.0), (0.4, 0.7), (-0.4, 0.7), (-0.8, 0.0), (-0.4, -0.7), (0.4, -0.7)], 0.125)
ROCKS = [(x, y) for x in range(4, WIDTH, 8) for y in range(7, HEIGHT, 8)]
HILLS = kt.polyline([(x, 1.0 + 0.75 * (x // 2 % 2)) for x in range(0, WIDTH + 1, 2)], kind="rock")
SENSORS = [kt.disc(2.0), kt.box(5.0, 2.0), kt.capsule((-2.0, 0.0), (2.0, 1.0), 0.75)]
SENSORS += [kt.polygon([(-2.0, -1.5), (2.5, -1.0), (0.0, 2.0)])]
RULES = {("*", "sensor"): "pass", ("*", "coin"): "pass", ("bullet", "ball"): "pass"}


def level(bodies: int, seed: int) -> kt.Scene:
    """Returns the start: the hero, balls and crates, coins, sensors, rocks, and hills at the bottom."""
    rng = random.Random(seed)
    free = [(x + 0.5, y + 0.5) for x in range(1, WIDTH - 1) for y in range(3, HEIGHT - 1)]
    free = [place for place in free if min(math.dist(place, rock) for rock in ROCKS) > 1.5]
    rng.shuffle(free)
    rows: list[tuple[Any, ...]] = [("hero", kt.disc(0.375), free.pop(), 20.0)]
    rows += [(("ball", BALL), ("crate", CRATE))[k % 2] + (free.pop(), 1.0) for k in range(bodies)]
    rows += [("coin", COIN, free.pop(), math.inf) for _ in range(40)]
    rows += [
        ("sensor", shape, (9.0 + 10.0 * k, 9.0 + 15.0 * (k % 2)), math.inf) for k, shape in enumerate(SENSORS)
    ]
    rows += [("rock", ROCK, place, math.inf) for place in ROCKS]
    kind, shape, position, mass = zip(*rows, strict=True)
    velocity = [(rng.uniform(-2, 2), rng.uniform(-2, 2)) if each == 1.0 else (0.0, 0.0) for each in mass]
    shapes, kinds = [*dict.fromkeys([*shape, BULLET, *PIECES])], [*dict.fromkeys([*kind, "bullet", "debris"])]
    forms, arena = [shapes.index(each) for each in shape], (WIDTH, HEIGHT)
    rules: Any = {"kind": kind, "kinds": kinds, "responses": RULES, "unit": 2.0**-6}
    scene = kt.Scene(position, velocity, None, mass, arena, shape=forms, shapes=shapes, **rules)
    return kt.with_obstacles(scene, HILLS)


class Game:
    """A simulation and the further state of the game; body 0 is the hero."""

    def __init__(self, scene: kt.Scene, phase: str, seed: int) -> None:
        self.sim, self.seed = kt.Simulation(scene, phase, live=True, room=2 * len(scene)), seed
        self.forms = [scene.shapes[each].kind for each in scene.shape]
        self.counts: Counter[str] = Counter()  # of all happenings, and of contacts seen
        self.debris: dict[int, int] = {}  # the last frame of each piece
        self.within: dict[tuple[int, int], float] = {}  # the time at which a body entered a sensor
        self.before: deque[Any] = deque(maxlen=20)

    def play(self) -> None:
        """Plays the next frame."""
        sim, counts, frame = self.sim, self.counts, self.counts["frames"]
        self.before.append((sim.snapshot(), (counts.copy(), self.debris.copy(), self.within.copy())))
        rng = random.Random(f"{self.seed} {frame}")  # the same orders when the frame is played again
        hero = sim.positions()[0]
        for coin in sim.bodies_near(hero, k=1, kinds="coin") if frame % 5 == 0 else ():
            ahead = sim.positions()[sim.bodies == coin][0] - hero
            sim.set_velocity(0, 8.0 * ahead / math.sqrt((ahead * ahead).sum()))
        with suppress(Refused):  # a body is in the way
            way = direction(rng)
            sim.insert(hero + 0.4375 * way, 15.0 * way, shape=BULLET, mass=0.125, kind="bullet")
            counts["bullets"] += 1
        counts["frames"] += 1
        while hit := sim.run(until=counts["frames"] * FRAME, stop_at=kt.StopAt(kinds=["bullet"])).event:
            of = dict(zip(hit.kinds, hit.bodies, strict=True))
            if {*of} & {"rock", "wall", "crate"}:  # at this very tick, not at the end of the frame
                sim.remove(of["bullet"])
                if "crate" in of:
                    self.burst(of["crate"], rng)
        news = sim.contacts_since(counts["contacts"])
        counts["contacts"] += len(news)
        gone = {body for body, until in self.debris.items() if until <= counts["frames"]}
        kinds = zip(sim.kinds_of(news["a"]).tolist(), sim.kinds_of(news["b"]).tolist(), strict=True)
        for (at, _, _, a, b), two in zip(news.tolist(), kinds, strict=True):
            if "sensor" in two and a < b:
                self.within[a, b] = at
                counts[f"in the {self.forms[a if two[0] == 'sensor' else b]}"] += 1
            elif "sensor" in two:
                counts["seconds in sensors"] += at - self.within.pop((b, a))
            elif {*two} == {"hero", "coin"} and a < b:  # once: the end comes with the removal
                counts["coins"] += 1
                gone.add(b)
        for body in sorted(gone):
            sim.remove(body)
            self.debris.pop(body, None)

    def burst(self, crate: int, rng: random.Random) -> None:
        """Replaces a crate by up to eight pieces, as many as have room."""
        place = self.sim.positions()[self.sim.bodies == crate][0]
        self.sim.remove(crate)
        flies = [3.0 * direction(rng) for _ in AROUND]
        made = self.sim.insert_many(place + AROUND, flies, shape=PIECES * 4, mass=0.125, kind="debris")
        pieces = made.numbers[~made.refused].tolist()
        self.debris |= dict.fromkeys(pieces, self.counts["frames"] + 60)
        self.counts["pieces"] += len(pieces)

    def rewind(self) -> None:
        """Goes back by twenty frames."""
        snapshot, (self.counts, self.debris, self.within) = self.before[0]
        self.sim.restore(snapshot)
        self.before.clear()


def direction(rng: random.Random) -> Any:
    """Returns a vector of length 1, by operations that round alike on all machines."""
    x, y = rng.uniform(-1, 1), rng.uniform(-1, 1)
    return np.array([x, y]) / math.sqrt(x * x + y * y)


def main(words: list[str] | None = None) -> int:
    """Plays the game under each phase; returns 1 if a fingerprint differs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    for name, default in {"frames": 600, "bodies": 1000, "seed": 1, "phases": "cells,sap-1d"}.items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    wish = parser.parse_args(words)
    scene, found = level(wish.bodies, wish.seed), set()
    for phase in wish.phases.split(","):
        game, spent, was = Game(scene, phase, wish.seed), [], dict[int, str]()
        while (frame := game.counts["frames"]) < wish.frames:
            if frame % 100 == 50 and frame not in was:
                was[frame] = game.sim.fingerprint
                game.rewind()
            began = time.thread_time()
            game.play()
            spent.append(1000.0 * (time.thread_time() - began))
            assert was.get(game.counts["frames"], game.sim.fingerprint) == game.sim.fingerprint, "rewound"
        found.add(game.sim.fingerprint)
        costs = sorted(spent[3:])  # the first frames load the loop
        median, worst, there = costs[len(costs) // 2], costs[len(costs) * 99 // 100], len(game.sim.bodies)
        print(f"{phase}: median {median:.2f} ms, p99 {worst:.2f} ms, {there} bodies, {game.sim.fingerprint}")
    print(", ".join(f"{name}: {count:.6g}" for name, count in sorted(game.counts.items())))
    print("one fingerprint" if len(found) == 1 else f"DIFFERENT: {', '.join(sorted(found))}")
    return int(len(found) != 1)


if __name__ == "__main__":
    sys.exit(main())
