"""A platform game: run, jump, land, and rest, with exact landings and no step that could miss a platform.

``python docs/examples/platformer.py`` plays 600 frames of a script of keys, prints each landing, and ends
with the fingerprint of all contacts. The player is a box that settles on platforms, passes ledges from below,
and passes through coins.
"""

from __future__ import annotations

import kinetile as kt

FRAME, SPEED, JUMP, GRAVITY = 1 / 60, 1.5, 3.5, -9.0
FLOOR, PLATFORMS = 0.25, [(2.0, 0.6), (3.5, 1.1), (5.0, 0.7), (6.4, 1.2)]
COINS = [(2.0, 1.1), (3.5, 1.6), (6.4, 1.7)]
KEYS = {30: "right", 55: "jump", 102: "jump", 162: "jump", 225: "jump", 264: "stop", 330: "left", 420: "jump"}
KEYS |= {478: "jump", 520: "stop"}  # up through a ledge, and onto it


def level() -> kt.Scene:
    """Returns the player, the coins and the platforms."""
    land = kt.Response("restitution", e=0.0, contact_time=1e-3, settle=0.5)
    ledge = kt.Response("restitution", **land.options, one_way=(0.0, 1.0))
    scene = kt.Scene(
        [(0.5, FLOOR + 0.2), *COINS],
        [(0.0, 0.0)] * 4,
        mass=[1.0] + [float("inf")] * 3,
        shapes=[kt.box(0.2, 0.4), kt.disc(0.08)],
        shape=[0, 1, 1, 1],
        kind=["player", "coin", "coin", "coin"],
        arena=(8.0, 4.0),
        gravity=(0.0, GRAVITY),
        responses={**land.for_all, ("player", "coin"): "pass", ("player", "ledge"): ledge},
        kinds=["player", "coin", "ground", "ledge"],
    )
    ground = [kt.Obstacle(kt.box(8.0, FLOOR), (4.0, FLOOR / 2), kind="ground")]
    ground += [kt.Obstacle(kt.box(0.8, 0.1), (x, y), kind="ledge") for x, y in PLATFORMS]
    return kt.with_obstacles(scene, ground)


def play(frames: int = 600) -> tuple[kt.Simulation, list[str]]:
    """Returns the simulation after some frames, and its messages."""
    sim, told, standing = kt.Simulation(level(), live=True), list[str](), True

    def take(event: kt.Event) -> None:
        sim.remove(event.bodies[1])
        told.append(f"{event.time:.6f} a coin")

    pace = 0.0
    for frame in range(frames):
        key = KEYS.get(frame)
        pace = {"right": SPEED, "left": -SPEED, "stop": 0.0}.get(key or "", pace)
        up = float(sim.velocities()[0, 1])
        if key is not None and (key != "jump" or standing):
            sim.set_velocity(0, (pace, JUMP if key == "jump" else up))
        sim.run(until=(frame + 1) * FRAME, on_contact={("player", "coin"): take})
        lands, standing = bool(sim.supports()[0]) and not standing, bool(sim.supports()[0])
        if lands:
            x, y = sim.positions()[0]
            told.append(f"{sim.time:.6f} stands at {x:.4f}, {y - 0.2:.4f}")
    return sim, told


if __name__ == "__main__":
    sim, told = play()
    print("\n".join(told), sim.fingerprint[:16], sep="\n")
