"""What a frame of an interactive program costs: the figures of README and docs/living-scenes.md.

``python docs/figures/frames.py [SPEED] [FRAMES]``: each frame turns some discs in one call, removes some,
inserts as many where those were, runs on for a sixtieth of a unit of time, and reads all positions and the
new contacts. Printed is the CPU time of this thread in these calls.
"""

from __future__ import annotations

import sys
import time

import numpy as np

import kinetile as kt
from kinetile.kernel.compiled import compiling_seconds

RATE, TURNED, EXCHANGED = 60, 50, 5
RING = 5.2  # radii: 64 pieces of a quarter of the radius have room beside each other


def play(sim: kt.Simulation, frames: int, speed: float = 1.0) -> list[float]:
    """Play frames on a live simulation; return the CPU milliseconds of each."""
    rng, spread = np.random.default_rng(1), speed / np.sqrt(2.0)
    radius, places, bodies, seen, spent = float(sim.scene.radius[0]), sim.positions(), sim.bodies, 0, []
    for frame in range(frames):
        drawn = rng.choice(len(bodies), TURNED + EXCHANGED, replace=False)
        flies, come = (rng.normal(0.0, spread, (n, 2)) for n in (TURNED, EXCHANGED))
        began = time.thread_time()
        sim.set_velocities(bodies[drawn[:TURNED]], flies)
        for body in bodies[drawn[TURNED:]].tolist():
            sim.remove(body)
        for place, velocity in zip(places[drawn[TURNED:]].tolist(), come.tolist(), strict=True):
            sim.insert(place, velocity, radius)
        sim.run(until=sim.scene.start + (frame + 1) / RATE)
        bodies, places = sim.bodies, sim.positions()
        seen += len(sim.contacts_since(seen))
        spent.append(1e3 * (time.thread_time() - began))
    return spent


def burst(phase: str, boxes: bool = False, pieces: int = 64, bursts: int = 60) -> list[float]:
    """Insert many small bodies at once among 1,000, remove them, run on; return the CPU milliseconds of each
    insertion."""
    scene = kt.make_scene("grid", bodies=1000, density=0.25, seed=1)
    radius, angle = float(scene.radius[0]), np.linspace(0.0, 2.0 * np.pi, pieces, endpoint=False)
    form: dict[str, object] = {"radius": radius / 4}
    if boxes:
        shapes = [kt.box(radius * side, radius * side) for side in (1.4, 0.35)]
        scene = kt.Scene(scene.position, scene.velocity, arena=scene.arena, shape=[0] * 1000, shapes=shapes)
        form = {"shape": 1}
    sim, rng, spent = kt.Simulation(scene, phase, live=True, room=2000), np.random.default_rng(1), []
    ways = np.column_stack([np.cos(angle), np.sin(angle)])
    for _ in range(bursts):
        place = np.array(scene.arena) * rng.uniform(0.2, 0.8, 2)
        began = time.thread_time()
        made = sim.insert_many(place + RING * radius * ways, ways, **form)
        spent.append(1e3 * (time.thread_time() - began))
        sim.run(until=sim.time + 1 / RATE)
        for body in made.numbers[~made.refused].tolist():
            sim.remove(body)
    return spent


if __name__ == "__main__":
    speed = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    frames = int(sys.argv[2]) if len(sys.argv) > 2 else 600
    for phase in ("cells", "sweep-tiling", "sap-1d"):
        scene = kt.make_scene("grid", bodies=1024, density=0.25, speed=speed)
        sim = kt.Simulation(scene, phase, live=True)
        sim.compile()
        before = compiling_seconds()
        spent = play(sim, frames, speed)[3:]
        print(
            f"{phase}: median {np.median(spent):.2f} ms, p99 {np.quantile(spent, 0.99):.2f}, "
            f"worst {max(spent):.1f}; {len(sim.contacts) / frames:.0f} contacts a frame, "
            f"{compiling_seconds() - before:.3g} s compiled"
        )
    for phase in ("cells", "sap-1d", "naive"):
        print(f"64 discs at once into 1,000 under {phase}: median {np.median(burst(phase)):.2f} ms")
    print(f"64 boxes at once into 1,000 under cells: median {np.median(burst('cells', True)):.2f} ms")
