"""A warehouse: robots move between shelves, from crossing to crossing, and scanners see them pass.

``python docs/examples/warehouse.py`` drives 12 robots for 60 units of time. A robot takes the next crossing
only if no other robot has taken it. The run proves that this is enough: contacts are exact, and no robot
meets another or a shelf. Scanners are sensors, and their times are exact as well.
"""

from __future__ import annotations

import random
from typing import Any

import kinetile as kt

WIDTH, HEIGHT, SPEED = 8, 6, 1.0
CROSSINGS = [(x, y) for x in range(0, WIDTH + 1, 2) for y in range(0, HEIGHT + 1, 2)]
SHELVES = [
    kt.Obstacle(kt.box(1.0, 1.0), (x + 1.5, y + 1.5), kind="shelf")
    for x in range(0, WIDTH, 2)
    for y in range(0, HEIGHT, 2)
]


def hall(robots: int, rng: random.Random) -> kt.Scene:
    """Returns robots at crossings, two scanners and the shelves; a crossing is half a unit off the walls."""
    start = [(x + 0.5, y + 0.5) for x, y in rng.sample(CROSSINGS, robots)]
    scene = kt.Scene(
        [*start, (2.5, 3.5), (6.5, 3.5)],
        [(0.0, 0.0)] * (robots + 2),
        mass=[1.0] * robots + [float("inf")] * 2,
        arena=(WIDTH + 1.0, HEIGHT + 1.0),
        shapes=[kt.disc(0.375), kt.box(1.0, 0.25)],
        shape=[0] * robots + [1, 1],
        kind=["robot"] * robots + ["scanner"] * 2,
        kinds=["robot", "scanner", "shelf"],
        responses={("robot", "scanner"): "pass"},
    )
    return kt.with_obstacles(scene, SHELVES)


def drive(robots: int = 12, until: float = 60.0, seed: int = 1) -> tuple[kt.Simulation, list[Any]]:
    """Returns the simulation after its end, and (time, robot, scanner) of each scan."""
    rng, scans = random.Random(seed), list[Any]()
    sim = kt.Simulation(hall(robots, rng), live=True)
    at = {robot: tuple(int(each) for each in sim.positions()[robot]) for robot in range(robots)}
    taken, ahead = set(at.values()), dict(at)

    def scan(event: kt.Event) -> None:
        scans.append((event.time, *event.bodies))

    while sim.time < until:
        for robot, (x, y) in at.items():  # all robots are at crossings now
            free = [(x + 2, y), (x - 2, y), (x, y + 2), (x, y - 2)]
            free = [each for each in free if each in CROSSINGS and each not in taken]
            ahead[robot] = rng.choice(free) if free else (x, y)
            taken.add(ahead[robot])
            right, up = (SPEED * (b - a) / 2 for a, b in zip((x, y), ahead[robot], strict=True))
            sim.set_velocity(robot, (right, up))
        sim.run(duration=2.0 / SPEED, on_contact={("robot", "scanner"): scan})
        at, taken = dict(ahead), set(ahead.values())
    return sim, scans


if __name__ == "__main__":
    sim, scans = drive()
    pairs = [*zip(sim.kinds_of(sim.contacts["a"]), sim.kinds_of(sim.contacts["b"]), strict=True)]
    print(f"{len(scans)} scans, {sum('scanner' not in pair for pair in pairs)} other contacts")
    for time, robot, scanner in scans[:5]:
        print(f"{time:.6f} robot {robot} at scanner {scanner}")
