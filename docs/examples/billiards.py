"""Billiards: the cloth slows balls down, pockets remove them, and a shot ends when all balls rest.

``python docs/examples/billiards.py`` plays shots at a rack of ten until nine balls are off the table, or ten
shots. Deceleration is opposite to the velocity, so it is set again after each contact; between two contacts
the path is a line, and the ball's stopping time is known.
"""

from __future__ import annotations

import math

import kinetile as kt

RADIUS, CLOTH, CUE = 0.03, 0.25, 0
POCKETS = [(x, y) for x in (0.03, 1.0, 1.97) for y in (0.03, 0.97)]
RACK = [(1.4 + 0.06 * row, 0.5 + 0.0325 * (2 * k - row)) for row in range(4) for k in range(row + 1)]


def table() -> kt.Scene:
    """Returns the cue ball, ten balls and six pockets."""
    return kt.Scene(
        [(0.5, 0.5), *RACK, *POCKETS],
        [(0.0, 0.0)] * 17,
        [RADIUS] * 17,
        [1.0] * 11 + [math.inf] * 6,
        (2.0, 1.0),
        kind=["ball"] * 11 + ["pocket"] * 6,
        responses={
            ("ball", "pocket"): "pass",
            ("ball", "ball"): kt.Response("restitution", e=0.95, contact_time=1e-6),
        },
    )


class Table:
    """A table, and the stopping times of its moving balls."""

    def __init__(self, phase: str = "cells") -> None:
        self.sim = kt.Simulation(table(), phase, live=True)
        self.stops: dict[int, float] = {}
        self.calls = {("ball", "ball"): self.hit, ("ball", "wall"): self.hit, ("ball", "pocket"): self.take}

    def shoot(self, velocity: tuple[float, float]) -> None:
        """Plays a shot until all balls rest."""
        sim = self.sim
        if CUE not in sim.bodies:
            return
        sim.set_velocity(CUE, velocity)
        self.brake(CUE)
        while self.stops:
            sim.run(until=min(self.stops.values()), on_contact=self.calls)
            for ball in [ball for ball, stop in self.stops.items() if stop <= sim.time]:
                sim.set_velocity(ball, (0.0, 0.0))
                self.brake(ball)

    def brake(self, ball: int) -> None:
        """Slows a ball down along its path."""
        vx, vy = self.sim.velocities()[self.sim.bodies == ball][0].tolist()
        speed = math.sqrt(vx * vx + vy * vy)
        self.stops.pop(ball, None)
        if speed > 0.0:
            self.stops[ball] = self.sim.time + speed / CLOTH
        share = CLOTH / speed if speed > 0.0 else 0.0
        self.sim.set_acceleration(ball, (-share * vx, -share * vy))

    def hit(self, event: kt.Event) -> bool:
        """Sets the decelerations again; the end of the run changes, so it stops here."""
        for ball in event.bodies:
            self.brake(ball)
        return True

    def take(self, event: kt.Event) -> None:
        """Removes a ball that reaches a pocket."""
        self.stops.pop(event.bodies[0], None)
        self.sim.remove(event.bodies[0])


def play(shots: int = 10, phase: str = "cells") -> Table:
    """Returns a table after shots, each at the ball nearest to the cue ball."""
    game = Table(phase)
    for shot in range(shots):
        sim = game.sim
        balls = [ball for ball in sim.bodies.tolist() if ball <= 10]
        if CUE not in balls or len(balls) < 3:
            break
        places = sim.positions()
        way = min((place - places[0] for place in places[1 : len(balls)]), key=lambda way: way @ way)
        far = math.sqrt(way @ way)
        game.shoot(tuple((2.0 * way / far).tolist()))
        there = sum(ball <= 10 for ball in sim.bodies.tolist())
        print(f"shot {shot + 1}: {there} balls, all at rest at {sim.time:.4f}")
    return game


if __name__ == "__main__":
    print(play().sim.fingerprint[:16])
