"""Brick-breaker: a ball, a moving paddle, and bricks; a hit brick is removed.

``python docs/examples/brick_breaker.py [FILE]`` plays a game to its end, and saves the recording as a scene:
``docs/scenes/brick-breaker.toml`` is one. The game adds a rule and a player. At the paddle the ball's speed
becomes 2, and the place of the hit decides its direction. The player moves to the place where the ball will
come down, and aims at a brick.
"""

from __future__ import annotations

import math
import sys

import kinetile as kt

BALL, PADDLE, SPEED = 0, 1, 2.0
BRICKS = [(1.0 + column, 6.0 - 0.5 * row) for row in range(3) for column in range(7)]
ROOM = kt.Scene(
    position=[(4.0, 1.0), (4.0, 0.5), (0.0, 0.0), (8.0, 0.0), (0.0, 7.0), *BRICKS],
    velocity=[(0.5, 1.5), *[(0.0, 0.0)] * (4 + len(BRICKS))],
    mass=[1.0, *[math.inf] * (4 + len(BRICKS))],
    shape=[0, 1, 2, 2, 3, *[4] * len(BRICKS)],
    shapes=[
        kt.disc(0.125),
        kt.capsule((-0.5, 0.0), (0.5, 0.0), 0.125),
        kt.segment((0.0, 0.0), (0.0, 7.0)),
        kt.segment((0.0, 0.0), (8.0, 0.0)),
        kt.box(1.0, 0.5),
    ],
    kind=["ball", "paddle", "side", "side", "side", *["brick"] * len(BRICKS)],
)


def coming_down(x: float, level: float, vx: float, vy: float, y: float) -> tuple[float, float]:
    """Returns the place where the ball reaches the paddle, mirrored at the sides, and the time until then."""
    wait = (y - level - 0.25) / -vy
    x = abs(x + wait * vx - 0.125) + 0.125
    return 7.875 - abs(7.875 - x), wait


def play(phase: str = "cells") -> kt.Simulation:
    """Returns the simulation of a game, after its end."""
    sim = kt.Simulation(ROOM, phase, live=True)
    while met := sim.run(until=120.0, stop_at=kt.StopAt(bodies=[BALL])).event:
        other = max(met.bodies)
        (x, y), (at, level) = sim.positions()[:2].tolist()
        vx, vy = sim.velocities()[BALL].tolist()
        if other == PADDLE:
            vx = 2 * (x - at)
            vy = math.sqrt(SPEED**2 - vx * vx)
            sim.set_velocity(BALL, (vx, vy))
        elif sim.kinds_of(other) == "brick":
            sim.remove(other)
            if "brick" not in sim.kinds:
                break
        speed = 0.0
        if vy < 0:
            x, wait = coming_down(x, level, vx, vy, y)
            right, up = (sim.positions()[-1] - (x, level)).tolist()  # to the last brick
            aim = max(-0.625, min(right / math.sqrt(right * right + up * up), 0.625))
            speed = (max(0.625, min(x - aim, 7.375)) - at) / wait
        sim.set_velocity(PADDLE, (speed, 0.0))
    return sim


if __name__ == "__main__":
    played = play()
    print(f"all bricks in {played.time:.1f} units of time, {len(played.contacts)} contacts")
    if len(sys.argv) > 1:
        kt.save_scene(played.recorded(), sys.argv[1])
