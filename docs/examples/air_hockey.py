"""Air hockey as an environment for learning: goals are sensors, and each frame steers two paddles.

``python docs/examples/air_hockey.py`` plays 16 games at once and prints the cost of a step and a reset. Both
have the arguments and results of gymnasium's methods, without gymnasium; only two spaces are missing in a
``class AirHockey(gymnasium.Env)``. A reset makes no scene: it restores a snapshot and moves the puck. A puck
that a paddle squeezes against a wall returns to the middle.
"""

from __future__ import annotations

import math
import random
import time
from typing import Any

import numpy as np

import kinetile as kt

FRAME, PUCK, PADDLES = 1 / 60, 0, [1, 2]
LEAST = np.array([(0.12, 0.12), (1.17, 0.12)])  # limits of paddles: the middle stays free for the puck
MOST = np.array([(0.83, 0.88), (1.88, 0.88)])
TABLE = kt.Scene(
    position=[(1.0, 0.5), (0.3, 0.5), (1.7, 0.5), (0.06, 0.5), (1.94, 0.5)],
    velocity=[(0.0, 0.0)] * 5,
    radius=[0.05, 0.1, 0.1, 0.05, 0.05],
    mass=[1.0] + [math.inf] * 4,
    arena=(2.0, 1.0),
    kind=["puck", "paddle", "paddle", "goal", "goal"],
    responses={("*", "goal"): "pass"},
)


class AirHockey:
    """One game for two players; an action is the velocity of each paddle, (2, 2), at most 3 along an axis."""

    def __init__(self, seed: int) -> None:
        self.sim = kt.Simulation(TABLE, "cells", live=True, keep_contacts=False, keep_commands=False)
        for fast in (3.0, 0.0):  # otherwise each reset would prepare for that speed again
            self.sim.set_velocities([PUCK, *PADDLES], (fast, fast))
        self.start, self.rng, self.reward, self.jams = self.sim.snapshot(), random.Random(seed), 0, 0

    def observe(self) -> Any:
        """Returns places and velocities of puck and paddles, (3, 4)."""
        return np.hstack([self.sim.positions()[:3], self.sim.velocities()[:3]])

    def serve(self) -> None:
        """Puts the puck into the middle, with a new random velocity."""
        self.sim.set_position(PUCK, (1.0, 0.5))
        self.sim.set_velocity(PUCK, (self.rng.choice((-1.0, 1.0)), self.rng.uniform(-1.0, 1.0)))

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        """Begins a new game."""
        self.rng = self.rng if seed is None else random.Random(seed)
        self.sim.restore(self.start)
        self.serve()
        return self.observe(), {}

    def step(self, action: Any) -> tuple[Any, int, bool, bool, dict[str, Any]]:
        """Plays a frame; the reward is 1 for a goal of the left player, -1 for one of the right player."""
        place, self.reward = self.sim.positions()[PADDLES], 0
        to = np.clip(place + np.clip(action, -3.0, 3.0) * FRAME, LEAST, MOST)
        self.sim.set_velocities(PADDLES, (to - place) / FRAME)
        until = self.sim.time + FRAME
        self.sim.run(until=until, on_contact={("puck", "goal"): self.score}, on_jam=self.release)
        return self.observe(), self.reward, self.reward != 0, self.sim.time > 60.0, {}

    def score(self, event: kt.Event) -> bool:
        """Ends the frame and the game at the tick of the goal."""
        self.reward = 1 if 4 in event.bodies else -1
        return True

    def release(self, _jam: object) -> None:
        """Serves again after a jam."""
        self.jams += 1
        self.serve()


def play(games: int = 16, frames: int = 600) -> list[AirHockey]:
    """Returns games whose players both move to the puck."""
    tables, goals = [AirHockey(seed) for seed in range(games)], [0, 0]
    views = [table.reset()[0] for table in tables]
    for _ in range(frames):
        for at, table in enumerate(tables):
            view, reward, ended, late, _ = table.step(5.0 * (views[at][0, :2] - views[at][1:, :2]))
            goals[reward < 0] += reward != 0
            views[at] = table.reset()[0] if ended or late else view
    print(f"goals {goals[0]}:{goals[1]}, {sum(table.jams for table in tables)} squeezes")
    return tables


if __name__ == "__main__":
    (table,) = play(1, 3)  # compiles the loop
    times = [time.process_time()]
    play()
    times.append(time.process_time())
    for _ in range(1000):
        table.reset()
    times.append(time.process_time())
    step, reset = 1e6 * (times[1] - times[0]) / 9600, times[2] - times[1]
    print(f"CPU time: {step:.0f} microseconds a step, {reset:.2f} milliseconds a reset")
