"""An environment for learning: a mallet keeps a puck from the left wall, and plays it to the right one.

It has the methods of gymnasium's interface, ``reset`` and ``step``, with their arguments and results, and
needs no gymnasium: ``class Hockey(gymnasium.Env)`` with two spaces is all that this would add. An episode
begins at a drawn start without a scene being made: the first snapshot is restored, and bodies are moved.

``python docs/examples/environment.py`` plays episodes, plays one of them again under another broad phase,
and says what a reset and a step take.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

import numpy as np
import numpy.typing as npt

import kinetile as kt

MALLET, PUCK = 0, 1
LEFT, RIGHT = -1, -2
WIDTH, HEIGHT = 2.0, 1.0

Observation = npt.NDArray[np.float32]
Policy = Callable[[Observation], Sequence[float]]


class Hockey:
    """The table. An action is the velocity of the mallet, (2,), each from -2 to 2; an observation has places
    and velocities of mallet and puck, (8,). A hit of the right wall is worth 1; one of the left ends the
    episode at -1, and so do ``longest`` steps, truncated."""

    def __init__(self, phase: str = "cells", frame: float = 1 / 30, longest: int = 300) -> None:
        table = kt.Scene(
            [[0.5, 0.5], [1.5, 0.5]],
            [[0.0, 0.0], [0.0, 0.0]],
            radius=[0.1, 0.05],
            mass=[20.0, 1.0],  # a mallet of finite mass squeezes no puck against a wall
            arena=(WIDTH, HEIGHT),
            kind=["mallet", "puck"],
            responses={("mallet", "wall"): "stop"},  # held against a wall it stays there
        )
        self.sim = kt.Simulation(table, phase, live=True)
        self.frame, self.longest, self.steps = frame, longest, 0
        for velocity in ((2.0, 2.0), (0.0, 0.0)):  # else each reset would make room for that speed again
            self.sim.set_velocity(MALLET, velocity)
        self._start = self.sim.snapshot()
        self._random = np.random.default_rng()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begins an episode: the puck flies to the left from somewhere in the right half."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        x, y, up = self._random.uniform((1.2, 0.1, -0.5), (1.9, 0.9, 0.5)).tolist()
        self.sim.restore(self._start)
        self.sim.set_position(PUCK, (x, y))
        self.sim.set_velocity(PUCK, (-1.0, up))
        self.steps = 0
        return self._observed(), {}

    def step(self, action: Sequence[float]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Steers the mallet and plays a frame; returns the observation, the reward, whether the episode has
        terminated or is truncated, and the contacts of the frame."""
        before = self.sim.readings.contacts
        self.sim.set_velocity(MALLET, np.clip(np.asarray(action, np.float64), -2.0, 2.0))
        self.steps += 1
        self.sim.run(until=self.steps * self.frame)
        news = self.sim.contacts_since(before)
        hit = news["b"][news["a"] == PUCK]
        lost = bool((hit == LEFT).any())
        reward = float((hit == RIGHT).sum()) - lost
        return self._observed(), reward, lost, self.steps >= self.longest, {"contacts": news}

    def _observed(self) -> Observation:
        both = np.concatenate([self.sim.positions(), self.sim.velocities()])
        return both.ravel().astype(np.float32)


def follow(seen: Observation) -> Sequence[float]:
    """Goes where the puck is, and forth when it is near: a policy to begin with."""
    x, y, to_x, to_y = seen[:4].tolist()
    return (2.0 if to_x - x < 0.4 else 4.0 * (0.4 - x), 8.0 * (to_y - y))


def play(env: Hockey, policy: Policy, seed: int | None) -> float:
    """Plays an episode; returns the sum of its rewards."""
    seen, _ = env.reset(seed=seed)
    score, over = 0.0, False
    while not over:
        seen, reward, terminated, truncated, _ = env.step(policy(seen))
        score, over = score + reward, terminated or truncated
    return score


def milliseconds(call: Callable[[], object], times: int = 101) -> float:
    """Returns the median CPU time of a call."""
    taken = []
    for _ in range(times):
        before = time.process_time_ns()
        call()
        taken.append(time.process_time_ns() - before)
    return median(taken) / 1e6


def main(words: list[str] | None = None) -> int:
    """Plays episodes; returns 1 unless the last is the same, to the bit, in another environment."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--longest", type=int, default=300)
    parser.add_argument("--phases", default="cells,sap-1d")
    wish = parser.parse_args(words)
    env, other = (Hockey(phase, longest=wish.longest) for phase in wish.phases.split(","))
    scores = [play(env, follow, seed) for seed in range(wish.episodes)]
    same = play(other, follow, wish.episodes - 1) == scores[-1]
    same = same and other.sim.fingerprint == env.sim.fingerprint
    print(f"{wish.episodes} episodes, mean score {np.mean(scores):.2f}, the last one again: {same}")
    reset, step = milliseconds(env.reset), milliseconds(lambda: env.step((0.0, 0.0)))
    print(f"CPU milliseconds: reset {reset:.3f}, step {step:.3f}")
    return int(not same)


if __name__ == "__main__":
    sys.exit(main())
